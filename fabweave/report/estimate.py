"""Estimate how long a laser cuts, and what sheets cost, where the material's figures are known."""

import html
from collections.abc import Sequence
from typing import Any

from fabweave.stock.material import Material

#: What piercing takes each time, seconds: an engineering default, without a published source.
PIERCE_S = 0.5
_UNKNOWN = "unknown"


def estimate_of(
    material: Material, *, cut_length_mm: float, pierces: int, area_mm2: float
) -> dict[str, Any]:
    """Estimate a sheet: seconds of cutting, from the fastest to the slowest, and its price.

    The time is length over speed, and ``PIERCE_S`` for each line that is cut; engraving and the
    way from line to line are not counted. None where the library has no speed, or no price.

    Parameters
    ----------
    material : Material
    cut_length_mm : float
    pierces : int
        How many lines are cut.
    area_mm2 : float
        Of the sheet.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> estimate_of(material_named("card"), cut_length_mm=1200.0, pierces=10, area_mm2=1e6)
    {'cut_s': [25.0, 35.0], 'price': None}
    """
    speed, price = material.speed_mm_s, material.price_per_m2
    return {
        "cut_s": speed
        and [round(cut_length_mm / each + PIERCE_S * pierces, 3) for each in sorted(speed)[::-1]],
        "price": None if price is None else round(price * area_mm2 * 1e-6, 6),
    }


def estimate_record(
    rows: Sequence[dict[str, Any]], materials: Sequence[Material]
) -> dict[str, Any] | None:
    """Return what ``waste.json`` says of cutting times and prices; None where nothing is known.

    Parameters
    ----------
    rows : sequence of dict
        The records of sheets, with ``cut_length_mm``, ``pierces`` and ``area_mm2``.
    materials : sequence of Material
        That of each sheet.
    """
    each = [
        {"sheet": row["sheet"]}
        | estimate_of(
            material,
            cut_length_mm=row["cut_length_mm"],
            pierces=row["pierces"],
            area_mm2=row["area_mm2"],
        )
        for row, material in zip(rows, materials, strict=True)
    ]
    if all(one["cut_s"] is None and one["price"] is None for one in each):
        return None
    named = {(one.name, one.thickness_mm): one for one in materials}
    times = [one["cut_s"] for one in each]
    prices, currencies = [one["price"] for one in each], {one.currency for one in materials}
    return {
        "pierce_s": PIERCE_S,
        "materials": [
            {
                "material": one.name,
                "thickness_mm": one.thickness_mm,
                "speed_mm_s": one.speed_mm_s and list(one.speed_mm_s),
                "price_per_m2": one.price_per_m2,
                "currency": one.currency,
            }
            for one in named.values()
        ],
        "sheets": each,
        # A sum that lacks a part, or is of several currencies, would be none.
        "cut_s": None
        if None in times
        else [round(sum(time[end] for time in times if time), 3) for end in (0, 1)],
        "price": None
        if None in prices or len(currencies) > 1
        else round(sum(price for price in prices if price), 6),
    }


def estimate_section(
    report: dict[str, Any], sheet_names: Sequence[str], materials: Sequence[Material]
) -> str:
    """Return the estimate as a section of a web page; nothing where there is none."""
    estimate = report["estimate"]
    if estimate is None:
        return ""
    heads = ["Sheet", "Cut, m", "Piercings", "Cutting, min", "Material"]
    named = zip(sheet_names, report["sheets"], estimate["sheets"], materials, strict=True)
    rows = [_cells(name, row, one, material.currency) for name, row, one, material in named] + [
        _cells("all", report["totals"], estimate, materials[0].currency)
    ]
    # What is known of no sheet is left out.
    kept = [at for at in range(len(heads)) if {row[at] for row in rows} != {_UNKNOWN}]
    *body, end = (_row([row[at] for at in kept]) for row in rows)
    head = "".join(f"<th>{heads[at]}</th>" for at in kept)
    return (
        "<h2>Estimate</h2>\n<p>Length over the cutting speeds of a 60 W CO2 laser, and "
        f"{estimate['pierce_s']:g} s for each piercing; engraving and the way between lines are "
        "not counted. Prices are the library's for a square metre. Ask who cuts it.</p>\n"
        f"<table><thead><tr>{head}</tr></thead>\n<tbody>\n"
        + "\n".join(body)
        + f"\n</tbody><tfoot>{end}</tfoot></table>\n"
    )


def minutes(seconds: Sequence[float] | None) -> str:
    """Return a range of times in minutes.

    Examples
    --------
    >>> minutes([25.0, 96.0]), minutes(None)
    ('0.4 to 1.6', 'unknown')
    """
    return _UNKNOWN if seconds is None else f"{seconds[0] / 60:.1f} to {seconds[1] / 60:.1f}"


def _cells(name: str, row: dict[str, Any], one: dict[str, Any], currency: str) -> tuple[str, ...]:
    """Return the cells of a sheet, or of all."""
    price = _UNKNOWN if one["price"] is None else f"{one['price']:.2f} {currency}"
    length = f"{row['cut_length_mm'] / 1000:.1f}"
    return name, length, str(row["pierces"]), minutes(one["cut_s"]), price


def _row(cells: Sequence[object]) -> str:
    return "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells) + "</tr>"
