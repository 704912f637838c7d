"""Keep the stations of a job that are known, and make anew only what other options change."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from fabweave.app.mesh_source import LoadedMesh, load_mesh
from fabweave.app.options.option import MESH, PIECES, RIBBONS, SEARCH, STOCK, WEAVE
from fabweave.app.options.table import OPTIONS
from fabweave.app.planned_job import PlannedJob, nest_job, plan_job
from fabweave.app.request import chosen_grain, complete_settings
from fabweave.app.settings import Settings, settings_from_options
from fabweave.app.woven_mesh import WovenMesh, weave_mesh
from fabweave.app.woven_object import WovenObject, keep_clear, lay_object
from fabweave.core.arrays import frozen_value
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.layout import Layout
from fabweave.stock.supplies import Supplies

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


def _view(settings: Settings, *sections: str) -> tuple[Any, ...]:
    """Return the settings of some sections of options: where they are equal, all of them are."""
    return tuple(
        getattr(settings, option.field) for option in OPTIONS if option.section in sections
    )


def mesh_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a loaded mesh depends on: where they are equal, the mesh is."""
    seed = settings.seed if settings.remeshed else None
    return (*_view(settings, MESH), settings.course, settings.pattern == "triaxial", seed)


def weave_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a weave depends on."""
    search = (settings.effort, settings.seed) if settings.pattern == "twill" else ()
    return (*mesh_view(settings), *_view(settings, WEAVE), *search)


def ribbon_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that ribbons depend on, before pieces are planned."""
    return (*weave_view(settings), *_view(settings, RIBBONS))


def piece_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that pieces depend on: the sheets that they must fit, too."""
    return (*ribbon_view(settings), *_view(settings, PIECES, STOCK))


def layout_view(settings: Settings) -> tuple[Any, ...]:
    """Return all settings that a layout depends on."""
    return (*piece_view(settings), *_view(settings, SEARCH))


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
    return Stations(request, load_mesh(request.settings, given_mesh=request.given))


def woven(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Weave the mesh, with more options."""
    request = known.request.also(options)
    settings = request.settings
    if mesh_view(known.request.settings) != mesh_view(settings):
        known = loaded(request)
    known = replace(known._unless_changed(settings), request=request)
    weave = known.weave or weave_mesh(known.loaded, settings)
    return replace(known, weave=weave)


def with_ribbons(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Lay ribbons as wide as asked, with more options."""
    known = woven(known, options)
    settings, supplies = completed(known)
    weave = there(known.weave)
    supplies.require(weave.bunches)
    return replace(known, ribbons=known.ribbons or lay_object(weave, settings, supplies))


def with_pieces(known: Stations, options: Mapping[str, Any]) -> Stations:
    """Split threads into pieces, with more options."""
    known = with_ribbons(known, options)
    ribbons = there(known.ribbons)
    settings, supplies = chosen_grain(ribbons.ribbons, ribbons.bunches, *completed(known))
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
    return keep_clear(there(known.ribbons), *completed(known))
