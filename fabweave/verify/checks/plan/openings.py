"""Check what was left out of the woven mesh: openings have their rims, and faces are missing."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.supplies import length_of
from fabweave.verify.measure.walks import LoadedMesh
from fabweave.verify.statement import Place, stated_number

#: Lengths in job.toml are told to a thousandth.
_TOLD_MM = 1e-3
#: Topmost are points so near to the topmost one, as a share of the height; and a centre is in an
#: opening that is so far beyond its radius, as a share of it.
_LEVEL, _WITHIN = 1e-6, 1e-6


@dataclass(frozen=True)
class LeftOut:
    """What the settings leave out: faces by number, and diameters of openings by their side."""

    faces: frozenset[int]
    diameters_mm: dict[str, float]

    def __bool__(self) -> bool:
        """Say whether anything is left out."""
        return bool(self.faces or self.diameters_mm)


@dataclass(frozen=True)
class Circle:
    """Where the rim of an opening lies in plan."""

    x_mm: float
    y_mm: float
    radius_mm: float

    def far(self, points: Floats) -> Floats:
        """Return how far points are from its middle in plan."""
        return np.asarray(np.linalg.norm(points[:, :2] - [self.x_mm, self.y_mm], axis=1))


def left_out(options: dict[str, Any]) -> LeftOut:
    """Return what the settings leave out of the mesh.

    Examples
    --------
    >>> told = left_out({"leave_out": "top:80mm,12,13"})
    >>> sorted(told.faces), told.diameters_mm
    ([12, 13], {'top': 80.0})
    """
    faces, diameters = set(), {}
    for part in str(options.get("leave_out") or "").split(","):
        side, colon, length = part.strip().partition(":")
        if colon:
            diameters[side] = length_of(length) or 0.0
        elif side.isdigit():
            faces.add(int(side))
    return LeftOut(frozenset(faces), diameters)


def check_openings(
    mesh: LoadedMesh, told: LeftOut, outcome: dict[str, Any], *, halved: bool, place: Place
) -> int | None:
    """Check that what was left out is told, and that each opening has the rim that is told of it.

    Some boundary has as many vertices as a rim, none further off the circle than told, and with as
    many on it.

    Parameters
    ----------
    mesh : LoadedMesh
        The woven mesh.
    told : LeftOut
        What the settings leave out.
    outcome : dict
        What job.toml says came out.
    halved : bool
        Whether each edge of a rim got a vertex in its middle afterwards.
    place : Place

    Returns
    -------
    int or None
        How many faces were left out, as it is told; None where it is not.
    """
    records = outcome.get("openings", [])
    if not isinstance(records, list) or not all(isinstance(one, dict) for one in records):
        place.fail(f"openings are {records!r:.80}, not tables")
        return None
    sides = [one.get("side") for one in records]
    wanted = [*(["faces"] if told.faces else []), *told.diameters_mm]
    if not place.equal("what was left out, by side,", sides, wanted):
        return None
    loops = _boundaries(mesh)
    for one in records:
        side = str(one["side"])
        here = place.at(side)
        place.count()
        if side == "faces":
            here.number("faces", one.get("faces"), len(told.faces))
            continue
        here.number("diameter_mm", one.get("diameter_mm"), told.diameters_mm[side])
        _check_rim(mesh, loops, one, halved=halved, place=here)
    counts = [one.get("faces") for one in records]
    whole = all(isinstance(count, int) and count > 0 for count in counts)
    place.expect(whole, f"numbers of faces left out are {counts}")
    return sum(counts) if whole else None


def _check_rim(
    mesh: LoadedMesh, loops: Sequence[Ints], one: dict[str, Any], *, halved: bool, place: Place
) -> None:
    """Check that some boundary is the rim that is told."""
    x, y, diameter, off = (
        stated_number(one, key) for key in ("x_mm", "y_mm", "diameter_mm", "off_mm")
    )
    circle = Circle(x, y, diameter / 2.0)
    rim, beside = one.get("rim"), one.get("off")
    if not isinstance(rim, int) or not isinstance(beside, int) or not 0 <= beside <= rim > 1:
        place.fail(f"its rim has {rim!r} vertices, {beside!r} of them off the circle")
        return
    found = False
    for loop in loops:
        # What was cut at the middles of edges afterwards is not on the circle.
        away = np.sort(np.abs(circle.far(mesh.vertices[loop]) - circle.radius_mm))
        near = int(np.count_nonzero(away <= off + _TOLD_MM))
        on = int(np.count_nonzero(away <= _TOLD_MM))
        found |= near >= rim and on >= rim - beside and (halved or len(loop) >= rim)
    place.expect(
        found,
        f"no boundary of woven_mesh.obj has {rim} vertices within {off:g} mm of a circle of "
        f"{diameter:g} mm around ({x:g}, {y:g}), and {rim - beside} on it",
    )


def _boundaries(mesh: LoadedMesh) -> list[Ints]:
    """Return the vertices of each boundary loop of a mesh."""
    rim = np.flatnonzero(mesh.twin < 0)
    ahead = dict(zip(mesh.corner[rim].tolist(), mesh.corner[mesh.next[rim]].tolist(), strict=True))
    loops = []
    while ahead:
        loop = [next(iter(ahead))]
        while (following := ahead.pop(loop[-1], None)) is not None:
            loop.append(following)
        loops.append(np.array(loop[:-1]))
    return loops


def faces_left(
    faces: Sequence[Floats], told: LeftOut, near: float
) -> tuple[list[Floats], list[Circle]]:
    """Return the faces, (K, 3) corners each, that stay of a given mesh, and the circles of rims.

    Parameters
    ----------
    faces : sequence of (K, 3) float arrays
        Upright and scaled.
    told : LeftOut
    near : float
        Corners no further apart are one vertex.
    """
    gone = set(told.faces)
    circles = []
    for side, diameter in told.diameters_mm.items():
        circle, patch = _patch(faces, side, diameter / 2.0, near)
        circles.append(circle)
        gone |= patch
    return [face for at, face in enumerate(faces) if at not in gone], circles


def _patch(
    faces: Sequence[Floats], side: str, radius: float, near: float
) -> tuple[Circle, set[int]]:
    """Return the circle of an opening, and the faces that hang together in it."""
    up = -1.0 if side == "bottom" else 1.0
    points = np.concatenate(faces)
    height = up * points[:, 2]
    least = height.max() - _LEVEL * np.ptp(height)
    # Each vertex counts once, however many faces have it.
    extreme = points[height >= least]
    _, first = np.unique(np.rint(extreme / (4.0 * near)), axis=0, return_index=True)
    x, y = extreme[first][:, :2].mean(axis=0).tolist()
    circle = Circle(x, y, radius)
    centres = np.array([face.mean(axis=0) for face in faces])
    within = circle.far(centres) <= radius * (1.0 + _WITHIN)
    sides: dict[tuple[Any, ...], list[int]] = defaultdict(list)
    for at in np.flatnonzero(within).tolist():
        keys = [tuple(row) for row in np.rint(faces[at] / (4.0 * near)).tolist()]
        for one, two in zip(keys, keys[1:] + keys[:1], strict=True):
            sides[min(one, two), max(one, two)].append(at)
    beside: dict[int, set[int]] = defaultdict(set)
    for group in sides.values():
        for at in group:
            beside[at].update(group)
    waiting = [
        at for at in np.flatnonzero(within).tolist() if (up * faces[at][:, 2]).max() >= least
    ]
    found: set[int] = set()
    while waiting:
        at = waiting.pop()
        if at not in found:
            found.add(at)
            waiting += beside[at]
    return circle, found
