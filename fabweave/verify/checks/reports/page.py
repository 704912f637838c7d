"""Check that the page on material shows what waste.json says, each text in its place."""

import re
import tomllib
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from typing import Any

from fabweave.verify.checks.reports.page_costs import costs_shown, rings_shown
from fabweave.verify.checks.reports.page_splitting import splitting_shown
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.titles import titles_of
from fabweave.verify.measure.words import ANSWERS, counted
from fabweave.verify.read.job_files import LIKENESS, Job, required
from fabweave.verify.read.offcuts import STOCK
from fabweave.verify.read.waste_page import Seen, bar, row, spaced
from fabweave.verify.statement import Place, Tally

#: What the sentence at the head of the page calls the materials.
_MATERIAL = re.compile(r"\d+ pieces? of (.+), on \d+ sheets?: ")


def check_page(job: Job, tally: Tally) -> None:
    """Check all that is seen on waste.html against waste.json, the verdict and the map."""
    page, waste, plan = required(job.waste_page), required(job.waste), required(job.map)
    place = tally.at("waste.html").against("waste.json")
    title = title_of(job)
    if job.options.get("mesh"):
        names = titles_of(job.options)
        place.expect(title in names, f"its title is {title!r}, but should be {names[0]!r}")
    _check_entries(job, page, title, place)
    wanted = map(spaced, _wanted(job, plan, waste, title))
    shown = (one for one in page if one.tag != "pre")
    compare_pages(shown, wanted, place)


def title_of(job: Job) -> str:
    """Return the name of the object, as the title of the page has it; empty without one."""
    titles = [text for tag, text in job.waste_page or () if tag == "title"]
    return titles[0].removesuffix(": material") if titles else ""


def material_of(job: Job) -> str | None:
    """Return what the page calls all materials; None where it does not.

    The files know materials by short names alone, so what they are called can be no more than the
    same wherever it stands, and have the right thicknesses.
    """
    said = (_MATERIAL.match(text) for tag, text in job.waste_page or () if tag == "p")
    return next((match[1] for match in said if match is not None), None)


def _sections(seen: Iterable[Seen]) -> dict[str, list[Seen]]:
    """Part what is seen by the headings; what stands before the first has no name."""
    sections: dict[str, list[Seen]] = {"": []}
    here = sections[""]
    for one in seen:
        if one.tag == "h2":
            here = sections.setdefault(one.text, [])
        here.append(one)
    return sections


def compare_pages(seen: Iterable[Seen], due: Iterable[Seen], place: Place) -> None:
    """Hold each section of a page to what it should show; of each, the first difference is told.

    Parameters
    ----------
    seen, due : iterable of Seen
        What is seen on the page, and what should be.
    place : Place
        The page.
    """
    shown, wanted = _sections(seen), _sections(due)
    place.equal("the row of sections", list(shown), list(wanted))
    for name, texts in wanted.items():
        there = shown.get(name, [])
        here = place.at(f"section {name!r}") if name else place
        here.count(len(texts))
        for said, one in zip_longest(there, texts):
            if said != one:
                here.fail(f"it says {_told(said)}, but should say {_told(one)}")
                break


def _told(one: Seen | None) -> str:
    return "nothing more" if one is None else f"<{one.tag}> {one.text!r:.100}"


def _wanted(job: Job, plan: CrossingMap, waste: dict[str, Any], title: str) -> Iterator[Seen]:
    """Yield what the page should show, in order."""
    names = {sheet.number: sheet.name for sheet in plan.sheets}
    yield Seen("title", f"{title}: material")
    yield Seen("h1", f"{title}: material")
    if job.verdict is not None:
        yield from verdict_shown(job.verdict)
    yield from _sheets(job, plan, waste)
    if len(waste.get("materials") or ()) > 1:
        yield from _materials(waste["materials"], _each_material(job, waste["materials"]))
    if "comparison" in waste:
        yield from _comparison(waste["comparison"], waste["totals"])
    if waste.get("estimate") is not None:
        yield from costs_shown(waste["estimate"], names)
    yield from rings_shown(waste.get("rim") or [])
    if waste.get("offcuts"):
        yield from _offcuts(waste["offcuts"], names)
    yield from _bill(waste)
    if waste.get("splitting") is not None:
        yield from splitting_shown(waste["splitting"])
    if waste.get("notes"):
        yield Seen("h2", "Notes")
        yield from (Seen("li", note) for note in waste["notes"])
    yield Seen("h2", "Pictures")
    for name in names.values():
        yield Seen("img", f"sheets/{name}.png")
        yield Seen("figcaption", name)
    outcome = (job.settings or {}).get("outcome")
    if isinstance(outcome, dict) and "likeness_mm" in outcome:
        yield Seen("img", LIKENESS)
        yield Seen(
            "figcaption", "the model, coloured by how far it is from the mesh that was woven"
        )


