"""Mark pieces: ticks at crossings, guides at glued joints, and labels where there is room."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, compress, pairwise, takewhile
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import KDTree

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.piece.congruence import Kinds, motion_onto, moved_by
from fabweave.piece.joint.ends import edge_ticks
from fabweave.piece.piece import Piece, find_owners
from fabweave.sheet.labels.lettering import place_text, text_box
from fabweave.sheet.labels.texts import (
    ARROW,
    Label,
    LabelChoice,
    LabelWish,
    Missing,
    kind_name,
    kind_wishes,
    raised,
    spare_wishes,
    wishes,
)

#: Nothing engraved comes nearer to an outline, a hole or another mark.
CLEAR_MM = 0.35
#: Labels in one line keep this far apart, or two would read as one: a space between words.
WORD_SPACE_MM = 1.5

# Where a label may be centred, as parts of the way from a station to the next, or, if negative, to
# the one before; beyond the ends of a piece the way goes on as far. First what is tried beside a
# station, then what is only for the piece's own id, midway between stations.
_BESIDE = (0.0, 0.25, -0.25, 0.3, -0.3, 0.2, -0.2, 0.35, -0.35, 0.4, -0.4, 0.45, -0.45)
_MIDWAY = (0.5, 0.35, -0.35)
_WAYS = (*_BESIDE, 0.5)
# The same places on the middle line, and then off it by these parts of the ribbon's width.
_ASIDE = (0.0, 0.25, -0.25, 0.35, -0.35)

#: What is hidden keeps so far inside what covers it: strands shift a little when they are woven.
COVER_MM = 0.35

#: Distances that differ less are the same.
_SAME_MM = 1e-6
#: So many boxes of each piece are tried at once.
_CHUNK = 12


class LabelSpot(NamedTuple):
    """Where a wish is lettered: how, around which point, in which direction."""

    choice: LabelChoice
    centre: FloatArray
    rotation_deg: float
    box_mm: tuple[float, float]


class _Places(NamedTuple):
    """Places where a label may be centred, and their reading directions, (S, T, A, 2) arrays."""

    centre: FloatArray
    along: FloatArray


class _Boxes(NamedTuple):
    """The boxes of every wish: its choices' half sizes, and its places.

    Choices and places of wish ``w`` are those from ``first[w]`` to ``first[w + 1]``.
    """

    half: FloatArray
    first_choice: IntArray
    place: IntArray
    first_place: IntArray


def find_spots(
    pieces: Sequence[Piece],
    ticks: Sequence[Sequence[FloatArray]],
    wishes: Sequence[Sequence[LabelWish]],
) -> list[list[LabelSpot | None]]:
    """Find a spot for every wish of every piece, or None.

    Parameters
    ----------
    pieces : sequence of Piece
    ticks : sequence of sequences of (2, 2) float arrays
        What is engraved on each piece beside its labels.
    wishes : sequence of sequences of LabelWish
        What each piece is to tell, the most important first. Wishes are passed over if the one
        before them was lettered in a way that tells the same.

    Returns
    -------
    list of lists of LabelSpot or None
        For each piece one for each of its wishes.
    """
    counts = [len(piece_wishes) for piece_wishes in wishes]
    if not sum(counts):
        return [[] for _ in pieces]
    places = _places(pieces)
    free = _free_regions(pieces, ticks)
    if any(wish.hidden for piece_wishes in wishes for wish in piece_wishes):
        free = np.concatenate((free, _hidden_regions(pieces, free)))
    boxes = _boxes(pieces, wishes, places)
    bounds = offsets_of(np.array(counts))
    flat = list(chain.from_iterable(wishes))
    hidden = np.array([wish.hidden for wish in flat])
    chosen = _choose(places, boxes, free, bounds, _spare(flat, bounds), hidden)
    centre, along = places.centre.reshape(-1, 2), places.along.reshape(-1, 2)
    turned = np.rad2deg(np.arctan2(along[:, 1], along[:, 0]))
    spots: list[LabelSpot | None] = []
    for number, (choice, place) in enumerate(chosen.tolist()):
        if choice < 0:
            spots.append(None)
            continue
        wide, high = (2 * boxes.half[choice]).tolist()
        way = flat[number].choices[choice - int(boxes.first_choice[number])]
        spots.append(LabelSpot(way, centre[place], float(turned[place]), (wide, high)))
    return [spots[start:end] for start, end in pairwise(bounds.tolist())]


def _places(pieces: Sequence[Piece]) -> _Places:
    """List the places around every station of all pieces: ways by asides."""
    counts = np.array([len(piece.crossings) for piece in pieces])
    last = np.cumsum(counts) - 1
    points = np.concatenate([piece.points for piece in pieces])
    directions = np.concatenate([piece.directions for piece in pieces])
    rails = np.concatenate([piece.rails for piece in pieces])
    breadth = np.hypot(*(rails[:, 1] - rails[:, 0]).T)
    step = np.diff(points, axis=0, append=points[-1:])
    # Before the first station and after the last one the ribbon goes straight on.
    length = np.hypot(*step.T)
    pitch = np.where(counts > 1, length[last - 1], breadth[last])
    after, before = step.copy(), np.roll(step, 1, axis=0)
    after[last] = directions[last] * pitch[:, None]
    start = last - counts + 1
    pitch = np.where(counts > 1, length[start], breadth[start])
    before[start] = directions[start] * pitch[:, None]
    wider, wider_before = np.diff(breadth, append=0.0), np.zeros(len(breadth))
    wider[last] = 0.0
    wider_before[1:] = -wider[:-1]
    wider_before[start] = 0.0
    centre = np.empty((len(points), len(_WAYS), len(_ASIDE), 2))
    along = np.empty_like(centre)
    for column, part in enumerate(_WAYS):
        way, change = (after, wider) if part > 0 else (before, wider_before)
        unit = way / np.hypot(*way.T)[:, None] if part else directions
        across = unit[:, ::-1] * (-1.0, 1.0) * (breadth + abs(part) * change)[:, None]
        for row, aside in enumerate(_ASIDE):
            centre[:, column, row] = points + part * way + aside * across
            along[:, column, row] = unit
    return _Places(centre, along)


def _outlines(pieces: Sequence[Piece]) -> npt.NDArray[Any]:
    """Return the outline of each piece as a polygon."""
    return np.array([shapely.Polygon(piece.outline) for piece in pieces], dtype=object)


def _free_regions(
    pieces: Sequence[Piece], ticks: Sequence[Sequence[FloatArray]]
) -> npt.NDArray[Any]:
    """Return the part of each piece where letters may stand: off its edge, holes and ticks."""
    inside = shapely.buffer(_outlines(pieces), -CLEAR_MM, join_style="mitre")
    every = np.arange(len(pieces))
    holes = np.concatenate([piece.holes for piece in pieces])
    lines = np.array(list(chain.from_iterable(ticks))).reshape(-1, 2, 2)
    slots = [shapely.Polygon(slot.path.flattened(0.01)) for piece in pieces for slot in piece.slots]
    obstacles = np.concatenate(
        (
            shapely.buffer(shapely.points(holes[:, 1:3]), holes[:, 3] / 2 + CLEAR_MM, quad_segs=6),
            shapely.buffer(shapely.linestrings(lines), CLEAR_MM, cap_style="square"),
            shapely.buffer(np.array(slots, dtype=object), CLEAR_MM, quad_segs=6),
        )
    )
    counts = (
        [len(piece.holes) for piece in pieces],
        [len(piece_ticks) for piece_ticks in ticks],
        [len(piece.slots) for piece in pieces],
    )
    owner = np.concatenate([np.repeat(every, count) for count in counts])
    order = np.argsort(owner, kind="stable")
    has, number = np.unique(owner[order], return_inverse=True)
    taken = shapely.multipolygons(obstacles[order], indices=number)
    # Two obstacles may overlap, and make no valid multipolygon.
    inside[has] = shapely.difference(inside[has], shapely.buffer(taken, 0.0))
    shapely.prepare(inside)
    return np.asarray(inside)


def covered_rooms(pieces: Sequence[Piece]) -> npt.NDArray[Any]:
    """Return the part of each piece that strands cover, well inside of its border."""
    bounds = offsets_of(np.array([len(piece.covers) for piece in pieces]))
    covers = np.array([cover for piece in pieces for cover in covers_of(piece)], dtype=object)
    inner = shapely.buffer(covers, -COVER_MM, join_style="mitre")
    rooms = [shapely.union_all(inner[start:end]) for start, end in pairwise(bounds.tolist())]
    return np.array(rooms, dtype=object)


def covers_of(piece: Piece) -> list[Any]:
    """Return what strands cover of a piece, as valid polygons.

    A cover that is almost cut in two may run through itself by a rounding once it was turned; and
    between corners a rounding apart there is no direction, so that one of them goes.
    """
    covers = np.array([shapely.Polygon(cover) for cover in piece.covers], dtype=object)
    return list(shapely.make_valid(shapely.remove_repeated_points(covers, _SAME_MM)))


def _hidden_regions(pieces: Sequence[Piece], free: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return what strands cover of the part of each piece where letters may stand."""
    hidden = np.asarray(shapely.intersection(covered_rooms(pieces), free))
    shapely.prepare(hidden)
    return hidden


