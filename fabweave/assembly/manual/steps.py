"""Write the steps of the manual: a picture, what to do, and a box to tick."""

import math
from collections.abc import Iterator, Mapping, Sequence

from PIL import Image, ImageChops

from fabweave.assembly.manual.book import LEADING, SMALL, TEXT, Book, tag_size, wrapped
from fabweave.assembly.manual.views import PICTURE_PX, StepPicture
from fabweave.core.messages import agree
from fabweave.flat.crossing_map import (
    CrossingMap,
    JointRecord,
    PieceRecord,
    StationRecord,
    StepRecord,
)
from fabweave.picture.camera import View

SECTION = "Steps"
#: Steps on a page where texts are short, and the space between them, in points.
_ON_A_PAGE, _GAP = 4, 14.0
_NUMBER, _BOX = 24.0, 14.0
#: How far from what it names a tag may stand, in points, and in how many directions it is tried.
_REACHES, _DIRECTIONS = (14.0, 24.0, 36.0, 52.0), 12
#: So large a share of a picture may differ from an earlier one before it is kept as a whole.
_PATCH = 0.12
_LEGEND = (
    "New pieces are dark, pieces in place are light, and pieces still to come are faint. Black "
    "tags name new pieces, white tags joints."
)
_UNPICTURED = (
    "There are too many steps to show each in a picture here: model.glb shows the woven object, "
    "and assembly.html each step on it, where that could be made."
)
_SIDES = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")


def write_steps(
    book: Book, crossing_map: CrossingMap, pictures: Sequence[StepPicture | None]
) -> None:
    """Write all steps, as many on a page as there is room for; a step may have no picture."""
    book.page(SECTION)
    legend = _LEGEND if any(pictures) else _UNPICTURED
    book.y = book.block(
        book.left,
        book.y,
        f"{legend} Tick the box when a step is done. Crossings and joints are numbered as in the "
        "crossing tables.",
        book.right - book.left,
        size=SMALL,
    )
    book.y -= _GAP
    parts = {piece.id: piece for piece in crossing_map.pieces}
    by_kind = crossing_map.cut.labels == "kinds"
    # Where no fastener goes, nobody needs to know that the last layer has come.
    idle = {crossing.id for crossing in crossing_map.crossings if crossing.fastened is False}
    joints = {joint.id: joint for joint in crossing_map.joints}
    strands = strand_pieces(crossing_map)
    there: set[str] = set()
    drawn = _Pictures(book)
    for step, picture in zip(crossing_map.steps, pictures, strict=True):
        high = (book.top - book.foot) / _ON_A_PAGE - _GAP - 0.1 if picture else 0.0
        wide = high * PICTURE_PX[0] / PICTURE_PX[1]
        x = book.left + (wide + 12.0 if picture else 0.0)
        room = book.right - x
        turn = turn_words(picture.view) if picture and picture.turned else ""
        there.update(step.pieces)
        rows = [
            placing(parts[key], step, joints, strands, there, by_kind=by_kind)
            for key in step.pieces
        ]
        fasten = _fastening([key for key in step.fasten if key not in idle])
        size = _NUMBER + 8.0 + LEADING * TEXT * len(wrapped(step.text, TEXT, room)) + 6.0
        size += sum(_lines(line, room - _BOX - 4.0) + 3.0 for line in rows)
        size += _lines(turn, room, bold=True) + 3.0 + _lines(fasten, room)
        book.room(max(size, high), SECTION)
        top = book.y
        if picture:
            drawn.draw(picture, book.left, top - high, (wide, high))
            _tag_picture(book, picture, book.left, top - high, (wide, high))
        y = top - _NUMBER
        book.text(x, y + 3.0, f"Step {step.number}", size=_NUMBER, bold=True)
        book.tick_box(book.right - _BOX - 1.0, y + 3.0, _BOX)
        y -= 4.0
        if turn:
            y = book.block(x, y, turn, room, size=SMALL, bold=True) - 3.0
        y = book.block(x, y, step.text, room) - 6.0
        for line in rows:
            book.tick_box(x + 1.0, y - LEADING * SMALL + 2.0, 8.0)
            y = book.block(x + _BOX + 2.0, y, line, room - _BOX - 4.0, size=SMALL) - 3.0
        if fasten:
            y = book.block(x, y, fasten, room, size=SMALL)
        book.y = min(y, top - high) - _GAP
        book.line([(book.left, book.y + _GAP / 2), (book.right, book.y + _GAP / 2)], grey=0.7)


def strand_pieces(crossing_map: CrossingMap) -> dict[tuple[int, bool], list[str]]:
    """Return the pieces of each strand: crossing, and whether it is the one on top."""
    strands: dict[tuple[int, bool], list[str]] = {}
    for piece in crossing_map.pieces:
        for station in piece.stations:
            strands.setdefault((station.crossing, station.over), []).append(piece.id)
    return strands


