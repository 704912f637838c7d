"""Hold what a mesh check found."""

from dataclasses import dataclass

from fabweave.core.arrays import IntArray
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh

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
