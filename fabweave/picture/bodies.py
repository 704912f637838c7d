"""Turn ribbons and yarns into the bodies that model files hold."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen, frozen_value, unit
from fabweave.core.colour_space import Colours
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.picture.surfaces import rung_colours
from fabweave.picture.yarns import Yarns
from fabweave.ribbon.project import Ribbons, following_rung

#: A thick ribbon's corner at a fold reaches at most so many half thicknesses out.
_MITRE = 2.5


@frozen_value
class Body:
    """One thread of a model: an open or closed surface of quads and triangles.

    Parameters
    ----------
    label : str
        The thread's name.
    colours : (V, 3) uint8 array
        The colour of each vertex in sRGB.
    vertices : (V, 3) float array
        Positions in millimetres.
    quads : (Q, 4) int array
    triangles : (F, 3) int array
        Faces, counter-clockwise seen from outside.
    normals : (V, 3) float array or None
        Unit normals for light that shows round what is round.
    """

    label: str
    colours: Colours
    vertices: FloatArray
    quads: IntArray
    triangles: IntArray
    normals: FloatArray | None = None

    @property
    def triangle_colours(self) -> Colours:
        """The colour of each of ``all_triangles``, that of its first corner, (F', 3)."""
        return np.asarray(self.colours[self.all_triangles[:, 0]])

    @property
    def all_triangles(self) -> IntArray:
        """All faces as triangles: quads are cut from their first corner to the third, (F', 3)."""
        halves = self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return np.concatenate((halves, self.triangles))


def ribbon_bodies(
    ribbons: Ribbons,
    labels: Sequence[str],
    colours: Colours,
    *,
    thickness_mm: float | FloatArray = 0.0,
) -> tuple[Body, ...]:
    """Return the ribbons as sheets, or as closed solids as thick as their material.

    Crossing panels are planar quads; all else is folded along diagonals, and so triangles. A solid
    has a sheet on either side, half a thickness away at right angles to every crossing panel, and
    walls along the rails and at open ends.

    Parameters
    ----------
    ribbons : Ribbons
    labels : sequence of str
        Names of the threads.
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of all passes, or of the threads; see ``rung_colours``.
    thickness_mm : float or (T,) float array
        Of all threads, or of each; 0 makes sheets.

    Returns
    -------
    tuple of Body
        One for each thread with a crossing.
    """
    following = following_rung(ribbons.offsets, ribbons.closed)
    panel = flags(ribbons.n_rungs, ribbons.entry)
    shift = None
    if np.any(thickness_mm):
        every = np.broadcast_to(thickness_mm, len(labels))
        half = np.repeat(every, np.diff(ribbons.offsets))[:, None, None] / 2
        shift = half * _corner_shifts(ribbons, following, panel)
    painted = np.repeat(rung_colours(ribbons, colours), 2, axis=0)
    bodies = []
    for thread, label in enumerate(labels):
        start, end = ribbons.offsets[thread : thread + 2].tolist()
        if start == end:
            continue
        rails = np.stack((ribbons.right[start:end], ribbons.left[start:end]), axis=1)
        near = start + np.flatnonzero(following[start:end] >= 0)
        a, b = 2 * (near - start), 2 * (following[near] - start)
        c, d = b + 1, a + 1
        flat, first = panel[near], ribbons.from_right[near]
        quads = np.column_stack((a, b, c, d))[flat]
        folds = [
            np.column_stack(corners)[~flat & way]
            for corners, way in (
                ((a, b, c), first), ((a, c, d), first), ((a, b, d), ~first), ((b, c, d), ~first),
            )
        ]  # fmt: skip
        triangles = np.concatenate(folds)
        vertices, paint = rails.reshape(-1, 3), painted[2 * start : 2 * end]
        if shift is not None:
            out = shift[start:end].reshape(-1, 3)
            under = len(vertices)
            walls = [np.column_stack((a, a + under, b + under, b)),
                     np.column_stack((c, c + under, d + under, d))]  # fmt: skip
            if not ribbons.closed[thread]:
                last = under - 2
                at_end = [last, last + under, last + 1 + under, last + 1]
                walls.append(np.array([[1, 1 + under, under, 0], at_end]))
            quads = np.concatenate((quads, quads[:, ::-1] + under, *walls))
            triangles = np.concatenate((triangles, triangles[:, ::-1] + under))
            vertices = np.concatenate((vertices + out, vertices - out))
            paint = np.concatenate((paint, paint))
        bodies.append(Body(label, paint, vertices, quads, triangles))
    return tuple(bodies)


def _corner_shifts(ribbons: Ribbons, following: IntArray, panel: BoolArray) -> FloatArray:
    """Return how far each end of each rung is from the middle of a sheet two units thick.

    Returns
    -------
    (R, 2, 3) float array
        For the right and the left end.
    """
    rung = np.flatnonzero(following >= 0)
    after = following[rung]
    first = ribbons.from_right[rung][:, None]
    a, b = ribbons.right[rung], ribbons.right[after]
    c, d = ribbons.left[after], ribbons.left[rung]
    # Each quad's two triangles, and the corners that each has.
    first_normal = unit(np.where(first, np.cross(b - a, c - a), np.cross(b - a, d - a)))
    second_normal = unit(np.where(first, np.cross(c - a, d - a), np.cross(c - b, d - b)))
    mean = np.zeros((ribbons.n_rungs, 2, 3))
    # Every rung is near once at most, and after another once at most.
    mean[rung, 0] += np.where(first, first_normal + second_normal, first_normal)
    mean[rung, 1] += np.where(first, second_normal, first_normal + second_normal)
    mean[after, 0] += np.where(first, first_normal, first_normal + second_normal)
    mean[after, 1] += np.where(first, first_normal + second_normal, second_normal)
    mean = unit(mean)
    # A panel keeps its thickness; elsewhere that of the facets on the average.
    normal = mean.copy()
    flat = panel[rung]
    normal[rung[flat]] = normal[after[flat]] = first_normal[flat][:, None, :]
    cosine = np.einsum("rsj,rsj->rs", mean, normal)
    return mean / np.maximum(cosine, 1.0 / _MITRE)[:, :, None]


def yarn_bodies(yarns: Yarns, labels: Sequence[str], colours: Colours) -> tuple[Body, ...]:
    """Return the yarns as closed bodies: tubes, with flat caps where a thread ends.

    Parameters
    ----------
    yarns : Yarns
    labels : sequence of str
        Names of the threads.
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of all passes, or of the threads; see ``rung_colours``.

    Returns
    -------
    tuple of Body
        One for each thread with a crossing.
    """
    sides = yarns.sides
    painted = rung_colours(yarns, colours)
    bodies = []
    for thread, label in enumerate(labels):
        start, end = yarns.offsets[thread : thread + 2].tolist()
        count = end - start
        if count == 0:
            continue
        closed = bool(yarns.closed[thread])
        ring = np.arange(count if closed else count - 1)[:, None]
        corner = np.arange(sides)
        onward, beside = (ring + 1) % count, (corner + 1) % sides
        here, there = sides * ring, sides * onward
        quads = np.stack(
            (here + corner, here + beside, there + beside, there + corner), axis=2
        ).reshape(-1, 4)
        rim = yarns.rim[start:end]
        vertices, normals = rim.reshape(-1, 3), unit(rim - yarns.spine[start:end, None])
        normals = normals.reshape(-1, 3)
        paint = np.repeat(painted[start:end], sides, axis=0)
        triangles = np.zeros((0, 3), dtype=np.int64)
        if not closed:
            middle, last = len(vertices), sides * (count - 1)
            ends = yarns.spine[[start, end - 1]]
            way = unit(ends - yarns.spine[[start + 1, end - 2]])
            vertices, normals = np.concatenate((vertices, ends)), np.concatenate((normals, way))
            paint = np.concatenate((paint, painted[[start, end - 1]]))
            triangles = np.concatenate((
                np.column_stack((np.full(sides, middle), beside, corner)),
                np.column_stack((np.full(sides, middle + 1), last + corner, last + beside)),
            ))  # fmt: skip
        bodies.append(Body(label, paint, vertices, quads, triangles, frozen(normals)))
    return tuple(bodies)


def joined_bodies(bodies: Sequence[Body]) -> tuple[FloatArray, IntArray]:
    """Return the vertices of all bodies, one after another, and all their triangles."""
    base = np.cumsum([0, *(len(body.vertices) for body in bodies)]).tolist()
    cut = [body.all_triangles + first for body, first in zip(bodies, base, strict=False)]
    return np.concatenate([body.vertices for body in bodies]), np.concatenate(cut)


def clashing_facets(bodies: Sequence[Body]) -> IntArray:
    """Find the pairs of facets that run through one another, in one body or in two.

    Returns
    -------
    (N, 2) int array
        The bodies of each pair.
    """
    owner = np.repeat(np.arange(len(bodies)), [len(body.all_triangles) for body in bodies])
    pairs = self_intersections(PolyMesh.from_faces(*joined_bodies(bodies)))
    return np.asarray(owner[pairs], dtype=np.int64).reshape(-1, 2)