def _boxes(
    pieces: Sequence[Piece], wishes: Sequence[Sequence[LabelWish]], places: _Places
) -> _Boxes:
    """List the boxes of every wish.

    Places without room for its lowest choice are left out, and those nearer to another station.
    """
    stations = offsets_of(np.array([len(piece.crossings) for piece in pieces]))
    own = _nearest_to_own(pieces, places)
    halves: list[tuple[float, float]] = []
    listed, n_choices, owner = [], [], []
    for index, (piece, piece_wishes) in enumerate(zip(pieces, wishes, strict=True)):
        first = int(stations[index]) * _PER_STATION
        anywhere = first + _for_the_whole(len(piece.crossings))
        for wish in piece_wishes:
            if wish.station is None:
                listed.append(anywhere)
            else:
                beside = first + wish.station * _PER_STATION + _AT_A_STATION
                listed.append(beside[own[beside]])
            halves += [_half_size(choice) for choice in wish.choices]
            n_choices.append(len(wish.choices))
            owner.append(index)
    half, place = np.array(halves), np.concatenate(listed)
    first_choice = offsets_of(np.array(n_choices))
    number = np.repeat(np.arange(len(owner)), [len(numbers) for numbers in listed])
    # Whatever its length, a text needs half its height around the middle of its box.
    lowest = np.minimum.reduceat(half[:, 1], first_choice[:-1])[number]
    kept = np.zeros(len(place), dtype=np.bool_)
    x, y = places.centre.reshape(-1, 2)[place].T
    piece_of, outlines = np.array(owner)[number], _outlines(pieces)
    for height in np.unique(lowest).tolist():
        # Bevelled corners leave a little more than there is, so nothing is missed.
        core = shapely.buffer(outlines, -(CLEAR_MM + height), join_style="bevel")
        shapely.prepare(core)
        some = np.flatnonzero(lowest == height)
        kept[some] = shapely.contains_xy(core[piece_of[some]], x[some], y[some])
    n_kept = np.bincount(number[kept], minlength=len(owner))
    return _Boxes(half, first_choice, place[kept], offsets_of(n_kept))


