"""Move the vertices of a mesh along its surface, without turning faces over."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, unit
from fabweave.mesh.fair.feature_lines import Lines
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_of_corner, next_corner

# A step is no longer than this share of a vertex's shortest portal or edge, or of the way to its
# neighbour on a line: two neighbours never pass one another.
_STRIDE = 0.35
# No triangle around a face's centre gets flatter than this (1 is a right angle between sides of
# equal length) unless it was, and then no flatter than it was.
_FLATTEST = 0.15
# Halvings of a step that would turn faces over, before their vertices stay where they are.
_HALVINGS = 4


@frozen_value
class Footing:
    """Where the vertices of a mesh stand on a surface.

    Parameters
    ----------
    positions : (V, 3) float array
    normals : (V, 3) float array
        Unit normals of the surface there.
    places : (S,) float array
        Where sliding vertices are on their lines.
    flatness : (H,) float array
        For each half-edge's triangle with its face's centre, twice its area as seen along the
        surface's normal, divided by the square of the longer side at the centre; negative if the
        triangle is turned over.
    """

    positions: FloatArray
    normals: FloatArray
    places: FloatArray
    flatness: FloatArray


class Ground:
    """The surface and the lines on which the vertices of a mesh move."""

    def __init__(self, mesh: PolyMesh, surface: Surface, lines: Lines) -> None:
        """Find out which vertices are free, which slide, and which stay."""
        self._mesh, self._surface, self._lines = mesh, surface, lines
        self._face, self._next = face_of_corner(mesh), next_corner(mesh)
        free = np.zeros(mesh.n_vertices, dtype=bool)
        free[mesh.indices] = True
        free[lines.fixed] = False
        free[lines.sliding] = False
        self._free: IntArray = np.flatnonzero(free)

    def start(self) -> Footing:
        """Return where the vertices of the mesh itself stand."""
        positions = self._mesh.vertices
        normals = self._surface.closest(positions)[1]
        return Footing(positions, normals, self._lines.place, self._flatness(positions, normals))

    def allowed(self, footing: Footing) -> FloatArray:
        """Return what projects moves to those along the surface or the lines, (V, 3, 3)."""
        result = np.zeros((self._mesh.n_vertices, 3, 3))
        normal = footing.normals[self._free]
        result[self._free] = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        along = self._lines.directions(footing.places)
        result[self._lines.sliding] = along[:, :, None] * along[:, None, :]
        return result

    def moved(self, footing: Footing, move: FloatArray) -> Footing:
        """Return where an allowed move leads to, shortened where faces would turn over.

        Parameters
        ----------
        footing : Footing
        move : (V, 3) float array
            Along the surface or the lines; long steps are shortened.

        Returns
        -------
        Footing
            Vertices on the surface or on their lines, without a triangle that became flatter
            than is allowed.
        """
        length = np.linalg.norm(move, axis=1)
        move = move * np.minimum(1.0, self._reach(footing) / np.maximum(length, 1e-300))[:, None]
        least = np.minimum(footing.flatness, _FLATTEST) - 1e-12
        share = np.ones(len(move))
        changed = np.any(move != 0, axis=1)
        reached, tries = footing, 0
        # This terminates: vertices of faces that stay too flat go back to where they were one by
        # one.
        while changed.any():
            reached = self._placed(footing, reached, move * share[:, None], changed)
            spoilt = np.zeros(self._mesh.n_faces, dtype=bool)
            spoilt[self._face[~(reached.flatness >= least)]] = True
            changed = np.zeros(len(move), dtype=bool)
            changed[self._mesh.indices[spoilt[self._face]]] = True
            changed &= share > 0
            tries += 1
            share[changed] = share[changed] / 2 if tries <= _HALVINGS else 0.0
        return reached

    def _reach(self, footing: Footing) -> FloatArray:
        """Return how far each vertex may move in one step, (V,)."""
        here, portal = self._around(footing.positions)
        edge = here[self._next] - here
        short = np.minimum(np.sum(portal**2, axis=1), np.sum(edge**2, axis=1))
        # An edge counts at both of its ends.
        short = np.minimum(short, np.sum((here - here[self._previous()]) ** 2, axis=1))
        reach = np.full(self._mesh.n_vertices, np.inf)
        np.minimum.at(reach, self._mesh.indices, np.sqrt(short))
        sliding = self._lines.sliding
        reach[sliding] = np.minimum(reach[sliding], self._lines.room(footing.places))
        return np.asarray(_STRIDE * reach)

    def _previous(self) -> IntArray:
        previous = np.empty_like(self._next)
        previous[self._next] = np.arange(len(previous))
        return previous

    def _placed(
        self, start: Footing, last: Footing, move: FloatArray, changed: BoolArray
    ) -> Footing:
        """Return where a move leads from the start; where not changed, as in the last try."""
        positions, normals = last.positions.copy(), last.normals.copy()
        free = self._free[changed[self._free]]
        up = start.normals[free]
        aims = self._surface.dropped(start.positions[free] + move[free], up)
        points, normal, _ = self._surface.closest(aims)
        # The closest point may be on the other side of something thin.
        stays = np.einsum("nd,nd->n", normal, up) <= 0
        stays |= ~np.any(move[free], axis=1)
        positions[free] = np.where(stays[:, None], start.positions[free], points)
        normals[free] = np.where(stays[:, None], start.normals[free], normal)

        slides = changed[self._lines.sliding]
        vertices = self._lines.sliding[slides]
        along = self._lines.directions(start.places)[slides]
        step = np.einsum("nd,nd->n", move[vertices], along)
        places = last.places.copy()
        places[slides] = start.places[slides] + step
        places = self._lines.wrapped(places)
        points = self._lines.at(places)[slides]
        positions[vertices] = np.where(step[:, None] == 0, start.positions[vertices], points)
        normals[vertices] = self._surface.closest(positions[vertices])[1]
        return Footing(positions, normals, places, self._flatness(positions, normals))

    def _around(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the position of each corner, and that relative to its face's centre."""
        here = positions[self._mesh.indices]
        return here, here - face_centres(self._mesh.with_vertices(positions))[self._face]

    def _flatness(self, positions: FloatArray, normals: FloatArray) -> FloatArray:
        starts = self._mesh.offsets[:-1]
        normal = unit(np.add.reduceat(normals[self._mesh.indices], starts, axis=0))[self._face]
        here = self._around(positions)[1]
        there = here[self._next]
        longer = np.maximum(np.sum(here**2, axis=1), np.sum(there**2, axis=1))
        area = np.einsum("hd,hd->h", np.cross(here, there), normal)
        return area / np.where(longer > 0, longer, 1.0)
