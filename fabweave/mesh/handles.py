"""Add handles to a mesh: two faces give way to a tube of quads from one to the other."""

import math
import re
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, unit
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh

#: Rings of quads along a tube: fewer would kink, and more are a slip.
_LEAST_RINGS, _MOST_RINGS = 3, 400
#: Faces whose normals point away from one another by less than 45° look through the object, and
#: are joined by a tunnel.
_THROUGH = math.sqrt(0.5)
#: Points along the middle of a tube at which its length and its frames are taken.
_STEPS = 256


def parse_handles(text: str | None) -> tuple[tuple[int, int], ...]:
    """Read which pairs of faces are to be joined, such as ``12:40,3:9``; none if nothing is said.

    Raises
    ------
    InputError
        If it reads otherwise, or names a face twice.

    Examples
    --------
    >>> parse_handles("12:40, 3:9")
    ((12, 40), (3, 9))
    """
    if text is None:
        return ()
    pairs = []
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d{1,9})\s*:\s*(\d{1,9})\s*", part, re.ASCII)
        if found is None:
            raise InputError(
                f"{part.strip()[:40]!r} names no two faces; write their numbers, counted from 0, "
                "such as 12:40, and commas between handles"
            )
        pairs.append((int(found[1]), int(found[2])))
    named = [face for pair in pairs for face in pair]
    twice = next((face for face in named if named.count(face) > 1), None)
    if twice is not None:
        raise InputError(f"face {twice} is named twice; each can hold one end of one handle")
    return tuple(pairs)


