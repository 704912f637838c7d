"""Say what a model is: closed or open, with how many rims and handles, and of how thin a wall."""

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.mesh.bodies import bodies_of
from fabweave.mesh.check import MeshReport
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.rim_cut import boundary_walks
from fabweave.mesh.triangulate import polygon_triangles


@frozen_value
class Seen:
    """What a model was seen to be.

    Parameters
    ----------
    n_bodies, n_rims : int
        Bodies, and boundary loops of all of them.
    n_handles : int or None
        Handles of all of them; None where that cannot be told.
    wall_mm : float or None
        How thick the wall is whose outer side alone is woven, in the median; None for none.
    """

    n_bodies: int
    n_rims: int
    n_handles: int | None
    wall_mm: float | None = None

    @property
    def kind(self) -> str:
        """What it is, in a word or a few.

        Examples
        --------
        >>> Seen(1, 2, 0).kind, Seen(1, 0, 1).kind, Seen(1, 1, 2).kind, Seen(3, 0, 0).kind
        ('tube', 'torus', 'open surface with 1 rim and 2 handles', '3 bodies')
        """
        if self.n_bodies > 1:
            return f"{self.n_bodies} bodies"
        plain = {(1, 0): "disc", (2, 0): "tube", (0, 0): "ball", (0, 1): "torus"}
        if (name := plain.get((self.n_rims, self.n_handles or 0))) is not None:
            return name
        has = [agree(self.n_rims, "{n} rim[|s]")] if self.n_rims else []
        has += [agree(self.n_handles, "{n} handle[|s]")] if self.n_handles else []
        return f"{'open' if self.n_rims else 'closed'} surface with {' and '.join(has)}"

    @property
    def notes(self) -> list[Note]:
        """What a person should know of it, where it has a wall or a rim."""
        if self.wall_mm is not None:
            told = f"a thin wall of {self.wall_mm:.2g} mm, woven once, on its outside; --walls both"
            return [Note("model", f"model: {told} weaves both sides")]
        if self.n_rims and self.n_bodies == 1:
            kind = self.kind if self.kind.startswith("open") else f"open surface, a {self.kind}"
            rims = (
                ""
                if kind.startswith("open surface w")
                else (agree(self.n_rims, " with {n} rim[|s]"))
            )
            return [Note("model", f"model: an {kind}{rims}")]
        return []


def seen_of(report: MeshReport, wall_mm: float | None) -> Seen:
    """Return what a model is, by the report of its mesh."""
    return Seen(report.n_components, report.n_boundary_loops, report.genus, wall_mm)


#: A loop is a crack, and no rim, if it is shorter than this share of the greatest side of its body.
_CRACK = 0.05


def fill_cracks(mesh: PolyMesh) -> tuple[PolyMesh, int, list[Note]]:
    """Close boundary loops that are too short to be rims, with triangles between their vertices.

    Parameters
    ----------
    mesh : PolyMesh
        Oriented.

    Returns
    -------
    mesh : PolyMesh
    count : int
        How many triangles were added.
    notes : list of Note

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> fill_cracks(cube())[1:]
    (0, [])
    """
    loops = boundary_walks(mesh)
    if not loops:
        return mesh, 0, []
    body = np.empty(mesh.n_vertices, dtype=np.int64)
    of_face, _ = bodies_of(mesh)
    body[mesh.indices] = np.repeat(of_face, mesh.face_sizes)
    sides: dict[int, float] = {}
    filled, new = list[IntArray](), list[list[int]]()
    for loop in loops:
        one = int(body[loop[0]])
        if one not in sides:
            sides[one] = float(np.ptp(mesh.vertices[body == one], axis=0).max())
        around = mesh.vertices[loop] - mesh.vertices[np.roll(loop, 1)]
        if np.linalg.norm(around, axis=1).sum() >= _CRACK * sides[one] or len(loop) < 3:
            continue
        # A boundary runs along its faces; what closes it runs the other way.
        parts = polygon_triangles(mesh.vertices, loop[::-1].tolist())
        if len(parts) == len(loop) - 2:
            filled.append(loop)
            new += parts
    if not new:
        return mesh, 0, []
    every = PolyMesh.from_faces(mesh.vertices, [*mesh.faces(), *new])
    told = agree(len(filled), "{n} crack[|s] of the surface [was|were] closed")
    places = few_of([int(loop[0]) for loop in filled], 5)
    return every, len(new), [Note("repaired", f"{told} (at vertex {places}, counted from 0)")]
