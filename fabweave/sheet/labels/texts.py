"""Say what is to be lettered on pieces: the texts, and how each may be shortened.

In the order of their importance a piece tells its id, the way of its thread (an arrow), the step in
which it is placed, its joints with the pieces that lap there (their mates), its partners (whom it
crosses, and how), and its id again along its length. A text is made smaller where there is no room
for it, then shortened, and dropped at last.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import Circle, Entity, Layer, PieceDrawing, Polyline

#: How much is lettered: what serves, only where strands cover it in the woven object; what serves;
#: everything; the pieces' ids alone; only of which kind they are, where strands cover it; or
#: nothing.
LABELS = ("hidden", "brief", "full", "numbers", "kinds", "none")
#: The face that is engraved: the one that is seen, or the hidden one.
SIDES = ("outside", "inside")
#: What labels tell, the most important first; the last is the first to be dropped.
KINDS = ("id", "arrow", "step", "joint", "mate", "partner", "sign")

#: Heights of letters that are tried, the preferred first. An id is engraved as low as it must be:
#: a piece without one is identified by its shape alone.
ID_HEIGHTS_MM = (4.0, 3.5, 3.0)
LOW_ID_HEIGHTS_MM = (2.5, 2.0, 1.6, 1.2)
TEXT_HEIGHTS_MM = (2.5, 2.0)
ARROW_HEIGHTS_MM = (3.0, 2.5, 2.0)
#: Letters lower than this are reported: readable on the bench, but small.
WANTED_HEIGHT_MM = 2.5
#: Where not all partners are named, those at the ends are, and one of so many on the way.
EVERY = 3
#: A longer piece bears its id at both ends, and so often between, millimetres.
ID_EVERY_MM = 100.0

#: Along the thread.
ARROW = "→"
#: Before a partner: a disc where the piece passes over it, a ring where it passes under.
OVER_SIGN, UNDER_SIGN = "●", "○"


class LabelChoice(NamedTuple):
    """A way to letter a wish: a text, how high, and which of the wish's kinds it tells."""

    text: str
    height_mm: float
    kinds: tuple[str, ...]


class LabelWish(NamedTuple):
    """A fact to letter on a piece: each kind with its words, and ways to letter it.

    ``station`` is the place along the piece that it is about, None for the whole piece. What is
    ``hidden`` may stand only where a strand covers it.
    """

    words: dict[str, str]
    station: int | None
    choices: tuple[LabelChoice, ...]
    hidden: bool = False


class Missing(NamedTuple):
    """A fact that found no room: its kind, its words, and the station it is about."""

    kind: str
    text: str
    station: int | None


@frozen_value
class Label:
    """A lettered text.

    Parameters
    ----------
    text : str
    kinds : tuple of str
        What it tells, of ``KINDS``; the first names it.
    station : int or None
        The station it is about.
    height_mm : float
        Height of a capital.
    centre : (2,) float array
        Middle of its box, in the piece's coordinates.
    rotation_deg : float
        Reading direction.
    box_mm : (float, float)
        Length along the reading direction, and height, underlines included.
    strokes : tuple of (N, 2) float arrays
        Polylines in the piece's coordinates.
    hidden : bool
        Whether it stands where a strand covers it in the woven object, as was asked.
    """

    text: str
    kinds: tuple[str, ...]
    station: int | None
    height_mm: float
    centre: FloatArray
    rotation_deg: float
    box_mm: tuple[float, float]
    strokes: tuple[FloatArray, ...]
    hidden: bool = False


