"""Check a polygon mesh of any content, by array operations only."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import (
    EdgeGroups,
    boundary_loops,
    group_edges,
    keep_faces,
    label_links,
    orient_faces,
    sorted_faces,
    sound_faces,
    vertex_fans,
)
from fabweave.mesh.weld import same_position_groups

#: How many places a message names.
_NAMED = 5


def faces_text(mesh: PolyMesh) -> str:
    """Return how many faces a mesh has, and of what sort.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube, octahedron
    >>> faces_text(cube()), faces_text(octahedron())
    ('6 quads', '8 triangles')
    """
    sizes = set(mesh.face_sizes.tolist())
    sort = {(3,): "triangles", (4,): "quads"}.get(tuple(sizes), "faces")
    return f"{mesh.n_faces:,} {sort}"


@dataclass(frozen=True)
class Problem:
    """One kind of problem of a mesh.

    Parameters
    ----------
    code : str
        A fixed name for programs, such as ``non-manifold-edge``.
    message : str
        What is wrong, in a maker's words, with the count.
    count : int
        How many times.
    kind : str
        What `where` names: ``vertex``, ``edge`` or ``face``.
    where : tuple of tuples of int
        The first few places: a vertex, the two ends of an edge, or a face, counted from 0.
    remedy : str
        What to do about it.
    fatal : bool
        Whether the mesh cannot be woven with it. Preparing a mesh cures what is not fatal, or
        leaves it as it does no harm.
    """

    code: str
    message: str
    count: int
    kind: str
    where: tuple[tuple[int, ...], ...]
    remedy: str
    fatal: bool

    def __str__(self) -> str:
        """Return one line: what, how many, where, and what to do."""
        places = ", ".join("–".join(map(str, place)) for place in self.where[:_NAMED])
        if self.count > len(self.where[:_NAMED]):
            places += ", …"
        at = f" ({self.kind} {places})" if self.where else ""
        return f"{self.message}{at}: {self.remedy}"


@dataclass(frozen=True)
class MeshReport:
    """What a mesh is, and what is wrong with it.

    Components, loops, genus and the properties are those of the sound faces: three or more
    corners, all at different vertices that exist.

    Parameters
    ----------
    n_vertices, n_edges, n_faces : int
        Counts of all vertices, all faces, and the edges of all faces whose vertices exist.
    face_sizes : tuple of (size, number)
        How many faces have how many corners.
    n_components : int
        Components, which are connected through common vertices.
    edge_manifold : bool
        Whether every edge has one or two faces.
    vertex_manifold : bool
        Whether the faces at every vertex form one fan.
    orientable : bool
        Whether faces can be turned so that neighbours agree.
    oriented : bool
        Whether they do as they are.
    n_boundary_loops : int
        Boundary loops; a closed mesh has none.
    euler : int
        Vertices with faces, minus edges, plus faces.
    component_genus : tuple of (int or None)
        Genus of each component, in the order of its first vertex; None where a component is no
        orientable surface.
    problems : tuple of Problem
        What is wrong, worst first.
    """

    n_vertices: int
    n_edges: int
    n_faces: int
    face_sizes: tuple[tuple[int, int], ...]
    n_components: int
    edge_manifold: bool
    vertex_manifold: bool
    orientable: bool
    oriented: bool
    n_boundary_loops: int
    euler: int
    component_genus: tuple[int | None, ...]
    problems: tuple[Problem, ...]

    @property
    def closed(self) -> bool:
        """Whether there are faces, and no boundary."""
        return self.n_faces > 0 and self.n_boundary_loops == 0

    @property
    def manifold(self) -> bool:
        """Whether the mesh is a surface everywhere."""
        return self.edge_manifold and self.vertex_manifold

    @property
    def genus(self) -> int | None:
        """Genus of all components together, or None where one has none."""
        known = [genus for genus in self.component_genus if genus is not None]
        complete = len(known) == len(self.component_genus) > 0
        return sum(known) if complete else None

    @property
    def codes(self) -> frozenset[str]:
        """The codes of all problems."""
        return frozenset(problem.code for problem in self.problems)

    @property
    def fatal(self) -> tuple[Problem, ...]:
        """The problems with which the mesh cannot be woven."""
        return tuple(problem for problem in self.problems if problem.fatal)


def mesh_notes(report: MeshReport, pairs: IntArray) -> list[str]:
    """Describe a mesh: its counts, what is odd about it, and where it intersects itself.

    Parameters
    ----------
    report : MeshReport
    pairs : (N, 2) int array
        Faces that run through one another.
    """
    bounds = "closed"
    if not report.closed:
        bounds = agree(report.n_boundary_loops, "{n} boundary [loop|loops]")
    bodies = f"{report.n_components} bodies, " if report.n_components > 1 else ""
    notes = [f"mesh: {mesh_counts(report)}, {bodies}{bounds}, genus {report.genus}"]
    notes += [str(problem) for problem in report.problems]
    if len(pairs):
        some = ", ".join(f"{a} and {b}" for a, b in pairs[:3].tolist())
        notes.append(
            agree(len(pairs), "{n} [pair|pairs] of faces intersect[s|] or touch[es|]")
            + f" (faces {some}{', …' if len(pairs) > 3 else ''}): ribbons may collide there; "
            + ("--bodies join makes one surface of the bodies, " if bodies else "")
            + "--bodies wrap lays a closed surface around all of it, or "
            + "move these parts of the surface apart in a modelling program"
        )
    return notes


def mesh_counts(report: MeshReport) -> str:
    """Return how many vertices, edges and faces a mesh has."""
    return ", ".join(
        agree(number, text)
        for number, text in (
            (report.n_vertices, "{n} [vertex|vertices]"),
            (report.n_edges, "{n} [edge|edges]"),
            (report.n_faces, "{n} [face|faces]"),
        )
    )


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
    members = sorted_faces(mesh)[1]
    duplicates = [np.zeros(0, dtype=np.int64)]
    for size in np.unique(mesh.face_sizes).tolist():
        faces = np.flatnonzero(mesh.face_sizes == size)
        rows = members[mesh.offsets[faces, None] + np.arange(size)]
        order = np.lexsort(rows.T)
        alike = np.all(rows[order[1:]] == rows[order[:-1]], axis=1)
        duplicates.append(faces[order[1:][alike]])
    yield from problem(
        "duplicate-face",
        "{n} [face has|faces have] exactly the same vertices as another face",
        "face",
        kept[np.sort(np.concatenate(duplicates))],
        "delete the duplicate faces; where they are the front and the back of a sheet, give it a "
        "thickness or keep only one of them",
        fatal=True,
    )


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


def check_mesh(mesh: PolyMesh) -> MeshReport:
    """Check a mesh: what it is, and what is wrong with it.

    Nothing is changed, and nothing is raised whatever the mesh holds.

    Parameters
    ----------
    mesh : PolyMesh
        Any vertices and faces.

    Returns
    -------
    MeshReport
        Counts, properties, genus of each component, and the problems, worst first.

    Notes
    -----
    The genus of a component with b boundary loops is (2 − χ − b) / 2, by Euler's formula. Where
    that is not a whole number of 0 or more although every other test passed, the check itself is
    wrong, and says so with the code ``euler``.

    Examples
    --------
    >>> tetrahedron = PolyMesh.from_faces(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    ...     [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> report = check_mesh(tetrahedron)
    >>> report.n_edges, report.genus, report.closed, report.problems
    (6, 0, True, ())
    """
    small, out_of_range, repeating = sound_faces(mesh)
    sound = ~(small | out_of_range | repeating)
    surface = keep_faces(mesh, sound)
    kept = np.flatnonzero(sound)
    edges = group_edges(surface)
    fans = vertex_fans(edges, mesh.n_vertices)
    used = _used_vertices(mesh)
    oriented = len(edges.same_way) == 0
    one_sided = np.zeros(surface.n_faces, dtype=bool)
    if not oriented:
        one_sided = orient_faces(edges, surface.n_faces)[1]
    n_loops, loop_vertex = boundary_loops(edges)
    components = _Components(surface, edges, fans, loop_vertex, one_sided)
    genus, contradictions = component_genus(
        components.euler, components.loops, components.is_surface
    )

    problems: list[Problem] = []
    problems += face_problems(small, out_of_range, repeating, mesh.n_vertices)
    problems += vertex_problems(mesh, used)
    problems += surface_problems(edges, fans, _among(one_sided, kept, mesh.n_faces))
    problems += duplicate_problems(surface, kept)
    problems += shape_problems(surface, kept, edges)
    problems += problem(
        "lone-face",
        "{n} [face has|faces have] no neighbour",
        "vertex",
        components.first_vertex[components.faces == 1],
        "no ribbon can reach it from another face; delete it if it is a leftover",
        fatal=False,
    )
    problems += problem(
        "euler",
        "{n} [component contradicts|components contradict] Euler's formula",
        "vertex",
        components.first_vertex[contradictions],
        "this is a bug in fabweave; please report it and send the mesh",
        fatal=True,
    )
    problems.sort(key=lambda item: not item.fatal)
    sizes, numbers = np.unique(mesh.face_sizes, return_counts=True)
    return MeshReport(
        n_vertices=mesh.n_vertices,
        n_edges=_count_edges(mesh, edges, small | out_of_range),
        n_faces=mesh.n_faces,
        face_sizes=tuple(zip(sizes.tolist(), numbers.tolist(), strict=True)),
        n_components=components.number,
        edge_manifold=not np.any(edges.sizes > 2),
        vertex_manifold=not np.any(fans > 1),
        orientable=not one_sided.any(),
        oriented=oriented,
        n_boundary_loops=n_loops,
        euler=int(components.euler.sum()),
        component_genus=genus,
        problems=tuple(problems),
    )


def _used_vertices(mesh: PolyMesh) -> BoolArray:
    """Return which vertices are used by faces, (V,)."""
    used = np.zeros(mesh.n_vertices, dtype=bool)
    used[mesh.indices[(mesh.indices >= 0) & (mesh.indices < mesh.n_vertices)]] = True
    return used


def _count_edges(mesh: PolyMesh, edges: EdgeGroups, no_polygon: BoolArray) -> int:
    """Count the edges of all polygons, those that pass a vertex twice included."""
    if mesh.n_corners == len(edges.tail):
        return len(edges.sizes)
    every = group_edges(keep_faces(mesh, ~no_polygon))
    return int(np.count_nonzero(every.tail[every.first] != every.head[every.first]))


def _among(chosen: BoolArray, kept: IntArray, count: int) -> BoolArray:
    """Spread flags of the kept faces over all faces."""
    spread = np.zeros(count, dtype=bool)
    spread[kept] = chosen
    return spread


class _Components:
    """Counts of each component of a mesh; components are connected through vertices."""

    def __init__(
        self,
        mesh: PolyMesh,
        edges: EdgeGroups,
        fans: IntArray,
        loop_vertex: IntArray,
        one_sided: BoolArray,
    ) -> None:
        """Count vertices, edges, faces and loops of each component."""
        with_faces = np.flatnonzero(fans)
        place = np.zeros(mesh.n_vertices, dtype=np.int64)
        place[with_faces] = np.arange(len(with_faces))
        half = edges.first
        # Smaller end first: edges are sorted by it, which saves a sort.
        ends = place[edges.tail[half]], place[edges.head[half]]
        self.number, label = label_links(np.minimum(*ends), np.maximum(*ends), len(with_faces))

        def count(vertices: IntArray) -> IntArray:
            return np.bincount(label[place[vertices]], minlength=self.number)

        face_vertex = mesh.indices[mesh.offsets[:-1]]
        self.faces = count(face_vertex)
        self.euler = (
            np.bincount(label, minlength=self.number) - count(edges.tail[half]) + self.faces
        )
        self.loops = count(loop_vertex)
        crowded = edges.tail[half[edges.sizes > 2]]
        spoilt = (count(crowded) > 0) | (count(np.flatnonzero(fans > 1)) > 0)
        self.is_surface = ~spoilt & (count(face_vertex[one_sided]) == 0)
        self.first_vertex = np.zeros(self.number, dtype=np.int64)
        self.first_vertex[label[::-1]] = with_faces[::-1]


def component_genus(
    euler: IntArray, loops: IntArray, is_surface: BoolArray
) -> tuple[tuple[int | None, ...], IntArray]:
    """Return the genus of each component from its Euler characteristic.

    Parameters
    ----------
    euler, loops : (C,) int arrays
        Euler characteristic and number of boundary loops.
    is_surface : (C,) bool array
        Whether the component is an orientable surface; only those have a genus.

    Returns
    -------
    genus : tuple of (int or None)
        The genus of each component.
    contradictions : int array
        Components whose numbers belong to no surface.

    Examples
    --------
    >>> import numpy as np
    >>> component_genus(np.array([2, 0, 1, 1]), np.array([0, 0, 1, 0]), np.array([True] * 4))
    ((0, 1, 0, None), array([3]))
    """
    double = 2 - euler - loops
    right = (double >= 0) & (double % 2 == 0)
    known = (right & is_surface).tolist()
    genus = tuple(
        value if sure else None for value, sure in zip((double // 2).tolist(), known, strict=True)
    )
    return genus, np.flatnonzero(is_surface & ~right)
