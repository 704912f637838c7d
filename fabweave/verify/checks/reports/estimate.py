"""Check times and prices: what the drawings take at the speeds stated, hands, and sums of money."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from fabweave.verify.checks.reports.assumptions import check_assumptions
from fabweave.verify.checks.reports.hands import check_hands, hardware_price
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import ENGRAVE_LAYERS, HOLES, OUTLINES, Drawing, Ints, traced
from fabweave.verify.measure.areas import polygon_area, sum_areas
from fabweave.verify.measure.motion import Pace, burn_time, hop_time
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Lengths and prices agree to this, and this share of themselves.
_SAME, _SHARE = 0.06, 1e-5
#: Times agree to this, seconds, and this share: coordinates in a drawing are rounded, and so are
#: directions of short sides.
_SAME_S, _SHARE_S = 0.05, 1e-3
#: Prices are rounded to a hundredth of a cent, of each sheet.
_CENT = 1e-4
#: Widths are rounded to a thousandth, and the model's coordinates to 32 bits.
_WIDTH_MM = 0.02
_TIMES = ("engrave_s", "cut_s", "travel_s")

_Span: TypeAlias = list[float] | None
_Price: TypeAlias = dict[str, Any] | None


def check_estimate(job: Job, tally: Tally) -> None:
    """Check lengths and piercings of each sheet, and what the estimate makes of the drawings."""
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
        _check_sheets(job, plan, estimate, rows, place.at("estimate"))
        check_hands(plan, estimate, waste["fasteners"], place.at("estimate"))
        _check_width(job, estimate["difficulty"], place.at("estimate", "difficulty"))
        place.at("estimate").equal("planned", estimate["planned"], False)
        check_assumptions(waste, estimate, place.at("estimate"))
        _check_money(job, waste, estimate, place.at("estimate"))
        _check_rim(job, waste, estimate, place.at("rim"))


def _check_rim(job: Job, waste: dict[str, Any], estimate: dict[str, Any], place: Place) -> None:
    """Check what sheets of rings are said to take against their drawings."""
    told = {str(one["sheet"]): one for one in waste.get("rim") or ()}
    drawings = job.rim.dxf if job.rim is not None else {}
    if not place.same("sheets", list(told), list(drawings)):
        return
    materials = {(one["material"], one["thickness_mm"]): one for one in estimate["materials"]}
    thick = {ring["thickness_mm"] for ring in (job.rim.rings if job.rim is not None else ())}
    for name, drawing in drawings.items():
        one, here = told[name], place.at(name)
        rates = materials.get((one["material"], one["thickness_mm"]))
        if rates is None or one["thickness_mm"] not in thick:
            here.fail("it is of a material that is not that of the rings")
            continue
        for key, span in _sheet_times(drawing, rates, job.options.get("calibrate", 1.0)).items():
            _check_span(one, key, span, here, _SAME_S, _SHARE_S)
        outlines = [shape for shape in drawing.shapes if shape.layer == OUTLINES]
        holes = [shape.radius or 0.0 for shape in drawing.shapes if shape.layer == HOLES]
        area = sum(polygon_area(traced(shape)) for shape in outlines)
        area -= sum(np.pi * radius**2 for radius in holes)
        here.equal("pieces", one["pieces"], len(outlines))
        here.number("piece_area_mm2", one["piece_area_mm2"], area, within=_SHARE_S * area)
        picture = job.rim.svg.get(name) if job.rim is not None else None
        if picture is not None:
            size = (picture.width_mm, picture.height_mm)
            here.equal("its size", (one["width_mm"], one["height_mm"]), size)
        if not job.options.get("stock"):
            area_m2 = [one["width_mm"] * one["height_mm"] * 1e-6] * 2
            _check_price(one, "price", _sheet_price(None, area_m2, rates), here)


def _check_width(job: Job, figures: dict[str, Any], place: Place) -> None:
    """Check how wide pieces are in the median of all stations, across the middle of panels."""
    sides = [
        (panels[:, 0::2].mean(axis=1), panels[:, 1::2].mean(axis=1))
        for panels in (development.panels for development in job.developments.values())
    ]
    widths = [np.hypot(*(right - left).T) for right, left in sides]
    if len(widths) == len(required(job.map).pieces) and widths:
        median = float(np.median(np.concatenate(widths)))
        place.number("width_mm", figures["width_mm"], median, within=_WIDTH_MM)


def _check_sheets(
    job: Job,
    plan: CrossingMap,
    estimate: dict[str, Any],
    rows: dict[int, dict[str, Any]],
    place: Place,
) -> None:
    """Check times and prices of sheets against their drawings, and the sums."""
    factor = job.options.get("calibrate", 1.0)
    place.number("calibration", estimate["calibration"], factor)
    materials = {(one["material"], one["thickness_mm"]): one for one in estimate["materials"]}
    records = {record["sheet"]: record for record in estimate["sheets"]}
    if not place.same("sheets", [record["sheet"] for record in estimate["sheets"]], plan.sheet):
        return
    for sheet in plan.sheets:
        here, record = place.at(f"sheet {sheet.number}"), records[sheet.number]
        rates, row = materials[sheet.material, sheet.thickness_mm], rows[sheet.number]
        drawing = job.dxf.get(sheet.number)
        if drawing is None:
            here.fail("its times are not checked, because its DXF could not be read")
        else:
            for name, span in _sheet_times(drawing, rates, factor).items():
                _check_span(record, name, span, here, _SAME_S, _SHARE_S)
        area = [sheet.area_mm2 * 1e-6] * 2
        _check_price(record, "price", _sheet_price(row["price"], area, rates), here)
    each = list(records.values())
    for name in _TIMES:
        _check_span(estimate, name, _sum_spans([one[name] for one in each]), place, 0.01, 1e-6)
    total = _sum_spans([estimate[name] for name in _TIMES])
    _check_span(estimate, "machine_s", total, place, 0.01, 1e-6)


def _sheet_times(drawing: Drawing, rates: dict[str, Any], factor: float) -> dict[str, _Span]:
    """Return what a drawing takes: colour after colour, at the fastest and at the slowest."""
    layers = np.array(drawing.layer, dtype=object)
    surface = _shapes(layers, ENGRAVE_LAYERS)
    through = _shapes(layers, (HOLES, OUTLINES))
    way = np.concatenate([surface, through])
    spans: dict[str, list[float]] = {name: [] for name in _TIMES}
    for fast in (1, 0):
        rate, corner = rates["acceleration_mm_s2"][fast], rates["deviation_mm"]
        pace = Pace(rates["engrave_mm_s"][fast], rate, corner, rates["laser_on_s"][1 - fast])
        spans["engrave_s"].append(factor * burn_time(drawing, surface, pace))
        hops = hop_time(drawing, way, rates["rapid_mm_s"][fast], rate)
        spans["travel_s"].append(factor * hops)
        if rates["speed_mm_s"] is not None:
            speed = sorted(rates["speed_mm_s"])[fast]
            pace = Pace(speed, rate, corner, rates["pierce_s"][1 - fast])
            spans["cut_s"].append(factor * burn_time(drawing, through, pace))
    return {name: span or None for name, span in spans.items()}


def _shapes(layers: np.ndarray[Any, np.dtype[np.object_]], names: Sequence[str]) -> Ints:
    """Return the shapes on some layers, one layer after another, in the order of the file."""
    return np.concatenate([np.flatnonzero(layers == name) for name in names])


def _sheet_price(stated: float | None, area_m2: list[float], rates: dict[str, Any]) -> _Price:
    """Return what a sheet costs: as the stock says, or by its area."""
    if stated is not None:
        span = [stated, stated]
    elif rates["price_per_m2"] is None:
        return None
    else:
        span = [
            area * price for area, price in zip(area_m2, _pair(rates["price_per_m2"]), strict=True)
        ]
    return {"low": span[0], "high": span[1], "currency": rates["currency"]}


def _check_money(job: Job, waste: dict[str, Any], estimate: dict[str, Any], place: Place) -> None:
    """Check sums of prices: of sheets, hardware, hours of the machine, and all."""
    sheets = _sum_prices([record["price"] for record in estimate["sheets"]])
    _check_price(estimate, "sheet_price", sheets, place)
    _check_price(estimate, "hardware_price", hardware_price(waste), place)
    plan = required(job.map)
    materials = {(one["material"], one["thickness_mm"]): one for one in estimate["materials"]}
    records = {record["sheet"]: record for record in estimate["sheets"]}
    rents: list[_Price] = []
    for sheet in plan.sheets:
        rates = materials.get((sheet.material, sheet.thickness_mm))
        record = records.get(sheet.number)
        if rates is None or record is None:
            place.fail(f"it has no record of {sheet.name}, or of its material")
            return
        span = _sum_spans([record[name] for name in _TIMES])
        if span is None or rates["machine_per_h"] is None:
            rents = [None]
            break
        low, high = (
            price * seconds / 3600.0
            for price, seconds in zip(_pair(rates["machine_per_h"]), span, strict=True)
        )
        rents.append({"low": low, "high": high, "currency": rates["currency"]})
    rent = _sum_prices(rents)
    _check_price(estimate, "machine_price", rent, place)
    parts = [estimate["sheet_price"], estimate["hardware_price"]]
    total = _sum_prices(parts + ([] if rent is None else [estimate["machine_price"]]))
    _check_price(estimate, "price", total, place)


def _pair(value: float | list[float]) -> list[float]:
    """Return a least and a greatest value, which may be one."""
    return value if isinstance(value, list) else [value, value]


def _sum_spans(spans: Sequence[_Span]) -> _Span:
    """Return sums of both ends; None where one is not known."""
    if any(span is None for span in spans):
        return None
    return [sum(span[end] for span in spans if span is not None) for end in (0, 1)]


def _sum_prices(prices: Sequence[_Price]) -> _Price:
    """Return a sum; None where a price is not known, or currencies of prices differ."""
    known = [price for price in prices if price is not None]
    currencies = {price["currency"] for price in known if price["high"] > 0.0}
    if len(known) < len(prices) or len(currencies) > 1:
        return None
    low, high = (sum(price[end] for price in known) for end in ("low", "high"))
    first = known[0]["currency"] if known else ""
    return {"low": low, "high": high, "currency": currencies.pop() if currencies else first}


def _check_span(
    record: dict[str, Any], name: str, span: _Span, place: Place, same: float, share: float
) -> None:
    """Check a range of times, which may be unknown."""
    if span is None:
        place.number(name, record[name], None)
        return
    stated = dict(zip(("fastest", "slowest"), record[name] or (), strict=False))
    for end, value in zip(("fastest", "slowest"), span, strict=True):
        here = place.at(name)
        here.number(end, stated.get(end), value, within=same + share * value)


def _check_price(record: dict[str, Any], name: str, price: _Price, place: Place) -> None:
    """Check a price, which may be unknown."""
    stated = record[name]
    if price is None or stated is None:
        place.equal(name, stated, price)
        return
    for end in ("low", "high"):
        within = _CENT * (1.0 + len(record.get("sheets", ()))) + _SHARE * price[end]
        place.at(name).number(end, stated[end], price[end], within=within)
    place.at(name).equal("currency", stated["currency"], price["currency"])


def _check(record: dict[str, Any], name: str, value: float, place: Place) -> None:
    """Check one figure."""
    place.number(name, record.get(name), value, within=_SAME + _SHARE * value)
