"""Read the woven mesh and trace the straight-ahead walks of its medial graph.

An *arc* is a corner of a face: it joins the middles of the two edges that meet there. Arc ``c``
has two ends, ``2 c`` on the edge that enters the corner and ``2 c + 1`` on the edge that leaves
it. Four arcs meet at the middle of an inner edge; a strand goes straight on into the opposite one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import Floats, Ints, ReadError
from fabweave.verify.read.content import read_content


@dataclass(frozen=True, eq=False)
class LoadedMesh:
    """A polygon mesh; corner ``c`` is also the side from its vertex to the next corner's."""

    vertices: Floats
    corner: Ints
    face: Ints
    next: Ints
    prev: Ints
    twin: Ints
    centres: Floats
    #: How strands run over the faces, as the settings say.
    course: object = "auto"

    @property
    def inner(self) -> Ints:
        """One side of each inner edge."""
        sides = np.arange(len(self.corner))
        return np.flatnonzero(sides < self.twin)


@dataclass(frozen=True)
class Pass:
    """A strand crossing an edge.

    ``side`` is the mesh side of the face it comes from; ``forward`` says that it comes from the
    corner before that side, so from near the side's start. Both strands at an edge differ in it,
    and it is the same for both walking directions.
    """

    side: int
    forward: bool


@dataclass(frozen=True)
class Walk:
    """A straight-ahead walk: whether it returns, and its passes in order."""

    closed: bool
    passes: tuple[Pass, ...]


