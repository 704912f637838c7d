"""Make the pictures of the steps: the new pieces dark, from where they are seen best."""

import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from PIL import Image

from fabweave.assembly.manual.pixels import GREY_STEP
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.crossing_map import CrossingMap
from fabweave.flat.piece import Piece
from fabweave.flat.unfold.stretch import piece_stretches
from fabweave.picture.camera import Frame, View, frame_object
from fabweave.picture.shading import facet_normals
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.picture.zbuffer import all_fragments
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: From where steps may be seen; the first is the usual place.
VIEWS = (
    *(View(-60.0 + 45.0 * turn, 28.0) for turn in range(8)),
    *(View(-60.0 + 45.0 * turn, -28.0) for turn in range(8)),
    View(-90.0, 80.0),
    View(-90.0, -80.0),
)
#: Pixels of a step's picture, and of those by which views are compared.
PICTURE_PX = (720, 560)
_TRIAL_PX = (180, 140)
#: What turning the object costs, where a view in which nothing new is seen costs 1 ...
_TURN = 0.4
#: ... and one in which a new piece cannot be seen at all so much more.
_BLIND = 5.0
#: Shades of grey: the ground, what is still to come, what is there, its outline. All are multiples
#: of ``GREY_STEP``.
_GROUND, _TO_COME, _COMING_EDGE, _OUTLINE = 255, 238, 204, 119
_THERE = (170, 221)
_NEW = (17, 68)
#: Light on a facet that is seen from behind, and what comes from the side.
_BEHIND, _EVEN = 0.55, 0.35
_KEY = (-0.42, 0.62, 0.66)


@frozen_value
class StepPicture:
    """The picture of one step.

    Parameters
    ----------
    packed : bytes
        Its shades of grey, deflated: a job has thousands of pictures.
    view : View
        From where.
    turned : bool
        Whether it is another view than that of the step before.
    pieces : dict from piece id to (x, y)
        Where each new piece is seen, in shares of the picture from the top left corner; those
        that are hidden are not there.
    joints : dict from joint id to (x, y)
        The same for joints that are made in this step.
    """

    packed: bytes
    view: View
    turned: bool
    pieces: dict[str, tuple[float, float]]
    joints: dict[int, tuple[float, float]]

    @property
    def image(self) -> Image.Image:
        """The picture in shades of grey."""
        return Image.frombytes("L", PICTURE_PX, zlib.decompress(self.packed))


def step_pictures(
    ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece], crossing_map: CrossingMap
) -> list[StepPicture]:
    """Make the picture of every step.

    All pieces that are there are light, the new ones dark; what is still to come is a faint
    ground. Views are chosen so that new pieces are seen and the object is turned seldom: the
    sequence of least cost, found exactly.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space.
    pieces : sequence of Piece
        All pieces of the job.
    crossing_map : CrossingMap

    Returns
    -------
    list of StepPicture
        One for each step.
    """
    scene = _scene(ribbons, weave, pieces, crossing_map)
    seen = np.array([_seen(scene, view) for view in VIEWS])
    chosen = choose_views(seen[:, :, 0], seen[:, :, 1])
    numbers = {piece.id: number for number, piece in enumerate(pieces)}
    positions = {joint.id: ribbons.centre[joint.crossing] for joint in crossing_map.joints}
    result: list[StepPicture | None] = [None] * len(crossing_map.steps)
    for number in np.unique(chosen).tolist():
        steps = np.flatnonzero(chosen == number).tolist()
        layers = _Layers(scene, VIEWS[number])
        for at in steps:
            step = crossing_map.steps[at]
            layers.place_until(at)
            result[at] = StepPicture(
                zlib.compress(layers.image(at).tobytes(), level=1),
                VIEWS[number],
                at > 0 and chosen[at] != chosen[at - 1],
                {
                    key: place
                    for key in step.pieces
                    if (place := layers.middle(numbers[key])) is not None
                },
                {
                    key: place
                    for key in step.joints
                    if (place := layers.spot(positions[key])) is not None
                },
            )
    return [picture for picture in result if picture is not None]


