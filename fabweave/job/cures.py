"""Find what makes an object stand that collapses when it is let go."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.form.body import ElasticBody, body_of, elastic
from fabweave.form.compensate import Begun
from fabweave.form.hold import Foresight, pins_of
from fabweave.form.settle import STANDS, Closely, settle
from fabweave.job.former import former_of
from fabweave.job.planned import PlannedJob
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.request import parse_remesh
from fabweave.options.command import changed_options
from fabweave.options.settings import Settings
from fabweave.piece.joint.fastening import beside_edges
from fabweave.piece.pieces import PieceSet
from fabweave.ribbon.rules.remedy import Depth
from fabweave.stock.material import Material, machine_of, material_library
from fabweave.stock.per_bunch import NAMED

#: Of larger objects, only coarser meshes are tried: else each takes as long as letting them go.
_MOST_TRIED = 1500
#: So many times thicker material is tried, and so many stiffer ones.
_THICKER, _STIFFER = (1.5, 2.0), 6
#: Ribs are all strands of one of so many bunches at most: each more is another sort of sheets.
_FEW_BUNCHES = 4
#: So many times as many faces make a denser mesh; so many times these in place of a large one.
_DENSER, _COARSE = 2, 150
#: So many that stand to first order are planned anew, at most.
_MOST_PLANNED = 4
#: To first order, what stands may go so many times too far.
_TOO_FAR = 2.0
#: Near enough to rest to know whether it stands.
_ABOUT = Closely(gain=1e-3, sag_gain=1e-7, steps=60)

_Changes = Mapping[str, Any]


def cure_of(planned: PlannedJob, asked: Settings, given: PolyMesh | None = None) -> str:
    """Return what makes the object of a job stand, as options to add to its command.

    A base is tried, ribs (all strands of a bunch are thicker), thicker strands, more fasteners,
    glue, stiffer material, and both; then other meshes; at last a former: the same material and
    fewer hours go first. Of large objects only coarser meshes are. Each is let go; what stands is
    planned anew and let go as it would be made. What cannot be built is no cure.

    Parameters
    ----------
    planned : PlannedJob
        It collapses.
    asked : Settings
        What it was planned by, as was asked: to these the options are added.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    """
    asked = asked.but(force=False)
    # Threads are cut to the length that was found best for it, in a hurry.
    tried = asked.but(effort="quick", max_length_mm=planned.split_plan.length_mm)
    source = replace(planned.woven.source, mesh=planned.woven.wished)
    woven = replace(planned.woven, source=source)
    begun = Stations(tried, given, depth=Depth.ALONG).know(loaded=source, weave=woven)
    few = planned.weave.threads.n_crossings <= _MOST_TRIED
    here = _on_this_mesh(planned, begun) if few else iter(())
    for some in (here, iter(_on_other_meshes(planned, asked))):
        for changes in islice(some, _MOST_PLANNED):
            roughly = begun.instead(tried.but(**changes))
            if not stands_as_made(roughly):
                continue
            # As it would be made: strips that are moved settle otherwise, and rest comes late.
            made = Stations(asked.but(**changes), given, remeshed=roughly.loaded.remeshed)
            if stands_as_made(made, Closely()):
                return f"{changed_options(asked.but(**changes), asked)} makes it stand, as tried"
    former = {"former": "auto"}
    if not few:
        return "no cure was found among coarser meshes"
    with suppress(InputError, CannotMakeError):
        if former_of(begun.instead(tried.but(**former)).buildable) is not None:
            return "--former auto holds it, while the former stays inside"
    return "no cure was found among fasteners, glue, material, other meshes and a former"


def _on_this_mesh(planned: PlannedJob, begun: Stations) -> Iterator[_Changes]:
    """Yield what makes an object stand whose pieces are cut as they are, of whatever they are.

    What does not stand with glue does not without.
    """
    threads, halfedges = planned.weave.threads, planned.woven.halfedges
    rim = beside_edges(threads, halfedges, halfedges.twin < 0)
    also = {"rim": rim, "all": np.ones_like(rim)}
    fastened, glued = planned.piece_set.fastened, planned.piece_set.glued

    def stands(changes: _Changes) -> bool:
        kind = str(changes.get("fasten"))
        pieces = replace(
            planned.piece_set,
            glued=kind == "glue" or glued,
            fastened=fastened | also.get(kind, False),
        )
        with suppress(InputError, CannotMakeError):
            job = begun.instead(begun.asked.but(**changes)).know(loaded=begun.loaded)
            return not job.foreseen and _stands(body_of(planned.woven, job.brief), pieces)
        return False

    rims: list[_Changes] = [{"fasten": "rim"}] if rim.any() else []
    free = bool(rims) and begun.asked.pieces.may_be_based
    bases: list[_Changes] = [{"base": "on"}] if free else []
    held: list[_Changes] = [{"fasten": one} for one in ("all", "glue") if one != planned.fasten]
    ribs, thicker, stiffer = _stiffer(planned, begun.asked)
    both = [{**one, **other} for one in held for other in (*thicker, *stiffer)]
    firm: dict[str, bool] = {}
    for changes in (*bases, *ribs, *thicker, *rims, *held, *stiffer, *both):
        glue = {**changes, "fasten": "glue"}
        if str(glue) not in firm:
            firm[str(glue)] = stands(glue)
        if firm[str(glue)] and (changes == glue or stands(changes)):
            yield changes


def _stiffer(planned: PlannedJob, asked: Settings) -> tuple[list[_Changes], ...]:
    """Return ribs, thicker material, and some that sags less; none where there are more."""
    if planned.supplies.several:
        return [], [], []
    own = planned.supplies.only

    def sags(one: Material) -> float:
        # A strip sags under its own weight by its density over E t², its length apart.
        stuff = elastic(one, grain=False)
        return stuff.density_kg_m3 / (stuff.young_mpa * one.thickness_mm**2)

    less = [
        one
        for one in material_library()
        if asked.stock.thickness_mm is None and machine_of(one).name == machine_of(own).name
        and sags(one) < sags(own) / 2.0
    ]  # fmt: skip
    less = sorted(less, key=sags, reverse=True)[:_STIFFER]
    less.sort(key=lambda one: np.max(one.price_per_m2 or np.inf))
    plain, *thick = (round(times * own.thickness_mm, 2) for times in (1.0, *_THICKER))
    count = int(planned.woven.bunches.max()) + 1
    names = NAMED if count == 2 else tuple(map(str, range(count if count <= _FEW_BUNCHES else 0)))
    ribs = [tuple((name, thick[-1] if name == rib else plain) for name in names) for rib in names]
    return (
        [{"thickness_mm": one} for one in ribs],
        [{"thickness_mm": one} for one in thick],
        [{"material": one.name} for one in less],
    )


def _on_other_meshes(planned: PlannedJob, asked: Settings) -> list[_Changes]:
    """Return what may make an object stand on another mesh: triangles brace themselves."""
    faces = planned.woven.mesh.n_faces
    denser: _Changes = {"refine": "catmull-clark:1"}
    if planned.weave.threads.n_crossings > _MOST_TRIED:
        faces = _COARSE
        denser = {"remesh": f"quads:{_DENSER * faces}", "pattern": "plain"}
    elif asked.mesh.remeshed:
        denser = {"remesh": f"{parse_remesh(str(asked.mesh.remesh)).kind}:{_DENSER * faces}"}
    kagome = {"remesh": f"triangles:{_DENSER * faces}", "pattern": "kagome"}
    return [denser, kagome, {**denser, "fasten": "glue"}]


def stands_as_made(job: Stations, how: Closely = _ABOUT) -> bool:
    """Return whether a job can be built, and its object stands when it is let go."""
    try:
        if job.n_crossings > _MOST_TRIED:
            return False
        made = job.buildable
        return _stands(body_of(made.woven, job.brief), made.piece_set, how, made.begun)
    except (InputError, CannotMakeError):
        return False


def _stands(
    body: ElasticBody | None, pieces: PieceSet, how: Closely = _ABOUT, begun: Begun | None = None
) -> bool:
    """Return whether an object stands when it is let go, from where it came if it has begun."""
    if body is None:
        return False
    pins = pins_of(body, pieces)
    # What goes by far too far to first order takes long to be let go, and collapses.
    far_mm = Foresight(body)(pins, body.size_mm).most_mm
    if far_mm > _TOO_FAR * STANDS * body.size_mm:
        return False
    return settle(body, pins, how=how, begun=begun.by(pins) if begun else ()).form.stands
