"""Check that every piece lies on a sheet of its thread's material, and what each comes to."""

import re
from typing import Any

from fabweave.verify.checks.own_materials import check_own_materials
from fabweave.verify.checks.pieces import areas_of
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.supplies import Supply, by_bunch
from fabweave.verify.read.job_files import Job, Rows
from fabweave.verify.report import Tally

#: Figures of sub-totals agree to this, or to this share of themselves.
_SAME, _SHARE = 0.011, 1e-6
_SIZE = re.compile(r"([\d.]+)x([\d.]+)mm")


def check_materials(job: Job, tally: Tally) -> None:
    """Check the materials of threads, sheets and pieces against the settings and one another.

    Where the settings name materials by bunch, they name every bunch, and threads of one bunch do
    not cross one another.
    """
    plan = job.map
    if plan is None:
        return
    _check_bunches(job, plan, tally)
    for sheet in plan.sheets:
        for piece in plan.pieces:
            if piece.sheet != sheet.number or piece.thread not in job.supplies:
                continue
            own = job.supplies[piece.thread]
            tally.expect(
                _agree(own, sheet.material, sheet.thickness_mm),
                f"piece {piece.id} is of {own.material}, {own.thickness_mm} mm, and lies on "
                f"{sheet.name} of {sheet.material}, {sheet.thickness_mm} mm",
            )
    _check_sheets_of_bunches(job, plan, tally)
    gaps = [own.gap_mm for own in job.supplies.values() if own.gap_mm is not None]
    tally.expect(
        not gaps or abs(min(gaps) - plan.gap_mm) < 1e-6,
        f"the least gap in job.toml is {min(gaps, default=0.0)} mm, the map has {plan.gap_mm}",
    )
    if job.piece_rows is not None:
        _check_rows(job, plan, job.piece_rows, tally)
    if job.waste is not None:
        _check_waste(job, plan, job.waste, tally)
    _check_limits(job, tally)
    check_own_materials(job, tally)


def _agree(own: Supply, material: object, thickness: object) -> bool:
    """Say whether what is stated is what the settings say, as far as they say it."""
    same = own.material is None or own.material == material
    if own.thickness_mm is None:
        return same
    return same and isinstance(thickness, float | int) and abs(thickness - own.thickness_mm) < 1e-9


def _check_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that settings by bunch fit the bunches of the map."""
    bunches = {thread.bunch for thread in plan.threads}
    parted = False
    for key in ("material", "thickness", "gap"):
        named = set(by_bunch(job.options.get(key))) - {None}
        parted = parted or bool(named)
        tally.expect(
            not named or named == bunches,
            f"job.toml: {key} is of bunches {sorted(named, key=str)}, the map has "
            f"{sorted(bunches)}",
        )
    for crossing in plan.crossings if parted else ():
        one, other = plan.thread[crossing.over.thread], plan.thread[crossing.under.thread]
        tally.expect(
            one is other or one.bunch != other.bunch,
            f"threads {one.label} and {other.label} of bunch {one.bunch} cross at {crossing.id}",
        )


def _check_sheets_of_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that no sheet that the settings keep for one bunch holds pieces of another."""
    kept = []
    for text in job.options.get("sheet", ()):
        # All sizes for one bunch, or for all under None.
        for bunch, size in by_bunch(text).items():
            found = _SIZE.match(size)
            if found is not None:
                kept.append((bunch, float(found[1]), float(found[2])))
    for sheet in plan.sheets if any(bunch is not None for bunch, *_ in kept) else ():
        fits = {
            bunch
            for bunch, width, height in kept
            if abs(width - sheet.width_mm) + abs(height - sheet.height_mm) < _SAME
        }
        there = {plan.thread[piece.thread].bunch for piece in plan.pieces
                 if piece.sheet == sheet.number}  # fmt: skip
        tally.expect(
            bool(sheet.stock) or None in fits or there <= fits,
            f"{sheet.name} holds pieces of bunches {sorted(there)}, and job.toml keeps sheets of "
            f"its size for {sorted(fits, key=str)}",
        )


def _check_rows(job: Job, plan: CrossingMap, rows: Rows, tally: Tally) -> None:
    """Check the materials of pieces.csv."""
    for row in rows:
        piece = plan.piece.get(row["id"])
        if piece is None or piece.thread not in job.supplies:
            continue
        tally.expect(
            _agree(job.supplies[piece.thread], row["material"], float(row["thickness_mm"])),
            f"pieces.csv, piece {piece.id}: {row['material']}, {row['thickness_mm']} mm, but its "
            f"thread is of {job.supplies[piece.thread].material}",
        )


