"""Say how a value is looked at: from where, and at which scale."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.units import parse_length

if TYPE_CHECKING:
    from fabweave.picture.camera import View


def length_mm(length: Any) -> float:
    """Return a length in millimetres: a number, or a text with a unit."""
    return float(length) if isinstance(length, int | float) else parse_length(length)


def seen_from(
    view: tuple[float, float] | None, across: Any, vertices: FloatArray, triangles: IntArray
) -> "View":
    """Return the view of an object as users say it.

    Parameters
    ----------
    view : (float, float) or None
        Azimuth and elevation in degrees, as ``--view`` takes them; None chooses.
    across : length or None
        How much of the world the picture shows across; None makes the object fill it.
    vertices : (V, 3) float array
    triangles : (T, 3) int array
        The object.

    Raises
    ------
    InputError
        If the length is none.

    Examples
    --------
    >>> import numpy as np
    >>> seen_from((-90, 0), "40cm", np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    View(azimuth_deg=-90, elevation_deg=0, width_mm=400.0)
    """
    from fabweave.picture.camera import View, choose_view  # noqa: PLC0415 - only pictures need it

    seen = choose_view(vertices, triangles) if view is None else View(*view)
    if across is None:
        return seen
    return replace(seen, width_mm=length_mm(across))