def verdict_shown(verdict: dict[str, Any]) -> Iterator[Seen]:
    """Yield what pages show of whether it can be built, and why not.

    Parameters
    ----------
    verdict : dict
        What verdict.json says.
    """
    level = verdict["level"]
    yield Seen("div", f"verdict {level.replace(' ', '-')}")
    forced = " It was made all the same (--force)." if verdict["forced"] else ""
    yield Seen("p", f"Can it be built? {ANSWERS[level]}{forced}")
    for reason in verdict["reasons"]:
        advice = f"; {reason['advice']}" if reason["advice"] else ""
        yield Seen("li", f"{reason['text']}{advice}")


def _each_material(job: Job, records: list[dict[str, Any]]) -> list[str]:
    """Return what the page calls each material, without its bunches.

    Where that has not the right thicknesses and bunches, what it should end with.
    """
    ends = [f", {record['thickness_mm']:g} mm" for record in records]
    tails = ["" if len(records) == 1 else _bunches(record) for record in records]
    said = material_of(job) or ""
    told = [said] if len(records) == 1 else said.split("; ")
    fits = len(told) == len(ends) and all(
        text.endswith(end + tail) for text, end, tail in zip(told, ends, tails, strict=True)
    )
    if not fits:
        return [f"…{end}" for end in ends]
    return [text.removesuffix(tail) for text, tail in zip(told, tails, strict=True)]


def _bunches(record: dict[str, Any]) -> str:
    """Return the bunches that a material is for, as sentences have them."""
    words = (name if name in ("warp", "weft") else f"bunch {name}" for name in record["bunches"])
    return f" ({', '.join(words)})"


def _sheets(job: Job, plan: CrossingMap, waste: dict[str, Any]) -> Iterator[Seen]:
    """Yield what all comes to, and the table of sheets."""
    totals, records = waste["totals"], waste.get("materials") or ()
    if records:
        tails = map(_bunches, records) if len(records) > 1 else [""]
        materials = map("".join, zip(_each_material(job, records), tails, strict=True))
        summary = (
            f"{counted(totals['pieces'], 'piece')} of {'; '.join(materials)}, on "
            f"{counted(totals['sheets'], 'sheet')}: {totals['utilisation']:.0%} of the material "
            f"is used, with {totals['cut_length_mm'] / 1000:.1f} m of cuts and "
            f"{totals['engrave_length_mm'] / 1000:.1f} m of engraving. "
            f"The finished object weighs {totals['mass_g']:.0f} g."
        )
        if totals["price"]:
            summary += f" The sheets cost {totals['price']:.2f}."
        yield Seen("p", summary)
    yield Seen("h2", "Sheets")
    yield from row(
        "Sheet", "Size, mm", "Pieces", "Pieces, cm²", "Holes, cm²", "Waste with holes, cm²",
        "Used", "", tag="th",
    )  # fmt: skip
    rows = {record["sheet"]: record for record in waste["sheets"]}
    for sheet in plan.sheets:
        size = f"{sheet.width_mm:g} × {sheet.height_mm:g} {sheet.stock}".rstrip()
        if len(records) > 1:
            size += f", {sheet.material} {sheet.thickness_mm:g}"
        yield from _sheet_row(sheet.name, size, rows[sheet.number])
    yield from _sheet_row("all", "", totals)


def _sheet_row(name: str, size: str, record: dict[str, Any]) -> Iterator[Seen]:
    """Yield a row of the table of sheets."""
    areas = (record[f"{what}_mm2"] / 100 for what in ("piece_area", "hole_area", "waste"))
    share = f"{100 * record['utilisation']:.1f}"
    cells = [f"{area:.1f}" for area in areas]
    yield from row(name, size, record["pieces"], *cells, f"{share} %", "")
    yield from bar(f"{share}%")


def _materials(records: list[dict[str, Any]], names: list[str]) -> Iterator[Seen]:
    """Yield the table of materials."""
    priced = any(record["price"] for record in records)
    yield Seen("h2", "Materials")
    yield from row(
        "Material", "Sheets", "Pieces", "Sheets, cm²", "Pieces, cm²", "Waste, cm²", "Used",
        "Mass, g", *["Price of sheets"] * priced, tag="th",
    )  # fmt: skip
    for record, name in zip(records, names, strict=True):
        areas = (record[f"{what}_mm2"] / 100 for what in ("area", "piece_area", "waste"))
        price = "unknown" if record["price"] is None else f"{record['price']:.2f}"
        yield from row(
            f"{name} ({', '.join(record['bunches'])})",
            record["sheets"],
            record["pieces"],
            *(f"{area:.1f}" for area in areas),
            f"{record['utilisation']:.1%}",
            f"{record['mass_g']:.1f}",
            *[price] * priced,
        )


