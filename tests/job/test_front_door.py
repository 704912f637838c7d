"""What Python users do: from a mesh in memory to pieces, a layout, and a proved folder."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh
from jobs import contents_of
from PIL import Image

import fabweave as fw

pytestmark = pytest.mark.usefixtures("quick_jobs")


@pytest.fixture(scope="module")
def steps():
    """Every step of one small job, from a trimesh in memory."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=1.0)
    mesh = fw.mesh(ball, size="300mm", name="ball")
    weave = fw.weave(mesh)
    ribbons = weave.ribbons(material="card", width="10mm")
    pieces = ribbons.pieces(max_length="300mm", sheet="600x400mm")
    return mesh, weave, ribbons, pieces, pieces.nest(effort="quick")


@pytest.mark.slow
def test_a_mesh_in_memory_becomes_a_proved_folder(steps, tmp_path):
    mesh, weave, ribbons, pieces, layout = steps
    # An icosphere is not turned or torn: V - E + F = 2, and one crossing on every edge.
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 2
    assert max(mesh.size_mm) == pytest.approx(300.0, abs=1e-9)
    assert len(weave.crossings) == len(mesh.edges) == 120
    assert sum(len(thread.crossings) for thread in weave.threads) == 2 * 120
    assert weave.exact
    assert weave.reason is None
    for thread in weave.threads:  # over and under by turns
        assert (thread.over != np.roll(thread.over, 1)).all()
    assert ribbons.to_trimesh().area > 0.0
    assert ribbons.widths_mm.max() == pytest.approx(10.0, rel=2e-3)
    polygons = pieces.polygons
    assert all(isinstance(polygon, shapely.Polygon) and polygon.is_valid for polygon in polygons)
    assert sum(len(polygon.interiors) for polygon in polygons) == sum(
        row["holes"] for row in pieces.rows()
    )
    # A layout moves pieces and changes nothing else; they lie inside and apart.
    for here, there in zip(polygons, layout.polygons, strict=True):
        assert there.area == pytest.approx(here.area, rel=1e-9)
    for number, sheet in enumerate(layout.sheets, start=1):
        lying = [
            polygon
            for polygon, row in zip(layout.polygons, layout.rows(), strict=True)
            if row["sheet"] == number
        ]
        assert shapely.box(0, 0, sheet.width_mm, sheet.height_mm).contains(shapely.union_all(lying))
        tree = shapely.STRtree(lying)
        pairs = tree.query(lying, predicate="dwithin", distance=1.9)
        assert (pairs[0] == pairs[1]).all()
    job = layout.write(tmp_path / "ball")
    assert job.proof.ok
    proof = fw.verify(tmp_path / "ball")
    assert proof.ok
    assert proof._repr_html_().count("<tr>") == 1 + len(proof.checks)
    (tmp_path / "ball" / "sheets" / "sheet_01.dxf").unlink()
    proof = fw.verify(tmp_path / "ball")
    assert ", ".join(proof.failed) in repr(proof)
    assert "sheets/sheet_01.dxf" in proof._repr_html_()
    assert {path.name for path in job.files} >= {"ball.obj", "job.toml", "crossing_map.json"}


SHAPE = ("shape:torus?m=8&n=4", {"m": 8, "n": 4})


@pytest.mark.slow
@pytest.mark.usefixtures("shipped")
def test_steps_and_whole_jobs_give_the_bytes_of_the_command_line(tmp_path):
    options = {"size": "300mm", "pattern": "twill", "effort": "quick", "kerf": "0.15mm",
               "width": 0.6, "joint": "rivet:2", "labels": "numbers"}  # fmt: skip
    words = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    subprocess.run(
        [sys.executable, "-m", "fabweave", "make", SHAPE[0], *words, "-q",
         "-o", str(tmp_path / "line")],
        check=True,
    )  # fmt: skip
    fw.make(SHAPE[0], tmp_path / "whole", **options)
    weave = fw.weave(fw.shape("torus", size="300mm", **SHAPE[1]), pattern="twill", effort="quick")
    pieces = weave.ribbons(width=0.6).pieces(joint="rivet:2")
    pieces.nest().write(tmp_path / "steps", kerf="0.15mm", labels="numbers")
    line = contents_of(tmp_path / "line")
    assert len(line) > 15
    assert contents_of(tmp_path / "whole") == line
    assert contents_of(tmp_path / "steps") == line


@pytest.mark.slow
def test_a_later_option_makes_anew_what_depends_on_it_and_keeps_the_rest(steps):
    _, weave, ribbons, pieces, _ = steps
    other = pieces.nest(sheet="400x300mm", effort="quick")
    assert {(sheet.width_mm, sheet.height_mm) for sheet in other.sheets} == {(400.0, 300.0)}
    assert other.stations.weave is weave.stations.weave
    assert other.stations.ribbons is ribbons.stations.ribbons
    assert other.stations.planned.piece_set is not pieces.planned.piece_set
    wider = pieces.nest(width="12mm", effort="quick")
    assert wider.stations.weave is weave.stations.weave
    assert wider.stations.ribbons is not ribbons.stations.ribbons
    twill = ribbons.pieces(pattern="triaxial")
    # A mesh for triaxial twill is subdivided at its edges' middles: four times the edges.
    assert len(twill.planned.weave.threads.crossing_halfedge) == 4 * 120


