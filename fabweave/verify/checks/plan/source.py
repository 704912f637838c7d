"""Check the woven mesh against the settings: its size, and the mesh or shape that they name."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.verify.checks.plan.openings import (
    Circle,
    LeftOut,
    check_openings,
    faces_left,
    left_out,
)
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.supplies import length_of
from fabweave.verify.measure.walks import LoadedMesh
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.source_mesh import SourceMesh
from fabweave.verify.statement import Place, Tally

#: Sizes come of a multiplication or a few; corners may have been welded to others near by.
_SIZE, _WELDED = 1e-9, 1e-6
#: Which coordinates become x, y and z, and with which sign, if this axis points up.
_TURNED = {
    "z": ((1, 0), (1, 1), (1, 2)),
    "y": ((1, 0), (-1, 2), (1, 1)),
    "x": ((1, 1), (1, 2), (1, 0)),
}
#: Of built-in shapes: the Euler characteristic, and what is multiplied to count the faces: a
#: number, and parameters, with what they are unless the shape says otherwise.
_SHAPES: dict[str, tuple[int, int, tuple[tuple[str, int], ...]]] = {
    "tetrahedron": (2, 4, ()),
    "cube": (2, 6, (("n", 1), ("n", 1))),
    "octahedron": (2, 8, ()),
    "icosahedron": (2, 20, ()),
    "dodecahedron": (2, 12, ()),
    "torus": (0, 1, (("m", 24), ("n", 12))),
    "sphere": (2, 6, (("n", 8), ("n", 8))),
    "tube": (0, 1, (("m", 16), ("n", 12))),
    "hemisphere": (1, 12, (("n", 4), ("n", 4))),
    "hypar": (1, 1, (("m", 10), ("n", 10))),
}

#: Those that have a boundary.
_OPEN = ("tube", "hemisphere", "hypar")


def check_source(job: Job, tally: Tally) -> None:
    """Check the size of the woven mesh, and its faces where those that it comes from are known.

    A size is the greatest extent of what is woven, whatever was done to the mesh; where faces were
    left out afterwards, of what was there before. Remeshing and refining make other faces; fairing
    and symmetry move their corners.
    """
    mesh, options = required(job.mesh), job.options
    place = tally.at("woven_mesh.obj").against("job.toml")
    extent = _extent(mesh.vertices[mesh.corner])
    told, outcome = left_out(options), (job.settings or {}).get("outcome")
    outcome = outcome if isinstance(outcome, dict) else {}
    if (size := length_of(options.get("size"))) is not None:
        if told:
            place.at_most("its greatest extent", extent, size * (1.0 + _SIZE), "the size")
        else:
            place.number("its greatest extent", extent, size, within=_SIZE * size)
    gone: int | None = 0
    if told or "openings" in outcome:
        halved = options.get("pattern") == "triaxial"
        here = tally.at("job.toml", "outcome", "openings")
        gone = check_openings(mesh, told, outcome, halved=halved, place=here)
    if options.get("remesh", "none") != "none":
        return
    finer = bool(options.get("refine")) or options.get("pattern") == "triaxial"
    name = options.get("mesh")
    if isinstance(name, str) and name.startswith("shape:"):
        refined = bool(options.get("refine"))
        if gone is not None:
            _check_shape(
                name, mesh, place,
                finer=finer, refined=refined, told=told, gone=gone,
            )  # fmt: skip
    if told.diameters_mm and _is_moved(options):
        return  # where corners were when the opening was made, nobody can tell
    if job.source is not None and not finer and options.get("bodies", "all") == "all":
        _check_faces(job.source, mesh, options, told, place)


def _is_moved(options: dict[str, Any]) -> bool:
    """Say whether corners were moved along the surface."""
    return bool(options.get("fair") or options.get("symmetrise"))


def _extent(points: Floats) -> float:
    """Return the largest side of the bounding box of some points."""
    return float(np.ptp(points, axis=0).max())


def _check_shape(
    name: str, mesh: LoadedMesh, place: Place, *,
    finer: bool, refined: bool, told: LeftOut, gone: int,
) -> None:  # fmt: skip
    """Check the faces and the Euler characteristic of a built-in shape that is known here.

    Each opening takes a disc of faces, and lowers the Euler characteristic by one where the shape
    was closed; what faces by number do to it, nobody can tell beforehand.
    """
    kind, _, query = name.removeprefix("shape:").partition("?")
    if kind not in _SHAPES:
        return
    euler, wanted, parameters = _SHAPES[kind]
    # Refining may give up what lies along a boundary.
    sure = (not refined or bool((mesh.twin >= 0).all())) if not told else kind not in _OPEN
    if sure and not told.faces:
        edges = len(mesh.corner) - len(mesh.inner)
        found = len(np.unique(mesh.corner)) - edges + len(mesh.centres)
        place.equal(
            f"its Euler characteristic, as a {kind},",
            found,
            euler - len(told.diameters_mm),
        )
    if not finer:
        values = dict(pair.partition("=")[::2] for pair in query.split("&"))
        for key, usual in parameters:
            wanted *= int(values.get(key, usual))
        place.equal(f"its number of faces, as a {kind},", len(mesh.centres) + gone, wanted)


def _check_faces(
    source: SourceMesh,
    mesh: LoadedMesh,
    options: dict[str, Any],
    told: LeftOut,
    place: Place,
) -> None:
    """Check that the faces are those of the mesh that was given: turned upright, and scaled.

    Those that were left out are not there; rims of openings lie on their circles instead.
    """
    faces = [face for face in source.faces if len(face) > 2]
    given = np.concatenate(faces)
    axes = _TURNED[str(options.get("up", "z"))]
    given = np.stack([sign * given[:, axis] for sign, axis in axes], axis=1)
    before = _extent(given)
    sizes = np.bincount(mesh.face)
    place = place.against(source.name)
    points = mesh.vertices[mesh.corner]
    extent = _extent(points)
    scale = 1.0
    if (size := length_of(options.get("size"))) is not None and before > 0.0:
        # What was left out was there when it was brought to size.
        scale = (size if told else extent) / before
    near = _WELDED * extent
    there = _faces(points, sizes, near)
    due = _faces(scale * given, np.array([len(face) for face in faces]), near)
    due, circles = faces_left(due, told, near)
    if not place.equal("the number of its faces", len(there), len(due)):
        return
    moved = _is_moved(options)
    off = [
        at
        for at, (face, other) in enumerate(zip(there, due, strict=True))
        if len(face) != len(other) or not (moved or _same(face, other, 4 * near, circles))
    ]
    place.count(len(there))
    if off:
        place.fail(
            f"{len(off)} faces are not as in {source.name}, first face {off[0]}; if that file was "
            "changed after the job was made, make the job again"
        )


def _faces(points: Floats, sizes: Ints, near: float) -> list[Floats]:
    """Part corners into faces, without corners at the place of the one before, nor what collapses.

    Such corners may have been joined, and faces left out that have fewer than three others.
    """
    last = np.cumsum(sizes) - 1
    previous = np.arange(len(points)) - 1
    previous[(last - sizes + 1)[sizes > 0]] = last[sizes > 0]
    keep = np.abs(points - points[previous]).max(axis=1) > near
    left = np.bincount(np.repeat(np.arange(len(sizes)), sizes), keep, len(sizes)).astype(int)
    parts = np.split(points[keep], np.cumsum(left)[:-1])
    return [face for face in parts if len(face) > 2]


def _same(face: Floats, other: Floats, near: float, circles: Sequence[Circle]) -> bool:
    """Say whether two faces have the same corners, from any of them on, and either way round.

    Corners of the first may have been moved towards the circle of a rim, or onto it.
    """
    return any(
        bool(_moved(face, np.roll(way, shift, axis=0), near, circles).all())
        for way in (other, other[::-1])
        for shift in range(len(face))
    )


def _moved(face: Floats, other: Floats, near: float, circles: Sequence[Circle]) -> Flags:
    """Return which corners of a face are those of another, or nearer to a circle than they."""
    there: Flags = np.abs(face - other).max(axis=1) <= near
    for circle in circles:
        # Straight to the circle or away from its middle, in plan.
        middle = [circle.x_mm, circle.y_mm]
        to, way = face[:, :2] - middle, other[:, :2] - middle
        across = np.abs(to[:, 0] * way[:, 1] - to[:, 1] * way[:, 0])
        straight = across <= near * np.linalg.norm(way, axis=1)
        nearer = np.abs(circle.far(face) - circle.radius_mm) < np.abs(
            circle.far(other) - circle.radius_mm
        )
        there = there | (straight & nearer)
    return there
