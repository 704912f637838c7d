"""Write the woven object as a model or a picture, without making anything to cut."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.errors import InputError
from fabweave.core.files import check_file, write_files
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.picture.bodies import Body, clashing_facets, ribbon_bodies, yarn_bodies
from fabweave.picture.camera import View
from fabweave.picture.contact_sheet import side_by_side
from fabweave.picture.model_files import model_bytes, woven_glb
from fabweave.picture.object_picture import bodies_picture, png_bytes, weave_picture
from fabweave.picture.twist_picture import ViewOf, weave_on_mesh
from fabweave.picture.yarns import Yarns, spin_yarns
from fabweave.ribbon.lay import WovenObject
from fabweave.weave.weave_mesh import WovenMesh

#: Suffixes of the files that can be written; those for printing hold solids.
SUFFIXES = (".glb", ".obj", ".ply", ".stl", ".3mf", ".png")
_PRINTED = (".stl", ".3mf")
#: A picture that was asked for may take a little longer than others, and be smoother.
_SAMPLES = 3


@dataclass(frozen=True)
class YarnOptions:
    """How yarns are spun: one radius for all, or the thickest that have room; and their sides."""

    radius_mm: float | None = None
    sides: int = 12


def check_suffix(path: Path, mesh: str | None = None) -> str:
    """Return which kind of file a path asks for.

    Raises
    ------
    InputError
        If it is none that can be written, the folder is not there, or it is the mesh itself.

    Examples
    --------
    >>> check_suffix(Path("vase.GLB"))
    '.glb'
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"the name {path.name} does not tell the format: end it with one of "
            f"{', '.join(SUFFIXES)}"
        )
    check_file(path, suffix, source=mesh)
    return suffix


def write_model(
    settings: Settings,
    path: Path,
    *,
    yarn: YarnOptions | None = None,
    views: Sequence[View] = (),
    show: Literal["weave"] | ViewOf = "weave",
    progress: Progress = no_progress,
) -> dict[str, Any]:
    """Weave a mesh and write the woven object in the format that a file's suffix names.

    Parameters
    ----------
    settings : Settings
        The mesh and how it is woven.
    path : Path
        Ends in one of ``SUFFIXES``; what is there is replaced when the new file is complete.
    yarn : YarnOptions or None
        Spin yarns instead of laying ribbons. Ribbons for printing are as thick as the material.
    views : sequence of View
        For a picture: from where, side by side; none lets fabweave choose one.
    show : str
        What a picture shows: the weave, or what it is on the mesh, see ``weave_on_mesh``.
    progress : callable
        Told what is being done.

    Returns
    -------
    dict
        What was written: ``file``, ``threads``, ``crossings``, ``kind`` (ribbons, solid ribbons,
        yarns), ``radius_mm`` of yarns as least, greatest and greatest possible, and ``notes``.

    Raises
    ------
    InputError
        For bad input, settings, or a suffix that cannot be written.
    CannotMakeError
        For what cannot be woven, or yarns that have no room.
    """
    suffix = check_suffix(path, settings.mesh.source)
    if show != "weave" and (suffix != ".png" or yarn is not None):
        raise InputError(f"--show {show} is a picture of the mesh: write .png, and without --yarn")
    job = Stations(settings, progress=progress)
    if show != "weave":
        return _shown_on_mesh(job.weave, path, show, views)
    woven, supplies = job.clear_ribbons if yarn is None else job.ribbons, job.completed[1]
    colours = job.colours(woven)
    facts = _facts(path, "ribbons" if yarn is None else "yarns", woven)
    bodies: tuple[Body, ...]
    if yarn is not None:
        bodies, facts["radius_mm"] = _spun(woven, colours, yarn, progress)
    elif suffix in _PRINTED:
        thicknesses = dict.fromkeys(f"{material.thickness_mm:g}" for material in supplies.materials)
        facts["kind"] = f"solid ribbons, {' and '.join(thicknesses)} mm thick"
        thickness = supplies.thickness_mm(woven.bunches)
        bodies = ribbon_bodies(woven.ribbons, woven.labels, colours, thickness_mm=thickness)
        facts["notes"] += _clashes(bodies)
    else:
        bodies = ribbon_bodies(woven.ribbons, woven.labels, colours)
    progress("model", 0, 1)
    if suffix == ".png":
        data = _picture(woven, colours, bodies if yarn is not None else None, views)
    elif suffix == ".glb" and yarn is None:
        data = woven_glb(woven.ribbons, woven.labels, colours)
    else:
        data = model_bytes(suffix, bodies)
    write_files({path: data})
    return facts


def _shown_on_mesh(
    woven: WovenMesh, path: Path, show: ViewOf, views: Sequence[View]
) -> dict[str, Any]:
    """Write a picture of the weave on its mesh; ribbons are not laid for it."""
    tiles = [
        weave_on_mesh(show, woven.mesh, woven.halfedges, woven.weave, view=view)
        for view in views or (None,)
    ]
    write_files({path: png_bytes(side_by_side(*tiles))})
    return _facts(path, show, woven)


def _facts(path: Path, kind: str, woven: WovenMesh) -> dict[str, Any]:
    """Return what is told of a file that shows a woven mesh."""
    return {
        "file": str(path),
        "kind": kind,
        "threads": woven.weave.threads.n_threads,
        "crossings": woven.weave.threads.n_crossings,
        "notes": list(woven.notes),
    }


def _clashes(bodies: tuple[Body, ...]) -> list[str]:
    """Return a note where solid ribbons touch one another or themselves; a printer welds them."""
    pairs = clashing_facets(bodies)
    if len(pairs) == 0:
        return []
    names = [bodies[index].label for index in np.unique(pairs).tolist()]
    shown = ", ".join(names[:6]) + (" …" if len(names) > 6 else "")
    return [
        f"solid ribbons touch in {len(pairs)} pairs of facets (threads {shown}): a printer would "
        "weld them there; make the object larger, use a smaller --thickness or --width, or print "
        "--yarn, which never touches"
    ]


def spin_object(woven: WovenObject, yarn: YarnOptions, progress: Progress = no_progress) -> Yarns:
    """Spin a yarn along every thread of a woven object."""
    return spin_yarns(
        woven.mesh,
        woven.halfedges,
        woven.weave,
        woven.labels,
        radius_mm=yarn.radius_mm,
        sides=yarn.sides,
        portals=woven.source.portals,
        progress=progress,
    )


def _spun(
    woven: WovenObject, colours: Colours, yarn: YarnOptions, progress: Progress
) -> tuple[tuple[Body, ...], dict[str, float]]:
    """Return yarns as bodies, and their radii."""
    yarns = spin_object(woven, yarn, progress)
    least, most = float(yarns.radius_mm.min()), float(yarns.radius_mm.max())
    radii = {"least": least, "greatest": most, "greatest_possible": most * yarns.most}
    return yarn_bodies(yarns, woven.labels, colours), {
        name: round(value, 4) for name, value in radii.items()
    }


def _picture(
    woven: WovenObject,
    colours: Colours,
    bodies: tuple[Body, ...] | None,
    views: Sequence[View],
) -> bytes:
    """Return a picture from each of the views, side by side, as PNG."""
    tiles = (
        weave_picture(woven.ribbons, colours, view=view, samples=_SAMPLES)
        if bodies is None
        else bodies_picture(bodies, view=view)
        for view in views or (None,)
    )
    return png_bytes(side_by_side(*tiles))
