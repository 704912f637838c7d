"""Choose the bodies of a mesh: keep some, join those that run together, or wrap them all."""

from types import ModuleType
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.check import FAR
from fabweave.mesh.halfedge import group_edges
from fabweave.mesh.likeness import likeness
from fabweave.mesh.nearest import Surface, libigl
from fabweave.mesh.polymesh import PolyMesh, face_of_corner, without_loose
from fabweave.mesh.remesh.engines import QSLIM, AttemptFailedError, Run, run_engine
from fabweave.mesh.remesh.remeshed import sound_faults
from fabweave.mesh.topology import face_patches, keep_faces, label_links, orient_faces, turn_faces
from fabweave.mesh.triangulate import surface_area, triangulate

#: A body is taken for debris if its diagonal is less than this share of the largest one's.
DEBRIS = 0.05


class Bodies(NamedTuple):
    """What is asked of bodies: how many are kept, None for all; or that they become one surface.

    They are joined to what they enclose together (``join``), or wrapped (``wrap``).
    """

    most: int | None = None
    one: str | None = None


class KeptBodies(NamedTuple):
    """A mesh of which bodies were kept or joined, notes, and the share of its surface that went.

    The share is rounded to a hundredth, as the notes tell it.
    """

    mesh: PolyMesh
    notes: tuple[str, ...] = ()
    left_out: float = 0.0


def parse_bodies(text: str) -> Bodies:
    """Return what is asked of bodies, from text.

    Raises
    ------
    InputError
        If the text says none of all, largest, join and wrap, and is no whole number from 1 on.

    Examples
    --------
    >>> parse_bodies("all").most, parse_bodies("largest").most, parse_bodies("3").most
    (None, 1, 3)
    >>> parse_bodies("join")
    Bodies(most=None, one='join')
    """
    if text == "all":
        return Bodies()
    if text in ("join", "wrap"):
        return Bodies(one=text)
    if text == "largest":
        return Bodies(1)
    if text.isascii() and text.isdigit() and len(text) < 10 and int(text) > 0:
        return Bodies(int(text))
    raise InputError(f"{text!r} is not all, largest, join, wrap, or a whole number from 1 on")


def keep_bodies(mesh: PolyMesh, most: int | None) -> KeptBodies:
    """Keep only the largest bodies of a mesh; or all, and say which look like debris.

    Bodies are what hangs together by vertices; the size of one is the diagonal of its bounding box.
    Of equal ones, the first in the mesh is kept.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.
    most : int or None
        How many bodies to keep; None for all.

    Returns
    -------
    KeptBodies
        With the same mesh if nothing was left out; notes tell what was left out, or could be.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [9, 0, 0], [0, 9, 0], [20, 0, 0], [20.1, 0, 0], [20, 0.1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> keep_bodies(two, 1).mesh.faces(), len(keep_bodies(two, None).notes)
    ([[0, 1, 2]], 1)
    """
    if not has_bodies(mesh):
        return KeptBodies(mesh)
    body, diagonals = bodies_of(mesh)
    count = len(diagonals)
    order = np.argsort(-diagonals, kind="stable")
    if most is None:
        small = int(np.count_nonzero(diagonals < DEBRIS * diagonals[order[0]]))
        if not small:
            return KeptBodies(mesh)
        large = count - small
        kept = "largest" if large == 1 else str(large)
        debris = (
            agree(small, f"{{n}} of the {count} bodies [is|are] smaller than a twentieth of ")
            + f"the largest, and may be debris; --bodies {kept} keeps only the large "
            + agree(large, "[one|ones]")
        )
        return KeptBodies(mesh, (debris,))
    if count <= most:
        return KeptBodies(mesh)
    stays = flags(count, order[:most])
    faces = stays[body]
    indices = mesh.indices[np.repeat(faces, mesh.face_sizes)]
    # Vertices of no face are the check's affair; those of the bodies that go, go.
    used, gone = np.zeros(mesh.n_vertices, dtype=bool), np.zeros(mesh.n_vertices, dtype=bool)
    used[indices] = True
    gone[mesh.indices] = True
    gone &= ~used
    place = np.cumsum(~gone) - 1
    kept_mesh = PolyMesh(mesh.vertices[~gone], offsets_of(mesh.face_sizes[faces]), place[indices])
    whole = surface_area(mesh)
    left_out = round(1.0 - surface_area(kept_mesh) / whole, 2) if whole > 0.0 else 0.0
    told = (
        agree(count - most, f"{{n}} of {count} bodies [was|were] left out, ")
        + f"with {agree(int(np.count_nonzero(~faces)), '{n} [face|faces]')} and "
        + f"{left_out:.0%} of the surface (--bodies)"
    )
    return KeptBodies(kept_mesh, (told,), left_out)


