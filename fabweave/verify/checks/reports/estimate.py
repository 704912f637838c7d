"""Check the estimate of cutting times and prices: it follows from what it says it is made of."""

from typing import Any

from fabweave.verify.checks.plan.pieces import areas_of
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: Lengths, times and prices agree to this, and this share of themselves.
_SAME, _SHARE = 0.06, 1e-5


def check_estimate(job: Job, tally: Tally) -> None:
    """Check lengths and piercings of each sheet, and what the estimate makes of them."""
    plan, waste = job.map, job.waste
    if plan is None or waste is None:
        return
    rows = {row["sheet"]: row for row in waste["sheets"]}
    pierces = 0
    for sheet in plan.sheets:
        pieces = [piece for piece in plan.pieces if piece.sheet == sheet.number]
        cut = sum(areas_of(piece, plan)[2] for piece in pieces)
        lines = sum(1 + len(plan.holes[piece.id]) + len(piece.slots) for piece in pieces)
        where, row = f"waste.json, sheet {sheet.number}", rows.get(sheet.number, {})
        _check(where, row, "cut_length_mm", cut, tally)
        _check(where, row, "pierces", lines, tally)
        pierces += lines
    # How long all lines are together is another check.
    _check("waste.json, totals", waste["totals"], "pierces", pierces, tally)
    if (estimate := waste.get("estimate")) is not None:
        _check_estimate(plan, estimate, rows, tally)


def _check_estimate(
    plan: CrossingMap, estimate: dict[str, Any], rows: dict[int, dict[str, Any]], tally: Tally
) -> None:
    """Check times and prices of sheets against speeds and prices of materials, and their sums."""
    materials = {(one["material"], one["thickness_mm"]): one for one in estimate["materials"]}
    told = {one["sheet"]: one for one in estimate["sheets"]}
    if not tally.expect(
        sorted(told) == sorted(sheet.number for sheet in plan.sheets),
        f"waste.json estimates sheets {sorted(told)}",
    ):
        return
    spans: list[Any] = []
    prices: list[Any] = []
    for sheet in plan.sheets:
        material = materials[sheet.material, sheet.thickness_mm]
        row, where = rows[sheet.number], f"waste.json, estimate of sheet {sheet.number}"
        speed, price = material["speed_mm_s"], material["price_per_m2"]
        span = speed and [
            row["cut_length_mm"] / each + estimate["pierce_s"] * row["pierces"]
            for each in (max(speed), min(speed))
        ]
        spans.append(span)
        prices.append(None if price is None else price * sheet.area_mm2 * 1e-6)
        _check_pair(where, told[sheet.number], spans[-1], prices[-1], tally)
    currencies = {
        materials[sheet.material, sheet.thickness_mm]["currency"] for sheet in plan.sheets
    }
    whole = None if None in spans else [sum(span[end] for span in spans) for end in (0, 1)]
    price = None if None in prices or len(currencies) > 1 else sum(prices)
    _check_pair("waste.json, estimate", estimate, whole, price, tally)


def _check_pair(
    where: str, told: dict[str, Any], span: list[float] | None, price: float | None, tally: Tally
) -> None:
    """Check a range of times and a price; either may be unknown."""
    if span is None:
        tally.expect(told["cut_s"] is None, f"{where}: cut_s is {told['cut_s']}, with no speed")
    else:
        ends = dict(zip(("fastest", "slowest"), told["cut_s"] or (), strict=False))
        for name, value in zip(("fastest", "slowest"), span, strict=True):
            _check(f"{where}, cut_s", ends, name, value, tally)
    if price is None:
        tally.expect(told["price"] is None, f"{where}: price is {told['price']}, and not known")
    else:
        _check(where, told, "price", price, tally)


def _check(where: str, row: dict[str, Any], key: str, value: float, tally: Tally) -> None:
    """Check one figure."""
    stated = row.get(key)
    same = isinstance(stated, int | float) and abs(stated - value) <= _SAME + _SHARE * value
    tally.expect(same, f"{where}: {key} is {stated}, but comes to {value:.4f}")
