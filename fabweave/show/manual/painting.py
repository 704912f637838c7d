"""Paint the object as far as it is woven: new pieces solid, what is in place pale.

Every tone is as light as its meaning asks, whatever its hue: a grey print tells what is new, what
is in place and where pieces end as the colours do.
"""

import zlib
from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.ndimage import binary_fill_holes

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value
from fabweave.core.colour_space import Colours, bytes_of, light_of
from fabweave.former.plates import Former, Laid, plate_body
from fabweave.former.way_out import Leaving, leaving
from fabweave.picture.camera import Frame, View, frame_object
from fabweave.picture.render import facet_normals
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.picture.zbuffer import (
    covered_pixels,
    nearest_places,
    nearest_triangles,
    nearness_map,
)
from fabweave.piece.development import PieceRungs, piece_stretches
from fabweave.piece.piece import Piece
from fabweave.plan.crossing_map import CrossingMap
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: What each pixel shows, by number.
Numbers: TypeAlias = npt.NDArray[np.integer[Any]]
#: While a smaller share of all pieces is in place, pictures show the table and what is to come.
EARLY = 0.25
#: The radius of the table by that of the object; so many squares go from its middle to its edge.
_TABLE, _SQUARES = 1.1, 5


@frozen_value
class Palette:
    """The colours of all pictures of a job.

    Parameters
    ----------
    own : (P,) int array
        The number of each piece's own colour.
    tones : (C, 8, 3) uint8 array
        Each own colour as it is shown in place and new, from dark to light.
    """

    own: IntArray
    tones: Colours

    @property
    def all(self) -> Colours:
        """The colours that are fixed, and then all tones, (N, 3)."""
        return np.concatenate((np.array(FIXED, dtype=np.uint8), self.tones.reshape(-1, 3)))


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
    palette : Palette
    stretches : PieceRungs
        The rungs of each piece, and its stations on them.
    plate_corners, plate : (N, 3, 3) float array, (N,) int array
        The triangles of a former, if there is one, and the plate of each.
    leaving : Leaving
        When that comes out.
    """

    points: FloatArray
    triangles: IntArray
    normals: FloatArray
    piece: IntArray
    step: IntArray
    step_of_piece: IntArray
    palette: Palette
    stretches: PieceRungs
    plate_corners: FloatArray
    plate: IntArray
    leaving: Leaving

    @property
    def n_steps(self) -> int:
        """How many steps there are."""
        return int(self.step_of_piece.max(initial=-1)) + 1

    @cached_property
    def early(self) -> BoolArray:
        """Which steps come while few pieces are in place, (S,): the object stands on the table."""
        before = np.searchsorted(np.sort(self.step_of_piece), np.arange(self.n_steps))
        return np.asarray(before < EARLY * len(self.step_of_piece))

    @cached_property
    def beyond(self) -> BoolArray:
        """Which triangles are in the half of their piece at its end, (T,)."""
        count = np.bincount(self.piece, minlength=len(self.step_of_piece))
        place = np.arange(len(self.piece)) - (np.cumsum(count) - count)[self.piece]
        return np.asarray(2 * place >= count[self.piece])

    @cached_property
    def _used(self) -> FloatArray:
        """The points of triangles."""
        return self.points[np.unique(self.triangles)]

    def frame(self, view: View, size_px: tuple[int, int], *, table: bool = False) -> Frame:
        """Return the frame that the whole object fills, alone or with its table."""
        points = self._used
        if table:
            middle, radius = self.table
            turn = np.radians(np.arange(0.0, 360.0, 5.0))
            edge = middle + radius * np.stack((np.cos(turn), np.sin(turn), 0.0 * turn), axis=1)
            points = np.concatenate((points, edge))
        return frame_object(points, view, size_px, 0.01 if table else 0.05)

    def former_seen(self, frame: Frame, step: int) -> tuple[IntArray, FloatArray]:
        """Return which plate each pixel shows when a step is done, or -1, and how near it is."""
        points = frame.pixels(self.plate_corners.reshape(-1, 3))
        triangles = np.arange(len(points) if step + 1 < self.leaving.until else 0).reshape(-1, 3)
        seen, near = nearest_triangles(
            points, triangles, width=frame.width_px, height=frame.height_px
        )
        return np.append(self.plate, -1)[seen], near

    @cached_property
    def table(self) -> tuple[FloatArray, float]:
        """The middle of the round table that the finished object stands on, and its radius."""
        points = self._used
        low, high = points.min(axis=0), points.max(axis=0)
        middle = np.array([*(low + high)[:2] / 2.0, low[2]])
        return middle, _TABLE * float(np.linalg.norm((points - middle)[:, :2], axis=1).max())

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
    laid: Laid | None = None,
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
    laid : Laid, optional
        The former that strips are laid on.
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
    former = Former((), 0.0) if laid is None else laid.former
    bodies = [plate_body(plate, former.thickness_mm) for plate in former.plates]
    return Scene(
        vertices,
        triangles[row],
        facet_normals(vertices, triangles[row])[:, 0],
        piece,
        step_of_piece[piece],
        step_of_piece,
        make_palette(colours),
        stretches,
        np.concatenate([np.empty((0, 3, 3)), *bodies]),
        np.repeat(np.arange(len(bodies)), np.array([len(body) for body in bodies], dtype=np.int64)),
        Leaving(0, 0, "") if laid is None else leaving(laid, crossing_map.steps),
    )


#: Pixels in a millimetre of a picture, 200 in an inch: where pieces end, lines are one and three of
#: them wide, 0.13 and 0.38 mm, and the gap beside what is beneath is two.
PX_MM = 200.0 / 25.4
#: Points of a page in a pixel.
POINTS_PX = 72.0 / 25.4 / PX_MM
#: The number of a colour for each pixel: those that are fixed, and then each own colour's tones.
Codes: TypeAlias = npt.NDArray[np.uint16]
#: Relative luminance of what is in place, seen from inside and from outside in three lights, and
#: of what is new: their contrast is 3 at least, ( 0.45 + 0.05 ) / ( 0.11 + 0.05 ), and what is in
#: place stands out from the paper.
THERE, NEW = (0.45, 0.49, 0.54, 0.60), (0.05, 0.07, 0.09, 0.11)
_LEVELS = len(THERE) + len(NEW)
#: The first colours of every picture: paper, the outline of what is in place (5.9 against white),
#: black, what is still to come and its outline, the lines of the table, the shadow on it, and the
#: board of a former.
PAPER, OUTLINE, BLACK, COMING, GHOST, TABLE, SHADOW, BOARD = range(8)
FIXED = (*((grey,) * 3 for grey in (255, 100, 0, 240, 160, 215, 205)), (246, 240, 228))
#: Lines that hatch what is hidden of a new piece come again after so many pixels, and are so wide.
_HATCH_PX, _HATCH_LINE_PX = 9, 2
#: How hard pictures are deflated, 1 to 9: more takes twice the time and saves an eighth.
_LEVEL = 4
#: As many colours as a byte can number.
_MOST_NUMBERED = 256
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_KEY = (-0.42, 0.62, 0.66)


@frozen_value
class Painted:
    """A picture as it stands in the manual: many are held until they are written.

    Parameters
    ----------
    width_px, height_px : int
    packed : bytes
        Each pixel, row after row from the top, deflated: the number of its colour, or red, green
        and blue.
    colours : bytes
        Red, green and blue of each colour; empty where pixels have their own.
    """

    width_px: int
    height_px: int
    packed: bytes
    colours: bytes = b""

    @property
    def image(self) -> Image.Image:
        """The picture in RGB."""
        pixels = np.frombuffer(zlib.decompress(self.packed), dtype=np.uint8)
        if self.colours:
            pixels = np.frombuffer(self.colours, dtype=np.uint8).reshape(-1, 3)[pixels]
        return Image.fromarray(pixels.reshape(self.height_px, self.width_px, 3))


@frozen_value
class Shown:
    """What a picture shows.

    Parameters
    ----------
    near : (height, width) float array
        How near it is, in pixels; minus infinity where there is nothing.
    pixel, piece : (N,) int arrays
        The pixels that show new pieces, row after row, and which.
    inner : (N,) bool array
        Whether the inner face of that is seen.
    """

    near: FloatArray
    pixel: IntArray
    piece: Numbers
    inner: BoolArray

    def of(self, piece: int) -> IntArray:
        """Return which pixels show a new piece."""
        return self.pixel[self.piece == piece]


def packed(pixels: Colours) -> Painted:
    """Return a picture of given pixels, (height, width, 3)."""
    return Painted(pixels.shape[1], pixels.shape[0], zlib.compress(pixels.tobytes(), _LEVEL))


def packed_by_number(code: Codes, colours: Colours) -> Painted:
    """Return a picture of numbered colours: a third as many bytes, if a byte can number them."""
    used = np.flatnonzero(np.bincount(code.ravel(), minlength=len(colours)))
    if len(used) > _MOST_NUMBERED:
        return packed(colours[code])
    number = np.zeros(len(colours), dtype=np.uint8)
    number[used] = np.arange(len(used))
    high, wide = code.shape
    return Painted(
        wide, high, zlib.compress(number[code].tobytes(), _LEVEL), colours[used].tobytes()
    )


def make_palette(colours: Colours) -> Palette:
    """Return the tones of pieces that have given colours, (P, 3)."""
    own, number = np.unique(colours, axis=0, return_inverse=True)
    light = light_of(own)
    tones = [_toned(light, luminance) for luminance in (*THERE, *NEW)]
    return Palette(number.ravel().astype(np.int64), bytes_of(np.stack(tones, axis=1)))


def _toned(light: FloatArray, luminance: float) -> FloatArray:
    """Mix each colour, (C, 3) of linear light, with white or black to a luminance.

    Examples
    --------
    >>> _toned(np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), 0.5).round(3).tolist()
    [[1.0, 0.365, 0.365], [0.5, 0.5, 0.5]]
    """
    own = light @ _LUMINANCE
    dark = light * np.minimum(1.0, luminance / np.maximum(own, 1e-9))[:, None]
    white = np.clip((luminance - own) / np.maximum(1.0 - own, 1e-9), 0.0, 1.0)[:, None]
    return np.asarray(dark + (1.0 - dark) * white)


class Stage:
    """One frame in which the object grows: each picture begins with the one before.

    The state of a book of pictures, not a value. Steps come in order.

    Parameters
    ----------
    scene : Scene
    frame : Frame
        What is beyond it is not painted.
    table : bool
        Whether the table is seen, with the shadow that what is new drops on it.
    """

    def __init__(self, scene: Scene, frame: Frame, *, table: bool = False) -> None:
        """Start with nothing in place."""
        self.scene, self.frame, self._table = scene, frame, table
        self._points = frame.pixels(scene.points)
        inside = np.flatnonzero(_in_frame(self._points, scene.triangles, frame))
        # Where two pieces lap, they lie in one place: the new one is seen, so it is the first.
        last = -scene.step[inside]
        order = np.argsort(last, kind="stable")
        self._triangles, self._last = inside[order], last[order]
        # The last of each is of pixels that show nothing.
        self._piece = np.append(scene.piece, -1).astype(np.int32)
        self._darkest = np.append(len(FIXED) + scene.palette.own[scene.piece] * _LEVELS, PAPER)
        self._tone = (self._darkest + np.append(_levels(scene, frame), 0)).astype(np.uint16)
        self._size = {"width": frame.width_px, "height": frame.height_px}
        pixels = frame.height_px * frame.width_px
        self._seen, self._near = np.full(pixels, -1), np.full(pixels, -np.inf)
        self._done = 0

    def paint(self, step: int, first_new: int, *, coming: bool) -> tuple[Painted, Shown]:
        """Paint what is in place after a step, and the former that is still inside.

        Parameters
        ----------
        step, first_new : int
            What came in steps from the one to the other is new; none of them was painted before.
        coming : bool
            Whether what is still to come is a faint ground, with an outline around the whole.
        """
        self._add(self._done, first_new)
        covered, fresh, shown = self._add(first_new, step + 1)
        self._done = step + 1
        shape = self.frame.height_px, self.frame.width_px
        seen, near, new = (
            self._seen,
            self._near.copy(),
            np.flatnonzero(flags(self._seen.size, shown)),
        )
        code, ends = self._tone.take(seen), self._piece.take(seen)
        if coming or self._table:
            bare = seen < 0
            code[bare] = self._ground(step, first_new, coming=coming).ravel()[bare]
        code[new] += len(THERE)
        if step + 1 < self.scene.leaving.until:
            plate, board = (each.ravel() for each in self._former)
            shut = board > near
            code[shut], new = BOARD, new[~shut[new]]
            ends[shut] = len(self.scene.step_of_piece) + plate[shut]
            near = np.maximum(near, board)
        _draw_ends(code, ends, near, new, self.frame.width_px)
        # A strip winds around the object: hatching shows where it goes on behind what is in front.
        down, across = np.divmod(covered, self.frame.width_px)
        hatched = (down + across) % _HATCH_PX < _HATCH_LINE_PX
        hatched &= ~flags(len(code), new)[covered]
        code[covered[hatched]] = self._darkest[fresh[hatched]] + len(THERE)
        triangle = seen[new]
        inner = self.scene.normals[triangle] @ self.frame.axes[2] < 0.0
        return packed_by_number(code.reshape(shape), self.scene.palette.all), Shown(
            near.reshape(shape), new, self._piece[triangle], inner
        )

    def _add(self, low: int, high: int) -> tuple[IntArray, IntArray, IntArray]:
        """Put what comes from one step on and before another in place.

        Returns
        -------
        covered, triangle : (N,) int arrays
            Pixels that it would cover alone, and what they would show.
        shown : (M,) int array
            Pixels that show it.
        """
        begin, end = np.searchsorted(self._last, (1 - high, 1 - low))
        own = self._triangles[begin:end]
        triangle, covered, near = nearest_places(
            self._points, self.scene.triangles[own], **self._size
        )
        triangle, near = own[triangle], near[covered]
        wins = near >= self._near[covered]
        shown = covered[wins]
        self._near[shown], self._seen[shown] = near[wins], triangle[wins]
        return covered, triangle, shown

    def _ground(self, step: int, first_new: int, *, coming: bool) -> Codes:
        """Return what is seen of the ground, and of what is to come."""
        code = self._empty.copy()
        if coming:
            last, outline = self._whole
            code[last > step] = COMING
            code[outline] = GHOST
        if self._table:
            fresh = (self.scene.step >= first_new) & (self.scene.step <= step)
            code[covered_pixels(self._fallen, self.scene.triangles[fresh], **self._size)] = SHADOW
        return code

    @cached_property
    def _empty(self) -> Codes:
        """The ground alone."""
        code = np.full((self.frame.height_px, self.frame.width_px), PAPER, dtype=np.uint16)
        if self._table:
            code[table_lines(self.scene, self.frame)] = TABLE
        return code

    @cached_property
    def _whole(self) -> tuple[FloatArray, BoolArray]:
        """The last step that covers each pixel, and the outline of the whole object."""
        points = self._points[self.scene.triangles[self._triangles]]
        points[..., 2] = self.scene.step[self._triangles, None]
        corners = np.arange(3 * len(points)).reshape(-1, 3)
        last = nearness_map(points.reshape(-1, 3), corners, **self._size)
        last = last.reshape(self._empty.shape)
        body = binary_fill_holes(last >= 0.0)
        return last, body & _grown(~body, body.shape[1]).reshape(body.shape)

    @cached_property
    def _fallen(self) -> FloatArray:
        """Where the shadow of each point falls on the table, in pixels."""
        flat = self.scene.points * (1.0, 1.0, 0.0) + self.scene.table[0] * (0.0, 0.0, 1.0)
        return self.frame.pixels(flat)

    @cached_property
    def _former(self) -> tuple[IntArray, FloatArray]:
        """The former while it is inside."""
        return self.scene.former_seen(self.frame, 0)


def table_lines(scene: Scene, frame: Frame) -> BoolArray:
    """Return which pixels show a line of the table: its edge, or those between its squares."""
    middle, radius = scene.table
    # Where the ray of each pixel meets the table, in squares from its middle.
    left, top = frame.pixels(middle[None])[0, :2]
    across, down = np.arange(frame.width_px) + 0.5 - left, np.arange(frame.height_px) + 0.5 - top
    flat = frame.axes[:2, :2] * ((1.0,), (-1.0,)) * frame.pixels_per_mm
    ways = np.linalg.inv(flat) * (_SQUARES / radius)
    x, y = (way[0] * across + (way[1] * down)[:, None] for way in ways)
    inside = x * x + y * y <= _SQUARES**2
    lines = np.zeros(inside.shape, dtype=bool)
    columns, rows = np.floor(x), np.floor(y)
    for one, two in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        other = (columns[one] != columns[two]) | (rows[one] != rows[two])
        lines[one] |= (inside[one] != inside[two]) | (inside[one] & other)
    lines[-1] |= inside[-1]
    lines[:, -1] |= inside[:, -1]
    return lines


def _in_frame(points: FloatArray, triangles: IntArray, frame: Frame) -> BoolArray:
    """Return which triangles may be seen in a frame, by the boxes around them."""
    inside = np.ones(len(triangles), dtype=bool)
    for axis, size in enumerate((frame.width_px, frame.height_px)):
        one, two, three = points[:, axis][triangles.T]
        inside &= np.maximum(np.maximum(one, two), three) > 0.0
        inside &= np.minimum(np.minimum(one, two), three) < size
    return inside


def _levels(scene: Scene, frame: Frame) -> IntArray:
    """Return which tone of its own colour each triangle has in place, (T,)."""
    key = np.array(_KEY)
    light = scene.normals @ (key / np.linalg.norm(key) @ frame.axes)
    back = scene.normals @ frame.axes[2] < 0.0
    steps = np.clip(np.floor(3.0 * light), 0, 2).astype(np.int64)
    return np.asarray(np.where(back, 0, 1 + steps))


def _draw_ends(code: Codes, piece: Numbers, near: FloatArray, new: IntArray, width: int) -> None:
    """Draw lines along the ends of pieces and plates, and a white gap beside on what is beneath.

    So at each crossing the rails of the upper strand go through, and the lower one's are broken.
    Pixels stand row after row, ``width`` to each.
    """
    across = np.flatnonzero(piece[1:] != piece[:-1])
    across = across[(across + 1) % width > 0]
    down = np.flatnonzero(piece[width:] != piece[:-width])
    one, two = np.append(across, down), np.append(across + 1, down + width)
    first = near[one] >= near[two]
    upper, lower = np.where(first, one, two), np.where(first, two, one)
    upper = upper[piece[upper] >= 0]
    gap = _grown(flags(len(piece), lower), width) & (piece >= 0)
    gap[upper] = False
    code[np.flatnonzero(gap)] = PAPER
    code[upper] = np.where(code[upper] == BOARD, GHOST, OUTLINE)
    fresh = flags(len(piece), new)
    ends = flags(len(piece), upper[fresh[upper]])
    code[np.flatnonzero(_grown(_grown(ends, width), width) & fresh & ~gap)] = BLACK


def _grown(mask: BoolArray, width: int) -> BoolArray:
    """Return a mask of rows of pixels with those beside it, above and below."""
    rows = mask.reshape(-1, width)
    grown = rows.copy()
    grown[1:] |= rows[:-1]
    grown[:-1] |= rows[1:]
    grown[:, 1:] |= rows[:, :-1]
    grown[:, :-1] |= rows[:, 1:]
    return grown.ravel()