def has_bodies(mesh: PolyMesh) -> bool:
    """Return whether bodies can be told apart: else the check of the mesh says what is wrong."""
    wrong = (mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)
    return bool(mesh.n_faces and not wrong.any() and mesh.face_sizes.all())


def bodies_of(mesh: PolyMesh) -> tuple[IntArray, FloatArray]:
    """Return the body of each face, (F,), and the diagonal of each body."""
    first = mesh.indices[mesh.offsets[:-1]]
    # Bodies are numbered by faces, so that vertices of no face count for none.
    corner_face = face_of_corner(mesh)
    label = label_links(first[corner_face], mesh.indices, mesh.n_vertices)[1]
    number, body = np.unique(label[first], return_inverse=True)
    low, high = np.full((len(number), 3), np.inf), np.full((len(number), 3), -np.inf)
    points = mesh.vertices[mesh.indices]
    np.minimum.at(low, body[corner_face], points)
    np.maximum.at(high, body[corner_face], points)
    with np.errstate(over="ignore", invalid="ignore"):
        diagonals = np.linalg.norm(high - low, axis=1)
    return body, np.where(np.isfinite(diagonals), diagonals, 0.0)


def with_bodies(mesh: PolyMesh, text: str) -> KeptBodies:
    """Return a mesh of the bodies that are asked for, as ``--bodies`` says it.

    Raises
    ------
    InputError
        If that cannot be read, or not be done.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> with_bodies(cube(), "all").mesh.n_faces, with_bodies(cube(), "join").mesh.n_faces
    (6, 6)
    """
    wanted = parse_bodies(text)
    if wanted.one == "join":
        return join_bodies(mesh)
    return wrap_bodies(mesh) if wanted.one == "wrap" else keep_bodies(mesh, wanted.most)


#: Slivers that the union leaves are taken away up to this share of the size.
_TINY = 1e-5


def join_bodies(mesh: PolyMesh) -> KeptBodies:
    """Return the surface of all that bodies enclose together: their union.

    Walls inside go, and so does a body that is inside another. Where no two bodies meet, the mesh
    stays as it is.

    Parameters
    ----------
    mesh : PolyMesh
        Of closed bodies.

    Returns
    -------
    KeptBodies
        Of triangles, if anything was joined.

    Raises
    ------
    InputError
        If a body is not closed.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> one = cube()
    >>> two = PolyMesh.from_faces(
    ...     [*one.vertices.tolist(), *(one.vertices + 0.5).tolist()],
    ...     [*one.faces(), *([corner + 8 for corner in face] for face in one.faces())])
    >>> joined = join_bodies(two)
    >>> joined.notes[0].partition(",")[0], len(bodies_of(joined.mesh)[1])
    ('2 bodies were joined into 1', 1)
    """
    if not has_bodies(mesh):
        return KeptBodies(mesh)
    triangles = triangulate(mesh)
    body, diagonals = bodies_of(triangles)
    count = len(diagonals)
    if count == 1:
        return KeptBodies(mesh, ("there is only one body, so nothing was joined (--bodies join)",))
    import manifold3d as engine  # noqa: PLC0415 - few jobs join bodies

    corners = triangles.indices.reshape(-1, 3)
    solids = [
        _solid(engine, triangles.vertices, corners[body == one], f"body {one + 1} of {count}")
        for one in range(count)
    ]
    union = engine.Manifold.batch_boolean(solids, engine.OpType.Add)
    parts = len(union.decompose())
    if parts == count:
        note = f"no two of the {count} bodies run into one another, so nothing was joined"
        return KeptBodies(mesh, (note,))
    size = float(np.ptp(triangles.vertices, axis=0).max())
    made = union.simplify(_TINY * size).to_mesh64()
    points = np.asarray(made.vert_properties, dtype=np.float64)[:, :3]
    faces = np.asarray(made.tri_verts, dtype=np.int64)
    told = (
        f"{count} bodies were joined into {parts}, of {agree(len(faces), '{n} triangle[|s]')} "
        "(--bodies join); --remesh makes faces of them that are good to weave"
    )
    return KeptBodies(PolyMesh.from_triangles(points, faces), (told,))


def _solid(engine: ModuleType, points: FloatArray, corners: IntArray, name: str) -> object:
    """Return what a closed body encloses, whichever way its faces look."""
    used, numbers = np.unique(corners, return_inverse=True)
    numbers = numbers.reshape(-1, 3)
    a, b, c = points[used][numbers].transpose(1, 0, 2)
    if np.einsum("ij,ij->", np.cross(a, b), c) < 0.0:
        numbers = numbers[:, ::-1]
    # The engine takes whole numbers without a sign.
    whole = np.ascontiguousarray(numbers.astype(np.uint64))
    solid = engine.Manifold(engine.Mesh64(np.ascontiguousarray(points[used]), whole))
    if solid.status() != engine.Error.NoError:
        raise InputError(
            f"{name}, with {agree(len(corners), '{n} triangle[|s]')}, is not closed, so the bodies "
            "cannot be joined: close it, or leave it out in a modelling program"
        )
    return solid


