"""Tell what is left of the sheets and worth keeping, for people and as stock of the next job."""

from collections.abc import Sequence
from typing import Any

import tomli_w

from fabweave.core.arrays import FloatArray
from fabweave.core.records import record
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut
from fabweave.plan.allotment import Allotment

#: Where offcuts lie in a job's folder, and the list of stock beside their drawings.
OFFCUT_FOLDER, OFFCUT_STOCK = "offcuts", "stock.toml"


@record
class KeptOffcut:
    """What is left of a sheet and worth keeping.

    ``file`` is its drawing in the job's folder, ``worth`` its share of the price of its sheet, None
    where that has none. ``rectangle`` has the least and the greatest corner of the largest one in
    it; ``holes`` are no good.
    """

    file: str
    material: str
    thickness_mm: float
    worth: float | None
    sheet: int
    area_mm2: float
    rectangle: tuple[tuple[float, float], tuple[float, float]]
    outline: tuple[tuple[float, float], ...]
    holes: tuple[tuple[tuple[float, float], ...], ...]


def offcut_records(
    offcuts: Sequence[Offcut], layout: Layout, allotment: Allotment
) -> list[KeptOffcut]:
    """Return what is kept of sheets.

    Each is worth the share of the price of its sheet that its area is of the sheet's.
    """
    records = []
    for offcut in offcuts:
        sheet, material = layout.sheets[offcut.sheet], allotment.of_sheet(offcut.sheet).material
        share = offcut.area_mm2 / sheet.area_mm2
        records.append(
            KeptOffcut(
                file=f"{OFFCUT_FOLDER}/{offcut.name}.dxf",
                material=material.name,
                thickness_mm=material.thickness_mm,
                worth=None if sheet.price is None else round(sheet.price * share, 6),
                sheet=offcut.sheet + 1,
                area_mm2=round(offcut.area_mm2, 6),
                rectangle=_points(offcut.rectangle),
                outline=_points(offcut.outline),
                holes=tuple(map(_points, offcut.holes)),
            )
        )
    return records


def _points(values: FloatArray) -> Any:
    """Return the rows of an array, (N, 2), as tuples of rounded floats."""
    return tuple(map(tuple, values.round(6).tolist()))


def stock_entries(
    offcuts: Sequence[Offcut], layout: Layout, allotment: Allotment, *, title: str, mirrored: bool
) -> list[str]:
    """Return for each offcut its entry in a list of stock that lies beside its drawing.

    It has no price: it is paid for. Its grain is that of the sheet as it lies on the bed.

    Parameters
    ----------
    offcuts : sequence of Offcut
    layout : Layout
    allotment : Allotment
    title : str
        Name of the job, which tells it from the offcuts of others.
    mirrored : bool
        Whether sheets are drawn mirrored.
    """
    entries = []
    for offcut in offcuts:
        sheet = layout.sheets[offcut.sheet]
        entry = {
            "name": f"{offcut.name} of {title}",
            "outline": f"{offcut.name}.dxf",
            "grain": (sheet.mirrored() if mirrored else sheet).grain_deg,
            "material": allotment.of_sheet(offcut.sheet).material.name,
        }
        known = {key: value for key, value in entry.items() if value is not None}
        entries.append(f"[[offcut]]\n{tomli_w.dumps(known)}")
    return entries


def stock_text(records: Sequence[KeptOffcut], entries: Sequence[str]) -> str:
    """Return the list of stock that holds all offcuts of a job."""
    parts = [
        "# Offcuts of a job. fabweave make MESH --stock THIS_FILE --sheet 600x400mm -o DIR uses\n"
        "# them first, and sheets of that size for what does not fit. Delete what is used up.\n"
    ]
    parts += [
        f"# sheet {offcut.sheet}, {offcut.thickness_mm:g} mm; {_room(offcut)}\n{entry}"
        for offcut, entry in zip(records, entries, strict=True)
    ]
    return "\n".join(parts)


def _room(offcut: KeptOffcut) -> str:
    """Say in a line how large an offcut is, and what it is worth."""
    low, high = offcut.rectangle
    size = (
        f"{offcut.area_mm2 / 100:.0f} cm², a rectangle of {high[0] - low[0]:.0f} × "
        f"{high[1] - low[1]:.0f} mm fits"
    )
    return size if offcut.worth is None else f"{size}; worth {offcut.worth:.2f}"
