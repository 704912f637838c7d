"""Hold what a mesh check found."""

from dataclasses import dataclass

#: How many places a message names.
_NAMED = 5


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
