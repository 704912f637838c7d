"""Pack rectangles on shelves: the naive layout that nesting is compared with."""

import numpy as np

from fabweave.core.arrays import FloatArray


def shelf_sheets(
    sizes_mm: FloatArray, sheet_mm: tuple[float, float], gap_mm: float
) -> tuple[int, int]:
    """Pack rectangles on shelves along the longer side of sheets, the highest first.

    Each lies along the shelf, and goes on the first shelf that has room for it, else on a new one
    of the first sheet that has. They stand at the gap from one another.

    Parameters
    ----------
    sizes_mm : (N, 2) float array
        Sides of each.
    sheet_mm : (float, float)
        Sides of what is usable of a sheet.
    gap_mm : float

    Returns
    -------
    sheets : int
        How many sheets are used.
    left_out : int
        How many rectangles fit on none.

    Examples
    --------
    Two of 4 × 2 fill a shelf of 9 × 2, and two shelves a sheet; one of 10 × 1 fits nowhere.

    >>> import numpy as np
    >>> shelf_sheets(np.array([[4.0, 2.0]] * 5 + [[1.0, 10.0]]), (9.0, 5.0), 1.0)
    (2, 1)
    """
    wide, high = max(sheet_mm) + gap_mm, min(sheet_mm) + gap_mm
    length, height = sizes_mm.max(axis=1) + gap_mm, sizes_mm.min(axis=1) + gap_mm
    fits = (length <= wide + 1e-9) & (height <= high + 1e-9)
    order = np.lexsort((-length, -height))
    shelves: list[list[float]] = []  # of each shelf: what is left of its length, and its height
    sheets: list[float] = []  # of each sheet: what is left above its shelves
    for rectangle in order[fits[order]].tolist():
        own = float(length[rectangle])
        shelf = next((one for one in shelves if one[0] >= own - 1e-9), None)
        if shelf is None:
            rise = float(height[rectangle])
            at = next((n for n, left in enumerate(sheets) if left >= rise - 1e-9), None)
            if at is None:
                at = len(sheets)
                sheets.append(high)
            sheets[at] -= rise
            shelf = [wide, rise]
            shelves.append(shelf)
        shelf[0] -= own
    return len(sheets), int(np.count_nonzero(~fits))
