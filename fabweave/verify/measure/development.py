"""Unfold each piece's part of the model and lay it on the piece."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Joint, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.geometry import (
    Motion,
    Steps,
    fit_most,
    lay_steps,
    panel_bounds,
    unfold,
)
from fabweave.verify.measure.walks import station_run
from fabweave.verify.read.glb import Strip


@dataclass(frozen=True)
class JointKind:
    """What is known of a kind of joint, and which checks it must pass.

    Parameters
    ----------
    name : str
        As crossing_map.json has it.
    fits : tuple of str
        How its two pieces, laid on one another, are checked: by the names of the checks in
        `fabweave.verify.check.joints`.
    laps : bool
        Whether its pieces lie on one another at the crossing.
    shaped : pair of bool
        Which of its pieces, the one that ends there and the one that begins there, are cut in the
        middle of the crossing to a shape of the joint's own. Others end half a lap beyond it.
    fastened : bool
        Whether fasteners hold it.
    crossings : int
        Over how many crossings its pieces lap at least.
    """

    name: str
    fits: tuple[str, ...]
    laps: bool = False
    shaped: tuple[bool, bool] = (False, False)
    fastened: bool = False
    crossings: int = 1

    @property
    def slotted(self) -> bool:
        """Whether the second piece has a slot, through which the first one's tab goes."""
        return "tab" in self.fits


#: A lap ends with a crossing panel to this.
_LAPPED_MM = 0.05

KINDS: Mapping[str, JointKind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            JointKind("rivet", ("lap",), laps=True, fastened=True),
            JointKind("glue", ("lap",), laps=True),
            JointKind("tuck", ("lap", "under"), laps=True, crossings=3),
            JointKind("dovetail", ("flush", "hold"), shaped=(True, True)),
            JointKind("slot", ("tab",), laps=True, shaped=(True, False)),
            JointKind("none", ("abut",), shaped=(True, True)),
        )
    }
)


def kind_of(joint: Joint) -> JointKind:
    """Return the kind of a joint; of an unknown one, another check says so."""
    return KINDS.get(joint.kind, JointKind(joint.kind, ()))


@dataclass(frozen=True)
class Reach:
    """How far a piece goes beyond the middle of its last crossing, along its middle line.

    ``mm`` is None where it goes to the end of the crossing panel, or, on a thread that is open
    there, to the thread's end. ``shaped`` says that the outline about the middle of the crossing
    is the joint's own.
    """

    mm: float | None = None
    shaped: bool = False


def reaches(plan: CrossingMap, piece: Piece) -> tuple[Reach, Reach]:
    """Return how far a piece reaches beyond its first and its last crossing."""
    start, end = map(plan.joint.get, piece.joints)
    return _reach(start, 1), _reach(end, 0)


def _reach(joint: Joint | None, side: int) -> Reach:
    """Return the reach of the first or of the second piece of a joint."""
    if joint is None:
        return Reach()
    if kind_of(joint).shaped[side]:
        return Reach(0.0, shaped=True)
    return Reach(lap_reach(joint)[1 - side])


def lap_reach(joint: Joint) -> tuple[float | None, float | None]:
    """Return how far a lap goes behind and ahead of the middle of its crossing."""
    if joint.lap_mm is None:
        return None, None
    ahead = joint.lap_mm / 2.0 if joint.ahead_mm is None else joint.ahead_mm
    return joint.lap_mm - ahead, ahead


