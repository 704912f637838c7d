"""Hold a sheet of stock: its size, number, price, grain, outline and defects."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

#: A closed run of points in the frame of a sheet, millimetres.
Ring: TypeAlias = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SheetSize:
    """A sheet of stock, in its own frame: from its lower left corner, millimetres.

    Parameters
    ----------
    width_mm, height_mm : float
        Of the sheet, or of the rectangle around it.
    quantity : int or None
        How many there are; None for enough.
    name : str
        What it is called in a list of stock; empty if it is in none.
    price : float or None
        Of one sheet, in any currency.
    material : str or None
        What it is made of; None for any.
    grain_deg : float or None
        The direction of its grain, from its width on; None if it has none.
    offcut : bool
        Whether it is left over from earlier work, and so used first.
    outline : Ring
        Its outline if that is not a rectangle.
    defects : tuple of Ring
        Polygons that pieces keep the gap from.
    bunch : str
        The bunch of threads that alone is cut from it; empty for any.
    """

    width_mm: float
    height_mm: float
    quantity: int | None = None
    name: str = ""
    price: float | None = None
    material: str | None = None
    grain_deg: float | None = None
    offcut: bool = False
    outline: Ring = ()
    defects: tuple[Ring, ...] = ()
    bunch: str = ""

    @property
    def plain(self) -> bool:
        """Whether there is nothing to know but size, number and bunch."""
        return self == SheetSize(self.width_mm, self.height_mm, self.quantity, bunch=self.bunch)

    @property
    def ring(self) -> Ring:
        """The outline, of a rectangle too."""
        wide, high = self.width_mm, self.height_mm
        return self.outline or ((0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high))

    @property
    def area_mm2(self) -> float:
        """The area inside the outline; defects are not taken off.

        Examples
        --------
        >>> SheetSize(4.0, 3.0, outline=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))).area_mm2
        6.0
        """
        x, y = np.array(self.ring).T
        return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0

    def mirrored(self) -> "SheetSize":
        """Return the sheet as it is seen from its back, turned over sideways.

        Examples
        --------
        >>> SheetSize(4.0, 3.0, outline=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))).mirrored().outline
        ((4.0, 0.0), (0.0, 0.0), (4.0, 3.0))
        """

        def turned(ring: Ring) -> Ring:
            return tuple((round(self.width_mm - x, 6), y) for x, y in ring)

        return replace(
            self,
            grain_deg=None if self.grain_deg is None else -self.grain_deg % 180.0,
            outline=turned(self.outline),
            defects=tuple(turned(ring) for ring in self.defects),
        )
