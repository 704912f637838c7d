"""Hold the rotations and reflections that map a mesh onto itself."""

from functools import cached_property

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.mesh.topology import label_links

#: Every unit vector has a component above this, which is just below 1 / sqrt(3).
_LARGE = 0.577


@frozen_value
class Symmetry:
    """A finite group of motions that map a mesh onto itself, as permutations of its half-edges.

    Element 0 is the identity, and the generators are the next ones in their order; every other is a
    generator after an earlier element. A motion takes a place ``x`` to
    ``centre + matrix @ (x - centre)``.

    A motion that *reverses* turns the surface inside out as seen from itself: what is
    counter-clockwise becomes clockwise. On closed surfaces reflections do, and rotations do not;
    on open ones a half-turn may swap front and back, and reverses as well. The half-edge of an
    image then runs against the image of the half-edge.

    Parameters
    ----------
    centre : (3,) float array
        The point that all motions leave in place: the mean of all corners of faces.
    matrix : (G, 3, 3) float array
        Orthogonal matrices.
    proper : (G,) bool array
        Whether each motion is a rotation; otherwise it is a reflection, perhaps with a turn.
    reverses : (G,) bool array
        Whether each motion reverses the surface.
    after, by : (G,) int arrays
        Each element is generator ``by`` after element ``after``; -1 for the identity.
    generators : (N, H) int array
        Where the generators take each half-edge.
    tolerance : float
        How far a generator may take a corner from its image, as a share of the mesh's size.
    off : float
        How far generators take any corner, and all elements a sample of them, from its image, in
        the same measure.
    """

    centre: FloatArray
    matrix: FloatArray
    proper: BoolArray
    reverses: BoolArray
    after: IntArray
    by: IntArray
    generators: IntArray
    tolerance: float
    off: float

    @property
    def order(self) -> int:
        """Number of motions, the identity among them."""
        return len(self.proper)

    @property
    def n_rotations(self) -> int:
        """Number of rotations, the identity among them."""
        return int(np.count_nonzero(self.proper))

    @property
    def n_reflections(self) -> int:
        """Number of reflections, with a turn or without."""
        return self.order - self.n_rotations

    def images(self, halfedges: IntArray) -> IntArray:
        """Return where every element takes some half-edges, (G, K)."""
        return images_of(self.generators, self.after, self.by, halfedges)

    @cached_property
    def permutations(self) -> IntArray:
        """Where every element takes each half-edge, (G, H); large on large meshes."""
        return self.images(np.arange(self.generators.shape[1]))

    @cached_property
    def axis(self) -> FloatArray:
        """Axis of each motion, (G, 3): of its turn, and the normal of the plane it reflects in.

        Of the two directions, the one whose first large component is positive; zero for the
        identity and for the reflection in a point.
        """
        turn = self._turns
        skew = turn - turn.transpose(0, 2, 1)
        sine = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1)
        # The skew part of a half-turn is zero, and so is nearly the even part of a small turn.
        even = turn + turn.transpose(0, 2, 1)
        cosine = (np.trace(turn, axis1=1, axis2=2) - 1) / 2
        even = even - 2 * cosine[:, None, None] * np.eye(3)
        column = np.argmax(np.linalg.norm(even, axis=1), axis=1)
        across = even[np.arange(self.order), :, column]
        found = np.where((cosine < 0)[:, None], across, sine)
        length = np.linalg.norm(found, axis=1, keepdims=True)
        found = np.where(length > 1e-9, found / np.where(length > 0, length, 1.0), 0.0)
        large = found[np.arange(self.order), np.argmax(np.abs(found) > _LARGE, axis=1)]
        return np.asarray(found * np.where(large < 0, -1.0, 1.0)[:, None])

    @cached_property
    def angle_deg(self) -> FloatArray:
        """How far each motion turns about its axis, counter-clockwise, in degrees, (G,).

        Above -180 and up to 180. A plain reflection turns by 0, and one in a point by 180.
        """
        turn = self._turns
        skew = turn - turn.transpose(0, 2, 1)
        sine = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1) / 2
        along = np.einsum("ij,ij->i", sine, self.axis)
        angle = np.degrees(np.arctan2(along, (np.trace(turn, axis1=1, axis2=2) - 1) / 2))
        angle = np.where(self.proper, angle, angle + 180.0)
        angle = np.round(angle, 9)
        angle = np.where(angle > 180.0, angle - 360.0, angle)
        return np.asarray(np.where(angle <= -180.0, angle + 360.0, angle)) + 0.0

    @property
    def _turns(self) -> FloatArray:
        """Return the rotations, and of reflections the rotation that their opposite is."""
        return np.asarray(self.matrix * np.where(self.proper, 1.0, -1.0)[:, None, None])


def images_of(generators: IntArray, after: IntArray, by: IntArray, items: IntArray) -> IntArray:
    """Return where every element takes some items, (G, K)."""
    result = np.empty((len(after), len(items)), dtype=np.int64)
    result[0] = items
    for element in range(1, len(after)):
        result[element] = generators[by[element]][result[after[element]]]
    return result


def orbits(permutations: IntArray, count: int) -> IntArray:
    """Return the orbit of each of some items under permutations (N, count), numbered from 0.

    Examples
    --------
    >>> orbits(np.array([[1, 0, 2, 3]]), 4).tolist()
    [0, 0, 1, 2]
    """
    here = np.tile(np.arange(count), len(permutations))
    _, label = label_links(here, permutations.ravel(), count)
    first = np.unique(label, return_index=True)[1]
    rank = np.empty(len(first), dtype=np.int64)
    rank[label[np.sort(first)]] = np.arange(len(first))
    return rank[label]
