"""Lay out the woven object for the viewer: for each piece its own stretch of ribbon."""

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.flat.piece import Piece
from fabweave.flat.unfold.stretch import piece_stretches
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: Coordinates are whole numbers of steps from the lower corner, up to this.
_STEPS = 65535


def space_record(
    ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece], *, layer_mm: float | list[float]
) -> dict[str, Any]:
    """Return every piece's stretch of ribbon in space, as the viewer reads it.

    A stretch is a chain of rungs, see ``Stretches``.

    Parameters
    ----------
    ribbons, weave
        The ribbons, and who is on top.
    pieces : sequence of Piece
        All pieces of the job.
    layer_mm : float or list of float
        Thickness of the material, or of each thread's: the layers of a lap are drawn this far
        apart.

    Returns
    -------
    dict
        ``counts``: the number of rungs of each piece. ``panels``: for each piece the rung, from
        its own first, at which the panel of each station begins. ``rungs``: x, y, z of the right
        and the left end of every rung, as unsigned 16-bit little-endian numbers in base64, times
        ``step_mm`` from ``origin_mm``. ``from_right``: a byte for each rung that says whether the
        diagonal of the quad that follows starts at the right rail.
    """
    own = piece_stretches(ribbons, weave, pieces)
    rung = own.rung
    corners = np.stack((ribbons.right[rung], ribbons.left[rung]), axis=1)
    low = corners.reshape(-1, 3).min(axis=0)
    step = max(float((corners.reshape(-1, 3).max(axis=0) - low).max()) / _STEPS, 1e-9)
    panels = np.split(own.panel, own.panel_offsets[1:-1])
    return {
        "layer_mm": layer_mm,
        "origin_mm": low.tolist(),
        "step_mm": step,
        "counts": np.diff(own.offsets).tolist(),
        "panels": [panel.tolist() for panel in panels],
        "rungs": _text(np.round((corners - low) / step).astype("<u2")),
        "from_right": _text(ribbons.from_right[rung].astype(np.uint8)),
    }


def _text(array: np.ndarray[Any, np.dtype[Any]]) -> str:
    """Return an array's bytes as base64."""
    return b64encode(array.tobytes()).decode("ascii")
