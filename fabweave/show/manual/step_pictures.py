"""Make the pictures of the steps: what is new in large, and where it is on the whole object."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby, pairwise, product
from operator import itemgetter

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.picture.camera import Frame, View
from fabweave.picture.zbuffer import nearest_of_layers
from fabweave.plan.crossing_map import CrossingMap
from fabweave.show.manual.painting import POINTS_PX, PX_MM, Painted, Scene, Shown, Stage

#: Where a picture would have more names, what a piece meets is numbered in it.
MOST_TAGS = 8
#: Of more numbers than that, those are left out between which over and under take turns.
MOST_NUMBERS = 11
#: What is seen so far in front of a place hides it, in millimetres: more than its own layers.
_LAYERS_MM = 6.0


@frozen_value
class PictureLabel:
    """What is named in a picture; places in points from its lower left corner.

    Parameters
    ----------
    text : str
    kind : {"new", "over", "under", "joint", "start"}
        A new piece; a piece that it lies over or runs under; a joint; or the start of a new piece.
    at : (2,) float array
        Where it is.
    along : (2,) float array
        The direction of its strand, of unit length.
    clear : float
        So far from there along its strand it is beside what is new.
    hidden : bool
        Whether something else is seen there.
    """

    text: str
    kind: str
    at: FloatArray
    along: FloatArray
    clear: float
    hidden: bool


@frozen_value
class Slide:
    """The way of an end that slides beneath what is in place.

    Parameters
    ----------
    points : (N, 2) float array
        From the middle of the piece to its tip, in points.
    beneath : (N - 1,) bool array
        Whether something lies over it there.
    """

    points: FloatArray
    beneath: BoolArray


def strand_pieces(crossing_map: CrossingMap) -> dict[tuple[int, bool], list[str]]:
    """Return the pieces of each strand: crossing, and whether it is the one on top.

    A ring of one piece that laps itself there is named once.
    """
    strands: dict[tuple[int, bool], list[str]] = {}
    for piece in crossing_map.pieces:
        for strand in dict.fromkeys((one.crossing, one.over) for one in piece.stations):
            strands.setdefault(strand, []).append(piece.id)
    return strands


class Drawn:
    """What pictures look up: pieces by their ids, and who lies at each strand."""

    def __init__(self, scene: Scene, crossing_map: CrossingMap) -> None:
        self.scene, self.steps = scene, crossing_map.steps
        self.pieces = crossing_map.pieces
        self.number = {piece.id: at for at, piece in enumerate(crossing_map.pieces)}
        self.joints = {joint.id: joint for joint in crossing_map.joints}
        self.idle = {one.id for one in crossing_map.crossings if one.fastened is False}
        self.strands = strand_pieces(crossing_map)
        self.step_of = {key: at for at, step in enumerate(self.steps) for key in step.pieces}
        self.station = {
            (piece.id, station.crossing, station.over): at
            for piece in crossing_map.pieces
            for at, station in enumerate(piece.stations)
        }

        self._stages: dict[tuple[View, tuple[float, float], bool], Stage] = {}

    def stage(self, view: View, size: tuple[float, float], *, table: bool) -> Stage:
        """Return where the whole object grows, as it is seen in pictures of a size."""
        key = view, size, table
        if key not in self._stages:
            frame = self.scene.frame(view, _pixels(size), table=table)
            self._stages[key] = Stage(self.scene, frame, table=table)
        return self._stages[key]

    def new(self, step: int) -> list[int]:
        """Return the numbers of the pieces that come in a step."""
        return [self.number[key] for key in self.steps[step].pieces]

    def panel(self, key: str, crossing: int, *, over: bool) -> FloatArray:
        """Return both ends of both rungs of a piece's panel at a crossing, (2, 2, 3)."""
        number = self.number[key]
        first = self.scene.panel(number, self.station[key, crossing, over])
        return self.scene.rung_ends(number)[first : first + 2]


def on_page(pixels: FloatArray, frame: Frame) -> FloatArray:
    """Return places in points from the lower left corner of a picture."""
    flat = np.asarray(pixels)[..., :2]
    return np.asarray((flat * (1.0, -1.0) + (0.0, frame.height_px)) * POINTS_PX)


