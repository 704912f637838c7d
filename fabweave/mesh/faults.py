"""Find what is wrong with a mesh, and say what to do about it."""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, places_in_groups
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.report import Problem
from fabweave.mesh.topology import EdgeGroups, keep_faces, sorted_faces
from fabweave.mesh.weld import same_position_groups

#: How many places a problem lists.
_LISTED = 20
#: A face is flat as a line where its area is below this share of its squared edge lengths.
_FLAT = 1e-10

_Kind = Literal["vertex", "edge", "face"]


def problem(
    code: str,
    message: str,
    kind: _Kind,
    places: IntArray,
    remedy: str,
    *,
    fatal: bool,
) -> Iterator[Problem]:
    """Yield a problem if it occurs; the message agrees with the count, as ``agree`` does it."""
    number = len(places)
    if number:
        rows = np.reshape(places[:_LISTED], (len(places[:_LISTED]), -1)).tolist()
        where = tuple(tuple(row) for row in rows)
        yield Problem(code, agree(number, message), number, kind, where, remedy, fatal)


def face_problems(
    small: BoolArray, out_of_range: BoolArray, repeating: BoolArray, n_vertices: int
) -> Iterator[Problem]:
    """Yield the problems of faces that are not polygons."""
    yield from problem(
        "small-face",
        "{n} [face has|faces have] fewer than three corners",
        "face",
        np.flatnonzero(small),
        "delete loose edges and points in the modelling program",
        fatal=True,
    )
    yield from problem(
        "index-range",
        "{n} [face names|faces name] a vertex that does not exist "
        f"(there are {n_vertices}, counted from 0)",
        "face",
        np.flatnonzero(out_of_range),
        "the file is damaged; export it again",
        fatal=True,
    )
    yield from problem(
        "repeated-vertex",
        "{n} [face uses|faces use] the same vertex twice",
        "face",
        np.flatnonzero(repeating),
        "clean up degenerate faces in the modelling program (Blender: Mesh > Clean Up > "
        "Degenerate Dissolve)",
        fatal=True,
    )


def vertex_problems(mesh: PolyMesh, used: BoolArray) -> Iterator[Problem]:
    """Yield the problems of vertices, whatever the faces do."""
    finite = np.isfinite(mesh.vertices).all(axis=1)
    yield from problem(
        "not-finite",
        "{n} [vertex|vertices] used by faces [has|have] coordinates that are not numbers",
        "vertex",
        np.flatnonzero(~finite & used),
        "the file is damaged; export it again",
        fatal=True,
    )
    yield from problem(
        "unreferenced-vertex",
        "{n} [vertex belongs|vertices belong] to no face",
        "vertex",
        np.flatnonzero(~used),
        "nothing to do: vertices that no face uses are left out",
        fatal=False,
    )


def surface_problems(edges: EdgeGroups, fans: IntArray, one_sided: BoolArray) -> Iterator[Problem]:
    """Yield the problems that keep faces from forming an oriented surface."""
    yield from problem(
        "non-manifold-edge",
        "{n} [edge has|edges have] more than two faces",
        "edge",
        edges.ends(np.flatnonzero(edges.sizes > 2)),
        "a ribbon cannot tell which way to go there; delete inner walls, fins and duplicate faces "
        "(Blender: Select > All by Trait > Non Manifold shows them)",
        fatal=True,
    )
    yield from problem(
        "non-manifold-vertex",
        "{n} [vertex joins|vertices join] bodies that touch only at that point",
        "vertex",
        np.flatnonzero(fans > 1),
        "nothing to do: each body gets a vertex of its own there",
        fatal=False,
    )
    yield from problem(
        "non-orientable",
        "{n} [face belongs|faces belong] to a one-sided surface, like a Möbius strip",
        "face",
        np.flatnonzero(one_sided),
        "a one-sided surface has no outside to weave; cut it open, or give it a thickness so that "
        "it has two sides",
        fatal=True,
    )
    if not one_sided.any():
        yield from problem(
            "inconsistent-orientation",
            "{n} [edge lies|edges lie] between two faces, one of which is inside out",
            "edge",
            edges.ends(edges.same_way),
            "nothing to do: the faces in the minority are turned over to agree with the others",
            fatal=False,
        )


