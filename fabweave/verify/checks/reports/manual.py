"""Check that the manual says what the crossing map says: its pieces, sheets, steps and stations."""

from collections.abc import Sequence

from fabweave.verify.checks.reports.manual_cover import check_cover, check_legend
from fabweave.verify.checks.reports.manual_drawings import check_parts, check_sheets
from fabweave.verify.checks.reports.manual_steps import OVER, UNDER, check_steps
from fabweave.verify.checks.reports.page import title_of
from fabweave.verify.crossing_map import CrossingMap, Piece, Thread
from fabweave.verify.measure.words import PAPERS_MM, counted
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.manual import ManualPage
from fabweave.verify.running_text import RunningText, printed
from fabweave.verify.statement import Place, Tally

SECTIONS = (
    "Overview", "How to read a piece", "Threads and their pieces", "Parts list", "Sheets", "Steps",
    "What each piece meets",
)  # fmt: skip
#: What stands above the cells of a station.
_HEADS = ("st.", "crossing", "mm", "passes", "joint", "step")
#: Sizes of paper are told in hundredths of points.
_PAPER_MM = 0.1
#: Distances are rounded to a tenth.
_SAME_MM = 0.0501
MAP = (
    "Each thread is drawn as a band in the colours that it has on the cover. Above the band "
    "are its pieces, with a line at each joint (#) between them; below it are the numbers of its "
    "crossings, with a disc • where the thread goes over and a ring o where it goes under, the "
    "strand drawn across it. A closed thread ends with the joint at which it begins."
)
TABLES = (
    "For each piece, along its arrow: a disc before each piece that it lies over, a ring before "
    "each that it runs under, and at its ends the joint and the piece that is joined there. The "
    "number after its name is the step in which it is placed."
)


def check_manual(job: Job, tally: Tally) -> None:
    """Check every text of assembly.pdf, and the drawings of pieces and sheets."""
    pages, plan = required(job.manual), required(job.map)
    place = tally.at("assembly.pdf").against("crossing_map.json")
    if (paper := job.options.get("paper")) is not None:
        _check_paper(pages, paper, place.against("job.toml"))
    sections = _sections(pages, printed(title_of(job)), place)
    place.equal("the row of sections", list(sections), list(SECTIONS))
    parts = [sections.get(name, []) for name in SECTIONS]
    cover, legend, threads, pieces, sheets, steps, tables = parts
    check_cover(job, plan, _running(cover, place.at("cover")))
    check_legend(plan, _running(legend, place.at("legend")))
    _check_map(plan, _running(threads, place.at("map")), place)
    check_parts(plan, pieces, place.at("parts list"))
    check_sheets(plan, sheets, place)
    check_steps(plan, _running(steps, place.at("steps")))
    _check_tables(plan, _running(tables, place.at("tables")))


def _check_paper(pages: Sequence[ManualPage], paper: object, place: Place) -> None:
    """Check that all pages have the size of the paper that was asked for."""
    size = PAPERS_MM.get(str(paper))
    if not place.expect(size is not None, f"there is no paper {paper!r}") or size is None:
        return
    for number, page in enumerate(pages, start=1):
        off = max(abs(one * 25.4 / 72.0 - mm) for one, mm in zip(page.size, size, strict=True))
        place.expect(off < _PAPER_MM, f"page {number} is not of {paper} paper")


def _sections(pages: Sequence[ManualPage], title: str, place: Place) -> dict[str, list[ManualPage]]:
    """Return the pages of each section, without their heads, which are checked."""
    sections: dict[str, list[ManualPage]] = {}
    for number, page in enumerate(pages, start=1):
        head = page.texts[1] if len(page.texts) > 1 else ""
        place.equal(f"the head of page {number}", head, f"{title}, page {number}")
        # A section that is begun again is another one.
        name = page.texts[0] if page.texts else ""
        last = next(reversed(sections), "")
        key = name if name == last or name not in sections else f"{name}, again"
        sections.setdefault(key, []).append(ManualPage(page.texts[2:], page.figures))
    return sections


def _running(pages: Sequence[ManualPage], place: Place) -> RunningText:
    """Return the texts of some pages as one."""
    return RunningText([text for page in pages for text in page.texts], place)


def _check_map(plan: CrossingMap, text: RunningText, place: Place) -> None:
    """Require that the map shows each thread's pieces, joints and crossings in order."""
    text.block(MAP)
    for thread in plan.threads:
        text.block(f"Thread {thread.label}")
        text.block(
            f"{'ring' if thread.closed else 'open'}, {counted(len(thread.pieces), 'piece')}, "
            f"{counted(len(set(thread.crossings)), 'crossing')}"
        )
        pieces, crossings, joints = set(thread.pieces), *_along(plan, thread)
        cells = text.some_of({*pieces, *crossings, *joints})
        if text.lost:
            return
        here = place.at(f"map of thread {thread.label}")
        # Where a row ends within a piece, it is named in both.
        named = list(dict.fromkeys(cell for cell in cells if cell in pieces))
        here.equal("the row of pieces", named, list(thread.pieces))
        for name, wanted in (("crossings, over or under,", crossings), ("joints", joints)):
            known = set(wanted)
            row = [cell for cell in cells if cell in known]
            here.equal(f"the row of {name}", row, wanted)
    text.end()


def _along(plan: CrossingMap, thread: Thread) -> tuple[list[str], list[str]]:
    """Return the crossings and the joints of a thread as the map of threads has them."""
    crossings: list[str] = []
    joints: list[str] = []
    for number, key in enumerate(thread.pieces):
        piece = plan.piece[key]
        ways = [f"{station.crossing} {'•' if station.over else 'o'}" for station in piece.stations]
        shared = number > 0 and piece.joints[0] is not None
        crossings += ways[1:] if shared else ways
        joints += [f"#{key}" for key in piece.joints[shared:] if key is not None]
    return crossings, joints


def _check_tables(plan: CrossingMap, text: RunningText) -> None:
    """Require that each piece has all that it meets, station by station, and its joints."""
    text.block(TABLES)
    steps = {key: step.step for step in plan.steps for key in step.pieces}
    for piece in plan.pieces:
        text.block(f"{piece.id} ({steps.get(piece.id)})")
        ends = [
            () if key is None else (f"#{key}>{_mate(plan, piece, key)}",) for key in piece.joints
        ]
        for word in ends[0]:
            text.block(word)
        for station in piece.stations:
            sign = OVER if station.over else UNDER
            text.match(sign, sign)
            text.block(station.partner)
        for word in ends[1]:
            text.block(word)
        if text.lost:
            return
    text.end()


def _mate(plan: CrossingMap, piece: Piece, joint: int) -> str:
    """Return whom a piece is joined to, which may be itself."""
    pieces = plan.joint[joint].pieces
    return next((name for name in pieces if name != piece.id), piece.id)
