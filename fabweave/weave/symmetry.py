"""Find the motions that map a woven object onto itself, with over and under."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.mesh.automorphisms import EXACT, Symmetry, find_symmetry, orbits
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import crossing_of_halfedges

#: Where a mesh has no exact symmetry, one to within this share of its size is looked for: 0.03 mm
#: of 300 mm, about as near as pieces of one kind are.
NEARLY = 1e-4


@frozen_value
class WeaveSymmetry:
    """The motions that map a woven object onto itself, and where they take what it is made of.

    Parameters
    ----------
    group : Symmetry
        The motions, as permutations of the half-edges of the mesh.
    weave : Weave
        The weave.
    crossing : (H,) int array
        The crossing of each half-edge; -1 on the boundary.
    strand : (X, 2) int array
        The pass of each crossing that arrives backward, and the one that arrives forward.
    """

    group: Symmetry
    weave: Weave
    crossing: IntArray
    strand: IntArray

    def crossing_images(self, crossings: IntArray) -> IntArray:
        """Return where every motion takes some crossings, (G, K)."""
        return self.crossing[self.group.images(self.weave.threads.crossing_halfedge[crossings])]

    def pass_images(self, passes: IntArray) -> IntArray:
        """Return where every motion takes some passes, (G, K)."""
        there = self.crossing_images(self.weave.threads.crossing[passes])
        return self._passes(passes, there, self.group.reverses)

    def _passes(self, passes: IntArray, there: IntArray, reverses: BoolArray) -> IntArray:
        """Return where motions take passes whose crossings they take there, (N, K).

        A motion that reverses the surface swaps left and right, and so forward and backward.
        """
        forward = self.weave.threads.forward[passes] ^ reverses[:, None]
        return self.strand[there, forward.astype(np.int64)]

    def thread_images(self, threads: IntArray) -> IntArray:
        """Return where every motion takes some threads, (G, K); those without passes stay."""
        walks = self.weave.threads
        images = np.tile(threads, (self.group.order, 1))
        crosses = walks.lengths[threads] > 0
        first = walks.offsets[threads[crosses]]
        images[:, crosses] = walks.thread_of_pass[self.pass_images(first)]
        return images

    @property
    def thread_orbits(self) -> IntArray:
        """The orbit of each thread, (T,): one can be carried to all others of its orbit."""
        walks, generators = self.weave.threads, self.group.generators
        images = np.tile(np.arange(walks.n_threads), (len(generators), 1))
        crosses = np.flatnonzero(walks.lengths)
        first = walks.offsets[crosses]
        there = self.crossing[generators[:, walks.crossing_halfedge[walks.crossing[first]]]]
        reverses = self.group.reverses[1 : 1 + len(generators)]
        images[:, crosses] = walks.thread_of_pass[self._passes(first, there, reverses)]
        return orbits(images, walks.n_threads)

    @property
    def crossing_orbits(self) -> IntArray:
        """The orbit of each crossing, (X,)."""
        generators = self.group.generators
        first = self.weave.threads.crossing_halfedge
        return orbits(self.crossing[generators[:, first]], len(first))


def nearest_symmetry(mesh: PolyMesh, halfedges: Halfedges) -> Symmetry:
    """Find the motions that map a mesh onto itself: exactly, or else nearly.

    Its tolerance is NEARLY where that finds more of them, else EXACT.
    """
    exact = find_symmetry(mesh, halfedges)
    nearly = find_symmetry(mesh, halfedges, tolerance=NEARLY)
    return nearly if nearly.order > exact.order else exact


def find_weave_symmetry(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    *,
    tolerance: float = EXACT,
    reflections: bool = True,
) -> WeaveSymmetry:
    """Find the motions that map a woven object onto itself, with over and under.

    A crossing whose twist is counter-clockwise is a right-handed helix of two strands, from
    whichever side it is seen. So a rotation maps the weave onto itself where it takes each edge
    to one of the same twist, and a reflection where it takes each to one of the other twist. In
    plain weave all twists are the same: every rotation of the mesh is one of the weave, and no
    reflection is; the mirror image of a plain weave has over and under swapped.

    Parameters
    ----------
    mesh, halfedges, weave
        The woven mesh.
    tolerance : float
        How far a motion may take a corner from its image, as a share of the largest dimension.
    reflections : bool
        Whether to look for reflections, too.

    Returns
    -------
    WeaveSymmetry

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = octahedron()
    >>> halfedges = build_halfedges(mesh)
    >>> found = find_weave_symmetry(mesh, halfedges, plain_weave(trace_threads(halfedges)))
    >>> found.group.n_rotations, found.group.n_reflections, found.thread_orbits.tolist()
    (24, 0, [0, 0, 0, 0])
    """
    threads = weave.threads
    crossing = crossing_of_halfedges(halfedges, threads.crossing_halfedge)
    handed = np.where(crossing >= 0, np.append(np.where(weave.twist, 1, -1), 0)[crossing], 0)
    group = find_symmetry(
        mesh, halfedges, handed=handed, tolerance=tolerance, reflections=reflections
    )
    strand = np.empty((threads.n_crossings, 2), dtype=np.int64)
    strand[threads.crossing, threads.forward.astype(np.int64)] = np.arange(len(threads.crossing))
    return WeaveSymmetry(group, weave, crossing, strand)
