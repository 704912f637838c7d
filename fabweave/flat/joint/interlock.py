"""Shape the ends of pieces that do not simply lap: dovetails, tabs in slots, and butts.

Shapes are in the frame of the joint's station: its origin is the middle of the crossing panel, x
runs along the thread and y to its left. Pieces are cut off square to the thread, even where the
panel is not a rectangle.
"""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value

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