def choose_views(least: FloatArray, total: FloatArray) -> IntArray:
    """Choose a view for each step so that new pieces are seen and few steps turn the object.

    Parameters
    ----------
    least : (V, S) float array
        For each view and step, how much is seen of the new piece that is seen least.
    total : (V, S) float array
        How much is seen of all new pieces.

    Returns
    -------
    (S,) int array
        The sequence of views with the least sum of what is not seen, as a share of the most that
        any view shows, and of ``0.4`` for each turn.

    Examples
    --------
    >>> seen = np.array([[9.0, 8.0, 0.0, 9.0], [5.0, 9.0, 9.0, 8.0]])
    >>> choose_views(seen, seen).tolist()
    [0, 1, 1, 1]
    """
    worth = least + 0.1 * total
    lost = 1.0 - worth / np.maximum(worth.max(axis=0), 1e-9)
    lost = lost + _BLIND * ((least <= 0.0) & (least.max(axis=0) > 0.0))
    n_views, n_steps = lost.shape
    best = np.zeros((n_steps, n_views), dtype=np.int64)
    cost = lost[:, 0]
    for step in range(1, n_steps):
        other = int(np.argmin(cost))
        turns = cost[other] + _TURN < cost
        best[step] = np.where(turns, other, np.arange(n_views))
        cost = np.where(turns, cost[other] + _TURN, cost) + lost[:, step]
    chosen = np.empty(n_steps, dtype=np.int64)
    chosen[-1] = int(np.argmin(cost))
    for step in range(n_steps - 1, 0, -1):
        chosen[step - 1] = best[step, chosen[step]]
    return chosen


@frozen_value
class _Scene:
    """All pieces in space: triangles with their piece and the step in which they come."""

    points: FloatArray
    triangles: IntArray
    normals: FloatArray
    piece: IntArray
    step: IntArray
    step_of_piece: IntArray


def _scene(
    ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece], crossing_map: CrossingMap
) -> _Scene:
    """Return all pieces in space."""
    vertices, triangles, _ = ribbon_triangles(ribbons)
    placed = {key: at for at, step in enumerate(crossing_map.steps) for key in step.pieces}
    step_of_piece = np.array([placed[piece.id] for piece in pieces], dtype=np.int64)
    rung, piece = piece_stretches(ribbons, weave, pieces).quads()
    # Each quad is two triangles; rungs that nothing follows begin none.
    number = np.full(len(ribbons.right), -1, dtype=np.int64)
    near = triangles[::2, 0] // 2
    number[near] = np.arange(len(near))
    row = (2 * number[rung][:, None] + (0, 1)).ravel()
    piece = np.repeat(piece, 2)
    return _Scene(
        vertices,
        triangles[row],
        facet_normals(vertices, triangles[row])[:, 0],
        piece,
        step_of_piece[piece],
        step_of_piece,
    )


def _events(scene: _Scene, frame: Frame) -> tuple[IntArray, IntArray, FloatArray]:
    """Return triangle, pixel and nearness of all that is seen when it is placed, step by step.

    Of the layers at a pixel those count that are nearer than all that came before them.
    """
    triangle, pixel, near = all_fragments(
        frame.pixels(scene.points), scene.triangles, width=frame.width_px, height=frame.height_px
    )
    if not len(near):
        return triangle, pixel, near
    share = (near - near.min()) / max(float(np.ptp(near)), 1e-9)
    # Pixel, step and nearness in one number: a quarter of the time of sorting by each in turn.
    place = pixel * (int(scene.step.max()) + 1) + scene.step[triangle]
    bits = 62 - int(place.max()).bit_length()
    order = np.argsort(
        (place << bits) + ((1.0 - share) * 2.0**bits).astype(np.int64), kind="stable"
    )
    triangle, pixel, near, share = triangle[order], pixel[order], near[order], share[order]
    # Each pixel has a range of its own, so one running maximum serves them all.
    level = np.maximum.accumulate(share + 2.0 * pixel)
    wins = np.flatnonzero(share + 2.0 * pixel > np.concatenate(([-1.0], level[:-1])))
    wins = wins[np.argsort(scene.step[triangle[wins]], kind="stable")]
    return triangle[wins], pixel[wins], near[wins]


def _frame(scene: _Scene, view: View, size_px: tuple[int, int]) -> Frame:
    """Return the frame of a view: the whole object fills it at every step."""
    return frame_object(scene.points[np.unique(scene.triangles)], view, size_px)


def _seen(scene: _Scene, view: View) -> FloatArray:
    """Return what a view shows of each step's new pieces, (S, 2): of the least seen, of all."""
    triangle, _, _ = _events(scene, _frame(scene, view, _TRIAL_PX))
    area = np.bincount(scene.piece[triangle], minlength=len(scene.step_of_piece)).astype(float)
    n_steps = int(scene.step_of_piece.max()) + 1
    least = np.full(n_steps, np.inf)
    np.minimum.at(least, scene.step_of_piece, area)
    return np.column_stack((least, np.bincount(scene.step_of_piece, area, n_steps)))


