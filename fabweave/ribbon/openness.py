"""Tell how much of a surface a weave leaves open."""

import numpy as np

from fabweave.core.arrays import FloatArray, unit
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import surface_area
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.weave.pattern import Weave, strand_passes


def open_share(ribbons: Ribbons, weave: Weave, mesh: PolyMesh) -> float:
    """Return which share of a surface no ribbon covers.

    That is what is left of its area when all facets are taken away, and what lies on one another
    at crossings is given back: there, strands of the widths a and b that cross at an angle share
    a parallelogram of area a b / sin.

    Parameters
    ----------
    ribbons : Ribbons
    weave : Weave
    mesh : PolyMesh
        The mesh that is woven.

    Returns
    -------
    float
        At least 0: ribbons climb over one another and may have more area than the surface.

    Examples
    --------
    A torus of fine quads in ribbons of half the room: a quarter is covered twice, a quarter not.

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = parse_shape("shape:torus?m=120&n=60")
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.0, width=0.5)
    >>> round(open_share(ribbons, weave, mesh), 2)
    0.25
    """
    following = following_rung(ribbons.offsets, ribbons.closed)
    here = np.flatnonzero(following >= 0)
    ahead = following[here]
    right, left = ribbons.right, ribbons.left
    strips = _areas(right[here], right[ahead], left[ahead]) + _areas(
        right[here], left[ahead], left[here]
    )
    enter, leave = ribbons.entry, ribbons.entry + 1
    along = unit(right[leave] + left[leave] - right[enter] - left[enter])
    across = left[enter] + left[leave] - right[enter] - right[leave]
    width = np.linalg.norm(np.cross(along, across), axis=1) / 2.0
    lower, upper = strand_passes(weave).T
    sine = np.linalg.norm(np.cross(along[upper], along[lower]), axis=1)
    shared = width[upper] * width[lower] / np.maximum(sine, 1e-9)
    covered = float(strips.sum()) - float(shared.sum())
    return max(0.0, 1.0 - covered / surface_area(mesh))


def _areas(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the areas of triangles."""
    area: FloatArray = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    return area
