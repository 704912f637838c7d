"""Measure how like its model a surface is: distances both ways, and what was lost where."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import area_samples, plain_triangles

#: Points spread over each surface, beside its vertices.
SAMPLES = 20_000
#: What is lost by more than this share of the size, and by more than this share of the greatest
#: loss, belongs to a lost feature; so many are named.
_LOST, _OF_GREATEST, _MOST_NAMED = 0.01, 0.35, 5
#: A feature that loses more than this share is a limb cut short: an ear, a tail or a toe.
SHORT = 0.03
#: Places of loss nearer than this share of the size are one feature.
_APART = 0.025
#: A place is called left, top and so on beyond this share of the way from the middle to the side.
_ASIDE = 1 / 3
#: Words for the negative and the positive side of z, y and x, in the order in which they are said.
_SIDES = (("bottom", "top"), ("front", "back"), ("left", "right"))


@frozen_value
class LostFeature:
    """A part of the model that the result lacks.

    Parameters
    ----------
    where : str
        Such as ``top front left``, as seen from the front, where y is least.
    lost_mm : float
        How far the model stands out there at most.
    size_mm : float
        The greatest side of the box around all that is lost there.
    place : (3,) float array
        Where most is lost.
    direction : (3,) float array
        The way in which it stands out, of length one.
    """

    where: str
    lost_mm: float
    size_mm: float
    place: FloatArray
    direction: FloatArray

    @property
    def text(self) -> str:
        """The feature in words."""
        return f"{self.where}: {_round(self.lost_mm)} mm lost"


@frozen_value
class Likeness:
    """How like its model a surface is.

    Parameters
    ----------
    size_mm : float
        The greatest extent of the model.
    in_mean_mm, in_rms_mm, in_greatest_mm : float
        Distances from the model to the result: what was lost.
    out_mean_mm, out_rms_mm, out_greatest_mm : float
        Distances from the result to the model: what was added.
    lost : tuple of LostFeature
        The worst losses, the greatest first; none where the greatest is within one per cent of the
        size.
    """

    size_mm: float
    in_mean_mm: float
    in_rms_mm: float
    in_greatest_mm: float
    out_mean_mm: float
    out_rms_mm: float
    out_greatest_mm: float
    lost: tuple[LostFeature, ...]

    @property
    def greatest_mm(self) -> float:
        """The greatest distance, either way."""
        return max(self.in_greatest_mm, self.out_greatest_mm)

    @property
    def loss(self) -> float:
        """How far it is from the model in the mean, lost or added, as a share of the size."""
        return max(self.in_mean_mm, self.out_mean_mm) / self.size_mm

    @property
    def short(self) -> dict[str, float]:
        """Limbs that are cut short, in words, and by what share of the size."""
        shares = {one.text: one.lost_mm / self.size_mm for one in self.lost}
        return {text: share for text, share in shares.items() if share > SHORT}

    def percent(self, length_mm: float) -> float:
        """Return a length in per cent of the model's greatest extent."""
        return 100.0 * length_mm / self.size_mm

    def record(self) -> dict[str, object]:
        """Return everything as JSON takes it, lengths rounded to micrometres."""
        names = [f"{way}_{what}" for way in ("in", "out") for what in ("mean", "rms", "greatest")]
        lengths = {name: float(getattr(self, f"{name}_mm")) for name in names}
        return {
            "size_mm": round(self.size_mm, 3),
            **{f"{name}_mm": round(length, 3) for name, length in lengths.items()},
            **{f"{name}_percent": round(self.percent(x), 3) for name, x in lengths.items()},
            "lost": [
                {
                    "where": feature.where,
                    "lost_mm": round(feature.lost_mm, 3),
                    "size_mm": round(feature.size_mm, 3),
                    "place_mm": [round(float(x), 3) for x in feature.place],
                    "direction": [round(float(x), 3) for x in feature.direction],
                }
                for feature in self.lost
            ],
        }

    @property
    def note(self) -> str:
        """What a person should know."""
        text = (
            f"the remeshed surface lies within {_round(self.greatest_mm)} mm "
            f"({self.percent(self.greatest_mm):.1f} %) of the model, "
            f"{_round(self.in_mean_mm)} mm lost and {_round(self.out_mean_mm)} mm added in the mean"
        )
        return f"{text}; farthest at the {self.lost_text}" if self.lost else text

    @property
    def lost_text(self) -> str:
        """All lost features in words; empty where there are none."""
        return ", ".join(feature.text for feature in self.lost)


