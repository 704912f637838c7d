"""The code on a sheet is proved: a dot too few, a command that makes something else."""

import json
import re
import shutil

import ezdxf
import pytest
from jobs import OCTAHEDRON

from fabweave.verify.checks.sheets.qr_code import check_code
from fabweave.verify.read.job_files import load_job
from fabweave.verify.statement import Tally


@pytest.fixture(scope="module")
def made(finished):
    return finished(*OCTAHEDRON)


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "job")


def found(folder) -> str:
    tally = Tally("code")
    check_code(load_job(folder, Tally("files")), tally)
    return " | ".join(tally.result().findings)


def change_map(folder, change) -> None:
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    change(plan)
    path.write_text(json.dumps(plan))


def test_a_true_code_passes(made) -> None:
    assert found(made) == ""
    plan = json.loads((made / "crossing_map.json").read_text())
    assert plan["sheets"][0]["code"]["dot_mm"] >= 0.6
    assert plan["cut"]["code"].startswith("fabweave make shape:octahedron --size 90mm")


def change_code(old, new):
    def change(plan) -> None:
        assert old in plan["cut"]["code"]
        plan["cut"]["code"] = plan["cut"]["code"].replace(old, new)

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (change_code("90mm", "95mm"), "it says size 95mm, and job.toml '90mm'"),
        (
            change_code("90mm", "95mm"),
            "what the code says is 'fabweave make shape:octahedron --size 90mm",
        ),
        (change_code("octahedron", "cube"), "should be ['shape:octahedron'], as in job.toml"),
        (change_code(" -o", " --strict -o"), "it says strict, and job.toml False"),
        (change_code("fabweave make", "rm"), "its command is ['rm', "),
        (change_code("-o", "# sha256"), "its digest is 'again"),
        (lambda plan: plan["cut"].pop("code"), "what it says is not stated"),
        (lambda plan: plan["sheets"][0].update(code=None), "and dots [] mm"),
        (lambda plan: plan["sheets"][0]["code"].update(x_mm=100.0), "the code cannot be read"),
        (lambda plan: plan["sheets"][0]["code"].update(dot_mm=0.5), "and dots [0.5] mm"),
        (lambda plan: plan["sheets"][0]["code"].update(x_mm=1.0), "the code leaves the sheet"),
    ],
)
def test_a_map_that_says_something_else_is_found(job, change, words) -> None:
    change_map(job, change)
    assert words in found(job)


def test_a_digest_is_held_to_the_settings(job) -> None:
    path = job / "job.toml"
    digest = "fabweave make --config job.toml -o again # sha256 0123456789abcdef"
    change_map(job, lambda plan: plan["cut"].update(code=digest))
    assert "its digest is '0123456789abcdef'" in found(job)
    true = re.findall("should be '([0-9a-f]{16})'", found(job))[0]
    change_map(job, lambda plan: plan["cut"].update(code=digest.replace("0123456789abcdef", true)))
    assert "digest" not in found(job)
    path.write_text(path.read_text().replace("seed = 0", "seed = 1"))
    assert "digest" in found(job)


def drop_a_line(space, lines) -> None:
    space.delete_entity(lines[40])


def shift_a_line(space, lines) -> None:  # noqa: ARG001 - as the others
    lines[40].dxf.start = lines[40].dxf.start + ezdxf.math.Vec3(0.05, 0.0)


def add_a_line(space, lines) -> None:
    middle = lines[40].dxf.start
    space.add_line(middle, middle + ezdxf.math.Vec3(3.0, 3.0), dxfattribs={"layer": "NOTES"})


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (drop_a_line, "the code cannot be read"),
        (shift_a_line, "the code cannot be read"),
        (add_a_line, "the code overlaps LINE"),
    ],
)
def test_a_spoilt_code_is_found(job, spoil, words) -> None:
    path = job / "sheets" / "sheet_01.dxf"
    document = ezdxf.readfile(path)
    space = document.modelspace()
    plan = json.loads((job / "crossing_map.json").read_text())
    code = plan["sheets"][0]["code"]
    low = ezdxf.math.Vec2(code["x_mm"], code["y_mm"])
    box = ezdxf.math.BoundingBox2d([low, low + ezdxf.math.Vec2(29, 29) * code["dot_mm"]])
    lines = [e for e in space.query("LINE") if box.inside(e.dxf.start) and box.inside(e.dxf.end)]
    assert {e.dxf.layer for e in lines} == {"NOTES"}
    spoil(space, lines)
    document.saveas(path)
    assert words in found(job)


def test_a_piece_on_the_code_is_found(job) -> None:
    def move(plan) -> None:
        code = plan["sheets"][0]["code"]
        piece = plan["pieces"][0]
        piece["placement"].update(rotation_deg=0.0, x_mm=0.0, y_mm=0.0)
        x, y = piece["outline"][0]
        piece["placement"].update(x_mm=code["x_mm"] + 3.0 - x, y_mm=code["y_mm"] + 3.0 - y)

    change_map(job, move)
    assert "the code overlaps A1" in found(job)


def test_lines_as_wide_as_no_dot_are_found(job) -> None:
    path = job / "sheets" / "sheet_01.svg"
    text = path.read_text()
    path.write_text(re.sub('(id="wide.note"[^>]*stroke-width=)"[^"]*"', '\\1"0.3"', text))
    assert "lines of NOTES are [0.3" in found(job)
