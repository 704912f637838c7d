"""Hold one record for each kind of joint, and what a job asks of its joints.

A new kind is a record here, and one in ``verify``, which shares no code with what it proves. If its
ends have a new shape, a function in :mod:`fabweave.piece.joint.kinds` makes it.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length

#: Air between a tongue and its socket, and around a tab in its slot; the cut adds its kerf.
CLEARANCE_MM = 0.1
#: Shares of the room: half the neck of a tongue, half its head, its length; half a tab.
_NECK, _HEAD, _TONGUE, _TAB = 0.26, 0.5, 0.65, 0.5
#: A tongue's head is wider than its neck by at least this on either side, or it slips out.
_UNDERCUT_MM = 0.6
#: Thinner walls beside a slot or a socket tear.
_WALL_MM = 1.0


@frozen_value
class Interlock:
    """How the two pieces of a joint are shaped where they meet.

    Parameters
    ----------
    end_mm : float
        Where the first piece ends, straight across, before shaping.
    begin_mm : float or None
        Where the second one begins likewise; None if it begins where its lap does.
    tongue : (K, 2) float array or None
        Polygon that is added to the first piece.
    socket : (K, 2) float array or None
        Polygon that is cut out of the second piece at its end.
    slot : (K, 2) float array or None
        Polygon that is cut out inside the second piece.
    """

    end_mm: float
    begin_mm: float | None
    tongue: FloatArray | None = None
    socket: FloatArray | None = None
    slot: FloatArray | None = None


def butt_room(_thickness_mm: float) -> float:
    """Return how far from the middle to the edges a panel must reach to be cut square across."""
    return _WALL_MM


def butt(_room_mm: float, _thickness_mm: float) -> Interlock:
    """Return the ends of pieces that meet in the middle of their crossing."""
    return Interlock(end_mm=0.0, begin_mm=0.0)


def dovetail_room(thickness_mm: float) -> float:
    """Return how far from the middle to the edges a panel must reach to hold a dovetail.

    Examples
    --------
    >>> dovetail_room(0.4), dovetail_room(3.0)
    (2.5, 12.5)
    """
    return round(max(_UNDERCUT_MM, thickness_mm) / (_HEAD - _NECK), 9)


def dovetail(room_mm: float, thickness_mm: float) -> Interlock:
    """Return a dovetail: a tongue that widens towards its head, and its socket.

    Both pieces stop half the clearance short of the middle line of the crossing, and the socket
    is larger than the tongue by the clearance all around.

    Parameters
    ----------
    room_mm : float
        From the middle of the panel to its nearest edge, :func:`dovetail_room` or more.
    thickness_mm : float
    """
    neck, head = _NECK * room_mm, _HEAD * room_mm
    length = min(_TONGUE * room_mm, room_mm - max(_WALL_MM, thickness_mm))
    right = np.array([(-neck, -neck), (0.0, -neck), (length, -head)])
    tongue = np.concatenate((right, right[::-1] * (1.0, -1.0)))
    socket = shapely.buffer(shapely.Polygon(tongue), CLEARANCE_MM, join_style="mitre")
    return Interlock(
        end_mm=-CLEARANCE_MM / 2,
        begin_mm=CLEARANCE_MM / 2,
        tongue=tongue,
        socket=shapely.get_coordinates(socket.exterior)[:-1],
    )


def slot_room(thickness_mm: float) -> float:
    """Return how far from the middle to the edges a panel must reach to hold a tab in a slot.

    Examples
    --------
    >>> round(slot_room(0.4), 9)
    2.2
    """
    return (max(_WALL_MM, 2 * thickness_mm) + CLEARANCE_MM) / (1 - _TAB)


def tab_in_slot(room_mm: float, thickness_mm: float) -> Interlock:
    """Return a tab with shoulders, and the slot that it goes through.

    The first piece lies on the second one up to the middle of the crossing. There it narrows to
    a tab, which goes down through the slot and lies under the second piece.

    Parameters
    ----------
    room_mm : float
        From the middle of the panel to its nearest edge, :func:`slot_room` or more.
    thickness_mm : float
    """
    half, wide = _TAB * room_mm, (thickness_mm + CLEARANCE_MM) / 2
    tip = room_mm - half / 2  # its corners are cut off, to find the slot
    right = np.array([(-half, -half), (tip, -half), (room_mm, -half / 2)])
    long = half + CLEARANCE_MM
    return Interlock(
        end_mm=0.0,
        begin_mm=None,
        tongue=np.concatenate((right, right[::-1] * (1.0, -1.0))),
        slot=np.array([(-wide, -long), (wide, -long), (wide, long), (-wide, long)]),
    )


@dataclass(frozen=True)
class JointKind:
    """A kind of joint: how its pieces end, what holds it, and what is said of it.

    Parameters
    ----------
    name : str
        On the command line and in files.
    title : str
        What it is, for the help of the command line.
    ties : pair of str
        What a maker does, in steps, with the piece that ends there and with the one that begins
        there; ``{}`` stands for the other piece.
    note : str
        What notes call any number of them, as for :func:`fabweave.core.messages.agree`.
    tools : str
        What the manual recommends to have at hand, besides what sets fasteners.
    laps : bool
        Whether the two pieces lie on one another at the crossing, under the strand above.
    shape : callable, optional
        Returns how the ends are shaped, from the room in the crossing panel and the thickness;
        without it they are cut straight.
    room_mm : callable, optional
        Returns the room that this needs, from the thickness.
    most_fasteners : int
        How many may hold one; 0 where none do.
    bought : str, optional
        The entry of the bill of materials, besides fasteners, in which it is counted.
    marked : bool
        Whether ticks and a cross are engraved, to lay it by.
    crossings : int
        Over so many crossings pieces lap, at least: from the joint's own to one at which their
        thread goes under again.
    """

    name: str
    title: str
    ties: tuple[str, str]
    note: str
    tools: str = ""
    laps: bool = False
    shape: Callable[[float, float], Interlock] | None = None
    room_mm: Callable[[float], float] | None = None
    most_fasteners: int = 0
    bought: str | None = None
    marked: bool = False
    crossings: int = 1


#: What a job has unless it asks for another; more fasteners find no room under a strand.
RIVET = JointKind(
    "rivet",
    title="a lap with a fastener under the strand above",
    ties=("lap the end with {}, hole on hole", "lap the start with {}, hole on hole"),
    note="[lap|laps]",
    laps=True,
    most_fasteners=4,
)
#: What a joint becomes where there is no room for what was asked.
GLUE = JointKind(
    "glue",
    title="a lap with marks to lay it by",
    ties=("glue the end on {}", "glue the start on {}"),
    note="glued [lap|laps]: ticks show where the other piece ends; lay cross on cross",
    tools="glue, and clips to hold each lap while it sets",
    laps=True,
    bought="glue",
    marked=True,
)
_OTHERS = (
    JointKind(
        "tuck",
        title="a long lap over three crossings, its ends under strands, held by the weave",
        ties=("slide the end along {}", "slide the start along {}"),
        note="[lap|laps] over three crossings: both ends lie under strands, and the weave holds "
        "[it|them]",
        laps=True,
        marked=True,
        crossings=3,
    ),
    JointKind(
        "dovetail",
        title="a tongue in a socket, flush",
        ties=("lock the end with {}", "lock the start with {}"),
        note="flush [dovetail|dovetails], each a tongue in a socket",
        tools="a flat surface on which to press the dovetails together",
        shape=dovetail,
        room_mm=dovetail_room,
    ),
    JointKind(
        "slot",
        title="a tab through a slot",
        ties=("put its tab through {}", "take the tab at {}"),
        note="[tab|tabs] pushed through a slot up to [its|their] shoulders",
        tools="a flat surface on which to bend the tabs",
        laps=True,
        shape=tab_in_slot,
        room_mm=slot_room,
    ),
    JointKind(
        "none",
        title="end to end, taped",
        ties=("tape the end to {}", "tape the start to {}"),
        note="[seam|seams] end to end, taped on the inside",
        tools="tape and scissors",
        shape=butt,
        room_mm=butt_room,
        bought="tape",
    ),
)
#: Every kind of joint by its name.
KINDS: Mapping[str, JointKind] = MappingProxyType(
    {kind.name: kind for kind in (RIVET, GLUE, *_OTHERS)}
)

_TEXT = re.compile(r"(?P<kind>[a-z]+)(?::(?P<count>\d{1,3}))?", re.ASCII)


@dataclass(frozen=True)
class JointRule:
    """What a job asks of its joints.

    Parameters
    ----------
    kind : JointKind
    fasteners : int
        How many hold a joint of a kind that has any.
    lap_mm : float or None
        Length of the lap; None for what the kind needs.
    slots : bool
        Whether strands that lie under and have no joint get slots in place of holes.

    Examples
    --------
    >>> parse_joint("rivet:2").fasteners
    2
    """

    kind: JointKind = RIVET
    fasteners: int = 1
    lap_mm: float | None = None
    slots: bool = False

    def __post_init__(self) -> None:
        """Refuse what is not a joint."""
        name = self.kind.name
        if not 1 <= self.fasteners <= RIVET.most_fasteners:
            raise InputError(
                f"a joint cannot have {self.fasteners} fasteners: write from 1 to "
                f"{RIVET.most_fasteners}"
            )
        if self.fasteners != 1 and not self.kind.most_fasteners:
            raise InputError(f"a joint of kind {name} has no fasteners: write just {name}")
        if self.lap_mm is not None and not (math.isfinite(self.lap_mm) and self.lap_mm > 0.0):
            raise InputError(f"the lap is {self.lap_mm} mm; it must be a positive length")
        if self.lap_mm is not None and not (self.kind.laps and self.kind.crossings == 1):
            lapped = ", ".join(
                kind.name for kind in KINDS.values() if kind.laps and kind.crossings == 1
            )
            raise InputError(
                f"a joint of kind {name} has no lap to set: leave that out, or ask for one of "
                f"{lapped}"
            )

    def __str__(self) -> str:
        """Return what is typed for it, with the number of fasteners where it has any."""
        return f"{self.kind.name}:{self.fasteners}" if self.kind.most_fasteners else self.kind.name

    @property
    def holes(self) -> int:
        """How many holes a joint has that is made as asked."""
        return self.fasteners if self.kind.most_fasteners else 0


def parse_joint(text: str) -> JointRule:
    """Read what is typed for a joint: a kind, for rivets maybe their number, laps, and slots.

    Raises
    ------
    InputError
        If it is not a kind of joint, or the number is out of range.

    Examples
    --------
    >>> parse_joint("dovetail").kind.title
    'a tongue in a socket, flush'
    >>> parse_joint("rivet:2,lap=3cm").lap_mm
    30.0
    """
    kind, *more = (part.strip() for part in text.lower().split(","))
    lap_mm, slots = None, False
    for part in more:
        name, equals, length = part.partition("=")
        if name == "lap" and equals:
            lap_mm = parse_length(length, what="lap")
        elif part == "slots":
            slots = True
        else:
            raise InputError(
                f"{part[:40]!r} is nothing that a joint takes: write lap=30mm or slots"
            )
    match = _TEXT.fullmatch(kind)
    if match is None:
        raise InputError(
            f"{text[:40]!r} is not a joint: write one of {', '.join(KINDS)}, or rivet:2 for two "
            "fasteners a joint"
        )
    if match["kind"] not in KINDS:
        raise InputError(
            f"{match['kind']!r} is not a kind of joint: choose one of {', '.join(KINDS)}"
        )
    return JointRule(KINDS[match["kind"]], int(match["count"] or 1), lap_mm, slots)