def _nearest_to_own(pieces: Sequence[Piece], places: _Places) -> BoolArray:
    """Say which places are no nearer to another station of their piece than to their own.

    Where a piece winds, a way along it may lead past a station that is further on.
    """
    own = np.empty(len(places.centre) * _PER_STATION, dtype=np.bool_)
    start = 0
    for piece in pieces:
        stop = start + len(piece.points)
        centre = places.centre[start:stop].reshape(-1, _PER_STATION, 2)
        mine = np.hypot(*np.moveaxis(centre - piece.points[:, None], -1, 0))
        nearest = KDTree(piece.points).query(centre)[0]
        own[start * _PER_STATION : stop * _PER_STATION] = (mine <= nearest + _SAME_MM).ravel()
        start = stop
    return own


_PER_STATION = len(_WAYS) * len(_ASIDE)
# A place's number is (station * ways + way) * asides + aside.
_AT_A_STATION = np.add.outer(np.arange(len(_ASIDE)), np.arange(len(_BESIDE)) * len(_ASIDE)).reshape(
    -1
)


def _for_the_whole(count: int) -> IntArray:
    """Return the places for a label of a whole piece, the nearest to its middle first."""
    segments = sorted(range(count - 1), key=lambda k: (abs(k - (count - 2) / 2), k))
    stations = sorted(range(count), key=lambda k: (abs(k - (count - 1) / 2), k))
    way = {part: number for number, part in enumerate(_WAYS)}
    steps = [
        (segment + (part < 0)) * len(_WAYS) + way[part] for part in _MIDWAY for segment in segments
    ]
    steps += [station * len(_WAYS) + way[0.0] for station in stations]
    return np.add.outer(np.arange(len(_ASIDE)), np.array(steps) * len(_ASIDE)).reshape(-1)


