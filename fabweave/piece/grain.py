"""Say what the grain of a material does to bends: which ask for it, and which lie off it."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.core.messages import agree
from fabweave.piece.development import Runs
from fabweave.piece.piece import Piece
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends, measure_spans
from fabweave.ribbon.rules.finding import FAR, Finding
from fabweave.stock.material import Material, along_radius_mm, laid_across, min_bend_radius_mm
from fabweave.stock.ribbon_limits import Limits, by_thread
from fabweave.stock.rotations import Rotations
from fabweave.weave.threads import Threads

#: A strip that is no more than this off the line across the grain bends as across it (the same
#: table that has the radii: "at 0 or 45 degrees").
ACROSS_DEG = 45.0


def tight_along(ribbons: Ribbons, limits: Limits) -> BoolArray:
    """Return whether from each pass to the next a ribbon bends more tightly than along the grain.

    Parameters
    ----------
    ribbons : Ribbons
    limits : Limits

    Returns
    -------
    (P,) bool array
        False where the material has no grain that counts.
    """
    if not np.any(limits.along_mm):
        return np.zeros(len(ribbons.entry), dtype=np.bool_)
    of_pass = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.pass_offsets))
    radius = measure_spans(ribbons, measure_bends(ribbons)).radius_mm
    return np.asarray(np.nan_to_num(radius, nan=np.inf) < by_thread(limits.along_mm, of_pass))


def off_length_deg(points: FloatArray) -> FloatArray:
    """Return how far the way from each station to the next is off a piece's length, degrees.

    Examples
    --------
    >>> import numpy as np
    >>> off_length_deg(np.array([[0.0, 0.0], [9.0, 0.0], [8.0, 1.0]])).round(6).tolist()
    [0.0, 45.0]
    """
    step = np.abs(np.diff(points, axis=0))
    return np.asarray(np.degrees(np.arctan2(step[:, 1], step[:, 0])))


def grain_findings(
    pieces: Sequence[Piece],
    runs: Runs,
    threads: Threads,
    tight: BoolArray,
    rotations: Rotations,
    labels: Sequence[str],
    centre: FloatArray,
) -> tuple[Finding, ...]:
    """Find the tight bends that may lie too far off the line across the grain.

    Where a piece turns, its strip does not run as its length does: from station to station the
    line between them counts. What the rotations allow is added.

    Parameters
    ----------
    pieces : sequence of Piece
    runs : Runs
        Which passes each carries.
    threads : Threads
    tight : (P,) bool array
        From :func:`tight_along`.
    rotations : Rotations
        How pieces may lie.
    labels : sequence of str
        Names of the threads.
    centre : (X, 3) float array
        Where the crossings are.

    Returns
    -------
    tuple of Finding
        One or none; none where pieces need not lie across the grain.
    """
    if not rotations.across or not tight.any():
        return ()
    passes, off = [], []
    for piece, first in zip(pieces, runs.first.tolist(), strict=True):
        around = first + np.arange(len(piece.points) - 1)
        passes.append(threads.offsets[piece.thread] + around % threads.lengths[piece.thread])
        off.append(off_length_deg(piece.points) + rotations.tolerance_deg)
    at, degrees = np.concatenate(passes), np.concatenate(off)
    at, degrees = at[tight[at]], degrees[tight[at]]
    wrong = np.flatnonzero(degrees > ACROSS_DEG)
    if not len(wrong):
        return ()
    worst = int(wrong[np.argmax(degrees[wrong])])
    thread = int(threads.thread_of_pass[at[worst]])
    crossing = int(threads.crossing[at[worst]])
    x, y, z = (round(float(value), 3) for value in centre[crossing])
    return (
        Finding(
            rule="grain",
            severity="warn",
            value=float(degrees[worst]),
            limit=ACROSS_DEG,
            unit="degrees",
            thread=labels[thread],
            station=int(at[worst] - threads.offsets[thread]),
            crossing=crossing,
            other=None,
            position=(x, y, z),
            count=len(wrong),
            of=len(at),
            far=int(np.count_nonzero(degrees > ACROSS_DEG / FAR)),
        ),
    )


def grain_notes(
    ribbons: Ribbons, limits: Limits, materials: Sequence[Material], rotations: Rotations
) -> list[str]:
    """Say how pieces lie to the grain, and why, where a material has one that counts.

    Parameters
    ----------
    ribbons : Ribbons
    limits : Limits
    materials : sequence of Material
    rotations : Rotations
        How pieces may lie.
    """
    grained = [material for material in materials if material.across_table_mm]
    if not grained:
        return []
    takes = "; ".join(
        f"{material.description} bends to a radius of "
        f"{min_bend_radius_mm(laid_across(material)):.1f} mm across the grain of its "
        f"face, and of {along_radius_mm(material):.1f} mm along it"
        for material in grained
    )
    count = int(np.count_nonzero(tight_along(ribbons, limits)))
    if rotations.across:
        asks = agree(count, "{n} bend[ asks|s ask] for it")
        return [
            f"grain: pieces lie across the grain, up to {rotations.tolerance_deg:g}° off: "
            f"{asks if count else 'no bend asks for it'}. {takes}"
        ]
    if count:
        asks = agree(count, "{n} bend[ is|s are] tighter than that")
        return [f"grain: {takes}; {asks}, and --rotations auto would lay pieces across the grain"]
    need_not = "grain: pieces need not lie across the grain"
    return [f"{need_not}. {takes}, and no bend here is tighter than that"]
