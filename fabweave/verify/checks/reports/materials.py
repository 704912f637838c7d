"""Check that every piece lies on a sheet of its thread's material, and what each comes to."""

import re
from math import nan
from typing import Any, TypeAlias

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import sum_areas
from fabweave.verify.measure.supplies import Supply, by_bunch, length_of
from fabweave.verify.read.job_files import Job, Rows, required
from fabweave.verify.statement import Place, Tally

#: Figures of sub-totals agree to this, or to this share of themselves; shares agree to that.
_SAME, _SHARE, _UTILISATION = 0.011, 1e-6, 1e-5
#: Radii are stated to a ten-thousandth.
_ROUNDED_MM = 1e-4
_SIZE = re.compile(r"([\d.]+)x([\d.]+)mm")

_Key: TypeAlias = tuple[str | None, float | None]


def check_materials(job: Job, tally: Tally) -> None:
    """Check the materials of threads, sheets and pieces against the settings and one another.

    Where the settings name materials by bunch, they name every bunch, and threads of one bunch do
    not cross one another.
    """
    plan = required(job.map)
    _check_bunches(job, plan, tally)
    for sheet in plan.sheets:
        for piece in plan.on_sheet(sheet.number):
            if (supply := job.supplies.get(piece.thread)) is not None:
                tally.at(f"piece {piece.id}").expect(
                    _agree(supply, sheet.material, sheet.thickness_mm),
                    f"it is of {supply.material}, {supply.thickness_mm} mm, and lies on "
                    f"{sheet.name} of {sheet.material}, {sheet.thickness_mm} mm",
                )
    _check_sheets_of_bunches(job, plan, tally)
    gaps = [supply.gap_mm for supply in job.supplies.values() if supply.gap_mm is not None]
    least = min(gaps, default=plan.gap_mm)
    place = tally.at("crossing_map.json").against("job.toml")
    place.number("the least gap", plan.gap_mm, least, within=1e-6)
    if job.piece_rows is not None:
        _check_rows(job, plan, job.piece_rows, tally.at("pieces.csv"))
    if job.waste is not None:
        _check_waste(job, plan, job.waste, tally.at("waste.json"))
    if job.waste is not None and "kerf_mm" in job.waste:
        kerf = length_of(str(job.options.get("kerf", "0mm")))
        tally.at("waste.json").against("job.toml").number("kerf_mm", job.waste["kerf_mm"], kerf)
    _check_limits(job, tally)
    check_own_materials(job, tally)


def _agree(supply: Supply, material: object, thickness: object) -> bool:
    """Say whether what is stated is what the settings say, as far as they say it."""
    same = supply.material is None or supply.material == material
    if supply.thickness_mm is None:
        return same
    return (
        same and isinstance(thickness, float | int) and abs(thickness - supply.thickness_mm) < 1e-9
    )


def _check_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that settings by bunch fit the bunches of the map."""
    bunches = {thread.bunch for thread in plan.threads}
    parted = False
    for key in ("material", "thickness", "gap"):
        named = set(by_bunch(job.options.get(key))) - {None}
        parted = parted or bool(named)
        tally.at("job.toml", key).same("bunches", named or bunches, bunches)
    for crossing in plan.crossings if parted else ():
        one, other = plan.thread[crossing.over.thread], plan.thread[crossing.under.thread]
        tally.at(f"crossing {crossing.id}").expect(
            one is other or one.bunch != other.bunch,
            f"threads {one.label} and {other.label} of bunch {one.bunch} cross there",
        )


def _check_sheets_of_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that no sheet that the settings keep for one bunch holds pieces of another."""
    kept = []
    for text in job.options.get("sheet", ()):
        # All sizes for one bunch, or for all under None.
        for bunch, size in by_bunch(text).items():
            match = _SIZE.match(size)
            if match is not None:
                kept.append((bunch, float(match[1]), float(match[2])))
    for sheet in plan.sheets if any(bunch is not None for bunch, *_ in kept) else ():
        fits = {
            bunch
            for bunch, width, height in kept
            if abs(width - sheet.width_mm) + abs(height - sheet.height_mm) < _SAME
        }
        there = {plan.thread[piece.thread].bunch for piece in plan.on_sheet(sheet.number)}
        tally.at(sheet.name).expect(
            bool(sheet.stock) or None in fits or there <= fits,
            f"it holds pieces of bunches {sorted(there)}, and in job.toml its size is for bunches "
            f"{sorted(fits, key=str)}",
        )