def read_obj(path: Path) -> LoadedMesh:
    """Read vertices and faces of an OBJ file as an oriented manifold mesh.

    Raises
    ------
    ReadError
        If a line is malformed, or an edge has more than two faces or two that run the same way.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(
        read_content(path).decode("utf-8", errors="replace").split("\n"), start=1
    ):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                vertices.append([float(word) for word in words[1:4]])
            elif words[:1] == ["f"]:
                faces.append([int(word.partition("/")[0]) - 1 for word in words[1:]])
        except ValueError as error:
            raise ReadError(f"line {number} is malformed: {error}") from error
    if not faces or any(len(vertex) != 3 for vertex in vertices):
        raise ReadError("it has no faces, or a vertex without three coordinates")
    positions = np.array(vertices)
    if not np.all(np.isfinite(positions)):
        raise ReadError("a vertex is not finite")
    sizes = np.array([len(face) for face in faces])
    corner = np.array([vertex for face in faces for vertex in face], dtype=np.int64)
    if sizes.min() < 3 or corner.min() < 0 or corner.max() >= len(positions):
        raise ReadError("a face has fewer than three corners or names a vertex that is not there")
    ends = np.cumsum(sizes)
    starts = ends - sizes
    following = np.arange(1, len(corner) + 1)
    following[ends - 1] = starts
    preceding = np.empty_like(following)
    preceding[following] = np.arange(len(corner))
    return LoadedMesh(
        vertices=positions,
        corner=corner,
        face=np.repeat(np.arange(len(faces)), sizes),
        next=following,
        prev=preceding,
        twin=_twins(corner, corner[following], len(positions)),
        centres=np.add.reduceat(positions[corner], starts) / sizes[:, None],
    )


def _twins(tail: Ints, head: Ints, count: int) -> Ints:
    """Pair the sides of each edge; -1 along the boundary."""
    forward = tail * count + head
    if len(np.unique(forward)) < len(forward):
        raise ReadError("two faces run the same way along an edge")
    order = np.argsort(forward)
    place = np.searchsorted(forward, head * count + tail, sorter=order)
    candidate = order[np.minimum(place, len(order) - 1)]
    return np.where(forward[candidate] == head * count + tail, candidate, -1)


def trace_walks(mesh: LoadedMesh, *, turning: bool = False) -> list[Walk]:
    """Trace every straight-ahead walk once, those that end at the boundary first.

    A corner between two boundary edges is an open walk without passes. On a closed mesh the
    passes are two for each edge. With ``turning``, the two arcs at the middle of a boundary edge
    join, so that every walk returns.
    """
    n_arcs = len(mesh.corner)
    opposite = np.full(2 * n_arcs, -1, dtype=np.int64)
    sides = np.flatnonzero(mesh.twin >= 0)
    twins = mesh.twin[sides]
    opposite[2 * mesh.prev[sides] + 1] = 2 * mesh.prev[twins] + 1
    opposite[2 * sides] = 2 * twins
    rim = np.flatnonzero(mesh.twin < 0)
    if turning:
        opposite[2 * mesh.prev[rim] + 1] = 2 * rim
        opposite[2 * rim] = 2 * mesh.prev[rim] + 1
    inner = (mesh.twin >= 0).tolist()
    jump = opposite.tolist()
    following = mesh.next.tolist()
    seen = [False] * n_arcs

    def follow(arc: int, leaving: int) -> list[Pass]:
        """Walk from an arc through one of its ends until a boundary or a walked arc."""
        passes: list[Pass] = []
        while True:
            seen[arc] = True
            entering = jump[leaving]
            if entering < 0:
                return passes
            forward = leaving % 2 == 1
            side = following[arc] if forward else arc
            if inner[side]:
                passes.append(Pass(side, forward))
            arc, leaving = entering // 2, entering ^ 1
            if seen[arc]:
                return passes

    walks = []
    for end in np.flatnonzero(opposite < 0).tolist():
        if not seen[end // 2]:
            walks.append(Walk(False, tuple(follow(end // 2, end ^ 1))))
    for arc in range(n_arcs):
        if not seen[arc]:
            walks.append(Walk(True, tuple(follow(arc, 2 * arc + 1))))
    return walks


def edge_keys(mesh: LoadedMesh) -> Ints:
    """Return for each side a number of its edge: the lesser of the two sides."""
    sides = np.arange(len(mesh.corner))
    return np.where(mesh.twin >= 0, np.minimum(sides, mesh.twin), sides)


def canonical(sequence: Sequence[int], closed: bool) -> tuple[tuple[int, ...], int, bool]:
    """Return the least form of a sequence up to reversal and, if closed, rotation.

    Returns
    -------
    form : tuple of int
        The least sequence.
    start : int
        Where it starts in the (reversed) sequence.
    backward : bool
        Whether the sequence had to be reversed.

    Examples
    --------
    >>> canonical([3, 1, 2], True)
    ((1, 2, 3), 1, False)
    >>> canonical([1, 3, 2], True)
    ((1, 2, 3), 2, True)
    """
    best: tuple[tuple[int, ...], int, bool] | None = None
    for backward in (False, True):
        words = tuple(reversed(sequence)) if backward else tuple(sequence)
        low = min(words, default=0)
        starts = [at for at, word in enumerate(words) if word == low] if closed else [0]
        for start in starts:
            form = words[start:] + words[:start]
            if best is None or form < best[0]:
                best = (form, start, backward)
    return best if best is not None else ((), 0, False)


def turned(step: Pass, mesh: LoadedMesh) -> Pass:
    """Return the same pass walked the other way."""
    return Pass(int(mesh.twin[step.side]), step.forward)


def lay_walk(
    claimed: Sequence[int], walk: Walk, keys: Ints, mesh: LoadedMesh
) -> Iterator[tuple[Pass, ...]]:
    """Lay a walk along a claimed sequence of edges, in every way in which the edges agree.

    Nearly always there is one way or none. There are more where the sequence reads the same
    backwards: a walk over one edge only, or a short ring.

    Yields
    ------
    tuple of Pass
        The passes in the claimed order and direction.
    """
    wanted = list(claimed)
    for passes in (walk.passes, tuple(turned(step, mesh) for step in reversed(walk.passes))):
        edges = [int(keys[step.side]) for step in passes]
        starts = [0]
        if walk.closed and wanted:
            starts = [at for at, edge in enumerate(edges) if edge == wanted[0]]
        for start in starts:
            if edges[start:] + edges[:start] == wanted:
                yield passes[start:] + passes[:start]