def wishes(
    piece: Piece,
    partners: Sequence[str],
    mates: tuple[str | None, str | None],
    labels: str,
    step: int | None = None,
    *,
    inside: bool = False,
) -> Iterator[LabelWish]:
    """Yield what a piece is to tell, the most important first.

    Parameters
    ----------
    piece : Piece
    partners : sequence of str
        The id of the piece crossed at each station.
    mates : (str or None, str or None)
        The ids of the pieces that lap at its first and its last station.
    labels : str
        One of ``LABELS``.
    step : int, optional
        The step in which it is placed.
    inside : bool
        Whether the inner face is engraved, of which nothing need be covered to be hidden.

    Yields
    ------
    LabelWish
        Arrow and step come twice: with the id, and alone, for when the id is lettered without
        them. So does an id that is to be hidden: small and in sight, where nothing covers enough
        of it.
    """
    if labels == "none":
        return
    if labels == "numbers":
        yield _id_wish(piece.id)
        return
    hidden = labels == "hidden" and not inside
    yield _id_wish(piece.id, arrow=True, step=step, hidden=hidden)
    if hidden:
        yield _seen_id_wish(piece.id)
    yield _arrow_wish(hidden=hidden)
    heights = TEXT_HEIGHTS_MM
    if step is not None:
        choices = tuple(LabelChoice(step_name(step), height, ("step",)) for height in heights)
        yield LabelWish({"step": step_name(step)}, None, choices, hidden)
    last = len(piece.crossings) - 1
    ends = ((0, piece.start_joint, mates[0]), (last, piece.end_joint, mates[1]))
    for station, joint, mate in ends:
        if joint is not None:
            words = {"joint": f"#{joint}", "mate": f">{mate}"}
            yield _joint_wish(words, station, heights, hidden=hidden)
    told = told_stations(piece, labels)
    for station in told:
        over = bool(piece.over[station])
        words = {"partner": partners[station], "sign": OVER_SIGN if over else UNDER_SIGN}
        text = words["sign"] + words["partner"]
        # Without its sign a name would read as the piece's own.
        choices = tuple(LabelChoice(text, height, ("partner", "sign")) for height in heights)
        yield LabelWish(words, station, choices, hidden)
    again = tuple(LabelChoice(piece.id, height, ("id",)) for height in heights)
    for station in id_stations(piece, told):
        yield LabelWish({"id": piece.id}, station, again, hidden)


def raised(wish: LabelWish, least_mm: float) -> LabelWish:
    """Return a wish with no lower letters than that; a piece's id may be lower, before it has none.

    Examples
    --------
    >>> wish = LabelWish({"id": "A1"}, None, (LabelChoice("A1", 2.5, ("id",)),), hidden=True)
    >>> [choice.height_mm for choice in raised(wish, 3.0).choices]
    [3.0, 2.5]
    """
    choices = [one._replace(height_mm=max(one.height_mm, least_mm)) for one in wish.choices]
    low = wish.choices if "id" in wish.words and wish.station is None else ()
    return wish._replace(choices=tuple(dict.fromkeys((*choices, *low))))


def step_name(step: int) -> str:
    """Return what a piece bears of the step in which it is placed.

    Examples
    --------
    >>> step_name(17)
    '(17)'
    """
    return f"({step})"


