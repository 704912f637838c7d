"""Find in a picture what a step names: new pieces, those that they meet, joints and crossings."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from fabweave.assembly.manual.painting import POINTS_PX
from fabweave.assembly.manual.scene import Scene
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.crossing_map import CrossingMap, StepRecord
from fabweave.picture.camera import Frame

#: What is seen so far in front of a place hides it, in millimetres: more than its own layers.
_LAYERS_MM = 6.0


@frozen_value
class Mark:
    """What is named in a picture; places in points from its lower left corner.

    Parameters
    ----------
    text : str
    kind : {"new", "over", "under", "joint"}
        A new piece; a piece that it lies over or runs under; or a joint.
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


def new_mark(drawn: Drawn, frame: Frame, piece: IntArray, number: int) -> Mark:
    """Return the name of a new piece, near the middle of what is seen of it."""
    seen = np.flatnonzero(piece == number)
    if len(seen):
        down, across = np.divmod(seen, frame.width_px)
        best = int(np.argmin((across - across.mean()) ** 2 + (down - down.mean()) ** 2))
        at = np.array([across[best] + 0.5, down[best] + 0.5])
    else:
        line = frame.pixels(drawn.scene.middle_line(number))
        at = line[len(line) // 2, :2]
    return Mark(
        drawn.pieces[number].id,
        "new",
        on_page(at, frame),
        np.array([0.0, 1.0]),
        0.0,
        not len(seen),
    )


class Places:
    """Where what a step names is in its picture."""

    def __init__(self, drawn: Drawn, frame: Frame, near: FloatArray, at: int) -> None:
        self._drawn, self._frame, self._near, self._at = drawn, frame, near, at
        self._new = set(drawn.steps[at].pieces)

    def middle(self, crossing: int) -> FloatArray:
        """Return where a crossing is."""
        return on_page(self._pixels(crossing).mean(axis=0), self._frame)

    def _pixels(self, crossing: int) -> FloatArray:
        """Return the corners of the panel of a new piece at a crossing, in pixels, (4, 3)."""
        over, key = self._own(crossing)
        corners = self._drawn.panel(key, crossing, over=over).reshape(-1, 3)
        return self._frame.pixels(corners)

    def _own(self, crossing: int) -> tuple[bool, str]:
        """Return the strand of a crossing that is a new piece's, and which."""
        strands = self._drawn.strands
        return next(
            (over, key)
            for over in (True, False)
            for key in strands.get((crossing, over), ())
            if key in self._new
        )

    def neighbours(self, step: StepRecord) -> Iterator[Mark]:
        """Yield what the new pieces lie over and run under: each piece once for each of them."""
        for key in step.pieces:
            named = set()
            for station in self._drawn.pieces[self._drawn.number[key]].stations:
                listed = step.over if station.over else step.under
                if station.crossing not in listed:
                    continue
                for other in self._drawn.strands[station.crossing, not station.over]:
                    there = self._drawn.step_of[other] <= self._at
                    if there and (other, station.over) not in named:
                        named.add((other, station.over))
                        yield self._mark(key, other, station.crossing, over=station.over)

    def _mark(self, key: str, other: str, crossing: int, *, over: bool) -> Mark:
        """Return the name of what a piece meets at a crossing."""
        drawn, frame = self._drawn, self._frame
        own = frame.pixels(drawn.panel(key, crossing, over=over).reshape(-1, 3))
        strand = drawn.panel(other, crossing, over=not over).mean(axis=1)
        ends = on_page(frame.pixels(strand), frame)
        along = ends[1] - ends[0]
        along = along / max(float(np.linalg.norm(along)), 1e-9)
        middle = own.mean(axis=0)
        corners = on_page(own, frame)
        at = corners.mean(axis=0)
        return Mark(
            other,
            "over" if over else "under",
            at,
            along,
            float(np.abs((corners - at) @ along).max()),
            self._hidden(middle),
        )

    def joints(self, step: StepRecord) -> Iterator[Mark]:
        """Yield the joints that are made."""
        for key in step.joints:
            middle = self._pixels(self._drawn.joints[key].crossing).mean(axis=0)
            at = on_page(middle, self._frame)
            up = np.array([0.0, 1.0])
            yield Mark(f"#{key}", "joint", at, up, 0.0, self._hidden(middle))

    def _hidden(self, pixel: FloatArray) -> bool:
        """Return whether something well in front of a place is seen there, or it is not shown."""
        frame, (x, y, near) = self._frame, pixel.tolist()
        if not (0 <= x < frame.width_px and 0 <= y < frame.height_px):
            return True
        return bool(self._near[int(y), int(x)] > near + _LAYERS_MM * frame.pixels_per_mm)

    def slides(self, step: StepRecord) -> Iterator[Slide]:
        """Yield the ways of the ends that slide beneath what is in place."""
        for key in step.pieces:
            number = self._drawn.number[key]
            stations = self._drawn.pieces[number].stations
            beneath = [not station.over and station.crossing in step.under for station in stations]
            line = on_page(self._frame.pixels(self._drawn.scene.middle_line(number)), self._frame)
            panels = [self._drawn.scene.panel(number, at) for at in range(len(stations))]
            half = len(stations) / 2
            for back in (True, False):
                under = [at for at, low in enumerate(beneath) if low and (at < half) == back]
                if not under:
                    continue
                inner = max(under) + 1 if back else min(under) - 1
                inner = min(max(inner, 0), len(stations) - 1)
                start = panels[inner]
                rungs = range(start, -1, -1) if back else range(start, len(line))
                hidden = {panels[at] for at in under}
                points = line[list(rungs)]
                covered = [(min(one, two) in hidden) for one, two in pairwise(rungs)]
                if len(points) > 1:
                    yield Slide(points, np.array(covered))
