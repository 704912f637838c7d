"""Keep the stations of a job that are known, and make anew only what other options change."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from fabweave.core.arrays import frozen_value
from fabweave.core.colour_space import Colours
from fabweave.form.straight import lay_strips
from fabweave.job.ask import complete_settings, load_asked
from fabweave.job.planned import PlannedJob, nest_job, plan_job
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.layout import Layout
from fabweave.options.settings import Settings, settings_from_options
from fabweave.plan.colours import woven_colours
from fabweave.ribbon.lay import WovenObject, keep_clear
from fabweave.stock.supplies import Supplies
from fabweave.weave.weave_mesh import WovenMesh, weave_mesh


def views(settings: Settings) -> dict[str, tuple[Any, ...]]:
    """Return for each station the settings that it depends on beside those of the ones before."""
    mesh, weave, stock, search = settings.mesh, settings.weave, settings.stock, settings.search
    material = stock.material, stock.library, stock.thickness_mm
    seed = search.seed if mesh.remeshed else None
    # A mesh is faired for what its ribbons are cut from.
    faired_for = material if mesh.faired else None
    return {
        "loaded": (mesh, weave.course, weave.triaxial, seed, faired_for),
        "weave": (weave, search if weave.pattern == "twill" else None),
        "ribbons": (settings.ribbons, *material),
        "planned_first": (settings.pieces, stock),
        "layout": (search,),
    }


@frozen_value
class Stations:
    """The stations of a job, each made when it is first asked for.

    Parameters
    ----------
    mesh : str
        A file, a built-in shape, or the name of a mesh from memory.
    options : mapping
        Options of the command line by name, ``-`` written ``_``.
    given : PolyMesh or None
        The mesh from memory.
    """

    mesh: str
    options: Mapping[str, Any]
    given: PolyMesh | None = None

    def also(self, options: Mapping[str, Any]) -> "Stations":
        """Return the stations with more options, of which later ones win: what they leave stays."""
        return self.instead(self.mesh, {**self.options, **options})

    def instead(self, mesh: str, options: Mapping[str, Any]) -> "Stations":
        """Return the stations of these options and no others: what they leave as it was stays."""
        other = Stations(mesh, options, self.given)
        before, now = views(self.settings), views(other.settings)
        for name in before:
            if before[name] != now[name]:
                break
            if name in vars(self):
                other.know(**{name: vars(self)[name]})
        return other

    def know(self, **stations: Any) -> None:
        """Take stations that were made elsewhere, so that they are not made here."""
        vars(self).update(stations)

    @cached_property
    def settings(self) -> Settings:
        """What the options come to."""
        return settings_from_options(self.mesh, **self.options)

    @cached_property
    def completed(self) -> tuple[Settings, Supplies]:
        """The settings with what was left to fabweave, and what bunches are cut from."""
        return complete_settings(self.settings)

    @cached_property
    def loaded(self) -> LoadedMesh:
        """The mesh."""
        return load_asked(self.settings, given_mesh=self.given)

    @cached_property
    def weave(self) -> WovenMesh:
        """The mesh, woven."""
        return weave_mesh(self.loaded, self.settings.weave, self.settings.search)

    @cached_property
    def ribbons(self) -> WovenObject:
        """The woven object with ribbons as wide as asked."""
        settings, supplies = self.completed
        supplies.require(self.weave.bunches)
        return lay_strips(self.weave, settings.ribbons, supplies)

    @cached_property
    def clear_ribbons(self) -> WovenObject:
        """The woven object with ribbons that keep clear of one another."""
        settings, supplies = self.completed
        return keep_clear(self.ribbons, settings.ribbons, supplies)

    @cached_property
    def planned_first(self) -> PlannedJob:
        """The pieces, with the settings that they were planned by."""
        return plan_job(self.ribbons, *self.completed)

    @cached_property
    def planned(self) -> PlannedJob:
        """The pieces; options that they do not depend on, such as those of files, are as now."""
        kept = self.planned_first.settings
        settings = self.completed[0].but(rotations=kept.stock.rotations, up=kept.mesh.up)
        return replace(self.planned_first, settings=settings)

    @cached_property
    def layout(self) -> Layout:
        """Where each piece lies on which sheet."""
        return nest_job(self.planned)

    def colours(self, woven: WovenMesh) -> Colours:
        """Return the colours of all passes, as they were asked for."""
        settings, supplies = self.completed
        return woven_colours(woven, settings.pieces.colours, supplies)
