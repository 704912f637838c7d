"""Prepare the mesh that is remeshed, and describe what came of it."""

from fabweave.core.arrays import frozen_value
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.irregular import Irregular
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.remesh.along.direction import Alignment
from fabweave.mesh.samples import fans
from fabweave.mesh.triangulate import triangulate
from fabweave.mesh.weld import weld_mesh


@frozen_value
class Remeshed:
    """A remeshed surface, and how it came about.

    Parameters
    ----------
    mesh : PolyMesh
        Quads or triangles; some other faces may have stayed if it was paired or unrefined, and a
        note says so.
    method : str
        ``unchanged``, ``pairing``, ``unrefining``, or the name of the remesher.
    notes : tuple of str
        What a person should know.
    irregular : Irregular
        The irregular vertices that remain: inside, those with other than four edges in meshes of
        quads, other than six in meshes of triangles.
    alignment : Alignment or None
        How well quads follow the direction that was wished for.
    """

    mesh: PolyMesh
    method: str
    notes: tuple[str, ...]
    irregular: Irregular
    alignment: Alignment | None = None


def ready_source(mesh: PolyMesh) -> tuple[PolyMesh, list[str]]:
    """Join vertices at the same place and orient the faces, so that remeshers can see the mesh.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.

    Returns
    -------
    source : PolyMesh
        An oriented manifold surface.
    notes : list of str
        What was done.

    Raises
    ------
    InputError
        If it cannot be made one.
    """
    if check_mesh(mesh).codes & {"index-range", "small-face"} or not mesh.n_faces:
        prepare_mesh(mesh)  # says what is wrong
    welded, joined, dropped = weld_mesh(mesh)
    notes: list[str] = []
    source = mesh
    # Bodies that only touch are better left apart than joined to something that cannot be woven.
    if joined and (not check_mesh(welded).fatal or check_mesh(mesh).fatal):
        source = welded
        notes.append(
            agree(
                joined,
                "{n} [vertex was|vertices were] at the same place as another vertex and merged "
                "with it",
            )
            + (agree(dropped, "; {n} [face|faces] vanished as a result") if dropped else "")
        )
    source, _, repairs = prepare_mesh(source)
    return source, [*notes, *repairs]


def cut_surface(source: PolyMesh) -> PolyMesh:
    """Cut a surface into triangles that are a manifold surface too.

    Faces are cut along their shorter diagonals; where two faces then share a diagonal, all faces
    are cut around their centres instead.

    Parameters
    ----------
    source : PolyMesh
        An oriented manifold surface.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> cut_surface(cube()).n_faces
    12
    """
    surface = triangulate(source)
    return surface if not check_mesh(surface).fatal else PolyMesh.from_faces(*fans(source))
