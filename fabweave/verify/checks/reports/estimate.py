"""Check the estimate of cutting times and prices: it follows from what it says it is made of."""

from typing import Any

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import sum_areas
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Lengths, times and prices agree to this, and this share of themselves.
_SAME, _SHARE = 0.06, 1e-5


def check_estimate(job: Job, tally: Tally) -> None:
    """Check lengths and piercings of each sheet, and what the estimate makes of them."""
    plan, waste = required(job.map), required(job.waste)
    place = tally.at("waste.json")
    rows = {row["sheet"]: row for row in waste["sheets"]}
    pierces = 0
    for sheet in plan.sheets:
        areas = [job.areas[piece.id] for piece in plan.on_sheet(sheet.number)]
        figures, here = sum_areas(areas), place.at(f"sheet {sheet.number}")
        lines = len(areas) + figures.cutouts
        row = rows.get(sheet.number, {})
        _check(row, "cut_length_mm", figures.cut_mm, here)
        _check(row, "pierces", lines, here)
        pierces += lines
    # How long all lines are together is another check.
    _check(waste["totals"], "pierces", pierces, place.at("totals"))
    if (estimate := waste.get("estimate")) is not None:
        _check_estimate(plan, estimate, rows, place.at("estimate"))


def _check_estimate(
    plan: CrossingMap, estimate: dict[str, Any], rows: dict[int, dict[str, Any]], place: Place
) -> None:
    """Check times and prices of sheets against speeds and prices of materials, and their sums."""
    materials = {(one["material"], one["thickness_mm"]): one for one in estimate["materials"]}
    records = {record["sheet"]: record for record in estimate["sheets"]}
    if not place.same("sheets", [record["sheet"] for record in estimate["sheets"]], plan.sheet):
        return
    spans: list[list[float] | None] = []
    prices: list[float | None] = []
    for sheet in plan.sheets:
        material, row = materials[sheet.material, sheet.thickness_mm], rows[sheet.number]
        speed, price = material["speed_mm_s"], material["price_per_m2"]
        spans.append(
            speed
            and [
                row["cut_length_mm"] / each + estimate["pierce_s"] * row["pierces"]
                for each in (max(speed), min(speed))
            ]
        )
        prices.append(None if price is None else price * sheet.area_mm2 * 1e-6)
        _check_pair(records[sheet.number], spans[-1], prices[-1], place.at(f"sheet {sheet.number}"))
    currencies = {
        materials[sheet.material, sheet.thickness_mm]["currency"] for sheet in plan.sheets
    }
    known = [span for span in spans if span is not None]
    sums = [sum(span[end] for span in known) for end in (0, 1)]
    costs = [price for price in prices if price is not None]
    price = None if len(costs) < len(prices) or len(currencies) > 1 else sum(costs)
    _check_pair(estimate, None if len(known) < len(spans) else sums, price, place)


def _check_pair(
    record: dict[str, Any], span: list[float] | None, price: float | None, place: Place
) -> None:
    """Check a range of times and a price; either may be unknown."""
    if span is None:
        place.number("cut_s", record["cut_s"], None)
    else:
        ends = dict(zip(("fastest", "slowest"), record["cut_s"] or (), strict=False))
        for name, value in zip(("fastest", "slowest"), span, strict=True):
            _check(ends, name, value, place.at("cut_s"))
    place.number("price", record["price"], price, within=_SAME + _SHARE * (price or 0.0))


def _check(record: dict[str, Any], name: str, value: float, place: Place) -> None:
    """Check one figure."""
    place.number(name, record.get(name), value, within=_SAME + _SHARE * value)