def _check_rows(job: Job, plan: CrossingMap, rows: Rows, place: Place) -> None:
    """Check the materials of pieces.csv."""
    for row in rows:
        piece = plan.cut_piece.get(row["id"])
        if piece is None or piece.thread not in job.supplies:
            continue
        supply = job.supplies[piece.thread]
        place.at(f"piece {piece.id}").expect(
            _agree(supply, row["material"], float(row["thickness_mm"])),
            f"it is of {row['material']}, {row['thickness_mm']} mm, but its thread is of "
            f"{supply.material}, {supply.thickness_mm} mm",
        )


def _check_waste(job: Job, plan: CrossingMap, waste: dict[str, Any], place: Place) -> None:
    """Check the sheets' materials in waste.json, and what each material comes to."""
    rows = {row.get("sheet"): row for row in waste["sheets"] if isinstance(row, dict)}
    for sheet in plan.sheets:
        row = rows.get(sheet.number, {})
        place.at(f"sheet {sheet.number}").equal(
            "what it is of",
            (row.get("material"), row.get("thickness_mm")),
            (sheet.material, sheet.thickness_mm),
        )
    records = waste.get("materials")
    if records is None:
        unnamed = all(supply.material is None for supply in job.supplies.values())
        place.expect(unnamed, "it has no list of materials")
        return
    only = {(record["material"], record["thickness_mm"]) for record in records}
    place.equal(
        "the one material",
        waste.get("material"),
        dict(zip(("name", "thickness_mm"), only.pop(), strict=True)) if len(records) == 1 else None,
    )
    _check_named(job, records, place)
    # Two supplies of one material have sheets of different sizes: they are looked at together.
    by_key: dict[_Key, list[dict[str, Any]]] = {}
    for record in records:
        by_key.setdefault((record["material"], record["thickness_mm"]), []).append(record)
    place.same("materials", by_key, {(sheet.material, sheet.thickness_mm) for sheet in plan.sheets})
    mass = sum(
        _check_material(job, plan, key, by_key[key], place.at(f"material {key[0]}"))
        for key in sorted(by_key)
    )
    place.at("totals").number(
        "mass_g", waste["totals"].get("mass_g"), mass, within=_SAME + _SHARE * mass
    )


def _check_named(job: Job, records: list[dict[str, Any]], place: Place) -> None:
    """Check that each bunch is said to be cut from its material, if there are several."""
    material, thickness = (by_bunch(job.options.get(key)) for key in ("material", "thickness"))
    named = [(name, record) for record in records for name in record["bunches"]]
    numbers = [*by_bunch(",".join(f"{name}=" for name, _ in named))]
    if len(records) == 1:
        place.equal("the list of bunches of the only material", [name for name, _ in named], [])
        return
    place.expect(
        len(set(numbers)) == len(numbers) and all(record["bunches"] for record in records),
        f"bunches are named twice, or not at all: {[name for name, _ in named]}",
    )
    for number, (name, record) in zip(numbers, named, strict=False):
        supply = Supply(
            material.get(number, material.get(None)),
            length_of(thickness.get(number, thickness.get(None))),
        )
        place.at(f"bunch {name}").expect(
            _agree(supply, record["material"], record["thickness_mm"]),
            f"it is said to be of {record['material']}, {record['thickness_mm']} mm, and is of "
            f"{supply.material}, {supply.thickness_mm} mm",
        )


def _check_material(
    job: Job, plan: CrossingMap, key: _Key, records: list[dict[str, Any]], place: Place
) -> float:
    """Check what the records of a material come to together; return its mass in grams."""
    sheets = [sheet for sheet in plan.sheets if (sheet.material, sheet.thickness_mm) == key]
    pieces = [piece for sheet in sheets for piece in plan.on_sheet(sheet.number)]
    figures = sum_areas(job.areas[piece.id] for piece in pieces)
    area = sum(sheet.area_mm2 for sheet in sheets)
    mass = figures.piece_mm2 * (key[1] or 0.0) * float(records[0]["density_kg_m3"]) * 1e-6
    for name, value in {
        "sheets": len(sheets),
        "pieces": len(pieces),
        "area_mm2": area,
        "piece_area_mm2": figures.piece_mm2,
        "hole_area_mm2": figures.holes_mm2,
        "waste_mm2": area - figures.piece_mm2,
        "mass_g": mass,
    }.items():
        total = sum(record[name] for record in records)
        place.number(name, total, value, within=_SAME + _SHARE * value)
    # An offcut without a price costs nothing; another sheet's price may be unknown.
    prices = [0.0 if sheet.price is None and sheet.offcut else sheet.price for sheet in sheets]
    known = [price for price in prices if price is not None]
    stated = [record["price"] for record in records if record["price"] is not None]
    if len(stated) == len(records):
        good = len(known) == len(prices) and abs(sum(stated) - sum(known)) <= _SAME
    else:
        good = len(known) < len(prices)
    place.expect(good, f"its sheets cost {stated}, and in the map {prices}")
    for record in records:
        used, whole = record["piece_area_mm2"], record["area_mm2"]
        share = used / whole if whole > 0.0 else nan
        place.number("utilisation", record["utilisation"], share, within=_UTILISATION)
    return mass