def _check_waste(job: Job, plan: CrossingMap, waste: dict[str, Any], tally: Tally) -> None:
    """Check the sheets' materials in waste.json, and what each material comes to."""
    told = {entry.get("sheet"): entry for entry in waste["sheets"] if isinstance(entry, dict)}
    for sheet in plan.sheets:
        entry = told.get(sheet.number, {})
        stated = entry.get("material"), entry.get("thickness_mm")
        tally.expect(
            stated == (sheet.material, sheet.thickness_mm),
            f"waste.json, sheet {sheet.number}: it is of {stated}, and in the map of "
            f"{sheet.material}, {sheet.thickness_mm} mm",
        )
    records = waste.get("materials")
    if records is None:
        stated_all = all(own.material is None for own in job.supplies.values())
        tally.expect(stated_all, "waste.json has no list of materials")
        return
    # Two supplies of one material have sheets of different sizes: they are looked at together.
    keys = [(record["material"], record["thickness_mm"]) for record in records]
    there = {(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}
    tally.expect(
        set(keys) == there, f"waste.json has materials {sorted(set(keys))}, the sheets {there}"
    )
    mass = 0.0
    for key in sorted(set(keys)):
        own = [record for record, other in zip(records, keys, strict=True) if other == key]
        sums = {name: sum(record[name] for record in own) for name in _wanted(plan, key, 1.0)}
        wanted = _wanted(plan, key, own[0]["density_kg_m3"])
        mass += wanted["mass_g"]
        for name, value in wanted.items():
            tally.expect(
                abs(sums[name] - value) <= _SAME + _SHARE * value,
                f"waste.json, material {key[0]}: {name} is {sums[name]}, but comes to {value:.4f}",
            )
        prices = [
            0.0 if sheet.price is None and sheet.offcut else sheet.price
            for sheet in plan.sheets
            if (sheet.material, sheet.thickness_mm) == key
        ]
        known = [price for price in prices if price is not None]
        told_prices = [record["price"] for record in own if record["price"] is not None]
        wrong = abs(sum(told_prices) - sum(known)) > _SAME
        if len(told_prices) < len(own):
            wrong = len(known) == len(prices)
        tally.expect(
            not wrong and (len(told_prices) < len(own) or len(known) == len(prices)),
            f"waste.json, material {key[0]}: its sheets cost {told_prices}, in the map {prices}",
        )
        for record in own:
            used = record["piece_area_mm2"] + record["hole_area_mm2"]
            tally.expect(
                record["area_mm2"] > 0.0
                and abs(record["utilisation"] - used / record["area_mm2"]) < 1e-5,
                f"waste.json, material {key[0]}: utilisation is {record['utilisation']}",
            )
    stated_mass = waste["totals"].get("mass_g")
    tally.expect(
        isinstance(stated_mass, float) and abs(stated_mass - mass) <= _SAME + _SHARE * mass,
        f"waste.json, totals: mass_g is {stated_mass}, but comes to {mass:.4f}",
    )


def _wanted(
    plan: CrossingMap, key: tuple[str | None, float | None], density: float
) -> dict[str, float]:
    """Return what all sheets of a material come to."""
    sheets = [sheet for sheet in plan.sheets if (sheet.material, sheet.thickness_mm) == key]
    numbers = {sheet.number for sheet in sheets}
    pieces = [piece for piece in plan.pieces if piece.sheet in numbers]
    figures = [areas_of(piece, plan) for piece in pieces]
    area = sum(sheet.area_mm2 for sheet in sheets)
    outlines, holes = (sum(figure[at] for figure in figures) for at in (0, 1))
    return {
        "sheets": len(sheets),
        "pieces": len(pieces),
        "area_mm2": area,
        "piece_area_mm2": outlines - holes,
        "hole_area_mm2": holes,
        "waste_mm2": area - outlines,
        "mass_g": (outlines - holes) * (key[1] or 0.0) * density * 1e-6,
    }


def _check_limits(job: Job, tally: Tally) -> None:
    """Check the thicknesses by which preflight.json went."""
    every = {own.thickness_mm for own in job.supplies.values()}
    if None in every:
        return
    if job.preflight is not None:
        records = job.preflight.get("materials", [job.preflight])
        stated_every = {record.get("thickness_mm") for record in records}
        tally.expect(
            stated_every == every,
            f"preflight.json is of {sorted(stated_every, key=str)} mm, job.toml of {every}",
        )