def _comparison(told: dict[str, Any], totals: dict[str, Any]) -> Iterator[Seen]:
    """Yield the comparison with the best there could be, and with naive ways."""
    yield Seen("h2", "How well the material is used")
    yield Seen("p", "Share of whole sheets that becomes pieces; holes are waste in all of them.")
    yield from row("Way", "Sheets, m²", "Sheets", "Used", "", tag="th")
    area, sheets = totals["area_mm2"], totals["sheets"]
    ways = [
        ("this job", area, sheets, told["gross"]),
        ("this job, kept offcuts not counted", area - told["kept_mm2"], sheets, told["net"]),
        (
            "no layout could be better: pieces with half the gap around",
            None, told["bound_sheets"], told["best"],
        ),
    ]  # fmt: skip
    for name, key in (
        ("naive: the pieces' rectangles on shelves", "rectangles"),
        ("naive: whole threads, not cut, in their rectangles", "strips"),
    ):
        way, large = told[key], told[key]["too_large"]
        count = f"{counted(large, 'does', 'do')} not fit" if large else way["sheets"]
        ways.append((name, None, count, way["utilisation"]))
    for name, key in (
        ("nested roughly, across the grain as here", "across"),
        ("nested roughly, at any angle", "free"),
    ):
        if told.get("grain") is not None:
            way = told["grain"][key]
            ways.append((name, way["area_mm2"], way["sheets"], way["utilisation"]))
    for name, mm2, count, share in ways:
        used = "" if share is None else f"{share:.1%}"
        yield from row(name, "" if mm2 is None else f"{mm2 / 1e6:.2f}", count, used, "")
        if used:
            yield from bar(used)


def _offcuts(records: list[dict[str, Any]], names: dict[int, str]) -> Iterator[Seen]:
    """Yield what is worth keeping."""
    yield Seen("h2", "To keep")
    yield Seen(
        "p",
        "The largest rest of a sheet is kept if a square of 100 mm fits in it, or if it is at "
        "least 5% of the sheet and a square of 50 mm fits in it. Its edge is dashed in the notes "
        "of its sheet; its worth is its share of the sheet's price.",
    )
    yield from row(
        "Offcut", "Sheet", "Material, mm", "Largest rectangle, mm", "Area, cm²", "Worth", tag="th"
    )
    for record in records:
        (x, y), (right, top) = record["rectangle"]
        file, *cells = row(
            record["file"],
            names[record["sheet"]],
            f"{record['material']} {record['thickness_mm']:g}",
            f"{right - x:.0f} × {top - y:.0f}",
            f"{record['area_mm2'] / 100:.0f}",
            "unknown" if record["worth"] is None else f"{record['worth']:.2f}",
        )
        first, *others = cells
        yield from (file, first, Seen("a", record["file"]), *others)
    yield Seen(
        "p",
        f"In the next job, use --stock {STOCK}, and --sheet for what does not fit. Or copy entries "
        f"from {STOCK} to your own list, with the path from there to the drawings:",
    )
    yield Seen("a", STOCK)


def _check_entries(job: Job, page: tuple[Seen, ...], title: str, place: Place) -> None:
    """Check that the entries on the page are those of the list of stock, by their names."""
    stock = job.offcuts.stock if job.offcuts is not None else None
    entries = (stock or {}).get("offcut", [])
    for entry in entries:
        stem = str(entry.get("outline")).removesuffix(".dxf")
        place.at(STOCK).equal("the name of an offcut", entry.get("name"), f"{stem} of {title}")
    copied = [text for tag, text in page if tag == "pre"]
    place.against(STOCK).equal(
        "the list of entries to copy",
        [tomllib.loads(text).get("offcut") for text in copied],
        [entries] if entries else [],
    )


def _bill(waste: dict[str, Any]) -> Iterator[Seen]:
    """Yield what to buy; nothing if there is nothing."""
    rows: list[tuple[object, ...]] = [
        (
            f"Fasteners, {each['layers']} layers",
            f"hole {each['diameter_mm']:g} mm, grip {each['grip_mm']:g} mm",
            each["needed"], each["spare"], each["buy"],
        )
        for each in waste.get("fasteners", ())
    ]  # fmt: skip
    glue, tape = waste.get("glue"), waste.get("tape")
    if glue and glue["joints"]:
        rows.append(("Glue", f"{glue['area_mm2'] / 100:.1f} cm² of laps", glue["joints"], "", ""))
    if tape and tape["joints"]:
        rows.append(("Tape", f"{tape['length_mm'] / 1000:.2f} m", tape["joints"], "", ""))
    if rows:
        yield Seen("h2", "To buy")
        yield from row("What", "Size", "Needed", "Spare", "Buy", tag="th")
        for cells in rows:
            yield from row(*cells)
