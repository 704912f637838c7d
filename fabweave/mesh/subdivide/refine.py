"""Name the refinement schemes, and run chains of them such as ``simplest:1,catmull-clark:2``."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TypeAlias

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.subdivide.catmull_clark import catmull_clark, catmull_clark_limit, split_to_quads
from fabweave.mesh.subdivide.dual import doo_sabin, simplest
from fabweave.mesh.subdivide.loop import loop, loop_limit, mid_edge
from fabweave.mesh.subdivide.sqrt3 import sqrt3

#: Largest result that is begun.
MOST_FACES = 4_000_000
_MOST_STEPS = 100


#: Takes a mesh, a number of steps, whether to end on the limit surface, and progress.
Run: TypeAlias = Callable[[PolyMesh, int, bool, Progress], PolyMesh]
_Step: TypeAlias = Callable[[PolyMesh], PolyMesh]


@dataclass(frozen=True)
class Scheme:
    """One way to refine a mesh.

    Parameters
    ----------
    name, text : str
        Its name, and what it does in one line.
    faces : str
        What all faces of the result are: ``quads``, ``triangles`` or ``polygons``.
    smooth : bool
        Whether it rounds the shape; else the shape stays as it is.
    run : callable
        Takes a mesh, a number of steps, whether to end on the limit surface, and a progress
        callback; returns the refined mesh.
    grow : callable
        Takes the numbers of vertices, edges and faces, and returns those after a step of a
        closed mesh.
    """

    name: str
    text: str
    faces: str
    smooth: bool
    run: Run
    grow: Callable[[int, int, int], tuple[int, int, int]]


def _repeated(name: str, step: _Step, to_limit: _Step | None = None) -> Run:
    def run(mesh: PolyMesh, steps: int, limit: bool, progress: Progress) -> PolyMesh:
        for number in range(steps):
            progress(name, number, steps)
            mesh = step(mesh)
        return to_limit(mesh) if limit and to_limit else mesh

    return run


def _to_quads(v: int, e: int, f: int) -> tuple[int, int, int]:
    return v + e + f, 4 * e, 2 * e


def _through_middles(v: int, e: int, f: int) -> tuple[int, int, int]:
    return v + e, 4 * e, f + 2 * e


#: All schemes, in the order in which they are listed.
SCHEMES: tuple[Scheme, ...] = (
    Scheme(
        "catmull-clark",
        "every n-gon becomes n quads; smooth, on the limit surface",
        "quads",
        True,
        _repeated("catmull-clark", catmull_clark, catmull_clark_limit),
        _to_quads,
    ),
    Scheme(
        "doo-sabin",
        "faces, edges and vertices become faces; smooth, all inner vertices have four edges",
        "polygons",
        True,
        _repeated("doo-sabin", doo_sabin),
        lambda v, e, f: (2 * e, 4 * e, v + e + f),
    ),
    Scheme(
        "simplest",
        "joins the middles of edges (Peters-Reif); half a doo-sabin step, smooth",
        "polygons",
        True,
        _repeated("simplest", simplest),
        lambda v, e, f: (e, 2 * e, v + f),
    ),
    Scheme(
        "sqrt3",
        "a vertex in every face, old edges flipped; smooth, on the limit surface",
        "triangles",
        True,
        lambda mesh, steps, limit, progress: sqrt3(mesh, steps, limit=limit, progress=progress),
        lambda v, e, f: (v + f, 3 * e, 2 * e),
    ),
    Scheme(
        "loop",
        "every n-gon becomes n triangles and an n-gon; smooth, on the limit surface",
        "polygons",
        True,
        _repeated("loop", loop, loop_limit),
        _through_middles,
    ),
    Scheme(
        "mid-edge",
        "every n-gon becomes n triangles and an n-gon; the shape stays (for triaxial twill)",
        "polygons",
        False,
        _repeated("mid-edge", mid_edge),
        _through_middles,
    ),
    Scheme(
        "quads",
        "every n-gon becomes n quads; the shape stays",
        "quads",
        False,
        _repeated("quads", split_to_quads),
        _to_quads,
    ),
)


@dataclass(frozen=True)
class Refinement:
    """Some steps of one scheme.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    steps : int
        Number of steps.

    Raises
    ------
    InputError
        If there is no such scheme, or the number is out of range.
    """

    scheme: str
    steps: int = 1

    def __post_init__(self) -> None:
        """Check both."""
        find_scheme(self.scheme)
        if not 1 <= self.steps <= _MOST_STEPS:
            raise InputError(f"{self.scheme} takes from 1 to {_MOST_STEPS} steps, not {self.steps}")


def find_scheme(name: str) -> Scheme:
    """Return the scheme of a name.

    Raises
    ------
    InputError
        If there is none; the message lists them.

    Examples
    --------
    >>> find_scheme("sqrt3").faces
    'triangles'
    """
    for scheme in SCHEMES:
        if scheme.name == name:
            return scheme
    names = ", ".join(scheme.name for scheme in SCHEMES)
    raise InputError(f"there is no refinement {name[:40]!r}; choose one of {names}")


def parse_refinements(text: str) -> tuple[Refinement, ...]:
    """Read a chain of refinements.

    Parameters
    ----------
    text : str
        Schemes joined by commas, each with a colon and a number of steps, or one step without.

    Returns
    -------
    tuple of Refinement
        In the order in which they are taken; empty for an empty text.

    Raises
    ------
    InputError
        If a scheme or a number is wrong; the message says what is right.

    Examples
    --------
    >>> parse_refinements("simplest,catmull-clark:2")
    (Refinement(scheme='simplest', steps=1), Refinement(scheme='catmull-clark', steps=2))
    """
    result = []
    for part in text.split(",") if text.strip() else ():
        name, colon, number = (piece.strip() for piece in part.partition(":"))
        scheme = find_scheme(name)
        if colon and not (number.isascii() and number.isdigit() and len(number) < 10):
            raise InputError(
                f"{part.strip()[:60]!r} should read {scheme.name}:STEPS, such as {scheme.name}:2"
            )
        result.append(Refinement(scheme.name, int(number) if colon else 1))
    return tuple(result)


def format_refinements(refinements: Sequence[Refinement]) -> str:
    """Return the text that `parse_refinements` reads as these refinements.

    Examples
    --------
    >>> format_refinements([Refinement("simplest"), Refinement("catmull-clark", 2)])
    'simplest:1,catmull-clark:2'
    """
    return ",".join(f"{item.scheme}:{item.steps}" for item in refinements)


def predict_faces(mesh: PolyMesh, refinements: Sequence[Refinement]) -> int:
    """Return how many faces a refined mesh will have.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh before.
    refinements : sequence of Refinement
        What is to be done.

    Returns
    -------
    int
        The number of faces: exact for closed meshes whose vertices have three edges or more,
        near for others. Counting stops beyond `MOST_FACES`.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> predict_faces(cube(), parse_refinements("catmull-clark:2"))
    96
    """
    if not refinements:
        return mesh.n_faces
    counts = mesh.n_vertices, build_halfedges(mesh).n_edges, mesh.n_faces
    for item in refinements:
        scheme = find_scheme(item.scheme)
        for _ in range(item.steps):
            if counts[2] > MOST_FACES:
                return counts[2]
            counts = scheme.grow(*counts)
    return counts[2]


def refine_mesh(
    mesh: PolyMesh, refinements: Sequence[Refinement], *, progress: Progress = no_progress
) -> PolyMesh:
    """Refine a mesh, one refinement after the other.

    Smooth schemes that have a limit mask for vertices end on the limit surface. That step is
    left out where another smooth scheme follows, which goes on from the control mesh; steps of
    one scheme that follow each other count as one refinement.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh, as `prepare_mesh` returns it; boundaries are allowed.
    refinements : sequence of Refinement
        What to do.
    progress : callable
        Told of each step.

    Returns
    -------
    PolyMesh
        The refined mesh: oriented, manifold, with the components, the genus and the boundary
        loops of the old one.

    Raises
    ------
    CannotMakeError
        If the result would have more than `MOST_FACES` faces, or a scheme cannot hold the mesh.
    InputError
        If the mesh is not an oriented manifold.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> ball = refine_mesh(cube(), parse_refinements("catmull-clark:2"))
    >>> ball.n_vertices, ball.n_faces
    (98, 96)
    """
    predicted = predict_faces(mesh, refinements)
    if predicted > MOST_FACES:
        raise CannotMakeError(
            f"refining {mesh.n_faces} faces with {format_refinements(refinements)} would give "
            f"about {predicted} faces or more, but the limit is {MOST_FACES}; take fewer steps"
        )
    runs = [
        (find_scheme(name), sum(item.steps for item in items))
        for name, items in groupby(refinements, key=lambda item: item.scheme)
    ]
    for number, (scheme, steps) in enumerate(runs):
        followed = number + 1 < len(runs) and runs[number + 1][0].smooth
        mesh = scheme.run(mesh, steps, not followed, progress)
    return mesh
