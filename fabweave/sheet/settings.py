"""Hold what the machine wants; the table of options says what each field means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fabweave.sheet.kerf import MicroJoints
    from fabweave.sheet.presets import Preset
    from fabweave.sheet.targets import Target
    from fabweave.stock.sheet_size import SheetSize


#: How high letters are at least: for hands at a bench, and for young ones.
LEAST_MM, SCHOOL_MM = 2.0, 3.0


@dataclass(frozen=True)
class MachineSettings:
    """How sheets are written for the machine that cuts them, and for its people."""

    profile: str
    preset: Preset
    dxf: str
    svg_units: str
    hairline_mm: float | None
    target: str
    rules: tuple[Target, ...]
    strict: bool
    paper: str
    sticks: str | None
    kerf_mm: float
    micro_joints: MicroJoints | None
    cut_order: str
    template: str
    calibrate: float
    bed: SheetSize | None

    @property
    def letters_mm(self) -> float:
        """How high letters are at least."""
        return SCHOOL_MM if self.profile == "school" else LEAST_MM

    @property
    def line_mm(self) -> float:
        """The width of lines in the SVG."""
        return self.preset.hairline_mm if self.hairline_mm is None else self.hairline_mm
