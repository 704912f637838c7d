"""The job: what is asked for, and its stations, each made when it is first asked for.

Settings → LoadedMesh → WovenMesh → WovenObject → JoinedObject → PieceSet → PlannedJob → Layout
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel.executors import Executors, here
from fabweave.estimate.costs import Costs, pieces_costs
from fabweave.form.compensate import Begun, compensated, foretell_end
from fabweave.form.hold import Foretold, form_hold
from fabweave.form.straight import straightened
from fabweave.job.ask import brief_of, complete_settings, ends_at_rims, load_asked
from fabweave.job.planned import PlannedJob
from fabweave.mesh.given import GivenMesh, give_mesh
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.settings import MeshSettings
from fabweave.nest.layout import Layout
from fabweave.options.settings import Settings, settings_from_options, settings_table
from fabweave.piece.brief import Brief
from fabweave.piece.congruence import spared
from fabweave.piece.grain import chosen_grain, with_grain
from fabweave.piece.joined_object import JoinedObject, check_joined, split_object
from fabweave.piece.pieces import PieceSet, joined_pieces
from fabweave.plan.colours import woven_colours
from fabweave.plan.nest_pieces import nest_pieces
from fabweave.plan.verdict import NotMakeableError, excess
from fabweave.ribbon.lay import WovenObject, keep_clear, lay_object
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.ribbon.rules.remedy import FEW, Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.supplies import Supplies
from fabweave.weave.weave_mesh import WovenMesh, weave_mesh

#: The refinements that are tried, one after the other: they round the shape, and divide every face.
REFINEMENTS = ("catmull-clark:1", "catmull-clark:2")
#: Each is tried if it comes to so many crossings at most, where every step makes four of one; and
#: in plain weave, which needs no search.
MOST_CROSSINGS = 2000
#: What comes of coarse faces: between them ribbons turn sharply.
_COARSE = frozenset(("bend", "twist", "crease", "clearance"))
#: Where there are so many kinds of pieces, one more is none.
_MANY_KINDS = 50
#: Rules that depend neither on joints nor on how much narrower ribbons get: where ribbons as wide
#: as asked break them, no plan of pieces helps.
_FORESEEN = {"width", "bend"}

#: What is asked of the mesh that is woven, not of the one that is given.
_MADE: dict[str, Any] = {
    "remesh": None, "refine": None, "symmetrise": False, "fair": None, "leave_out": None,
    "rim": "none",
}  # fmt: skip


def given_by(settings: Settings) -> MeshSettings:
    """Return what the mesh that is given depends on: the rest is as it is by default."""
    return replace(settings.mesh, **_MADE)


def remeshed_by(settings: Settings) -> tuple[MeshSettings, int]:
    """Return what a remeshed mesh depends on: the given one, to what it is remeshed, and a seed."""
    return replace(given_by(settings), remesh=settings.mesh.remesh), settings.search.seed


def views(settings: Settings) -> list[tuple[tuple[Any, ...], tuple[str, ...]]]:
    """Return what stations depend on beside what those before them do, and which these are."""
    mesh, weave, stock, search = settings.mesh, settings.weave, settings.stock, settings.search
    material = stock.material, stock.library, stock.thickness_mm
    seed = search.seed if mesh.remeshed else None
    # A mesh is faired for what its ribbons are cut from.
    faired_for = material if mesh.faired else None
    return [
        ((given_by(settings),), ("given_mesh",)),
        ((mesh, weave.course, weave.triaxial, seed, faired_for), ("loaded",)),
        (
            (weave, ends_at_rims(settings), search if weave.pattern == "twill" else None),
            ("weave",),
        ),
        ((settings.ribbons, *material), ("ribbons", "along", "clear_ribbons")),
        ((settings.pieces, stock), ("drawn", "_made", "check", "foretold")),
        ((search,), ("layout",)),
    ]


class Stations:
    """The stations of a job.

    Parameters
    ----------
    asked : Settings
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    depth : Depth
        How closely things are worked out: what is to be made is looked at as closely as may be;
        what is only foretold, as of designs that are tried, less so.
    remeshed : Remeshed, optional
        What the model is remeshed to, if that is known.
    recorded : Path, optional
        The crossing map of this very job: pieces lie as it says, and are not nested.
    progress : callable
        Told what is being done.
    executors : callable
        Opens the executor that nests; the result is the same with any.
    options : mapping
        The options that the settings were read from, if they were; see :meth:`also`.
    """

    def __init__(
        self,
        asked: Settings,
        given: PolyMesh | None = None,
        *,
        depth: Depth = Depth.SEARCHED,
        remeshed: Remeshed | None = None,
        recorded: Path | None = None,
        progress: Progress = no_progress,
        executors: Executors = here,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self.asked, self.given, self.depth = asked, given, depth
        self.progress, self.executors, self.options = progress, executors, dict(options or {})
        self._remeshed, self._recorded = remeshed, recorded

    @classmethod
    def read(
        cls, mesh: str, options: Mapping[str, Any], given: PolyMesh | None = None
    ) -> "Stations":
        """Return the stations of a mesh and options of the command line, ``-`` written ``_``."""
        return cls(settings_from_options(mesh, **options), given, options=options)

    def also(self, options: Mapping[str, Any]) -> "Stations":
        """Return the stations with more options, of which later ones win: what they leave stays."""
        more = {**self.options, **options}
        return self.instead(settings_from_options(self.asked.mesh.source, **more), more)

    def instead(self, asked: Settings, options: Mapping[str, Any] | None = None) -> "Stations":
        """Return the stations of other settings: what these leave as it was stays."""
        if options is None:
            was = settings_table(self.asked)
            options = self.options | {
                name.replace("-", "_"): value
                for name, value in settings_table(asked).items()
                if was.get(name) != value
            }
        other = Stations(
            asked, self.given, depth=self.depth, progress=self.progress,
            executors=self.executors, options=options, remeshed=self._remeshed_as(asked),
        )  # fmt: skip
        for (before, names), (now, _) in zip(views(self.asked), views(asked), strict=True):
            if before != now:
                break
            other.know(**self._made_of(names))
        return other

    def _remeshed_as(self, asked: Settings) -> Remeshed | None:
        """Return what the model is remeshed to, if that is known, and other settings leave it."""
        if remeshed_by(self.asked) != remeshed_by(asked):
            return None
        return vars(self)["loaded"].remeshed if "loaded" in vars(self) else self._remeshed

    def _made_of(self, names: Iterable[str]) -> dict[str, Any]:
        """Return those of some stations that were made."""
        return {name: vars(self)[name] for name in names if name in vars(self)}

    @property
    def made(self) -> dict[str, Any]:
        """The stations that were made so far, by their names, for others of the same settings."""
        return self._made_of(name for _, names in views(self.asked) for name in names)

    def know(self, **stations: Any) -> "Stations":
        """Take stations that were made elsewhere, so that they are not made here."""
        vars(self).update(stations)
        return self

    @cached_property
    def completed(self) -> tuple[Settings, Supplies]:
        """The settings with what was left to fabweave, and what bunches are cut from."""
        return complete_settings(self.asked)

    @cached_property
    def given_mesh(self) -> GivenMesh:
        """The mesh that is given, at its size."""
        return give_mesh(self.asked.mesh, self.progress, self.given)

    @cached_property
    def loaded(self) -> LoadedMesh:
        """The mesh."""
        return load_asked(self.completed[0], self.given_mesh, self.progress, self._remeshed)

    @cached_property
    def weave(self) -> WovenMesh:
        """The mesh, woven."""
        settings, supplies = self.completed
        return weave_mesh(self.loaded, settings.weave, settings.search, supplies, self.progress)

    @property
    def n_crossings(self) -> int:
        """How many crossings there are."""
        return self.loaded.n_crossings

    @cached_property
    def ribbons(self) -> WovenObject:
        """The woven object with ribbons as wide as asked."""
        settings, supplies = self.completed
        supplies.require(self.weave.bunches)
        laid = lay_object(self.weave, settings.ribbons, supplies, self.progress)
        if not settings.ribbons.straight:
            return laid
        return straightened(laid, settings.ribbons, supplies, self.progress)

    @cached_property
    def clear_ribbons(self) -> WovenObject:
        """The woven object with ribbons that keep clear of one another."""
        settings, supplies = self.completed
        return keep_clear(self.ribbons, settings.ribbons, supplies)

    @cached_property
    def settled(self) -> tuple[Settings, Supplies]:
        """The settings once ribbons are there: pieces lie across the grain if bends ask for it."""
        settings, supplies = self.completed
        supplies = chosen_grain(self.ribbons.ribbons, self.ribbons.bunches, supplies)
        up = settings.mesh.up or self.ribbons.source.up
        boundary = settings.weave.boundary
        if boundary == "auto":
            boundary = "turn" if len(self.weave.weave.threads.turn_pass) else "end"
        kept = settings.but(rotations=supplies.rotations, up=up, boundary=boundary)
        return kept, supplies

    @cached_property
    def brief(self) -> Brief:
        """What the pieces are made by."""
        return brief_of(*self.settled)

    @cached_property
    def along(self) -> RibbonCheck:
        """The check of each ribbon by itself, before there are pieces: a moment's work."""
        return self._checked(self.ribbons, Depth.ALONG)

    @property
    def foreseen(self) -> list[BrokenRule]:
        """The rules that are broken whatever its pieces are, the width first."""
        found = [
            one for one in self.along.findings if one.rule in _FORESEEN and excess([one]) > 1.0
        ]
        return sorted(found, key=lambda one: one.rule != "width")

    @cached_property
    def drawn(self) -> JoinedObject:
        """Where threads are cut and how these pieces are joined, as ribbons lie on the mesh."""
        return split_object(self.ribbons, self.brief, self.progress)

    @cached_property
    def _made(self) -> tuple[JoinedObject, PieceSet, Begun | None]:
        """What is cut, so that it settles onto the mesh, its pieces, and how far it came to rest.

        Fasteners that keep the form are looked for where it does not come near enough without.
        """
        drawn, brief, searched = self.drawn, self.brief, self.depth == Depth.SEARCHED
        self.progress("checks", 0, 1)
        bare, hold = joined_pieces(drawn, brief), form_hold(drawn, brief, closely=searched)
        found = self._compensated(bare) if searched else (drawn, bare, None)
        if hold is None:
            return found
        foretold = self._foretell(*found[:2])
        left_mm = None if foretold is None else foretold.left_mm
        if left_mm is not None and left_mm <= hold.bound_mm:
            return found
        held = joined_pieces(drawn, brief, hold)
        if np.array_equal(held.fastened, bare.fastened):
            return found
        return self._compensated(held) if searched else (drawn, held, None)

    def _foretell(self, joined: JoinedObject, pieces: PieceSet) -> Foretold | None:
        """Return how far an object goes to first order, and is off in the end as it is made."""
        found = foretell_end(joined.woven, self.brief, pieces)
        drawn = self.depth == Depth.SEARCHED and joined.woven.aim is None
        return found._replace(left_mm=None) if drawn and found is not None else found

    def _compensated(self, drawn: PieceSet) -> tuple[JoinedObject, PieceSet, Begun | None]:
        """Return what settles onto the mesh, and its pieces; as drawn where little is gained."""
        beside = drawn.fastened.copy()
        beside[self.drawn.joints.crossing] = False
        joints = [(one.kind, len(one.holes)) for one in drawn.joints]
        # What comes nearer is not cut into more pieces, hardly more kinds, nor held otherwise. Its
        # holes are of as many sizes: where there is less room, all are smaller.
        most = drawn.kinds.count + drawn.kinds.count // _MANY_KINDS
        least_mm = min((one.hole_mm for one in drawn.rules), default=0.0)
        smaller = [(one,) for one in self.brief.rules if one.hole_mm < least_mm]
        for joined, begun in compensated(
            self.drawn, drawn, self.brief, self._checked, self.progress
        ):
            for rules in (drawn.rules, *smaller):
                brief = replace(self.brief, rules=rules)
                pieces = joined_pieces(joined, brief, lambda held, *_: held | beside)
                held = [(one.kind, len(one.holes)) for one in pieces.joints] == joints
                held &= bool(pieces.fastened.sum() >= drawn.fastened.sum())
                few = len(pieces.pieces) <= len(drawn.pieces) and pieces.kinds.count <= most
                if held and few:
                    return joined, pieces, begun
        return self.drawn, drawn, None

    @cached_property
    def joined(self) -> JoinedObject:
        """Where threads are cut and how these pieces are joined; the ribbons, laid for that."""
        return self._made[0]

    @cached_property
    def piece_set(self) -> PieceSet:
        """The pieces."""
        return self._made[1]

    @property
    def _many(self) -> bool:
        """Whether there are too many crossings to look for what would help before it is refused."""
        return self.n_crossings > FEW

    @cached_property
    def check(self) -> RibbonCheck:
        """The check of the ribbons as they are cut.

        What would help takes long to find on a large object: it is looked for where it is refused.
        """
        return self.check_at(min(self.depth, Depth.NEAR) if self._many else self.depth)

    @cached_property
    def planned(self) -> PlannedJob:
        """The pieces, with all that they were planned by, whether they can be built or not."""
        settings, supplies = self.settled
        numbers = self.piece_set.kinds.number
        return PlannedJob(
            settings, supplies, self.brief.rules, self.joined.woven, self.check, self.joined.plan,
            self.piece_set, spared(numbers, settings.pieces.spares), self._made[2],
        )  # fmt: skip

    @property
    def buildable(self) -> PlannedJob:
        """The pieces; NotMakeableError if they cannot be built, and are not forced."""
        planned = self.planned
        if planned.verdict.stops and not self.asked.pieces.force:
            closely = self.check_at(self.depth) if self._many else self.check
            raise NotMakeableError(replace(planned, check=closely).verdict)
        return planned

    @cached_property
    def costs(self) -> Costs:
        """What it costs, as far as that is known before nesting."""
        settings, supplies = self.settled
        return pieces_costs(
            self.piece_set, self.joined.woven, settings.pieces, supplies,
            settings.machine.calibrate, common=settings.common_cuts,
        )  # fmt: skip

    @cached_property
    def foretold(self) -> Foretold | None:
        """How far it goes when it is let go, to first order; None where that takes minutes."""
        return self._foretell(self.joined, self.piece_set)

    @cached_property
    def layout(self) -> Layout:
        """Where each piece lies on which sheet, each material on its own.

        Raises
        ------
        InputError
            If a layout that was given cannot be taken.
        CannotMakeError
            If a piece fits no sheet, or sheets run out.
        """
        planned = self.planned
        pieces, search = planned.to_cut, planned.settings.search
        sheets = planned.supplies, planned.woven.bunches
        if self._recorded is not None:
            kept = replace(search, layout=str(self._recorded))
            layout = nest_pieces(pieces, *sheets, kept)
            return replace(layout, recorded=search.layout is not None)
        self.progress("nesting", 0, len(pieces))
        return nest_pieces(pieces, *sheets, search, self.executors, self.progress)

    def colours(self, woven: WovenMesh) -> Colours:
        """Return the colours of all passes, as they were asked for."""
        settings, supplies = self.completed
        return woven_colours(woven, settings.pieces.colours, supplies)

    def _checked(self, woven: WovenObject, depth: Depth = Depth.NEAR) -> RibbonCheck:
        """Check ribbons without a search for remedies."""
        settings, supplies = self.settled
        return check_ribbons(
            woven.ribbons,
            woven.weave,
            woven.labels,
            thread_limits(supplies, woven.bunches, settings.ribbons.clearance_mm),
            size_mm=woven.size_mm,
            clearance=woven.narrowed.clearance if woven.narrowed is not None else None,
            depth=depth,
        )

    def check_at(self, depth: Depth) -> RibbonCheck:
        """Check the ribbons as they are cut, as closely as is asked."""
        joined, supplies = self.joined, self.settled[1]
        check = check_joined(joined.woven, self.brief, joined.repeats, depth)
        if depth == Depth.SEARCHED and not joined.woven.straight:
            check = self._refined(check)
        return with_grain(check, joined, self.piece_set.pieces, supplies.rotations)

    def _refined(self, check: RibbonCheck) -> RibbonCheck:
        """Add refinement as a remedy to findings that one or two steps of it mend, as tried.

        The object is woven, planned and laid once more from the refined mesh, as a job would. A
        rule is mended if it holds there, and no rule is broken that is not broken now. Where it
        might be a remedy and is not tried, ``untried`` says why.
        """
        settings, broken = self.settled[0], {finding.rule for finding in check.findings}
        if not broken & _COARSE:
            return check
        if settings.mesh.remeshed:
            return replace(check, untried="a mesh that is made anew is made finer by --remesh")
        if settings.weave.pattern != "plain":
            return replace(check, untried="fabweave tries it for plain weave only")
        crossings, most = self.n_crossings, MOST_CROSSINGS // 4
        if crossings > most:
            return replace(check, untried=f"there are more than {most} crossings")
        findings = check.findings
        for steps, refinement in enumerate(REFINEMENTS, start=1):
            waiting = {finding.rule for finding in findings if finding.refine is None}
            if not waiting & _COARSE or crossings * 4**steps > MOST_CROSSINGS:
                break
            before = f"{settings.mesh.refine}," if settings.mesh.refine else ""
            finer = self.instead(settings.but(refine=before + refinement))
            still = finer._broken()
            if still is not None and still <= broken:
                findings = tuple(
                    finding
                    if finding.refine is not None or finding.rule in still
                    else replace(finding, refine=finer.asked.mesh.refine)
                    for finding in findings
                )
        return replace(check, findings=findings)

    def _broken(self) -> set[str] | None:
        """Return the rules that are broken by what is made; None if nothing is."""
        try:
            check = self._checked(self.drawn.woven)
        except (CannotMakeError, InputError):
            return None
        return None if check.refused else {finding.rule for finding in check.findings}
