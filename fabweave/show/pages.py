"""Make the web pages of a job: the one that opens it, and the report on its material.

What they look like and say stands in ``templates``; here are the values that they show.
"""

from collections.abc import Collection, Sequence
from functools import cache
from typing import Any, TypeAlias

from jinja2 import Environment, PackageLoader, StrictUndefined

from fabweave.core.arrays import FloatArray
from fabweave.core.messages import agree
from fabweave.estimate.costs import SideSheet
from fabweave.estimate.machine_time import MachineTime
from fabweave.estimate.money import price_text
from fabweave.estimate.texts import difficulty_text, hours_text, time_text
from fabweave.estimate.waste import WasteReport
from fabweave.nest.offcut import KEPT_SHARE, KEPT_SIDE_MM, KEPT_WIDTH_MM
from fabweave.piece.split.length_curve import splitting_reason
from fabweave.plan.allotment import Allotment
from fabweave.plan.bill_of_materials import SHOPPING, shopping_rows
from fabweave.plan.crossing_map import CrossingMap
from fabweave.plan.grade import Grade
from fabweave.plan.verdict import QUESTION, VERDICTS, Verdict
from fabweave.stock.machine import CURRENCY, Span
from fabweave.weave.pattern import exact_text

#: Where the page that opens a job stands in its folder.
INDEX_FILE = "index.html"
#: The picture of what a remeshed model lost.
LIKENESS = "likeness.png"
#: What patterns are called; a fabric has its own name.
_WEAVES = {
    "plain": "plain weave",
    "kagome": "kagome, plain weave in three directions",
    "twill": "2/2 twill",
    "triaxial": "triaxial twill",
    "twists": "edges twisted as they were given",
}
#: These are written when the page is there already.
_LATER = ("verify.json", "contents.json")
#: What is shown small beside its link.
_SHOWN = {LIKENESS: LIKENESS, "assembly.html": "render.png"}
_SECONDS_PER_HOUR = 3600.0
#: A row of a chart: what it says, and from where to where its bar goes, of 1 in all.
Bar: TypeAlias = tuple[str, float, float]


