"""Mark pieces: ticks at the crossings and lettering where it is clear of holes and edges."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from fabweave.arrays import FloatArray
from fabweave.cut.lettering import place_text, text_box
from fabweave.flat.piece import Piece

#: Nothing engraved comes nearer to an outline, a hole or another mark.
CLEAR_MM = 0.35
#: Heights of letters that are tried, the preferred first.
ID_HEIGHTS_MM = (4.0, 3.5, 3.0, 2.5, 2.0, 1.5)
OTHER_HEIGHTS_MM = (2.5, 2.0, 1.5)
#: Letters lower than this are reported: readable on the bench, but small.
WANTED_HEIGHT_MM = 2.5
#: Two strokes of the tick of a strand that goes under stand this far apart.
_DOUBLE_TICK_MM = 0.8
_SHORTEST_TICK_MM = 0.3

# Fractions of the way from a station to its neighbour where a label may be centred, in the order
# in which they are tried: for what belongs to the station, and for what belongs to the piece.
_BESIDE = (0.0, 0.25, 0.3, 0.2, 0.35, 0.4, 0.45)
_BETWEEN = (0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Label:
    """A lettered text: its strokes in the piece's coordinates, its height, what it tells."""

    text: str
    kind: str
    height_mm: float
    strokes: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class Marks:
    """What is engraved on a piece.

    ``dropped`` lists the labels, as (kind, text), for which no clear place was found; kinds are
    ``"id"``, ``"joint"`` and ``"partner"``.
    """

    labels: tuple[Label, ...]
    ticks: tuple[FloatArray, ...]
    dropped: tuple[tuple[str, str], ...]


class _Place(NamedTuple):
    """A place where a label may be centred, and its reading direction."""

    centre: FloatArray
    angle_deg: float


class _Request(NamedTuple):
    """A label that somebody wants to read, and where it may stand."""

    kind: str
    text: str
    heights: tuple[float, ...]
    places: list[_Place]


def mark_piece(piece: Piece, partners: Sequence[str]) -> Marks:
    """Engrave a piece: its id, joint numbers at its tabs, its partners, and ticks at crossings.

    At each crossing a short tick stands inside each edge: single where the piece lies over,
    double where it goes under. A joint without a hole has a cross. Letters read along the
    thread. A label that finds no clear place is made smaller, and dropped at last; the id is
    placed first, then joints, then partners.

    Parameters
    ----------
    piece : Piece
    partners : sequence of str
        The id of the piece crossed at each station.

    Returns
    -------
    Marks
        In the piece's own coordinates.
    """
    ticks = (*_ticks(piece), *_crosses(piece))
    ground = _ground(piece, ticks)
    labels: list[Label] = []
    dropped: list[tuple[str, str]] = []
    for request in _requests(piece, partners):
        found = _find_place(ground, request)
        if found is None:
            dropped.append((request.kind, request.text))
            continue
        label, box = found
        labels.append(label)
        ground = shapely.difference(ground, shapely.buffer(box, CLEAR_MM, join_style="mitre"))
    return Marks(tuple(labels), ticks, tuple(dropped))


def _ticks(piece: Piece) -> Iterator[FloatArray]:
    """Yield the ticks at every station: beside the right edge and beside the left one."""
    for direction, rails, over in zip(piece.directions, piece.rails, piece.over, strict=True):
        across = rails[1] - rails[0]
        width = float(np.hypot(*across))
        if width < 4 * CLEAR_MM:
            continue
        inward = across / width
        length = min(max(0.15 * width, 0.6), 2.0, width / 2 - 2 * CLEAR_MM)
        if length < _SHORTEST_TICK_MM:
            continue
        for shift in (0.0,) if over else (-_DOUBLE_TICK_MM / 2, _DOUBLE_TICK_MM / 2):
            for edge, way in ((rails[0], inward), (rails[1], -inward)):
                start = edge + shift * direction + CLEAR_MM * way
                yield np.array([start, start + length * way])


