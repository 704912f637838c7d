"""Mark pieces: ticks at the crossings and lettering where it is clear of holes and edges."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import KDTree

from fabweave.arrays import BoolArray, FloatArray, IntArray
from fabweave.cut.lettering import place_text, text_box
from fabweave.flat.owners import find_owners
from fabweave.flat.piece import Piece

#: Nothing engraved comes nearer to an outline, a hole or another mark.
CLEAR_MM = 0.35
#: Labels in one line keep this far apart, or two would read as one: a space between words.
WORD_SPACE_MM = 1.5
#: Heights of letters that are tried, the preferred first.
ID_HEIGHTS_MM = (4.0, 3.5, 3.0, 2.5, 2.0, 1.5)
OTHER_HEIGHTS_MM = (2.5, 2.0, 1.5)
#: Letters lower than this are reported: readable on the bench, but small.
WANTED_HEIGHT_MM = 2.5
#: Two strokes of the tick of a strand that goes under stand this far apart.
_DOUBLE_TICK_MM = 0.8
_SHORTEST_TICK_MM = 0.3

# Fractions of the way from a station to the next where a label may be centred; the places beside
# a station come in the order in which they are tried.
_AFTER = (0.25, 0.3, 0.2, 0.35, 0.4, 0.45)
_MIDWAY = (0.5, 0.35, 0.65)
_FRACTIONS = (*_AFTER, *(1 - fraction for fraction in _AFTER), *_MIDWAY)
# The same places on the middle line, and then off it by these parts of the ribbon's width.
_ASIDE = (0.0, 0.25, -0.25)


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


class _Places(NamedTuple):
    """Places where a label may be centred, their reading directions, and the free room there.

    First the stations, then ``len(_FRACTIONS)`` places between each station and the next; all
    this once for each of ``_ASIDE``.
    """

    centre: FloatArray
    along: FloatArray
    room: FloatArray


class _Obstacles(NamedTuple):
    """Discs that letters keep clear of: holes, and points of ticks."""

    centre: FloatArray
    radius: FloatArray


class _Request(NamedTuple):
    """A label that somebody wants to read, and the places where it may stand."""

    kind: str
    text: str
    choices: tuple[tuple[str, float], ...]  # how to letter it, and how high, the best first
    places: list[int]


class _Boxes(NamedTuple):
    """Every box in which some request might be lettered, in the order in which they are tried."""

    request: IntArray
    choice: IntArray
    place: IntArray
    half: FloatArray  # (N, 2) half width along the reading direction, and half height


def mark_pieces(pieces: Sequence[Piece], n_crossings: int) -> tuple[Marks, ...]:
    """Engrave every piece; at each crossing it names the piece that it meets there."""
    owners = find_owners(pieces, n_crossings)
    return tuple(
        mark_piece(piece, [pieces[other].id for other in owners.partners(piece)])
        for piece in pieces
    )


def mark_piece(piece: Piece, partners: Sequence[str]) -> Marks:
    """Engrave a piece: its id, joint numbers at its tabs, its partners, and ticks at crossings.

    At each crossing a short tick stands inside each edge: single where the piece lies over,
    double where it goes under. Glued joints have their guides. Letters read along the
    thread. A label that finds no clear place is made smaller, and dropped at last; the id is
    placed first, then joints, then partners. The id is the largest of all, or else in brackets.

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
    ticks = _inside(piece, [*_ticks(piece), *piece.guides])
    obstacles = _obstacles(piece, ticks)
    places = _places(piece, obstacles)
    requests = list(_requests(piece, partners))
    boxes = _boxes(places, requests)
    shapes = shapely.polygons(_corners(places, boxes))
    free = _clear(piece, obstacles, places, boxes, shapes)
    bounds = np.searchsorted(boxes.request, np.arange(len(requests) + 1))
    centres, reach = places.centre[boxes.place], np.hypot(boxes.half[:, 0], boxes.half[:, 1])
    labels: list[Label] = []
    dropped: list[tuple[str, str]] = []
    for number, request in enumerate(requests):
        open_boxes = np.flatnonzero(free[bounds[number] : bounds[number + 1]])
        if len(open_boxes) == 0:
            dropped.append((request.kind, request.text))
            continue
        chosen = int(bounds[number] + open_boxes[0])
        place = int(boxes.place[chosen])
        text, height = request.choices[boxes.choice[chosen]]
        angle = float(np.rad2deg(np.arctan2(places.along[place, 1], places.along[place, 0])))
        strokes = place_text(text, height, places.centre[place], angle)
        labels.append(Label(request.text, request.kind, height, tuple(strokes)))
        # Whatever would come too near to this label is closed to the following ones.
        away = np.hypot(*(centres - centres[chosen]).T)
        near = np.flatnonzero(free & (away < reach + reach[chosen] + WORD_SPACE_MM))
        only = boxes._replace(
            place=boxes.place[[chosen]], half=boxes.half[[chosen]] + (WORD_SPACE_MM, CLEAR_MM)
        )
        kept_free = shapely.polygons(_corners(places, only))[0]
        free[near[shapely.intersects(shapes[near], kept_free)]] = False
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


