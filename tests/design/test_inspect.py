"""Inspecting a mesh tells what the job would find, and what theory says."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from jobs import make_job, run
from mesh_writers import write_mesh
from meshes_shared import known_meshes
from PIL import Image

from fabweave.core.errors import CannotMakeError
from fabweave.design.inspection import facts as facts_module
from fabweave.design.inspection.facts import inspect_mesh
from fabweave.design.inspection.files import inspection_picture
from fabweave.design.inspection.text import first_rows, inspection_text
from fabweave.job.stations import Stations
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate
from fabweave.options.settings import Settings
from fabweave.ribbon.measures import thread_lengths
from fabweave.ribbon.rules.bends import measure_bends
from fabweave.ribbon.width import WidthRule

pytestmark = pytest.mark.usefixtures("quick_jobs")

slow = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize(
    ("m", "thickness_mm", "size_mm", "told"), [(12, 0.4, 50, 60), (24, 0.12, 36, None)]
)
def test_no_size_is_named_at_which_strips_are_too_narrow_for_hands(m, thickness_mm, size_mm, told):
    # Bends hold at 60 mm, with strips of 4 mm; at 37 mm strips are wide enough to cut, at 1.4 mm.
    asked = Settings.of(
        f"shape:torus?m={m}&n={m // 2}", size_mm=float(size_mm), thickness_mm=thickness_mm
    )
    (way,) = inspect_mesh(Stations(asked), answer=True).facts["advice"]
    assert way["command"] is None if told is None else f"--size {told}mm" in way["command"]


def facts_of(mesh: object, **options) -> dict:
    """Return what is told of a mesh, without trying others where it cannot be built."""
    with mock.patch.object(facts_module, "shelf", lambda search, _count: search):
        return inspect_mesh(Stations(Settings.of(str(mesh), size_mm=300.0, **options))).facts


def text_of(facts: dict) -> str:
    return "\n".join(f"{topic}: {text}" for topic, text in inspection_text(facts))


@pytest.mark.slow
def test_a_torus_is_exact_and_has_warp_and_weft() -> None:
    facts = facts_of("shape:torus?m=8&n=4")
    known = {"vertices": 32, "edges": 64, "faces": 32, "genus": 1}
    assert facts["mesh"].items() >= known.items()
    assert facts["mesh"]["face_sizes"] == facts["mesh"]["valences"] == {"4": 32}
    # 2 gcd(m, n) threads, as long together as twice the edges.
    assert facts["threads"]["count"] == facts["threads"]["closed"] == 8
    assert facts["threads"]["passes"] == {"least": 16, "median": 16, "greatest": 16}
    assert facts["threads"]["crossing_themselves"] == 0
    assert facts["bunches"] == {"count": 2, "fewest": True, "warp_and_weft": True}
    assert facts["twill"] == {"exact": True, "conditions": 6 * 64}
    # Rings of 16 crossings hold repeats of 4 and 8, and none of 3, 5 and 6.
    assert facts["fabrics"]["exact"] == ["3/1", "2/2", "satin:8/3"]
    assert set(facts["fabrics"]["because"]) == {"2/1", "3/3", "satin:5/2"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "pattern", "rotations", "reflections"),
    [
        ("shape:torus?m=8&n=3", "plain", 16, 0),
        ("shape:torus?m=8&n=3", "twill", 4, 4),
        pytest.param("shape:torus?m=24&n=12", "plain", 48, 0, marks=slow),
        pytest.param("shape:torus?m=24&n=12", "twill", 24, 0, marks=slow),
    ],
)
def test_the_symmetries_of_a_torus_are_told(mesh, pattern, rotations, reflections) -> None:
    found = (facts := facts_of(mesh, pattern=pattern))["symmetry"]
    assert found["exact"] is True
    assert found["weave"] == {"rotations": rotations, "reflections": reflections}
    # Every torus of m × n quads has 2 m rotations and as many reflections.
    m = int(mesh.partition("m=")[2].partition("&")[0])
    assert found["mesh"] == {"rotations": 2 * m, "reflections": 2 * m}
    fewest = int(np.ceil(facts["pieces"]["count"] / (rotations + reflections)))
    assert found["kinds_possible"] >= fewest


def test_what_is_symmetric_but_for_noise_is_told_as_such() -> None:
    mesh, asked = parse_shape("shape:cube"), Settings.of("cube.obj", size_mm=300.0, remesh="none")
    noise = np.random.default_rng(0).normal(size=mesh.vertices.shape)
    size = np.ptp(mesh.vertices, axis=0).max()
    told = {}
    for share in (2e-5, 1e-2):
        rough = mesh.with_vertices(mesh.vertices + share * size * noise)
        facts = inspect_mesh(Stations(asked, rough)).facts
        told[share] = facts["symmetry"]["exact"], facts["symmetry"]["weave"]["rotations"]
    assert told == {2e-5: (False, 24), 1e-2: (True, 1)}


def test_the_cube_is_exact_only_after_a_mid_edge_subdivision() -> None:
    facts = facts_of("shape:cube")
    twill = facts["twill"]
    assert twill["exact"] is False
    # Catmull-Clark and Doo-Sabin descendants of the cube are not twillable.
    assert [one["option"] for one in twill["exact_after"]] == ["refine loop:1"]
    assert twill["exact_after"][0]["crossings"] == 4 * 12
    assert twill["at_least_broken"] <= twill["voting_breaks"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(row, id=row.name, marks=slow if row.n_edges > 100 else ())
        for row in known_meshes()
        if not row.bad and row.n_edges < 1200
    ],
)
def test_real_meshes_are_what_their_table_says(mesh) -> None:
    facts = facts_of(mesh.path, remesh="none", boundary="end")
    found = facts["mesh"]
    assert (found["vertices"], found["edges"], found["faces"]) == (
        mesh.n_vertices, mesh.n_edges, mesh.n_faces,
    )  # fmt: skip
    assert found["face_sizes"] == {str(size): number for size, number in mesh.face_sizes}
    assert found["genus"] == sum(mesh.genus)
    assert found["components"] == mesh.n_components
    assert found["boundary_loops"] == mesh.n_boundary_loops
    # A strand about a corner that has one face alone crosses nothing, and is none of the threads.
    corners = np.bincount(read_mesh(mesh.path).mesh.indices)
    assert facts["threads"]["count"] == mesh.strands - np.count_nonzero(corners == 1)
    assert not re.search(r"None|[\[\]{}|]", text_of(facts))


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        Settings.of("shape:hypar?m=4&n=4", size_mm=300.0, boundary="turn", thickness_mm=2.0),
        *(
            pytest.param(settings, marks=slow)
            for settings in (
                Settings.of("shape:torus?m=8&n=4", size_mm=400.0),
                Settings.of("shape:torus?m=8&n=4", size_mm=400.0, pattern="twill",
                         max_length_mm=300.0),
                Settings.of("shape:octahedron", size_mm=200.0, pattern="triaxial",
                         width=WidthRule(0.5, 0.0, 30.0)),
                Settings.of("shape:cube", size_mm=200.0, refine="catmull-clark:1", smooth=1),
                # Its pieces repeat, so that it wants room for laps everywhere, at any size.
                Settings.of("shape:torus?m=12&n=8", size_mm=40.0, force=True),
            )
        ),
    ],
    ids=lambda settings: f"{settings.mesh.source}-{settings.weave.pattern}",
)  # fmt: skip
def test_what_is_told_is_what_is_made(settings) -> None:
    facts = inspect_mesh(Stations(settings)).facts
    job = make_job(settings.but(effort="quick"))
    assert facts["pieces"]["count"] == len(job.piece_set.pieces)
    assert facts["pieces"]["sheets"] == ["1000x700mm"]
    width = measure_bends(job.woven.ribbons).width_mm
    length = thread_lengths(job.woven.ribbons)
    spread = {"least": width.min(), "median": np.median(width), "greatest": width.max()}
    assert facts["ribbons"] == pytest.approx(spread, abs=5e-4)
    assert facts["threads"]["total_mm"] == pytest.approx(length.sum(), abs=0.05)
    told = [(one["rule"], one["size_mm"]) for one in facts["checks"]["findings"]]
    assert told == [(one.rule, one.size_mm) for one in job.check.findings]


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        Settings.of("shape:hypar?m=3&n=3", size_mm=300.0, pattern="triaxial", boundary="turn"),
        Settings.of("shape:torus?m=20&n=20", size_mm=4.0),
        Settings.of("shape:tetrahedron", size_mm=3000.0),
    ],
    ids=["hangs by one edge", "too narrow", "too large"],
)
def test_what_cannot_be_cut_is_told_before(settings) -> None:
    with pytest.raises(CannotMakeError) as error:
        make_job(settings)
    facts = inspect_mesh(Stations(settings)).facts
    assert facts["pieces"]["count"] is None
    assert facts["pieces"]["because"] == str(error.value)


@pytest.fixture(scope="module")
def split_torus(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("meshes") / "torus.obj"
    write_mesh(path, triangulate(parse_shape("shape:torus?m=8&n=4")))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("refine", [None, pytest.param("catmull-clark:1", marks=slow)])
def test_advice_holds_when_it_is_followed(split_torus, refine) -> None:
    twill = facts_of(split_torus, refine=refine, remesh="none")["twill"]
    assert twill["exact"] is False
    advice = [one["option"].split(" ") for one in twill["exact_after"]]
    assert (["remesh", "quads"] in advice) == (refine is None)
    for (option, value), one in zip(advice, twill["exact_after"], strict=True):
        after = facts_of(split_torus, **({"refine": refine} | {option: value}))
        assert after["twill"]["exact"] is True
        assert after["threads"]["crossings"] == one["crossings"]
        assert after["threads"]["count"] == one["threads"]


def test_json_is_one_document_with_the_same_facts(capsys) -> None:
    assert run("inspect", "shape:octahedron", "--size", "300mm", "--json") == 0
    told = capsys.readouterr()
    assert json.loads(told.out) == json.loads(json.dumps(facts_of("shape:octahedron")))
    assert told.err == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh", ["shape:hypar?m=3&n=3", pytest.param("shape:torus?m=8&n=4", marks=slow)]
)
def test_the_picture_shows_the_mesh_and_the_weave(mesh, tmp_path) -> None:
    assert run("inspect", mesh, "--size", "300mm", "--pattern", "twill", "--boundary", "turn",
               "--colours", "hue-range", "--png", tmp_path / "a.png") == 0  # fmt: skip
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    left, right = np.split(picture[: picture.shape[0] * 3 // 4], [picture.shape[1] // 2], axis=1)
    drawn = [np.mean(np.ptp(half, axis=2) > 40) for half in (left, right)]
    assert np.mean(left.min(axis=2) < 240) > 0.1
    # The mesh is grey as stone, the threads are coloured.
    assert drawn[0] < 0.01
    assert drawn[1] > 0.1
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


@pytest.fixture
def small_limits(monkeypatch) -> None:
    """Let 64 crossings be many."""
    for name in ("_MOST_SEARCHED", "_MOST_PRICED", "_MOST_PLANNED", "_MOST_QUICK"):
        monkeypatch.setattr(facts_module, name, 20)


@pytest.mark.slow
@pytest.mark.usefixtures("small_limits")
def test_a_large_mesh_is_answered_without_what_takes_long_and_says_so(capsys) -> None:
    whole = inspect_mesh(
        Stations(Settings.of("shape:hypar?m=6&n=6", size_mm=300.0)), thorough=True
    ).facts
    facts = facts_of("shape:hypar?m=6&n=6")
    for known in ("mesh", "bunches", "fabrics"):
        assert facts[known] == whole[known]
    for known in ("count", "closed", "crossings", "passes"):
        assert facts["threads"][known] == whole["threads"][known]
    assert facts["twill"]["exact"] == whole["twill"]["exact"]
    assert (whole["left_out"], facts["pieces"]["count"]) == ([], None)
    assert whole["pieces"]["count"] > 0
    assert facts["left_out"]
    assert ("--thorough" in text_of(facts), "--thorough" in text_of(whole)) == (True, False)
    assert run("inspect", "shape:hypar?m=6&n=6", "--size", "300mm", "--json", "--thorough") == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(whole))


@pytest.mark.usefixtures("small_limits")
def test_what_is_too_stiff_is_told_of_large_meshes_as_make_tells_it() -> None:
    settings = Settings.of("shape:torus?m=8&n=4", size_mm=20.0)
    with pytest.raises(CannotMakeError) as error:
        make_job(settings)
    assert inspect_mesh(Stations(settings)).facts["pieces"]["because"] == str(error.value)


@pytest.mark.slow
@pytest.mark.usefixtures("small_limits")
def test_a_mesh_of_middle_size_gets_its_pieces_and_the_sizes_of_single_rules(monkeypatch) -> None:
    monkeypatch.setattr(facts_module, "_MOST_PLANNED", 2000)
    settings = Settings.of(
        "shape:torus?m=8&n=4", size_mm=120.0, material="birch-veneer", rotations="free"
    )
    whole = inspect_mesh(Stations(settings), thorough=True).facts
    facts = inspect_mesh(Stations(settings)).facts
    kinds = whole["pieces"].pop("kinds")  # known where pieces are built
    assert kinds > 0
    assert facts["pieces"] == whole["pieces"]
    quick, full = (
        {found["rule"]: found for found in one["checks"]["findings"]} for one in (facts, whole)
    )
    assert set(quick) == set(full)
    alike = [rule for rule in full if rule in ("bend", "width", "crease")]
    assert alike
    for rule in alike:
        assert 120 < quick[rule]["size_mm"] <= full[rule]["size_mm"]
    assert facts["left_out"]


def test_the_mesh_is_told_first_and_then_all_the_rest() -> None:
    told: list[dict] = []
    found = inspect_mesh(
        Stations(Settings.of("shape:octahedron", size_mm=300.0)),
        told=lambda facts: told.append(dict(facts)),
    )
    first, rest = told
    assert set(first) == {"mesh", "notes"}
    assert rest == found.facts
    assert rest["mesh"] == first["mesh"]
    rows = inspection_text(found.facts)
    assert rows[: len(first_rows(first))] == first_rows(first)
    assert [topic for topic, _ in rows[:2]] == ["mesh", "buildable"]
    (way,) = found.facts["advice"]
    assert shlex.split(way["command"])[:3] == ["fabweave", "make", "shape:octahedron"]


@slow
def test_designs_from_coarse_to_fine_are_told_and_shown(tmp_path) -> None:
    mesh = tmp_path / "ball.obj"
    write_mesh(mesh, parse_shape("shape:sphere?n=4&radius=50"))
    found = inspect_mesh(Stations(Settings.of(str(mesh))), n_designs=3, looks=True)
    told = found.facts["designs"]
    assert [one.name for one in found.designs] == [design["name"] for design in told]
    # Its own mesh was tried before.
    names = [design["name"] for design in told if design["name"] != "as asked"]
    asked = [int(name.split(":")[1]) for name in names]
    assert asked == sorted(asked)
    assert len(told) == 3
    alone = inspection_picture(replace(found, designs=()))
    shown = inspection_picture(found)
    assert shown.width >= alone.width
    # The pictures of the designs are below, beside one another, and none is blank.
    below = np.asarray(shown)[alone.height :]
    for third in np.array_split(below, 3, axis=1):
        assert (third != 255).any(axis=-1).mean() > 0.1
    assert shown.height > alone.height + 500