def _half_size(choice: LabelChoice) -> tuple[float, float]:
    """Return half the width and half the height of a lettered text."""
    box = text_box(choice.text, choice.height_mm)
    if choice.text == ARROW:  # a low sign, alone in its line
        return box.width / 2, choice.height_mm / 4
    return box.width / 2, (box.top - box.bottom) / 2


def _spare(wishes: Sequence[LabelWish], bounds: IntArray) -> IntArray:
    """Return for each choice how many wishes of its piece that follow it tells, too."""
    end = np.repeat(bounds[1:], np.diff(bounds)).tolist()
    spare = []
    for number, wish in enumerate(wishes):
        following = wishes[number + 1 : end[number]] if wish.station is None else ()
        for choice in wish.choices:
            told = (
                after.station is None and set(after.words) <= set(choice.kinds)
                for after in following
            )
            spare.append(sum(1 for _ in takewhile(bool, told)))
    return np.array(spare)


def _choose(
    places: _Places,
    boxes: _Boxes,
    free: npt.NDArray[Any],
    bounds: IntArray,
    spare: IntArray,
    hidden: BoolArray,
) -> IntArray:
    """Return the choice and the place of every wish, (W, 2); -1 where there is none.

    ``free`` lists the regions of all pieces, and then those for wishes that are to be hidden.
    """
    n_pieces = len(bounds) - 1
    centre, along = places.centre.reshape(-1, 2), places.along.reshape(-1, 2)
    n_places = np.diff(boxes.first_place)
    n_boxes = n_places * np.diff(boxes.first_choice)
    chosen = np.full((len(n_boxes), 2), -1)
    most = int(np.diff(bounds).max())
    # Of every piece, the boxes that are taken: centre, direction, half size.
    kept = np.zeros((n_pieces, most, 6))
    n_kept = np.zeros(n_pieces, dtype=np.int64)
    wish, tried = bounds[:-1].copy(), np.zeros(n_pieces, dtype=np.int64)
    while len(active := np.flatnonzero(wish < bounds[1:])):
        now = wish[active]
        number = tried[active, None] + np.arange(_CHUNK)
        row, column = np.nonzero(number < n_boxes[now][:, None])
        wish_of_box, number = now[row], number[row, column]
        choice = boxes.first_choice[wish_of_box] + number // n_places[wish_of_box]
        place = boxes.place[boxes.first_place[wish_of_box] + number % n_places[wish_of_box]]
        box = np.column_stack((centre[place], along[place], boxes.half[choice]))
        piece = active[row]
        region = free[piece + n_pieces * hidden[wish_of_box]]
        good = shapely.contains_properly(region, shapely.polygons(_corners(box)))
        some = np.flatnonzero(good)
        good[some] = _apart(box[some], kept[piece[some]], n_kept[piece[some]])
        # The first good box of each wish; rows come in order.
        served, first = np.unique(row[good], return_index=True)
        taken = np.flatnonzero(good)[first]
        chosen[now[served], 0], chosen[now[served], 1] = choice[taken], place[taken]
        winner = active[served]
        kept[winner, n_kept[winner]] = box[taken]
        n_kept[winner] += 1
        tried[active] += _CHUNK
        done = tried[active] >= n_boxes[now]
        done[served] = True
        wish[active[done]] += 1
        tried[active[done]] = 0
        wish[winner] += spare[choice[taken]]
    return chosen


def _corners(box: FloatArray) -> FloatArray:
    """Return the corners of boxes, (N, 4, 2)."""
    along = box[:, 2:4] * box[:, 4:5]
    upward = box[:, 3:1:-1] * (-1.0, 1.0) * box[:, 5:6]
    reach = np.stack((-along - upward, along - upward, along + upward, upward - along), axis=1)
    return np.asarray(box[:, None, :2] + reach)


