"""Lay a closed surface around a mesh, however broken it is."""

import numpy as np
from scipy.ndimage import binary_closing

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.bodies.keep import DEBRIS, KeptBodies, bodies_of, has_bodies
from fabweave.mesh.nearest import Surface
from fabweave.mesh.orient import face_patches, orient_faces, turn_faces
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import group_edges, keep_faces
from fabweave.mesh.triangulate import triangulate

#: So many steps of the lattice go along the greatest dimension: finer detail is lost.
_STEPS = 100
#: The lattice reaches so many steps beyond the mesh.
_BEYOND = 2
#: A place is inside where the surface winds around it more than so.
_INSIDE = 0.5
#: No point of the lattice is nearer to the surface than this share of a step: triangles keep an
#: area.
_NEAREST = 0.02


def wrap_bodies(mesh: PolyMesh) -> KeptBodies:
    """Return a closed surface around all that a mesh encloses, as far as that can be told.

    The mesh may be open, run through itself, have patches that look either way, or consist of loose
    faces that look outward: a place counts as inside where the generalised winding number of the
    surface is above one half. On a lattice of a hundredth of the size, the border between inside
    and outside is drawn where the surface is. Cavities go, and so does what is finer than the
    lattice.

    Parameters
    ----------
    mesh : PolyMesh
        Any faces.

    Returns
    -------
    KeptBodies
        Of triangles; a mesh that has no places, whose check says what is wrong, as it is.

    Raises
    ------
    InputError
        If the mesh encloses nothing, as an open sheet does.

    References
    ----------
    Barill, Dickson, Schmidt, Levin, Jacobson, "Fast winding numbers for soups and clouds", 2018;
    Lorensen, Cline, "Marching cubes", 1987.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> lidless = keep_faces(cube(), np.arange(6) > 0)
    >>> wrapped = wrap_bodies(lidless)
    >>> wrapped.notes[0].partition(",")[0]
    'all was wrapped in one closed surface'
    """
    sound = _sound(mesh)
    if sound is None:
        return KeptBodies(mesh)
    # All is measured in steps of the lattice, so that no size is too small or too large.
    low, extent = sound.vertices.min(axis=0), np.ptp(sound.vertices, axis=0)
    step = float(extent.max()) / _STEPS
    triangles = _outward(sound.with_vertices((sound.vertices - low) / step))
    counts = np.ceil(extent / step).astype(np.int64) + 2 * _BEYOND + 1
    axes = [np.arange(count, dtype=np.float64) - _BEYOND for count in counts]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")  # x runs fastest, as the cubes are marched
    lattice = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    inside = _closed((_winding(triangles, lattice) > _INSIDE).reshape(z.shape))
    # What is between two faces that nothing closes may go on and on, but not beyond the mesh.
    inside = np.pad(inside[(slice(_BEYOND, -_BEYOND),) * 3], _BEYOND)
    if not inside.any():
        raise InputError(
            "--bodies wrap found nothing to wrap: the mesh encloses nothing, as an open sheet "
            "does, or it is thinner everywhere than a hundredth of its size; close it or thicken "
            "it in a modelling program, or weave it as it is (--bodies all)"
        )
    height = np.where(inside.ravel(), -1.0, 1.0)
    near = np.flatnonzero(_beside(inside))
    surface = Surface(triangles.vertices, triangles.indices.reshape(-1, 3))
    apart = surface.closest(lattice[near])[2]
    height[near] *= np.clip(apart, _NEAREST, 1.0)
    solid, count = _solid(_border(height, lattice, counts))
    wrapped = solid.with_vertices(solid.vertices * step + low)
    told = (
        f"all was wrapped in {agree(count, '[one closed surface|{n} closed surfaces]')}, of "
        f"{wrapped.n_faces} triangles (--bodies wrap): detail and walls finer than a hundredth of "
        "the size are lost; --remesh makes faces of them that are good to weave"
    )
    return KeptBodies(wrapped, (told,))


