"""Make of the bodies of a mesh what is asked for."""

from fabweave.mesh.bodies.keep import KeptBodies, keep_bodies, parse_bodies
from fabweave.mesh.bodies.union import join_bodies
from fabweave.mesh.bodies.wrap import wrap_bodies
from fabweave.mesh.polymesh import PolyMesh


def with_bodies(mesh: PolyMesh, text: str) -> KeptBodies:
    """Return a mesh of the bodies that are asked for, as ``--bodies`` says it.

    Raises
    ------
    InputError
        If that cannot be read, or not be done.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> with_bodies(cube(), "all").mesh.n_faces, with_bodies(cube(), "wrap").mesh.n_faces > 6
    (6, True)
    """
    wanted = parse_bodies(text)
    if wanted.one == "join":
        return join_bodies(mesh)
    return wrap_bodies(mesh) if wanted.one == "wrap" else keep_bodies(mesh, wanted.most)
