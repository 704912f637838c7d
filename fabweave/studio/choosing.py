"""Choose the mesh of a model, and try designs of it: each is told as soon as it was tried."""

import os
from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

from fabweave.core.errors import CannotMakeError
from fabweave.core.parallel.executors import get_ready, processes
from fabweave.core.records import to_json
from fabweave.design.choice import choose_mesh
from fabweave.design.search import Search
from fabweave.design.tried import Tried
from fabweave.design.variety import is_free, variety
from fabweave.design.wishes import NO_WISHES, rank
from fabweave.estimate.texts import hours_text
from fabweave.job.stations import Stations
from fabweave.mesh.load import LoadedMesh
from fabweave.options.settings import Settings
from fabweave.ribbon.rules.remedy import Depth
from fabweave.studio.state import SIZE, State, state_of
from fabweave.studio.work import (
    Tell,
    mesh_key,
    progress_of,
    seen_colours,
    stations_for,
    stations_key,
    strips,
)

#: So many designs are tried, which are free in these options.
_DESIGNS, _FREE = 12, ("remesh", "refine", "pattern", "width")
#: So many processes try designs: the meshes of a round are few.
_MOST_WORKERS = 4
#: What a new page offers to begin with.
EXAMPLES = {
    "Torus in twill": ("shape:torus?m=24&n=12", {"pattern": "twill"}),
    "Lampshade": ("shape:tube?m=24&n=10", {}),
    "Ball of kagome": ("shape:icosahedron", {"refine": "loop:2", "pattern": "kagome"}),
    "Dome": ("shape:hemisphere?n=6", {}),
    "Canopy": ("shape:hypar?m=12&n=12", {}),
    "Ring of three holes": ("shape:slit?genus=3", {}),
}


def warm_up(_kept: dict[str, Any], _wish: dict[str, Any], _tell: Tell) -> None:
    """Load what works, here and in the processes that are to try designs."""
    if _workers():
        get_ready()


def choose(kept: dict[str, Any], wish: dict[str, Any], tell: Tell) -> None:
    """Tell designs of the model of a wish as they are tried, each with its ribbons.

    At last ``choice`` has the options of the mesh on which ``make`` would weave it, and why, and
    which designs are quicker and finer. A wish for ``more`` tries other meshes, patterns and widths
    instead; one for ``examples`` has what a new page offers.
    """
    if wish.get("examples"):
        for name, (mesh, options) in EXAMPLES.items():
            job = Stations.read(mesh, {"size": SIZE, **options})
            tell(_card(job, {"name": name, "state": State(mesh, job.options).to_json()}))
        return
    if wish.get("more"):
        options = {name: value for name, value in wish["options"].items() if name not in _FREE}
        asked = Stations.read(wish["mesh"], options).asked
        search = Search(
            asked, progress=progress_of(tell, "choose"), told=_teller(tell), at_once=True
        )
        search.add(variety(asked, search.model().mesh, _DESIGNS))
        return
    stations = stations_for(kept, wish)
    stations.progress = progress_of(tell, "choose")
    asked = stations.asked
    if not is_free(asked):
        return
    try:
        with processes(_workers())() as pool:
            search = Search(
                asked, progress=stations.progress, told=_teller(tell),
                executors=lambda: nullcontext(pool), at_once=True,
            )  # fmt: skip
            choice = choose_mesh(stations, search, advise=False)
    except CannotMakeError as error:
        # It is shown as it is, with the reasons.
        own = {"remesh": "none"}
        tell(({"choice": {"options": own, "why": error.reason, "roles": {}}}, {}))
        return
    design = _stated(choice.job.asked)
    was, now = (state_of(one).options for one in (asked, design))
    roles = {"usual": design, **{role: one.design for role, one in choice.beside.items()}}
    told = {
        "options": {name: value for name, value in now.items() if was.get(name) != value},
        "why": choice.text,
        "roles": {role: state_of(_stated(one)).to_json() for role, one in roles.items()},
    }
    keep = {mesh_key(design): choice.job.loaded, stations_key(design): choice.job.made}
    tell(({"choice": told, "keep": keep}, {}))


def _workers() -> int:
    """Return how many processes try designs; none where there is one processor."""
    count = min(os.cpu_count() or 1, _MOST_WORKERS)
    return count if count > 1 else 0


def _stated(design: Settings) -> Settings:
    """Return a design that says so where it has the model's own mesh."""
    return design.but(remesh="none") if is_free(design) else design


def _teller(tell: Tell) -> Any:
    """Return what tells a design that can be built, and whether none before was better."""
    best: list[Any] = []

    def show(tried: Tried) -> None:
        figures, loaded = tried.figures, tried.loaded
        if figures is None or loaded is None or not tried.makeable:
            return
        design, order = _stated(tried.design), rank(tried, NO_WISHES)
        leads = not best or order < best[0]
        if leads:
            best[:] = [order]
        told = {
            "name": called(design),
            "state": state_of(design).to_json(),
            "figures": to_json(figures),
            "hours": "" if figures.hours is None else hours_text(figures.hours),
            "level": tried.verdict.level,
            "leads": leads,
        }
        job = Stations(design, depth=Depth.NEAR).know(loaded=loaded)
        tell(_card(job, told, keep={mesh_key(design): loaded}))

    return show


def _card(job: Stations, told: dict[str, Any], keep: Mapping[str, LoadedMesh] | None = None) -> Any:
    """Return a design with the ribbons that show it."""
    woven = job.ribbons
    values = {"card": told, **({} if keep is None else {"keep": keep})}
    return values, strips(woven, seen_colours(job, woven))


def called(design: Settings) -> str:
    """Return what sets a design of a model apart, in a few words.

    Examples
    --------
    >>> called(Settings.of("cow.obj", remesh="quads:120", pattern="twill"))
    '120 quads, twill'
    """
    remesh = "" if design.mesh.remesh is None else str(design.mesh.remesh)
    kind, _, number = remesh.partition(":")
    own = kind in ("", "none")
    parts = ["the model's own mesh" if own else f"{number} {kind}".strip()]
    if design.mesh.refine is not None:
        parts.append(f"refined by {design.mesh.refine}")
    if design.weave.pattern != "plain":
        parts.append(design.weave.pattern)
    if design.ribbons.width is not None:
        parts.append(f"width {design.ribbons.width}")
    return ", ".join(parts)
