"""Cut meshes and ribbons to the triangles that pictures are made of."""

from typing import Protocol

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.core.colour_space import Colours
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_of_corner, next_corner
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.stretches import facet_vertices, rung_ends


class RungRows(Protocol):
    """What ribbons and yarns have in common: rungs or sections in rows, and where passes are."""

    @property
    def offsets(self) -> IntArray:
        """Where the rungs of each thread begin, (T + 1,)."""

    @property
    def pass_offsets(self) -> IntArray:
        """Where the passes of each thread begin, (T + 1,)."""

    @property
    def entry(self) -> IntArray:
        """The rung at which each pass comes to its crossing, (P,)."""


def rung_colours(strips: RungRows, colours: Colours) -> Colours:
    """Return the colour of each rung of ribbons or section of yarns, (R, 3).

    A rung where a thread comes to a crossing has the colour in which it comes, and the ones behind
    that in which it leaves; so colours change at crossings only.

    Parameters
    ----------
    strips : Ribbons or Yarns
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of each pass, as it comes and as it leaves; or one for each thread.

    Raises
    ------
    InputError
        If there are not as many colours as passes or threads.
    """
    offsets = strips.offsets
    n_threads, n_passes = len(offsets) - 1, len(strips.entry)
    colours = np.asarray(colours, dtype=np.uint8)
    if colours.shape not in ((n_threads, 3), (n_passes, 2, 3)):
        raise InputError(
            f"there are {n_threads} threads with {n_passes} passes, and the colours have the shape "
            f"{colours.shape}; give red, green and blue for each thread, or for each pass as it "
            "comes and as it leaves"
        )
    rung = np.arange(offsets[-1])
    thread = np.searchsorted(offsets, rung, side="right") - 1
    if colours.ndim == 2:
        return np.asarray(colours[thread])
    number = np.searchsorted(strips.entry, rung, side="right") - 1
    # An open thread begins before its first pass.
    before = number < strips.pass_offsets[thread]
    number = np.where(before, strips.pass_offsets[thread], number)
    leaves = strips.entry[number] < rung
    return np.asarray(colours[number, leaves.astype(np.int64)])


def ribbon_triangles(ribbons: Ribbons) -> tuple[FloatArray, IntArray, IntArray]:
    """Return all ribbons as vertices, triangles, and the thread of each triangle.

    Vertex ``2 r`` is the right and ``2 r + 1`` the left end of rung ``r``; triangles are as
    ``ribbon_faces`` gives them.
    """
    near = np.flatnonzero(following_rung(ribbons.offsets, ribbons.closed) >= 0)
    thread = np.searchsorted(ribbons.offsets, near, side="right") - 1
    return rung_ends(ribbons), facet_vertices(ribbons, near), np.repeat(thread, 2)


def polygon_triangles(mesh: PolyMesh) -> tuple[FloatArray, IntArray, BoolArray, IntArray]:
    """Cut polygons to triangles: quads in two, larger faces around their centres.

    Returns
    -------
    vertices : (V + F', 3) float array
        Positions, and the centres of faces with more than four corners.
    triangles : (T, 3) int array
        Corners.
    sides : (T, 3) bool array
        Whether the side from corner k to the next is an edge of the mesh.
    face : (T,) int array
        The face that each triangle belongs to.

    Examples
    --------
    >>> square = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    >>> polygon_triangles(square)[2].tolist()
    [[True, True, False], [False, True, True]]
    """
    sizes, start = mesh.face_sizes, mesh.offsets[:-1]
    few = np.flatnonzero((sizes == 3) | (sizes == 4))
    quad = np.flatnonzero(sizes == 4)
    corner = [mesh.indices[start[few] + step] for step in range(3)]
    again = [mesh.indices[start[quad] + step] for step in (0, 2, 3)]
    large = np.flatnonzero(sizes > 4)
    number = np.full(mesh.n_faces, -1, dtype=np.int64)
    number[large] = mesh.n_vertices + np.arange(len(large))
    owner = face_of_corner(mesh)
    around = np.flatnonzero(sizes[owner] > 4)
    fan = [mesh.indices[around], mesh.indices[next_corner(mesh)[around]], number[owner[around]]]
    triangles = np.concatenate([np.column_stack(part) for part in (corner, again, fan)])
    sides = np.ones((len(triangles), 3), dtype=bool)
    sides[: len(few), 2] = sizes[few] == 3
    sides[len(few) : len(few) + len(quad), 0] = False
    sides[len(few) + len(quad) :, 1:] = False
    vertices = mesh.vertices
    if len(large):
        vertices = np.concatenate((vertices, face_centres(mesh)[large]))
    return vertices, triangles, sides, np.concatenate((few, quad, owner[around]))


def face_normals(mesh: PolyMesh) -> FloatArray:
    """Return the mean unit normal of each face, (F, 3)."""
    here = mesh.vertices[mesh.indices]
    area = np.cross(here, here[next_corner(mesh)])
    return unit(np.add.reduceat(area, mesh.offsets[:-1], axis=0))
