"""Draw what the manual has beside its steps: how to read a piece, threads, parts, and bags."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple, TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
from fabweave.piece.joint.kinds import KINDS
from fabweave.plan.crossing_map import CrossingMap, PieceRecord, StationRecord, ThreadRecord
from fabweave.sheet.drawing import Layer, SheetDrawing
from fabweave.show.manual.book import LEADING, SMALL, Book, text_width, wrapped
from fabweave.show.manual.sheets import DrawnPiece, drawn_pieces, levelling

LEGEND = "How to read a piece"
#: Sizes of heads, and of texts that are read beside pictures.
_HEAD, _READ = 12.0, 11.0
#: What a sign is shown in: width and height in points, between two, and points to a millimetre.
_LENS, _LENS_GAP, _LENS_SCALE = (210.0, 72.0), 6.0, 6.0
#: How high the piece may be drawn.
_HIGHEST = 150.0
#: Takes points of the sheet, (N, 2), to the page.
_Place: TypeAlias = Callable[[FloatArray], FloatArray]


class _Sign(NamedTuple):
    """A sign on a piece: what it is called, what it means, and where some are on the sheet."""

    title: str
    text: str
    spots: FloatArray = np.zeros((0, 2))


def write_legend(book: Book, crossing_map: CrossingMap, drawn: dict[str, DrawnPiece]) -> None:
    """Show a piece of this job, and in large each of its signs with what it means."""
    book.page(LEGEND)
    piece = max(
        crossing_map.pieces,
        key=lambda piece: (len({label.kind for label in piece.labels}), len(piece.labels)),
    )
    drawn_piece = drawn[piece.id]
    turn = levelling(drawn_piece.outline)
    for label in piece.labels[:1]:
        angle = np.deg2rad(label.rotation_deg)
        way = np.array([[0.0, 0.0], [np.cos(angle), np.sin(angle)]])
        start, tip = crossing_map.on_sheet(piece, way + np.array([label.x, label.y]))
        if ((tip - start) @ turn)[0] < 0.0:
            turn = -turn  # its letters would stand on their heads
    points = drawn_piece.outline @ turn
    low, high = points.min(axis=0), points.max(axis=0)
    wide, tall = (high - low).tolist()
    scale = min((book.right - book.left) / wide, _HIGHEST / tall)
    book.y -= 34.0
    shift = np.array([book.left, book.y]) - np.array([low[0], high[1]]) * scale

    def at(places: FloatArray) -> FloatArray:
        return np.asarray(places @ turn * scale + shift)

    _draw_piece(book, drawn_piece, at)
    # The first says which face it is, and has no number.
    signs = [
        (str(number or ""), sign)
        for number, sign in enumerate(_signs(crossing_map, piece, drawn_piece))
    ]
    _point_out(
        book, [(number, *spot) for number, sign in signs for spot in at(sign.spots).tolist()]
    )
    book.y -= tall * scale + 20.0
    book.text(book.left, book.y, f"Piece {piece.id} of this object", size=_HEAD, bold=True)
    book.y -= 6.0
    for number, sign in signs:
        shown = len(sign.spots) > 0
        book.room(_LENS[1] if shown else 30.0, LEGEND)
        top, left = book.y, book.left + (_LENS[0] + 14.0 if shown else 0.0)
        _magnify(book, drawn_piece, turn, sign.spots)
        book.y -= LEADING * _HEAD
        name = f"{number} {sign.title}".strip()
        book.text(left, book.y + 0.25 * _HEAD, name, size=_HEAD, bold=True)
        book.y = book.block(left, book.y - 2.0, sign.text, book.right - left, size=_READ) - 8.0
        if shown:
            book.y = min(book.y, top - _LENS[1] - 8.0)


def _magnify(book: Book, drawn: DrawnPiece, turn: FloatArray, spots: FloatArray) -> None:
    """Draw what is around some signs, side by side in the room of one lens."""
    wide = (_LENS[0] - _LENS_GAP * (len(spots) - 1)) / max(len(spots), 1)
    for number, spot in enumerate(spots):
        x, y = book.left + number * (wide + _LENS_GAP), book.y - _LENS[1]
        middle = np.array([x + wide / 2.0, y + _LENS[1] / 2.0])
        with book.clipped(x, y, wide, _LENS[1]):
            _draw_piece(book, drawn, lambda at: (at - spot) @ turn * _LENS_SCALE + middle)  # noqa: B023 - called at once
        book.box(x, y, wide, _LENS[1], width=0.6, grey=0.45)


def _draw_piece(book: Book, drawn: DrawnPiece, at: _Place) -> None:
    """Draw a piece: its outline, what is engraved, and its holes."""
    book.line(at(drawn.outline), width=1.0, closed=True, fill=0.95)
    for layer, line in drawn.lines:
        book.line(at(line), width=1.2 if layer is Layer.ENGRAVE_LABEL else 0.8)
    turns = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    circle = np.column_stack((np.cos(turns), np.sin(turns)))
    for x, y, radius in drawn.holes.tolist():
        book.line(at(circle * radius + (x, y)), width=0.8, closed=True)


def _point_out(book: Book, spots: Sequence[tuple[str, float, float]]) -> None:
    """Stand the number of each sign above the piece, with a line to where it is on it."""
    last = -np.inf
    for number, x, y in sorted(spots, key=lambda spot: spot[1]):
        last = max(x, last + 18.0)
        book.line([(x, y + 1.5), (last, book.y + 12.0)], width=0.6, grey=0.35)
        book.tag(last, book.y + 18.0, number, dark=True)


#: What is engraved of the step in which a piece is placed.
STEP = re.compile(r"\((\d+)\)$")


def _signs(crossing_map: CrossingMap, piece: PieceRecord, drawn: DrawnPiece) -> list[_Sign]:
    """Say what the marks on a piece mean, each with an example from the piece itself."""

    def on_sheet(*places: tuple[float, float]) -> FloatArray:
        return crossing_map.on_sheet(piece, np.array(places).reshape(-1, 2))

    # Of each kind the first; of crossings the first that goes over, and the first under.
    labels, met, said = {}, {}, {}
    for label in reversed(piece.labels):
        labels[label.kind] = place = on_sheet((label.x, label.y))
        said[label.kind] = label.text
        if label.kind in ("partner", "sign") and label.station is not None:
            station = piece.stations[label.station]
            met[station.over] = (
                place,
                f"A {'disc' if station.over else 'ring'} and {station.partner}: here {piece.id} "
                f"passes {'over' if station.over else 'under'} {station.partner}.",
            )
    face = "inside" if any(sheet.mirrored for sheet in crossing_map.sheets) else "outside"
    if any(sheet.roll_mm for sheet in crossing_map.sheets):
        signs = [_Sign("Marked face", f"These marks are copied from its tape. It is the {face}.")]
    elif labels:
        covered = " In the woven object, other strands cover the letters."
        hidden = any(label.hidden for label in piece.labels)
        signs = [_Sign("Engraved face", f"This is the {face} of the object.{covered * hidden}")]
    else:
        bare = f"The pieces are not engraved. The face that is up on the sheet is the {face}."
        signs = [_Sign("No lettering", bare)]
    thread = f"{piece.id}: the letters name the thread, and the number counts its pieces."
    arrow = "The arrow points from the start of the piece to its end"
    if "id" in labels and crossing_map.cut.labels == "kinds":
        text = (
            f"K{piece.kind}: all pieces with these letters are alike, and each fits any of their "
            f"places. A place has a name of its own, such as {thread} {arrow}; or back, where a "
            "step says so."
        )
        signs.append(_Sign("Kind", text, labels["id"]))
    elif "id" in labels:
        again = sum(label.text == piece.id for label in piece.labels) > 1
        more = f" {piece.id} stands again along its length." if again else ""
        signs.append(_Sign("Id", f"{thread} {arrow}.{more}", labels["id"]))
    step = next((label for label in piece.labels if STEP.search(label.text)), None)
    if step is not None:
        number = STEP.findall(step.text)[0]
        text = f"({number}): {piece.id} is placed in step {number}."
        signs.append(_Sign("Step", text, on_sheet((step.x, step.y))))
    if "joint" in labels:
        key = int(re.findall(r"\d+", said["joint"])[0])
        mate = next(joint for joint in crossing_map.joints if joint.id == key).mate(piece.id)
        text = f"{said['joint']}: joint {key} joins this end to piece {mate}."
        signs.append(_Sign("Joint", text, labels["joint"]))
    if met:
        text = "Beside a crossing stands the piece that crosses there. "
        text += " ".join(words for _, words in met.values())
        signs.append(_Sign("Crossing", text, np.concatenate([place for place, _ in met.values()])))
    taken = np.concatenate([np.zeros((0, 2)), *(sign.spots for sign in signs)])
    return signs + _marks(crossing_map, piece, drawn, taken)


def _marks(
    crossing_map: CrossingMap, piece: PieceRecord, drawn: DrawnPiece, taken: FloatArray
) -> list[_Sign]:
    """Say what the lines and holes of a piece mean; some places on it have a number already."""

    def on_sheet(places: Sequence[tuple[float, float]]) -> FloatArray:
        return crossing_map.on_sheet(piece, np.array(places).reshape(-1, 2))

    signs = []
    if piece.ticks:
        first = piece.stations[piece.ticks[0]]
        text = "Two ticks, one inside each edge: here a strand crosses over this piece."
        signs.append(_Sign("Ticks", text, on_sheet([(first.x, first.y)])))
    first = piece.stations[0]
    text = "Millimetres along a strip count from here: its first crossing, at its start."
    signs.append(_Sign("0 mm", text, on_sheet([(first.x, first.y)])))
    holes = [(one.x, one.y) for one in piece.stations if one.hole_mm]
    hole = on_sheet(holes[len(holes) // 2 :][:1])
    if any(KINDS[joint.kind].marked for joint in crossing_map.joints):
        text = (
            "A cross in place of a hole marks a lap without fastener: lay cross on cross. "
            "Ticks show where the other piece ends."
        )
        ticks = [run.mean(axis=0) for layer, run in drawn.lines if layer is Layer.ENGRAVE_MARK]
        taken = np.concatenate([hole, taken])
        if ticks and len(taken):
            # The tick that is farthest from what has a number already.
            apart = np.linalg.norm(np.array(ticks)[:, None] - taken, axis=2).min(axis=1)
            ticks = [ticks[int(np.argmax(apart))]]
        signs.append(_Sign("Cross", text, np.array(ticks[:1]).reshape(-1, 2)))
    if holes:
        text = (
            "A fastener goes through all layers of the crossing: line up their holes. Steps say "
            "where; other holes stay empty."
        )
        signs.append(_Sign("Hole", text, hole))
    return signs


MAP = "Threads and their pieces"
_INTRO = (
    "Each thread is drawn as a band in the colours that it has on the cover. Above the band "
    "are its pieces, with a line at each joint (#) between them; below it are the pieces that "
    "cross it, each strand drawn, with a disc where the thread goes over and a ring where it "
    "goes under, as on the pieces. A closed thread ends with the joint at which it began. Beside "
    "the name of the thread is the step in which each piece is placed."
)
#: Least and greatest distance of crossings along a band, in points, and the band's half width.
_PITCH, _WIDEST, _HALF = 9.9, 16.0, 4.5
#: Above the middle of a band stand its pieces, then its joints; below it signs, then partners.
_PIECES_UP, _JOINTS_UP, _SIGNS_DOWN, _PARTNERS_DOWN = 14.5, 23.5, 11.5, 15.5
#: The least size of a name that has little room, in points.
_LEAST = 8.0
#: Height of a thread's heading, of what is above and below a band, and half the width of a strand
#: that crosses it.
_STRIP_HEAD, _ABOVE, _BELOW, _STRAND = 14.0, 34.0, 36.0, 1.9


#: A crossing on the way along a thread as one of its pieces sees it, and which piece.
_Stop: TypeAlias = tuple[StationRecord, str]


def thread_stops(thread: ThreadRecord, pieces: Mapping[str, PieceRecord]) -> list[_Stop]:
    """Return the crossings of a thread in order, those of joints once.

    A closed thread ends with the joint at which it began.

    Parameters
    ----------
    thread : ThreadRecord
    pieces : mapping from id to PieceRecord
        All pieces.
    """
    stops: list[_Stop] = []
    for key in thread.pieces:
        piece = pieces[key]
        shared = 1 if stops and piece.joints[0] is not None else 0
        stops += [(station, key) for station in piece.stations[shared:]]
    return stops


def write_map(book: Book, crossing_map: CrossingMap, colours: Colours) -> None:
    """Draw each thread as a band in its colours, with its pieces, joints and what crosses it."""
    book.page(MAP)
    book.y = book.block(book.left, book.y, _INTRO, book.right - book.left, size=SMALL)
    pieces = {piece.id: piece for piece in crossing_map.pieces}
    step_of = {key: step.step for step in crossing_map.steps for key in step.pieces}
    wide = book.right - book.left
    per_row = int(wide / _PITCH) - 1
    for thread in crossing_map.threads:
        stops = thread_stops(thread, pieces)
        name = f"Thread {thread.label}"
        figures = "ring" if thread.closed else "open"
        figures += agree(len(thread.pieces), ", {n} [piece|pieces]")
        figures += agree(len(set(thread.crossings)), ", {n} [crossing|crossings]")
        steps = ", ".join(f"{key} {step_of[key]}" for key in thread.pieces)
        beside = text_width(name, 12.0, bold=True) + 8.0
        lines = wrapped(f"{figures}; steps: {steps}", SMALL, wide - beside)
        book.room(_STRIP_HEAD + LEADING * SMALL * (len(lines) - 1) + _ABOVE + _BELOW, MAP)
        book.y -= _STRIP_HEAD
        book.text(book.left, book.y, name, size=12.0, bold=True)
        for number, line in enumerate(lines):
            book.y -= LEADING * SMALL if number else 0.0
            book.text(book.left + beside, book.y, line, size=SMALL)
        pitch = max(_PITCH, min(_WIDEST, wide / (len(stops) + 1)))
        start = 0
        while start < len(stops):
            end = _row_end(stops, start, per_row)
            book.room(_ABOVE + _BELOW, MAP)
            book.y -= _ABOVE
            _write_row(book, stops[start:end], pitch, colours)
            book.y -= _BELOW
            start = end


def _row_end(stops: list[_Stop], start: int, most: int) -> int:
    """Return where a row ends: at a joint if there is one, so that pieces stay whole."""
    end = min(start + most, len(stops))
    if end == len(stops):
        return end
    joints = (at + 1 for at in range(end - 1, start, -1) if stops[at][0].joint is not None)
    return next(joints, end)


def _write_row(book: Book, stops: list[_Stop], pitch: float, colours: Colours) -> None:
    """Draw a part of a thread; the middle of its band is where the book stands."""
    y = book.y
    places = [book.left + (number + 1) * pitch for number in range(len(stops))]
    for x, (stop, _) in zip(places, stops, strict=True):
        if stop.over:
            _strand(book, x, y)
    halves = [tuple(part) for stop, _ in stops for part in colours[stop.crossing, int(stop.over)]]
    left = book.left + pitch / 2
    for colour, run in groupby(halves):
        wide = len(list(run)) * pitch / 2
        book.area(left, y - _HALF, wide, 2 * _HALF, colour)
        left += wide
    for x, (stop, _) in zip(places, stops, strict=True):
        if not stop.over:
            _strand(book, x, y)
        if stop.joint is not None:
            book.line([(x, y - _HALF - 1.0), (x, y + _JOINTS_UP - 2.0)], width=1.3)
            book.text(x, y + _JOINTS_UP, f"#{stop.joint}", size=SMALL, align=0.5)
        book.sign(x, y - _SIGNS_DOWN, over=stop.over)
        low = y - _PARTNERS_DOWN
        book.text(x, low, stop.partner, size=SMALL, align=1.0, angle_deg=90.0, middle=True)
    first = 0
    for at in range(1, len(stops) + 1):
        if at == len(stops) or stops[at][1] != stops[first][1]:
            # From the joint where the piece begins, which is the stop before, to its last stop.
            left = places[first] - pitch if first else places[0]
            _name_piece(book, stops[first][1], left, places[at - 1], y + _PIECES_UP)
            first = at


def _name_piece(book: Book, key: str, left: float, right: float, y: float) -> None:
    """Write the id of a piece above the middle of what is seen of it, in its room."""
    room = max(right - left, _PITCH) - 3.0
    size = min(10.0, max(_LEAST, 10.0 * room / text_width(key, 10.0, bold=True)))
    book.text((left + right) / 2, y - _PIECES_UP + 6.5, key, size=size, bold=True, align=0.5)


def _strand(book: Book, x: float, y: float) -> None:
    """Draw the strand that crosses a band."""
    book.box(x - _STRAND, y - _HALF - 3.5, 2 * _STRAND, 2 * _HALF + 5.0, width=0.5, fill=1.0)


#: A bag holds about so many pieces.
_IN_A_BAG = 12


class Bag(NamedTuple):
    """What is taken to the table at once: its first and last step, and the pieces of these."""

    first: int
    last: int
    pieces: tuple[str, ...]


def bags_of(crossing_map: CrossingMap) -> list[Bag]:
    """Return the bags into which pieces are sorted, step after step."""
    every = [(step.step, (*step.pieces, *(step.ring or ()))) for step in crossing_map.steps]
    total = sum(len(names) for _, names in every)
    share = total / max(math.ceil(total / _IN_A_BAG), 1)
    bags: list[list[tuple[int, tuple[str, ...]]]] = []
    filled = 0
    for number, names in every:
        if filled >= share * len(bags) or not bags:
            bags.append([])
        bags[-1].append((number, names))
        filled += len(names)
    return [Bag(own[0][0], own[-1][0], tuple(key for _, keys in own for key in keys))
            for own in bags]  # fmt: skip


BAGS = "Labels for bags"
#: Labels stand in two columns, so high, in points, and with so much between them.
_LABEL_HIGH, _LABEL_GAP = 92.0, 12.0


def write_bags(book: Book, crossing_map: CrossingMap) -> None:
    """Write a label for each bag, to cut out: its steps and its pieces."""
    book.page(BAGS)
    wide = (book.right - book.left - _LABEL_GAP) / 2.0
    for number, bag in enumerate(bags_of(crossing_map)):
        if number % 2 == 0:
            book.room(_LABEL_HIGH + _LABEL_GAP, BAGS)
            book.y -= _LABEL_HIGH + _LABEL_GAP
        left = book.left + (number % 2) * (wide + _LABEL_GAP)
        book.box(left, book.y, wide, _LABEL_HIGH, width=0.5, grey=0.45)
        top = book.y + _LABEL_HIGH - 22.0
        steps = f"Steps {bag.first} to {bag.last}" if bag.last > bag.first else f"Step {bag.first}"
        book.text(left + 8.0, top, f"Bag {number + 1}: {steps}", size=14.0, bold=True)
        book.block(left + 8.0, top - 4.0, ", ".join(bag.pieces), wide - 16.0, size=SMALL)


PARTS = "Parts list"
#: Cells of the parts list: at most so many in a row, the space below a piece for two lines of text,
#: and that beside it.
_COLUMNS, _TEXTS, _BESIDE = 3, 40.0, 14.0
#: Height of what is said above them.
_INTRODUCED = 50.0
_PLACED = (
    " Their ids stand by sheet. Where there is only one, its place is that of its middle on the "
    "sheet, in mm from the left edge and from the lower edge."
)
_SPARES = (
    " A spare, such as A1S1, is one more of the kind of A1: put it in the place of any piece of "
    "that kind that breaks."
)


def write_parts(book: Book, crossing_map: CrossingMap, drawings: Sequence[SheetDrawing]) -> None:
    """Write the parts list: each kind of piece to one scale, with its length, stations and places.

    Pieces of which only one is cut are called by their id, and their place is told; of others the
    ids stand by sheet, those of spares among them.
    """
    drawn = drawn_pieces(*drawings)
    kinds: dict[int, list[PieceRecord]] = {}
    for piece in crossing_map.to_cut:
        kinds.setdefault(piece.kind, []).append(piece)
    parts = list(kinds.values())
    own, spares = {piece.id for piece in crossing_map.pieces}, len(crossing_map.spares or ())
    outlines = [drawn[pieces[0].id].outline for pieces in parts]
    level = [outline @ levelling(outline) for outline in outlines]
    names = {sheet.sheet: sheet.name for sheet in crossing_map.sheets}
    told = [_places(pieces, names, drawn) for pieces in parts]
    book.page(PARTS)
    # Few kinds are drawn large: in as few columns as a page has room for.
    for columns in range(1, _COLUMNS + 1):
        cells = _cells(book, level, told, columns)
        if sum(cells.heights) <= book.y - book.foot - _INTRODUCED:
            break
    if max(cells.heights) > book.top - book.foot:
        # Only what stands alone in its row can go on over pages.
        cells = _cells(book, level, told, 1)
    book.y = book.block(
        book.left,
        book.y,
        agree(len(own), "{n} [piece|pieces]")
        + (agree(spares, " and {n} spare[|s]") if spares else "")
        + agree(len(parts), " of {n} [kind|kinds], outer face up, drawn at a scale of")
        + f" 1 : {72.0 / 25.4 / cells.scale:.1f}. Pieces of one kind are cut alike and drawn once."
        + ("" if any(sheet.roll_mm for sheet in crossing_map.sheets) else _PLACED)
        + (_SPARES if spares else ""),
        book.right - book.left,
        size=SMALL,
    )
    book.y -= 8.0
    for number, row in enumerate(cells.rows):
        book.room(cells.heights[number], PARTS)
        low = book.y - cells.heights[number]
        for column, at in enumerate(row):
            points, piece, count = level[at], parts[at][0], len(parts[at])
            wanted = sum(one.id in own for one in parts[at])
            more = agree(count - wanted, " and {n} spare[|s]") if count > wanted else ""
            x = book.left + column * cells.width
            y = book.y - cells.highs[number]
            shift = np.array([x, y]) - points.min(axis=0) * cells.scale
            book.line(points * cells.scale + shift, width=0.6, closed=True, fill=0.9)
            y -= 13.0
            key = piece.id if count == 1 else f"Kind {piece.kind}"
            book.text(x, y, key, size=12.0, bold=True)
            book.text(
                x + text_width(key, 12.0, bold=True) + 6.0,
                y,
                ("" if count == 1 else f"x {wanted}{more}: ")
                + f"{np.ptp(points[:, 0]):.0f} mm, "
                + agree(len(piece.stations), "{n} [station|stations]"),
                size=SMALL,
            )
            for line in cells.places[at]:
                y -= LEADING * SMALL
                if y < book.foot:
                    book.page(PARTS)
                    y = book.y - SMALL
                    low = book.foot
                book.text(x, y, line, size=SMALL)
        book.y = low


class _Cells(NamedTuple):
    """How the parts list is laid out.

    ``width`` is that of a cell in points, and ``scale`` points for a millimetre of a piece; there
    are ``rows`` of parts, ``places`` are the lines below each part, ``highs`` and ``heights`` those
    of the pieces of each row, and of all of it.
    """

    width: float
    scale: float
    rows: tuple[range, ...]
    places: tuple[list[str], ...]
    highs: tuple[float, ...]
    heights: tuple[float, ...]


def _cells(
    book: Book, level: Sequence[FloatArray], told: Sequence[Sequence[str]], columns: int
) -> _Cells:
    """Lay parts with these outlines and texts out in columns."""
    width = (book.right - book.left) / columns
    scale = (width - _BESIDE) / max(float(np.ptp(points[:, 0])) for points in level)
    rows = tuple(
        range(first, min(first + columns, len(level))) for first in range(0, len(level), columns)
    )
    places = tuple(
        [line for text in texts for line in wrapped(text, SMALL, width - _BESIDE)] for texts in told
    )
    highs = tuple(max(float(np.ptp(level[at][:, 1])) for at in row) * scale for row in rows)
    heights = tuple(
        high + _TEXTS + LEADING * SMALL * (max(len(places[at]) for at in row) - 1)
        for high, row in zip(highs, rows, strict=True)
    )
    return _Cells(width, scale, rows, places, highs, heights)


def _places(
    pieces: Sequence[PieceRecord], names: Mapping[int, str], drawn: Mapping[str, DrawnPiece]
) -> list[str]:
    """Say where pieces of one kind are: their ids sheet by sheet, or the place of the only one."""
    if len(pieces) == 1:
        across, up = drawn[pieces[0].id].middle.tolist()
        return [f"{names[pieces[0].sheet]} at {across:.0f}, {up:.0f}"]
    by_sheet: dict[int, list[str]] = {}
    for piece in pieces:
        by_sheet.setdefault(piece.sheet, []).append(piece.id)
    return [f"{names[sheet]}: {' '.join(by_sheet[sheet])}" for sheet in sorted(by_sheet)]
