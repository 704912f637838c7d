"""Write how to read a piece: one of the job, and its signs in large, each with what it means."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.piece.joint.kinds import KINDS
from fabweave.plan.crossing_map import CrossingMap, PieceRecord
from fabweave.sheet.drawing import Layer
from fabweave.show.manual.book import LEADING, Book
from fabweave.show.manual.sheets import DrawnPiece, levelling

LEGEND = "How to read a piece"
#: Sizes of heads, and of texts that are read beside pictures.
_HEAD, _READ = 12.0, 11.0
#: What a sign is shown in: width and height in points, between two, and points to a millimetre.
_LENS, _LENS_GAP, _LENS_SCALE = (210.0, 88.0), 6.0, 6.0
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


def _signs(crossing_map: CrossingMap, piece: PieceRecord, drawn: DrawnPiece) -> list[_Sign]:
    """Say what the marks on a piece mean, each with an example from the piece itself."""

    def on_sheet(*places: tuple[float, float]) -> FloatArray:
        return crossing_map.on_sheet(piece, np.array(places).reshape(-1, 2))

    # Of each kind the first; of crossings the first that goes over, and the first under.
    labels, met = {}, {}
    for label in reversed(piece.labels):
        labels[label.kind] = place = on_sheet((label.x, label.y))
        if label.kind in ("partner", "sign") and label.station is not None:
            met[piece.stations[label.station].over] = place
    face = "inside" if any(sheet.mirrored for sheet in crossing_map.sheets) else "outside"
    if labels:
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
        signs.append(_Sign("Id", f"{thread} {arrow}.", labels["id"]))
    if "joint" in labels:
        key = next(key for key in piece.joints if key is not None)
        mate = next(joint for joint in crossing_map.joints if joint.id == key).mate(piece.id)
        text = f"#{key}>{mate}: joint {key} joins this end to piece {mate}."
        signs.append(_Sign("Joint", text, labels["joint"]))
    if met:
        station = piece.stations[0]
        word = "over" if station.over else "under"
        text = (
            "Beside a crossing stands the piece that crosses there: with a disc before its id "
            "where this piece passes over it, with a ring where it passes under. At its first "
            f"station, {piece.id} passes {word} {station.partner}."
        )
        signs.append(_Sign("Crossing", text, np.concatenate(list(met.values()))))
    holes = [(one.x, one.y) for one in piece.stations if one.hole_mm]
    hole = on_sheet(*holes[len(holes) // 2 :][:1])
    if any(KINDS[joint.kind].marked for joint in crossing_map.joints):
        text = (
            "A cross in place of a hole marks a glued lap: lay cross on cross. Where there are "
            "ticks, the end of the other piece lies at them."
        )
        ticks = [run.mean(axis=0) for layer, run in drawn.lines if layer is Layer.ENGRAVE_MARK]
        taken = np.concatenate([hole, *(sign.spots for sign in signs)])
        if ticks and len(taken):
            # The tick that is farthest from what has a number already.
            apart = np.linalg.norm(np.array(ticks)[:, None] - taken, axis=2).min(axis=1)
            ticks = [ticks[int(np.argmax(apart))]]
        signs.append(_Sign("Cross", text, np.array(ticks[:1]).reshape(-1, 2)))
    if holes:
        text = "A fastener goes through all layers of the crossing: line up their holes."
        signs.append(_Sign("Hole", text, hole))
    return signs
