"""Try one design: all of a job up to its pieces, and what it comes to."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.errors import FabweaveError, InputError
from fabweave.core.finding import Finding
from fabweave.core.records import to_json
from fabweave.estimate.texts import hours_text
from fabweave.form.settle import BOUND, STANDS
from fabweave.job.figures import Figures, figures_of, words
from fabweave.job.stations import Stations
from fabweave.mesh.given import GivenMesh
from fabweave.mesh.leave_out import LeaveOut, leave_out, parse_leave_out
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.one_rings import irregular_share
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.triangulate import plain_triangles
from fabweave.options.command import long_command
from fabweave.options.settings import Settings
from fabweave.picture.camera import choose_view
from fabweave.picture.contact_sheet import stacked
from fabweave.picture.object_picture import loss_legend, loss_tiles, png_bytes, weave_picture
from fabweave.plan.grade import BEST, grade
from fabweave.plan.verdict import Verdict, excess, judge, refused
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.broken_rule import FAR
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.weave.bunches import count_bodies

#: Pixels of a design's picture.
PICTURE_PX = (440, 360)
#: Below, what a remeshed model lost, from two sides.
LOSS_PX = (220, 180)
#: The excess of what is refused for another reason than a rule, as for ribbons that would burn.
_REFUSED = 1000.0
#: Faces are left out so often, and no more than this share of them, or so many.
_OPENINGS, _FEW_FACES, _LEAST_OPENING = 2, 0.06, 8
#: What is farther off in the mean, as a share of its size, is hardly the model, however well it is
#: built.
_POOR = 0.01
#: What is foretold to go farther than this share of what collapses is let go, to be sure.
_UNSURE = 0.25
#: A board costs as much as so many points of the grade: less gain is not worth it.
_BOARD = 1.0
#: Strips narrower than that, and more crossings, are not taken unasked: nobody begins with that.
_LEAST_MM, MOST_CROSSINGS = 5.0, 1000


@frozen_value
class Tried:
    """A design that was tried: whether it can be built, and what it comes to.

    Parameters
    ----------
    design : Settings
    name : str
        What sets it apart, for people.
    verdict : Verdict
        Where it was refused before there were pieces, that is the reason, and there are no figures.
    figures : Figures or None
    excess : float or None
        By how much the worst rule passes what care makes up for (see
        :func:`fabweave.plan.verdict.excess`); None where no ribbons could be laid.
    loaded : LoadedMesh or None
        The mesh; None where it could not be made.
    picture : bytes or None
        A PNG file; None where none was asked for, or nothing could be laid.
    """

    design: Settings
    name: str
    verdict: Verdict
    figures: Figures | None
    excess: float | None = None
    loaded: LoadedMesh | None = None
    picture: bytes | None = None

    @property
    def makeable(self) -> bool:
        """Whether it can be built, maybe with care."""
        return not self.verdict.stops

    @property
    def soft(self) -> bool:
        """Whether nothing stops it but that it does not stand by itself."""
        return {stop.rule for stop in self.verdict.stops} == {"form"}

    @property
    def passed_over(self) -> bool:
        """Whether no pieces were planned, as others were better already."""
        return {stop.rule for stop in self.verdict.stops} == {"grade"}

    @property
    def laid(self) -> bool:
        """Whether ribbons could be laid at all: none are where there is no mesh to lay them on."""
        return self.figures is not None or self.excess is not None

    @property
    def like(self) -> bool:
        """Whether it is like the model."""
        like = self.loaded.likeness if self.loaded is not None else None
        return like is None or like.loss <= _POOR

    @property
    def short(self) -> bool:
        """Whether limbs of the model are cut short."""
        like = self.loaded.likeness if self.loaded is not None else None
        return like is not None and bool(like.short)

    @property
    def daunting(self) -> bool:
        """Whether its strips are too narrow, or its crossings too many, to be taken unasked."""
        figures = self.figures
        return figures is not None and (
            figures.median_mm < _LEAST_MM or figures.crossings > MOST_CROSSINGS
        )

    @property
    def moves(self) -> float:
        """How far it is foretold to go when it is let go, as a share of its size."""
        if self.figures is None or self.figures.form_mm is None or self.loaded is None:
            return 0.0
        return self.figures.form_mm / float(np.ptp(self.loaded.mesh.vertices, axis=0).max())

    @property
    def unsure(self) -> bool:
        """Whether it is foretold to go so far that it may collapse, and to stand."""
        return not (self.soft or self.daunting) and self.moves > _UNSURE * STANDS

    @property
    def fallen(self) -> "Tried":
        """The same, once it is known to collapse when it is let go."""
        return replace(self, verdict=_fallen(self.verdict))

    @property
    def opened(self) -> float:
        """The share of its faces that are left out."""
        gone = len(parse_leave_out(self.design.mesh.leave_out).faces)
        return gone / max(gone + (0 if self.loaded is None else self.loaded.mesh.n_faces), 1)

    @property
    def brief(self) -> str:
        """What it came to, in few words, for whoever waits."""
        figures = self.figures
        if figures is None:
            return f"{self.name}: {self.verdict.headline}"
        hours = "" if figures.hours is None else f", {hours_text(figures.hours)}"
        tied = self.design.pieces.base == "on" and "--base" not in self.name
        # Typed by hand, it is asked for as well.
        name, on = (f"{self.name} --base on", " on a base") if tied else (self.name, "")
        return (
            f"{name}: {figures.pieces} pieces{on}, "
            f"strips of some {figures.median_mm:.0f} mm{hours}, "
            f"grade about {figures.grade or 0.0:.1f}; "
            f"{'does not stand by itself' if self.soft else self.verdict.level}"
        )

    @property
    def text(self) -> str:
        """What it came to, in a line."""
        figures = "" if self.figures is None else f": {words(self.figures)}"
        return f"{self.name}{figures}; {self.verdict.level}"

    def record(self) -> dict[str, Any]:
        """Return it as JSON takes it, with the command that makes it."""
        return {
            "name": self.name,
            "command": long_command(self.design),
            "verdict": to_json(self.verdict),
            "figures": None if self.figures is None else to_json(self.figures),
            "excess": self.excess,
        }


def try_design(
    design: Settings,
    name: str,
    given: PolyMesh | None = None,
    remeshed: Remeshed | None = None,
    given_mesh: GivenMesh | None = None,
    *,
    looks: bool = False,
    opens: bool = False,
    least: float = -np.inf,
) -> Tried:
    """Try a design, quickly.

    Its pieces are those that would be cut, but for the search of its pattern and of the layout. How
    many sheets they take is foretold; where the stock is limited they are nested, as it may not
    suffice. No pieces are planned of what cannot be built whatever they are.

    Parameters
    ----------
    design : Settings
    name : str
        See :class:`Tried`.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    remeshed : Remeshed, optional
        What the model is remeshed to, if that is known.
    given_mesh : GivenMesh, optional
        The model at its size, if that is known.
    looks : bool
        Whether its picture is wanted.
    opens : bool
        Whether faces may be left out where ribbons have no room, if it cannot be built for a few
        places alone: twice at most.
    least : float
        No pieces are planned of what is sure to come to a lower grade: a grade without its floor.

    Returns
    -------
    Tried
        The same for the same settings. What cannot be made is no error, but a verdict.
    """
    found = _try_once(design, name, given, remeshed, given_mesh, looks=looks, least=least)
    has_rims = _has_rims(found.tried.loaded)
    for _ in range(_OPENINGS if opens else 0):
        tried = found.tried
        loaded, left = tried.loaded, parse_leave_out(tried.design.mesh.leave_out)
        if not found.hopeless or loaded is None or left.diameters_mm or design.weave.triaxial:
            break
        # Faces are numbered as those of the whole mesh.
        whole = np.setdiff1d(np.arange(loaded.mesh.n_faces + len(left.faces)), left.faces)
        gone = sorted({*left.faces, *whole[list(found.hopeless)].tolist()})
        if len(gone) > max(_FEW_FACES * len(whole), _LEAST_OPENING):
            break
        opened = design.but(leave_out=",".join(map(str, gone)))
        further = _try_once(
            opened, name, given, loaded.remeshed, given_mesh, looks=looks, least=least
        )
        if further.tried.loaded is None or further.bodies > found.bodies:
            # It cannot be opened there, or a limb would fall off.
            break
        found = further
    return _based(found, looks=looks) if opens and has_rims else found.tried


def _has_rims(loaded: LoadedMesh | None) -> bool:
    """Tell whether a mesh is open, so that its feet may be tied to a base."""
    return loaded is not None and bool((loaded.halfedges.twin < 0).any())


def _based(found: "_Once", *, looks: bool) -> Tried:
    """Return a design on a base, where it falls without, or goes far and keeps much better with it.

    Else it is as it is. What is cut is the same, but for what ties its feet.
    """
    tried, job = found.tried, found.job
    figures = tried.figures
    if figures is None or not tried.design.pieces.may_be_based:
        return tried
    if not (tried.soft or tried.makeable):
        return tried
    if tried.makeable and tried.moves <= BOUND:
        return tried
    on_base = job.instead(job.asked.but(base="on")).know(drawn=job.drawn)
    held = _come_to(on_base, tried.design.but(base="on"), tried.name, looks=looks).tried
    if held.figures is None or not held.makeable:
        return tried
    gain = (figures.points_lost or 0.0) - (held.figures.points_lost or 0.0)
    return held if tried.soft or gain >= _BOARD else tried


class _Once(NamedTuple):
    """What a design comes to, its job, the faces without which it may be built, and its bodies."""

    tried: Tried
    job: Stations
    hopeless: tuple[int, ...] = ()
    bodies: int = 1


def _try_once(
    design: Settings,
    name: str,
    given: PolyMesh | None,
    remeshed: Remeshed | None,
    given_mesh: GivenMesh | None,
    *,
    looks: bool,
    least: float,
) -> _Once:
    """Try a design as it is."""
    job = Stations(design.but(effort="quick"), given, depth=Depth.NEAR, remeshed=remeshed)
    if given_mesh is not None:
        job.know(given_mesh=given_mesh)
    return _come_to(job, design, name, looks=looks, least=least)


def _come_to(
    job: Stations, design: Settings, name: str, *, looks: bool, least: float = -np.inf
) -> _Once:
    """Return what a job of a design comes to."""
    loaded, far, figures, picture = None, None, None, None
    try:
        loaded, woven = job.loaded, job.ribbons
        far = _REFUSED
        if job.foreseen:
            check = job.along
            verdict = judge(check.findings, narrowest_mm=np.inf)
        elif (sure := _at_best(loaded)) < least:
            check = job.along
            text = f"its grade would be {max(sure, 0.0):.1f} at best"
            reason = Finding(rule="grade", level="not makeable", text=text)
            verdict = Verdict(level="not makeable", reasons=(reason,))
        else:
            check, woven = job.check, job.joined.woven
            figures, verdict = figures_of(job), replace(job.planned.verdict, forced=False)
            if figures.collapses:
                verdict = _fallen(verdict)
            sheets = job.completed[1].sheets
            if not verdict.stops and any(one.quantity is not None for one in sheets):
                _ = job.layout
        far = round(excess(check.findings), 4)
        if looks and figures is not None:
            picture = _picture(job)
    except FabweaveError as error:
        verdict = refused(error.reason, cure=error.cure)
        return _Once(Tried(design, name, verdict, None, far, loaded), job)
    hopeless = _hopeless_faces(woven, check, verdict) if verdict.stops else ()
    bodies = count_bodies(woven.weave.threads)
    tried = Tried(design, name, verdict, figures, far, loaded, picture)
    return _Once(tried, job, hopeless, bodies)


def _at_best(loaded: LoadedMesh) -> float:
    """Return the grade that no pieces can better, by the mesh alone: without its floor."""
    nothing = Verdict(level="makeable", reasons=())
    known = grade([], nothing, loaded.likeness, irregular=irregular_share(loaded.mesh))
    return BEST - sum(one.points for one in known.lost)


def _picture(job: Stations) -> bytes:
    """Return the picture of a design, with what its model lost where it was remeshed."""
    planned, original = job.planned, job.loaded.original
    loss = None if original is None else original.loss()
    # All are seen alike: from where the model shows most.
    model = plain_triangles(job.loaded.mesh) if loss is None else (loss.points, loss.triangles)
    view = choose_view(*model)
    picture = weave_picture(
        planned.woven.ribbons, planned.colours, size_px=PICTURE_PX, view=view, floor=False
    )
    if loss is not None:
        tiles = loss_tiles(loss, view, LOSS_PX)
        picture = stacked(picture, tiles, loss_legend(loss, tiles.width))
    return png_bytes(picture)


def _fallen(verdict: Verdict) -> Verdict:
    """Return the verdict on a design that collapses when it is let go."""
    reason = Finding(
        rule="form",
        level="not makeable",
        text=f"let go, it goes farther from its form than {STANDS:.0%} of its size",
    )
    return replace(verdict, level="not makeable", reasons=(reason, *verdict.reasons))


def _hopeless_faces(woven: WovenObject, check: RibbonCheck, verdict: Verdict) -> tuple[int, ...]:
    """Return the faces around the places that are far from what the rules want that stop it."""
    threads, half = woven.weave.threads, woven.halfedges
    passes = [np.zeros(0, dtype=np.int64)]
    for rule in {stop.rule for stop in verdict.stops} & check.measured.keys():
        measured = check.measured[rule]
        far = measured.margins < FAR
        passes += [measured.passes[far], measured.others[far]]
    there = np.concatenate(passes)
    edges = threads.crossing_halfedge[np.unique(threads.crossing[there[there >= 0]])]
    ends = np.concatenate([half.tail[edges], half.head[edges]])
    twins = half.twin[edges]
    beside = half.face[np.concatenate([edges, twins[twins >= 0]])]
    # Without the faces beside these edges, or without all at their ends, if that is a surface.
    for faces in (beside, half.face[np.isin(half.tail, ends)]):
        gone = tuple(np.unique(faces).tolist())
        try:
            leave_out(woven.mesh, LeaveOut((), gone))
        except InputError:
            continue
        return gone
    return ()
