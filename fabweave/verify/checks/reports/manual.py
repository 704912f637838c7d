"""Check that the manual says what the crossing map says: its pieces, sheets, steps and stations."""

from collections.abc import Sequence

from fabweave.verify.checks.reports.manual_cover import check_cover, check_legend
from fabweave.verify.checks.reports.manual_drawings import check_parts, check_sheets
from fabweave.verify.checks.reports.manual_steps import OVER, UNDER, check_steps
from fabweave.verify.checks.reports.page import title_of
from fabweave.verify.crossing_map import CrossingMap, Thread
from fabweave.verify.measure.words import PAPERS_MM, counted
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.manual import ManualPage
from fabweave.verify.running_text import RunningText, printed
from fabweave.verify.statement import Place, Tally

SECTIONS = (
    "Overview", "How to read a piece", "Threads and their pieces", "Parts list", "Sheets", "Steps",
)  # fmt: skip
#: Sizes of paper are told in hundredths of points.
_PAPER_MM = 0.1
MAP = (
    "Each thread is drawn as a band in the colours that it has on the cover. Above the band "
    "are its pieces, with a line at each joint (#) between them; below it are the pieces that "
    "cross it, each strand drawn, with a disc where the thread goes over and a ring where it "
    "goes under, as on the pieces. A closed thread ends with the joint at which it began. Beside "
    "the name of the thread is the step in which each piece is placed."
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
    cover, legend, threads, pieces, sheets, steps = parts
    check_cover(job, plan, _running(cover, place.at("cover")))
    check_legend(plan, _running(legend, place.at("legend")))
    _check_map(plan, _running(threads, place.at("map")), place)
    check_parts(plan, pieces, place.at("parts list"))
    check_sheets(plan, sheets, place)
    check_steps(plan, _running(steps, place.at("steps")))


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
        place.equal(f"the head of page {number}", head, f"{title}, page {number} / {len(pages)}")
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
    """Require that the map shows each thread's pieces, joints and who crosses it, in order."""
    text.block(MAP)
    names = {piece.id for piece in plan.pieces}
    steps = {key: step.step for step in plan.steps for key in step.pieces}
    for thread in plan.threads:
        text.block(f"Thread {thread.label}")
        placed = ", ".join(f"{key} {steps.get(key)}" for key in thread.pieces)
        text.block(
            f"{'ring' if thread.closed else 'open'}, {counted(len(thread.pieces), 'piece')}, "
            f"{counted(len(set(thread.crossings)), 'crossing')}; steps: {placed}"
        )
        crossings, joints = _along(plan, thread)
        cells = text.some_of({*names, *joints, OVER, UNDER})
        if text.lost:
            return
        here = place.at(f"map of thread {thread.label}")
        signed = [at for at, cell in enumerate(cells) if cell in (OVER, UNDER)]
        partners = {at + 1 for at in signed}
        # Where a row ends within a piece, it is named in both.
        named = list(
            dict.fromkeys(
                cell for at, cell in enumerate(cells) if cell in names and at not in partners
            )
        )
        here.equal("the row of pieces", named, list(thread.pieces))
        row = [" ".join(cells[at : at + 2]) for at in signed]
        here.equal("the row of what it meets, over or under,", row, crossings)
        known = set(joints)
        here.equal("the row of joints", [cell for cell in cells if cell in known], joints)
    text.end()


def _along(plan: CrossingMap, thread: Thread) -> tuple[list[str], list[str]]:
    """Return whom a thread meets and its joints, as the map of threads has them."""
    crossings: list[str] = []
    joints: list[str] = []
    for number, key in enumerate(thread.pieces):
        piece = plan.piece[key]
        ways = [
            f"{OVER if station.over else UNDER} {station.partner}" for station in piece.stations
        ]
        shared = number > 0 and piece.joints[0] is not None
        crossings += ways[1:] if shared else ways
        joints += [f"#{key}" for key in piece.joints[shared:] if key is not None]
    return crossings, joints