def placing(
    piece: PieceRecord,
    step: StepRecord,
    joints: Mapping[int, JointRecord],
    strands: dict[tuple[int, bool], list[str]],
    there: set[str],
    *,
    by_kind: bool = False,
) -> str:
    """Return what a new piece does in a step: over and under whom, at which crossings, and joints.

    Parameters
    ----------
    piece : PieceRecord
    step : StepRecord
    joints : mapping from id to JointRecord
        All joints.
    strands : dict
        The pieces of each strand, from ``strand_pieces``.
    there : set of str
        The pieces that are in place after this step; only they are named.
    by_kind : bool
        Whether pieces bear their kind in place of their id.

    Returns
    -------
    str
        Such as ``"C1 (sheet 2): over E1 at 39; joint #12 with C4"``.
    """
    clauses = []
    for word, passing, crossings in (("over", True, step.over), ("under", False, step.under)):
        named = [
            f"{' and '.join(_met(station, strands, there))} at {station.crossing}"
            for station in piece.stations
            if station.over == passing and station.crossing in crossings
        ]
        if named:
            clauses.append(f"{word} {', '.join(named)}")
    for key in dict.fromkeys(piece.joints):
        if key in step.joints:
            mate = joints[key].mate(piece.id)
            clauses.append(f"joint #{key} with {'itself' if mate == piece.id else mate}")
    which = f"sheet {piece.sheet}"
    if by_kind:
        which = f"any K{piece.kind}" + (", arrow back" if piece.turned else "")
    return f"{piece.id} ({which}): {'; '.join(clauses) or 'lay it down'}"


def _met(
    station: StationRecord, strands: dict[tuple[int, bool], list[str]], there: set[str]
) -> list[str]:
    """Return the pieces in place that a station meets: two at a joint."""
    pieces = strands[station.crossing, not station.over]
    return list(dict.fromkeys(key for key in pieces if key in there))


def turn_words(view: View) -> str:
    """Say how the object is to be turned.

    Examples
    --------
    >>> turn_words(View(-60.0, 28.0))
    'Turn the object to see it from the front right and above.'
    """
    high = "above" if view.elevation_deg > 0 else "below"
    if abs(view.elevation_deg) > 60.0:
        return f"Turn the object to see it from straight {high}."
    side = _SIDES[math.floor((view.azimuth_deg + 90.0) / 45.0 + 0.5) % 8]
    return f"Turn the object to see it from the {side} and {high}."


def _fastening(crossings: Sequence[int]) -> str:
    """Say at which crossings the last layer has come."""
    if not crossings:
        return ""
    listed = ", ".join(map(str, crossings))
    return agree(len(crossings), f"All layers are now in place at [crossing|crossings] {listed}.")


def _lines(text: str, width: float, *, bold: bool = False) -> float:
    """Return the height of a small text."""
    if not text:
        return 0.0
    return LEADING * SMALL * len(wrapped(text, SMALL, width, bold=bold))


class _Pictures:
    """Draws pictures on pages; of one that resembles an earlier one, only what differs is kept."""

    def __init__(self, book: Book) -> None:
        self._book = book
        self._whole: dict[View, tuple[str, Image.Image]] = {}

    def draw(self, picture: StepPicture, x: float, y: float, size: tuple[float, float]) -> None:
        """Draw a picture."""
        image = picture.image
        (width, high), (wide_px, high_px) = size, image.size
        if picture.view in self._whole:
            name, whole = self._whole[picture.view]
            box = ImageChops.difference(whole, image).getbbox() or (0, 0, 1, 1)
            left, top, right, bottom = box
            if (right - left) * (bottom - top) <= _PATCH * wide_px * high_px:
                across, up = width / wide_px, high / high_px
                self._book.image(name, x, y, width, high)
                self._book.image(
                    image.crop(box),
                    x + left * across,
                    y + (high_px - bottom) * up,
                    (right - left) * across,
                    (bottom - top) * up,
                )
                return
        name = self._book.image(image, x, y, width, high)
        self._whole[picture.view] = name, image


def _tag_picture(
    book: Book, picture: StepPicture, x: float, y: float, size: tuple[float, float]
) -> None:
    """Name the new pieces and joints of a step in its picture."""
    width, high = size
    taken: list[tuple[float, float, float, float]] = []
    wanted = [
        *((key, place, True) for key, place in picture.pieces.items()),
        *((f"#{key}", place, False) for key, place in picture.joints.items()),
    ]
    for text, (across, down), dark in wanted:
        at = x + across * width, y + (1.0 - down) * high
        wide, tall = tag_size(text)
        for spot in _spots(at):
            box = spot[0] - wide / 2, spot[1] - tall / 2, spot[0] + wide / 2, spot[1] + tall / 2
            inside = x < box[0] and box[2] < x + width and y < box[1] and box[3] < y + high
            if inside and not any(_overlap(box, other) for other in taken):
                taken.append(box)
                # A white line below the black one: it is seen on dark and on light.
                book.line([at, spot], width=2.0, grey=1.0)
                book.line([at, spot], width=0.8)
                book.tag(*spot, text, dark=dark)
                break


def _spots(at: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Yield places around a point, the nearest first."""
    for reach in _REACHES:
        for step in range(_DIRECTIONS):
            turn = 2.0 * math.pi * (step + 1.5) / _DIRECTIONS
            yield at[0] + reach * math.cos(turn), at[1] + reach * math.sin(turn)


def _overlap(
    box: tuple[float, float, float, float], other: tuple[float, float, float, float]
) -> bool:
    """Return whether two boxes touch."""
    return box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]
