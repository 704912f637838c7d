"""Spoil, cut short or take away single files: the checks that must object do, and no other."""

import json
import random
import shutil

import pytest
from sealing import told, verify_job
from slow import slow_but
from spoiling import drop, edit_json, exchange, more, put
from verify_writers import glb_bytes, write_mesh

from fabweave.verify.report import MEANINGS

#: Without the map nothing can be checked but the mesh, and what job.toml says came out, which is
#: left alone then.
MAP_CHECKS = " ".join(name for name in MEANINGS if name not in ("seal", "source"))
MISSING = {
    "job.toml": "files fastened colours",
    "woven_mesh.obj": "files source mesh-walks pattern space rim former base",
    "model.glb": "files space clearance bends grain joints unfolding",
    "crossing_map.json": MAP_CHECKS,
    "ribbons.json": "files clearance bends grain",
    "sheets/sheet_01.dxf": "files outlines-dxf outlines-svg order",
    "sheets/sheet_01.svg": "files outlines-svg order",
    "sheets": "files outlines-dxf outlines-svg order labels",
}


@pytest.mark.parametrize("name", MISSING)
def test_missing_file(job, name):
    folder = job()
    path = folder / name
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    found = told(folder)
    assert set(found) == set(MISSING[name].split())
    assert any("missing" in finding for finding in found["files"])


@pytest.mark.parametrize("name", [name for name in MISSING if name != "sheets"])
def test_file_cut_short(job, name):
    path = job() / name
    data = path.read_bytes()
    # The shortest cut that breaks every format: in the middle of a line, record or number.
    path.write_bytes(
        data[: int(len(data) * 0.6)].rstrip()[:-1] + (b"\n[" if "toml" in name else b"")
    )
    found = told(path.parents[name.count("/")])
    if name == "woven_mesh.obj":
        assert "mesh-walks" in found
    else:
        assert set(found) == set(MISSING[name].split())


@pytest.mark.parametrize("seed", range(21))
def test_no_mutation_makes_a_traceback(job, seed):
    """Random bytes changed, doubled or dropped anywhere: a report, whatever comes."""
    folder = job()
    dice = random.Random(seed)  # noqa: S311 - no secret
    names = [name for name in MISSING if name != "sheets"]
    path = folder / names[seed % len(names)]
    data = bytearray(path.read_bytes())
    for _ in range(dice.randint(1, 8)):
        if not data:
            break
        at = dice.randrange(len(data))
        action = dice.randrange(3)
        if action == 0:
            data[at] = dice.choice(b'0123456789.-e{}[]",:<>\n\x00') if dice.random() < 0.8 else 255
        elif action == 1:
            data[at:at] = data[at : at + dice.randint(1, 40)]
        else:
            del data[at : at + dice.randint(1, 40)]
    path.write_bytes(bytes(data))
    report = verify_job(folder)
    assert tuple(check.name for check in report.checks) == tuple(MEANINGS)
    json.dumps(report.to_json(), allow_nan=True)


def test_a_sheet_of_an_earlier_run_is_found(job):
    folder = job()
    shutil.copy(folder / "sheets" / "sheet_01.dxf", folder / "sheets" / "sheet_02.dxf")
    assert set(told(folder)) == {"files"}


# --- references ---------------------------------------------------------------------------------


SCHEMA = [
    put("schema", "fabweave.crossing-map/2"),
    put("units", "in"),
    put("threads", 0, "over", 0, 1),
    put("threads", 0, "id", "0"),
    put("threads", 0, "id", True),
    put("pieces", 0, "outline", [[0, 0], [1, 1]]),
    put("pieces", 0, "outline", 0, [0, 0, 0]),
    put("pieces", 0, "outline", 0, [0, None]),
    put("pieces", 0, "placement", "x_mm", float("nan")),
    put("pieces", 0, "stations", 0, "x", float("inf")),
    put("pieces", 0, "joints", [1]),
    put("joints", 0, "holes", [[1, 2]]),
    put("crossings", 0, "position", [0, 0]),
    put("crossings", []),
    put("weave", None),
    drop("layout"),
    drop("threads", 0, "bunch"),
    drop("pieces", 0, "stations", 0, "hole_mm"),
    drop("steps"),
    drop("steps", 0, "fasten"),
    put("steps", 0, "closes", 0),
]


WRONG_STEP = put("steps", 0, "crossings", [17])
REFERENCES = [
    put("threads", 0, "crossings", 0, 9999),
    put("threads", 0, "pieces", 0, "Z9"),
    put("threads", 0, "over", [True]),
    put("threads", 1, "label", "A"),
    put("threads", 1, "id", 0),
    put("crossings", 1, "id", 100),
    put("crossings", 0, "edge", [0, 99]),
    put("crossings", 0, "edge", [-1, 0]),
    put("crossings", 0, "over", "station", 99),
    put("crossings", 0, "over", "station", -1),
    put("crossings", 0, "under", "piece", "Z9"),
    put("crossings", 0, "under", "thread", 17),
    put("pieces", 0, "thread", 17),
    put("pieces", 0, "sheet", 17),
    put("pieces", 1, "id", "A1"),
    put("pieces", 0, "joints", 0, 17),
    put("pieces", 0, "stations", 0, "joint", 17),
    put("pieces", 0, "stations", 0, "crossing", 17),
    put("pieces", 0, "stations", 0, "partner", "Z9"),
    put("joints", 1, "id", 1),
    put("joints", 0, "crossing", 17),
    put("joints", 0, "pieces", 1, "Z9"),
    put("steps", 0, "pieces", ["Z9"]),
    WRONG_STEP,
    put("steps", 0, "over", [17]),
    put("steps", 0, "under", [17]),
    put("steps", 0, "fasten", [17]),
    put("steps", 0, "joints", [999]),
    put("steps", 1, "step", 1),
    put("sheets", 0, "sheet", 2),
    put("sheets", 0, "name", "sheet_07"),
]


