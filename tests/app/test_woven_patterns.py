"""Jobs in every pattern are made and proved, and what they claim cannot be spoiled unseen."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jobs import run
from meshes_shared import shared_mesh

from fabweave.app.settings import Settings
from fabweave.core.errors import InputError
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate
from fabweave.verify import verify_job


def words(mesh: object, pattern: str, *options: str) -> tuple[object, ...]:
    # Small sheets are nested on sooner, and few of them are written sooner.
    return (mesh, "--size", "200mm", "--sheet", "600x400mm", "--effort", "quick",
            "--pattern", pattern, *options)  # fmt: skip


def make(mesh: object, pattern: str, folder: Path, *options: str) -> int:
    return run("make", *words(mesh, pattern, *options), "-q", "-o", folder)


def plan_of(folder: Path) -> dict:
    return json.loads((folder / "crossing_map.json").read_text())


slow = pytest.mark.slow
NONE_BROKEN = {"edge": 0, "face": 0, "vertex": 0}


@pytest.mark.parametrize(
    ("mesh", "pattern", "options"),
    [
        ("shape:tube?m=4&n=4", "twill", ("--boundary", "turn")),
        ("shape:tetrahedron", "triaxial", ()),
        pytest.param("shape:slit?genus=2&m=12&n=4", "twill", ("--force",), marks=slow),
        pytest.param("shape:regular?face=8&valence=4&genus=3&refine=2", "twill", (), marks=slow),
        pytest.param("shape:tube?m=8&n=6", "twill", ("--boundary", "turn"), marks=slow),
        pytest.param("shape:tetrahedron", "triaxial", ("--refine", "catmull-clark:1"), marks=slow),
        pytest.param("shape:torus?m=4&n=3", "triaxial", ("--force",), marks=slow),
        pytest.param("shape:tube?m=4&n=2", "triaxial", ("--boundary", "turn"), marks=slow),
    ],
)
def test_exact_twills_are_made_and_proved(mesh, pattern, options, finished) -> None:
    weave = plan_of(finished(*words(mesh, pattern, *options)))["weave"]
    assert weave["pattern"] == pattern
    assert weave["exact"] is True
    assert weave["broken"] == NONE_BROKEN
    assert "voted" not in weave


@slow
@pytest.mark.parametrize("name", ["quad/catmark_torus.obj", "open/tubemesh.off"])
def test_real_meshes_are_woven_in_twill(name, finished) -> None:
    weave = plan_of(finished(*words(shared_mesh(name), "twill")))["weave"]
    assert weave["exact"] is True
    assert weave["broken"] == NONE_BROKEN


@pytest.fixture(scope="module")
def ball(finished) -> Path:
    return finished(*words("shape:sphere?n=2", "twill"))


@pytest.mark.slow
def test_an_optimised_twill_says_how_good_it_is(ball) -> None:
    weave = plan_of(ball)["weave"]
    assert weave["exact"] is False
    assert sum(weave["broken"].values()) == weave["at_least_broken"] == 16
    notes = (ball / "job.toml").read_text()
    assert "which is proved to be the least" in notes
    assert "vertex 0 has valence 3; in all, 8 vertices" in notes


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["edge", "face", "vertex"])
def test_broken_conditions_are_recounted(ball, kind, tmp_path) -> None:
    spoiled = tmp_path / "out"
    shutil.copytree(ball, spoiled)
    plan = plan_of(spoiled)
    plan["weave"]["broken"][kind] += 1
    (spoiled / "crossing_map.json").write_text(json.dumps(plan))
    failed = {check.name for check in verify_job(spoiled).checks if not check.ok}
    assert failed == {"pattern", "seal"}


def require_fabric(folder: Path, pattern: str, ups: int, size: int) -> None:
    plan = plan_of(folder)
    assert plan["weave"]["pattern"] == pattern
    assert plan["weave"]["exact"] is True
    warp = set(plan["weave"]["warp"])
    over = {True: [], False: []}
    for thread in plan["threads"]:
        over[thread["id"] in warp] += thread["over"]
    if all(thread["closed"] for thread in plan["threads"]):
        # Round a torus every thread repeats its sequence a whole number of times.
        assert sum(over[True]) * size == ups * len(over[True])
        assert sum(over[False]) * size == (size - ups) * len(over[False])


@pytest.mark.parametrize(
    ("mesh", "pattern", "ups", "size"),
    [
        ("shape:hypar?m=5&n=5", "sateen:5/2", 1, 5),
        pytest.param("shape:torus?m=6&n=3", "2/1", 2, 3, marks=slow),
        pytest.param("shape:torus?m=4&n=4", "2/2", 2, 4, marks=slow),
        pytest.param("shape:torus?m=5&n=5", "satin:5/2", 4, 5, marks=slow),
    ],
)
def test_fabrics_are_made_and_proved(mesh, pattern, ups, size, finished) -> None:
    require_fabric(finished(*words(mesh, pattern)), pattern, ups, size)


@pytest.fixture(scope="module")
def denim(finished) -> Path:
    return finished(*words("shape:torus?m=4&n=4", "3/1"))


@pytest.mark.slow
def test_denim_is_a_fabric(denim) -> None:
    require_fabric(denim, "3/1", 3, 4)


@pytest.mark.slow
@pytest.mark.parametrize(("named", "mirrored"), [("3/1/-1", "3/1/1"), ("3/1/1", "3/1/-1")])
def test_the_hand_of_a_named_shift_is_proved(named, mirrored, finished, tmp_path) -> None:
    folder = finished(*words("shape:torus?m=4&n=4", named))
    require_fabric(folder, named, 3, 4)
    renamed = tmp_path / "out"
    shutil.copytree(folder, renamed)
    plan = plan_of(renamed)
    plan["weave"]["pattern"] = mirrored
    (renamed / "crossing_map.json").write_text(json.dumps(plan))
    failed = verify_job(renamed)
    assert "pattern" in failed.failed
    side = "left" if mirrored == "3/1/1" else "right"
    said = [finding for check in failed.checks for finding in check.findings]
    assert any(f"its diagonal rises to the {side}" in str(finding) for finding in said)


def change_one_label(weave, _plan) -> None:
    weave["labels"][5] = (weave["labels"][5] + 1) % 4


def shift_all_labels(weave, _plan) -> None:
    weave["labels"] = [(label + 1) % 4 for label in weave["labels"]]


def drop_a_label(weave, _plan) -> None:
    weave["labels"].pop()


def forget_the_labels(weave, _plan) -> None:
    del weave["labels"]


def leave_a_thread_out_of_the_warp(weave, _plan) -> None:
    weave["warp"].pop()


def take_the_weft_for_the_warp(weave, plan) -> None:
    weave["warp"] = [t["id"] for t in plan["threads"] if t["id"] not in weave["warp"]]


def name_a_thread_that_is_not_there(weave, _plan) -> None:
    weave["warp"].append(999)


def claim_another_twill(weave, _plan) -> None:
    weave["pattern"] = "2/2"


def claim_a_satin(weave, _plan) -> None:
    weave["pattern"] = "satin:4/3"


def claim_a_fabric_that_falls_apart(weave, _plan) -> None:
    weave["pattern"] = "3/1/2"


def run_one_warp_thread_the_other_way(weave, plan) -> None:
    # Its labels step by one all along, but its neighbours run apart from it.
    number = {crossing["id"]: at for at, crossing in enumerate(plan["crossings"])}
    thread = plan["threads"][weave["warp"][0]]
    for key in thread["crossings"]:
        weave["labels"][number[key]] = -weave["labels"][number[key]] % 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "spoil",
    [
        change_one_label,
        shift_all_labels,
        drop_a_label,
        forget_the_labels,
        leave_a_thread_out_of_the_warp,
        take_the_weft_for_the_warp,
        name_a_thread_that_is_not_there,
        claim_another_twill,
        claim_a_fabric_that_falls_apart,
        run_one_warp_thread_the_other_way,
    ],
)
def test_a_spoiled_fabric_is_found_out(denim, spoil, tmp_path) -> None:
    spoiled = tmp_path / "out"
    shutil.copytree(denim, spoiled)
    plan = plan_of(spoiled)
    spoil(plan["weave"], plan)
    (spoiled / "crossing_map.json").write_text(json.dumps(plan))
    failed = {check.name for check in verify_job(spoiled).checks if not check.ok}
    assert failed == {"pattern", "seal"}


def test_the_other_hand_of_a_twill_is_the_same_weave_walked_the_other_way(denim, tmp_path) -> None:
    # A satin over 3 under 1 with shift 3 steps by -1 along the warp: only a name for 3/1.
    renamed = tmp_path / "out"
    shutil.copytree(denim, renamed)
    plan = plan_of(renamed)
    claim_a_satin(plan["weave"], plan)
    (renamed / "crossing_map.json").write_text(json.dumps(plan))
    assert verify_job(renamed).failed == ("seal",)


@pytest.mark.parametrize(
    ("mesh", "pattern", "code", "message"),
    [
        ("shape:torus?m=7&n=5", "3/1", 1, "are not a multiple of 4"),
        ("shape:cube", "satin:5/2", 1, "warp and weft do not exist"),
        ("shape:cube", "herringbone", 2, "there is no pattern 'herringbone'"),
        ("shape:cube", "3/0", 2, "over 1 or more and under 1 or more"),
        ("shape:cube", "satin:6/2", 2, "no common divisor"),
    ],
)
def test_what_cannot_be_woven_says_why(mesh, pattern, code, message, tmp_path, capsys) -> None:
    assert make(mesh, pattern, tmp_path / "out") == code
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_remeshed_and_refined_jobs_say_what_was_done(tmp_path) -> None:
    mesh = triangulate(parse_shape("shape:torus?m=4&n=4"))
    write_mesh(tmp_path / "torus.obj", mesh)
    options = ("--remesh", "quads", "--refine", "simplest:1", "--size", "250mm")
    assert make(tmp_path / "torus.obj", "twill", tmp_path / "out", *options) == 0
    notes = (tmp_path / "out" / "job.toml").read_text()
    assert "remeshed to quads (pairing), refined by simplest:1: 32 vertices, 64 edges" in notes
    mesh = np.loadtxt(
        [line[2:] for line in (tmp_path / "out" / "woven_mesh.obj").read_text().splitlines()
         if line.startswith("v ")]
    )  # fmt: skip
    assert np.ptp(mesh, axis=0).max() == pytest.approx(250.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--refine", "butterfly:2"), "there is no refinement 'butterfly'"),
        (("--refine", "catmull-clark:x"), "should read catmull-clark:STEPS"),
        (("--remesh", "triangles:5"), "from 8 to 100000 triangles"),
        (("--remesh", "hexagons:5"), "quads"),
    ],
)
def test_wrong_remeshing_is_said_before_anything_is_done(
    options, message, tmp_path, capsys
) -> None:
    assert make("shape:cube", "plain", tmp_path / "out", *options) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_weave_and_so_do_its_settings(finished, tmp_path) -> None:
    again = tmp_path / "again"
    first = finished(*words("shape:octahedron", "twill", "--seed", "7", "--size", "90mm"))
    assert run("make", "--config", first / "job.toml", "-q", "-o", again) == 0
    maps = [(folder / "crossing_map.json").read_bytes() for folder in (first, again)]
    assert maps[0] == maps[1]


@pytest.mark.parametrize("name", ["boundary", "effort", "colours", "dxf"])
def test_settings_from_python_are_checked_too(name) -> None:
    with pytest.raises(InputError, match=f"{name}: 'sideways' is not one of"):
        replace(Settings(mesh="shape:cube"), **{name: "sideways"})


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh", ["shape:torus?m=2000&n=2000", pytest.param("shape:sphere?n=700", marks=slow)]
)
def test_more_edges_than_can_be_woven_are_refused_at_once(mesh, tmp_path, capsys) -> None:
    assert make(mesh, "triaxial", tmp_path / "out") == 1
    assert "at most 2000000 can be woven" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
