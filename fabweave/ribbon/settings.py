"""Hold what is asked of ribbons; the table of options says what each field means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fabweave.ribbon.width import WidthRule

#: Panels at crossings are so long, as a share of their room, if that is left to fabweave.
_PANEL_SHARE = 0.7


@dataclass(frozen=True)
class RibbonSettings:
    """How wide and how smooth ribbons are, and how far apart."""

    width: WidthRule | None
    strips: Literal["wavy", "straight"]
    smooth: int
    crossing: float | None
    clearance_mm: float

    @property
    def width_rule(self) -> WidthRule:
        """How wide ribbons are; of one width where nobody says."""
        from fabweave.ribbon.width import EVEN  # noqa: PLC0415 - not for help

        return EVEN if self.width is None else self.width

    @property
    def straight(self) -> bool:
        """Whether strips are straight."""
        return self.strips == "straight"

    @property
    def panel_share(self) -> float:
        """Length of the panel at each crossing, as a share of its room."""
        if self.crossing is not None:
            return self.crossing
        return max(_PANEL_SHARE, self.width_rule.relative)

    def with_width(self, rule: WidthRule) -> RibbonSettings:
        """Return the settings with another width, and panels at crossings as long as they were."""
        return replace(self, width=rule, crossing=self.panel_share)
