"""Round tubes off into one smooth surface, and spread a mesh evenly over it."""

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import group_edges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh

# Samples of a skeleton may stand this many blends apart: the sum of their bells then differs
# from the integral by a factor of 1 ± 4e-5 only (Poisson summation).
_SPACING = 0.95
# Places are moved in blocks of neighbours, by the samples up to a radius and this many blends
# away; what is left out is less than 1e-5 of the rest.
_BLOCK = 64
_FAR = 2.5
# Newton steps that bring a place from half a radius away to the surface.
_LANDING = 4


@frozen_value
class SoftTubes:
    """The surface at a radius around a skeleton of curves, with smooth joints.

    A Gaussian bell of width ``blend`` runs along every curve; the surface is where their sum has
    the value that it has at distance ``radius`` from one straight curve. Where curves come
    closer to one another than about 1.2 radii, their tubes flow together.

    Parameters
    ----------
    points : (S, 3) float array
        Samples of the skeleton.
    weights : (S,) float array
        Length that each sample stands for, divided by ``blend · √π``.
    radius, blend : float
        Radius of a lone tube, and width of the bell.

    References
    ----------
    Bloomenthal, Shoemake, "Convolution surfaces", SIGGRAPH 1991.
    """

    points: FloatArray
    weights: FloatArray
    radius: float
    blend: float

    def __or__(self, other: "SoftTubes") -> "SoftTubes":
        """Return the surface around both skeletons, with this one's radius and blend."""
        points = np.concatenate([self.points, other.points])
        weights = np.concatenate([self.weights, other.weights])
        return SoftTubes(points, weights, self.radius, self.blend)

    def project(self, places: FloatArray) -> FloatArray:
        """Move places one Newton step towards the surface, along the gradient.

        Parameters
        ----------
        places : (V, 3) float array
            Places near the surface.

        Returns
        -------
        (V, 3) float array
            The places after a step of at most half a radius.

        Examples
        --------
        >>> import numpy as np
        >>> line = np.zeros((41, 3))
        >>> line[:, 2] = np.arange(-20, 21) / 2
        >>> bar = soft_tubes([line], radius=1.0, blend=0.8, closed=False)
        >>> place = np.array([[1.3, 0.0, 0.0]])
        >>> for _ in range(6):
        ...     place = bar.project(place)
        >>> place[0, :2].round(4).tolist()
        [1.0, 0.0]
        """
        moved = np.empty_like(places)
        reach = self.radius + _FAR * self.blend
        order = cKDTree(places, leafsize=_BLOCK).indices
        for start in range(0, len(places), _BLOCK):
            block = order[start : start + _BLOCK]
            part = places[block]
            low, high = part.min(axis=0) - reach, part.max(axis=0) + reach
            near = np.flatnonzero(np.all((self.points > low) & (self.points < high), axis=1))
            moved[block] = self._step(part, near if len(near) else slice(None))
        return moved

    def _step(self, places: FloatArray, near: IntArray | slice) -> FloatArray:
        """Move places that stand close together by the samples near them."""
        middle = places.mean(axis=0)
        places, points = places - middle, self.points[near] - middle
        square = (places**2).sum(axis=1)[:, None] - 2 * places @ points.T + (points**2).sum(axis=1)
        least = square.min(axis=1, keepdims=True)
        # Numbers next to nothing are slow to compute with, so far samples all count the same.
        bells = self.weights[near] * np.exp(np.maximum((least - square) / self.blend**2, -40.0))
        total = bells.sum(axis=1)
        field = least[:, 0] - self.blend**2 * np.log(total)
        away = places - (bells @ points) / total[:, None]
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-3 * self.radius)
        step = np.clip((field - self.radius**2) / (2 * length), -self.radius / 2, self.radius / 2)
        return middle + places - (step / length)[:, None] * away


def soft_tubes(curves: list[FloatArray], *, radius: float, blend: float, closed: bool) -> SoftTubes:
    """Build the soft tubes around polylines, sampled anew at even distances.

    Parameters
    ----------
    curves : list of (N, 3) float array
        Corners of each curve in order.
    radius, blend : float
        Radius of a lone tube, and width of its bell; about equal.
    closed : bool
        Whether each curve closes to a ring.

    Returns
    -------
    SoftTubes
        The surface.
    """
    points, weights = [], []
    for corners in curves:
        ring = np.concatenate([corners, corners[:1]]) if closed else corners
        places = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))))
        pieces = max(3, int(np.ceil(places[-1] / (_SPACING * blend))))
        middles = (np.arange(pieces) + 0.5) * places[-1] / pieces
        points.append(np.column_stack([np.interp(middles, places, ring[:, k]) for k in range(3)]))
        weights.append(np.full(pieces, places[-1] / pieces / (blend * np.pi**0.5)))
    return SoftTubes(np.concatenate(points), np.concatenate(weights), radius, blend)


def spread(mesh: PolyMesh, surface: SoftTubes, *, steps: int = 20) -> PolyMesh:
    """Slide the vertices of a mesh over a surface, as if all edges were springs.

    Every step moves each vertex halfway to the mean of its neighbours, and then back to the
    surface. (Stiffer long edges would even out lengths further, and fold quads around vertices
    of high valence.)

    Parameters
    ----------
    mesh : PolyMesh
        A mesh that already lies near the surface.
    surface : SoftTubes
        Where its vertices should be.
    steps : int
        How many steps.

    Returns
    -------
    PolyMesh
        The same connectivity on the surface.
    """
    edges = group_edges(mesh)
    one, two = edges.tail[edges.first], edges.head[edges.first]
    links = sparse.coo_array(
        (np.ones(2 * len(one)), (np.concatenate([one, two]), np.concatenate([two, one]))),
        shape=(mesh.n_vertices, mesh.n_vertices),
    ).tocsr()
    valence = links.sum(axis=1)[:, None]
    places = mesh.vertices
    for _ in range(_LANDING):
        places = surface.project(places)
    for _ in range(steps):
        places = surface.project(0.5 * places + 0.5 * (links @ places) / valence)
    for _ in range(_LANDING):
        places = surface.project(places)
    return mesh.with_vertices(places)


def settle(mesh: PolyMesh, surface: SoftTubes) -> PolyMesh:
    """Spread a mesh over a surface so that it does not run through itself.

    Springs even out a fine mesh, and may pull the few quads of a coarse one across a gap; so fewer
    steps are tried where many do not work.

    Raises
    ------
    InputError
        If faces cross however little the mesh is spread.
    """
    crossing = np.zeros((0, 2), dtype=np.int64)
    for steps in (20, 5, 0):
        settled = spread(mesh, surface, steps=steps)
        crossing = self_intersections(settled)
        if not len(crossing):
            return settled
    one, two = crossing[0]
    raise InputError(
        f"with so few quads the shape runs through itself: {len(crossing)} pairs of faces cross, "
        f"such as faces {one} and {two}; choose more quads, or about as many in both directions"
    )