@cache
def _templates() -> Environment:
    """Return the templates, and what they may do to values: whatever is shown is escaped."""
    templates = Environment(
        loader=PackageLoader("fabweave.show"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {
        "f": format,
        "agree": agree,
        "cm2": lambda area_mm2: f"{area_mm2 / 100:.1f}",
        "time": time_text,
        "hours": hours_text,
        "price": price_text,
    }
    templates.tests["in_folder"] = str.startswith
    templates.globals |= {"question": QUESTION, "answers": VERDICTS}
    return templates


def render(template: str, **values: Any) -> str:
    """Return a page from its template, as HTML that loads nothing but the job's own pictures."""
    return _templates().get_template(template).render(values) + "\n"


def index_page(
    crossing_map: CrossingMap,
    report: WasteReport,
    *,
    title: str,
    verdict: Verdict,
    grade: Grade,
    form: str,
    material: str,
    size_mm: FloatArray,
    given_mesh: str | None,
    cut_names: Sequence[str],
    files: Collection[str],
) -> str:
    """Return the page that opens a job.

    Parameters
    ----------
    crossing_map : CrossingMap
        Its plan.
    report : WasteReport
        What becomes of its material.
    title, material : str
    verdict : Verdict
    grade : Grade
    form : str
        What becomes of it when it is let go; empty if that is not known.
    size_mm : (3,) float array
    given_mesh : str or None
        The file in which a mesh from memory is kept.
    cut_names : sequence of str
        The sheets for the cutter; none where the others are to be cut as they are.
    files : collection of str
        What is in its folder already.
    """
    broken = crossing_map.weave.broken
    return render(
        "index.html",
        title=title,
        verdict=verdict,
        grade=grade,
        form=form,
        material=material,
        size_mm=size_mm,
        given_mesh=given_mesh,
        plan=crossing_map,
        report=report,
        costs=report.estimate,
        cut_names=cut_names,
        there={*files, *_LATER},
        shown=_SHOWN,
        weaves=_WEAVES,
        broken=broken.total,
        exact=exact_text(crossing_map.weave.broken_at_turns or 0),
        kinds=len({piece.kind for piece in crossing_map.pieces}),
        charts=charts(report),
        shopping=SHOPPING,
        buy=shopping_rows(report.bill),
    )


def charts(report: WasteReport) -> list[tuple[str, list[Bar]]]:
    """Return what becomes of the sheets, how well that is, and what it takes, each as a chart."""
    told, costs = report.comparison, report.estimate
    kept = told.kept_mm2 / report.totals.sums.area_mm2
    ways = ("this job", told.gross), ("at the very best", told.best)
    hands = [_SECONDS_PER_HOUR * end for end in costs.assembly.hours]
    spans: tuple[tuple[str, Span | None], ...] = (
        ("cutting", costs.machine.cut_s),
        ("engraving", costs.machine.engrave_s),
        ("moves of the machine", costs.machine.travel_s),
        ("hands", (hands[0], hands[1])),
    )
    most = max(span[1] for _, span in spans if span is not None)
    return [
        (
            "What becomes of the sheets",
            [
                (f"pieces: {told.gross:.0%}", 0.0, told.gross),
                (f"offcuts worth keeping: {kept:.0%}", told.gross, told.gross + kept),
                (f"waste, holes too: {1.0 - told.gross - kept:.0%}", told.gross + kept, 1.0),
            ],
        ),
        (
            "How much could be pieces",
            [(f"{name}: {share:.0%}", 0.0, share) for name, share in ways],
        ),
        (
            "How long it takes",
            [
                (f"{name}: {time_text(span)}", low / most, high / most)
                for name, span in spans
                for low, high in [span or (0.0, 0.0)]
            ],
        ),
    ]


def waste_page(
    report: WasteReport,
    allotment: Allotment,
    *,
    title: str,
    verdict: Verdict,
    names: Sequence[str],
    entries: Sequence[str],
    remeshed: bool,
) -> str:
    """Return the report on a job's material, which opens from its folder.

    Parameters
    ----------
    report : WasteReport
    allotment : Allotment
    title : str
    verdict : Verdict
    names : sequence of str
        The sheets.
    entries : sequence of str
        What is worth keeping, as a list of stock has it.
    remeshed : bool
        Whether there is a picture of what the model lost.
    """
    costs, split = report.estimate, report.splitting
    return render(
        "waste.html",
        title=title,
        verdict=verdict,
        report=report,
        totals=report.totals,
        supplies=allotment.supplies,
        names=names,
        entries=entries,
        likeness=LIKENESS if remeshed else None,
        materials=_material_rows(report, allotment),
        machine=[
            *(
                (name, *_times(sheet.machine), price_text(sheet.price))
                for name, sheet in zip(names, costs.sheets, strict=True)
            ),
            *(
                (sheet.sheet, *_times(sheet.machine), price_text(sheet.price))
                for sheet in (*(report.rim or ()), *(report.former or ()))
            ),
        ],
        hands=[
            (
                action.words,
                action.count,
                f"{action.each_s:g} s",
                f"{action.count * action.each_s / 60:.0f} min",
            )
            for action in costs.assembly.actions
        ],
        difficulty=difficulty_text(costs),
        rim=_side_rows(report.rim or ()),
        former=_side_rows(report.former or ()),
        kept={"share": KEPT_SHARE, "side_mm": KEPT_SIDE_MM, "width_mm": KEPT_WIDTH_MM},
        shopping=SHOPPING,
        buy=shopping_rows(report.bill),
        reason=splitting_reason(split.chosen, split.prefer, len(split.choices)),
        currency=CURRENCY,
    )


def _times(machine: MachineTime) -> tuple[str, str, str]:
    """Return what cutting, engraving and moving take, in words."""
    return time_text(machine.cut_s), time_text(machine.engrave_s), time_text(machine.travel_s)


def _side_rows(sheets: Sequence[SideSheet]) -> list[tuple[object, ...]]:
    """Return what each sheet beside those of the pieces comes to."""
    return [
        (
            one.sheet,
            f"{one.width_mm:g} × {one.height_mm:g}, {one.material} {one.thickness_mm:g}",
            one.pieces,
            f"{one.piece_area_mm2 / 100:.1f}",
            *_times(one.machine),
            price_text(one.price),
        )
        for one in sheets
    ]


def _material_rows(report: WasteReport, allotment: Allotment) -> list[tuple[object, ...]]:
    """Return what each material comes to."""
    return [
        (
            f"{supply.description} ({', '.join(supply.bunches)})",
            account.sums.sheets,
            account.sums.pieces,
            f"{account.sums.area_mm2 / 100:.1f}",
            f"{account.sums.piece_area_mm2 / 100:.1f}",
            f"{account.sums.waste_mm2 / 100:.1f}",
            f"{account.sums.utilisation:.1%}",
            f"{account.mass_g:.1f}",
            "unknown" if account.sums.price is None else f"{account.sums.price:.2f}",
        )
        for account, supply in zip(report.materials, allotment.supplies.each, strict=True)
    ]
