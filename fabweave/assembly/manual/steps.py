"""Write the steps of the manual: the whole object now and then, and each step in large."""

from collections.abc import Sequence

import numpy as np

from fabweave.assembly.manual.book import LEADING, Book, text_width, wrapped
from fabweave.assembly.manual.marks import Slide
from fabweave.assembly.manual.ring_picture import RingPicture, ring_picture
from fabweave.assembly.manual.step_pictures import WHOLE, StepPicture, WholePicture
from fabweave.assembly.manual.tags import CORNER, SIGN, TAG, Tag, place_tags
from fabweave.assembly.manual.words import (
    BOXES,
    LEGEND,
    RINGED,
    UNPICTURED,
    hang_words,
    layers_words,
    place_words,
    progress_words,
    steps_words,
    strand_pieces,
    time_words,
    view_words,
)
from fabweave.core.arrays import FloatArray
from fabweave.flat.crossing_map import CrossingMap, StepRecord
from fabweave.flat.rim_ring import RimRing

SECTION = "Steps"
#: Size of all texts, of the number of a step, and of what stands beside it, in points.
_TEXT, _NUMBER, _HEAD = 9.5, 24.0, 27.0
#: Between columns, and below each step.
_GUTTER, _GAP = 15.0, 12.0
_BOX = 8.0


def write_steps(
    book: Book,
    crossing_map: CrossingMap,
    pictures: Sequence[WholePicture],
    seconds: Sequence[float],
    rings: Sequence[RimRing] = (),
) -> None:
    """Write all steps in two columns; those of rings come last.

    Parameters
    ----------
    book : Book
    crossing_map : CrossingMap
    pictures : sequence of WholePicture
        Of all steps; none if they are too many.
    seconds : sequence of float
        About how long each step takes.
    rings : sequence of RimRing
        Those of the last steps.
    """
    book.page(SECTION)
    legend = (LEGEND if pictures else UNPICTURED) + (RINGED if rings else "")
    book.y = book.block(book.left, book.y, legend + BOXES, book.right - book.left, size=_TEXT)
    writer = _Writer(book, crossing_map, seconds)
    woven = [step for step in crossing_map.steps if step.ring is None]
    if not pictures:
        for step in woven:
            writer.write(step, None)
    steps = iter(woven)
    for whole in pictures:
        own = [next(steps) for _ in whole.steps]
        writer.write_whole(whole, own)
        for step, picture in zip(own, whole.steps, strict=True):
            writer.write(step, picture)
    for step, ring in zip(crossing_map.steps[len(woven) :], rings, strict=True):
        writer.write_ring(step, ring)


