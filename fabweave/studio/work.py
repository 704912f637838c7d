"""What the processes of the studio do for its pages: look, plan, and make.

Each keeps the stations of the last wish, and makes anew only what another wish changes.
"""

import hashlib
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import lru_cache, wraps
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.colour_space import Colours
from fabweave.core.errors import FabweaveError, InputError
from fabweave.core.job_folder import clear_abandoned
from fabweave.core.records import to_json
from fabweave.design.making import make_or_advise
from fabweave.design.variety import is_free
from fabweave.estimate.texts import hours_text
from fabweave.job.figures import figures_of, foretold_grade
from fabweave.job.model import YarnOptions, spin_object
from fabweave.job.planned import PlannedJob, order_of
from fabweave.job.stations import Stations, views
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.one_rings import sum_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.mesh.triangulate import plain_triangles
from fabweave.mesh.upright import guess_up, turn_of, turn_upright
from fabweave.options.command import long_command
from fabweave.options.settings import Settings, job_toml
from fabweave.picture.bodies import yarn_bodies
from fabweave.picture.camera import choose_view
from fabweave.picture.surfaces import polygon_triangles, ribbon_triangles, rung_colours
from fabweave.piece.development import piece_stretches
from fabweave.plan.steps import build_steps
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import following_rung
from fabweave.ribbon.rules.remedy import Depth
from fabweave.stock.hardware import sort_asked
from fabweave.studio.controls import controls
from fabweave.studio.fixes import fixes, reasons_fixed
from fabweave.studio.trouble import trouble
from fabweave.studio.worker import Told, Work

#: Meshes that are kept, so that what is undone is there at once; and bars of the histogram.
_KEPT_MESHES, _BARS, _LEAST_SPAN_MM = 8, 24, 0.1
#: The checks of a model of so many faces take a while: it is shown before.
_LARGE = 10_000
#: A model that is not woven yet has this grey.
_CLAY = (188, 186, 181)
#: The thinnest yarn that is shown, as a share of what has room.
_THINNEST = 0.05
#: Progress is told so often at the most, seconds.
_TELL_S = 0.1

Tell = Callable[[Told], None]


def mesh_key(settings: Settings) -> str:
    """Return what the mesh of a job depends on, as a key."""
    return repr(views(settings)[:2])


def stations_key(settings: Settings) -> str:
    """Return what stations depend on that were made elsewhere, as a key."""
    return f"stations {settings!r}"


def stations_for(kept: dict[str, Any], wish: dict[str, Any]) -> Stations:
    """Return the stations of a wish, with what is known of the last ones and of earlier meshes."""
    before: Stations | None = kept.get("stations")
    now = Stations.read(wish["mesh"], wish["options"])
    now.depth = Depth.NEAR
    known = _known(kept, wish).get(stations_key(now.asked), {})
    if before is not None:
        now = before.instead(now.asked, now.options)
    if before is None or before.asked != now.asked:
        now.know(**known)
    if "loaded" not in vars(now):
        now.know(loaded=_loaded(kept, now))
    kept["stations"] = now
    return now


def _known(kept: dict[str, Any], wish: dict[str, Any]) -> dict[str, Any]:
    """Return the meshes and stations that are known, with those that a wish brings."""
    meshes: dict[str, Any] = kept.setdefault("meshes", {})
    meshes.update(wish.get("known") or {})
    while len(meshes) > _KEPT_MESHES:
        del meshes[next(iter(meshes))]
    return meshes


def _loaded(kept: dict[str, Any], stations: Stations) -> LoadedMesh:
    """Return the mesh of some stations, which may be one of those that were loaded last."""
    meshes, key = _known(kept, {}), mesh_key(stations.asked)
    found = meshes[key] = meshes.get(key) or stations.loaded
    return found


def warm(_kept: dict[str, Any], _wish: dict[str, Any], _tell: Tell) -> None:
    """Do nothing: the process that is asked for it has then loaded what it works with."""


