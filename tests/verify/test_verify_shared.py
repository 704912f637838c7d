"""Sheets that jobs share: every piece of every job once, or the proof objects."""

import shutil

import pytest
from spoiling import drop, edit_json, exchange, more, put

import fabweave as fw

pytestmark = pytest.mark.usefixtures("quick_jobs")

COMMON = {"size": "90mm", "effort": "quick", "kerf": "0.15mm", "spares": 1}


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batch") / "two"
    jobs = {name: {"mesh": f"shape:{name}", **COMMON} for name in ("octahedron", "tetrahedron")}
    (queue,) = fw.batch(jobs, folder, together=True).together
    proof = fw.verify(queue)
    assert proof.ok, proof.failed
    assert "shared" in {check.name for check in proof.checks}
    return folder


def spoilt(batch, tmp_path):
    folder = shutil.copytree(batch, tmp_path / "copy")
    (queue,) = (folder / "together").iterdir()
    return folder, queue


PIECE = ("pieces", 0)


def again(pieces):
    return [*pieces, pieces[-1]]


@pytest.mark.parametrize(
    ("change", "check"),
    [
        (put(*PIECE, "placement", "x_mm", more(0.05)), "outlines-dxf"),
        (put(*PIECE, "placement", "x_mm", more(0.05)), "outlines-svg"),
        (put(*PIECE, "placement", "x_mm", more(0.05)), "cut"),
        (put(*PIECE, "placement", "x_mm", more(-900.0)), "sheets"),
        (put(*PIECE, "sheet", 99), "sheets"),
        (put(*PIECE, "piece", "Z9"), "files"),
        (put(*PIECE, "job", 9), "files"),
        (put(*PIECE, "job", 2), "shared"),
        (put(*PIECE, "id", "1Z9"), "shared"),
        (drop(*PIECE), "shared"),
        (drop(*PIECE), "outlines-dxf"),
        (put("pieces", again), "shared"),
        (exchange("pieces", 0, 1), None),
        (drop("jobs", 1), "shared"),
        (put("jobs", 0, "number", 2), "shared"),
        (put("jobs", 0, "name", "../two/octahedron"), "files"),
        (put("jobs", 0, "crossing_map", "0" * 64), "files"),
        (put("material", "felt"), "shared"),
        (put("together", "sheets", more(1)), "shared"),
        (put("one_by_one", "waste_mm2", more(1.0)), "shared"),
        (put("layout", "gap_mm", more(1.0)), "materials"),
        (put("sheets", 0, "width_mm", more(-100.0)), "stock"),
        (put("cut", "preset", "glowforge"), "colours"),
        (put("schema", "fabweave.queue/2"), "files"),
    ],
)
def test_what_the_queue_says_is_held_to_the_jobs_and_the_drawings(change, check, batch, tmp_path):
    _, queue = spoilt(batch, tmp_path)
    edit_json(queue / "queue.json", change)
    failed = set(fw.verify(queue).failed) - {"seal"}
    assert check in failed if check else not failed


@pytest.mark.parametrize(
    ("name", "edit", "check"),
    [
        ("octahedron/crossing_map.json", lambda text: text + " ", "files"),
        (
            "octahedron/job.toml",
            lambda text: text.replace('kerf = "0.15mm"', 'kerf = "0.1mm"'),
            "files",
        ),
        ("pieces.csv", lambda text: text.rpartition("\n1")[0], "shared"),
        ("sheets/sheet_01.svg", lambda _: None, "files"),
        ("sheets/sheet_09.dxf", lambda _: "", "files"),
        ("cut/sheet_01_kerf0.15mm.dxf", lambda _: None, "files"),
        ("sheets/sheet_01.dxf", lambda text: text.replace("\n1A1\n", "\n2A1\n"), "outlines-dxf"),
    ],
)
def test_files_of_the_queue_and_of_its_jobs_are_held_to_it(name, edit, check, batch, tmp_path):
    folder, queue = spoilt(batch, tmp_path)
    path = (folder if name.startswith("octahedron") else queue) / name
    text = edit(path.read_text() if path.exists() else "")
    path.unlink() if text is None else path.write_text(text)
    assert check in fw.verify(queue).failed
