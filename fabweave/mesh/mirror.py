"""Find the plane in which a surface is most nearly its own image, and work on half of it."""

from functools import lru_cache

import numpy as np

from fabweave.core.arrays import FloatArray, flags, frozen_value, unit
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.nearest import Feet, Surface
from fabweave.mesh.polymesh import PolyMesh, without_loose
from fabweave.mesh.triangulate import area_samples, plain_triangles, triangles_above

#: Samples of the surface; one of so many is used for comparing directions.
_SAMPLES, _EACH = 4000, 4
#: Directions that are tried, beside the three axes and the three principal ones; the best of all
#: are improved.
_DIRECTIONS, _BEST = 60, 8
#: Rounds of improving, and the share of the pairs that are left out of each as too far.
_ROUNDS, _OUTLIERS = 12, 0.1
#: A round must bring the distance below this share of what it was, or it is the last one.
_WORTH = 0.999
#: A surface is symmetric if its mirror image is within this root mean square, in per cent of its
#: size, and 95 % of it within this: no farther than a remeshed one is anyhow. Measured: spot, bob
#: and suzanne 0.003, homer and cow 0.1 and 0.2, an elephant 0.26, nefertiti 0.38 and 0.8;
#: cheburashka, who holds its ears askew, 0.8 and 1.5, armadillo and duck 1.5, bunny 2.8 and more.
_RMS_PERCENT, _QUANTILE_PERCENT = 0.5, 1.0
#: A surface that rises from a plane by no more than this share of its extent (both root mean
#: squares) lies in it: it is its own image there whatever its shape, and has no halves.
_FLAT = 0.01


@frozen_value
class Mirror:
    """A plane, and how nearly a surface is its own image in it.

    Parameters
    ----------
    point, normal : (3,) float arrays
        The plane; the normal has length one, and its greatest component is positive.
    rms_percent, quantile_percent : float
        Root mean square, and 95 % quantile, of the distances from the mirrored surface to the
        surface, in per cent of its greatest extent.
    """

    point: FloatArray
    normal: FloatArray
    rms_percent: float
    quantile_percent: float

    @property
    def symmetric(self) -> bool:
        """Whether the surface is symmetric for all that a maker can see."""
        return self.rms_percent < _RMS_PERCENT and self.quantile_percent < _QUANTILE_PERCENT

    def image(self, places: FloatArray) -> FloatArray:
        """Return the mirror images of places, (N, 3)."""
        height = (places - self.point) @ self.normal
        return np.asarray(places - 2 * height[:, None] * self.normal)


@lru_cache(maxsize=8)
def find_mirror(mesh: PolyMesh) -> Mirror:
    """Find the plane in which a surface is most nearly its own mirror image.

    Planes through the centre of area are tried in many directions; the best are improved in turns
    of finding the closest points of the mirrored samples, and the plane that mirrors these pairs
    best. It goes by the surface alone, so vertices need not have images.

    Parameters
    ----------
    mesh : PolyMesh
        Faces with an area.

    Returns
    -------
    Mirror
        The same for the same mesh; ask whether it is ``symmetric``.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> mirror = find_mirror(torus(24, 12, 35.0, 15.0))
    >>> mirror.symmetric, round(mirror.rms_percent, 2)
    (True, 0.0)

    References
    ----------
    Podolak, Shilane, Golovinskiy, Rusinkiewicz, Funkhouser, "A planar-reflective symmetry
    transform for 3D shapes", ACM TOG 25(3), 2006. Ecins, Fermüller, Aloimonos, "Detecting
    reflectional symmetries in 3D data through symmetrical fitting", ICCV workshops 2017.
    """
    points, triangles = plain_triangles(mesh)
    surface = Surface(points, triangles)
    places, _ = area_samples(points, triangles, _SAMPLES)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    centre = places.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((places - centre).T))
    directions = np.concatenate([np.eye(3), axes.T, _half_sphere(_DIRECTIONS)])
    few = places[::_EACH]
    score = [_off(surface, few, centre, normal)[0] for normal in directions]
    tried = [
        _improved(surface, few, centre, directions[number])
        for number in np.argsort(score, kind="stable")[:_BEST].tolist()
    ]
    _, point, normal = min(tried, key=lambda plane: plane[0])
    _, point, normal = _improved(surface, places, point, normal)
    normal = normal * np.sign(normal[int(np.argmax(np.abs(normal)))])
    distance = _off(surface, places, point, normal)[1].distances
    return Mirror(
        point,
        normal,
        100.0 * float(np.sqrt(np.mean(distance**2))) / size,
        100.0 * float(np.quantile(distance, 0.95)) / size,
    )