def cured(work: Callable[[dict[str, Any], dict[str, Any], Tell], None]) -> Work:
    """Return work that tells what cures an error, as options, where the error names some."""

    @wraps(work)
    def tried(kept: dict[str, Any], wish: dict[str, Any], tell: Tell) -> None:
        try:
            work(kept, wish, tell)
        except FabweaveError as error:
            found = fixes(wish["mesh"], wish["options"], str(error))
            tell(({"error": str(error), "fixes": found}, {}))

    return tried


@cured
def look(kept: dict[str, Any], wish: dict[str, Any], tell: Tell) -> None:
    """Tell what the object of a wish looks like, what makes it, and what can be changed.

    A model whose mesh is left to fabweave is shown as it is, in grey: ``raw``. Where an exact twill
    may not exist, the vote of the paper is shown until the search ends; where strips are straight,
    wavy ones are until these are found.
    """
    before = kept.get("stations")
    if (before is None or before.asked.mesh.source != wish["mesh"]) and (glance := _glance(wish)):
        tell(glance)
    stations = stations_for(kept, wish)
    stations.progress = progress_of(tell, "look")
    if is_free(stations.asked):
        tell(_raw(stations, wish, kept))
        return
    if "weave" not in vars(stations) and wish["options"].get("pattern") == "twill":
        first = stations.also({"twill_method": "voting"})
        if first.weave.weave.broken.total:
            tell(_seen(first, wish, first.ribbons, kept, better=True))
    if "ribbons" not in vars(stations) and stations.asked.ribbons.straight:
        wavy = stations.also({"strips": "wavy"}).ribbons
        tell(_seen(stations, wish, wavy, kept, better=True))
    tell(_seen(stations, wish, stations.ribbons, kept))


def seen_colours(stations: Stations, woven: WovenObject) -> Colours:
    """Return the colours of all passes; without pieces, one for each direction in their place."""
    if stations.asked.pieces.colours == "piece":
        stations = stations.also({"colours": "direction"})
    return stations.colours(woven)


def _colours(stations: Stations, woven: WovenObject, kept: dict[str, Any]) -> Colours:
    """Return the colours of all passes, which do not change with the width of ribbons."""
    settings = stations.asked
    what = repr((settings.pieces.colours, settings.stock.material, settings.stock.library))
    known = kept.get("colours")
    if known is None or known[0] is not woven.weave or known[1] != what:
        known = kept["colours"] = woven.weave, what, seen_colours(stations, woven)
    return np.asarray(known[2])


def _glance(wish: dict[str, Any]) -> Told | None:
    """Return a large model as its file has it, before anything is checked; None of a small one."""
    settings = Stations.read(wish["mesh"], wish["options"]).asked
    if not is_free(settings):
        return None
    file = read_mesh(settings.mesh.source)
    if file.mesh.n_faces < _LARGE:
        return None
    try:
        up = settings.mesh.up or file.up or (guess_up(file.mesh, file.format) or ("z", ""))[0]
        mesh = turn_upright(file.mesh, up)
        return {"glance": True, "faces": mesh.n_faces, "view": _view(mesh)}, _clay(mesh)
    except (FabweaveError, ValueError):
        return None  # the checks say what is wrong with it


@lru_cache(maxsize=2)
def _view(mesh: PolyMesh) -> tuple[float, float]:
    """Return from where an object is seen first, as pictures find it: azimuth and elevation.

    While a slider moves the mesh stays, and so does this.
    """
    view = choose_view(*plain_triangles(mesh))
    return view.azimuth_deg, view.elevation_deg


