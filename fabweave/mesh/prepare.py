"""Make a mesh ready to weave, or say why it cannot be."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.check import MeshReport, check_mesh
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.polymesh import PolyMesh, next_corner, used_vertices, without_loose
from fabweave.mesh.topology import face_patches, orient_faces, split_fans, turn_faces


def prepare_mesh(mesh: PolyMesh) -> tuple[PolyMesh, MeshReport, tuple[str, ...]]:
    """Drop loose vertices, part bodies that only touch, and turn faces; say what was done.

    Where bodies touch only at a vertex, each gets a vertex of its own at that place. In each
    component the direction of most faces stays; a closed component that is then inside
    out is turned as a whole. Nothing else is changed.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.

    Returns
    -------
    mesh : PolyMesh
        An oriented manifold mesh; the same object if nothing had to be done.
    report : MeshReport
        The check of that mesh.
    notes : tuple of str
        What was changed.

    Raises
    ------
    InputError
        If the mesh cannot be woven: the message lists what is wrong, how many, where, and what
        to do about each.

    Examples
    --------
    >>> mesh, report, notes = prepare_mesh(PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2], [0, 3, 2]]))
    >>> mesh.faces(), report.oriented
    ([[0, 1, 2], [0, 2, 3]], True)
    >>> notes[0]
    '1 vertex belongs to no face and was left out'
    """
    if not mesh.n_faces:
        raise InputError("the mesh has no faces; there is nothing to weave")
    report = check_mesh(mesh)
    if report.fatal:
        raise InputError(
            "the mesh cannot be woven:\n"
            + "\n".join(f"  - {finding}" for finding in report.fatal)
            + "\n(vertices and faces are counted from 0)"
        )
    notes = []
    prepared = mesh
    used = used_vertices(mesh)
    if not used.all():
        loose = np.flatnonzero(~used)
        prepared = without_loose(mesh)
        notes.append(
            agree(
                len(loose),
                "{n} [vertex belongs|vertices belong] to no face and [was|were] left out",
            )
        )
    if not report.vertex_manifold:
        # Numbers of vertices are the file's, as in all other messages.
        place = np.flatnonzero(used)
        prepared, split = split_fans(prepared, group_edges(prepared))
        notes.append(
            agree(
                len(split),
                "{n} [vertex|vertices] at which bodies only touch, or fold onto themselves, "
                "[was|were] split, so that each part has its own",
            )
            + f" (vertex {few_of(place[split].tolist(), 5)})"
        )
    edges = group_edges(prepared)
    patch = face_patches(edges, prepared.n_faces)
    if not report.oriented:
        turned = orient_faces(edges, prepared.n_faces)[0]
        prepared = turn_faces(prepared, turned)
        notes.append(
            agree(
                int(np.count_nonzero(turned)),
                "{n} [face was|faces were] inside out and [was|were] turned over",
            )
            + f" ({_some(turned)})"
        )
    inward = _inward_patches(prepared, edges, patch)
    if inward.any():
        prepared = turn_faces(prepared, inward[patch])
        notes.append(
            agree(
                int(np.count_nonzero(inward)),
                "{n} closed [body was|bodies were] inside out and [was|were] turned as a whole",
            )
            + f" ({_some(inward[patch])})"
        )
    if prepared is not mesh:
        report = check_mesh(prepared)
    return prepared, report, tuple(notes)


def inward_faces(mesh: PolyMesh) -> BoolArray:
    """Return which faces are of closed bodies that are inside out, as cavities are, (F,)."""
    edges = group_edges(mesh)
    patch = face_patches(edges, mesh.n_faces)
    astray = flags(int(patch.max(initial=-1)) + 1, patch[edges.face[edges.first[edges.same_way]]])
    return (_inward_patches(mesh, edges, patch) & ~astray)[patch]


def _some(chosen: BoolArray) -> str:
    return f"face {few_of(np.flatnonzero(chosen).tolist(), 5)}"


def _inward_patches(mesh: PolyMesh, edges: EdgeGroups, patch: IntArray) -> BoolArray:
    """Return which components are closed and enclose a negative volume."""
    number = int(patch.max()) + 1
    closed = ~flags(number, patch[edges.face[edges.first[edges.sizes == 1]]])
    volume, size = _patch_volumes(mesh, patch, number)
    # What rounding could make negative (a body without inside) is not called inside out.
    inward: BoolArray = closed & (volume < -1e-12 * size)
    return inward


def _patch_volumes(mesh: PolyMesh, patch: IntArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return six times each component's signed volume, and the sum of its terms' sizes."""
    start = mesh.offsets[:-1]
    size = mesh.face_sizes
    some_vertex = np.zeros((number, 3))
    some_vertex[patch] = mesh.vertices[mesh.indices[start]]  # any point of the component will do
    centre = np.repeat(some_vertex[patch], size, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        base = np.repeat(mesh.vertices[mesh.indices[start]], size, axis=0) - centre
        here = mesh.vertices[mesh.indices] - centre
        there = here[next_corner(mesh)]
        terms = np.einsum("ij,ij->i", base, np.cross(here, there))
        corner_patch = np.repeat(patch, size)
        volume = np.bincount(corner_patch, weights=terms, minlength=number)
        total = np.bincount(corner_patch, weights=np.abs(terms), minlength=number)
    return volume.astype(np.float64), total.astype(np.float64)