def _inside(piece: Piece, strokes: list[FloatArray]) -> tuple[FloatArray, ...]:
    """Keep the strokes that lie inside a piece; at a slanting or tapering panel some may not."""
    if not strokes:
        return ()
    room = shapely.buffer(shapely.Polygon(piece.outline), -CLEAR_MM / 2, join_style="mitre")
    held = shapely.contains_properly(room, shapely.linestrings(np.array(strokes)))
    return tuple(stroke for stroke, kept in zip(strokes, held, strict=True) if kept)


def _obstacles(piece: Piece, ticks: tuple[FloatArray, ...]) -> _Obstacles:
    """Return holes and ticks as discs; the ends and middle of a tick stand for all of it."""
    strokes = np.array(ticks).reshape(-1, 2, 2)
    samples = np.concatenate((strokes, strokes.mean(axis=1, keepdims=True)), axis=1).reshape(-1, 2)
    holes, slots = piece.holes[:, 1:], [_discs(slot.path.points) for slot in piece.slots]
    discs = np.concatenate([holes * (1.0, 1.0, 0.5), *slots])
    return _Obstacles(
        np.concatenate((discs[:, :2], samples)),
        np.concatenate((discs[:, 2], np.zeros(len(samples)))),
    )


def _discs(ring: FloatArray) -> FloatArray:
    """Return discs, (N, 3), that cover a slot: as wide as it is, along its middle."""
    middle = ring.mean(axis=0)
    corners = ring - middle
    _, _, axes = np.linalg.svd(corners)
    span = np.abs(corners @ axes.T).max(axis=0)
    radius = float(np.hypot(span[1], span[1])) if span[0] > span[1] else float(np.hypot(*span))
    reach = max(span[0] - span[1], 0.0)
    shares = np.linspace(-1.0, 1.0, 2 * int(np.ceil(reach / max(radius, 0.1))) + 1)[:, None]
    places = middle + shares * reach * axes[0]
    return np.column_stack((places, np.full(len(places), radius)))


def _places(piece: Piece, obstacles: _Obstacles) -> _Places:
    """List the places of a piece: its stations, then those between stations, then off the line."""
    fractions = np.array(_FRACTIONS)
    way = np.diff(piece.points, axis=0)
    between = piece.points[:-1, None, :] + fractions[None, :, None] * way[:, None, :]
    unit = way / np.hypot(way[:, 0], way[:, 1])[:, None]
    breadth = np.hypot(*(piece.rails[:, 1] - piece.rails[:, 0]).T)
    middle = np.concatenate((piece.points, between.reshape(-1, 2)))
    along = np.concatenate((piece.directions, np.repeat(unit, len(_FRACTIONS), axis=0)))
    gained = np.diff(breadth)[:, None] * fractions
    width = np.concatenate((breadth, (breadth[:-1, None] + gained).reshape(-1)))
    across = along[:, ::-1] * np.array([-1.0, 1.0]) * width[:, None]
    centre = np.concatenate([middle + aside * across for aside in _ASIDE])
    room = np.asarray(shapely.distance(shapely.points(centre), shapely.LinearRing(piece.outline)))
    for radius in np.unique(obstacles.radius):
        nearest, _ = KDTree(obstacles.centre[obstacles.radius == radius]).query(centre)
        room = np.minimum(room, nearest - radius)
    return _Places(centre, np.tile(along, (len(_ASIDE), 1)), room)


