"""Make the viewer: one web page with the woven object, its pieces, its sheets and its steps."""

import html
import json
import re
from base64 import b64encode
from collections.abc import Sequence
from importlib import resources
from itertools import accumulate, groupby, pairwise
from typing import Any

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.core.colour_space import Colours
from fabweave.core.records import fingerprint, optional, record, to_json
from fabweave.former.plates import Laid
from fabweave.former.way_out import leaving
from fabweave.piece.development import piece_stretches
from fabweave.piece.piece import Piece
from fabweave.plan.crossing_map import CrossingMap, StepRecord
from fabweave.plan.grade import Place
from fabweave.ribbon.project import Ribbons
from fabweave.show.bundle import bundled
from fabweave.weave.pattern import Weave

#: Coordinates are whole numbers of steps from the lower corner, up to this.
_STEPS, _MOST = 65535, 32767


@record
class Motion:
    """How the ends of all rungs move, as the viewer reads it.

    Parameters
    ----------
    step_mm : float
    steps : str
        x, y, z of the right and the left end of every rung, as signed 16-bit little-endian
        numbers of steps in base64.
    """

    step_mm: float
    steps: str


@record
class SpaceRecord:
    """Every piece's stretch of ribbon in space, as the viewer reads it.

    A stretch is a chain of rungs, see ``Stretches``.

    Parameters
    ----------
    layer_mm : float or tuple of float
        Thickness of the material, or of each thread's: the layers of a lap are drawn this far
        apart.
    origin_mm, step_mm : (float, float, float), float
        Coordinates are whole numbers of steps from the origin.
    counts : tuple of int
        The number of rungs of each piece.
    panels : tuple of tuples of int
        For each piece the rung, from its own first, at which the panel of each station begins.
    rungs : str
        x, y, z of the right and the left end of every rung, as unsigned 16-bit little-endian
        numbers in base64.
    from_right : str
        A byte for each rung, in base64: whether the diagonal of the quad that follows starts at
        the right rail.
    let_go, sway : Motion, optional
        How the ends of rungs go when the object is let go, and in the way in which it moves most
        easily.
    """

    layer_mm: float | tuple[float, ...]
    origin_mm: tuple[float, float, float]
    step_mm: float
    counts: tuple[int, ...]
    panels: tuple[tuple[int, ...], ...]
    rungs: str
    from_right: str
    let_go: Motion | None = optional()
    sway: Motion | None = optional()


def space_record(
    ribbons: Ribbons,
    weave: Weave,
    pieces: Sequence[Piece],
    *,
    layer_mm: float | tuple[float, ...],
    relaxed: Ribbons | None = None,
    mode: FloatArray | None = None,
) -> SpaceRecord:
    """Return every piece's stretch of ribbon in space.

    Parameters
    ----------
    ribbons, weave, pieces
    layer_mm : float or tuple of float
        See ``SpaceRecord``.
    relaxed : Ribbons, optional
        The same when the object was let go.
    mode : (X, 3) float array, optional
        How crossings go in the way in which it moves most easily.
    """
    stretches = piece_stretches(ribbons, weave, pieces)
    rung = stretches.rung
    corners = np.stack((ribbons.right[rung], ribbons.left[rung]), axis=1)
    low = corners.reshape(-1, 3).min(axis=0)
    step = max(float((corners.reshape(-1, 3).max(axis=0) - low).max()) / _STEPS, 1e-9)
    panels = np.split(stretches.panel, stretches.panel_offsets[1:-1])
    x, y, z = low.tolist()
    return SpaceRecord(
        layer_mm=layer_mm,
        origin_mm=(x, y, z),
        step_mm=step,
        counts=tuple(np.diff(stretches.offsets).tolist()),
        panels=tuple(tuple(panel.tolist()) for panel in panels),
        rungs=_text(np.round((corners - low) / step).astype("<u2")),
        from_right=_text(ribbons.from_right[rung].astype(np.uint8)),
        let_go=None
        if relaxed is None
        else _motion(np.stack((relaxed.right[rung], relaxed.left[rung]), axis=1) - corners),
        sway=None if mode is None else _motion(_swayed(ribbons, weave, mode)[rung]),
    )


def _swayed(ribbons: Ribbons, weave: Weave, mode: FloatArray) -> FloatArray:
    """Return how both ends of rungs go with their crossings, evenly from one to the next."""
    at = np.arange(ribbons.n_rungs)
    own = weave.threads.crossing
    panel = np.repeat(ribbons.entry, 2) + np.tile([0, 1], len(ribbons.entry))
    there = mode[np.repeat(own, 2)]
    each = np.stack([np.interp(at, panel, axis) for axis in there.T], axis=1)
    return np.repeat(each[:, None], 2, axis=1)


