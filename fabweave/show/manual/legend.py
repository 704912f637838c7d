"""Write how to read a piece: one of the job, and its signs in large, each with what it means."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.piece.joint.kinds import KINDS
from fabweave.plan.crossing_map import CrossingMap, PieceRecord
from fabweave.sheet.drawing import Layer
from fabweave.show.manual.book import LEADING, Book
from fabweave.show.manual.sheets import DrawnPiece, levelling

LEGEND = "How to read a piece"
#: The number of each kind of label among all signs; those that a page explains are counted anew.
_NUMBER_OF = {"id": "1", "joint": "2", "partner": "3", "sign": "3"}
#: Sizes of heads, and of texts that are read beside pictures.
_HEAD, _READ = 12.0, 11.0
#: What a sign is shown in: width and height in points, between two, and points to a millimetre.
_LENS, _LENS_GAP, _LENS_SCALE = (210.0, 88.0), 6.0, 6.0
#: How high the piece may be drawn.
_HIGHEST = 150.0
#: Takes points of the sheet, (N, 2), to the page.
_Place: TypeAlias = Callable[[FloatArray], FloatArray]


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
    wide = book.right - book.left
    low, high = points.min(axis=0), points.max(axis=0)
    scale = min(wide / float(high[0] - low[0]), _HIGHEST / float(high[1] - low[1]))
    book.y -= 34.0
    shift = np.array([book.left, book.y]) - np.array([low[0], high[1]]) * scale
    _draw_piece(book, drawn_piece, lambda at: at @ turn * scale + shift)
    signs = _signs(crossing_map, piece)
    # Those that are explained are counted without a gap.
    kinds = [name[0] for name, _ in signs if name[0].isdigit()]
    counted = {kind: str(number) for number, kind in enumerate(kinds, start=1)}
    spots = [
        (counted[kind], spot)
        for kind, spot in _spots(crossing_map, piece, drawn_piece)
        if kind in counted
    ]
    _point_out(book, spots, lambda at: at @ turn * scale + shift)
    book.y -= float(high[1] - low[1]) * scale + 20.0
    book.text(book.left, book.y, f"Piece {piece.id} of this object", size=_HEAD, bold=True)
    book.y -= 6.0
    for sign, text in signs:
        name = counted.get(sign[0], sign[0]) + sign[1:]
        shown = [spot for number, spot in spots if number == name[:1]]
        book.room(_LENS[1] if shown else 30.0, LEGEND)
        top, left = book.y, book.left + (_LENS[0] + 14.0 if shown else 0.0)
        if shown:
            _magnify(book, drawn_piece, turn, shown)
        book.y -= LEADING * _HEAD
        book.text(left, book.y + 0.25 * _HEAD, name, size=_HEAD, bold=True)
        book.y = book.block(left, book.y - 2.0, text, book.right - left, size=_READ) - 8.0
        if shown:
            book.y = min(book.y, top - _LENS[1] - 8.0)


def _spots(
    crossing_map: CrossingMap, piece: PieceRecord, drawn: DrawnPiece
) -> list[tuple[str, FloatArray]]:
    """Return the kinds of signs, by their numbers here, and where one of each is on the sheet.

    Of crossings that are passed over and under one each is shown, if there are both.
    """
    places: dict[str, tuple[float, float]] = {}
    for label in piece.labels:
        number = _NUMBER_OF.get(label.kind, "")
        over = label.station is not None and piece.stations[label.station].over
        places.setdefault(f"{number} over" if number == "3" and over else number,
                          (label.x, label.y))  # fmt: skip
    holes = [station for station in piece.stations if station.hole_mm]
    if holes:
        middle = holes[len(holes) // 2]
        places["5"] = middle.x, middle.y
    places.pop("", None)
    spots = [
        (name[:1], crossing_map.on_sheet(piece, np.array([place]))[0])
        for name, place in places.items()
    ]
    ticks = [run.mean(axis=0) for layer, run in drawn.lines if layer is Layer.ENGRAVE_MARK]
    if ticks and spots:
        # The tick that is farthest from what has a number already.
        apart = [min(float(np.hypot(*(tick - at))) for _, at in spots) for tick in ticks]
        spots.append(("4", ticks[int(np.argmax(apart))]))
    return spots


def _magnify(book: Book, drawn: DrawnPiece, turn: FloatArray, spots: Sequence[FloatArray]) -> None:
    """Draw what is around some signs, one or two, side by side in the room of one lens."""
    wide = (_LENS[0] - _LENS_GAP * (len(spots) - 1)) / len(spots)
    for number, spot in enumerate(spots):
        corner = np.array([book.left + number * (wide + _LENS_GAP), book.y - _LENS[1]])
        size = np.array([wide, _LENS[1]])
        middle = corner + size / 2.0
        x, y = corner.tolist()
        book.line([(x, y), (x + wide, y), (x + wide, y + _LENS[1]), (x, y + _LENS[1])],
                  width=0.6, grey=0.45, closed=True)  # fmt: skip
        with book.clipped(*corner.tolist(), *size.tolist()):
            _draw_piece(book, drawn, lambda at: (at - spot) @ turn * _LENS_SCALE + middle)  # noqa: B023 - called at once


def _draw_piece(book: Book, drawn: DrawnPiece, at: _Place) -> None:
    """Draw a piece: its outline, what is engraved, and its holes."""
    book.line(at(drawn.outline), width=1.0, closed=True, fill=0.95)
    for layer, line in drawn.lines:
        book.line(at(line), width=1.2 if layer is Layer.ENGRAVE_LABEL else 0.8)
    turns = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    circle = np.column_stack((np.cos(turns), np.sin(turns)))
    for x, y, radius in drawn.holes.tolist():
        book.line(at(circle * radius + (x, y)), width=0.8, closed=True)


def _point_out(
    book: Book,
    spots: Sequence[tuple[str, FloatArray]],
    place: _Place,
) -> None:
    """Stand the number of each sign above the piece, with a line to where it is on it."""
    if not spots:
        return
    points = place(np.array([spot for _, spot in spots]))
    last = -np.inf
    for at in np.argsort(points[:, 0], kind="stable").tolist():
        x, y = points[at].tolist()
        stand = max(x, last + 18.0)
        last = stand
        book.line([(x, y + 1.5), (stand, book.y + 12.0)], width=0.6, grey=0.35)
        book.tag(stand, book.y + 18.0, spots[at][0], dark=True)


def _signs(crossing_map: CrossingMap, piece: PieceRecord) -> list[tuple[str, str]]:
    """Say what the marks on a piece mean, each with an example from the piece itself."""
    labels = {label.kind: label.text for label in reversed(piece.labels)}
    inside = any(sheet.mirrored for sheet in crossing_map.sheets)
    signs = []
    face = "inside" if inside else "outside"
    if labels:
        covered = any(label.hidden for label in piece.labels)
        words = f"This is the {face} of the object."
        words += " Other strands cover the letters when it is woven." if covered else ""
        signs.append(("Engraved face", words))
    else:
        signs.append(
            (
                "No lettering",
                f"The pieces are not engraved. The face that is up on the sheet is the {face}.",
            )
        )
    if "id" in labels and crossing_map.cut.labels == "kinds":
        signs.append(
            (
                "1 Kind",
                f"K{piece.kind}: all pieces with these letters are alike, and any of them fits any "
                f"of their places. {piece.id} is a name of the place alone: its letters name the "
                "thread, and the number counts its pieces. The arrow points from the start of a "
                "piece to its end; or back, where a step says so.",
            )
        )
    elif "id" in labels:
        signs.append(
            (
                "1 Id",
                f"{piece.id}: the letters name the thread, and the number counts its pieces. The "
                "arrow points from the start of the piece to its end.",
            )
        )
    if "joint" in labels:
        key = next(key for key in piece.joints if key is not None)
        mate = next(joint for joint in crossing_map.joints if joint.id == key).mate(piece.id)
        signs.append(("2 Joint", f"#{key}>{mate}: joint {key} joins this end to piece {mate}."))
    station = piece.stations[0]
    if "partner" in labels or "sign" in labels:
        word = "over" if station.over else "under"
        signs.append(
            (
                "3 Crossing",
                "Beside a crossing stands the piece that is met there: with a disc before its id "
                f"where this piece passes over, with a ring where it passes under. At its first "
                f"station, {piece.id} passes {word} {station.partner}.",
            )
        )
    if any(KINDS[joint.kind].marked for joint in crossing_map.joints):
        signs.append(
            (
                "4 Cross",
                "A cross in place of a hole marks a glued lap: lay cross on cross. Where there are "
                "ticks, the end of the other piece lies at them.",
            )
        )
    if any(station.hole_mm for station in piece.stations):
        signs.append(
            ("5 Hole", "A fastener goes through all layers of the crossing: line up their holes.")
        )
    return signs