class _Writer:
    """Writes one step after another, down one column and then the next."""

    def __init__(self, book: Book, crossing_map: CrossingMap, seconds: Sequence[float]) -> None:
        self._book, self._map, self._seconds = book, crossing_map, seconds
        self._pieces = {piece.id: piece for piece in crossing_map.pieces}
        self._strands = strand_pieces(crossing_map)
        # Where no fastener goes, nobody needs to know that the last layer has come.
        self._idle = {one.id for one in crossing_map.crossings if one.fastened is False}
        self._wide = (book.right - book.left - _GUTTER) / 2
        self._column, self._top, self._y = 0, book.y - _GAP, book.y - _GAP
        self._there, self._so_far = 0, 0.0

    def _room(self, height: float) -> tuple[float, float]:
        """Take so much room in a column; return the left and the upper end of it."""
        book = self._book
        if self._y - height < book.foot:
            self._column += 1
            if self._column == 2:
                book.page(SECTION)
                self._column, self._top = 0, book.top - _GAP / 2
            self._y = self._top
        x, y = book.left + self._column * (self._wide + _GUTTER), self._y
        book.line([(x, y), (x + self._wide, y)], width=0.6, grey=0.55)
        self._y -= height
        return x, y

    def write_whole(self, whole: WholePicture, steps: Sequence[StepRecord]) -> None:
        """Write the picture of the whole object before the steps that it shows."""
        book = self._book
        self._there += sum(len(step.pieces) for step in steps)
        seen = view_words(whole.view, turned=whole.turned)
        progress = progress_words(self._there, len(self._pieces))
        high = 20.0 + self._high(seen, self._wide, bold=whole.turned)
        high += self._high(progress, self._wide) + 4.0
        x, y = self._room(high + WHOLE[1] + _GAP)
        head = steps_words(steps[0].number, steps[-1].number)
        book.text(x, y - 16.0, head, size=14.0, bold=True)
        end = book.block(x, y - 20.0, seen, self._wide, size=_TEXT, bold=whole.turned)
        book.block(x, end, progress, self._wide, size=_TEXT)
        low = y - high - WHOLE[1]
        book.image(whole.painted, x, low, *WHOLE)
        tags = place_tags(whole.marks, WHOLE, np.zeros((0, 2)), 0.0, whole.bands)
        self._draw_tags(tags, np.array([x, low]), ringed=True)

    def write(self, step: StepRecord, picture: StepPicture | None) -> None:
        """Write a step: its number, its pieces, what to do, and its picture."""
        book = self._book
        beside = picture is not None and picture.size[0] < self._wide / 2
        size = picture.size if picture else (0.0, 0.0)
        room = self._wide - (size[0] + 8.0 if beside else 0.0)
        due = [key for key in step.fasten if key not in self._idle]
        texts = [
            step.text,
            layers_words(step, self._pieces, self._strands, due),
            hang_words(step, self._map),
        ]
        told = sum(self._high(text, room) + 2.0 for text in texts if text)
        rows = self._rows(step)
        high = _HEAD + LEADING * _TEXT * (len(rows) - 1)
        body = max(told + 4.0, size[1] + 4.0) if beside else told + size[1] + 6.0
        x, y = self._room(high + body + _GAP)
        self._write_head(x, y, step, rows)
        y -= high
        end = y
        for text in filter(None, texts):
            end = book.block(x + self._wide - room, end, text, room, size=_TEXT) - 2.0
        if picture:
            top = y - 4.0 if beside else end - 4.0
            self._draw(picture, np.array([x, top - size[1]]))

    def write_ring(self, step: StepRecord, ring: RimRing) -> None:
        """Write the step that lays a ring, with its pieces flat below one another."""
        book, picture = self._book, ring_picture(ring, self._wide)
        texts = [text for text in (step.text, hang_words(step, self._map)) if text]
        told = sum(self._high(text, self._wide) + 2.0 for text in texts)
        rows = self._rows(step)
        high = _HEAD + LEADING * _TEXT * (len(rows) - 1)
        x, y = self._room(high + told + picture.high + _GAP)
        self._write_head(x, y, step, rows)
        end = y - high
        for text in texts:
            end = book.block(x, end, text, self._wide, size=_TEXT) - 2.0
        self._draw_ring(picture, np.array([x, end]))

    def _draw_ring(self, picture: RingPicture, corner: FloatArray) -> None:
        """Draw the pieces of a ring with their upper left corner at a place."""
        book = self._book
        for piece in picture.pieces:
            book.line(piece.outline + corner, width=0.8, closed=True, fill=0.93)
            for number, (hole, beside) in enumerate(
                zip(piece.holes + corner, piece.numbers + corner, strict=True), start=1
            ):
                x, y = hole.tolist()
                book.circle(x, y, piece.hole)
                x, y = beside.tolist()
                book.text(x, y, str(number), size=_TEXT, align=0.5, middle=True)
            x, y = (piece.middle + corner).tolist()
            book.text(x, y, piece.id, size=_TEXT, bold=True, align=0.5, middle=True)
        x, y = corner.tolist()
        ratio = f"1 : {picture.ratio:g}"
        book.text(x + self._wide, y - picture.high + 2.5, ratio, size=_TEXT, align=1.0)

    def _write_head(self, x: float, y: float, step: StepRecord, rows: list[list[str]]) -> None:
        """Write the number of a step, its time, and its pieces with their boxes."""
        book = self._book
        seconds = self._seconds[step.number - 1]
        self._so_far += seconds
        y -= 0.84 * _NUMBER
        head = f"Step {step.number}"
        book.text(x, y, head, size=_NUMBER, bold=True)
        time = time_words(seconds, self._so_far)
        book.text(x + self._wide, y, time, size=_TEXT, align=1.0)
        at = x + text_width(head, _NUMBER, bold=True) + 10.0
        for row in rows:
            for name in row:
                book.tick_box(at, y - 0.5, _BOX)
                book.text(at + _BOX + 4.0, y, name, size=_TEXT, bold=True)
                at += self._name_width(name)
            at, y = x, y - LEADING * _TEXT

    def _rows(self, step: StepRecord) -> list[list[str]]:
        """Return the pieces of a step in rows; the first is beside its number."""
        by_kind = self._map.cut.labels == "kinds"
        names = [place_words(self._pieces[key], by_kind=by_kind) for key in step.pieces]
        names += [f"{name} (rim)" for name in step.ring or ()]
        left = self._wide - text_width(f"Step {step.number}", _NUMBER, bold=True) - 84.0
        rows: list[list[str]] = [[]]
        for name in names:
            wide = self._name_width(name)
            if wide > left:
                rows.append([])
                left = self._wide
            rows[-1].append(name)
            left -= wide
        return rows

    def _name_width(self, name: str) -> float:
        return _BOX + 4.0 + text_width(name, _TEXT, bold=True) + 10.0

    def _high(self, text: str, width: float, *, bold: bool = False) -> float:
        """Return the height of a text."""
        return LEADING * _TEXT * len(wrapped(text, _TEXT, width, bold=bold))

    def _draw(self, picture: StepPicture, corner: FloatArray) -> None:
        """Draw the picture of a step with its lower left corner at a place."""
        book = self._book
        x, y = corner.tolist()
        wide, high = picture.size
        book.image(picture.painted, x, y, wide, high)
        for slide in picture.slides:
            _draw_slide(book, slide, corner)
        for spot in (picture.fasten + corner).tolist():
            book.complete(*spot)
        bands = np.concatenate([ends.mean(axis=1) for ends in picture.ends])
        tags = place_tags(picture.marks, picture.size, picture.crossings, picture.radius, bands)
        self._draw_tags(tags, corner, ringed=False)
        ratio = f"1 : {picture.ratio:g}"
        left, top = x + wide - CORNER[0], y + CORNER[1]
        corners = [(left, y), (x + wide, y), (x + wide, top), (left, top)]
        book.line(corners, width=0.0, closed=True, fill=1.0)
        book.text(x + wide - 2.0, y + 2.5, ratio, size=_TEXT, align=1.0)
        frame = [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)]
        book.line(frame, width=0.4, grey=0.55, closed=True)

    def _draw_tags(self, tags: Sequence[Tag], corner: FloatArray, *, ringed: bool) -> None:
        """Draw names, and lines to what they name: dashed to what is hidden."""
        book = self._book
        for tag in tags:
            if tag.led:
                line = tag.line + corner
                # A white line below the black one: it is seen on dark and on light.
                book.line(line, width=2.2, grey=1.0)
                book.line(line, width=0.8, dash=(2.0, 1.5) if tag.mark.hidden else ())
            if ringed:
                book.ring(*(tag.mark.at + corner).tolist())
        for tag in tags:
            dark = tag.mark.kind == "new"
            (left, low), (right, top) = (
                (tag.middle + way * tag.half + corner).tolist() for way in (-1.0, 1.0)
            )
            box = [(left, low), (right, low), (right, top), (left, top)]
            book.line(box, width=0.7, closed=True, fill=0.0 if dark else 1.0)
            middle = (low + top) / 2
            if tag.mark.kind in ("over", "under"):
                book.sign(left + 2.0 + SIGN / 2, middle, over=tag.mark.kind == "over")
                left += SIGN - 1.0
            book.text((left + right) / 2, middle, tag.mark.text, size=TAG, bold=True, align=0.5,
                      grey=1.0 if dark else 0.0, middle=True)  # fmt: skip


def _draw_slide(book: Book, slide: Slide, corner: FloatArray) -> None:
    """Draw the way of an end: a line where it is seen, dots where it runs beneath, and a head."""
    points = slide.points + corner
    for number, beneath in enumerate(slide.beneath.tolist()):
        run = points[number : number + 2]
        if beneath:
            book.line(run, width=1.3, dash=(1.3, 1.3))
        else:
            book.line(run, width=1.2, grey=1.0)
    tip, way = points[-1], points[-1] - points[-2]
    way = way / max(float(np.linalg.norm(way)), 1e-9)
    side = np.array([-way[1], way[0]])
    head = np.stack((tip + 7.0 * way, tip + 3.2 * side, tip - 3.2 * side))
    book.line(head, width=0.8, grey=1.0, closed=True, fill=0.0)