def _crosses(piece: Piece) -> Iterator[FloatArray]:
    """Yield a cross at each joint that has no hole, to align the two pieces by."""
    joined = ((0, piece.start_joint), (len(piece.crossings) - 1, piece.end_joint))
    for station, joint in joined:
        if joint is None or not np.isnan(piece.hole_mm[station]):
            continue
        across = piece.rails[station, 1] - piece.rails[station, 0]
        arm = min(1.0, float(np.hypot(*across)) / 2 - 2 * CLEAR_MM)
        if 2 * arm < _SHORTEST_TICK_MM:
            continue
        along = piece.directions[station]
        for way in (along, np.array([-along[1], along[0]])):
            yield np.array([piece.points[station] - arm * way, piece.points[station] + arm * way])


def _ground(piece: Piece, ticks: tuple[FloatArray, ...]) -> shapely.Geometry:
    """Return where letters may stand: off the edge, the holes and the ticks."""
    inside = shapely.buffer(shapely.Polygon(piece.outline), -CLEAR_MM, join_style="mitre")
    drilled = ~np.isnan(piece.hole_mm)
    holes = shapely.buffer(
        shapely.points(piece.points[drilled]), piece.hole_mm[drilled] / 2 + CLEAR_MM
    )
    strokes = shapely.buffer(shapely.linestrings(np.array(ticks)), CLEAR_MM) if ticks else []
    taken = shapely.union_all(np.concatenate((holes, strokes)))
    return shapely.difference(inside, taken)


def _requests(piece: Piece, partners: Sequence[str]) -> Iterator[_Request]:
    """Yield what is to be lettered, the most wanted first."""
    count = len(piece.crossings)
    segments = sorted(range(count - 1), key=lambda k: (abs(k - (count - 2) / 2), k))
    between = [_between(piece, k, fraction) for fraction in _BETWEEN for k in segments]
    if count == 1:
        between = _beside(piece, 0)
    yield _Request("id", piece.id, ID_HEIGHTS_MM, between)
    if piece.start_joint is not None:
        yield _Request("joint", f"#{piece.start_joint}", OTHER_HEIGHTS_MM, _beside(piece, 0))
    if piece.end_joint is not None:
        yield _Request("joint", f"#{piece.end_joint}", OTHER_HEIGHTS_MM, _beside(piece, count - 1))
    for station, partner in enumerate(partners):
        yield _Request("partner", partner, OTHER_HEIGHTS_MM, _beside(piece, station))


def _between(piece: Piece, station: int, fraction: float) -> _Place:
    """Return the place between a station and the following one."""
    a, b = piece.points[station], piece.points[station + 1]
    way = b - a
    return _Place(a + fraction * way, float(np.rad2deg(np.arctan2(way[1], way[0]))))


def _beside(piece: Piece, station: int) -> list[_Place]:
    """Return places at a station, then after it, then before it."""
    x, y = piece.directions[station]
    places = [_Place(piece.points[station], float(np.rad2deg(np.arctan2(y, x))))]
    for fraction in _BESIDE[1:]:
        if station + 1 < len(piece.points):
            places.append(_between(piece, station, fraction))
        if station > 0:
            places.append(_between(piece, station - 1, 1 - fraction))
    return places


def _find_place(
    ground: shapely.Geometry, request: _Request
) -> tuple[Label, shapely.Geometry] | None:
    """Return the label at the greatest height, and the first place, where its box is clear."""
    shapely.prepare(ground)
    centres = np.array([place.centre for place in request.places])
    angles = np.deg2rad([place.angle_deg for place in request.places])
    along = np.column_stack((np.cos(angles), np.sin(angles)))
    upward = np.column_stack((-along[:, 1], along[:, 0]))
    unit = text_box(request.text, 1.0)
    for height in request.heights:
        half = along * (unit.width * height / 2), upward * ((unit.top - unit.bottom) * height / 2)
        corners = np.stack(
            (
                centres - half[0] - half[1],
                centres + half[0] - half[1],
                centres + half[0] + half[1],
                centres - half[0] + half[1],
            ),
            axis=1,
        )
        boxes = shapely.polygons(corners)
        clear = np.flatnonzero(shapely.contains_properly(ground, boxes))
        if len(clear):
            place = request.places[int(clear[0])]
            strokes = place_text(request.text, height, place.centre, place.angle_deg)
            label = Label(request.text, request.kind, height, tuple(strokes))
            return label, boxes[clear[0]]
    return None
