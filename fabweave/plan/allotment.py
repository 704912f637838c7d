"""Say which supply every thread and every sheet of a job is of."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.nest.layout import Layout
from fabweave.piece.piece import Piece
from fabweave.stock.material import Material
from fabweave.stock.supplies import Supplies, Supply


@frozen_value
class Allotment:
    """Which supply every thread and every sheet of a job is of.

    Parameters
    ----------
    supplies : Supplies
    threads : (T,) int array
        The supply of each thread, as an index of ``supplies.each``.
    sheets : (S,) int array
        That of each sheet.
    """

    supplies: Supplies
    threads: IntArray
    sheets: IntArray

    def of_thread(self, thread: int) -> Supply:
        """Return what a thread is cut from."""
        return self.supplies.each[int(self.threads[thread])]

    def of_pieces(self, pieces: Sequence[Piece]) -> list[int]:
        """Return the supply of each piece, as an index of ``supplies.each``."""
        return self.threads[[piece.thread for piece in pieces]].tolist()

    def of_sheet(self, sheet: int) -> Supply:
        """Return what a sheet is of, counted from 0."""
        return self.supplies.each[int(self.sheets[sheet])]

    @property
    def sheet_materials(self) -> tuple[Material, ...]:
        """The material of each sheet, (S,)."""
        return tuple(self.supplies.materials[index] for index in self.sheets.tolist())

    def captions(self) -> tuple[str, ...]:
        """Return what each sheet is of, (S,), in few letters."""
        return tuple(material.caption for material in self.sheet_materials)


def allot(
    supplies: Supplies, bunches: IntArray, layout: Layout, pieces: Sequence[Piece]
) -> Allotment:
    """Say which supply every thread and every sheet is of; a sheet is of that of its pieces.

    Parameters
    ----------
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    layout : Layout
    pieces : sequence of Piece
    """
    threads = supplies.of(bunches)
    sheets = np.zeros(len(layout.sheets), dtype=np.int64)
    for placement in layout.placements:
        sheets[placement.sheet] = threads[pieces[placement.piece].thread]
    return Allotment(supplies, threads, sheets)
