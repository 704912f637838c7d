"""Write the steps of the manual: the whole object now and then, and each step in large."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value, unit
from fabweave.core.messages import agree
from fabweave.former.way_out import Leaving
from fabweave.picture.camera import View
from fabweave.piece.rim_ring import RimRing
from fabweave.plan.crossing_map import CrossingMap, PieceRecord, StepRecord
from fabweave.plan.steps import listed
from fabweave.show.manual.book import LEADING, Book, text_width, wrapped
from fabweave.show.manual.cards import Card, lay_card, what_is_met, write_card
from fabweave.show.manual.step_pictures import (
    TALL,
    WHOLE,
    Overview,
    Slide,
    StepPicture,
    WholePicture,
    side_words,
    strand_pieces,
)
from fabweave.show.manual.tags import CORNER, SIGN, TAG, Tag, place_tags

SECTION = "Steps"
#: Between two pictures of one step, in points.
_PICTURES_APART = 6.0
#: The middle of a clip is so far from its mouth, in points.
_CLIP_UP = np.array([0.0, 6.0])
#: What to look for, now and then.
_LOOK = (
    "Compare. A name or tick that can still be seen waits for a strand to come; all others are "
    "covered. A name that shows beside a strand: that strand is one place off, or under for over."
)
#: Size of all texts, of the number of a step, and of what stands beside it, in points.
_TEXT, _NUMBER, _HEAD = 9.5, 24.0, 25.0
#: Between columns, below each step, and between the line above it and its picture.
_GUTTER, _GAP, _BELOW_LINE = 15.0, 5.0, 4.0
_BOX = 8.0
#: Between cards, and around them.
_CARD_GAP = 5.0
#: The card of a step that makes more crossings stands below its picture, over the whole width.
_BESIDE_PICTURE = 5
#: Numbers of holes stand so far beyond the border, and need so much room, and so much is between
#: pieces, in points.
_BEYOND, _DIGITS, _BETWEEN = 7.0, 7.0, 6.0
#: Beyond a number stands whose hole it is: the size of the name, and how far it reaches, in points.
_ON_TOP, _NAMES = 7.5, 22.0
#: The corners of arcs are off by so much, millimetres.
_FLAT_MM = 0.05
_POINTS_MM = 72.0 / 25.4
LEGEND = (
    "Each step is one strip, read along its length from its start, where the arrow begins. What it "
    "crosses is numbered 1, 2, 3 ... in the words, in the pictures and on the card: a disc where "
    "it goes over, on the outside, a ring where it runs under. Where your strip runs under, the "
    "place is marked on your strip; where it goes over, on the strip that lies there. Millimetres "
    'count from a strip\'s first crossing, 0 on its card: "A1 at its 243 mm" is a place on A1, '
    "small numbers on a card are places on its own strip. Front, back, left and right are those of "
    "page 1: lay the first strip as its picture shows, and mark the front on the table. The card "
    "shows the strip flat, outer face up, with its holes; grey lines are strands to come. New "
    "strips are dark with a black name, and hatched where something nearer hides them. # marks a "
    "joint: lap both ends, holes in line, either on top. White arrows show where an end is pushed "
    "under, dotted where it is beneath. At a circle with a cross all layers are in place: set what "
    "the step says. At a clip, hold both strips together with one. The first pictures show the "
    "table, and the finished object as a ghost: strips may lie flat until others bend them; what "
    "counts is who crosses whom, and where."
)
UNPICTURED = (
    "There are too many steps to show each in a picture here: model.glb shows the woven object, "
    "and assembly.html each step on it, where that could be made."
)
RINGED = (
    " Crossings under the ring along a rim get their fasteners with it, at the end: "
    "until then, clips hold them."
)
BOXES = " Tick the box of a piece when it is in its place."


def write_steps(
    book: Book,
    crossing_map: CrossingMap,
    pictures: Sequence[WholePicture],
    seconds: Sequence[float],
    rings: Sequence[RimRing] = (),
    leaving: Leaving | None = None,
    *,
    tied: bool = False,
) -> None:
    """Write all steps; those of rings come last.

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
    leaving : Leaving, optional
        When a former comes out.
    tied : bool
        Whether what carries something is tied to a base in the end.
    """
    book.page(SECTION)
    legend = (LEGEND if pictures else UNPICTURED) + (RINGED if rings else "")
    book.y = book.block(book.left, book.y, legend + BOXES, book.right - book.left, size=_TEXT)
    writer = _Writer(book, crossing_map, seconds, leaving, pictured=bool(pictures), tied=tied)
    woven = [step for step in crossing_map.steps if step.ring is None]
    if not pictures:
        for step in woven:
            writer.write(step, None)
    steps = iter(woven)
    for whole in pictures:
        own = [next(steps) for _ in whole.steps]
        for step, picture in zip(own, whole.steps, strict=True):
            writer.write(step, picture, turn=whole if step is own[0] else None)
        writer.write_whole(whole, own)
    for step, ring in zip(crossing_map.steps[len(woven) :], rings, strict=True):
        writer.write_ring(step, ring)


@frozen_value
class FlatPiece:
    """A piece of a ring in a picture, in points from its upper left corner, y upwards.

    Parameters
    ----------
    id : str
    outline : (N, 2) float array
    holes : (H, 2) float array
    numbers : (H, 2) float array
        Where the number of each hole stands, beyond the outer border.
    hole : float
        The radius of the holes.
    middle : (2,) float array
        Where the id stands: in the middle of the band, between two holes.
    """

    id: str
    outline: FloatArray
    holes: FloatArray
    numbers: FloatArray
    hole: float
    middle: FloatArray


class _Writer:
    """Writes one step below the other: words and cards at the left, the picture at the right.

    Without pictures there are two columns.
    """

    def __init__(
        self,
        book: Book,
        crossing_map: CrossingMap,
        seconds: Sequence[float],
        leaving: Leaving | None,
        *,
        pictured: bool,
        tied: bool,
    ) -> None:
        self._tied = tied
        self._book, self._map, self._seconds, self._leaving = book, crossing_map, seconds, leaving
        self._pieces = {piece.id: piece for piece in crossing_map.pieces}
        self._strands = strand_pieces(crossing_map)
        # Where no fastener goes, nobody needs to know that the last layer has come.
        self._idle = {one.id for one in crossing_map.crossings if one.fastened is False}
        self._joints = {joint.id: joint for joint in crossing_map.joints}
        self._rolls = crossing_map.sheets[0].roll_mm is not None
        self._step_of = {key: step.step for step in crossing_map.steps for key in step.pieces}
        self._columns = 1 if pictured else 2
        self._wide = (book.right - book.left + _GUTTER) / self._columns - _GUTTER
        self._column, self._top, self._y = 0, book.y - _GAP, book.y - _GAP
        self._there, self._so_far = 0, 0.0

    def _room(self, height: float) -> tuple[float, float]:
        """Take so much room in a column; return the left and the upper end of it."""
        book = self._book
        if self._y - height < book.foot:
            self._column += 1
            if self._column == self._columns:
                book.page(SECTION)
                self._column, self._top = 0, book.top - _GAP / 2
            self._y = self._top
        x, y = book.left + self._column * (self._wide + _GUTTER), self._y
        book.line([(x, y), (x + self._wide, y)], width=0.6, grey=0.55)
        self._y -= height + _GAP
        return x, y

    def write_whole(self, whole: WholePicture, steps: Sequence[StepRecord]) -> None:
        """Write the picture of the whole object after the steps that it shows."""
        book = self._book
        self._there += sum(len(step.pieces) for step in steps)
        x, y = self._room(WHOLE[1] + _BELOW_LINE)
        room = self._wide - WHOLE[0] - _GUTTER
        book.text(x, y - 16.0, f"After step {steps[-1].step} it looks so", size=14.0, bold=True)
        seen = f"{view_words(whole.view, turned=False)} New strips are dark."
        end = book.block(x, y - 22.0, seen, room, size=_TEXT)
        all_of_them = agree(len(self._pieces), "{n} [strip is|strips are]")
        end = book.block(x, end, f"{self._there} of {all_of_them} in place.", room, size=_TEXT)
        book.block(x, end - 4.0, _LOOK, room, size=_TEXT)
        left, low = x + self._wide - WHOLE[0], y - _BELOW_LINE - WHOLE[1]
        self._draw_overview(whole.overview, WHOLE, np.array([left, low]))

    def _draw_overview(
        self, overview: Overview, size: tuple[float, float], corner: FloatArray
    ) -> None:
        """Draw a picture of the whole object with its lower left corner at a place."""
        left, low = corner.tolist()
        self._book.image(overview.painted, left, low, *size)
        tags = place_tags(overview.marks, size, np.zeros((0, 2)), 0.0, overview.bands)
        self._draw_tags(tags, corner, ringed=True)

    def write(
        self, step: StepRecord, picture: StepPicture | None, turn: WholePicture | None = None
    ) -> None:
        """Write a step: its number, its piece, what to do, its card, and its pictures.

        ``turn`` begins with it, if the object is to be turned for that.
        """
        shown = [] if picture is None else [one for one in (picture, picture.other) if one]
        sizes = [one.size for one in shown]
        if picture:
            sizes.insert(0, TALL)
        wide = sum(size[0] for size in sizes) + (_PICTURES_APART * len(shown[1:]))
        tall = max((size[1] for size in sizes), default=0.0)
        # Three pictures stand in a row of their own.
        row = bool(shown[1:])
        room = self._wide if row or not shown else self._wide - wide - _GUTTER
        below = row or (picture is not None and len(step.over) + len(step.under) > _BESIDE_PICTURE)
        card = self._card(step, self._wide if below else room) if picture else None
        due = [key for key in step.fasten if key not in self._idle]
        texts = [
            view_words(turn.view, turned=True) if turn and turn.turned else "",
            *self._told_of(step),
            # A card shows it.
            "" if picture else layers_words(step, self._pieces, self._strands, due),
            hang_words(step, self._map, tied=self._tied),
            seen_words(shown),
            inside_words(sorted({name for one in shown for name in one.inside})),
        ]
        rows = self._rows(step, room)
        high = self._text_top(rows) + self._told(texts, room)
        flat = card.high + _CARD_GAP if card else 0.0
        pictured = tall + _BELOW_LINE
        if row:
            x, y = self._room(high + flat + pictured)
        else:
            x, y = self._room(max(high, pictured) + flat if below else max(high + flat, pictured))
        end = self._write_texts(x, y, step, rows, texts, room)
        top = y
        if row:
            top, end = end, end - pictured
        elif below:
            end = min(end, y - pictured) - _CARD_GAP
        if card:
            write_card(self._book, card, x, end - _CARD_GAP / 2.0)
        low, left = top - _BELOW_LINE, x + self._wide - wide
        if picture and picture.place:
            self._draw_overview(picture.place, TALL, np.array([left, low - TALL[1]]))
            left += TALL[0]
        for one in shown:
            self._draw(one, np.array([left, low - one.size[1]]))
            left += one.size[0] + _PICTURES_APART

    def write_ring(self, step: StepRecord, ring: RimRing) -> None:
        """Write the step that lays a ring, with its pieces flat below one another."""
        texts = [*self._told_of(step), hang_words(step, self._map, tied=self._tied)]
        rows = self._rows(step, self._wide)
        above = self._text_top(rows) + self._told(texts, self._wide)
        page = self._book.top - _GAP / 2 - self._book.foot
        pieces, high, ratio = lay_ring(ring, self._wide, page - above)
        x, y = self._room(above + high)
        end = self._write_texts(x, y, step, rows, texts, self._wide)
        self._draw_ring(ring, pieces, np.array([x, end]))
        corner = x + self._wide, end - high + 2.5
        self._book.text(*corner, f"1 : {ratio:g}", size=_TEXT, align=1.0)

    def _told_of(self, step: StepRecord) -> list[str]:
        """Return what a step says, and when the former is taken out before or after it."""
        leaving = self._leaving
        if leaving is None or leaving.step != step.step:
            return [step.text]
        said = [leaving.told, step.text]
        return said if leaving.until == step.step else said[::-1]

    def _told(self, texts: Sequence[str], room: float) -> float:
        """Return the height of texts below one another."""
        return sum(
            LEADING * _TEXT * len(wrapped(text, _TEXT, room)) + 2.0 for text in texts if text
        )

    def _text_top(self, rows: Sequence[Sequence[str]]) -> float:
        """Return how far below the line above a step its texts begin."""
        return _HEAD + LEADING * _TEXT * (len(rows) - 1)

    def _write_texts(
        self,
        x: float,
        y: float,
        step: StepRecord,
        rows: list[list[str]],
        texts: Sequence[str],
        room: float,
    ) -> float:
        """Write the head of a step and its texts; return where they end."""
        self._write_head(x, y, step, rows, room)
        end = y - self._text_top(rows)
        for text in filter(None, texts):
            end = self._book.block(x, end, text, room, size=_TEXT) - 2.0
        return end

    def _card(self, step: StepRecord, room: float) -> Card:
        """Return the card of a step's piece."""
        piece = self._pieces[step.pieces[0]]
        met = what_is_met(piece, step, self._strands, self._joints, self._step_of, self._idle)
        back = self._map.cut.labels == "kinds" and bool(piece.turned)
        return lay_card(piece, met, room, back=back)

    def _draw_ring(self, ring: RimRing, pieces: Sequence[FlatPiece], corner: FloatArray) -> None:
        """Draw the pieces of a ring with their upper left corner at a place.

        Beyond the number of each hole stands which piece lies on top there, on the object.
        """
        book = self._book
        for piece, cut in zip(pieces, ring.pieces, strict=True):
            book.line(piece.outline + corner, width=0.8, closed=True, fill=0.93)
            for x, y in (piece.holes + corner).tolist():
                book.circle(x, y, piece.hole)
            for number, (x, y) in enumerate((piece.numbers + corner).tolist(), start=1):
                book.text(x, y, str(number), size=_TEXT, align=0.5, middle=True)
            outward = unit(piece.numbers - piece.holes)
            beyond = piece.numbers + _DIGITS * outward + corner
            for key, (x, y), (right, up) in zip(
                cut.crossings.tolist(), beyond.tolist(), outward.tolist(), strict=True
            ):
                turn = math.degrees(math.atan2(up, right))
                back = abs(turn) > 90.0
                name = self._strands[key, True][0]
                book.text(
                    x, y, name, size=_ON_TOP, align=float(back), middle=True,
                    angle_deg=turn - 180.0 * back,
                )  # fmt: skip
            x, y = (piece.middle + corner).tolist()
            book.text(x, y, piece.id, size=_TEXT, bold=True, align=0.5, middle=True)

    def _write_head(
        self, x: float, y: float, step: StepRecord, rows: list[list[str]], room: float
    ) -> None:
        """Write the number of a step, its time, and its pieces with their boxes."""
        book = self._book
        seconds = self._seconds[step.step - 1]
        self._so_far += seconds
        y -= 0.84 * _NUMBER
        head = f"Step {step.step}"
        book.text(x, y, head, size=_NUMBER, bold=True)
        time = time_words(seconds, self._so_far)
        book.text(x + room, y, time, size=_TEXT, align=1.0)
        at = x + text_width(head, _NUMBER, bold=True) + 10.0
        for row in rows:
            for name in row:
                book.tick_box(at, y - 0.5, _BOX)
                book.text(at + _BOX + 4.0, y, name, size=_TEXT, bold=True)
                at += self._name_width(name)
            at, y = x, y - LEADING * _TEXT

    def _rows(self, step: StepRecord, room: float) -> list[list[str]]:
        """Return the pieces of a step in rows; the first is beside its number."""
        by_kind = self._map.cut.labels == "kinds"
        names = [
            place_words(self._pieces[key], by_kind=by_kind, rolls=self._rolls)
            for key in step.pieces
        ]
        names += [f"{name} (rim)" for name in step.ring or ()]
        left = room - text_width(f"Step {step.step}", _NUMBER, bold=True) - 84.0
        rows: list[list[str]] = [[]]
        for name in names:
            wide = self._name_width(name)
            if wide > left:
                rows.append([])
                left = room
            rows[-1].append(name)
            left -= wide
        return rows

    def _name_width(self, name: str) -> float:
        return _BOX + 4.0 + text_width(name, _TEXT, bold=True) + 10.0

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
        for spot in (picture.clips + corner).tolist():
            book.clip(*spot)
        bands = np.concatenate([ends.mean(axis=1) for ends in picture.ends])
        # What a clip covers is as much in the way of names as a crossing.
        spots = np.concatenate((picture.crossings, picture.clips + _CLIP_UP))
        tags = place_tags(picture.marks, picture.size, spots, picture.radius, bands)
        self._draw_tags(tags, corner, ringed=False)
        ratio = f"1 : {picture.ratio:g}"
        book.box(x + wide - CORNER[0], y, *CORNER, width=0.0, fill=1.0)
        book.text(x + wide - 2.0, y + 2.5, ratio, size=_TEXT, align=1.0)
        book.box(x, y, wide, high, width=0.4, grey=0.55)

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
            (left, low), (wide, high) = (tag.middle - tag.half + corner).tolist(), 2.0 * tag.half
            book.box(left, low, wide, high, width=0.7, fill=0.0 if dark else 1.0)
            x, y = (tag.middle + corner).tolist()
            if tag.mark.kind in ("over", "under"):
                book.sign(left + 2.0 + SIGN / 2, y, over=tag.mark.kind == "over")
                x += (SIGN - 1.0) / 2
            book.text(x, y, tag.mark.text, size=TAG, bold=True, align=0.5,
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


def place_words(piece: PieceRecord, *, by_kind: bool, rolls: bool = False) -> str:
    """Return the id of a piece, and where it is found: on which sheet, or among which kind.

    Parameters
    ----------
    piece : PieceRecord
    by_kind : bool
        Whether pieces bear their kind in place of their id.
    rolls : bool
        Whether they came off rolls.
    """
    if rolls and not by_kind:
        return piece.id
    which = f"sheet {piece.sheet}"
    if by_kind:
        which = f"any K{piece.kind}" + (", arrow back" if piece.turned else "")
    return f"{piece.id} ({which})"


def layers_words(
    step: StepRecord,
    pieces: Mapping[str, PieceRecord],
    strands: Mapping[tuple[int, bool], Sequence[str]],
    crossings: Sequence[int],
) -> str:
    """Say where the last layer has come, by the pieces that meet there.

    Parameters
    ----------
    step : StepRecord
    pieces : mapping from id to PieceRecord
    strands : mapping
        From ``strand_pieces``.
    crossings : sequence of int
        Those of the step that are complete now and matter.
    """
    met: dict[str, list[str]] = {}
    for crossing in crossings:
        over, key = next(
            (station.over, key)
            for key in reversed(step.pieces)
            for station in pieces[key].stations
            if station.crossing == crossing
        )
        others = met.setdefault(key, [])
        others += [one for one in strands[crossing, not over] if one not in others]
    said = "; ".join(f"{key} with {listed(others)}" for key, others in met.items())
    return f"All layers are in place: {said}." if said else ""


def hang_words(step: StepRecord, crossing_map: CrossingMap, *, tied: bool) -> str:
    """Say which crossings that come into place in a step carry something, and in what hole."""
    pieces = {piece.id: piece for piece in crossing_map.pieces}
    holes = {joint.id: joint.hole_mm for joint in crossing_map.joints}
    said = []
    for crossing in crossing_map.crossings:
        if crossing.hang and crossing.id in step.fasten:
            station = pieces[crossing.over.piece].stations[crossing.over.station]
            hole = station.hole_mm
            if hole is None and station.joint is not None:
                hole = holes[station.joint]
            said.append(
                f"{crossing.over.piece} with {crossing.under.piece}"
                + (f" (hole of {hole:g} mm)" if hole is not None else "")
            )
    what = "Only clipped until the base is tied on" if tied else "A cord or a foot goes here"
    return f"{what}: {listed(said)}." if said else ""


def view_words(view: View, *, turned: bool) -> str:
    """Say from where the next steps are seen, and whether the object is to be turned for it.

    Examples
    --------
    >>> view_words(View(-60.0, 35.0), turned=True)
    'Turn the object to see it from the front right and above.'
    """
    side = side_words(view)
    return f"Turn the object to see it from {side}." if turned else f"Seen from {side}."


def seen_words(shown: Sequence[StepPicture]) -> str:
    """Say from where a step is drawn in large; both halves of its strip, where these are apart."""
    sides = [side_words(one.view) for one in shown]
    if sides[1:] and shown[0].place:
        whole = side_words(shown[0].place.view)
        return f"Whole from {whole}, half at the start from {sides[0]}, at the end from {sides[1]}."
    return f"Close-up, from {sides[0]}." if sides else ""


def inside_words(names: Sequence[str]) -> str:
    """Say which new pieces are seen from inside.

    Examples
    --------
    >>> inside_words(["A1"]), inside_words([])
    ('You see the inner face of A1: "over" is on the far side.', '')
    """
    if not names:
        return ""
    face = "faces" if names[1:] else "face"
    return f'You see the inner {face} of {listed(names)}: "over" is on the far side.'


def time_words(seconds: float, so_far: float) -> str:
    """Say about how long a step takes, and all steps up to it.

    Examples
    --------
    >>> time_words(20.0, 20.0), time_words(200.0, 4000.0)
    ('1 min, 0 h 01', '3 min, 1 h 07')
    """
    whole = max(round(so_far / 60.0), 1)
    return f"{max(round(seconds / 60.0), 1)} min, {whole // 60} h {whole % 60:02d}"


#: A ring is drawn no smaller than this, whatever room there is.
_MOST_RATIO = 50.0


def lay_ring(
    ring: RimRing, wide: float, tall: float = math.inf
) -> tuple[list[FlatPiece], float, float]:
    """Lay the pieces of a ring below one another, all in one scale, letters up, as engraved.

    They are as large as there is room for, ``wide`` and ``tall``, in points.

    Returns
    -------
    pieces : list of FlatPiece
    high : float
        How high all of them are, in points.
    ratio : float
        How many times smaller they are than cut.
    """
    outlines = [piece.path.flattened(_FLAT_MM) for piece in ring.pieces]
    widest = max(float(np.ptp(outline[:, 0])) for outline in outlines)
    needed = widest * _POINTS_MM / (wide - 2.0 * (_BEYOND + _DIGITS + _NAMES))
    ratio = max(math.ceil(10.0 * needed) / 10.0, 1.0)
    pieces, high = _one_below_another(ring, outlines, wide, _POINTS_MM / ratio)
    while high > tall and ratio < _MOST_RATIO:
        ratio = math.ceil(10.0 * ratio * max(high / tall, 1.01)) / 10.0
        pieces, high = _one_below_another(ring, outlines, wide, _POINTS_MM / ratio)
    return pieces, high, ratio


def _one_below_another(
    ring: RimRing, outlines: Sequence[FloatArray], wide: float, scale: float
) -> tuple[list[FlatPiece], float]:
    """Lay the pieces of a ring below one another in a scale; return how high they are, too."""
    pieces, top = [], 0.0
    for piece, outline in zip(ring.pieces, outlines, strict=True):
        holes, outward = piece.holes[:, :2] * scale, piece.outward
        border = shapely.LinearRing(outline * scale)
        numbers = holes + (_reach(border, holes, outward) + _BEYOND)[:, None] * outward
        drawn = np.concatenate((outline * scale, numbers, numbers + _NAMES * outward))
        low, high = drawn.min(axis=0) - _DIGITS, drawn.max(axis=0) + _DIGITS
        shift = np.array([(wide - low[0] - high[0]) / 2.0, top - high[1]])
        pieces.append(
            FlatPiece(
                id=piece.id,
                outline=outline * scale + shift,
                holes=holes + shift,
                numbers=numbers + shift,
                hole=float(piece.holes[0, 2]) / 2.0 * scale,
                middle=_middle(border, holes, outward) + shift,
            )
        )
        top -= float(high[1] - low[1]) + _BETWEEN
    return pieces, -top


def _middle(border: shapely.LinearRing, holes: FloatArray, outward: FloatArray) -> FloatArray:
    """Return the middle of a band between two holes, as near to its half as it is straight."""
    between, up = (holes[1:] + holes[:-1]) / 2.0, unit(outward[1:] + outward[:-1])
    within = shapely.contains_xy(shapely.Polygon(border), between)
    # Between the holes beside a corner there may be no band.
    off = np.where(within, 0, len(between)) + np.abs(np.arange(len(between)) - len(between) // 2)
    best = slice(int(np.argmin(off)), int(np.argmin(off)) + 1)
    above, below = (_reach(border, between[best], way * up[best]) for way in (1.0, -1.0))
    return np.asarray(between[best] + (above - below)[:, None] / 2.0 * up[best])[0]


def _reach(border: shapely.LinearRing, places: FloatArray, ways: FloatArray) -> FloatArray:
    """Return how far the border is from places in it, each in its direction, (N,)."""
    far = float(border.length)
    rays = shapely.linestrings(np.stack((places, places + far * ways), axis=1))
    met = shapely.intersection(rays, border)
    return np.asarray(shapely.distance(shapely.points(places), met))
