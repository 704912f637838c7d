"""Count the rotations that carry a woven mesh onto itself, with the sense of every crossing."""

from collections.abc import Mapping

import numpy as np

# Its parts are loaded where they are used: few jobs ask for rotations.
import scipy

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.walks import LoadedMesh, edge_keys

#: A rotation may take a vertex this far from its image, as a share of the size of the mesh: ten
#: times what makers allow, as what turns after what adds up.
_OFF = 1e-5
#: Two vertices nearer than this share of the size are one place.
_ONE_PLACE = 1e-9
#: Vertices that a rotation is tried on before it is tried on all, and rotations tried together.
_SAMPLES, _TOGETHER = 16, 4096


def count_rotations(mesh: LoadedMesh, sense: Mapping[int, bool], enough: int) -> int:
    """Count rotations about the centre of a mesh that keep its faces and its crossings' senses.

    A crossing's sense is that of a screw, which no rotation changes. Each rotation is known from
    where it takes one side of a face, of those that there are fewest like. It is fitted to all
    vertices afterwards, and must take sides to sides: those of a face to those of a face, in the
    same order or all in the other one (as where a half-turn swaps the two sides of an open mesh).

    Parameters
    ----------
    mesh : LoadedMesh
        The mesh.
    sense : mapping of int to bool
        The sense of each edge's crossing, by `edge_keys`; edges without a crossing have none.
    enough : int
        Counting ends here.

    Returns
    -------
    int
        The number of rotations, the identity among them.
    """
    corners = mesh.vertices[mesh.corner]
    size = float(np.ptp(corners, axis=0).max())
    places, corner = _places(corners - corners.mean(axis=0), _ONE_PLACE * size)
    screw = np.array(
        [0 if key not in sense else 1 if sense[key] else -1 for key in edge_keys(mesh).tolist()]
    )
    after, before = corner[mesh.next], corner[mesh.prev]
    sides = np.column_stack((corner, after, after[mesh.next], screw))
    against = np.column_stack((after, corner, before, screw))
    first, images = _fewest_alike(places, np.concatenate((sides, against)), size)
    tree, found = scipy.spatial.KDTree(places), 0
    samples = np.linspace(0, len(places) - 1, _SAMPLES).astype(np.int64)
    near = 0.3 * float(np.linalg.norm(places[after] - places[corner], axis=1).min())
    known, turned = _sorted(sides), _sorted(against)
    for some in np.array_split(images, 1 + len(images) // _TOGETHER):
        turns = _turns(places[first], places[some])
        away, _ = tree.query(np.einsum("kij,sj->ksi", turns, places[samples]))
        for turn in turns[np.max(away, axis=1) <= near]:
            found += _fits(turn, places, tree, (sides, known, turned), size)
            if found >= enough:
                return found
    return found


def _places(corners: Floats, reach: float) -> tuple[Floats, Ints]:
    """Return the places of corners, each once, and the number of each corner's place."""
    points, number = np.unique(corners, axis=0, return_inverse=True)
    first = np.arange(len(points))
    for one, other in sorted(scipy.spatial.KDTree(points).query_pairs(reach)):
        first[other] = first[one]
    kept, number_of = np.unique(first, return_inverse=True)
    return points[kept], number_of[number.ravel()]


def _fewest_alike(places: Floats, sides: Ints, size: float) -> tuple[Ints, Ints]:
    """Return the ends of a side that few are like, and those of all that may be its image."""
    tail, head = places[sides[:, 0]], places[sides[:, 1]]
    # What is in line with the centre would leave a rotation open.
    wide = np.linalg.norm(np.cross(tail, head), axis=1)
    lengths = [np.linalg.norm(one, axis=1) for one in (tail, head, head - tail)]
    rows = np.column_stack((*(np.round(one / (1e-4 * size)) for one in lengths), sides[:, 3]))
    _, sort, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    fits = np.flatnonzero(wide >= 0.5 * np.median(wide))
    first = fits[np.argmin(count[sort.ravel()[fits]])]
    alike = sides[:, 3] == sides[first, 3]
    for one in lengths:
        alike &= np.abs(one - one[first]) <= 2.0 * _OFF * size
    return sides[first, :2], np.unique(sides[alike, :2], axis=0)


def _frames(ends: Floats) -> Floats:
    """Return right-handed frames: along one end, towards the other, and across, (..., 3, 3)."""
    along = ends[..., 0, :] / np.linalg.norm(ends[..., 0, :], axis=-1, keepdims=True)
    across = np.cross(along, ends[..., 1, :])
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack((along, np.cross(across, along), across), axis=-1)


def _turns(here: Floats, there: Floats) -> Floats:
    """Return the rotations that take two places to pairs of others, (K, 3, 3)."""
    return np.asarray(_frames(there) @ _frames(here).T)


def _fits(
    turn: Floats,
    places: Floats,
    tree: "scipy.spatial.KDTree",
    sides: tuple[Ints, Ints, Ints],
    size: float,
) -> bool:
    """Say whether some rotation near this one takes the mesh onto itself."""
    images = np.asarray(tree.query(places @ turn.T)[1], dtype=np.int64)
    there = places[images]
    left, _, right = np.linalg.svd(there.T @ places)
    if np.linalg.det(left @ right) < 0.0:
        left[:, 2] *= -1.0
    if np.linalg.norm(places @ (left @ right).T - there, axis=1).max() > _OFF * size:
        return False
    rows, known, turned = sides
    moved = _sorted(np.column_stack((images[rows[:, :3]], rows[:, 3])))
    return np.array_equal(moved, known) or np.array_equal(moved, turned)


def _sorted(rows: Ints) -> Ints:
    """Return rows in order."""
    return np.asarray(rows[np.lexsort(rows.T)])
