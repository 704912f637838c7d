"""Tell where pieces end, from the kind and lap of their joints, and what is checked of those."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Joint, Piece
from fabweave.verify.drawing import Floats


@dataclass(frozen=True)
class JointKind:
    """What is known of a kind of joint, and which checks it must pass.

    Parameters
    ----------
    name : str
        As crossing_map.json has it.
    fits : tuple of str
        How its two pieces, laid on one another, are checked: by the names of the checks in
        `fabweave.verify.checks.plan.joints`.
    laps : bool
        Whether its pieces lie on one another at the crossing.
    shaped : pair of bool
        Which of its pieces, the one that ends there and the one that begins there, are cut in the
        middle of the crossing to a shape of the joint's own. Others end half a lap beyond it.
    fastened : bool
        Whether fasteners hold it.
    """

    name: str
    fits: tuple[str, ...]
    laps: bool = False
    shaped: tuple[bool, bool] = (False, False)
    fastened: bool = False

    @property
    def slotted(self) -> bool:
        """Whether the second piece has a slot, through which the first one's tab goes."""
        return "tab" in self.fits


KINDS: Mapping[str, JointKind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            JointKind("rivet", ("lap",), laps=True, fastened=True),
            JointKind("glue", ("lap",), laps=True),
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
    start, end = (plan.joint.get(key) if key is not None else None for key in piece.joints)
    return _reach(start, 1), _reach(end, 0)


def _reach(joint: Joint | None, side: int) -> Reach:
    """Return the reach of the first or of the second piece of a joint."""
    if joint is None:
        return Reach()
    if kind_of(joint).shaped[side]:
        return Reach(0.0, shaped=True)
    half = None if joint.lap_mm is None else joint.lap_mm / 2.0
    return Reach(half)


def cut_rungs(rungs: Floats, first: int, last: int, ends: tuple[Reach, Reach]) -> Floats:
    """Return the rungs of a piece, cut off straight where its reaches say.

    Parameters
    ----------
    rungs : (N, 2, 2) float array
        Laid rungs, at least as far as the piece goes.
    first, last : int
        The rungs where the ribbon enters the first panel, and where it enters the last one.
    ends : pair of Reach
        Both with a length in millimetres.
    """
    middle = rungs.mean(axis=1)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))])
    begin = (run[first] + run[first + 1]) / 2.0 - (ends[0].mm or 0.0)
    end = (run[last] + run[last + 1]) / 2.0 + (ends[1].mm or 0.0)
    inside = rungs[(run > begin + 1e-9) & (run < end - 1e-9)]
    corners = [_at(run, rungs, place)[None] for place in (begin, end)]
    return np.concatenate([corners[0], inside, corners[1]])


def lap_rungs(window: Floats, panel: Floats, joint: Joint) -> Floats:
    """Return the rungs of a ribbon where it laps at a joint: half the lap to either side.

    Parameters
    ----------
    window : (N, 2, 2) float array
        Laid rungs, from before the joint's crossing panel to after it.
    panel : (4, 2) float array
        The corners of that panel: right and left where the ribbon enters, then where it leaves.
    joint : Joint
    """
    half = Reach((joint.lap_mm or 0.0) / 2.0)
    entered = int(np.argmin(np.hypot(*(window[:, 0] - panel[0]).T)))
    return cut_rungs(window, entered, entered, (half, half))


def ring_of_rungs(rungs: Floats) -> Floats:
    """Return the border of laid rungs: along the right rail, and back along the left one."""
    return np.concatenate([rungs[:, 0], rungs[::-1, 1]])


def _at(run: Floats, rungs: Floats, place: float) -> Floats:
    """Return the cross-line at a distance along the middle, (2, 2)."""
    flat = rungs.reshape(len(rungs), 4)
    return np.array([np.interp(place, run, column) for column in flat.T]).reshape(2, 2)