def _motion(steps: FloatArray) -> Motion:
    """Return how ends of rungs move, (N, 2, 3), packed."""
    step_mm = max(float(np.abs(steps).max()) / _MOST, 1e-9)
    return Motion(step_mm=step_mm, steps=_text(np.round(steps / step_mm).astype("<i2")))


def _text(array: np.ndarray[Any, np.dtype[Any]]) -> str:
    """Return an array's bytes as base64."""
    return b64encode(array.tobytes()).decode("ascii")


SCHEMA = "fabweave.viewer/1"

#: Numbers of the map are rounded to a thousandth in the page, which is for looking.
_DECIMALS = 3


def viewer_page(
    crossing_map: CrossingMap,
    space: SpaceRecord,
    *,
    title: str,
    colours: Colours,
    view_deg: tuple[float, float],
    hands: dict[str, Any],
    step_views_deg: Sequence[tuple[float, float]] = (),
    worst: Sequence[Place] = (),
    former: Laid | None = None,
) -> str:
    """Return the viewer as one HTML file that needs nothing else, neither files nor a network.

    Parameters
    ----------
    crossing_map : CrossingMap
    space : SpaceRecord
        The pieces in space.
    title : str
        Name of the job.
    colours : (R, 3) uint8 array
        The colour of each rung of all pieces, one after another.
    view_deg : (float, float)
        Azimuth and elevation of the first view.
    hands : dict
        How long it takes: ``seconds`` of each step, half way from a quick to a slow maker, and
        ``hours`` of the whole job, for both.
    step_views_deg : sequence of (float, float)
        Azimuth and elevation from which the manual shows each step; of the first ones, or of none,
        where it does not show them all.
    worst : sequence of Place
        The worst places, from the grade.
    former : Laid, optional
        Shown with the steps for which it is inside.

    Returns
    -------
    str
        The page. It holds the whole map, numbers rounded to a thousandth.
    """
    told = json.dumps(crossing_map.to_json())
    shown = json.loads(told, parse_float=_short)
    data = {
        "schema": SCHEMA,
        "title": title,
        # What is remembered between visits is kept under this name.
        "job": fingerprint(told),
        "colours": _colour_runs(colours, space),
        "view_deg": list(view_deg),
        "views_deg": [list(view) for view in step_views_deg],
        "hands": hands,
        "worst": [to_json(place) for place in worst],
        "former": _former(former, crossing_map.steps),
        "plan": shown,
        "space": to_json(space),
    }
    parts = {
        "TITLE": html.escape(title),
        "STYLE": _page_file("page.css"),
        "DATA": _compact(data),
        "SCRIPT": bundled("show/viewer/viewer_page/page.js"),
    }
    # One pass, so that nothing that is put in is looked at again.
    return re.sub(r"\{\{(\w+)\}\}", lambda name: parts[name[1]], _page_file("page.html"))


def _former(laid: Laid | None, steps: Sequence[StepRecord]) -> dict[str, Any]:
    """Return the outlines of a former's plates, and when it is taken out."""
    if laid is None:
        return {"until": 0, "plates": []}
    return {
        **to_json(leaving(laid, steps)),
        "plates": [
            {
                "origin": plate.plane.origin.round(_DECIMALS).tolist(),
                "axes": plate.plane.axes.round(6).tolist(),
                "rings": [
                    shapely.get_coordinates(ring)[:-1].round(2).tolist()
                    for ring in (plate.outline.exterior, *plate.outline.interiors)
                ],
            }
            for plate in laid.former.plates
        ],
    }


def _colour_runs(colours: Colours, space: SpaceRecord) -> list[list[list[str | int]]]:
    """Return for each piece its colours along it, each with the number of rungs that have it."""
    words = ["#" + bytes(colour).hex() for colour in colours]
    bounds = list(accumulate(space.counts, initial=0))
    return [
        [[word, len(list(run))] for word, run in groupby(words[start:end])]
        for start, end in pairwise(bounds)
    ]


def _page_file(name: str) -> str:
    """Return one of the files that the page is made of."""
    return resources.files("fabweave.show.viewer").joinpath("viewer_page", name).read_text("utf-8")


def _compact(value: Any) -> str:
    """Return JSON that can stand in a script element: no tag begins in it."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")


def _short(number: str) -> float | int:
    """Read a number rounded, a whole one without a point."""
    value = round(float(number), _DECIMALS)
    return int(value) if value.is_integer() else value