def _check_limits(job: Job, tally: Tally) -> None:
    """Check the materials, and their thicknesses, by which preflight.json went."""
    wanted = {(supply.material, supply.thickness_mm) for supply in job.supplies.values()}
    if job.preflight is None or any(None in pair for pair in wanted):
        return
    records = job.preflight.get("materials", [job.preflight])
    stated = [(record.get("material"), record.get("thickness_mm")) for record in records]
    tally.at("preflight.json").same("materials", stated, wanted)


def check_own_materials(job: Job, tally: Tally) -> None:
    """Check that entries are of materials in use, and density, price, speed and bend are theirs."""
    entries = job.options.get("materials", {})
    if not entries:
        return
    used = {_plain(supply.material) for supply in job.supplies.values()}
    strange = sorted(set(entries) - used)
    tally.at("job.toml").equal("entries of materials that are not used", strange, [])
    waste = job.waste or {}
    estimate = (waste.get("estimate") or {}).get("materials", [])
    for where, records, keys in (
        ("materials", waste.get("materials", []), ("density_kg_m3",)),
        ("estimate", estimate, ("speed_mm_s", "price_per_m2", "currency")),
    ):
        for record in records:
            entry = entries.get(_plain(record["material"]), {})
            for key in keys if entry else ():
                place = tally.at("waste.json", where, record["material"]).against("job.toml")
                place.equal(key, record[key] or None, entry.get(key) or None)
    for record in estimate:
        _check_machine(record, entries.get(_plain(record["material"]), {}), tally)
    _check_bends(job, entries, tally)


def _check_machine(record: dict[str, Any], entry: dict[str, Any], tally: Tally) -> None:
    """Check what an entry says of its machine, one value or two; what it does not is its kind's."""
    place = tally.at("waste.json", "estimate", record["material"]).against("job.toml")
    for key in ("engrave_mm_s", "acceleration_mm_s2", "rapid_mm_s", "pierce_s"):
        if key in entry:
            stated = entry[key] if isinstance(entry[key], list) else [entry[key]] * 2
            place.equal(key, record[key], stated)
    for key in ("machine", "machine_per_h") if entry else ():
        stated = entry.get(key, None if key == "machine_per_h" else record[key])
        place.equal(key, record[key], stated)


def _check_bends(job: Job, entries: dict[str, Any], tally: Tally) -> None:
    """Check the tightest bend that ribbons.json states of each thread."""
    if job.map is None or job.ribbons is None:
        return
    threads = {thread.label: job.supplies.get(thread.id, Supply()) for thread in job.map.threads}
    for record in job.ribbons["threads"]:
        supply = threads.get(record.get("thread"), Supply())
        entry = entries.get(_plain(supply.material))
        if entry is None or supply.thickness_mm is None:
            continue
        stated = record.get("limits", job.ribbons["limits"]).get("bend_mm")
        across = job.map.from_grain_deg == 90.0 and "across_table_mm" in entry
        wanted = _tightest_mm(entry, supply.thickness_mm, across=across)
        place = tally.at("ribbons.json", f"thread {record.get('thread')}").against("job.toml")
        place.number("bend_mm", stated, wanted, within=_ROUNDED_MM)


def _tightest_mm(entry: dict[str, Any], thickness_mm: float, *, across: bool = False) -> float:
    """Return the tightest radius by an entry's rule; beyond a table its end's ratio is kept.

    Examples
    --------
    >>> table = {"bend_table_mm": [[1.0, 50.0], [2.0, 120.0]]}
    >>> [_tightest_mm(table, thickness) for thickness in (0.5, 1.5, 4.0)]
    [25.0, 85.0, 240.0]
    """
    if "min_bend_radius_t" in entry and not across:
        return float(entry["min_bend_radius_t"] * thickness_mm)
    table = entry["across_table_mm" if across else "bend_table_mm"]
    thick, radius = np.array(table, dtype=np.float64).T
    inside = float(np.clip(thickness_mm, thick[0], thick[-1]))
    return float(np.interp(inside, thick, radius)) * thickness_mm / inside


def _plain(material: str | None) -> str:
    """Return the name of a material without the sort after its colon."""
    return (material or "").partition(":")[0]