def likeness(source: PolyMesh, result: PolyMesh) -> Likeness:
    """Measure how like its model a surface is.

    Distances are taken from 20,000 samples spread by area, and from all vertices, to the closest
    point of the other surface. Means are over the samples alone, so that densely meshed places
    count no more than others. Faces with more than three corners are cut around their centres, as
    ribbons are laid.

    Parameters
    ----------
    source : PolyMesh
        The model, in millimetres; its vertices are finite, and faces have an area.
    result : PolyMesh
        The surface that stands in for it.

    Returns
    -------
    Likeness
        The same for the same arguments: there is no chance in it.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> model = octahedron()
    >>> larger = model.with_vertices(1.5 * model.vertices)
    >>> found, size = likeness(model, larger), float(np.abs(model.vertices).max())
    >>> round(found.in_mean_mm / (0.5 * size / 3**0.5), 6)  # between parallel faces
    1.0
    >>> round(found.out_greatest_mm / (0.5 * size), 6)  # from corner to corner
    1.0

    References
    ----------
    Cignoni, Rocchini, Scopigno, "Metro: measuring error on simplified surfaces", Computer
    Graphics Forum 17(2), 1998.
    """
    before, after = plain_triangles(source), plain_triangles(result)
    lower, upper = source.vertices.min(axis=0), source.vertices.max(axis=0)
    size = float((upper - lower).max())
    places, feet, lost = _distances(source, before, Surface(*after))
    _, _, added = _distances(result, after, Surface(*before))
    return Likeness(
        size,
        *_summary(lost),
        *_summary(added),
        lost=_lost_features(places, places - feet, lost, lower, upper),
    )


def nearly_as_like(source: PolyMesh, result: PolyMesh, other: PolyMesh, factor: float) -> bool:
    """Tell whether a surface is as like its model as another, up to a factor on its distances."""
    one, two = likeness(source, result), likeness(source, other)
    return one.in_rms_mm <= factor * two.in_rms_mm and one.greatest_mm <= factor * two.greatest_mm


