"""Try one design: all of a job up to its pieces on their sheets, and what it comes to."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabweave import __version__
from fabweave.core.errors import FabweaveError
from fabweave.core.finding import Finding
from fabweave.core.messages import agree
from fabweave.core.records import optional, record
from fabweave.estimate.comparison import MOST_PIECES
from fabweave.estimate.costs import Costs
from fabweave.estimate.money import sheet_price
from fabweave.estimate.texts import hours_text
from fabweave.form.settle import STANDS
from fabweave.job.ask import brief_of, complete_settings, lay_asked, load_asked, settle_grain
from fabweave.job.letting_go import foretold
from fabweave.job.planned import PlannedJob, nest_job, plan_job, planned_costs
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.options.command import long_command
from fabweave.options.settings import Settings, settings_table
from fabweave.picture.camera import View
from fabweave.picture.contact_sheet import stacked
from fabweave.picture.object_picture import loss_legend, loss_tiles, png_bytes, weave_picture
from fabweave.piece.on_stock import rough_nesting
from fabweave.plan.grade import grade
from fabweave.plan.verdict import Verdict, excess, refused
from fabweave.ribbon.lay import WovenObject, stiffness_check
from fabweave.ribbon.rules.remedy import Depth
from fabweave.stock.material import Material
from fabweave.stock.supplies import Supplies

#: Pixels of a candidate's picture, and from where all are seen alike.
PICTURE_PX = (440, 360)
VIEW = View(-60.0, 22.0)
#: Below, what a remeshed model lost, from two sides.
LOSS_PX = (220, 180)
#: By the area of what is cut so few sheets are foretold to one, or any of so many small pieces.
_SURE_SHEETS, _SMALL_ON_SHEET = 4, 40
#: The excess of what is refused for another reason than a rule, as for ribbons that would burn.
_REFUSED = 1000.0


@record
class Candidate:
    """A design that was tried: how to make it, whether it can be built, and what it comes to.

    Parameters
    ----------
    key : str
        The digest of its settings and its mesh.
    name : str
        What sets it apart, for people.
    command : str
        What makes exactly this.
    verdict : Verdict
        Where it was refused before there were pieces, that is the reason, and there are no figures.
    figures : Figures or None
    excess : float or None
        By how much the worst rule passes what care makes up for (see
        :func:`fabweave.plan.verdict.excess`); None where no ribbons could be laid.
    """

    key: str
    name: str
    command: str
    verdict: Verdict
    figures: "Figures | None"
    excess: float | None = optional()

    @property
    def makeable(self) -> bool:
        """Whether it can be built, maybe with care."""
        return not self.verdict.stops

    @property
    def laid(self) -> bool:
        """Whether ribbons could be laid at all: none are where there is no mesh to lay them on."""
        return self.figures is not None or self.excess is not None


@record
class Figures:
    """What a design comes to.

    ``kinds`` counts the different pieces, and ``broken`` the conditions of its pattern that the
    weave breaks; ``sheets`` are foretold, and ``use`` is the share of them that becomes pieces,
    without their holes.
    ``likeness_mm`` and ``likeness_mean_mm`` say how far the mesh is from the model at the most
    and in the mean, where it was remeshed, and ``lost`` names features that went. ``form_mm``
    foretells how far it goes from its form when it is let go; what ``collapses`` goes farther than
    that; and ``grade`` tells how good it is before. ``hours`` are those of the assembly,
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
    collapses: bool | None = optional()
    hours: tuple[float, float] | None
    cutting_h: tuple[float, float] | None
    price: tuple[float, float] | None


@record
class Tried:
    """A candidate, and its picture as a PNG file; none where nothing could be laid."""

    candidate: Candidate
    picture: bytes | None


class Trial(NamedTuple):
    """What a design came to, and what its model was remeshed to, which others may share."""

    tried: Tried
    remeshed: Remeshed | None