def _requests(piece: Piece, partners: Sequence[str]) -> Iterator[_Request]:
    """Yield what is to be lettered, the most wanted first."""
    count, each = len(piece.crossings), len(_FRACTIONS)
    # The id stands as near to the middle of the piece as it can.
    segments = sorted(range(count - 1), key=lambda k: (abs(k - (count - 2) / 2), k))
    midway = range(each - len(_MIDWAY), each)
    between = [count + each * segment + k for k in midway for segment in segments]
    stations = sorted(range(count), key=lambda k: (abs(k - (count - 1) / 2), k))
    large = [(piece.id, height) for height in ID_HEIGHTS_MM if height > OTHER_HEIGHTS_MM[0]]
    small = [(f"[{piece.id}]", height) for height in OTHER_HEIGHTS_MM]
    yield _Request("id", piece.id, (*large, *small), between + stations)
    for station, joint in ((0, piece.start_joint), (count - 1, piece.end_joint)):
        if joint is not None:
            yield _other("joint", f"#{joint}", _beside(station, count))
    for station, partner in enumerate(partners):
        yield _other("partner", partner, _beside(station, count))


def _other(kind: str, text: str, places: list[int]) -> _Request:
    """Return a request for a text that is no piece's id."""
    return _Request(kind, text, tuple((text, height) for height in OTHER_HEIGHTS_MM), places)


def _beside(station: int, count: int) -> list[int]:
    """Return the places at a station, just after it, and just before it."""
    each, near = len(_FRACTIONS), len(_AFTER)
    after = count + each * station
    before = count + each * (station - 1) + near
    places = [station]
    for step in range(near):
        if station + 1 < count:
            places.append(after + step)
        if station > 0:
            places.append(before + step)
    return places


def _boxes(places: _Places, requests: list[_Request]) -> _Boxes:
    """List the boxes of every request: at its best choice in all its places, then the next."""
    asides = len(places.centre) // len(_ASIDE) * np.arange(len(_ASIDE))
    parts = []
    for number, request in enumerate(requests):
        where = np.add.outer(asides, request.places).reshape(-1)
        half = np.array([_half_size(text) for text, _ in request.choices])
        half *= np.array([[height] for _, height in request.choices])
        # Whatever its length, a text needs this much room around its middle.
        fits = half.min(axis=1)[:, None] + CLEAR_MM <= places.room[where]
        choice, place = np.nonzero(fits)
        parts.append((np.full(len(choice), number), choice, where[place], half[choice]))
    return _Boxes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


@lru_cache(maxsize=4096)
def _half_size(text: str) -> tuple[float, float]:
    """Return half the width and half the height of a text whose capitals are 1 mm high."""
    box = text_box(text, 1.0)
    return box.width / 2, (box.top - box.bottom) / 2


def _corners(places: _Places, boxes: _Boxes) -> FloatArray:
    """Return the corners of every box, (N, 4, 2)."""
    along = places.along[boxes.place] * boxes.half[:, :1]
    upward = places.along[boxes.place][:, ::-1] * np.array([-1.0, 1.0]) * boxes.half[:, 1:]
    reach = np.stack((-along - upward, along - upward, along + upward, upward - along), axis=1)
    return places.centre[boxes.place][:, None, :] + reach


def _clear(
    piece: Piece,
    obstacles: _Obstacles,
    places: _Places,
    boxes: _Boxes,
    shapes: npt.NDArray[Any],
) -> BoolArray:
    """Say which boxes lie inside the piece, off its edge, its holes and its ticks."""
    inside = shapely.buffer(shapely.Polygon(piece.outline), -CLEAR_MM, join_style="mitre")
    shapely.prepare(inside)
    clear = np.asarray(shapely.contains_properly(inside, shapes))
    left = np.flatnonzero(clear)
    # Obstacles within reach of each place first: several boxes share a place.
    reach = float(np.hypot(*boxes.half.T).max(initial=0.0)) + CLEAR_MM
    away = obstacles.centre[None, :, :] - places.centre[:, None, :]
    distance = np.hypot(away[:, :, 0], away[:, :, 1]) - obstacles.radius
    place, thing = np.nonzero(distance < reach)
    away, unit = away[place, thing], places.along[place]
    along = np.abs(away[:, 0] * unit[:, 0] + away[:, 1] * unit[:, 1])
    across = np.abs(away[:, 1] * unit[:, 0] - away[:, 0] * unit[:, 1])
    first = np.searchsorted(place, np.arange(len(places.centre) + 1))
    own = boxes.place[left]
    count = first[own + 1] - first[own]
    box = np.repeat(left, count)
    pair = np.arange(len(box)) + np.repeat(first[own] - (np.cumsum(count) - count), count)
    outside = np.hypot(
        np.maximum(along[pair] - boxes.half[box, 0], 0.0),
        np.maximum(across[pair] - boxes.half[box, 1], 0.0),
    )
    clear[box[outside < obstacles.radius[thing[pair]] + CLEAR_MM]] = False
    return clear
