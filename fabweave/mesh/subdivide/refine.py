"""Name the refinement schemes, and run chains of them such as ``simplest:1,catmull-clark:2``."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TypeAlias

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.subdivide.dual import doo_sabin, simplest
from fabweave.mesh.subdivide.primal import (
    catmull_clark,
    catmull_clark_limit,
    loop,
    loop_limit,
    mid_edge,
    split_to_quads,
)
from fabweave.mesh.subdivide.sqrt3 import sqrt3

#: Largest result that is begun, in edges.
MOST_EDGES = 8_000_000
_MOST_STEPS = 100

_Step: TypeAlias = Callable[[PolyMesh], PolyMesh]


@dataclass(frozen=True)
class Scheme:
    """One way to refine a mesh.

    Parameters
    ----------
    name : str
    growth : int
        How many edges come of one in a step, at the boundary perhaps fewer.
    step : callable or None
        Takes a mesh and returns it after a step; None if `sqrt3` takes all steps at once.
    limit : callable or None
        Moves the vertices to where endless steps would take them.
    smooth : bool
        Whether it rounds the shape; else the shape stays as it is.
    """

    name: str
    growth: int
    step: _Step | None
    limit: _Step | None = None
    smooth: bool = True

    def run(self, mesh: PolyMesh, steps: int, *, to_limit: bool, progress: Progress) -> PolyMesh:
        """Return a mesh after some steps, on the limit surface if asked and known."""
        if self.step is None:
            return sqrt3(mesh, steps, limit=to_limit, progress=progress)
        for number in range(steps):
            progress(self.name, number, steps)
            mesh = self.step(mesh)
        return self.limit(mesh) if to_limit and self.limit else mesh


#: All schemes, in the order in which they are listed.
SCHEMES = (
    Scheme("catmull-clark", 4, catmull_clark, catmull_clark_limit),
    Scheme("doo-sabin", 4, doo_sabin),
    Scheme("simplest", 2, simplest),
    Scheme("sqrt3", 3, None),
    Scheme("loop", 4, loop, loop_limit),
    Scheme("mid-edge", 4, mid_edge, smooth=False),
    Scheme("quads", 4, split_to_quads, smooth=False),
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
    >>> find_scheme("mid-edge").smooth
    False
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
        If the result would have more than `MOST_EDGES` edges, or a scheme cannot hold the mesh.
    InputError
        If the mesh is not an oriented manifold.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> ball = refine_mesh(cube(), parse_refinements("catmull-clark:2"))
    >>> ball.n_vertices, ball.n_faces
    (98, 96)
    """
    growth = math.prod(find_scheme(item.scheme).growth ** item.steps for item in refinements)
    if growth * mesh.n_corners // 2 > MOST_EDGES:
        raise CannotMakeError(
            f"refining {mesh.n_faces} faces with {format_refinements(refinements)} would give "
            f"more than {MOST_EDGES} edges; take fewer steps"
        )
    runs = [
        (find_scheme(name), sum(item.steps for item in items))
        for name, items in groupby(refinements, key=lambda item: item.scheme)
    ]
    for number, (scheme, steps) in enumerate(runs):
        followed = number + 1 < len(runs) and runs[number + 1][0].smooth
        mesh = scheme.run(mesh, steps, to_limit=not followed, progress=progress)
    return mesh