def design_key(settings: Settings, mesh_digest: str) -> str:
    """Return the key of a design: that of another version, mesh or setting is another.

    Examples
    --------
    >>> one, two = Settings.of("shape:cube"), Settings.of("shape:cube", size_mm=200.0)
    >>> design_key(one, "") == design_key(one, ""), design_key(one, "") == design_key(two, "")
    (True, False)
    """
    told = json.dumps([__version__, mesh_digest, settings_table(settings)], sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def mesh_digest(mesh: str, given: PolyMesh | None = None) -> str:
    """Return a digest of what is woven: of a file's content, or of a mesh in memory."""
    if given is not None:
        parts = [given.vertices.tobytes(), given.offsets.tobytes(), given.indices.tobytes()]
        return hashlib.sha256(b"".join(parts)).hexdigest()
    path = Path(mesh)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else mesh


def try_design(
    settings: Settings,
    key: str,
    name: str,
    given: PolyMesh | None = None,
    remeshed: Remeshed | None = None,
) -> Trial:
    """Try a design.

    Its pieces are those that would be cut. How many sheets they take is foretold, as nesting would
    take half of the time; where the stock is limited they are nested, as it may not suffice.

    Parameters
    ----------
    settings : Settings
    key, name : str
        See :class:`Candidate`.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    remeshed : Remeshed, optional
        What the model is remeshed to, if that is known.

    Returns
    -------
    Trial
        The same for the same settings. What cannot be made is no error, but a verdict.
    """
    candidate = partial(Candidate, key=key, name=name, command=long_command(settings))
    loaded = laid = None
    try:
        complete, supplies = complete_settings(settings.but(force=True))
        loaded = load_asked(complete, given_mesh=given, remeshed=remeshed)
        laid = lay_asked(loaded, complete, supplies)
        planned = plan_job(laid, complete, supplies, depth=Depth.NEAR)
        verdict = replace(planned.verdict, forced=False)
        figures = figures_of(planned)
        if figures.collapses:
            verdict = fallen(verdict)
        if not verdict.stops and any(sheet.quantity is not None for sheet in supplies.sheets):
            nest_job(planned)
    except FabweaveError as error:
        far = None if laid is None else _stiffness(laid, complete, supplies)
        failed = candidate(verdict=refused(str(error)), figures=None, excess=far)
        remeshed = None if loaded is None else loaded.remeshed
        return Trial(Tried(candidate=failed, picture=None), remeshed)
    ribbons, colours = planned.woven.ribbons, planned.colours
    picture = weave_picture(ribbons, colours, size_px=PICTURE_PX, view=VIEW, floor=False)
    if loaded.loss is not None:
        tiles = loss_tiles(loaded.loss, VIEW, LOSS_PX)
        picture = stacked(picture, tiles, loss_legend(loaded.loss, tiles.width))
    far = round(excess(planned.check.findings), 4)
    found = candidate(verdict=verdict, figures=figures, excess=far)
    return Trial(Tried(candidate=found, picture=png_bytes(picture)), loaded.remeshed)


def fallen(verdict: Verdict) -> Verdict:
    """Return the verdict on a design that collapses when it is let go."""
    reason = Finding(
        rule="form",
        level="not makeable",
        text=f"let go, it goes farther from its form than {STANDS:.0%} of its size",
    )
    return replace(verdict, level="not makeable", reasons=(reason, *verdict.reasons))


def _stiffness(laid: WovenObject, settings: Settings, supplies: Supplies) -> float:
    """Return by how much too stiff the material of a refused object is, or that it is far off."""
    settings, supplies = settle_grain(laid, settings, supplies)
    check = stiffness_check(laid, settings.ribbons, supplies)
    return _REFUSED if check is None else round(excess(check.findings), 4)


def _rounded(span: tuple[float, float]) -> tuple[float, float]:
    """Return a range to two decimals."""
    return round(span[0], 2), round(span[1], 2)


def _sheets(planned: PlannedJob) -> tuple[int, float]:
    """Return how many sheets the pieces take, and their area.

    What is foretold of runs of threads is a sheet or two short where these are many, as pieces have
    laps, and large ones lie beside one another as they can: then they are nested roughly.
    """
    foretold, pieces = planned.split_plan.chosen, planned.piece_set.pieces
    most = min(_SMALL_ON_SHEET * foretold.sheets, MOST_PIECES)
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


def figures_of(planned: PlannedJob) -> Figures:
    """Return what a design comes to."""
    pieces, widths = planned.piece_set.pieces, planned.check.measured["width"].value
    area = sum(piece.net_area_mm2 for piece in pieces)
    sheets, sheets_mm2 = _sheets(planned)
    like = planned.woven.source.likeness
    costs = planned_costs(planned)
    machine, brief = costs.machine_s, brief_of(planned.settings, planned.supplies)
    form = foretold(planned.woven, brief, planned.piece_set)
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
        form_mm=None if form is None else form.far_mm,
        grade=grade(pieces, planned.verdict, like).score,
        collapses=True if form is not None and form.collapses else None,
        hours=_rounded(costs.assembly.hours),
        cutting_h=None if machine is None else _rounded((machine[0] / 3600.0, machine[1] / 3600.0)),
        price=_price(costs, sheets_mm2, planned.supplies.materials),
    )


def told_design(candidate: Candidate) -> str:
    """Return what a design came to, in a line."""
    figures = "" if candidate.figures is None else f": {words(candidate.figures)}"
    return f"{candidate.name}{figures}; {candidate.verdict.level}"


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
