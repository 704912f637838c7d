"""Check a polygon mesh of any content, by array operations only."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.mesh.faults import (
    duplicate_problems,
    face_problems,
    problem,
    shape_problems,
    surface_problems,
    vertex_problems,
)
from fabweave.mesh.orient import orient_faces
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.report import MeshReport, Problem
from fabweave.mesh.topology import (
    EdgeGroups,
    boundary_loops,
    group_edges,
    keep_faces,
    label_links,
    sound_faces,
    vertex_fans,
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