def _apart(box: FloatArray, kept: FloatArray, n_kept: IntArray) -> BoolArray:
    """Say which boxes (N, 6) keep apart from all boxes that are taken (N, K, 6).

    Two rectangles are apart if they are so along a side of one of them. In a line they keep a
    space between words, one above the other the clearance.
    """
    new = box[:, None, :]
    away = kept[..., :2] - new[..., :2]
    turn = new[..., 2] * kept[..., 2] + new[..., 3] * kept[..., 3]
    slant = new[..., 2] * kept[..., 3] - new[..., 3] * kept[..., 2]
    turn, slant = np.abs(turn), np.abs(slant)
    apart = np.arange(kept.shape[1]) >= n_kept[:, None]
    for mine, theirs in ((new, kept), (kept, new)):
        wide, high = mine[..., 4] + WORD_SPACE_MM, mine[..., 5] + CLEAR_MM
        along = np.abs(away[..., 0] * mine[..., 2] + away[..., 1] * mine[..., 3])
        across = np.abs(away[..., 1] * mine[..., 2] - away[..., 0] * mine[..., 3])
        apart |= along > wide + theirs[..., 4] * turn + theirs[..., 5] * slant
        apart |= across > high + theirs[..., 4] * slant + theirs[..., 5] * turn
    return np.asarray(apart.all(axis=1))


@frozen_value
class Marks:
    """What is engraved on a piece, in its own coordinates, and what found no room.

    Of the lines in ``ticks``, those of guides come first, and then those at stations, ``ticked``.
    """

    labels: tuple[Label, ...]
    ticks: tuple[FloatArray, ...]
    dropped: tuple[Missing, ...]
    ticked: tuple[int, ...] = ()

    @property
    def seen(self) -> tuple[Label, ...]:
        """The labels that are not hidden."""
        return tuple(label for label in self.labels if not label.hidden)


def mark_pieces(
    pieces: Sequence[Piece],
    n_crossings: int,
    labels: str = "full",
    side: str = "outside",
    kinds: Kinds | None = None,
    steps: Mapping[str, int] = MappingProxyType({}),
    prefix: str = "",
    least_mm: float = 0.0,
    leaders: IntArray | None = None,
) -> tuple[Marks, ...]:
    """Engrave every piece.

    Labels read along the thread; one that finds no clear place is made smaller, then shortened,
    and dropped at last, the least important first. Where the lower strand of a crossing has no
    hole, it has a tick inside either edge, abreast of its middle; glued joints have their guides.
    Where labels are to be hidden, all stands where strands cover it, but for ids that find no room
    there, and ticks and guides are left out that are not covered.

    Parameters
    ----------
    pieces : sequence of Piece
    n_crossings : int
        Of the whole job.
    labels : str
        One of :data:`fabweave.sheet.labels.texts.LABELS`.
    side : str
        The face that is engraved and read, ``"outside"`` or ``"inside"``: on the inside letters
        are mirrored in the piece's coordinates, in which the outside is seen. Nothing that is
        engraved there need be covered to be hidden.
    kinds : Kinds, optional
        Which pieces are the same; needed where only that is told.
    steps : mapping
        The step in which each piece is placed, by its id, as far as that is told.
    prefix : str
        Stands before the id of each, as on sheets that several jobs share.
    least_mm : float
        How high letters are, but for ids that find no room otherwise.
    leaders : (P,) int array, optional
        The pieces whose letters each bears, where it is only asked how long engraving takes; each
        its own if not given.

    Returns
    -------
    tuple of Marks
        One for each piece.
    """
    if not pieces or labels == "none":
        return (Marks((), (), ()),) * len(pieces)
    if labels == "kinds":
        if kinds is None:
            raise ValueError("labels that tell kinds want to know them")
        return _mark_kinds(pieces, kinds, prefix, mirrored=side == "inside")
    inside = side == "inside"
    owners = find_owners(pieces, n_crossings)
    begins = {piece.start_joint: piece.id for piece in pieces}
    ends = {piece.end_joint: piece.id for piece in pieces}
    wanted = [
        [
            raised(wish, least_mm)
            for wish in wishes(
                replace(piece, id=prefix + piece.id),
                [pieces[other].id for other in owners.partners(piece)],
                (ends.get(piece.start_joint), begins.get(piece.end_joint)),
                labels,
                steps.get(piece.id),
                inside=inside,
            )
        ]
        for piece in pieces
    ]
    rooms = _rooms(pieces, hidden=labels == "hidden" and not inside)
    guides = _inside(pieces, rooms)
    ticks = [
        ticks_of(piece, room) if labels != "numbers" else {}
        for piece, room in zip(pieces, rooms, strict=True)
    ]
    lines = [(*own, *chain(*more.values())) for own, more in zip(guides, ticks, strict=True)]
    every = range(len(pieces)) if leaders is None else leaders.tolist()
    laid = sorted(set(every))
    own_lines, own_wishes = ([own[at] for at in laid] for own in (lines, wanted))
    found = find_spots([pieces[at] for at in laid], own_lines, own_wishes)
    spots = dict(zip(laid, found, strict=True))
    marks = [
        _marks(wanted[at], spots[at], own, mirrored=inside)
        for at, own in zip(every, lines, strict=True)
    ]
    return tuple(replace(one, ticked=tuple(own)) for one, own in zip(marks, ticks, strict=True))