def _distances(
    mesh: PolyMesh, triangles: tuple[FloatArray, IntArray], other: Surface
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return places of a mesh, samples first, their closest points on a surface, and how far."""
    used = np.unique(mesh.indices)
    places = np.concatenate([area_samples(*triangles, SAMPLES)[0], mesh.vertices[used]])
    feet = other.feet(places)
    return places, feet.points, feet.distances


def _summary(distances: FloatArray) -> tuple[float, float, float]:
    """Return the mean, the root mean square and the greatest of some distances."""
    spread = distances[:SAMPLES]
    return float(spread.mean()), float(np.sqrt(np.mean(spread**2))), float(distances.max())


def _lost_features(
    places: FloatArray, way: FloatArray, lost: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[LostFeature, ...]:
    """Gather the places of great loss into features, the greatest first."""
    size = float((upper - lower).max())
    far = np.flatnonzero(lost > max(_LOST * size, _OF_GREATEST * float(lost.max())))
    if not len(far):
        return ()
    label = _clusters(places[far], _APART * size)
    # Sorted by loss: the first of each cluster is its worst.
    order = far[np.argsort(-lost[far], kind="stable")]
    cluster = label[np.argsort(-lost[far], kind="stable")]
    names, first = np.unique(cluster, return_index=True)
    features = []
    for name, worst in sorted(zip(names, first, strict=True), key=lambda pair: int(pair[1])):
        members = places[order[cluster == name]]
        place = places[order[worst]]
        distance = float(lost[order[worst]])
        features.append(
            LostFeature(
                where=_where(place, lower, upper),
                lost_mm=distance,
                size_mm=float(np.ptp(members, axis=0).max()),
                place=place,
                direction=way[order[worst]] / distance,
            )
        )
    return tuple(features[:_MOST_NAMED])


def _clusters(places: FloatArray, apart: float) -> IntArray:
    """Label places so that those nearer to one another than a distance have the same label."""
    # Through the cells of a grid, so that dense places cost no more than sparse ones.
    corner = np.floor((places - places.min(axis=0)) / apart).astype(np.int64)
    cells, cell = np.unique(corner, axis=0, return_inverse=True)
    pairs = cKDTree(cells).query_pairs(1.8, output_type="ndarray")  # neighbours by corner, too
    return label_links(pairs[:, 0], pairs[:, 1], len(cells))[1][cell.reshape(-1)]


def _where(place: FloatArray, lower: FloatArray, upper: FloatArray) -> str:
    """Name a place in a box."""
    half = np.maximum((upper - lower) / 2, 1e-300)
    aside = (place - (lower + upper) / 2) / half
    words = [
        _SIDES[2 - axis][int(aside[axis] > 0)] for axis in (2, 1, 0) if abs(aside[axis]) > _ASIDE
    ]
    return " ".join(words) or "middle"


def name_place(place: FloatArray, mesh: PolyMesh) -> str:
    """Name a place of a mesh, such as ``top front left``."""
    return _where(place, mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))


def _round(length_mm: float) -> str:
    """Return a length with one decimal, or with two where it is small; at least 0.01."""
    return f"{length_mm:.1f}" if length_mm >= 1 else f"{max(length_mm, 0.01):.2f}"


#: The sides of the parts are no longer than this share of the size.
_SIDE = 1 / 50
#: No triangle is cut oftener in four; a side that is longer yet belongs to a sliver.
_MOST_CUTS = 6


@frozen_value
class LossMap:
    """A model in small triangles, and how far each is from what stands in for it.

    Parameters
    ----------
    points : (N, 3) float array
        In millimetres.
    triangles : (T, 3) int array
        Corners, counter-clockwise as seen from outside.
    lost_mm : (T,) float array
        The distance of each triangle's centre.
    size_mm : float
        The greatest extent of the model.
    """

    points: FloatArray
    triangles: IntArray
    lost_mm: FloatArray
    size_mm: float


def loss_map(model: PolyMesh, result: PolyMesh) -> LossMap:
    """Map the distances from a model to the surface that stands in for it.

    Parameters
    ----------
    model : PolyMesh
        In millimetres.
    result : PolyMesh

    Returns
    -------
    LossMap
        Its triangles are those of the model, cut in four until they are small.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> model = octahedron()
    >>> inner = model.with_vertices(0.5 * model.vertices)
    >>> far = 0.5 * np.abs(model.vertices).max() / 3**0.5  # between parallel faces
    >>> loss = loss_map(model, inner)
    >>> bool(np.isclose(loss.lost_mm.min(), far)), len(loss.triangles)
    (True, 32768)
    """
    points, triangles = plain_triangles(model)
    size = float(np.ptp(model.vertices, axis=0).max())
    points, triangles = _quartered(points, triangles, _SIDE * size)
    lost = Surface(*plain_triangles(result)).feet(points[triangles].mean(axis=1)).distances
    return LossMap(points, triangles, lost, size)


def _quartered(
    points: FloatArray, triangles: IntArray, longest: float
) -> tuple[FloatArray, IntArray]:
    """Cut triangles in four at the middles of their sides, until those are short enough."""
    for _ in range(_MOST_CUTS):
        corners = points[triangles]
        side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        long = np.flatnonzero(side > longest)
        if not len(long):
            break
        whole = triangles[long]
        a, b, c = whole.T
        ab, bc, ca = len(points) + np.arange(3 * len(long)).reshape(3, -1)
        middles = (points[whole] + points[np.roll(whole, -1, axis=1)]) / 2.0
        points = np.concatenate([points, middles.transpose(1, 0, 2).reshape(-1, 3)])
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        parts = np.concatenate([np.column_stack(quarter) for quarter in quarters])
        triangles = np.concatenate([np.delete(triangles, long, axis=0), parts])
    return points, triangles


@frozen_value
class Original:
    """What a mesh stands in for, as it was remeshed from it.

    Parameters
    ----------
    mesh : PolyMesh
        The model.
    worn : PolyMesh or None
        What the model was wrapped around, if it was.
    growth : float
        By how much the mesh grew afterwards.
    whole : PolyMesh
        That mesh, before anything was left out of it.
    """

    mesh: PolyMesh
    worn: PolyMesh | None
    growth: float
    whole: PolyMesh

    def likeness(self, mesh: PolyMesh) -> Likeness:
        """Return how like it a mesh is.

        A wrap is measured against what was wrapped, too: where a mask became a bag, its back is
        far.
        """
        there = self._there(mesh)
        like = likeness(self.mesh, there)
        if self.worn is None:
            return like
        off = likeness(self.worn, there)
        return replace(
            like, out_mean_mm=off.out_mean_mm, out_rms_mm=off.out_rms_mm,
            out_greatest_mm=off.out_greatest_mm,
        )  # fmt: skip

    def loss(self, mesh: PolyMesh | None = None) -> LossMap:
        """Return what of it a mesh lacks where; the whole mesh if none is given."""
        return loss_map(self.mesh, self._there(self.whole if mesh is None else mesh))

    def _there(self, mesh: PolyMesh) -> PolyMesh:
        """Return a mesh where it was, not where it went when it was brought to size again."""
        return mesh.with_vertices(mesh.vertices / self.growth)