def id_stations(piece: Piece, among: Sequence[int]) -> list[int]:
    """Return the stations of a long piece by which its id stands again: at its ends and between.

    Parameters
    ----------
    piece : Piece
    among : sequence of int
        The stations that there are to choose from.
    """
    steps = np.hypot(*np.diff(piece.points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if along[-1] <= ID_EVERY_MM or not len(among):
        return []
    wanted = np.linspace(0.0, along[-1], math.ceil(along[-1] / ID_EVERY_MM) + 1)
    far = np.abs(along[np.asarray(among)][:, None] - wanted)
    return sorted({int(among[at]) for at in far.argmin(axis=0).tolist()})


def kind_name(kind: int) -> str:
    """Return what pieces of a kind bear where only that is told.

    Examples
    --------
    >>> kind_name(3)
    'K3'
    """
    return f"K{kind}"


def kind_wishes(name: str, *, hidden: bool) -> Iterator[LabelWish]:
    """Yield what a piece is to tell of which only the kind counts: ``K3``, and an arrow.

    The arrow is that of the first piece of the kind; in others the thread may run against it.
    """
    yield _id_wish(name, arrow=True, hidden=hidden)
    if hidden:
        yield _seen_id_wish(name)
    yield _arrow_wish(hidden=hidden)


def spare_wishes(name: str, *, hidden: bool) -> Iterator[LabelWish]:
    """Yield what a spare is to tell: its id. Who crosses it depends on the place it is put in."""
    yield _id_wish(name, hidden=hidden)
    if hidden:
        yield _seen_id_wish(name)


def told_stations(piece: Piece, labels: str) -> list[int]:
    """Return the stations of a piece at which its partner is named.

    All with ``"full"``; if labels are hidden, all where there is a cover, so that each crossing
    bears a name; else the first, every third after it and the last.

    Parameters
    ----------
    piece : Piece
    labels : str
        One of ``LABELS`` that names partners.
    """
    stations = list(range(len(piece.crossings)))
    if labels == "full":
        return stations
    if labels == "hidden":
        return [station for station in stations if not piece.over[station]]
    return sorted({*stations[::EVERY], *stations[-1:]})


def _id_wish(
    name: str, *, arrow: bool = False, step: int | None = None, hidden: bool = False
) -> LabelWish:
    """Return the wish for a piece's id: large, with arrow and step, or else smaller, or alone."""
    words = {"id": name, "arrow": ARROW} if arrow else {"id": name}
    if step is not None:
        words["step"] = step_name(step)
    choices = []
    for heights in (ID_HEIGHTS_MM, LOW_ID_HEIGHTS_MM):
        if step is not None and heights is ID_HEIGHTS_MM:
            text = f"{name}{ARROW} {step_name(step)}"
            choices += [LabelChoice(text, height, ("id", "arrow", "step")) for height in heights]
        if arrow:
            choices += [LabelChoice(name + ARROW, height, ("id", "arrow")) for height in heights]
        choices += [LabelChoice(name, height, ("id",)) for height in heights]
    return LabelWish(words, None, tuple(choices), hidden)


def _arrow_wish(*, hidden: bool) -> LabelWish:
    """Return the wish for the arrow alone."""
    choices = tuple(LabelChoice(ARROW, height, ("arrow",)) for height in ARROW_HEIGHTS_MM)
    return LabelWish({"arrow": ARROW}, None, choices, hidden)


def _seen_id_wish(name: str) -> LabelWish:
    """Return the wish for an id that is seen: no larger than it is read in the hand."""
    heights = LOW_ID_HEIGHTS_MM[1:]
    return LabelWish(
        {"id": name}, None, tuple(LabelChoice(name, height, ("id",)) for height in heights)
    )


def _joint_wish(
    words: dict[str, str], station: int, heights: Sequence[float], *, hidden: bool
) -> LabelWish:
    """Return a wish for a joint with the mate there, or the joint alone."""
    text = words["joint"] + words["mate"]
    whole = [LabelChoice(text, height, ("joint", "mate")) for height in heights]
    part = [LabelChoice(words["joint"], height, ("joint",)) for height in heights]
    return LabelWish(words, station, (*whole, *part), hidden)


_Region: TypeAlias = Any  # a shapely geometry: shapely ships no types

#: The smallest title, taken where no larger one fits, millimetres.
SMALLEST_TITLE_MM = 2.5
# How many font sizes are tried.
_N_SIZES = 9
# Titles stand in directions that are whole numbers of these.
_STEP_DEG = 5.0
# A capital's box in heights of the font, with air for the halo.
_LETTER_WIDTH, _AIR, _LETTER_HEIGHT = 0.62, 0.45, 1.05
# How far outlines may stand off their arcs here, and how exactly the widest place is found.
_FLAT_MM, _EXACT_MM = 0.05, 0.5
# A place is wide that has this share of the widest circle.
_WIDE = 0.9
# Titles keep so far from engraved letters, millimetres.
_OFF_MM = 0.4
# How far apart the points stand by which a title keeps clear of lines, millimetres; letters have
# more air than half of it.
_STEP_MM = 0.8


class Title(NamedTuple):
    """Where a title stands: its middle, its direction (counter-clockwise) and its font size."""

    x: float
    y: float
    angle_deg: float = 0.0
    height_mm: float = 6.0


def place_titles(pieces: Sequence[PieceDrawing], *, largest_mm: float = 9.0) -> dict[str, Title]:
    """Return a title for each piece.

    It stands in the midst of where the piece is widest, clear of its outline, holes and engraved
    labels; of the directions level and along the outline there, the one is taken that
    admits the larger letters. Where none fits, labels are ignored; then holes and the outline are.

    Parameters
    ----------
    pieces : sequence of PieceDrawing
        Pieces on a sheet, millimetres; one without an outline gets no title.
    largest_mm : float
        Font size of a title that has room enough.

    Returns
    -------
    dict from piece id to Title
        No title stands on its head.

    Examples
    --------
    >>> from fabweave.sheet.drawing import Polyline
    >>> box = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 10.0], [0.0, 10.0]])
    >>> piece = PieceDrawing("A1", (Polyline(Layer.CUT_OUTER, box, closed=True),))
    >>> title = place_titles([piece])["A1"]
    >>> title.angle_deg, title.height_mm
    (0.0, 9.0)
    """
    sizes = np.geomspace(max(largest_mm, SMALLEST_TITLE_MM), SMALLEST_TITLE_MM, _N_SIZES)
    titles = {piece.piece_id: _place(piece, sizes) for piece in pieces}
    return {name: title for name, title in titles.items() if title is not None}


def _place(piece: PieceDrawing, sizes: FloatArray) -> Title | None:
    """Return the title of one piece; sizes come the largest first."""
    outers, inners = (
        [_region(entity) for entity in piece.entities if entity.layer is layer]
        for layer in (Layer.CUT_OUTER, Layer.CUT_INNER)
    )
    strokes = [
        entity.flattened(_FLAT_MM)
        for entity in piece.entities
        if isinstance(entity, Polyline) and entity.layer is Layer.ENGRAVE_LABEL
    ]
    if not outers:
        return None
    area = max(outers, key=lambda region: float(region.area))
    bare = area.difference(shapely.union_all(inners))
    letters = shapely.union_all([_around(stroke) for stroke in strokes])
    for free in (bare.difference(letters), bare):
        title = _largest(free, piece.title, sizes)
        if title is not None:
            return title
    point = area.representative_point()
    return Title(float(point.x), float(point.y), 0.0, SMALLEST_TITLE_MM)


def _around(stroke: FloatArray) -> _Region:
    """Return the box of a stroke, as far around it as titles keep off: close enough for letters."""
    return shapely.box(*(stroke.min(axis=0) - _OFF_MM), *(stroke.max(axis=0) + _OFF_MM))


def _region(entity: Entity) -> _Region:
    """Return what an entity encloses."""
    if isinstance(entity, Circle):
        return shapely.Point(entity.x, entity.y).buffer(entity.radius)
    # The widest place of a polygon with corners at 1e-310 is not found.
    return shapely.make_valid(shapely.Polygon(np.round(entity.flattened(_FLAT_MM), 6)))


def _largest(free: _Region, text: str, sizes: FloatArray) -> Title | None:
    """Return the title with the largest letters in the widest place of a region.

    A box grows about its middle with its letters. So the largest size that fits in a direction is
    the least, over all points of the border, of the greater of two distances: that along the
    direction in halves of the width, and that across it in halves of the height, at size one.
    """
    if not free.area > 0.0:
        return None
    # Letters have bends without end, of which the widest place wants to know little.
    rough = free.simplify(_EXACT_MM)
    radius = shapely.length(shapely.maximum_inscribed_circle(rough, _EXACT_MM))
    inside = rough.buffer(-_WIDE * radius, quad_segs=1)
    widest = max(shapely.get_parts(inside), key=shapely.area)
    way = shapely.shortest_line(widest.representative_point(), free.boundary)
    middle, touched = shapely.get_coordinates(way)
    # The outline runs square to the way there.
    across_deg = np.rad2deg(np.arctan2(*(touched - middle)[::-1]))
    along_deg = _STEP_DEG * np.rint((across_deg + 90.0) / _STEP_DEG)
    # From -90 (not included) to 90 degrees: no title stands on its head.
    direction_deg = np.array([0.0, 90.0 - (90.0 - along_deg) % 180.0])
    border = shapely.get_coordinates(shapely.segmentize(free.boundary, _STEP_MM)) - middle
    turn = np.exp(-1j * np.deg2rad(direction_deg))[:, None] * (border @ np.array([1.0, 1.0j]))
    wide, high = _LETTER_WIDTH * len(text) + _AIR, _LETTER_HEIGHT
    room = np.maximum(np.abs(turn.real) * 2.0 / wide, np.abs(turn.imag) * 2.0 / high)
    fits = np.round(np.minimum(room.min(axis=1), sizes[0]), 6)
    if not fits.max() >= sizes[-1]:
        return None
    # Where both are as good, the level one.
    angle = float(direction_deg[int(np.argmax(fits))])
    size = sizes[np.argmax(sizes <= fits.max() + 1e-6)]
    return Title(float(middle[0]), float(middle[1]), angle, float(size))