def mark_spares(
    spares: Sequence[Piece],
    originals: Sequence[Marks],
    labels: str,
    side: str = "outside",
    prefix: str = "",
) -> tuple[Marks, ...]:
    """Engrave spares: their ids alone, or where kinds are told, what their originals bear.

    Parameters
    ----------
    spares : sequence of Piece
    originals : sequence of Marks
        For each spare, those of the piece that it is a copy of.
    labels, side, prefix : str
        As for :func:`mark_pieces`.
    """
    if not spares or labels in ("kinds", "none"):
        return tuple(originals)
    mirrored = side == "inside"
    wanted = [
        list(spare_wishes(prefix + spare.id, hidden=labels == "hidden" and not mirrored))
        for spare in spares
    ]
    ticks = [marks.ticks for marks in originals]
    return tuple(
        _marks(*each, mirrored=mirrored)
        for each in zip(wanted, find_spots(spares, ticks, wanted), ticks, strict=True)
    )


def _mark_kinds(
    pieces: Sequence[Piece], kinds: Kinds, prefix: str, *, mirrored: bool
) -> tuple[Marks, ...]:
    """Engrave the first piece of each kind, and all others at the same places."""
    first = kinds.first
    leaders = [pieces[at] for at in first.tolist()]
    ticked = _inside(pieces, _rooms(pieces, hidden=not mirrored))
    leading = [ticked[at] for at in first.tolist()]
    names = [prefix + kind_name(kind + 1) for kind in range(len(first))]
    wanted = [list(kind_wishes(name, hidden=not mirrored)) for name in names]
    spots = find_spots(leaders, leading, wanted)
    marked = [
        _marks(wishes_of_kind, spots_of_kind, (), mirrored=mirrored)
        for wishes_of_kind, spots_of_kind in zip(wanted, spots, strict=True)
    ]
    result = []
    for at, (piece, kind) in enumerate(zip(pieces, (kinds.number - 1).tolist(), strict=True)):
        turn, shift = motion_onto(piece, leaders[kind], backwards=bool(kinds.turned[at]))
        labels = marked[kind].labels
        if at != first[kind]:
            labels = tuple(_carried(label, turn.conjugate(), shift) for label in labels)
        result.append(Marks(labels, ticked[at], marked[kind].dropped))
    return tuple(result)


def _carried(label: Label, turn: complex, shift: complex) -> Label:
    """Return a label on a piece that a turn, undone here, and a shift take onto the label's."""

    def back(points: FloatArray) -> FloatArray:
        return moved_by(points - (shift.real, shift.imag), turn, 0.0)

    return replace(
        label,
        centre=back(label.centre),
        rotation_deg=label.rotation_deg + float(np.degrees(np.angle(turn))),
        strokes=tuple(back(stroke) for stroke in label.strokes),
    )