def duplicate_problems(mesh: PolyMesh, kept: IntArray) -> Iterator[Problem]:
    """Yield the faces with exactly the vertices of another; ``kept`` names the faces."""
    # A sum of scrambled vertex numbers tells different sets apart but for rare accidents,
    # which the comparison below rules out.
    scrambled = (np.arange(mesh.n_vertices, dtype=np.uint64) + np.uint64(1)) * np.uint64(
        0x9E3779B97F4A7C15
    )
    scrambled = (scrambled ^ (scrambled >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    scrambled ^= scrambled >> np.uint64(32)
    duplicates = np.zeros(0, dtype=np.int64)
    if mesh.n_faces:
        mark = np.add.reduceat(scrambled[mesh.indices], mesh.offsets[:-1])
        order = np.argsort(mark, kind="stable")
        alike = np.flatnonzero(mark[order[1:]] == mark[order[:-1]])
        if len(alike):
            duplicates = _really_alike(mesh, order[alike], order[alike + 1])
    yield from problem(
        "duplicate-face",
        "{n} [face has|faces have] exactly the same vertices as another face",
        "face",
        kept[duplicates],
        "delete the duplicate faces; where they are the front and the back of a sheet, give it a "
        "thickness or keep only one of them",
        fatal=True,
    )


def _really_alike(mesh: PolyMesh, one: IntArray, two: IntArray) -> IntArray:
    """Return the faces of ``two`` that have the same vertices as their partners in ``one``."""
    fits = mesh.face_sizes[one] == mesh.face_sizes[two]
    one, two = one[fits], two[fits]
    if not len(one):
        return two
    chosen = np.zeros(mesh.n_faces, dtype=bool)
    chosen[one] = chosen[two] = True
    some = keep_faces(mesh, chosen)
    number = np.cumsum(chosen) - 1
    members = sorted_faces(some)[1]
    sizes = mesh.face_sizes[one]
    bounds = np.cumsum(sizes) - sizes
    inner = places_in_groups(sizes)
    differs = (
        members[np.repeat(some.offsets[number[one]], sizes) + inner]
        != members[np.repeat(some.offsets[number[two]], sizes) + inner]
    )
    alike: IntArray = np.sort(two[np.add.reduceat(differs, bounds, dtype=np.int64) == 0])
    return alike


def shape_problems(mesh: PolyMesh, kept: IntArray, edges: EdgeGroups) -> Iterator[Problem]:
    """Yield the faces without area, the edges without length and the seams that lie open."""
    with np.errstate(all="ignore"):
        x, y, z = (np.ascontiguousarray(column) for column in mesh.vertices.T)
        base = np.repeat(mesh.indices[mesh.offsets[:-1]], mesh.face_sizes)
        steps = [axis[edges.head] - axis[edges.tail] for axis in (x, y, z)]
        length2 = steps[0] ** 2 + steps[1] ** 2 + steps[2] ** 2
        flat = np.zeros(mesh.n_faces, dtype=bool)
        if mesh.n_faces:
            # From the first corner of each face, so that far from the origin no digits are lost.
            arms = [axis[edges.tail] - axis[base] for axis in (x, y, z)]
            area2 = np.zeros(mesh.n_faces)
            for one, two in ((0, 1), (1, 2), (2, 0)):
                part = arms[one] * steps[two] - arms[two] * steps[one]
                area2 += np.add.reduceat(part, mesh.offsets[:-1]) ** 2
            flat = np.sqrt(area2) <= _FLAT * np.add.reduceat(length2, mesh.offsets[:-1])
        short = length2[edges.first] == 0
    yield from problem(
        "zero-area-face",
        "{n} [face has|faces have] no area",
        "face",
        kept[np.flatnonzero(flat)],
        "a ribbon across them would have no width; dissolve them in the modelling program",
        fatal=False,
    )
    yield from problem(
        "zero-length-edge",
        "{n} [edge has|edges have] no length",
        "edge",
        edges.ends(np.flatnonzero(short)),
        "merge vertices by distance in the modelling program",
        fatal=False,
    )
    yield from _seam_problems(mesh.vertices, edges)


def _seam_problems(vertices: FloatArray, edges: EdgeGroups) -> Iterator[Problem]:
    half = edges.first[edges.sizes == 1]
    rim = np.unique(np.concatenate([edges.tail[half], edges.head[half]]))
    rim = rim[np.isfinite(vertices[rim]).all(axis=1)]
    group = same_position_groups(vertices[rim])
    crowd = np.bincount(group, minlength=1)
    yield from problem(
        "open-seam",
        "{n} boundary [vertex is|vertices are] at the same place as another vertex",
        "vertex",
        rim[crowd[group] > 1] if len(rim) else rim,
        "the surface is cut open there, and no ribbon will cross; merge the vertices (--weld) "
        "if it should be closed",
        fatal=False,
    )
