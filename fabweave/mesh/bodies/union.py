"""Join bodies that run into one another into one surface."""

from types import ModuleType

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.bodies.keep import KeptBodies, bodies_of, has_bodies
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import triangulate

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
        If a body is not closed, or the package that does it is not installed.

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
    engine = _engine()
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
    sizes = np.full(len(faces), 3, dtype=np.int64)
    told = (
        f"{count} bodies were joined into {parts}, of {agree(len(faces), '{n} triangle[|s]')} "
        "(--bodies join); --remesh makes faces of them that are good to weave"
    )
    return KeptBodies(PolyMesh(points, offsets_of(sizes), faces.ravel()), (told,))


def _engine() -> ModuleType:
    """Return the package that joins solids; raise InputError if it is not installed."""
    try:
        import manifold3d  # noqa: PLC0415
    except ImportError:
        raise InputError(
            "--bodies join needs the package manifold3d: pip install 'fabweave[join]'; or join "
            "the bodies in a modelling program (in Blender: Boolean, Union)"
        ) from None
    return manifold3d


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
