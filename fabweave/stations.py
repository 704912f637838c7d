"""Keep the stations of a job that are known, and make anew only what other options change."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from fabweave.core.arrays import frozen_value
from fabweave.core.colour_space import Colours
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.layout import Layout
from fabweave.options.settings import Settings, settings_from_options
from fabweave.plan.ask import complete_settings, load_asked, settle_grain
from fabweave.plan.colours import woven_colours
from fabweave.plan.planned_job import PlannedJob, nest_job, plan_job
from fabweave.ribbon.lay import WovenObject, keep_clear, lay_object
from fabweave.stock.supplies import Supplies
from fabweave.weave.weave_mesh import WovenMesh, weave_mesh

_Station = TypeVar("_Station")


@frozen_value
class Request:
    """What has been asked for so far.

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

    @property
    def settings(self) -> Settings:
        """The settings that the options come to."""
        return settings_from_options(self.mesh, **self.options)

    def also(self, options: Mapping[str, Any]) -> "Request":
        """Return the request with more options; later ones win."""
        return Request(self.mesh, {**self.options, **options}, self.given)


def mesh_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a loaded mesh depends on: where they are equal, the mesh is."""
    mesh, weave = settings.mesh, settings.weave
    seed = settings.search.seed if mesh.remeshed else None
    return mesh, weave.course, weave.triaxial, seed


def weave_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a weave depends on."""
    search = settings.search if settings.weave.pattern == "twill" else None
    return (*mesh_view(settings), settings.weave, search)


def ribbon_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that ribbons depend on, before pieces are planned."""
    stock = settings.stock
    material = stock.material, stock.library, stock.thickness_mm
    return (*weave_view(settings), settings.ribbons, *material)


def piece_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that pieces depend on: the sheets that they must fit, too."""
    return (*ribbon_view(settings), settings.pieces, settings.stock)


def layout_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a layout depends on."""
    return (*piece_view(settings), settings.search)


@frozen_value
class Stations:
    """A request, and the stations of its job as far as they are known.

    Parameters
    ----------
    request : Request
    loaded : LoadedMesh
    weave : WovenMesh or None
    ribbons : WovenObject or None
        With ribbons as wide as asked.
    planned : PlannedJob or None
    layout : Layout or None
    """

    request: Request
    loaded: LoadedMesh
    weave: WovenMesh | None = None
    ribbons: WovenObject | None = None
    planned: PlannedJob | None = None
    layout: Layout | None = None

    def _unless_changed(self, settings: Settings) -> "Stations":
        """Return what stays true with other settings: a station falls, and all after it."""
        before = self.request.settings
        kept = self
        if piece_view(before) != piece_view(settings):
            kept = replace(kept, planned=None)
        if ribbon_view(before) != ribbon_view(settings):
            kept = replace(kept, ribbons=None, planned=None)
        if weave_view(before) != weave_view(settings):
            kept = replace(kept, weave=None, ribbons=None, planned=None)
        return kept


def there(station: _Station | None) -> _Station:
    """Return a station that was reached.

    Raises
    ------
    LookupError
        If it was not.
    """
    if station is None:
        raise LookupError("this station of the job was not reached")
    return station


def loaded(request: Request) -> Stations:
    """Load the mesh of a request."""
    return Stations(request, load_asked(request.settings, given_mesh=request.given))


def woven(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Weave the mesh, with more options."""
    request = known.request.also(options)
    settings = request.settings
    if mesh_view(known.request.settings) != mesh_view(settings):
        known = loaded(request)
    known = replace(known._unless_changed(settings), request=request)
    weave = known.weave or weave_mesh(known.loaded, settings.weave, settings.search)
    return replace(known, weave=weave)


def with_ribbons(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Lay ribbons as wide as asked, with more options."""
    known = woven(known, options)
    settings, supplies = completed(known)
    weave = there(known.weave)
    supplies.require(weave.bunches)
    return replace(known, ribbons=known.ribbons or lay_object(weave, settings.ribbons, supplies))


def with_pieces(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Split threads into pieces, with more options."""
    known = with_ribbons(known, options)
    ribbons = there(known.ribbons)
    settings, supplies = completed(known)
    settings, supplies = settle_grain(ribbons, settings, supplies)
    planned = known.planned or plan_job(ribbons, settings, supplies)
    # Options that pieces do not depend on, such as those of files, may be others.
    return replace(known, planned=replace(planned, settings=settings, supplies=supplies))


def with_layout(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Nest the pieces, with more options."""
    known = with_pieces(known, options)
    return replace(known, layout=nest_job(there(known.planned)))


def with_files(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Return the stations with options of files; if others are among them, nest once more."""
    settings = known.request.also(options).settings
    if layout_view(settings) != layout_view(known.request.settings):
        return with_layout(known, options)
    return with_pieces(known, options)


def completed(known: Stations) -> tuple[Settings, Supplies]:
    """Return the settings with what was left to fabweave, and what bunches are cut from."""
    return complete_settings(known.request.settings)


def clear_ribbons(known: Stations) -> WovenObject:
    """Return the woven object with ribbons that keep clear of one another."""
    known = with_ribbons(known, {})
    settings, supplies = completed(known)
    return keep_clear(there(known.ribbons), settings.ribbons, supplies)


def asked_colours(known: Stations, object_: WovenMesh) -> Colours:
    """Return the colours of all passes, as they were asked for."""
    settings, supplies = completed(known)
    return woven_colours(object_, settings.pieces.colours, supplies)
