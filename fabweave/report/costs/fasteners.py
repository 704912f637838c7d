"""Hold what fasteners cost, and how long they take, by the holes that they go through."""

from typing import NamedTuple

from fabweave.stock.machine import Span


class FastenerClass(NamedTuple):
    """What goes through holes up to a diameter: seconds to set one, and its price in euros."""

    most_mm: float
    words: str
    seconds: float
    price: Span


#: Holes by screws (ISO 273), blind and semi-tubular rivets (ISO 15981; tengrifast.com 282), craft
#: eyelets and book screws (Wikipedia, Buchschraube). Seconds are the middle of those of the
#: fasteners that fit, practised; blind rivets take 4 (AJX Rivet Handbook) to 8.6 (mfgcalcs.com).
#: Prices and the other seconds are estimates.
_CLASSES = (
    FastenerClass(2.15, "thread, mini brad", 12.0, (0.01, 0.10)),
    FastenerClass(2.9, "M2 screw, 2.4 mm rivet, snap rivet", 10.0, (0.03, 0.15)),
    FastenerClass(3.7, "M3 screw, 3.2 mm rivet, eyelet, snap rivet", 10.0, (0.02, 0.15)),
    FastenerClass(4.8, "4 mm rivet, eyelet, snap rivet", 9.0, (0.05, 0.15)),
    FastenerClass(float("inf"), "book screw", 15.0, (0.20, 0.60)),
)
#: Glue and tape for one joint, in euros: estimates.
GLUE_PRICE, TAPE_PRICE = 0.01, 0.02


def fastener_class(hole_mm: float) -> FastenerClass:
    """Return what goes through a hole.

    Examples
    --------
    >>> fastener_class(2.5).words, fastener_class(5.1).price
    ('M2 screw, 2.4 mm rivet, snap rivet', (0.2, 0.6))
    """
    return next(kind for kind in _CLASSES if hole_mm <= kind.most_mm)
