"""Hold what is asked of the stock; the table of options says what each field means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fabweave.stock.material import Material
    from fabweave.stock.per_bunch import ByBunch
    from fabweave.stock.sheet_size import SheetSize


@dataclass(frozen=True)
class StockSettings:
    """What the object is cut from, and how pieces lie on it."""

    material: str
    library: tuple[Material, ...]
    thickness_mm: float | ByBunch[float] | None
    sheets: tuple[SheetSize, ...]
    margin_mm: float
    gap_mm: float | ByBunch[float] | None
    rotations: str

    @property
    def rolls(self) -> tuple[SheetSize, ...]:
        """The rolls of the stock."""
        return tuple(sheet for sheet in self.sheets if sheet.is_roll)
