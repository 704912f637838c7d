"""Jobs in every pattern are made and proved, and what they claim cannot be spoiled unseen."""

import json
import tomllib
from collections import Counter
from itertools import product

import numpy as np
import pytest
from jobs import run
from mesh_writers import write_mesh
from meshes_shared import shared_mesh
from spoiling import drop, edit_json, more, put

from fabweave.job.stations import Stations
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate
from fabweave.verify.measure.walks import trace_walks
from fabweave.verify.proof import verify_job
from fabweave.verify.read.mesh import read_obj

pytestmark = pytest.mark.usefixtures("quick_jobs")

slow = pytest.mark.slow
TURN = ("--boundary", "turn")


def words(mesh, pattern, *options):
    # Small sheets are nested on sooner, and few of them are written sooner.
    return (mesh, "--size", "200mm", "--sheet", "600x400mm", "--effort", "quick",
            "--pattern", pattern, *options)  # fmt: skip


def plan_of(folder):
    return json.loads((folder / "crossing_map.json").read_text())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "pattern", "options"),
    [
        ("shape:tube?m=4&n=4", "twill", TURN),
        ("shape:tetrahedron", "triaxial", ()),
        pytest.param("shape:slit?genus=2&m=12&n=4", "twill", ("--force",), marks=slow),
        pytest.param("shape:regular?face=8&valence=4&genus=3&refine=2", "twill", (), marks=slow),
        pytest.param("shape:tube?m=8&n=6", "twill", TURN, marks=slow),
        pytest.param("shape:tetrahedron", "triaxial", ("--refine", "catmull-clark:1"), marks=slow),
        pytest.param("shape:torus?m=4&n=3", "triaxial", ("--force",), marks=slow),
        pytest.param("shape:tube?m=4&n=2", "triaxial", TURN, marks=slow),
        pytest.param("quad/catmark_torus.obj", "twill", (), marks=slow),
        pytest.param("open/tubemesh.off", "twill", (), marks=slow),
    ],
)
def test_exact_twills_are_made_and_proved(mesh, pattern, options, finished):
    mesh = mesh if mesh.startswith("shape:") else shared_mesh(mesh)
    weave = plan_of(finished(*words(mesh, pattern, *options)))["weave"]
    assert (weave["pattern"], weave["exact"]) == (pattern, True)
    assert weave["broken"] == {"edge": 0, "face": 0, "vertex": 0}
    assert "voted" not in weave


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "pattern", "ups", "size"),
    [
        ("shape:hypar?m=5&n=5", "sateen:5/2", 1, 5),
        pytest.param("shape:torus?m=6&n=3", "2/1", 2, 3, marks=slow),
        pytest.param("shape:torus?m=4&n=4", "2/2", 2, 4, marks=slow),
        pytest.param("shape:torus?m=5&n=5", "satin:5/2", 4, 5, marks=slow),
        *(
            pytest.param("shape:torus?m=4&n=4", named, 3, 4, marks=slow)
            for named in ("3/1", "3/1/1", "3/1/-1")
        ),
    ],
)
def test_fabrics_are_made_and_proved(mesh, pattern, ups, size, finished):
    plan = plan_of(finished(*words(mesh, pattern)))
    assert (plan["weave"]["pattern"], plan["weave"]["exact"]) == (pattern, True)
    warp = set(plan["weave"]["warp"])
    over = {True: [], False: []}
    for thread in plan["threads"]:
        over[thread["id"] in warp] += thread["over"]
    if all(thread["closed"] for thread in plan["threads"]):
        # Round a torus every thread repeats its sequence a whole number of times.
        assert sum(over[True]) * size == ups * len(over[True])
        assert sum(over[False]) * size == (size - ups) * len(over[False])


def run_one_warp_thread_the_other_way(plan):
    # Its labels step by one all along, but its neighbours run apart from it.
    weave = plan["weave"]
    number = {crossing["id"]: at for at, crossing in enumerate(plan["crossings"])}
    for key in plan["threads"][weave["warp"][0]]["crossings"]:
        weave["labels"][number[key]] = -weave["labels"][number[key]] % 4


def take_the_weft_for_the_warp(plan):
    warp = plan["weave"]["warp"]
    plan["weave"]["warp"] = [one["id"] for one in plan["threads"] if one["id"] not in warp]


def next_label(label):
    return (label + 1) % 4


