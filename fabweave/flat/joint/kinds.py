"""Name the kinds of joints, and hold what a job asks of its joints."""

import math
import re
from dataclasses import dataclass

from fabweave.core.errors import InputError

#: Every kind of joint; the first is what a job has unless it asks for another.
KINDS = ("rivet", "glue", "dovetail", "slot", "none")
#: Kinds whose two pieces lie on one another at the crossing, under the strand above.
LAPPED = ("rivet", "glue", "slot")
#: More fasteners find no room under a strand that anybody weaves.
MOST_FASTENERS = 4

_TEXT = re.compile(r"(?P<kind>[a-z]+)(?::(?P<count>\d{1,3}))?", re.ASCII)


@dataclass(frozen=True)
class JointRule:
    """What a job asks of its joints.

    Parameters
    ----------
    kind : str
        ``"rivet"``: the pieces lap, and fasteners go through all layers. ``"glue"``: they lap,
        with marks to lay them by. ``"dovetail"``: a tongue lies in a socket, flush. ``"slot"``: a
        tab goes through a slot. ``"none"``: they butt in the middle of the crossing, to be taped.
    fasteners : int
        How many hold a riveted joint.
    lap_mm : float or None
        Length of the lap; None for what the kind needs.

    Examples
    --------
    >>> parse_joint("rivet:2").fasteners
    2
    """

    kind: str = "rivet"
    fasteners: int = 1
    lap_mm: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is no joint."""
        if self.kind not in KINDS:
            raise InputError(f"{self.kind!r} is no kind of joint: choose one of {', '.join(KINDS)}")
        if not 1 <= self.fasteners <= MOST_FASTENERS:
            raise InputError(
                f"{self.fasteners} fasteners a joint cannot be set: from 1 to {MOST_FASTENERS}"
            )
        if self.fasteners != 1 and self.kind != "rivet":
            raise InputError(f"a joint of kind {self.kind} has no fasteners: write {self.kind}")
        if self.lap_mm is not None and not (math.isfinite(self.lap_mm) and self.lap_mm > 0.0):
            raise InputError(f"a lap of {self.lap_mm} mm must be a positive length")
        if self.lap_mm is not None and self.kind not in LAPPED:
            raise InputError(
                f"a joint of kind {self.kind} has no lap: leave out the lap's length, or ask for "
                f"one of {', '.join(LAPPED)}"
            )


def parse_joint(text: str, *, lap_mm: float | None = None) -> JointRule:
    """Read what is typed for a joint: a kind, and for rivets maybe their number.

    Raises
    ------
    InputError
        If it is no kind of joint, or the number is out of range.

    Examples
    --------
    >>> parse_joint("dovetail").kind
    'dovetail'
    """
    match = _TEXT.fullmatch(text.strip().lower())
    if match is None:
        raise InputError(
            f"{text[:40]!r} is no joint: write one of {', '.join(KINDS)}, or rivet:2 for two "
            "fasteners a joint"
        )
    count = match["count"]
    return JointRule(match["kind"], 1 if count is None else int(count), lap_mm)