def _sound(mesh: PolyMesh) -> PolyMesh | None:
    """Return the faces that have an area, as triangles; None if that cannot be told."""
    if not has_bodies(mesh):
        return None
    with np.errstate(over="ignore"):
        sizes = np.ptp(mesh.vertices, axis=0)
    if not np.isfinite(sizes).all():
        return None
    triangles = triangulate(keep_faces(mesh, mesh.face_sizes > 2))
    a, b, c = triangles.vertices[triangles.indices.reshape(-1, 3)].transpose(1, 0, 2)
    sound = _of_faces(triangles, np.any(np.cross(b - a, c - a) != 0.0, axis=1))
    return sound if sound.n_faces else None


def _of_faces(mesh: PolyMesh, keep: BoolArray) -> PolyMesh:
    """Return a mesh of some faces and their vertices only."""
    kept = keep_faces(mesh, keep)
    used, numbers = np.unique(kept.indices, return_inverse=True)
    return PolyMesh(kept.vertices[used], kept.offsets, numbers)


def _outward(mesh: PolyMesh) -> PolyMesh:
    """Return triangles with the sides of each patch turned alike, and outward on the whole."""
    edges = group_edges(mesh)
    mesh = turn_faces(mesh, orient_faces(edges, mesh.n_faces)[0])
    patch = face_patches(edges, mesh.n_faces)
    return turn_faces(mesh, _volumes(mesh, patch)[patch] < 0.0)


def _volumes(triangles: PolyMesh, part: IntArray) -> FloatArray:
    """Return six times what each part encloses with its middle, negative if it looks inward."""
    corners = triangles.vertices[triangles.indices.reshape(-1, 3)]
    weight = np.bincount(part).astype(np.float64)
    middle = np.column_stack(
        [np.bincount(part, corners.mean(axis=1)[:, axis]) / weight for axis in range(3)]
    )
    a, b, c = (corners - middle[part][:, None]).transpose(1, 0, 2)
    terms = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.bincount(part, terms).astype(np.float64)


def _winding(triangles: PolyMesh, places: FloatArray) -> FloatArray:
    """Return how often a surface winds around places, (N,)."""
    # igl takes a while to import, and most jobs never need it.
    from igl import fast_winding_number  # noqa: PLC0415 -- see above

    corners = np.ascontiguousarray(triangles.indices.reshape(-1, 3))
    found = fast_winding_number(np.ascontiguousarray(triangles.vertices), corners, places)
    return np.asarray(found, dtype=np.float64).reshape(-1)


def _closed(inside: BoolArray) -> BoolArray:
    """Return the inside with cracks and holes closed that are a step or two wide."""
    closed: BoolArray = binary_closing(inside, np.ones((3, 3, 3), dtype=bool))
    return closed | inside


def _beside(inside: BoolArray) -> BoolArray:
    """Return which points of a lattice have a neighbour on the other side."""
    found = np.zeros_like(inside)
    for axis in range(3):
        differs = np.diff(inside, axis=axis)
        here = np.moveaxis(found, axis, 0)  # a view
        across = np.moveaxis(differs, axis, 0)
        here[:-1] |= across
        here[1:] |= across
    return found


def _border(height: FloatArray, lattice: FloatArray, counts: IntArray) -> PolyMesh:
    """Return where heights on a lattice go through zero."""
    from igl import marching_cubes  # noqa: PLC0415 -- as above

    points, faces, *_ = marching_cubes(height, lattice, *counts.tolist(), 0.0)
    sizes = np.full(len(faces), 3, dtype=np.int64)
    corners = np.asarray(faces, dtype=np.int64)
    return PolyMesh(np.asarray(points, dtype=np.float64), offsets_of(sizes), corners.ravel())


def _solid(mesh: PolyMesh) -> tuple[PolyMesh, int]:
    """Return the outer surfaces alone, without cavities and debris; and how many there are."""
    body, diagonals = bodies_of(mesh)
    outer = _volumes(mesh, body) > 0.0
    stays = outer & (diagonals >= DEBRIS * diagonals[outer].max(initial=0.0))
    return _of_faces(mesh, stays[body]), int(np.count_nonzero(stays))