def add_handles(
    mesh: PolyMesh, pairs: tuple[tuple[int, int], ...]
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Join pairs of faces by tubes of quads.

    The two faces go, and a tube takes their place, whose middle is a cubic Hermite curve that
    leaves either face along its normal, and whose rings are about as far apart as their corners.
    Faces that look away from one another through the object are joined by a tunnel through it
    instead. Of all ways to match their corners, the one that turns least is taken. The Euler
    characteristic falls by two for each handle: on one body, the genus rises by one.

    Parameters
    ----------
    mesh : PolyMesh
        Consistently oriented.
    pairs : tuple of (int, int)
        Numbers of faces.

    Returns
    -------
    mesh : PolyMesh
        The faces that stay, in their order, and those of the tubes.
    notes : tuple of str
        What was done.

    Raises
    ------
    InputError
        If there is no such face, or the two are the same, touch, or differ in their numbers of
        sides.

    Examples
    --------
    >>> from fabweave.mesh.check import check_mesh
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> check_mesh(add_handles(sphere(4, 50.0), ((0, 95),))[0]).genus
    1

    References
    ----------
    Akleman, Chen, "Guaranteeing the 2-manifold property for meshes with doubly linked face list",
    Int. J. of Shape Modeling 5(2), 1999: inserting an edge between two faces makes a handle.
    """
    if not pairs:
        return mesh, ()
    faces = mesh.faces()
    for one, two in pairs:
        _require_joinable(faces, one, two)
    points, tubes, notes = [mesh.vertices], [], []
    count = mesh.n_vertices
    for one, two in pairs:
        new, quads, kind = _tube(mesh.vertices, faces[one], faces[two], count)
        points.append(new)
        tubes += quads
        count += len(new)
        notes.append(
            f"faces {one} and {two} were joined by a {kind} of "
            + agree(len(quads) // len(faces[one]), "{n} ring[|s] of quads")
        )
    gone = {face for pair in pairs for face in pair}
    kept = [face for number, face in enumerate(faces) if number not in gone]
    return PolyMesh.from_faces(np.concatenate(points), [*kept, *tubes]), tuple(notes)


def _require_joinable(faces: list[list[int]], one: int, two: int) -> None:
    """Raise InputError for two faces between which there can be no handle."""
    told = f"a handle from face {one} to face {two} cannot be made: "
    unknown = max(one, two)
    if unknown >= len(faces):
        raise InputError(
            f"{told}there is no face {unknown}; the mesh has {len(faces)}, counted from 0, before "
            "it is remeshed or refined"
        )
    if set(faces[one]) & set(faces[two]):
        raise InputError(
            f"{told}they share a corner, and a tube needs room; name faces further apart"
        )
    sides = len(faces[one]), len(faces[two])
    if sides[0] != sides[1]:
        raise InputError(
            f"{told}they have {sides[0]} and {sides[1]} sides, and a tube of quads joins equal "
            "numbers; name faces that agree"
        )


def _tube(
    points: FloatArray, one: list[int], two: list[int], count: int
) -> tuple[FloatArray, list[list[int]], str]:
    """Return the new vertices of a tube, its faces, and what it is."""
    start, end = points[one], points[two]
    origin, normal = start.mean(axis=0), _normal(start)
    target, other = end.mean(axis=0), _normal(end)
    way = target - origin
    distance = float(np.linalg.norm(way))
    away = min(float(way @ normal), -float(way @ other)) / distance if distance else 0.0
    tunnel = max(float(way @ normal), -float(way @ other)) < -_THROUGH * distance
    # Faces that look at one another need no bulge; the more they look away, the wider the bow.
    reach = distance * (1.0 if tunnel else 2.0 - away if away > 0 else 2.0 - 4.0 * away)
    sign = -1.0 if tunnel else 1.0
    middle, along = _hermite(origin, target, sign * reach * normal, -sign * reach * other)
    frames = _frames(along)
    steps = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    side = np.mean([_side(start), _side(end)])
    rings = int(np.clip(round(length[-1] / side), _LEAST_RINGS, _MOST_RINGS))
    here, shift = _matched(start - origin, end - target, frames)
    order = [two[(shift - k) % len(two)] for k in range(len(two))]
    there = (points[order] - target) @ frames[-1].T
    at = np.searchsorted(length, np.arange(1, rings) / rings * length[-1])
    share = (length[at] / length[-1])[:, None, None]
    local = (1.0 - share) * here + share * there
    new = middle[at][:, None, :] + np.einsum("rkc,rcd->rkd", local, frames[at])
    k = len(one)
    numbers = count + np.arange((rings - 1) * k).reshape(rings - 1, k)
    lines = np.concatenate([[one], numbers, [order]])
    ahead = np.roll(lines, -1, axis=1)
    quads = np.stack([lines[:-1], ahead[:-1], ahead[1:], lines[1:]], axis=-1).reshape(-1, 4)
    return new.reshape(-1, 3), quads.tolist(), "tunnel" if tunnel else "handle"


def _normal(ring: FloatArray) -> FloatArray:
    """Return the unit normal of a face, by its vector area."""
    here = ring - ring.mean(axis=0)
    return unit(np.cross(here, np.roll(here, -1, axis=0)).sum(axis=0))


def _side(ring: FloatArray) -> float:
    """Return the mean side of a face."""
    return float(np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).mean())


def _hermite(
    start: FloatArray, end: FloatArray, leave: FloatArray, arrive: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return points along a cubic Hermite curve, and its unit tangents there."""
    t = np.linspace(0.0, 1.0, _STEPS + 1)[:, None]
    place = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * leave
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * arrive
    )
    slope = (
        (6 * t**2 - 6 * t) * (start - end)
        + (3 * t**2 - 4 * t + 1) * leave
        + (3 * t**2 - 2 * t) * arrive
    )
    return place, unit(slope)


def _frames(along: FloatArray) -> FloatArray:
    """Return frames that turn as little as can be along a curve, (N, 3, 3), axes in rows.

    Each is the one before, turned by the least rotation from one tangent to the next.
    """
    first = np.eye(3)[np.argmin(np.abs(along[0]))]
    side = unit(np.cross(along[0], first))
    frames = [np.stack([side, np.cross(along[0], side), along[0]])]
    for before, after in pairwise(along):
        axis, cosine = np.cross(before, after), float(before @ after)
        cross = np.cross(np.eye(3), axis)
        turn = np.eye(3) + cross + cross @ cross / max(1.0 + cosine, 1e-9)
        frames.append(frames[-1] @ turn.T)
    return np.stack(frames)


def _matched(here: FloatArray, there: FloatArray, frames: FloatArray) -> tuple[FloatArray, int]:
    """Return the first ring in its frame, and where the other begins so that the tube turns least.

    The other ring is walked backwards, as it is seen from behind.
    """
    start, end = here @ frames[0].T, there @ frames[-1].T
    k = len(start)
    orders: list[IntArray] = [(shift - np.arange(k)) % k for shift in range(k)]
    off = [float(np.sum((start - end[order]) ** 2)) for order in orders]
    return start, int(np.argmin(np.round(off, 9)))
