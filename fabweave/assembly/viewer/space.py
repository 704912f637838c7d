"""Lay out the woven object for the viewer: for each piece its own stretch of ribbon."""

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.records import record
from fabweave.flat.piece import Piece
from fabweave.flat.unfold.development import piece_stretches
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: Coordinates are whole numbers of steps from the lower corner, up to this.
_STEPS = 65535


@record
class SpaceRecord:
    """Every piece's stretch of ribbon in space, as the viewer reads it.

    A stretch is a chain of rungs, see ``Stretches``.

    Parameters
    ----------
    layer_mm : float or tuple of float
        Thickness of the material, or of each thread's: the layers of a lap are drawn this far
        apart.
    origin_mm, step_mm : (float, float, float), float
        Coordinates are whole numbers of steps from the origin.
    counts : tuple of int
        The number of rungs of each piece.
    panels : tuple of tuples of int
        For each piece the rung, from its own first, at which the panel of each station begins.
    rungs : str
        x, y, z of the right and the left end of every rung, as unsigned 16-bit little-endian
        numbers in base64.
    from_right : str
        A byte for each rung, in base64: whether the diagonal of the quad that follows starts at
        the right rail.
    """

    layer_mm: float | tuple[float, ...]
    origin_mm: tuple[float, float, float]
    step_mm: float
    counts: tuple[int, ...]
    panels: tuple[tuple[int, ...], ...]
    rungs: str
    from_right: str


def space_record(
    ribbons: Ribbons,
    weave: Weave,
    pieces: Sequence[Piece],
    *,
    layer_mm: float | tuple[float, ...],
) -> SpaceRecord:
    """Return every piece's stretch of ribbon in space; see ``SpaceRecord`` for ``layer_mm``."""
    stretches = piece_stretches(ribbons, weave, pieces)
    rung = stretches.rung
    corners = np.stack((ribbons.right[rung], ribbons.left[rung]), axis=1)
    low = corners.reshape(-1, 3).min(axis=0)
    step = max(float((corners.reshape(-1, 3).max(axis=0) - low).max()) / _STEPS, 1e-9)
    panels = np.split(stretches.panel, stretches.panel_offsets[1:-1])
    x, y, z = low.tolist()
    return SpaceRecord(
        layer_mm=layer_mm,
        origin_mm=(x, y, z),
        step_mm=step,
        counts=tuple(np.diff(stretches.offsets).tolist()),
        panels=tuple(tuple(panel.tolist()) for panel in panels),
        rungs=_text(np.round((corners - low) / step).astype("<u2")),
        from_right=_text(ribbons.from_right[rung].astype(np.uint8)),
    )


def _text(array: np.ndarray[Any, np.dtype[Any]]) -> str:
    """Return an array's bytes as base64."""
    return b64encode(array.tobytes()).decode("ascii")
