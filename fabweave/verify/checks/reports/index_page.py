"""Check that the page that opens a job shows its figures and leads to all its files."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from fabweave.verify.checks.reports.charts import charts_shown
from fabweave.verify.checks.reports.page import compare_pages, material_of, title_of, verdict_shown
from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.measure.words import counted, price_words, time_words
from fabweave.verify.read.index_page import INDEX, Index
from fabweave.verify.read.job_files import LIKENESS, MOST_VIEWED, Job, required
from fabweave.verify.read.qr_code import CODE
from fabweave.verify.read.waste_page import Seen, bar, spaced
from fabweave.verify.statement import Place, Tally

_WEAVES = {
    "plain": "plain weave",
    "kagome": "kagome, plain weave in three directions",
    "twill": "2/2 twill",
    "triaxial": "triaxial twill",
    "twists": "edges twisted as they were given",
}
_SIZE = re.compile(r"(\d+) × (\d+) × (\d+) mm")
#: Sizes are rounded to a millimetre; the mesh has more digits.
_SAME_MM = 0.501
_PORTRAIT, _VIEWER = "render.png", "assembly.html"
_MATERIAL = "3 Material"
#: What each file is, in the order in which they are needed, by headings.
_ENTRIES: dict[str, tuple[tuple[str, str], ...]] = {
    "2 Build": (
        ("assembly.pdf", "the manual, to print: parts, sheets, and every step"),
        (_VIEWER, "the viewer: the object in space, its pieces, sheets and steps"),
        ("pieces.csv", "each piece: sheet, size, kind, material"),
        (
            "stations.csv",
            "each piece, crossing by crossing: over or under, partner, joint, hole, step",
        ),
        ("crossing_map.csv", "each crossing: what lies over what"),
        ("crossing_map.json", "the whole plan, for programs"),
    ),
    _MATERIAL: (
        ("waste.html", "how full the sheets are, what to buy, times and costs, what to keep"),
        ("waste.json", "the same, for programs"),
    ),
    "4 Check": (
        ("preflight.json", "which rules of cutting the pieces break, and where"),
        ("ribbons.json", "widths, bends, creases and clearances, and what would mend them"),
        ("verdict.json", "whether it can be built, and why not"),
        (LIKENESS, "what of the model was lost where it was remeshed"),
        ("verify.json", "what was proved about these files"),
    ),
    "5 Again": (
        ("job.toml", "every setting: fabweave make --config job.toml -o again makes the same"),
        ("woven_mesh.obj", "the mesh that was woven"),
        ("model.glb", "the woven object, for programs that show 3-D models"),
        (_PORTRAIT, "its picture"),
        (CODE, "the command that makes it again, for the camera of a phone"),
        ("contents.json", "all these files with their SHA-256"),
    ),
}
_PICTURES = {_VIEWER: _PORTRAIT, LIKENESS: LIKENESS, CODE: CODE}


def check_index(job: Job, tally: Tally) -> None:
    """Check every text, link and picture of index.html; older jobs have none."""
    if job.index is None:
        return
    place = tally.at(INDEX).against("the job's files")
    seen = job.index.seen
    size = next((text for (_, name), (_, text) in pairwise(seen) if name == "Size"), "")
    _check_size(job, size, place)
    compare_pages(seen, map(spaced, _wanted(job, job.index, size)), place)


def _check_size(job: Job, said: str, place: Place) -> None:
    """Check the extents of the mesh."""
    match = _SIZE.fullmatch(said)
    extents = np.ptp(required(job.mesh).vertices, axis=0).tolist()
    good = match is not None and all(
        abs(float(one) - length) <= _SAME_MM
        for one, length in zip(match.groups(), extents, strict=True)
    )
    stated = " × ".join(f"{length:.1f}" for length in extents)
    place.expect(good, f"the size is said to be {said!r:.60}, but the mesh has {stated} mm")


def _wanted(job: Job, index: Index, size: str) -> Iterator[Seen]:
    """Yield what the page should show, in order."""
    plan, waste, title = required(job.map), required(job.waste), title_of(job)
    yield Seen("title", title)
    yield Seen("h1", title)
    yield from verdict_shown(required(job.verdict))
    yield from (Seen("p", ""), Seen("a", _PORTRAIT), Seen("img", _PORTRAIT))
    for name, text in (
        ("Weave", _weave(plan)),
        ("Size", size),
        ("Material", material_of(job) or "what waste.html says"),
    ):
        yield from (Seen("tr", ""), Seen("th", name), Seen("td", text))
    yield from (Seen("li", text) for text in _figures(plan, waste))
    yield Seen("h2", "1 Cut")
    yield from _cut(job, plan, waste, index.files)
    absent = _absent(job, plan, index)
    for heading, entries in _ENTRIES.items():
        yield Seen("h2", heading)
        if heading == _MATERIAL:
            yield from charts_shown(waste)
        for name, text in entries:
            if name not in absent:
                yield from _entry(name, text)
            if name == "job.toml" and (mesh := _given_mesh(job, index)):
                yield from _entry(mesh, "the mesh as it was given")


def _absent(job: Job, plan: CrossingMap, index: Index) -> set[str]:
    """Return the files that this job does well without; that others are there, is seen to."""
    absent = set()
    outcome = (job.settings or {}).get("outcome")
    if not isinstance(outcome, dict) or "likeness_mm" not in outcome:
        absent.add(LIKENESS)
    if job.options.get("qr", "none") == "none":
        absent.add(CODE)
    if len(plan.crossings) > MOST_VIEWED and _VIEWER not in index.files:
        absent.add(_VIEWER)
    return absent


def _weave(plan: CrossingMap) -> str:
    """Return the pattern in words, and whether it holds everywhere."""
    name, broken = _WEAVES.get(plan.pattern, plan.pattern), sum(plan.broken)
    if plan.exact:
        return f"{name}, exact"
    return f"{name}; {broken} of its conditions {'is' if broken == 1 else 'are'} broken"


def _figures(plan: CrossingMap, waste: dict[str, Any]) -> Iterator[str]:
    """Yield the figures, each with what it counts or measures."""
    estimate, used = waste["estimate"], waste["totals"]["utilisation"]
    kinds = counted(len({piece.kind for piece in plan.pieces}), "kind")
    yield counted(len(plan.threads), "thread")
    yield counted(len(plan.crossings), "crossing")
    yield f"{counted(len(plan.pieces), 'piece')} of {kinds}"
    if plan.spare_of:
        yield counted(len(plan.spare_of), "spare")
    yield counted(len(plan.joints), "joint")
    yield f"{counted(len(plan.sheets), 'sheet')}, {used:.0%} used"
    yield f"{time_words(estimate['machine_s'])} of the machine"
    hours = time_words([3600.0 * end for end in estimate["assembly"]["hours"]])
    yield f"{hours} of hands, {estimate['difficulty']['word']}"
    rent = "" if estimate["machine_price"] is None else ", and the machine"
    yield f"{price_words(estimate['price'])} for sheets and hardware{rent}"


def _cut(
    job: Job, plan: CrossingMap, waste: dict[str, Any], files: frozenset[str]
) -> Iterator[Seen]:
    """Yield what goes to the machine."""
    if job.ready is None:
        yield Seen("p", "DXF and SVG hold the same lines: take the one that your machine likes.")
    else:
        yield Seen(
            "p",
            "Cut the files that allow for the kerf or have bridges; the nominal ones are the plan.",
        )
    used = {record["sheet"]: record["utilisation"] for record in waste["sheets"]}
    for sheet in plan.sheets:
        yield from _sheet(job, sheet, f"{100 * used[sheet.number]:.1f}%", plan)
    for heading, folder in (
        (
            "For a service: each kind of piece in a file of its own, and how many to order.",
            "service/",
        ),
        ("The ring around each opening, to cut as well; rim.txt says how it is laid.", "rim/"),
        ("The QR code as a tag, to engrave on an offcut and to cut from it.", "tag/"),
        (
            "What is left and worth keeping, and a list of it for the --stock of a later job.",
            "offcuts/",
        ),
    ):
        names = sorted(name for name in files if name.startswith(folder))
        if names:
            yield Seen("p", heading)
            for name in names:
                yield from (Seen("li", name.removeprefix(folder)), Seen("a", name))


def _sheet(job: Job, sheet: Sheet, share: str, plan: CrossingMap) -> Iterator[Seen]:
    """Yield a sheet: its picture, how full it is, and its drawings."""
    picture, cuts = f"sheets/{sheet.name}.png", ("dxf", "svg")
    nominal = cuts if job.templates is None else (*cuts, "pdf")
    links = [[f"sheets/{sheet.name}.{kind}" for kind in nominal]]
    words = ["to cut:"]
    if job.ready is not None:
        links.insert(0, [f"cut/{job.ready.name_of(sheet.name)}.{kind}" for kind in cuts])
        words.append(" nominal:")
    told = "".join(
        f"{word} {' '.join(name.rpartition('.')[2].upper() for name in names)}"
        for word, names in zip(words, links, strict=True)
    )
    pieces = counted(len(plan.on_sheet(sheet.number)), "piece")
    yield Seen("li", f"{sheet.name} {pieces}, {share} used {told}")
    yield from (Seen("a", picture), Seen("img", picture), *bar(share))
    yield from (Seen("a", name) for names in links for name in names)


def _entry(name: str, text: str) -> Iterator[Seen]:
    """Yield a link with what the file is."""
    yield Seen("li", f"{name} {text}")
    yield Seen("a", name)
    if name in _PICTURES:
        yield Seen("img", _PICTURES[name])


def _given_mesh(job: Job, index: Index) -> str:
    """Return the name of the mesh that the job was made from, if the job has it; else nothing.

    Somebody may have put one of that name there since.
    """
    mesh = str(job.options.get("mesh", ""))
    return mesh if mesh in index.files and mesh in (index.listed or index.files) else ""