class _Layers:
    """What is seen from one place while pieces are placed."""

    def __init__(self, scene: _Scene, view: View) -> None:
        self._scene = scene
        self._frame = _frame(scene, view, PICTURE_PX)
        self._triangle, self._pixel, self._near = _events(scene, self._frame)
        self._bounds = np.searchsorted(
            scene.step[self._triangle], np.arange(int(scene.step_of_piece.max()) + 2)
        )
        self._at = 0
        count = PICTURE_PX[0] * PICTURE_PX[1]
        self._shown = np.full(count, -1, dtype=np.int64)
        self._depth = np.full(count, -np.inf)
        ground = np.full(count, _GROUND, dtype=np.uint8)
        ground[self._pixel] = _TO_COME
        whole = _shaped(ground != _GROUND)
        self._ground = _shaped(ground).copy()
        self._ground[_border(whole)] = _COMING_EDGE
        light = scene.normals @ frame_key(self._frame)
        back = scene.normals @ self._frame.axes[2] < 0.0
        light = np.where(back, _BEHIND * np.maximum(-light, 0.0), np.maximum(light, 0.0))
        light = _EVEN + (1.0 - _EVEN) * light
        self._pale, self._dark = (
            (GREY_STEP * np.round((low + (high - low) * light) / GREY_STEP)).astype(np.uint8)
            for low, high in (_THERE, _NEW)
        )

    def place_until(self, step: int) -> None:
        """Place the pieces of all steps up to one."""
        low, high = self._at, int(self._bounds[step + 1])
        events = slice(low, high)
        # A later step's piece is nearer, so the last write counts.
        self._shown[self._pixel[events]] = self._triangle[events]
        self._depth[self._pixel[events]] = self._near[events]
        self._at = high

    def image(self, step: int) -> Image.Image:
        """Return the picture: what came in a step is dark."""
        shown = _shaped(self._shown)
        there = shown >= 0
        triangle = shown[there]
        new = self._scene.step[triangle] == step
        picture = self._ground.copy()
        picture[there] = np.where(new, self._dark[triangle], self._pale[triangle])
        piece = np.full(shown.shape, -1, dtype=np.int64)
        piece[there] = self._scene.piece[triangle]
        fresh = np.zeros(shown.shape, dtype=bool)
        fresh[there] = new
        edges = _changes(piece)
        picture[edges & there] = _OUTLINE
        # A white line around what is dark, where it ends at something light.
        halo = _border(fresh) | (edges & fresh)
        picture[halo] = _GROUND
        picture[_border(fresh | halo) & ~halo] = 0
        return Image.fromarray(picture)

    def middle(self, piece: int) -> tuple[float, float] | None:
        """Return a place near the middle of what is seen of a piece."""
        seen = np.flatnonzero((self._shown >= 0) & (self._scene.piece[self._shown] == piece))
        if not len(seen):
            return None
        y, x = np.divmod(seen, PICTURE_PX[0])
        best = int(np.argmin((x - x.mean()) ** 2 + (y - y.mean()) ** 2))
        return _shares(float(x[best]), float(y[best]))

    def spot(self, point: FloatArray) -> tuple[float, float] | None:
        """Return where a point is seen; None if something stands well in front of it."""
        x, y, near = self._frame.pixels(point[None])[0].tolist()
        front = self._depth[int(y) * PICTURE_PX[0] + int(x)]
        if front > near + 0.03 * min(PICTURE_PX):
            return None
        return _shares(x, y)


def frame_key(frame: Frame) -> FloatArray:
    """Return the direction of the light in the object's own axes."""
    key = np.array(_KEY)
    return np.asarray(key / np.linalg.norm(key) @ frame.axes, dtype=np.float64)


def _shares(x: float, y: float) -> tuple[float, float]:
    """Return a place as shares of the picture."""
    return x / PICTURE_PX[0], y / PICTURE_PX[1]


def _shaped(values: Any) -> Any:
    """Return values of all pixels as rows."""
    return values.reshape(PICTURE_PX[1], PICTURE_PX[0])


def _changes(values: IntArray) -> BoolArray:
    """Return pixels whose right or lower neighbour has another value."""
    changes = np.zeros(values.shape, dtype=bool)
    changes[:, :-1] |= values[:, :-1] != values[:, 1:]
    changes[:-1] |= values[:-1] != values[1:]
    return changes


def _border(inside: BoolArray) -> BoolArray:
    """Return the pixels just outside an area."""
    grown = inside.copy()
    grown[:, :-1] |= inside[:, 1:]
    grown[:, 1:] |= inside[:, :-1]
    grown[:-1] |= inside[1:]
    grown[1:] |= inside[:-1]
    return np.asarray(grown & ~inside, dtype=np.bool_)
