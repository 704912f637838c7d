"""Check a polygon mesh of any content, by array operations only."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, flags
from fabweave.core.finding import Finding, Level, Note
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import (
    boundary_loops,
    first_alike,
    keep_faces,
    label_links,
    orient_faces,
    sound_faces,
    vertex_fans,
)
from fabweave.mesh.weld import same_position_groups

#: How many places a message names.
_NAMED = 5
#: What is farther than this from 0 is no place: products of such numbers leave the range of floats.
FAR = 1e60
#: A face is flat as a line where its area is below this share of its squared edge lengths.
FLAT = 1e-10


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
    findings : tuple of Finding
        What is wrong, worst first. Preparing a mesh cures what is not refused, or leaves it as it
        does no harm.
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
    findings: tuple[Finding, ...]

    @property
    def closed(self) -> bool:
        """Whether there are faces, and no boundary."""
        return self.n_faces > 0 and self.n_boundary_loops == 0

    @property
    def manifold(self) -> bool:
        """Whether the mesh is a surface everywhere."""
        return self.edge_manifold and self.vertex_manifold

    @property
    def kind(self) -> tuple[int, int, int]:
        """What remeshing keeps: Euler characteristic, components and boundary loops."""
        return self.euler, self.n_components, self.n_boundary_loops

    @property
    def genus(self) -> int | None:
        """Genus of all components together, or None where one has none."""
        known = [genus for genus in self.component_genus if genus is not None]
        complete = len(known) == len(self.component_genus) > 0
        return sum(known) if complete else None

    @property
    def rules(self) -> frozenset[str]:
        """The rules that do not hold."""
        return frozenset(finding.rule for finding in self.findings)

    @property
    def fatal(self) -> tuple[Finding, ...]:
        """What the mesh cannot be woven with."""
        return tuple(finding for finding in self.findings if finding.level == "not makeable")


def mesh_notes(report: MeshReport, pairs: IntArray) -> list[Note]:
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
    counts = f"mesh: {mesh_counts(report)}, {bodies}{bounds}, genus {report.genus}"
    notes = [Note("mesh", counts, detail=True)]
    notes += [Note(finding.rule, str(finding)) for finding in report.findings]
    if len(pairs):
        some = ", ".join(f"{a} and {b}" for a, b in pairs[:3].tolist())
        told = (
            agree(len(pairs), "{n} [pair|pairs] of faces intersect[s|] or touch[es|]")
            + f" (faces {some}{', …' if len(pairs) > 3 else ''}): ribbons may collide there; "
            + ("--bodies join makes one surface of the bodies, " if bodies else "")
            + "--bodies wrap lays a closed surface around all of it, or "
            + "move these parts of the surface apart in a modelling program"
        )
        notes.append(Note("intersections", told))
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


@dataclass(frozen=True)
class _Rule:
    """What is wrong where a rule does not hold, at vertices, edges or faces, and what to do."""

    name: str
    kind: str
    text: str
    cure: str
    level: Level = "with care"

    def finding(self, places: IntArray, n_vertices: int) -> Finding:
        """Return the finding at places: rows of one vertex or face, or of two ends of an edge."""
        rows = places.reshape(len(places), -1)[:_NAMED].tolist()
        where = f"{self.kind} {', '.join('–'.join(map(str, row)) for row in rows)}"
        more = ", …" if len(places) > _NAMED else ""
        text = agree(len(places), self.text).replace("{vertices}", str(n_vertices))
        return Finding(
            rule=self.name, level=self.level, text=text, cure=self.cure, where=where + more
        )


#: What is looked for, worst first.
_RULES = (
    _Rule(
        "small-face",
        "face",
        "{n} [face has|faces have] fewer than three corners",
        "delete loose edges and points in the modelling program",
        "not makeable",
    ),
    _Rule(
        "index-range",
        "face",
        "{n} [face names|faces name] a vertex that does not exist "
        "(there are {vertices}, counted from 0)",
        "the file is damaged; export it again",
        "not makeable",
    ),
    _Rule(
        "repeated-vertex",
        "face",
        "{n} [face uses|faces use] the same vertex twice",
        "clean up degenerate faces in the modelling program (Blender: Mesh > Clean Up > "
        "Degenerate Dissolve)",
        "not makeable",
    ),
    _Rule(
        "not-finite",
        "vertex",
        "{n} [vertex|vertices] used by faces [has|have] coordinates that are not numbers, or "
        "beyond 1e60",
        "the file is damaged; export it again",
        "not makeable",
    ),
    _Rule(
        "non-manifold-edge",
        "edge",
        "{n} [edge has|edges have] more than two faces",
        "a ribbon cannot tell which way to go there; delete inner walls, fins and duplicate faces "
        "(Blender: Select > All by Trait > Non Manifold shows them)",
        "not makeable",
    ),
    _Rule(
        "non-orientable",
        "face",
        "{n} [face belongs|faces belong] to a one-sided surface, like a Möbius strip",
        "a one-sided surface has no outside to weave; cut it open, or give it a thickness so that "
        "it has two sides",
        "not makeable",
    ),
    _Rule(
        "duplicate-face",
        "face",
        "{n} [face has|faces have] exactly the same vertices as another face",
        "delete the duplicate faces; where they are the front and the back of a sheet, give it a "
        "thickness or keep only one of them",
        "not makeable",
    ),
    _Rule(
        "euler",
        "vertex",
        "{n} [component contradicts|components contradict] Euler's formula",
        "this is a bug in fabweave; please report it and send the mesh",
        "not makeable",
    ),
    _Rule(
        "unreferenced-vertex",
        "vertex",
        "{n} [vertex belongs|vertices belong] to no face",
        "nothing to do: vertices that no face uses are left out",
    ),
    _Rule(
        "non-manifold-vertex",
        "vertex",
        "{n} [vertex joins|vertices join] bodies that touch only at that point",
        "nothing to do: each body gets a vertex of its own there",
    ),
    _Rule(
        "inconsistent-orientation",
        "edge",
        "{n} [edge lies|edges lie] between two faces, one of which is inside out",
        "nothing to do: the faces in the minority are turned over to agree with the others",
    ),
    _Rule(
        "zero-area-face",
        "face",
        "{n} [face has|faces have] no area",
        "a ribbon across them would have no width; dissolve them in the modelling program",
    ),
    _Rule(
        "zero-length-edge",
        "edge",
        "{n} [edge has|edges have] no length",
        "merge vertices by distance in the modelling program",
    ),
    _Rule(
        "open-seam",
        "vertex",
        "{n} boundary [vertex is|vertices are] at the same place as another vertex",
        "the surface is cut open there, and no ribbon will cross; merge the vertices (--weld all) "
        "if it should be closed",
    ),
    _Rule(
        "lone-face",
        "vertex",
        "{n} [face has|faces have] no neighbour",
        "no ribbon can reach it from another face; delete it if it is a leftover",
    ),
)


@lru_cache(maxsize=8)  # what is remeshed is asked for beside each of its results
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
        Counts, properties, genus of each component, and what is wrong, worst first.

    Notes
    -----
    The genus of a component with b boundary loops is (2 − χ − b) / 2, by Euler's formula. Where
    that is not a whole number of 0 or more although every other test passed, the check itself is
    wrong, and says so by the rule ``euler``.

    Examples
    --------
    >>> tetrahedron = PolyMesh.from_faces(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    ...     [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> report = check_mesh(tetrahedron)
    >>> report.n_edges, report.genus, report.closed, report.findings
    (6, 0, True, ())
    """
    small, out_of_range, repeating = sound_faces(mesh)
    sound = ~(small | out_of_range | repeating)
    surface = keep_faces(mesh, sound)
    kept = np.flatnonzero(sound)
    edges = group_edges(surface)
    fans = vertex_fans(edges, mesh.n_vertices)
    used = flags(
        mesh.n_vertices, mesh.indices[(mesh.indices >= 0) & (mesh.indices < mesh.n_vertices)]
    )
    oriented = len(edges.same_way) == 0
    one_sided = np.zeros(surface.n_faces, dtype=bool)
    if not oriented:
        one_sided = orient_faces(edges, surface.n_faces)[1]
    n_loops, loop_vertex = boundary_loops(edges)
    components = _Components(surface, edges, fans, loop_vertex, one_sided)
    genus, contradictions = component_genus(
        components.euler, components.loops, components.is_surface
    )
    inside_out = edges.same_way[:0] if one_sided.any() else edges.same_way
    flat, short = _without_extent(surface, edges)
    places: Mapping[str, IntArray] = {
        "small-face": np.flatnonzero(small),
        "index-range": np.flatnonzero(out_of_range),
        "repeated-vertex": np.flatnonzero(repeating),
        "not-finite": np.flatnonzero(~(np.abs(mesh.vertices) <= FAR).all(axis=1) & used),
        "non-manifold-edge": edges.ends(np.flatnonzero(edges.sizes > 2)),
        "non-orientable": kept[one_sided],
        "duplicate-face": kept[first_alike(surface) != np.arange(surface.n_faces)],
        "euler": components.first_vertex[contradictions],
        "unreferenced-vertex": np.flatnonzero(~used),
        "non-manifold-vertex": np.flatnonzero(fans > 1),
        "inconsistent-orientation": edges.ends(inside_out),
        "zero-area-face": kept[flat],
        "zero-length-edge": edges.ends(np.flatnonzero(short)),
        "open-seam": _on_seams(surface, edges),
        "lone-face": components.first_vertex[components.faces == 1],
    }
    n_edges = len(edges.sizes)
    if not sound.all():  # those of all polygons, which may pass a vertex twice
        every = group_edges(keep_faces(mesh, ~(small | out_of_range)))
        n_edges = int(np.count_nonzero(every.tail[every.first] != every.head[every.first]))
    sizes, numbers = np.unique(mesh.face_sizes, return_counts=True)
    return MeshReport(
        n_vertices=mesh.n_vertices,
        n_edges=n_edges,
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
        findings=tuple(
            rule.finding(places[rule.name], mesh.n_vertices)
            for rule in _RULES
            if len(places[rule.name])
        ),
    )


def _without_extent(mesh: PolyMesh, edges: EdgeGroups) -> tuple[BoolArray, BoolArray]:
    """Return which faces have no area, (F,), and which edges no length, (E,)."""
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
            flat = np.sqrt(area2) <= FLAT * np.add.reduceat(length2, mesh.offsets[:-1])
        return flat, length2[edges.first] == 0


def _on_seams(mesh: PolyMesh, edges: EdgeGroups) -> IntArray:
    """Return the vertices on the boundary that have another at the same place."""
    rim = edges.rim[np.isfinite(mesh.vertices[edges.rim]).all(axis=1)]
    group = same_position_groups(mesh.vertices[rim])
    return rim[np.bincount(group, minlength=1)[group] > 1]


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