#: So many steps of the lattice go along the greatest dimension: finer detail is lost.
_STEPS = 100
#: The lattice reaches so many steps beyond the mesh.
_BEYOND = 2
#: A place is inside where the surface winds around it more than so.
_INSIDE = 0.5
#: No point of the lattice is nearer to the surface than this share of a step: triangles keep an
#: area.
_NEAREST = 0.02
#: A wrap has no more triangles than the first of these, and the last if that keeps it within so
#: many steps of the lattice. Of fewer, quads come out farther off the corners of a box.
_COUNTS, _OFF = (12_000, 6000), 0.25


def wrap_bodies(mesh: PolyMesh) -> KeptBodies:
    """Return a closed surface around all that a mesh encloses, as far as that can be told.

    The mesh may be open, run through itself, have patches that look either way, or consist of loose
    faces that look outward: a place counts as inside where the generalised winding number of the
    surface is above one half. On a lattice of a hundredth of the size, the border between inside
    and outside is drawn where the surface is. Cavities go, and so does what is finer than the
    lattice. Then edges are collapsed as long as the surface stays within a quarter of a step.

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
    sound = sound_part(mesh)
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
    inside = (winding(triangles, lattice) > _INSIDE).reshape(z.shape)
    # Cracks and holes are closed that are a step or two wide.
    inside |= binary_closing(inside, np.ones((3, 3, 3), dtype=bool))
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
    apart = surface.feet(lattice[near]).distances
    height[near] *= np.clip(apart, _NEAREST, 1.0)
    dense, count = _wrapped_solid(_border(height, lattice, counts))
    solid, off = _thinned(dense)
    wrapped = solid.with_vertices(solid.vertices * step + low)
    told = (
        f"all was wrapped in {agree(count, '[one closed surface|{n} closed surfaces]')}, of "
        f"{wrapped.n_faces} triangles (--bodies wrap): detail and walls finer than a hundredth of "
        f"the size are lost; the triangles stand for {dense.n_faces}, and are at most "
        f"{off / _STEPS:.2%} of the size off these; --remesh makes faces of them that are good to "
        "weave"
    )
    return KeptBodies(wrapped, (told,))


def _thinned(dense: PolyMesh) -> tuple[PolyMesh, float]:
    """Return a surface of fewer triangles that is as sound, and how far off it is, in steps."""
    thin, off = dense, 0.0
    for count in _COUNTS:
        if count >= thin.n_faces:
            continue
        try:
            fewer = run_engine(QSLIM, thin, Run(count, 0, rim=False))
        except AttemptFailedError:
            break
        if sound_faults(thin, fewer, 3):
            break
        away = likeness(dense, fewer).greatest_mm
        if away > _OFF and count < _COUNTS[0]:
            break
        thin, off = fewer, away
    return thin, off


def sound_part(mesh: PolyMesh) -> PolyMesh | None:
    """Return the faces that have an area, as triangles; None if that cannot be told."""
    if not has_bodies(mesh):
        return None
    if not (np.abs(mesh.vertices) <= FAR).all():
        return None
    triangles = triangulate(keep_faces(mesh, mesh.face_sizes > 2))
    a, b, c = triangles.vertices[triangles.indices.reshape(-1, 3)].transpose(1, 0, 2)
    sound = _of_faces(triangles, np.any(np.cross(b - a, c - a) != 0.0, axis=1))
    return sound if sound.n_faces else None


def _of_faces(mesh: PolyMesh, keep: BoolArray) -> PolyMesh:
    """Return a mesh of some faces and their vertices only."""
    return without_loose(keep_faces(mesh, keep))


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


def winding(mesh: PolyMesh, places: FloatArray) -> FloatArray:
    """Return how often a surface winds around places, (N,)."""
    triangles = triangulate(mesh)
    corners = np.ascontiguousarray(triangles.indices.reshape(-1, 3))
    points = np.ascontiguousarray(triangles.vertices)
    found = libigl().fast_winding_number(points, corners, np.ascontiguousarray(places))
    return np.asarray(found, dtype=np.float64).reshape(-1)


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
    points, faces, *_ = libigl().marching_cubes(height, lattice, *counts.tolist(), 0.0)
    corners = np.asarray(faces, dtype=np.int64)
    return PolyMesh.from_triangles(np.asarray(points, dtype=np.float64), corners)


def _wrapped_solid(mesh: PolyMesh) -> tuple[PolyMesh, int]:
    """Return the outer surfaces alone, without cavities and debris; and how many there are."""
    body, diagonals = bodies_of(mesh)
    outer = _volumes(mesh, body) > 0.0
    stays = outer & (diagonals >= DEBRIS * diagonals[outer].max(initial=0.0))
    return _of_faces(mesh, stays[body]), int(np.count_nonzero(stays))