def test_the_callers_arrays_stay_as_they_are():
    cube = trimesh.creation.box()
    corners, faces = np.array(cube.vertices), np.array(cube.faces)
    mesh = fw.mesh(corners, faces, size=100.0)
    corners[0] = 7.0  # still writeable, and not shared
    assert np.abs(mesh.vertices).max() <= 50.0 + 1e-9
    assert not mesh.vertices.flags.writeable
    again = fw.mesh(mesh.to_trimesh())
    assert again.size_mm == pytest.approx((100.0, 100.0, 100.0))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((np.zeros((3, 2)), [[0, 1, 2]]), r"real numbers \(V, 3\)"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.array([[0.0, 1.0, 2.0]])), "not whole numbers"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 9]]), "names a vertex that does not exist"),
        ((object(),), "this is no mesh"),
        ((Path("cow.obj"),), r"read\('cow.obj'"),
        (([["a", 0, 0]], [[0, 0, 0]]), "this is no mesh"),
        ((np.eye(3) + 1j, [[0, 1, 2]]), "must be real numbers"),
        ((np.eye(3) + 0j, [[0, 1, 2]]), "must be real numbers"),
        ((np.eye(3), [[0, 1, 2**63]]), "this is no mesh"),
        ((np.eye(3), [[0, 1, -(2**70)]]), "this is no mesh"),
        ((np.eye(3), [[0, 1, 2**63 - 1]]), "names a vertex that does not exist"),
        ((np.eye(3), np.array([[0, 1, 2**63]], dtype=np.uint64)), "names a vertex that does not"),
        (([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "coordinates that are not numbers"),
    ],
)
def test_what_is_no_mesh_is_refused_in_words(given, expected):
    with pytest.raises(fw.InputError, match=expected):
        fw.mesh(*given)


@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
@pytest.mark.parametrize("held", [np.asmatrix, memoryview, np.ndarray.tolist, np.ma.array])
def test_whatever_holds_the_numbers_of_a_mesh_they_are_the_same_mesh(held):
    cube = trimesh.creation.box()
    corners, faces = np.array(cube.vertices), np.array(cube.faces)
    mesh, other = fw.mesh(corners, faces), fw.mesh(held(corners), held(faces))
    assert np.array_equal(mesh.vertices, other.vertices)
    assert mesh.faces == other.faces


def test_no_array_that_is_handed_out_can_be_written_to(steps):
    mesh, weave, *_ = steps
    values = (*steps, weave.yarns(), *weave.threads, *steps[3])
    named = [(value, name) for value in values for name in dir(value) if not name.startswith("_")]
    arrays = [
        (type(value).__name__, name, found.flags.writeable)
        for value, name in named
        if isinstance(found := getattr(value, name), np.ndarray)
    ]
    assert {name for _, name, _ in arrays} >= {"vertices", "edges", "crossings", "widths_mm"}
    assert not [array for array in arrays if array[2]]
    assert weave.crossings.tolist() == mesh.edges.tolist()  # every edge, in its order


@pytest.mark.slow
def test_the_package_is_quick_to_import_and_its_names_are_functions():
    script = (
        "import sys, fabweave as fw\n"
        "assert 'numpy' not in sys.modules\n"
        "import fabweave.weave.threads as threads, fabweave.mesh.polymesh\n"
        "assert callable(fw.mesh) and callable(fw.weave) and callable(fw.verify)\n"
        "assert threads.trace_threads\n"
        "import fabweave.verify.proof as proof, fabweave.weave.pattern as pattern\n"
        "assert proof.verify_job and pattern.Weave and callable(fw.verify)\n"
        "assert set(fw.__all__) <= set(dir(fw))\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize("name", fw.__all__)
def test_every_public_name_is_documented_with_an_example(name):
    public = getattr(fw, name)
    assert public.__doc__
    if name.islower():
        for section in ("Parameters", "Raises", "Examples", ">>> "):
            assert section in public.__doc__, section


def shown_wide(picture: Image.Image) -> int:
    """Return how many columns of a picture show something, its soft shadow left out."""
    dark = np.asarray(picture.convert("L")) < 200
    columns = np.flatnonzero(dark.any(axis=0))
    return int(columns[-1] - columns[0]) + 1


def test_pictures_have_the_size_the_view_and_the_scale_that_are_asked_for():
    for size in ("100mm", "200mm"):
        mesh = fw.shape("cube", size=size)
        # From the front, a cube is as wide as its side; marks of 5 pixels stand on its corners.
        picture = mesh.picture(size_px=(300, 240), view=(-90, 0), across="300mm", samples=1)
        assert picture.size == (300, 240)
        assert shown_wide(picture) == pytest.approx(float(size.removesuffix("mm")) + 10, abs=2)
    filling = mesh.picture(size_px=(300, 300), view=(-90, 0))
    assert shown_wide(filling) == pytest.approx(0.9 * 300 + 10, abs=2)
    with pytest.raises(fw.InputError, match="across"):
        mesh.picture(view=(-90, 0), across=-1)
    with pytest.raises(fw.InputError, match="elevation"):
        mesh.picture(view=(-90, 95))