@pytest.mark.parametrize(
    "edit", slow_but([*SCHEMA, *REFERENCES], every=4), ids=lambda edit: edit.__name__
)
def test_a_map_that_is_none_or_refers_to_nothing(job, edit):
    folder = job()
    edit_json(folder / "crossing_map.json", edit)
    found = told(folder)
    assert "files" in found
    if edit is WRONG_STEP:
        assert set(found) == {"files", "steps"}


# --- model and mesh -----------------------------------------------------------------------------


def write_model(folder, specimen, edit=None, strip=None):
    if strip is not None:
        strip(specimen.strips)
    (folder / "model.glb").write_bytes(glb_bytes(specimen.strips, edit=edit))
    return told(folder)


def rungs(change, *labels):
    """Return an edit of the rungs of some strips, or of all."""

    def edit(strips):
        for label in labels or strips:
            strips[label]["rungs"] = change(strips[label]["rungs"])

    return edit


def exchange_ends_of_one_rung(strips):
    strip = strips["A"]
    rung = strip["entry"][0]
    strip["rungs"][rung] = strip["rungs"][rung, ::-1].copy()


def shift_panels(strips):
    strip = strips["A"]
    strip["entry"], strip["exit"] = strip["exit"], [*strip["entry"][1:], strip["entry"][0]]


def say_open(strips):
    strips["A"] |= {"closed": False, "triangles": strips["A"]["triangles"][:-2]}


def say_fewer_panels(strips):
    for key in ("entry", "exit"):
        strips["A"][key].pop()


UNREADABLE = "files space clearance bends grain joints unfolding"
STRIPS = [
    (rungs(lambda all_rungs: all_rungs * 1.01), "space unfolding joints"),
    (rungs(more([0.0, 0.0, 0.05]), "A"), "space joints"),
    (rungs(lambda all_rungs: all_rungs[:, ::-1]), "space unfolding"),
    (exchange_ends_of_one_rung, "space joints unfolding"),
    (exchange("A", "B"), "space"),
    (drop("B"), "files space joints unfolding"),
    (shift_panels, "space unfolding joints"),
    (say_open, "files joints unfolding"),
    (say_fewer_panels, "files space joints unfolding"),
]


@pytest.mark.parametrize(("spoil", "objecting"), STRIPS)
def test_spoiled_strips(specimen, job, spoil, objecting):
    found = set(write_model(job(), specimen("octahedron"), strip=spoil))
    if spoil.__name__.startswith("exchange A"):
        # Congruent threads: nothing but their places differs.
        found -= {"unfolding", "joints"}
    assert found == set(objecting.split())


def other_order_of_panels(document):
    extras = document["meshes"][0]["extras"]
    for key in ("entry", "exit"):
        extras[key][1], extras[key][2] = extras[key][2], extras[key][1]


#: Whatever of these is done to the document of a model, it cannot be read.
GLB = {
    "twice": lambda d: d["nodes"][1].update(name=d["nodes"][0]["name"]),
    "moved": lambda d: d["nodes"][0].update(translation=[0.0, 0.0, 0.001]),
    "lines for triangles": lambda d: d["meshes"][0]["primitives"][0].update(mode=1),
    "no extras": lambda d: d["meshes"][0].pop("extras"),
    "two primitives": lambda d: d["meshes"][0]["primitives"].append({}),
    "beyond the buffer": lambda d: d["accessors"][0].update(count=100_000),
    "strange panel": lambda d: d["meshes"][0]["extras"]["entry"].__setitem__(0, 999),
    "other order of panels": other_order_of_panels,
    "doubles for floats": lambda d: d["accessors"][0].update(componentType=9999),
}


@pytest.mark.parametrize("name", GLB)
def test_edited_glb(specimen, job, name):
    assert set(write_model(job(), specimen("octahedron"), GLB[name])) == set(UNREADABLE.split())


def test_extras_may_stand_on_the_node(specimen, job):
    def edit(document):
        document["nodes"][0]["extras"] = document["meshes"][0].pop("extras")

    assert write_model(job(), specimen("octahedron"), edit) == {}


def test_triangles_that_are_no_strip(specimen, job):
    source = specimen("octahedron")
    triangles = source.strips["A"]["triangles"]
    triangles[4], triangles[6] = triangles[6], triangles[4]
    assert set(write_model(job(), source)) == set(UNREADABLE.split())


def stretch(mesh):
    mesh.points[0] *= 3.0


def mirror(mesh):
    mesh.points[:, 0] *= -1.0
    turn_inside_out(mesh)


def turn_one_face(mesh):
    mesh.faces[0] = mesh.faces[0][::-1]


def turn_inside_out(mesh):
    mesh.faces = [face[::-1] for face in mesh.faces]


@pytest.mark.parametrize(
    ("spoil", "objecting", "not_objecting"),
    [
        (stretch, "space", None),
        (mirror, "space", ""),
        (turn_one_face, "files source mesh-walks pattern space rim former base", None),
        (lambda mesh: mesh.faces.pop(0), "mesh-walks pattern space", None),
        # The same threads, but seen from inside every panel looks away.
        (turn_inside_out, "space", "mesh-walks"),
    ],
)
def test_another_mesh(specimen, job, spoil, objecting, not_objecting):
    folder, source = job(), specimen("octahedron")
    spoil(source)
    write_mesh(source, folder)
    found = set(told(folder))
    if not_objecting is None:
        assert found == set(objecting.split())
    else:
        assert objecting in found
        assert not_objecting not in found
