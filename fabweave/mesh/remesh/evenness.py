"""Measure how even the edges of a mesh are: ribbons are narrow where edges are short."""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.mesh.polymesh import PolyMesh, next_corner

#: The share of the edges that may be short.
_FEW = 0.05


def edge_lengths(mesh: PolyMesh) -> FloatArray:
    """Return the length of each half-edge, (H,)."""
    here = mesh.vertices[mesh.indices]
    lengths: FloatArray = np.linalg.norm(here[next_corner(mesh)] - here, axis=1)
    return lengths


def evenness(mesh: PolyMesh) -> float:
    """Return how long all but the shortest twentieth of the edges are, over the median edge.

    Parameters
    ----------
    mesh : PolyMesh

    Returns
    -------
    float
        From 0 to 1; 1 if all edges are as long.

    Examples
    --------
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> round(evenness(parse_shape("shape:cube")), 9)
    1.0
    """
    short, middle = np.quantile(edge_lengths(mesh), (_FEW, 0.5)).tolist()
    return float(short / middle) if middle > 0 else 0.0