def _off(
    surface: Surface, places: FloatArray, point: FloatArray, normal: FloatArray
) -> tuple[float, Feet]:
    """Return the root mean square of the distances of mirrored places, and their closest points.

    It is infinite where the surface lies in the plane.
    """
    height = (places - point) @ normal
    feet = surface.feet(places - 2 * height[:, None] * normal)
    flat = np.mean(height**2) <= _FLAT**2 * places.var(axis=0).sum()
    return np.inf if flat else float(np.sqrt(np.mean(feet.distances**2))), feet


def _improved(
    surface: Surface, places: FloatArray, point: FloatArray, normal: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Bring a plane to where it mirrors the places best; return how far they are off, and it."""
    off, feet = _off(surface, places, point, normal)
    best = off, point, normal
    for _ in range(_ROUNDS):
        near = feet.distances <= np.quantile(feet.distances, 1 - _OUTLIERS)
        here, there = places[near], feet.points[near]
        # The sum of the squares of |image of a place - its partner| is least for the eigenvector
        # of the least eigenvalue of this.
        cross = (here - here.mean(axis=0)).T @ (there - there.mean(axis=0))
        point = (here.mean(axis=0) + there.mean(axis=0)) / 2
        normal = np.linalg.eigh(cross + cross.T)[1][:, 0]
        off, feet = _off(surface, places, point, normal)
        if off >= best[0] * _WORTH:
            break
        best = off, point, normal
    return best


def _half_sphere(count: int) -> FloatArray:
    """Return directions spread over half a sphere, (count, 3), along a spiral."""
    height = (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    across = np.sqrt(1 - height**2)
    return unit(np.column_stack([across * np.cos(turn), across * np.sin(turn), height]))


#: Vertices nearer to the mirror than this share of the mean edge are put on it before the cut.
_NEAR = 0.1


def half_of(surface: PolyMesh, mirror: Mirror) -> PolyMesh:
    """Return the part of a surface of triangles on the positive side of a mirror.

    Vertices near the mirror are put on it, and edges that cross it are cut there.

    Parameters
    ----------
    surface : PolyMesh
        An oriented manifold of triangles.
    mirror : Mirror

    Returns
    -------
    PolyMesh
        Triangles, with a boundary on the mirror.

    Examples
    --------
    >>> from fabweave.mesh.mirror import find_mirror
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> from fabweave.mesh.triangulate import triangulate
    >>> ball = triangulate(sphere(8, 50.0))
    >>> half = half_of(ball, find_mirror(ball))
    >>> half.n_faces == ball.n_faces // 2
    True
    """
    faces = surface.indices.reshape(-1, 3)
    ends = surface.vertices[np.roll(faces, -1, axis=1)] - surface.vertices[faces]
    near = _NEAR * float(np.linalg.norm(ends, axis=2).mean())
    height = (surface.vertices - mirror.point) @ mirror.normal
    on = np.abs(height) <= near
    points = surface.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    half = triangles_above(points, faces, np.where(on, 0.0, height))
    return without_loose(PolyMesh.from_triangles(*half))


def sound_half(surface: PolyMesh, mirror: Mirror) -> PolyMesh | None:
    """Return the half of a surface of triangles; None if that is no open surface."""
    half = half_of(surface, mirror)
    report = check_mesh(half)
    return None if not half.n_faces or report.fatal or report.closed else half


def joined_with_image(half: PolyMesh, mirror: Mirror, reach: float) -> PolyMesh:
    """Return a half and its mirror image, joined along the boundary that is on the mirror.

    Parameters
    ----------
    half : PolyMesh
        A surface on the positive side.
    mirror : Mirror
    reach : float
        Boundary vertices nearer to the mirror than this are put on it.

    Returns
    -------
    PolyMesh
        Exactly symmetric.
    """
    halfedges = build_halfedges(half)
    height = (half.vertices - mirror.point) @ mirror.normal
    on = flags(half.n_vertices, halfedges.tail[halfedges.twin < 0])
    on &= np.abs(height) <= reach
    points = half.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    number = np.where(on, np.arange(len(points)), len(points) + np.cumsum(~on) - 1)
    faces = half.indices.reshape(half.n_faces, -1)
    return PolyMesh.from_faces(
        np.concatenate([points, mirror.image(points[~on])]),
        np.concatenate([faces, number[faces[:, ::-1]]]),
    )
