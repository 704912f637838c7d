"""Lay ribbons without a job, and measure how exact an unfolding is."""

import numpy as np
from weaving_meshes import walked

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.upright import resize_mesh
from fabweave.piece.development import Strips
from fabweave.ribbon.project import Ribbons, project_ribbons
from fabweave.weave.pattern import Weave, plain_weave


def shape_at(name: str, size_mm: float = 300.0) -> PolyMesh:
    """Return a built-in shape at a size."""
    return resize_mesh(parse_shape(f"shape:{name}"), size_mm=size_mm)[0]


def plain_ribbons(
    mesh: PolyMesh, *, turn: bool = False, height_mm: float = 0.3, **options: object
) -> tuple[Weave, Ribbons]:
    """Lay the ribbons of a mesh in plain weave."""
    halfedges, threads = walked(mesh, turn=turn)
    weave = plain_weave(threads)
    return weave, project_ribbons(mesh, halfedges, weave, height_mm=height_mm, **options)


def worst_stretch(ribbons: Ribbons, strips: Strips) -> float:
    """The largest relative change of length over all facet edges, diagonals included."""
    right, left = ribbons.right[strips.rung], ribbons.left[strips.rung]
    inner = np.ones(len(strips.rung), dtype=bool)
    inner[strips.offsets[1:][np.diff(strips.offsets) > 0] - 1] = False
    near = np.flatnonzero(inner)
    far = near + 1
    slanted = ribbons.from_right[strips.rung[near]]
    start = np.where(slanted, near, near + len(right))
    end = np.where(slanted, far + len(right), far)
    space, flat = np.concatenate((right, left)), np.concatenate((strips.right, strips.left))
    every = np.arange(len(right))
    pairs = (every, every + len(right)), (near, far), (near + len(right), far + len(right))
    edges = np.concatenate([np.column_stack(pair) for pair in (*pairs, (start, end))])
    length = np.linalg.norm(space[edges[:, 0]] - space[edges[:, 1]], axis=1)
    unfolded = np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1)
    return float(np.max(np.abs(unfolded - length) / length))
