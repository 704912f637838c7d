"""Rims of surfaces of revolution, with rings along them."""

import numpy as np

from fabweave.piece.rim_ring import Rungs, plan_ring

SIZES = {"edge_mm": 6.0, "thickness_mm": 0.8, "clearance_mm": 0.2}
#: From the middle of the strands to that of the band.
ABOVE = 1.5 * 0.8 + 0.1


def rim_of(rim, foot, count=16):
    """Return the rungs of a rim of a radius and height, each with its normals: rim, and foot."""
    turn = -np.arange(count) * 2 * np.pi / count
    away = np.array(foot, float) - rim
    out = np.array([-away[1], away[0]]) / np.hypot(*away)

    def around(radius, height):
        return np.column_stack(
            (radius * np.cos(turn), radius * np.sin(turn), np.full(count, height, float))
        )

    normal = around(*out)
    return (around(*rim), normal), (around(*foot), normal)


def ring_of(rim, foot, count=16, **options):
    """Plan a ring along such a rim."""
    names = np.arange(count)
    given = {"hole_mm": np.full(count, 3.0), **SIZES, **options}
    return plan_ring("top", Rungs(names, names), *rim_of(rim, foot, count), **given)