BALL = ("shape:sphere?n=2", "twill")
DENIM = ("shape:torus?m=4&n=4", "3/1")
#: Of which job the map is spoiled, and how; each is not what it claims any more.
SPOILS = [
    *[(BALL, put("weave", "broken", kind, more(1))) for kind in ("edge", "face", "vertex")],
    (DENIM, put("weave", "labels", 0, next_label)),
    (DENIM, put("weave", "labels", lambda labels: list(map(next_label, labels)))),
    (DENIM, drop("weave", "labels", -1)),
    (DENIM, drop("weave", "labels")),
    (DENIM, drop("weave", "warp", -1)),
    (DENIM, take_the_weft_for_the_warp),
    (DENIM, put("weave", "warp", lambda warp: [*warp, 999])),
    (DENIM, put("weave", "pattern", "2/2")),
    (DENIM, put("weave", "pattern", "3/1/2")),  # it falls apart
    (DENIM, run_one_warp_thread_the_other_way),
    ((DENIM[0], "3/1/-1"), put("weave", "pattern", "3/1/1")),
    ((DENIM[0], "3/1/1"), put("weave", "pattern", "3/1/-1")),
]
#: A satin over 3 under 1 with shift 3 steps by -1 along the warp: only a name for 3/1.
ANOTHER_NAME = put("weave", "pattern", "satin:4/3")


@slow
@pytest.mark.parametrize(("job", "spoil"), [*SPOILS, (DENIM, ANOTHER_NAME)])
def test_a_spoiled_weave_is_found_out(job, spoil, finished, tmp_path):
    folder = finished.copy(tmp_path / "out", *words(*job))
    edit_json(folder / "crossing_map.json", spoil)
    objecting = {"seal"} if spoil is ANOTHER_NAME else {"pattern", "seal"}
    assert set(verify_job(folder).failed) == objecting


@slow
def test_an_optimised_twill_says_how_good_it_is(finished):
    weave = plan_of(finished(*words(*BALL)))["weave"]
    assert weave["exact"] is False
    assert sum(weave["broken"].values()) == weave["at_least_broken"] == 16


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "threads", "crossings"),
    [
        ("shape:hypar?m=2&n=2", 2, 4),
        ("shape:tube?m=5&n=1", 1, 5),
        pytest.param("shape:hypar?m=5&n=4", 1, 31, marks=slow),
        pytest.param("shape:tube?m=6&n=3", 6, 30, marks=slow),
    ],
)
def test_threads_that_turn_back_are_made_and_proved(mesh, threads, crossings, finished):
    plan = plan_of(finished(*words(mesh, "plain", *TURN)))
    assert [thread["closed"] for thread in plan["threads"]] == [True] * threads
    assert sum(len(thread["crossings"]) for thread in plan["threads"]) == 2 * crossings
    for thread in plan["threads"]:
        over = np.array(thread["over"])
        assert np.all(over != np.roll(over, 1))
    assert len(plan["joints"]) == len(plan["pieces"])  # rings only


@pytest.mark.slow
@pytest.mark.parametrize("claim", ['boundary = "end"', ""])
def test_verify_goes_by_what_was_asked_of_boundaries(claim, finished, tmp_path):
    folder = finished.copy(tmp_path / "spoiled", *words("shape:hypar?m=6&n=4", "plain", *TURN))
    walks = trace_walks(read_obj(folder / "woven_mesh.obj"), turning=True)
    lengths = sorted(len(thread["crossings"]) for thread in plan_of(folder)["threads"])
    assert sorted(len(walk.passes) for walk in walks) == lengths == [38, 38]
    text = (folder / "job.toml").read_text()
    assert 'boundary = "turn"\n' in text
    (folder / "job.toml").write_text(text.replace('boundary = "turn"', claim))
    assert verify_job(folder).failed == ("seal", "mesh-walks", "pattern", "space")


def test_a_face_by_itself_is_left_out(tmp_path):
    # Two meshes in one: a mat of two by two squares, and a square by itself.
    points = [*product(range(3), range(3)), *product((5, 6), (0, 1))]
    faces = [(4, 5, 2, 1), (5, 6, 3, 2), (7, 8, 5, 4), (8, 9, 6, 5), (12, 13, 11, 10)]
    lines = [f"v {x} {y} 0" for x, y in points] + [f"f {a} {b} {c} {d}" for a, b, c, d in faces]
    (tmp_path / "two.obj").write_text("\n".join(lines) + "\n")
    out = tmp_path / "out"
    assert run("make", *words(tmp_path / "two.obj", "plain", *TURN), "-q", "-o", out) == 0
    count = Counter(len(thread["crossings"]) for thread in plan_of(out)["threads"])
    assert count == {4: 2, 0: 1}