def _clay(mesh: PolyMesh) -> dict[str, np.ndarray[Any, Any]]:
    """Return a mesh as a page shows it in grey, smooth where its corners are."""
    points, triangles, _, _ = polygon_triangles(mesh)
    corner = points[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = sum_at(triangles.T.ravel(), np.tile(area, (3, 1)), len(points))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shade = np.zeros((len(points), 4), dtype=np.int8)
    shade[:, :3] = (normal * 127.0).round()
    return {
        "position": points.astype("<f4"), "shade": shade,
        "colour": np.tile(np.array(_CLAY, dtype=np.uint8), (len(points), 1)),
        "index": triangles.astype("<u4"),
    }  # fmt: skip


def _raw(stations: Stations, wish: dict[str, Any], kept: dict[str, Any]) -> Told:
    """Return a model as it comes, as a page shows it."""
    loaded, settings = stations.loaded, stations.asked
    told = {
        "raw": True, "title": loaded.title, "faces": loaded.mesh.n_faces, "notes": [],
        "better": False, "turn": turn_of(loaded.upward).tolist(), "view": _view(loaded.mesh),
        "command": long_command(settings), "toml": job_toml(settings, {}),
        "controls": [asdict(one) for one in controls(settings, stations.completed[0], loaded)],
    }  # fmt: skip
    return told, _clay(loaded.mesh) | (_faces(stations, kept) if wish.get("faces") else {})


def _seen(
    stations: Stations,
    wish: dict[str, Any],
    woven: WovenObject,
    kept: dict[str, Any],
    *,
    better: bool = False,
) -> Told:
    """Return a woven object as a page shows it."""
    settings, complete = stations.asked, stations.completed[0]
    spun = wish.get("yarns", False)
    arrays = (
        _yarns(stations, woven, kept, wish.get("radius"))
        if spun
        else strips(woven, _colours(stations, woven, kept))
    )
    told = {
        "title": woven.title,
        "crossings": woven.weave.threads.n_crossings,
        "faces": woven.mesh.n_faces,
        "broken": woven.weave.broken.total,
        "notes": [note.text for note in woven.notes if not note.detail],
        "better": better,
        "turn": turn_of(woven.source.upward).tolist(),
        "view": _view(woven.source.mesh),
        "command": long_command(settings),
        "toml": job_toml(settings, {}),
        "controls": [asdict(one) for one in controls(settings, complete, woven.source, woven)],
    }
    if wish.get("faces"):
        arrays |= _faces(stations, kept)
    return _packed(told, arrays, wish.get("have", ""))


def strips(woven: WovenObject, colours: Colours) -> dict[str, np.ndarray[Any, Any]]:
    """Return ribbons: the ends of rungs, which way they look, how far over, and triangles."""
    ribbons, weave = woven.ribbons, woven.weave
    points, triangles, _ = ribbon_triangles(ribbons)
    middle = (ribbons.right + ribbons.left) / 2.0
    rungs = np.arange(ribbons.n_rungs)
    after = following_rung(ribbons.offsets, ribbons.closed)
    after = np.where(after < 0, rungs, after)
    before = rungs.copy()
    before[after[after != rungs]] = rungs[after != rungs]
    normal = np.cross(middle[after] - middle[before], ribbons.left - ribbons.right)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    panel = np.repeat(ribbons.entry, 2) + np.tile([0, 1], len(ribbons.entry))
    height = np.repeat(np.where(weave.over, 1.0, -1.0), 2)
    dip = np.interp(rungs, panel, height)
    shade = np.column_stack((normal * 127.0, dip * 127.0)).round().astype(np.int8)
    return {
        "position": points.astype("<f4"),
        "shade": np.repeat(shade, 2, axis=0),
        "colour": np.repeat(rung_colours(ribbons, colours), 2, axis=0),
        "index": triangles.astype("<u4"),
        "crossing": ribbons.centre.astype("<f4"),
        "thread": ribbons.offsets.astype("<u4"),
    }


def _yarns(
    stations: Stations, woven: WovenObject, kept: dict[str, Any], share: float | None
) -> dict[str, np.ndarray[Any, Any]]:
    """Return yarns of a share of the radius that has room, as far as they are shown as ribbons."""
    yarns = spin_object(woven, YarnOptions(None, 8))
    if share is not None:
        thick = float(yarns.radius_mm.max()) * min(max(float(share), _THINNEST), 1.0)
        yarns = spin_object(woven, YarnOptions(thick, 8))
    bodies = yarn_bodies(yarns, woven.labels, _colours(stations, woven, kept))
    first = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    normals = [one.vertices * 0.0 if one.normals is None else one.normals for one in bodies]
    shade = np.zeros((int(first[-1]), 4), dtype=np.int8)
    shade[:, :3] = (np.concatenate(normals) * 127.0).round()
    return {
        "position": np.concatenate([body.vertices for body in bodies]).astype("<f4"),
        "shade": shade,
        "colour": np.concatenate([body.colours for body in bodies]),
        "index": np.concatenate(
            [one.all_triangles + at for one, at in zip(bodies, first[:-1].tolist(), strict=True)]
        ).astype("<u4"),
        "crossing": woven.ribbons.centre.astype("<f4"),
    }


def _faces(stations: Stations, kept: dict[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
    """Return the mesh before any face was left out, with the number of each triangle's face."""
    mesh = _loaded(kept, stations.also({"leave_out": None, "rim": None})).mesh
    points, triangles, _, face = polygon_triangles(mesh)
    return {
        "face_position": points[triangles].astype("<f4"),
        "face": face.astype("<u4"),
    }


def _packed(told: dict[str, Any], arrays: dict[str, np.ndarray[Any, Any]], have: str = "") -> Told:
    """Return what is told with arrays behind it; triangles that a page has are left out."""
    index = arrays.get("index")
    if index is not None:
        told["shape"] = hashlib.blake2b(index.tobytes(), digest_size=8).hexdigest()
        if told["shape"] == have:
            del arrays["index"]
    return told, arrays


@cured
def plan(kept: dict[str, Any], wish: dict[str, Any], tell: Tell) -> None:
    """Tell what the object of a wish comes to: verdict and figures, then sheets, then steps.

    A wish for what is finer gets the sheets alone, nested as they will be.
    """
    stations = stations_for(kept, wish)
    stations.progress = progress_of(tell, "plan")
    planned = stations.planned
    stations.progress = progress_of(tell, "sheets")
    if wish.get("finer"):
        # As it is made: so that it settles onto its mesh.
        made = Stations(stations.asked, progress=stations.progress)
        parts = ("loaded", "weave", "ribbons", "drawn")
        tell(_sheets(made.know(**{name: getattr(stations, name) for name in parts})))
        return
    tell(_figures(stations))
    if not wish.get("yarns"):
        tell(_cut(stations))
    quick = replace(planned, settings=planned.settings.but(effort="quick"))
    tell(_sheets(stations.instead(stations.asked, stations.options).know(planned=quick)))
    tell(_steps(planned))


def progress_of(tell: Tell, of: str) -> Callable[[str, int, int], None]:
    """Return what tells of progress, seldom."""
    last = [0.0]

    def progress(what: str, done: int, total: int) -> None:
        if (now := time.monotonic()) - last[0] > _TELL_S:
            last[0] = now
            tell(({"progress": {"of": of, "what": what, "done": done, "total": total}}, {}))

    return progress


def _figures(stations: Stations) -> Told:
    """Return verdict, figures and widths, and each piece flat."""
    planned, figures = stations.planned, figures_of(stations)
    verdict = replace(planned.verdict, forced=False)
    widths = planned.check.measured["width"].value
    low = float(widths.min())
    # Of one width alone there is one bar.
    span = low, max(float(widths.max()), low + _LEAST_SPAN_MM)
    count, edges = np.histogram(widths, bins=_BARS, range=span)
    pieces = planned.piece_set.pieces
    colours = planned.piece_colours
    form = stations.foretold
    return {
        "verdict": {"level": verdict.level,
                    "reasons": [to_json(reason) | {"fixes": cures} for reason, cures in
                                zip(verdict.reasons, reasons_fixed(stations), strict=True)]},
        "figures": to_json(figures),
        "lost": [to_json(one) for one in foretold_grade(stations).lost],
        # Cut as it lies on the mesh, it would go so far.
        "drawn_mm": None if form is None or form.left_mm is None else round(form.most_mm, 2),
        "hours": "" if figures.hours is None else hours_text(figures.hours),
        "widths": {"from": round(float(edges[0]), 2), "to": round(float(edges[-1]), 2),
                   "count": count.tolist()},
        "pieces": [
            {
                "id": piece.id,
                "kind": int(kind),
                "colour": "#" + bytes(colour).hex(),
                "outline": piece.outline.round(2).tolist(),
                "holes": piece.holes[:, 1:4].round(2).tolist(),
            }
            for piece, kind, colour in zip(pieces, planned.kinds, colours, strict=True)
        ],
        "fastened": np.flatnonzero(planned.piece_set.fastened).tolist(),
    }, {}  # fmt: skip


def cut_ribbons(stations: Stations) -> dict[str, np.ndarray[Any, Any]]:
    """Return ribbons as they are cut, and whose piece each rung is."""
    planned = stations.planned
    woven, pieces = planned.woven, planned.piece_set.pieces
    stretches = piece_stretches(woven.ribbons, woven.weave, pieces)
    owner = np.zeros(woven.ribbons.n_rungs, dtype="<u4")
    owner[stretches.rung] = np.repeat(np.arange(len(pieces)), np.diff(stretches.offsets))
    return strips(woven, planned.colours) | {"owner": owner}


def _cut(stations: Stations) -> Told:
    """Return ribbons as they are cut, and where there is trouble."""
    counts, more = trouble(stations.planned, stations.foretold)
    return _packed({"cut": True, "trouble": counts}, cut_ribbons(stations) | more)


def _sheets(stations: Stations) -> Told:
    """Return where pieces lie on sheets."""
    planned, layout = stations.planned, stations.layout
    margin = stations.asked.stock.margin_mm
    return {
        "effort": planned.settings.search.effort,
        "sheets": [
            {"width": sheet.width_mm, "height": sheet.height_mm, "margin": margin}
            for sheet in layout.sheets
        ],
        "placed": [
            [int(origin), place.sheet, round(place.x_mm, 2), round(place.y_mm, 2),
             round(place.rotation_deg, 4)]
            for origin, place in zip(planned.origins.tolist(), layout.placements, strict=True)
        ],
    }, {}  # fmt: skip


def _steps(planned: PlannedJob) -> Told:
    """Return the steps of assembly."""
    order = order_of(planned, "quick", planned.settings.search.seed)
    steps = build_steps(planned.piece_set, order, sort_asked(planned.settings.pieces.fastener))
    return {"steps": [{"pieces": list(step.pieces), "text": step.text} for step in steps]}, {}


@cured
def make(kept: dict[str, Any], wish: dict[str, Any], tell: Tell) -> None:
    """Make the job of a wish in a new folder, as the command line does, and tell where it is."""
    job = Stations.read(wish["mesh"], wish["options"])
    job.progress = progress_of(tell, "make")
    known = _known(kept, wish).get(mesh_key(job.asked))
    if known is not None:
        job.know(loaded=known)
    folder = new_folder(Path(wish["folder"]), job.asked)
    clear_abandoned(folder)
    finished, _, chosen = make_or_advise(job, folder)
    verdict = finished.job.verdict
    tell(({"made": folder.name, "chosen": chosen, "verdict": verdict.headline,
           "level": verdict.level}, {}))  # fmt: skip


def new_folder(parent: Path, settings: Settings) -> Path:
    """Return the path of a folder that is not there yet, named after the mesh."""
    mesh = settings.mesh.source
    name = mesh.partition("?")[0].removeprefix("shape:") if is_shape(mesh) else Path(mesh).stem
    for number in range(1, 10_000):
        folder = parent / (name if number == 1 else f"{name}-{number}")
        if not folder.exists():
            return folder
    raise InputError(f"{parent} has too many jobs of {name}; move some of them elsewhere")
