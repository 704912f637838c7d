"""Measure how much unfolded ribbons wave from side to side."""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.flat.unfold.development import unfold_threads
from fabweave.ribbon.project import Ribbons


def wave_turns(ribbons: Ribbons) -> FloatArray:
    """Return by how many degrees each unfolded middle line turns at its rungs.

    A straight strip has none; the sum of their sizes over the length tells how wavy a ribbon is,
    and with it how much of the sheet its pieces waste.

    Returns
    -------
    (R,) float array
        Positive to the left as seen from outside; 0 at the ends of open ribbons.
    """
    strips = unfold_threads(ribbons)
    wave = np.zeros(ribbons.n_rungs)
    if len(strips.rung) < 3:
        return wave
    middle = (strips.right + strips.left) @ np.array([0.5, 0.5j])
    heading = np.diff(middle)
    strip = np.repeat(np.arange(len(strips.offsets) - 1), np.diff(strips.offsets))
    same = strip[:-2] == strip[2:]
    turn = np.degrees(np.angle(heading[1:] * heading[:-1].conj()))
    wave[strips.rung[1:-1][same]] = turn[same]
    # A ring ends with its first rung again: there the two ends of its strip come together.
    rings = np.flatnonzero(ribbons.closed & (np.diff(ribbons.offsets) > 0))
    starts, ends = strips.offsets[:-1][rings], strips.offsets[1:][rings] - 1
    rung = (strips.left - strips.right) @ np.array([1, 1j])
    out, back = heading[starts] / rung[starts], heading[ends - 1] / rung[ends]
    wave[strips.rung[starts]] = np.degrees(np.angle(out * back.conj()))
    return wave