@pytest.mark.parametrize(
    ("mesh", "pattern", "options"),
    [
        ("shape:torus?m=7&n=5", "3/1", ()),
        ("shape:hypar?m=3&n=1", "plain", TURN),
        ("shape:cube", "satin:5/2", ()),
        ("shape:hypar?m=1&n=1", "plain", TURN),
        # More edges than can be woven are refused at once.
        pytest.param("shape:torus?m=2000&n=2000", "triaxial", (), marks=pytest.mark.slow),
        pytest.param("shape:sphere?n=700", "triaxial", (), marks=pytest.mark.slow),
    ],
)
def test_what_cannot_be_woven_is_refused(mesh, pattern, options, tmp_path, capsys):
    assert run("make", *words(mesh, pattern, *options), "-q", "-o", tmp_path / "out") == 1
    assert capsys.readouterr().err.startswith("fabweave: ")
    assert list(tmp_path.iterdir()) == []


@slow
def test_remeshed_and_refined_jobs_have_the_size_that_was_asked_for(tmp_path):
    write_mesh(tmp_path / "torus.obj", triangulate(parse_shape("shape:torus?m=4&n=4")))
    options = ("--remesh", "quads", "--refine", "simplest:1", "--size", "250mm")
    out = tmp_path / "out"
    assert run("make", *words(tmp_path / "torus.obj", "twill", *options), "-q", "-o", out) == 0
    # 16 quads, each with two crossings, and twice as many after a step.
    assert len(plan_of(out)["crossings"]) == 64
    lines = (out / "woven_mesh.obj").read_text().splitlines()
    vertices = np.loadtxt([line[2:] for line in lines if line.startswith("v ")])
    assert np.ptp(vertices, axis=0).max() == pytest.approx(250.0)
    assert tomllib.loads((out / "job.toml").read_text())["job"]["refine"] == "simplest:1"


@pytest.mark.parametrize(
    ("shape", "options", "turns"),
    [
        ("hypar?m=4&n=4", {}, True),
        ("hypar?m=4&n=4", {"pattern": "twill"}, True),
        ("tube?m=8&n=4", {"pattern": "3/1"}, False),
        ("tube?m=8&n=4", {"material": "warp=card,weft=birch-veneer"}, False),
        ("hypar?m=4&n=4", {"boundary": "end"}, False),
        ("torus?m=8&n=4", {}, False),
        # Its corners hang by two edges each; those of one row by one.
        ("hypar?m=4&n=1", {}, False),
    ],
)
def test_threads_turn_back_where_nothing_forbids_it(shape, options, turns):
    job = Stations.read(f"shape:{shape}", {"size": "300mm", **options})
    assert bool(len(job.weave.weave.threads.turn_pass)) == turns
    # What was taken is kept, so that the same is made again.
    assert job.settled[0].weave.boundary == ("turn" if turns else "end")


def test_a_job_that_was_straight_turns_when_it_is_wavy():
    straight = Stations.read("shape:hypar?m=4&n=4", {"size": "300mm", "strips": "straight"})
    assert not len(straight.weave.weave.threads.turn_pass)
    wavy = straight.instead(straight.asked.but(strips="wavy"))
    assert len(wavy.weave.weave.threads.turn_pass)


def test_what_a_model_is_remeshed_to_stays_while_nothing_that_it_depends_on_changes():
    job = Stations.read("shape:tube?m=24&n=12", {"size": "200mm", "remesh": "grid:40"})
    first, asked = job.loaded.remeshed, job.asked
    for same in ({"thickness_mm": 0.8}, {"material": "birch-veneer"}, {"fair": 3}):
        other = job.instead(asked.but(**same))
        assert "loaded" not in vars(other)
        assert other.loaded.remeshed is first
        fresh = Stations(other.asked).loaded
        assert np.array_equal(fresh.mesh.vertices, other.loaded.mesh.vertices)
        # It stays known through a change that leaves the mesh, before it is loaded again.
        again = job.instead(asked.but(**same)).instead(asked.but(**same, gap_mm=3.0))
        assert again.loaded.remeshed is first
    for new in ({"remesh": "grid:80"}, {"size_mm": 300.0}, {"seed": 7}, {"remesh": None}):
        assert job.instead(asked.but(**new)).loaded.remeshed is not first
