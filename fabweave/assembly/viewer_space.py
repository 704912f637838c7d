"""Lay out the woven object for the viewer: for each piece its own stretch of ribbon."""

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.arrays import IntArray, offsets_of
from fabweave.flat.piece import Piece
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave

#: Coordinates are whole numbers of steps from the lower corner, up to this.
_STEPS = 65535


def space_record(
    ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece], *, layer_mm: float
) -> dict[str, Any]:
    """Return every piece's stretch of ribbon in space, as the viewer reads it.

    A stretch is a chain of rungs, from the panel of the piece's first crossing to that of its
    last; where no joint ends it, to the end of the open thread. Two pieces that lap both have the
    panel of their joint.

    Parameters
    ----------
    ribbons, weave
        The ribbons, and who is on top.
    pieces : sequence of Piece
        All pieces of the job.
    layer_mm : float
        Thickness of the material: the layers of a lap are drawn this far apart.

    Returns
    -------
    dict
        ``counts``: the number of rungs of each piece. ``panels``: for each piece the rung, from
        its own first, at which the panel of each station begins. ``rungs``: x, y, z of the right
        and the left end of every rung, as unsigned 16-bit little-endian numbers in base64, times
        ``step_mm`` from ``origin_mm``. ``from_right``: a byte for each rung that says whether the
        diagonal of the quad that follows starts at the right rail.
    """
    thread, place, stations = _places(weave, pieces)
    entry = local_entry(ribbons, thread, place)
    offsets = offsets_of(stations)
    first, last = entry[offsets[:-1]], entry[offsets[1:] - 1] + 1
    size = np.diff(ribbons.offsets)[thread[offsets[:-1]]]
    first = np.where([piece.start_joint is None for piece in pieces], 0, first)
    last = np.where([piece.end_joint is None for piece in pieces], size - 1, last)
    counts = last - first + 1
    rung = _chains(ribbons, thread[offsets[:-1]], first, counts)
    corners = np.stack((ribbons.right[rung], ribbons.left[rung]), axis=1)
    low = corners.reshape(-1, 3).min(axis=0)
    step = max(float((corners.reshape(-1, 3).max(axis=0) - low).max()) / _STEPS, 1e-9)
    panels = np.split(entry - np.repeat(first, stations), offsets[1:-1])
    return {
        "layer_mm": layer_mm,
        "origin_mm": low.tolist(),
        "step_mm": step,
        "counts": counts.tolist(),
        "panels": [panel.tolist() for panel in panels],
        "rungs": _text(np.round((corners - low) / step).astype("<u2")),
        "from_right": _text(ribbons.from_right[rung].astype(np.uint8)),
    }


def _places(weave: Weave, pieces: Sequence[Piece]) -> tuple[IntArray, IntArray, IntArray]:
    """Return thread and place along it of every station, and the number of stations a piece.

    Places count on around a ring, so that they rise along each piece.
    """
    threads = weave.threads
    found = np.zeros((threads.n_crossings, 2), dtype=np.int64)
    passes = np.arange(len(threads.crossing))
    found[threads.crossing, weave.over.astype(np.int64)] = passes
    first = np.array([found[p.crossings[0], int(p.over[0])] for p in pieces], dtype=np.int64)
    thread = threads.thread_of_pass[first]
    stations = np.array([len(piece.crossings) for piece in pieces], dtype=np.int64)
    starts = np.cumsum(stations) - stations
    within = np.arange(stations.sum()) - np.repeat(starts, stations)
    place = np.repeat(first - threads.offsets[thread], stations) + within
    return np.repeat(thread, stations), place, stations


def _chains(ribbons: Ribbons, thread: IntArray, first: IntArray, counts: IntArray) -> IntArray:
    """Return the rungs of all pieces one after another."""
    starts = np.cumsum(counts) - counts
    within = np.arange(counts.sum()) - np.repeat(starts, counts)
    local = np.repeat(first, counts) + within
    size = np.repeat(np.diff(ribbons.offsets)[thread], counts)
    return np.asarray(np.repeat(ribbons.offsets[thread], counts) + local % size)


def _text(array: np.ndarray[Any, np.dtype[Any]]) -> str:
    """Return an array's bytes as base64."""
    return b64encode(array.tobytes()).decode("ascii")