def _marks(
    wanted: Sequence[LabelWish],
    spots: Sequence[LabelSpot | None],
    ticks: tuple[FloatArray, ...],
    *,
    mirrored: bool,
) -> Marks:
    """Letter the wishes of a piece that found a spot, and list all that is told nowhere."""
    lettered: list[Label] = []
    covered: set[Missing] = set()
    for wish, spot in zip(wanted, spots, strict=True):
        if spot is None:
            continue
        text, height, kinds = spot.choice
        strokes = place_text(text, height, spot.centre, spot.rotation_deg, mirrored=mirrored)
        lettered.append(
            Label(
                text=text,
                kinds=kinds,
                station=wish.station,
                height_mm=height,
                centre=spot.centre,
                rotation_deg=spot.rotation_deg,
                box_mm=spot.box_mm,
                strokes=tuple(strokes),
                hidden=wish.hidden,
            )
        )
        covered.update(Missing(kind, wish.words[kind], wish.station) for kind in kinds)
    every = [
        Missing(kind, words, wish.station)
        for wish in wanted
        for kind, words in wish.words.items()
        if kind != "id" or wish.station is None  # it is told elsewhere
    ]
    missing = [item for item in dict.fromkeys(every) if item not in covered]
    return Marks(tuple(lettered), ticks, tuple(missing))


def ticks_of(piece: Piece, room: Any) -> dict[int, FloatArray]:
    """Return ticks where a piece passes under another without a hole, abreast of the crossing.

    Parameters
    ----------
    piece : Piece
    room : polygon
        Where they may be.

    Returns
    -------
    dict from station to (2, 2, 2) float array
        Two lines each, as far apart as there is room; none where that is too narrow.
    """
    bare = np.isnan(piece.hole_mm) & ~piece.over
    bare[[*piece.more_holes[:, 0].astype(int), *(slot.station for slot in piece.slots)]] = False
    if piece.guides:
        # They mark the crossing of their joint, and may lie where a tick would.
        ends = [piece.start_joint is not None, piece.end_joint is not None]
        bare[[0, -1]] &= ~np.array(ends)
    ticks = {}
    across = shapely.intersection(room, shapely.linestrings(piece.rails[bare]))
    for station, parts in zip(np.flatnonzero(bare).tolist(), across, strict=True):
        middle = shapely.Point(piece.points[station])
        whole = min(shapely.get_parts(parts), key=middle.distance, default=None)
        if whole is None or whole.distance(middle) > _SAME_MM or not whole.length:
            continue
        drawn = edge_ticks(*shapely.get_coordinates(whole)[[0, -1]])
        if drawn:
            ticks[station] = np.array(drawn)
    return ticks


def _rooms(pieces: Sequence[Piece], *, hidden: bool) -> npt.NDArray[Any]:
    """Return where lines may be: inside of each piece; of what is to be hidden, what is covered."""
    room = shapely.buffer(_outlines(pieces), -CLEAR_MM / 2, join_style="mitre")
    if hidden:
        room = shapely.intersection(room, covered_rooms(pieces))
    shapely.prepare(room)
    return np.asarray(room)


def _inside(pieces: Sequence[Piece], rooms: npt.NDArray[Any]) -> list[tuple[FloatArray, ...]]:
    """Return the guides inside their room; at a slanting or tapering panel some may not be."""
    counts = [len(piece.guides) for piece in pieces]
    lines = np.array([guide for piece in pieces for guide in piece.guides]).reshape(-1, 2, 2)
    held = shapely.contains_properly(np.repeat(rooms, counts), shapely.linestrings(lines))
    kept = np.split(held, np.cumsum(counts)[:-1])
    return [
        tuple(compress(piece.guides, flags.tolist()))
        for piece, flags in zip(pieces, kept, strict=True)
    ]


def seen_mm(pieces: Sequence[Piece], marks: Sequence[Marks]) -> float:
    """Return the length of all strokes that no strand covers.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Marks
        What is engraved on the outer face of each.

    Returns
    -------
    float
        Millimetres; 0.0 if everything is covered.
    """
    # What is hidden is covered by its making; only the rest is to be measured.
    return sum(
        _seen_of_piece(piece, [*(stroke for label in one.seen for stroke in label.strokes)])
        + _seen_of_piece(piece, one.ticks)
        for piece, one in zip(pieces, marks, strict=True)
    )


def _seen_of_piece(piece: Piece, strokes: Sequence[np.ndarray]) -> float:
    """Return how much of some strokes is outside all covers of their piece."""
    if not strokes:
        return 0.0
    lines = shapely.multilinestrings([shapely.linestrings(stroke) for stroke in strokes])
    covers = shapely.union_all(covers_of(piece))
    return float(shapely.length(shapely.difference(lines, covers)))
