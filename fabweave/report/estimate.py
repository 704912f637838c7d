"""Estimate how long a laser cuts, and what sheets cost, where the material's figures are known."""

import html
from collections.abc import Sequence

from fabweave.core.records import record
from fabweave.report.accounts import SheetAccount, Totals
from fabweave.stock.material import Material

#: What piercing takes each time, seconds: an engineering default, without a published source.
PIERCE_S = 0.5
_UNKNOWN = "unknown"


@record
class SheetEstimate:
    """What a sheet takes: seconds of cutting, from the fastest to the slowest, and its price."""

    sheet: int
    cut_s: tuple[float, float] | None
    price: float | None


@record
class MaterialRates:
    """What the library knows of a material: slowest and fastest speed, and its price."""

    material: str
    thickness_mm: float
    speed_mm_s: tuple[float, float] | None
    price_per_m2: float | None
    currency: str


@record
class Estimate:
    """What cutting takes, and what sheets cost: of each, and in all; None where it is not known."""

    pierce_s: float
    materials: tuple[MaterialRates, ...]
    sheets: tuple[SheetEstimate, ...]
    cut_s: tuple[float, float] | None
    price: float | None


def estimate_sheet(sheet: SheetAccount, material: Material) -> SheetEstimate:
    """Estimate a sheet of a material.

    The time is length over speed, and ``PIERCE_S`` for each line that is cut; engraving and the
    way from line to line are not counted.
    """
    speed, price = material.speed_mm_s, material.price_per_m2
    cut_s = None
    if speed:
        quick, slow = (
            round(sheet.cut_length_mm / each + PIERCE_S * sheet.pierces, 3)
            for each in sorted(speed, reverse=True)
        )
        cut_s = quick, slow
    return SheetEstimate(
        sheet=sheet.number,
        cut_s=cut_s,
        price=None if price is None else round(price * sheet.area_mm2 * 1e-6, 6),
    )


def estimate_sheets(
    sheets: Sequence[SheetAccount], materials: Sequence[Material]
) -> Estimate | None:
    """Estimate all sheets; None where nothing is known.

    Parameters
    ----------
    sheets : sequence of SheetAccount
    materials : sequence of Material
        That of each sheet.
    """
    estimates = tuple(map(estimate_sheet, sheets, materials))
    times = [estimate.cut_s for estimate in estimates if estimate.cut_s is not None]
    prices = [estimate.price for estimate in estimates if estimate.price is not None]
    if not times and not prices:
        return None
    named = {(material.name, material.thickness_mm): material for material in materials}
    quick, slow = (round(sum(time[end] for time in times), 3) for end in (0, 1))
    one_currency = len({material.currency for material in materials}) == 1
    return Estimate(
        pierce_s=PIERCE_S,
        materials=tuple(
            MaterialRates(
                material=material.name,
                thickness_mm=material.thickness_mm,
                speed_mm_s=material.speed_mm_s,
                price_per_m2=material.price_per_m2,
                currency=material.currency,
            )
            for material in named.values()
        ),
        sheets=estimates,
        # A sum that lacks a part, or is of several currencies, would be none.
        cut_s=(quick, slow) if len(times) == len(sheets) else None,
        price=round(sum(prices), 6) if len(prices) == len(sheets) and one_currency else None,
    )


def estimate_section(
    estimate: Estimate | None,
    sheets: Sequence[SheetAccount],
    totals: Totals,
    sheet_names: Sequence[str],
    materials: Sequence[Material],
) -> str:
    """Return the estimate as a section of a web page; nothing where there is none.

    Parameters
    ----------
    estimate : Estimate or None
    sheets : sequence of SheetAccount
    totals : Totals
    sheet_names : sequence of str
    materials : sequence of Material
        That of each sheet.
    """
    if estimate is None:
        return ""
    heads = ["Sheet", "Cut, m", "Piercings", "Cutting, min", "Material"]
    rows = [
        _cells(name, sheet, sheet_estimate, material.currency)
        for name, sheet, sheet_estimate, material in zip(
            sheet_names, sheets, estimate.sheets, materials, strict=True
        )
    ]
    rows.append(_cells("all", totals, estimate, materials[0].currency))
    # What is known of no sheet is left out.
    kept = [at for at in range(len(heads)) if {row[at] for row in rows} != {_UNKNOWN}]
    *body, end = (_row([row[at] for at in kept]) for row in rows)
    head = "".join(f"<th>{heads[at]}</th>" for at in kept)
    return (
        "<h2>Estimate</h2>\n<p>Times are for the cutting speeds of a 60 W CO2 laser, plus "
        f"{estimate.pierce_s:g} s for each piercing; engraving and moves between lines are not "
        "counted. Prices are those of the material library, per square metre. Whoever cuts the "
        "sheets can say what they really take.</p>\n"
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


def _cells(
    name: str, cuts: SheetAccount | Totals, estimate: SheetEstimate | Estimate, currency: str
) -> tuple[str, ...]:
    """Return the cells of a sheet, or of all."""
    price = _UNKNOWN if estimate.price is None else f"{estimate.price:.2f} {currency}"
    length = f"{cuts.cut_length_mm / 1000:.1f}"
    return name, length, str(cuts.pierces), minutes(estimate.cut_s), price


def _row(cells: Sequence[object]) -> str:
    return "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells) + "</tr>"
