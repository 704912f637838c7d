"""Choose which sheet of the stock is taken next: offcuts first, then what costs least."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fabweave.nest.place.fill import NestingJob
from fabweave.stock.sheet_size import SheetSize


def order_of_use(stock: Sequence[SheetSize]) -> list[int]:
    """Return the numbers of the stock in the order in which sheets are taken.

    Offcuts come first, the smallest first: they are paid for. Then the sheets that cost least for
    their area; then, as they stand, those without a price.

    Examples
    --------
    >>> stock = [SheetSize(9, 9), SheetSize(8, 8, price=4.0), SheetSize(2, 2, price=0.1)]
    >>> order_of_use([*stock, SheetSize(1, 3, 1, offcut=True)])
    [3, 2, 1, 0]
    """

    def key(number: int) -> tuple[int, float]:
        sheet = stock[number]
        if sheet.offcut:
            return 0, sheet.area_mm2
        return (2, 0.0) if sheet.price is None else (1, sheet.price / sheet.area_mm2)

    return sorted(range(len(stock)), key=key)


def next_sheet(job: NestingJob, queue: Sequence[int], sheets: Sequence[int]) -> int | None:
    """Return the sheet of the stock to fill next; None if none is left for the queue's first piece.

    ``sheets`` are in use already, by their number in the stock. An offcut is taken if any piece of
    the queue fits it, another sheet if the first one does.
    """
    shapes = np.unique([job.poses[piece].shape for piece in queue])
    first, taken = job.poses[queue[0]].shape, Counter(sheets)
    for number in order_of_use(job.stock):
        sheet = job.stock[number]
        if sheet.quantity is not None and taken[number] >= sheet.quantity:
            continue
        if job.fits[first, number] or (sheet.offcut and job.fits[shapes, number].any()):
            return number
    return None
