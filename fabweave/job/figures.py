"""What a job comes to whose pieces are planned: the figures that everybody tells."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.messages import agree
from fabweave.core.records import optional, record
from fabweave.estimate.costs import Costs
from fabweave.estimate.money import sheet_price
from fabweave.estimate.texts import hours_text
from fabweave.form.settle import BOUND, STANDS
from fabweave.job.planned import PlannedJob
from fabweave.job.stations import Stations
from fabweave.mesh.one_rings import irregular_share
from fabweave.piece.stock_fit import rough_nesting
from fabweave.plan.grade import Grade, grade
from fabweave.stock.material import Material

#: By the area of what is cut so few sheets are foretold to one, or any of so many small pieces.
_SURE_SHEETS, _SMALL_ON_SHEET = 4, 40
#: More pieces are not nested only to foretell their sheets.
_MOST_PIECES = 500


@record
class Figures:
    """What a design comes to.

    ``kinds`` counts the different pieces, and ``broken`` the conditions of its pattern that the
    weave breaks; ``sheets`` are foretold, and ``use`` is the share of them that becomes pieces,
    without their holes.
    ``likeness_mm`` and ``likeness_mean_mm`` say how far the mesh is from the model at the most
    and in the mean, where it was remeshed, and ``lost`` names features that went. ``form_mm``
    foretells how far it is out of its form in the end; what ``collapses`` goes farther than
    that; and ``grade`` is foretold from all of that: ``points_lost`` were taken, maybe more than
    there are of what is worst. ``hours`` are those of the assembly,
    ``cutting_h`` those of the machine, ``price`` that of sheets and hardware: each a range, None
    where it is not known.
    """

    faces: int
    threads: int
    crossings: int
    broken: int
    pieces: int
    kinds: int | None = optional()
    joints: int
    sheets: int
    use: float
    narrowest_mm: float
    median_mm: float
    widest_mm: float
    longest_mm: float
    likeness_mm: float | None
    likeness_mean_mm: float | None
    lost: tuple[str, ...]
    form_mm: float | None = optional()
    grade: float | None = optional()
    points_lost: float | None = optional()
    collapses: bool | None = optional()
    hours: tuple[float, float] | None
    cutting_h: tuple[float, float] | None
    price: tuple[float, float] | None


def figures_of(stations: Stations) -> Figures:
    """Return what a job comes to whose pieces are planned; sheets and form are foretold."""
    planned, costs = stations.planned, stations.costs
    pieces, widths = planned.piece_set.pieces, planned.check.measured["width"].value
    area = sum(piece.net_area_mm2 for piece in pieces)
    sheets, sheets_mm2 = _sheets(planned)
    like = planned.woven.source.likeness
    machine, form = costs.machine_s, stations.foretold
    most_mm = STANDS * planned.woven.size_mm
    collapses = form is not None and form.most_mm > most_mm
    found = foretold_grade(stations)
    return Figures(
        faces=planned.woven.mesh.n_faces,
        threads=planned.weave.threads.n_threads,
        crossings=planned.weave.threads.n_crossings,
        broken=planned.weave.broken.total,
        pieces=len(pieces),
        kinds=planned.piece_set.kinds.count,
        joints=len(planned.piece_set.joints),
        sheets=sheets,
        use=round(area / sheets_mm2, 4),
        narrowest_mm=round(float(widths.min()), 2),
        median_mm=round(float(np.median(widths)), 2),
        widest_mm=round(float(widths.max()), 2),
        longest_mm=round(max(float(np.ptp(piece.outline[:, 0])) for piece in pieces), 1),
        likeness_mm=None if like is None else round(like.greatest_mm, 2),
        likeness_mean_mm=None if like is None else round(max(like.in_mean_mm, like.out_mean_mm), 3),
        lost=() if like is None else tuple(feature.text for feature in like.lost[:3]),
        form_mm=None if form is None else round(min(form.off_mm, most_mm), 2),
        grade=found.score,
        points_lost=round(sum(one.points for one in found.lost), 2),
        collapses=collapses or None,
        hours=_rounded(costs.assembly.hours),
        cutting_h=None if machine is None else _rounded((machine[0] / 3600.0, machine[1] / 3600.0)),
        price=_price(costs, sheets_mm2, planned.supplies.materials),
    )


def foretold_grade(stations: Stations) -> Grade:
    """Return the grade that a job whose pieces are planned is to have, with what takes from it."""
    planned, form = stations.planned, stations.foretold
    woven_mm, far = planned.woven.size_mm, None
    if form is not None:
        settles_mm = form.settles_mm if form.left_mm is None else form.left_mm
        far = settles_mm / (BOUND * woven_mm), form.sags_mm / woven_mm
    return grade(
        planned.piece_set.pieces, planned.verdict, planned.woven.source.likeness, foretold=far,
        irregular=irregular_share(planned.woven.mesh),
    )  # fmt: skip


def _rounded(span: tuple[float, float]) -> tuple[float, float]:
    """Return a range to two decimals."""
    return round(span[0], 2), round(span[1], 2)


def _sheets(planned: PlannedJob) -> tuple[int, float]:
    """Return how many sheets the pieces take, and their area.

    What is foretold of runs of threads is a sheet or two short where these are many, as pieces have
    laps, and large ones lie beside one another as they can: then they are nested roughly.
    """
    foretold, pieces = planned.split_plan.chosen, planned.piece_set.pieces
    most = min(_SMALL_ON_SHEET * foretold.sheets, _MOST_PIECES)
    if foretold.sheets < _SURE_SHEETS or len(pieces) > most:
        return foretold.sheets, foretold.sheets_mm2
    of_thread = planned.supplies.of(planned.woven.bunches)
    needed = rough_nesting(planned.supplies)(
        [piece.outline for piece in pieces],
        np.array([of_thread[piece.thread] for piece in pieces], dtype=np.int64),
    )
    if needed is None:
        return foretold.sheets, foretold.sheets_mm2
    return needed.count, needed.area_mm2


def _price(
    costs: Costs, sheets_mm2: float, materials: Sequence[Material]
) -> tuple[float, float] | None:
    """Return what sheets and the rest cost: at worst, each sheet that is begun is paid."""
    if costs.price is None or costs.sheet_price is None:
        return None
    whole = [sheet_price(sheets_mm2, material) for material in materials]
    dearest = max((price.high for price in whole if price is not None), default=0.0)
    more = max(dearest - costs.sheet_price.high, 0.0)
    return _rounded((costs.price.low, costs.price.high + more))


def words(figures: Figures) -> str:
    """Return what a design comes to, in a few words."""
    text = (
        f"{figures.pieces} pieces, ribbons {figures.narrowest_mm:.1f} to {figures.widest_mm:.0f} "
        f"mm wide (mostly {figures.median_mm:.0f}), about "
        f"{agree(figures.sheets, '{n} sheet[|s]')}"
    )
    if figures.hours is not None:
        text += f", {hours_text(figures.hours)} of assembly"
    if figures.likeness_mm is not None:
        text += f", at most {figures.likeness_mm:.0f} mm off the model"
    if figures.collapses:
        text += ", collapses when it is let go"
    elif figures.form_mm is not None:
        text += f", {figures.form_mm:.0f} mm out of form when it is let go"
    if figures.lost:
        text += f" ({'; '.join(figures.lost)})"
    return text
