"""List the places where threads may be cut into pieces."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value, offsets_of
from fabweave.weave.pattern import Weave


@frozen_value
class Sites:
    """Where each thread may be cut, in compressed rows, in walking order.

    A ring may be cut at any of its sites. An open thread has its first and its last pass as its
    outer sites: there it ends, whether it is cut or not.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the sites ``offsets[t]:offsets[t + 1]``; none if it has no crossing.
    position : (N,) int array
        The pass of each site, counted from the start of its thread.
    crossing : (N,) int array
        The crossing of each site.
    closed : (T,) bool array
        Whether the thread is a ring.
    lengths : (T,) int array
        Number of passes of each thread.
    """

    offsets: IntArray
    position: IntArray
    crossing: IntArray
    closed: BoolArray
    lengths: IntArray

    @property
    def thread(self) -> IntArray:
        """The thread of each site, (N,)."""
        return np.repeat(np.arange(len(self.closed)), np.diff(self.offsets))

    @property
    def outer(self) -> BoolArray:
        """Whether each site is the end of an open thread and so carries no joint, (N,)."""
        thread = self.thread
        end = (self.position == 0) | (self.position == self.lengths[thread] - 1)
        return np.asarray(end & ~self.closed[thread])

    @property
    def steps(self) -> IntArray:
        """How many passes on the next site of the thread is, (N,); 0 at the end of an open one."""
        filled = np.flatnonzero(np.diff(self.offsets))
        final = self.offsets[filled + 1] - 1
        steps = np.diff(self.position, append=0)
        back = self.position[self.offsets[filled]] + self.lengths[filled] - self.position[final]
        steps[final] = np.where(self.closed[filled], back, 0)
        return steps

    def of(self, threads: IntArray) -> "Sites":
        """Return the sites of some threads only; the others keep none."""
        chosen = np.zeros(len(self.closed), dtype=bool)
        chosen[threads] = True
        keep = chosen[self.thread]
        return Sites(
            offsets=offsets_of(np.where(chosen, np.diff(self.offsets), 0)),
            position=self.position[keep],
            crossing=self.crossing[keep],
            closed=self.closed,
            lengths=self.lengths,
        )


def list_sites(weave: Weave) -> Sites:
    """List where threads go under, and the ends of open threads.

    A ring that never goes under may be cut anywhere.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(tetrahedron())))
    >>> sites = list_sites(weave)
    >>> np.diff(sites.offsets).tolist(), sites.position.tolist()
    ([2, 2, 2], [1, 3, 1, 3, 1, 3])
    """
    threads = weave.threads
    thread, lengths = threads.thread_of_pass, threads.lengths
    position = np.arange(len(thread)) - threads.offsets[thread]
    under = np.bincount(thread[~weave.over], minlength=threads.n_threads)
    chosen = ~weave.over | (threads.closed & (under == 0))[thread]
    ends = (position == 0) | (position == lengths[thread] - 1)
    chosen = np.flatnonzero(chosen | (ends & ~threads.closed[thread]))
    return Sites(
        offsets=offsets_of(np.bincount(thread[chosen], minlength=threads.n_threads)),
        position=position[chosen],
        crossing=threads.crossing[chosen],
        closed=threads.closed,
        lengths=lengths,
    )
