"""Say how vertices are to move, beside a motion, so that ribbons keep the rules that they kept.

A ribbon's margin at a place, what there is over what is needed, changes with the few vertices about
it. How much is tried: vertices that no place shares are moved at once (Curtis, Powell and Reid, "On
the estimation of sparse Jacobian matrices", IMA J. Appl. Math. 13, 1974). Then the least motion
that makes up for all margins is known.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.colouring import colour
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import following_rung
from fabweave.ribbon.rules.ribbon_check import RibbonCheck

#: What is near to others depends on more than the vertices about it: that is not tried.
_RULES = ("clearance", "width", "bend", "twist", "crease", "layers")
#: A place is worse than it was from such a share of what is needed on; what is about to be so is
#: looked at with it; and so much is enough, of what was more.
_WORSE, _SOON, _ENOUGH = 0.02, 1.1, 1.005
#: How far vertices are moved to try, as a share of the size; and slopes that are none, of others.
_TRIED, _FLAT = 2e-4, 1e-2


class Broken:
    """Where ribbons break rules.

    Parameters
    ----------
    check : RibbonCheck
    woven : WovenObject
        Whose ribbons they are.
    """

    def __init__(self, check: RibbonCheck, woven: WovenObject) -> None:
        self._counts = {one.rule: (one.count, one.far) for one in check.findings}
        #: What there is over what is needed by rule and pass, at the least, (R, P).
        self.margins = np.full((len(_RULES), len(woven.weave.threads.crossing)), np.inf)
        for rule, measured in check.measured.items():
            for at in (measured.passes, measured.others):
                known = at >= 0
                np.minimum.at(self.margins[_RULES.index(rule)], at[known], measured.margins[known])

    def no_more_than(self, other: "Broken") -> bool:
        """Return whether no rule is broken oftener than elsewhere, and its worst place is no worse.

        One that is kept there is kept; and no more places are far from what is needed.
        """
        for rule, (count, far) in self._counts.items():
            often, far_there = other._counts.get(rule, (0, 0))
            own, others = (one.margins[_RULES.index(rule)].min() for one in (self, other))
            if count > often or far > far_there or own < (others - _WORSE if often else 1.0):
                return False
        return True

    def worse_than(self, other: "Broken") -> BoolArray:
        """Return where a rule is broken, and was not, or less so, (R, P)."""
        less = (self.margins < other.margins - _WORSE) | (other.margins >= 1.0)
        return np.asarray((self.margins < 1.0) & less)


class RuleKeeper:
    """What makes up for places that get worse as vertices move.

    Parameters
    ----------
    woven : WovenObject
        As it is drawn.
    drawn : Broken
        Where rules are broken so.
    along : callable
        Returns where rules are broken by each ribbon by itself, if it is laid on a mesh.
    beside : (X, V) sparse array
        Which vertices lie about each crossing.
    symmetric : callable
        Returns the mean of how vertices move as seen by all motions of the mesh onto itself.
    """

    def __init__(
        self,
        woven: WovenObject,
        drawn: Broken,
        along: Callable[[PolyMesh], Broken],
        beside: sp.csr_array,
        symmetric: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._drawn, self._along, self._symmetric = drawn, along, symmetric
        self._tried_mm = _TRIED * woven.size_mm
        threads = woven.weave.threads
        after = following_rung(threads.offsets, threads.closed)
        after = np.where(after >= 0, after, np.arange(len(after)))
        at = threads.crossing
        self._about = sp.csr_array(((beside[at] + beside[at[after]]) != 0).astype(np.float64))
        #: Rules and passes whose slopes are known, (2, N), and these, (N, V, 3).
        self._places: IntArray = np.zeros((2, 0), dtype=np.int64)
        self._slopes: FloatArray = np.zeros((0, self._about.shape[1], 3))

    def correction(self, mesh: PolyMesh, broken: Broken) -> FloatArray:
        """Return the least motion of vertices, (V, 3), that makes up for what is worse on a mesh.

        It is none where nothing is known that would.
        """
        self._learn(mesh, broken)
        at = tuple(self._places)
        short = np.minimum(self._drawn.margins[at], _ENOUGH) - broken.margins[at]
        near = short > -_WORSE
        slopes = self._slopes[near].reshape(np.count_nonzero(near), 3 * self._slopes.shape[1])
        least = np.linalg.lstsq(slopes, np.maximum(short[near], 0.0), rcond=_FLAT)[0]
        return np.asarray(least.reshape(-1, 3))

    def _learn(self, mesh: PolyMesh, broken: Broken) -> None:
        """Try how margins change with vertices, where they are worse or about to be."""
        known = np.zeros(broken.margins.shape, dtype=np.bool_)
        known[_RULES.index("clearance")] = True
        known[tuple(self._places)] = True
        if not np.any(broken.worse_than(self._drawn) & ~known):
            return
        soon = (broken.margins < _SOON) & (broken.margins < self._drawn.margins - _WORSE)
        places = np.nonzero((soon | broken.worse_than(self._drawn)) & ~known)
        about = self._about[places[1]]
        shared = sp.csr_array(about.T @ about)
        shared.setdiag(0.0)
        shared.eliminate_zeros()
        classes = colour(shared)
        row, vertex = about.nonzero()
        slopes = np.zeros((len(places[1]), *mesh.vertices.shape))
        for number in np.unique(classes[vertex]).tolist():
            own = classes[vertex] == number
            moving = np.unique(vertex[own])
            for axis in range(3):
                vertices = mesh.vertices.copy()
                vertices[moving, axis] += self._tried_mm
                there = self._along(mesh.with_vertices(vertices)).margins[places]
                slope = np.nan_to_num(there - broken.margins[places], posinf=0.0, neginf=0.0)
                slopes[row[own], vertex[own], axis] = slope[row[own]] / self._tried_mm
        slopes = np.array([self._symmetric(one) for one in slopes])
        self._places = np.concatenate([self._places, np.array(places)], axis=1)
        self._slopes = np.concatenate([self._slopes, slopes])
