"""Bring the colours of strands to the rungs of ribbons and the sections of yarns."""

from typing import Protocol

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.core.colour_space import Colours
from fabweave.core.errors import InputError


class Strips(Protocol):
    """What ribbons and yarns have in common: rungs or sections in rows, and where passes are."""

    @property
    def offsets(self) -> IntArray:
        """Where the rungs of each thread begin, (T + 1,)."""

    @property
    def pass_offsets(self) -> IntArray:
        """Where the passes of each thread begin, (T + 1,)."""

    @property
    def entry(self) -> IntArray:
        """The rung at which each pass comes to its crossing, (P,)."""


def rung_colours(strips: Strips, colours: Colours) -> Colours:
    """Return the colour of each rung of ribbons or section of yarns, (R, 3).

    A rung where a thread comes to a crossing has the colour in which it comes, and the ones behind
    that in which it leaves; so colours change at crossings only.

    Parameters
    ----------
    strips : Ribbons or Yarns
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of each pass, as it comes and as it leaves; or one for each thread.

    Raises
    ------
    InputError
        If there are not as many colours as passes or threads.
    """
    offsets = strips.offsets
    n_threads, n_passes = len(offsets) - 1, len(strips.entry)
    colours = np.asarray(colours, dtype=np.uint8)
    if colours.shape not in ((n_threads, 3), (n_passes, 2, 3)):
        raise InputError(
            f"there are {n_threads} threads with {n_passes} passes, and the colours have the shape "
            f"{colours.shape}; give red, green and blue for each thread, or for each pass as it "
            "comes and as it leaves"
        )
    rung = np.arange(offsets[-1])
    thread = np.searchsorted(offsets, rung, side="right") - 1
    if colours.ndim == 2:
        return np.asarray(colours[thread])
    number = np.searchsorted(strips.entry, rung, side="right") - 1
    # An open thread begins before its first pass.
    before = number < strips.pass_offsets[thread]
    number = np.where(before, strips.pass_offsets[thread], number)
    leaves = strips.entry[number] < rung
    return np.asarray(colours[number, leaves.astype(np.int64)])