def seen_mark(text: str, pixel: IntArray, frame: Frame) -> PictureLabel | None:
    """Return the name of something near the middle of the pixels that show it, if any do."""
    if not len(pixel):
        return None
    down, across = np.divmod(pixel, frame.width_px)
    best = int(np.argmin((across - across.mean()) ** 2 + (down - down.mean()) ** 2))
    at = on_page(np.array([across[best] + 0.5, down[best] + 0.5]), frame)
    return PictureLabel(text, "new", at, np.array([0.0, 1.0]), 0.0, hidden=False)


def new_mark(drawn: Drawn, frame: Frame, shown: Shown, number: int) -> PictureLabel:
    """Return the name of a new piece, near the middle of what is seen of it."""
    text, line = drawn.pieces[number].id, drawn.scene.middle_line(number)
    at = on_page(frame.pixels(line)[len(line) // 2], frame)
    unseen = PictureLabel(text, "new", at, np.array([0.0, 1.0]), 0.0, hidden=True)
    return seen_mark(text, shown.of(number), frame) or unseen


def stations_of_half(count: int, half: int | None) -> range:
    """Return which of a piece's stations a picture shows: all, or those of a half, 0 or 1.

    Examples
    --------
    >>> stations_of_half(5, 0), stations_of_half(5, 1)
    (range(0, 3), range(2, 5))
    """
    return range(count // 2 if half == 1 else 0, (count + 1) // 2 if half == 0 else count)


class Places:
    """Where what a step names is in its picture, which shows its piece or a half of that."""

    def __init__(
        self, drawn: Drawn, frame: Frame, near: FloatArray, at: int, half: int | None = None
    ) -> None:
        self._drawn, self._frame, self._near, self._at, self._half = drawn, frame, near, at, half
        self._step, (self._number,) = drawn.steps[at], drawn.new(at)
        self._stations = drawn.pieces[self._number].stations
        self._shown = stations_of_half(len(self._stations), half)
        self._station = {self._stations[at].crossing: at for at in self._shown}

    def middles(self, crossings: Iterable[int]) -> list[FloatArray]:
        """Return where those of some crossings are that the picture shows."""
        shown = [self._station[key] for key in dict.fromkeys(crossings) if key in self._station]
        return [on_page(self._pixels(at).mean(axis=0), self._frame) for at in shown]

    def _pixels(self, station: int) -> FloatArray:
        """Return the corners of the panel of the new piece at a station, in pixels, (4, 3)."""
        scene = self._drawn.scene
        first = scene.panel(self._number, station)
        return self._frame.pixels(scene.rung_ends(self._number)[first : first + 2].reshape(-1, 3))

    def neighbours(self) -> Iterator[PictureLabel]:
        """Yield what the new piece lies over and runs under, numbered from its start.

        Its card has the same numbers; where names are many, numbers stand alone.
        """
        met = list(self._met())
        over = [self._stations[at].over for at, _ in met]
        joints = sum(1 for _ in self.joints())
        shown = sum(at in self._shown for at, _ in met)
        bare = shown + joints + (1 if self._half == 1 else 2) > MOST_TAGS
        for number, (at, others) in enumerate(met, start=1):
            if at in self._shown and (
                not bare or shown <= MOST_NUMBERS or self._told(number, over)
            ):
                text = f"{number}" if bare else f"{number} {' '.join(others)}"
                yield self._mark(at, others[0], text)

    @staticmethod
    def _told(number: int, over: Sequence[bool]) -> bool:
        """Say whether a number stands in a picture.

        Where there are many, those that go on as one expects, over and under in turn, do not.
        """
        if number in (1, len(over)):
            return True
        return over[number - 1] in (over[number - 2], over[number])

    def _met(self) -> Iterator[tuple[int, list[str]]]:
        """Yield at which stations the new piece meets others that are in place, and which."""
        drawn, step = self._drawn, self._step
        for at, station in enumerate(self._stations):
            if station.crossing in (step.over if station.over else step.under):
                others = drawn.strands[station.crossing, not station.over]
                there = [other for other in others if drawn.step_of[other] <= self._at]
                if there:
                    yield at, there

    def _mark(self, at: int, other: str, text: str) -> PictureLabel:
        """Return the name of what the new piece meets at a station."""
        drawn, frame, station = self._drawn, self._frame, self._stations[at]
        own = self._pixels(at)
        strand = drawn.panel(other, station.crossing, over=not station.over).mean(axis=1)
        ends = on_page(frame.pixels(strand), frame)
        along = ends[1] - ends[0]
        along = along / max(float(np.linalg.norm(along)), 1e-9)
        corners = on_page(own, frame)
        middle = corners.mean(axis=0)
        return PictureLabel(
            text,
            "over" if station.over else "under",
            middle,
            along,
            float(np.abs((corners - middle) @ along).max()),
            self._hidden(own.mean(axis=0)),
        )

    def joints(self) -> Iterator[PictureLabel]:
        """Yield the joints that are made."""
        for key in self._step.joints:
            at = self._station.get(self._drawn.joints[key].crossing)
            if at is not None:
                pixel = self._pixels(at).mean(axis=0)
                middle, up = on_page(pixel, self._frame), np.array([0.0, 1.0])
                yield PictureLabel(f"#{key}", "joint", middle, up, 0.0, self._hidden(pixel))

    def starts(self) -> Iterator[PictureLabel]:
        """Yield the start of the new piece, if the picture shows it."""
        line = self._frame.pixels(self._drawn.scene.middle_line(self._number)[:2])
        at, after = on_page(line, self._frame)
        corner = on_page(np.array([self._frame.width_px, 0.0]), self._frame)
        if self._half != 1 and np.all((at > 0.0) & (at < corner)):
            along = (at - after) / max(float(np.linalg.norm(at - after)), 1e-9)
            yield PictureLabel("start", "start", at, along, 0.0, self._hidden(line.mean(axis=0)))

    def _hidden(self, pixel: FloatArray) -> bool:
        """Return whether something well in front of a place is seen there, or it is not shown."""
        frame, (x, y, near) = self._frame, pixel.tolist()
        if not (0 <= x < frame.width_px and 0 <= y < frame.height_px):
            return True
        return bool(self._near[int(y), int(x)] > near + _LAYERS_MM * frame.pixels_per_mm)

    def slides(self) -> Iterator[Slide]:
        """Yield the ways of the ends that slide beneath what is in place."""
        scene, stations = self._drawn.scene, self._stations
        beneath = [not one.over and one.crossing in self._step.under for one in stations]
        line = on_page(self._frame.pixels(scene.middle_line(self._number)), self._frame)
        panels = [scene.panel(self._number, at) for at in range(len(stations))]
        half = len(stations) / 2
        for back in (True, False):
            under = [at for at, low in enumerate(beneath) if low and (at < half) == back]
            if not under or self._half == int(back):
                continue
            inner = max(under) + 1 if back else min(under) - 1
            start = panels[min(max(inner, 0), len(stations) - 1)]
            rungs = range(start, -1, -1) if back else range(start, len(line))
            hidden = {panels[at] for at in under}
            points = line[list(rungs)]
            covered = [(min(one, two) in hidden) for one, two in pairwise(rungs)]
            if len(points) > 1:
                yield Slide(points, np.array(covered))


#: From where steps may be seen: around at four heights, and from straight above and below; the
#: first is the usual place.
VIEWS = (
    *(View(-60.0 + 45.0 * turn, rise) for rise in (35.0, 50.0, -35.0, 0.0) for turn in range(8)),
    View(-60.0, 85.0),
    View(-60.0, -85.0),
)
#: Pixels of the pictures by which views are compared.
_TRIAL_PX = (180, 140)
#: Every step is seen from where at least such a share of its new pieces is seen as from the best
#: view: the greatest of these with which no more than this share of the steps turns the object.
_ENOUGH, MOST_TURNS = (0.9, 0.8, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1), 1 / 8
#: Who sits at a table sees what stands on it from between these elevations.
SITTING_DEG = (20.0, 55.0)
#: From elsewhere, or from below, is seen what shows so many times as much from there.
_WORTH_A_LOOK = 1.5
#: A strip that meets fewer strands is not drawn half by half; one that meets more than this is.
_SPLIT_FROM, _ONE_PICTURE = 4, 6
#: What shows less than this share of what the best view shows shows little; a half of a strip of
#: which one picture shows less than that has a picture of its own.
_LITTLE, _HALF_SEEN = 0.3, 0.7
#: A strip is a ring if its ends are no farther apart than this share of its extent; it is seen well
#: if it is so many times as wide as it is high.
_CLOSED, _OPEN = 0.2, 0.4
#: A strip of which less of its area is turned to the eye is seen from its edge.
FACED = 0.35
_SIDES = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")


def views_of_steps(scene: Scene) -> tuple[IntArray, IntArray, IntArray]:
    """Choose a view for each step, so that the object is turned in an eighth of them.

    In early steps it is held as a person sees it who sits. Strips are drawn neither from their
    edges nor, where they can be seen from outside, from inside.

    Returns
    -------
    held, drawn : (S,) int arrays
        How the object is held, and from where the step is drawn: that is another view where no
        turn is left for a strip that would be seen from its edge or from inside.
    halves : (S, 2) int array
        From where the halves of the step's piece are best drawn, at its start and at its end: the
        same view where one shows enough of both.
    """
    seen_areas = seen_from_views(scene) * ring_shares(scene)[..., None]
    least, outer, inner, *halves = np.moveaxis(seen_areas, 2, 0)
    rise = np.array([view.elevation_deg for view in VIEWS])[:, None]
    seats = ~scene.early | ((rise >= SITTING_DEG[0]) & (rise <= SITTING_DEG[1]))
    faced = (faced_shares(scene) >= FACED) & (outer > inner)
    usual = np.where(faced & seats & (rise >= 0.0), outer, 0.0).max(axis=0)
    open_views = faced & (seats & (rise >= 0.0) | (outer > _WORTH_A_LOOK * usual))
    open_views = np.where(open_views.any(axis=0), open_views, seats)
    best = np.where(open_views, shown_shares(open_views * least, open_views * outer), -1.0)
    sitting = open_views & seats
    # Better a strip from its edge than an object that is turned all the time.
    for views, enough in product((np.where(sitting.any(axis=0), sitting, seats), seats), _ENOUGH):
        shares = np.where(views, shown_shares(views * least, views * outer), 0.0)
        held = choose_views(shares, enough)
        if np.count_nonzero(np.diff(held)) <= MOST_TURNS * len(held):
            break
    every = np.arange(len(held))
    drawn = np.where(best[held, every] >= _LITTLE, held, best.argmax(axis=0))
    seen = np.where(open_views, halves, -1.0)
    shown, most = np.take_along_axis(seen, drawn[None, None], 1)[:, 0], seen.max(axis=1)
    two = np.where(shown >= _HALF_SEEN * most, drawn, seen.argmax(axis=1))
    return held, drawn, two.T


def ring_shares(scene: Scene) -> FloatArray:
    """Return how open each view shows a step's piece that is a ring, 0 to 1, (V, S); 1 for others.

    A ring that is seen from its side is a line, however its faces are turned.
    """
    shares = np.ones((len(VIEWS), scene.n_steps))
    for piece, step in enumerate(scene.step_of_piece.tolist()):
        line = scene.middle_line(piece)
        if np.linalg.norm(line[-1] - line[0]) > _CLOSED * np.ptp(line, axis=0).max():
            continue
        for share, view in zip(shares, VIEWS, strict=True):
            across = (line - line.mean(axis=0)) @ view.axes()[:2].T
            wide, narrow = np.linalg.svd(across, compute_uv=False)
            share[step] = min(1.0, narrow / (_OPEN * wide))
    return shares


def faced_shares(scene: Scene) -> FloatArray:
    """Return how much of the area of each step's new pieces a view has turned to it, (V, S).

    That is of the piece that is turned away most; it counts what is hidden, too.
    """
    corners = scene.points[scene.triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    whole = np.bincount(scene.piece, np.linalg.norm(sides, axis=1), len(scene.step_of_piece))
    shares = np.full((len(VIEWS), scene.n_steps), np.inf)
    for share, view in zip(shares, VIEWS, strict=True):
        turned = np.bincount(scene.piece, np.abs(sides @ view.axes()[2]), len(whole))
        np.minimum.at(share, scene.step_of_piece, turned / np.maximum(whole, 1e-9))
    return shares


def seen_from_views(scene: Scene) -> FloatArray:
    """Return what each view shows of each step's new pieces when the step is done.

    Returns
    -------
    (V, S, 5) float array
        Pixels of small pictures: outer faces, of the piece that is seen least and of all; inner
        faces, of all; and outer faces of the halves at starts and at ends.
    """
    return np.array([_seen(scene, view) for view in VIEWS])


def shown_shares(least: FloatArray, total: FloatArray) -> FloatArray:
    """Return how well each view shows each step's new pieces, beside the best view, (V, S).

    Parameters
    ----------
    least : (V, S) float array
        For each view and step, how much is seen of the new piece that is seen least.
    total : (V, S) float array
        The same of all new pieces together; it counts a tenth.
    """
    # A view that hides a piece is worth nothing where another one shows all of them.
    blind = (least <= 0.0) & (least.max(axis=0) > 0.0)
    worth = np.where(blind, 0.0, least + 0.1 * total)
    best = worth.max(axis=0)
    return np.asarray(np.where(best > 0.0, worth / np.maximum(best, 1e-9), 1.0))


def choose_views(shares: FloatArray, enough: float) -> IntArray:
    """Choose a view for each step so that each shows enough, and fewest steps turn the object.

    Whoever turns as late as can be turns least often; of views that serve as long, that which
    shows most is taken.

    Parameters
    ----------
    shares : (V, S) float array
        As of :func:`shown_shares`.
    enough : float
        What each step's view shows at least; no more than 1.

    Returns
    -------
    (S,) int array

    Examples
    --------
    >>> choose_views(np.array([[1.0, 0.6, 0.1], [0.2, 1.0, 1.0]]), 0.5).tolist()
    [0, 0, 1]
    """
    chosen: list[int] = []
    while len(chosen) < shares.shape[1]:
        left = shares[:, len(chosen) :]
        good = left >= enough
        lasts = np.where(good.all(axis=1), left.shape[1], good.argmin(axis=1))
        longest = int(lasts.max())
        shown = np.where(lasts == longest, left[:, :longest].sum(axis=1), -1.0)
        chosen += [int(np.argmax(shown))] * longest
    return np.array(chosen, dtype=np.int64)


def _seen(scene: Scene, view: View) -> FloatArray:
    """Return what a view shows of each step's new pieces, (S, 5).

    Steps are painted one over the other: of a piece that counts which is nearer than all before,
    and than the former.
    """
    frame = scene.frame(view, _TRIAL_PX)
    wide, high = _TRIAL_PX
    triangle, pixel, near = nearest_of_layers(
        frame.pixels(scene.points), scene.triangles, scene.step, width=wide, height=high
    )
    board = scene.former_seen(frame, 0)[1].ravel()[pixel]
    triangle = triangle[(near > board) | (scene.step[triangle] + 1 >= scene.leaving.until)]
    back = scene.normals @ frame.axes[2] < 0.0
    side = 2 * scene.piece + back
    area = np.bincount(side[triangle], minlength=2 * len(scene.step_of_piece)).astype(np.float64)
    outer = triangle[~back[triangle]]
    half = 2 * scene.step[outer] + scene.beyond[outer]
    halves = np.bincount(half, minlength=2 * scene.n_steps).reshape(-1, 2)
    least = np.full(scene.n_steps, np.inf)
    np.minimum.at(least, scene.step_of_piece, area[::2])
    sides = area[::2], area[1::2]
    totals = [np.bincount(scene.step_of_piece, each, scene.n_steps) for each in sides]
    return np.column_stack((least, *totals, halves))


def side_words(view: View) -> str:
    """Say from where something is seen.

    Examples
    --------
    >>> side_words(View(-60.0, 35.0)), side_words(View(180.0, 0.0)), side_words(View(0.0, -85.0))
    ('the front right and above', 'the left', 'straight below')
    """
    high = "above" if view.elevation_deg > 0 else "below"
    if abs(view.elevation_deg) > 60.0:
        return f"straight {high}"
    side = _SIDES[math.floor((view.azimuth_deg + 90.0) / 45.0 + 0.5) % 8]
    high = f"well {high}" if abs(view.elevation_deg) > 42.0 else high
    return f"the {side}" + (f" and {high}" if view.elevation_deg else "")


#: Sizes of pictures in points: of the whole object after some steps, and of a step.
WHOLE, TALL = (254.0, 134.0), (150.0, 138.0)
#: A ribbon is drawn so wide, in millimetres; else only what is around its crossings is drawn.
RIBBON_MM = 3.0
#: What is drawn of it beyond its crossings then, in widths.
_BEYOND = 1.5
#: What is new keeps so far from the border of its picture, in points: there is room for names.
_ROOM = 15.0
#: An object is drawn so many times smaller than it is, at the least and further on.
_SCALES = (
    *(1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.25, 2.5, 2.75, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0),
    *(7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0),
)
#: The steps of about so many pieces share a picture of the whole object.
_MOST_PIECES = 9
_MM_POINTS = 25.4 / 72.0


@frozen_value
class Overview:
    """A picture of the whole object, with what is new in it.

    Parameters
    ----------
    painted : Painted
    view : View
    marks : tuple of PictureLabel
        The new pieces.
    bands : (N, 2) float array
        Places on them.
    """

    painted: Painted
    view: View
    marks: tuple[PictureLabel, ...]
    bands: FloatArray


@frozen_value
class StepPicture:
    """The picture of a step: what is new in large.

    Parameters
    ----------
    painted : Painted
    size : tuple of float
        Its width and height in points.
    view : View
    inside : tuple of str
        New pieces of which the greater part that is seen is the inner face.
    ratio : float
        How many times smaller it is drawn than it is.
    marks : tuple of PictureLabel
    crossings : (N, 2) float array
        The crossings and joints of the step, which no name may cover.
    radius : float
        How far each of them reaches.
    ends : tuple of (N, 2, 2) float arrays
        For each new piece both ends of its rungs.
    fasten, clips : (N, 2) float arrays
        The crossings that are complete now, and those where a clip is put on.
    slides : tuple of Slide
    place : Overview or None
        Where that is on the object, as it is held, or from where it is seen; of the half at the
        end there is none.
    other : StepPicture or None
        The half at the end, where this one shows that at the start alone.
    """

    painted: Painted
    size: tuple[float, float]
    view: View
    inside: tuple[str, ...]
    ratio: float
    marks: tuple[PictureLabel, ...]
    crossings: FloatArray
    radius: float
    ends: tuple[FloatArray, ...]
    fasten: FloatArray
    clips: FloatArray
    slides: tuple[Slide, ...]
    place: Overview | None = None
    other: "StepPicture | None" = None


@frozen_value
class WholePicture:
    """The picture of the whole object after some steps.

    Parameters
    ----------
    overview : Overview
    view : View
    turned : bool
        Whether it is another view than that of the steps before.
    steps : tuple of StepPicture
        The pictures of those steps.
    """

    overview: Overview
    view: View
    turned: bool
    steps: tuple[StepPicture, ...]


def step_pictures(scene: Scene, crossing_map: CrossingMap) -> list[WholePicture]:
    """Make the pictures of all steps.

    What is in place is pale and what is new is dark, each in its own colour, and views are chosen
    so that new pieces are seen and the object is turned seldom: the sequence of least cost, found
    exactly.

    Parameters
    ----------
    scene : Scene
    crossing_map : CrossingMap
        With steps.

    Returns
    -------
    list of WholePicture
        Of all steps together, in order.
    """
    drawn = Drawn(scene, crossing_map)
    held, seen_from, halves = (each.tolist() for each in views_of_steps(scene))
    pictures: list[WholePicture] = []
    for number, run in groupby(range(scene.n_steps), key=lambda at: held[at]):
        view = VIEWS[number]
        for part, own in enumerate(_parted(list(run), crossing_map)):
            turned = part == 0 and own[0] > 0
            details = tuple(
                _two_details(drawn, VIEWS[seen_from[at]], halves[at], at)
                if _is_parted(len(_strands_met(drawn, at)), halves[at])
                else _detail(drawn, VIEWS[seen_from[at]], at)
                for at in own
            )
            overview = _overview(drawn, view, own, WHOLE)
            pictures.append(WholePicture(overview, view, turned, details))
    return pictures


def _parted(run: Sequence[int], crossing_map: CrossingMap) -> list[list[int]]:
    """Part steps that are seen from one side into those that share a picture of the object.

    They are shared out evenly, by their pieces.
    """
    counts = [len(crossing_map.steps[at].pieces) for at in run]
    share = sum(counts) / max(math.ceil(sum(counts) / _MOST_PIECES), 1)
    parts: dict[int, list[int]] = {}
    before = 0
    for at, count in zip(run, counts, strict=True):
        parts.setdefault(int(before / share), []).append(at)
        before += count
    return list(parts.values())


def _overview(
    drawn: Drawn, view: View, steps: Sequence[int], size: tuple[float, float]
) -> Overview:
    """Return the picture of the whole object after some steps, what is new, and where it is."""
    early = bool(drawn.scene.early[steps[0]])
    stage = drawn.stage(view, size, table=_tabled(drawn, view, steps[0]))
    frame = stage.frame
    painted, shown = stage.paint(steps[-1], steps[0], coming=early)
    new = [number for step in steps for number in drawn.new(step)]
    lines = np.concatenate([drawn.scene.middle_line(number) for number in new])
    marks = tuple(new_mark(drawn, frame, shown, number) for number in new)
    return Overview(painted, view, marks, on_page(frame.pixels(lines), frame))


def _tabled(drawn: Drawn, view: View, at: int) -> bool:
    """Say whether the table is seen: in early steps, and from above, where it hides nothing."""
    return bool(drawn.scene.early[at]) and view.elevation_deg > 0.0


def _detail(drawn: Drawn, view: View, at: int) -> StepPicture:
    """Return the picture of a step in large."""
    ends = np.concatenate([drawn.scene.rung_ends(number) for number in drawn.new(at)])
    breadth = float(np.median(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)))
    window = _window(ends.reshape(-1, 3), view)
    if breadth / window[0] < RIBBON_MM:
        window = min(
            window, _window(_worked(drawn, at, _BEYOND * breadth), view), key=itemgetter(0)
        )
    return replace(_close_up(drawn, view, at, window), place=_overview(drawn, view, [at], TALL))


def _is_parted(met: int, halves: Sequence[int]) -> bool:
    """Say whether a strip that meets so many strands is drawn half by half."""
    return met > _ONE_PICTURE or (met >= _SPLIT_FROM and halves[0] != halves[1])


def _strands_met(drawn: Drawn, at: int) -> tuple[int, ...]:
    """Return where a step's piece meets what is in place."""
    return (*drawn.steps[at].over, *drawn.steps[at].under)


def _two_details(drawn: Drawn, whole: View, halves: Sequence[int], at: int) -> StepPicture:
    """Return the pictures of a step in large whose piece winds around the object, half by half."""
    (number,) = drawn.new(at)
    ends, count = drawn.scene.rung_ends(number), len(drawn.pieces[number].stations)
    pictures = []
    for half, view in enumerate(VIEWS[one] for one in halves):
        own = stations_of_half(count, half)
        first, last = (drawn.scene.panel(number, station) for station in (own[0], own[-1]))
        rungs = slice(last + 2) if half == 0 else slice(first, None)
        window = _window(ends[rungs].reshape(-1, 3), view)
        pictures.append(_close_up(drawn, view, at, window, half))
    place = _overview(drawn, whole, [at], TALL)
    return replace(pictures[0], place=place, other=pictures[1])


def _close_up(
    drawn: Drawn,
    view: View,
    at: int,
    window: tuple[float, Frame],
    half: int | None = None,
) -> StepPicture:
    """Return the picture of a step in a window, of its piece or a half of that."""
    scene, step = drawn.scene, drawn.steps[at]
    ratio, frame = window
    stage = Stage(scene, frame, table=_tabled(drawn, view, at))
    painted, shown = stage.paint(at, at, coming=False)
    places = Places(drawn, frame, shown.near, at, half)
    marks = [
        *(new_mark(drawn, frame, shown, number) for number in drawn.new(at)),
        *places.neighbours(),
        *places.joints(),
        *places.starts(),
    ]
    joints = (drawn.joints[key].crossing for key in step.joints)
    ends = [scene.rung_ends(number) for number in drawn.new(at)]
    wide = np.concatenate(ends)
    breadth = float(np.median(np.linalg.norm(wide[:, 0] - wide[:, 1], axis=1)))
    fasten = places.middles(key for key in step.fasten if key not in drawn.idle)
    return StepPicture(
        painted,
        TALL,
        view,
        tuple(
            drawn.pieces[number].id
            for number in drawn.new(at)
            if 2 * shown.inner[own := shown.piece == number].sum() > own.sum()
        ),
        ratio,
        tuple(marks),
        np.array(places.middles((*step.over, *step.under, *joints))).reshape(-1, 2),
        breadth / 2.0 * frame.pixels_per_mm * POINTS_PX,
        tuple(on_page(frame.pixels(one.reshape(-1, 3)), frame).reshape(-1, 2, 2) for one in ends),
        np.array(fasten).reshape(-1, 2),
        np.array(places.middles(key for key, _, _ in step.clips or ())).reshape(-1, 2),
        tuple(_cut_off(places.slides(), TALL)),
    )


def _cut_off(slides: Iterator[Slide], size: tuple[float, float]) -> Iterator[Slide]:
    """Yield what a picture shows of ways up to their tips, where it shows these."""
    for slide in slides:
        outside = ~np.all((slide.points >= 0.0) & (slide.points <= size), axis=1)
        first = len(outside) - int(np.append(outside[::-1], True).argmax())
        if len(outside) - first > 1:
            yield Slide(slide.points[first:], slide.beneath[first:])


def _worked(drawn: Drawn, at: int, beyond: float) -> FloatArray:
    """Return what lies around a step's crossings and joints, in millimetres, (N, 3).

    That is all of a piece without any.
    """
    step, shown = drawn.steps[at], []
    keys = {*step.over, *step.under, *(drawn.joints[key].crossing for key in step.joints)}
    for number in drawn.new(at):
        piece, line = drawn.pieces[number], drawn.scene.middle_line(number)
        spots = [
            drawn.panel(piece.id, one.crossing, over=one.over).reshape(-1, 3).mean(axis=0)
            for one in piece.stations
            if one.crossing in keys
        ]
        if spots:
            away = np.linalg.norm(line[:, None] - np.array(spots), axis=2).min(axis=1)
            line = np.concatenate((spots, line[away <= beyond]))
        shown.append(line)
    return np.concatenate(shown)


def _window(points: FloatArray, view: View) -> tuple[float, Frame]:
    """Return how many times smaller points are drawn, and the frame of their picture."""
    axes = view.axes()
    across = points @ axes[:2].T
    low, high = across.min(axis=0), across.max(axis=0)
    room = (np.array(TALL) - 2.0 * _ROOM) * _MM_POINTS
    needed = float(np.max((high - low) / room))
    ratio = next((one for one in _SCALES if one >= needed), float(np.ceil(needed)))
    width, height = _pixels(TALL)
    scale = PX_MM / ratio
    middle = (low + high) / 2.0 * scale
    left, top = float(width / 2.0 - middle[0]), float(height / 2.0 + middle[1])
    return ratio, Frame(width, height, axes, scale, left, top)


def _pixels(size: tuple[float, float]) -> tuple[int, int]:
    """Return the pixels of a picture of a size in points."""
    return round(size[0] / POINTS_PX), round(size[1] / POINTS_PX)
