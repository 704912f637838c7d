"""Hold all pieces in space as the pictures of the steps show them."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.flat.crossing_map import CrossingMap
from fabweave.flat.piece import Piece
from fabweave.flat.unfold.development import Stretches, piece_stretches
from fabweave.picture.camera import Frame, View, frame_object
from fabweave.picture.shading import facet_normals
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave


@frozen_value
class Scene:
    """All pieces in space: triangles with their piece and the step in which they come.

    Parameters
    ----------
    points : (V, 3) float array
        The right and the left end of each rung, one after the other, in millimetres.
    triangles : (T, 3) int array
    normals : (T, 3) float array
        Of unit length.
    piece, step : (T,) int arrays
        The piece of each triangle, and the step in which it comes, from 0.
    step_of_piece : (P,) int array
    colours : (P, 3) uint8 array
        The own colour of each piece.
    stretches : Stretches
        The rungs of each piece, and its stations on them.
    """

    points: FloatArray
    triangles: IntArray
    normals: FloatArray
    piece: IntArray
    step: IntArray
    step_of_piece: IntArray
    colours: Colours
    stretches: Stretches

    @property
    def n_steps(self) -> int:
        """How many steps there are."""
        return int(self.step_of_piece.max(initial=-1)) + 1

    def frame(self, view: View, size_px: tuple[int, int]) -> Frame:
        """Return the frame that the whole object fills."""
        return frame_object(self.points[np.unique(self.triangles)], view, size_px)

    def middle_line(self, piece: int) -> FloatArray:
        """Return the middles of a piece's rungs in space, (N, 3)."""
        ends = self.rung_ends(piece)
        return np.asarray(ends.mean(axis=1))

    def rung_ends(self, piece: int) -> FloatArray:
        """Return both ends of each rung of a piece, (N, 2, 3)."""
        low, high = self.stretches.offsets[piece : piece + 2].tolist()
        rung = self.stretches.rung[low:high]
        return np.stack((self.points[2 * rung], self.points[2 * rung + 1]), axis=1)

    def panel(self, piece: int, station: int) -> int:
        """Return at which of a piece's rungs the panel of a station begins."""
        return int(self.stretches.panel[self.stretches.panel_offsets[piece] + station])


def build_scene(
    ribbons: Ribbons,
    weave: Weave,
    pieces: Sequence[Piece],
    crossing_map: CrossingMap,
    colours: Colours,
) -> Scene:
    """Put all pieces into space.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space.
    pieces : sequence of Piece
        All pieces of the job, as the map has them.
    crossing_map : CrossingMap
        Whose steps they come in.
    colours : (P, 3) uint8 array
        The colour of each piece.
    """
    vertices, triangles, _ = ribbon_triangles(ribbons)
    placed = {key: at for at, step in enumerate(crossing_map.steps) for key in step.pieces}
    step_of_piece = np.array([placed[piece.id] for piece in pieces], dtype=np.int64)
    stretches = piece_stretches(ribbons, weave, pieces)
    rung, piece = stretches.quads()
    # Each quad is two triangles; rungs that nothing follows begin none.
    number = np.full(len(ribbons.right), -1, dtype=np.int64)
    near = triangles[::2, 0] // 2
    number[near] = np.arange(len(near))
    row = (2 * number[rung][:, None] + (0, 1)).ravel()
    piece = np.repeat(piece, 2)
    return Scene(
        vertices,
        triangles[row],
        facet_normals(vertices, triangles[row])[:, 0],
        piece,
        step_of_piece[piece],
        step_of_piece,
        colours,
        stretches,
    )
