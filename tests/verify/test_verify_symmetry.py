"""The rotations that a twill was to keep are counted anew, from places and senses of crossings."""

import numpy as np
import pytest
from sealing import verify_job
from symmetry_oracle import all_motions
from verify_specimen import Corners, count_broken, exact_twill, make_specimen, torus, walk_threads
from verify_writers import write_job

from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import catmull_clark
from fabweave.verify.check.weave import count_rotations
from fabweave.verify.read.mesh import edge_keys, read_obj

CUBE = parse_shape("shape:cube")
RING = torus(6, 4)


def loaded(mesh, tmp_path):
    write_mesh(tmp_path / "mesh.obj", mesh)
    return read_obj(tmp_path / "mesh.obj")


def senses(mesh, value=bool):
    """Return the sense of each edge: by the places of its ends in the mesh."""
    keys = edge_keys(mesh)
    ends = np.sort(np.column_stack((mesh.corner, mesh.corner[mesh.next])), axis=1)
    return {int(key): value(tuple(edge)) for key, edge in zip(keys, ends.tolist(), strict=True)}


@pytest.mark.parametrize(
    ("shape", "rotations"),
    [
        ("shape:tetrahedron", 12),
        ("shape:cube", 24),
        ("shape:dodecahedron", 60),
        ("shape:torus?m=12&n=6", 24),
        ("shape:tube?m=8&n=3", 16),
        # A half-turn about a side's middle line takes the surface to its other side.
        ("shape:hypar?m=4&n=4", 4),
    ],
)
def test_known_groups_are_counted(shape, rotations, tmp_path):
    mesh = loaded(parse_shape(shape), tmp_path)
    assert count_rotations(mesh, senses(mesh), 1000) == rotations
    # No more are counted than are asked for.
    assert count_rotations(mesh, senses(mesh), 2) == 2


@pytest.mark.parametrize(
    ("side", "rotations"),
    [
        (lambda p: p[2], 4),
        (lambda p: abs(p[2]), 8),
        (lambda p: p[0] * p[1], 4),
        (lambda p: p[0] * p[1] * p[2], 12),
        (lambda p: p @ (1, 1, 1), 3),
        (lambda p: p @ (1, 2, 3), 1),
    ],
)
def test_senses_are_kept_as_all_motions_say(side, rotations, tmp_path):
    made = catmull_clark(CUBE)
    mesh = loaded(made, tmp_path)
    twist = senses(mesh, lambda edge: bool(side(made.vertices[list(edge)].mean(axis=0)) > 1e-6))
    ends = senses(mesh, tuple)
    by_ends = {ends[key]: sense for key, sense in twist.items()}
    assert sum(np.linalg.det(one) > 0 for one in all_motions(made, by_ends)) == rotations
    assert count_rotations(mesh, twist, 1000) == rotations


def test_a_vertex_off_its_place_breaks_what_turns_about_it(tmp_path):
    made = parse_shape("shape:cube?n=2")
    for moved, rotations in ((0.0, 24), (1e-7, 24), (1e-3, 3)):
        points = made.vertices.copy()
        corner = np.argmax(points.sum(axis=1))
        points[corner] *= 1.0 + moved
        mesh = loaded(made.with_vertices(points), tmp_path)
        assert count_rotations(mesh, senses(mesh), 1000) == rotations


def turned(number):
    """Return a twill of a ring with some of its crossings turned over, and what it then breaks."""
    corners = Corners(RING[1])
    threads = walk_threads(corners)
    sense = exact_twill(corners, threads)
    for edge in sorted(sense)[:number]:
        sense[edge] = not sense[edge]
    specimen = make_specimen(RING, pattern="twill", sense=sense)
    broken = count_broken(corners, threads, sense)
    weave = specimen.plan["weave"]
    weave["exact"], weave["broken"] = (
        not any(broken),
        dict(zip(("edge", "face", "vertex"), broken, strict=True)),
    )
    return specimen


def findings(specimen, folder, asked=None):
    """Return what the proof finds, by check."""
    write_job(specimen, folder)
    if asked is not None:
        path = folder / "job.toml"
        text = path.read_text()
        head = "" if "[job]" in text else "[job]\n"
        path.write_text(f"{text}{head}twill_symmetry = {asked}\n")
    return {check.name: str(check.findings) for check in verify_job(folder).checks if not check.ok}


def test_rotations_are_proved_and_no_more(tmp_path):
    specimen = turned(0)
    # Of the 12 rotations of a ring of 6 by 4, half step along the twill's diagonal.
    specimen.plan["weave"]["rotations"] = 6
    assert findings(specimen, tmp_path / "true", 6) == {}
    assert findings(specimen, tmp_path / "fewer", 3) == {}
    assert "asks for 7 or more" in findings(specimen, tmp_path / "more", 7)["pattern"]
    assert "is no number" in findings(specimen, tmp_path / "none", "'six'")["pattern"]
    specimen.plan["weave"]["rotations"] = 12
    found = findings(specimen, tmp_path / "raised", 12)
    assert "its rotations are 12, but only 6 carry the mesh onto itself" in found["pattern"]
    del specimen.plan["weave"]["rotations"]
    assert "its rotations are None" in findings(specimen, tmp_path / "untold", 2)["pattern"]


def test_a_crossing_that_is_turned_over_is_found(tmp_path):
    specimen = turned(1)
    assert findings(specimen, tmp_path / "free") == {}
    specimen.plan["weave"]["rotations"] = 6
    found = findings(specimen, tmp_path / "told", 6)
    assert list(found) == ["pattern"]
    assert "its rotations are 6, but only 1" in found["pattern"]


@pytest.mark.slow
def test_a_finished_job_proves_its_rotations(finished, tmp_path):
    words = "--size 200mm --refine catmull-clark:1 --pattern twill --twill-symmetry 4"
    folder = finished.copy(tmp_path / "job", "shape:cube", *words.split(), "--effort", "quick")
    assert verify_job(folder).ok
    for name, old, new, words in (
        ("job.toml", "twill_symmetry = 4", "twill_symmetry = 8", "asks for 8 or more"),
        ("crossing_map.json", '"rotations": 4', '"rotations": 8', "but only 4 carry"),
    ):
        path = folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        checks = {check.name: check for check in verify_job(folder).checks}
        assert words in str(checks["pattern"].findings)
        path.write_text(text)
