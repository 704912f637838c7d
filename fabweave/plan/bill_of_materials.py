"""Hold what is bought besides sheets: fasteners, glue and tape, as ``waste.json`` lists them."""

from fabweave.core.records import optional, record
from fabweave.stock.hardware import Hardware


@record
class FastenerRow:
    """Fasteners of one diameter, number of layers and grip: needed, spare, and to buy in all.

    ``fits`` names the sorts of hardware that do, in the order of the catalogue.
    """

    diameter_mm: float
    layers: int
    grip_mm: float
    needed: int
    spare: int
    buy: int
    fits: tuple[str, ...] | None = optional()


@record
class GlueRow:
    """Glued joints, and the area of their laps, each counted once."""

    joints: int
    area_mm2: float


@record
class TapeRow:
    """Taped joints, and the length of tape across their seams."""

    joints: int
    length_mm: float


@record
class BillOfMaterials:
    """What is bought besides sheets; ``hardware`` tells of the sorts that fit some fastener."""

    fasteners: tuple[FastenerRow, ...]
    glue: GlueRow
    tape: TapeRow
    hardware: tuple[Hardware, ...] | None = optional()