def _cut_rungs(
    rungs: Floats, whole: tuple[int, int], panels: tuple[int, int], ends: tuple[Reach, Reach]
) -> Floats:
    """Return the rungs of a piece, cut off straight where its reaches say.

    Parameters
    ----------
    rungs : (N, 2, 2) float array
        Laid rungs, at least as far as the piece goes.
    whole : pair of int
        The first and the last rung of what is not cut off.
    panels : pair of int
        The rungs where the ribbon enters the first panel, and where it enters the last one.
    ends : pair of Reach
    """
    run = _along_middle(rungs)
    begin, end = (
        run[at] if reach.mm is None else (run[panel] + run[panel + 1]) / 2.0 + way * reach.mm
        for at, panel, reach, way in zip(whole, panels, ends, (-1.0, 1.0), strict=True)
    )
    inside = rungs[(run > begin + 1e-9) & (run < end - 1e-9)]
    return np.concatenate([_at(run, rungs, begin), inside, _at(run, rungs, end)])


def _along_middle(rungs: Floats) -> Floats:
    """Return how far along the middle line each rung is."""
    steps = np.hypot(*np.diff(rungs.mean(axis=1), axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def lap_rungs(window: Floats, panel: Floats, joint: Joint) -> Floats:
    """Return the rungs of a ribbon where it laps at a joint.

    Parameters
    ----------
    window : (N, 2, 2) float array
        Laid rungs, from before the lap to after it.
    panel : (4, 2) float array
        The corners of that panel: right and left where the ribbon enters, then where it leaves.
    joint : Joint
    """
    behind, ahead = (Reach(mm or 0.0) for mm in lap_reach(joint))
    entered = int(np.argmin(np.hypot(*(window[:, 0] - panel[0]).T)))
    return _cut_rungs(window, (0, -1), (entered, entered), (behind, ahead))


def ring_of_rungs(rungs: Floats) -> Floats:
    """Return the border of laid rungs: along the right rail, and back along the left one."""
    return np.concatenate([rungs[:, 0], rungs[::-1, 1]])


def _at(run: Floats, rungs: Floats, place: float) -> Floats:
    """Return the cross-line at a distance along the middle, (1, 2, 2)."""
    flat = rungs.reshape(len(rungs), 4)
    return np.array([np.interp(place, run, column) for column in flat.T]).reshape(1, 2, 2)


@dataclass(frozen=True, eq=False)
class Development:
    """A piece's part of the model, unfolded and laid on the piece.

    Parameters
    ----------
    rungs : (N, 2, 2) float array
        Right and left ends of its rungs in the piece's coordinates.
    panels : (S, 4, 2) float array
        Corners of the crossing panel of each station: entry right, left, exit right, left.
    space : (S, 4, 3) float array
        The same corners in the model.
    placed : (R, 2, 3) float array
        All rungs in the model from the first panel to the last one, or to an open thread's ends.
    window : (N, 2, 2) float array
        The rungs from the panel before the piece to that after it, or those over which it may lap,
        as far as there are any.
    slack_mm : float
        What the model's rounding to 32 bits may have added to any deviation.
    """

    rungs: Floats
    panels: Floats
    space: Floats
    placed: Floats
    window: Floats
    slack_mm: float

    @property
    def stations(self) -> Floats:
        """The middle of each panel, (S, 2)."""
        return np.asarray(self.panels.mean(axis=1))

    @property
    def outline(self) -> Floats:
        """The rails as one ring: along the right one and back along the left one."""
        return ring_of_rungs(self.rungs)


def lapped_stations(development: Development, joint: Joint) -> int:
    """Return how many crossings after its first one the piece that begins at a joint laps over."""
    middle, run = development.rungs.mean(axis=1), _along_middle(development.rungs)
    sides = development.panels.reshape(-1, 2, 2, 2).mean(axis=2)
    at = np.hypot(*np.moveaxis(sides[:, :, None] - middle, -1, 0)).argmin(axis=2)
    ahead = run[at[:, 1]] - run[at[0]].mean()
    return int(np.count_nonzero(ahead[1:] <= (lap_reach(joint)[1] or 0.0) + _LAPPED_MM))


def develop_pieces(plan: CrossingMap, strips: dict[int, Strip]) -> dict[str, Development]:
    """Unfold each piece's part of the model and lay it on the piece without reflection.

    A piece whose stations are no run of its thread is left out.
    """
    steps = {key: lay_steps(strip) for key, strip in strips.items()}
    result = {}
    for piece in plan.pieces:
        thread, strip = plan.thread.get(piece.thread), strips.get(piece.thread)
        start = station_run(thread, piece) if thread is not None else None
        if thread and strip and strip.closed == thread.closed and start is not None:
            result[piece.id] = _develop(plan, piece, strip, steps[piece.thread], start)
    return result


def _develop(
    plan: CrossingMap, piece: Piece, strip: Strip, steps: Steps, start: int
) -> Development:
    """Unfold one piece and lay it on itself by its stations."""
    begin, end = panel_bounds(strip, start, len(piece.stations))
    size, count, final = len(strip.entry), len(strip.rungs), start + len(piece.stations) - 1
    # The ends of an open thread reach beyond their last crossing.
    opens, ends = (not strip.closed and at_end for at_end in (start == 0, final == size - 1))
    first, last = 0 if opens else int(begin[0]), count - 1 if ends else int(end[-1])
    # Laps may go on to the panels before and after.
    before, after = first, last
    if not opens:
        before -= int((strip.entry[start] - strip.exit[(start - 1) % size]) % count)
    joint = plan.joint.get(piece.joints[1])
    panels_on = 1 if joint is None or joint.ahead_mm is None else 2 * kind_of(joint).crossings
    panels_on = min(panels_on, size - 1 - (0 if strip.closed else final))
    after += int((strip.exit[(final + panels_on) % size] - strip.exit[final % size]) % count)
    window = unfold(strip, steps, before, after)
    panels = np.concatenate([window[begin - before], window[end - before]], axis=1)
    whole, reach = (first - before, last - before), reaches(plan, piece)
    rungs = window[whole[0] : whole[1] + 1]
    if any(one.mm is not None for one in reach):
        entered = int(begin[0]) - before, int(begin[-1]) - before
        rungs = _cut_rungs(window, whole, entered, reach)
    place = np.stack([begin, end], axis=1) % count
    space = strip.rungs[place].reshape(-1, 4, 3)
    flat = panels.mean(axis=1)
    motion = fit_most(flat, piece.points)
    if len(flat) < 2:
        motion = _turn_by_outline(rungs, flat[0], piece)
    width = float(np.min(np.hypot(*(rungs[:, 1] - rungs[:, 0]).T)))
    length = float(_along_middle(rungs)[-1])
    # Each rung's direction is uncertain by about grain / width; the errors walk at random.
    slack = strip.grain_mm * (1.0 + np.sqrt(len(rungs)) * length / max(2.0 * width, 1e-9))
    return Development(
        rungs=motion.apply(rungs),
        panels=motion.apply(panels),
        space=space,
        placed=strip.rungs[np.arange(first, last + 1) % count],
        window=motion.apply(window),
        slack_mm=float(slack),
    )


def _turn_by_outline(rungs: Floats, middle: Floats, piece: Piece) -> Motion:
    """Lay a piece with one station: among turns that bring a corner onto a vertex, the best."""
    station = complex(piece.stations[0].x, piece.stations[0].y)
    ring = ring_of_rungs(rungs)
    arms = (ring[:, 0] + 1j * ring[:, 1]) - complex(*middle)
    goals = (piece.outline[:, 0] + 1j * piece.outline[:, 1]) - station
    corners = arms[np.argsort(-np.abs(arms), kind="stable")[:4]]
    turns = (goals[:, None] / corners[None, :]).ravel()
    turns = turns[np.abs(turns) > 0.0]
    turns = turns / np.abs(turns)
    border = shapely.LinearRing(piece.outline)
    moved = turns[:, None] * arms[None, :] + station
    misses = shapely.distance(shapely.points(moved.real, moved.imag), border).max(axis=1)
    turn = complex(turns[int(np.argmin(misses))])
    return Motion(turn, station - turn * complex(*middle))
