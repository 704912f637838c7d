"""Tell whether the ribbons of a mesh keep clear of one another, and at which size."""

from dataclasses import dataclass

import numpy as np

from fabweave.app.joined_object import check_joined, split_object
from fabweave.app.request import complete_settings, hole_rules
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject, weave_object
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.stock.ribbon_limits import ribbon_limits


def intersecting(ribbons: Ribbons) -> int:
    """Count pairs of facets that run through one another, by libigl's exact predicates."""
    vertices, triangles, _ = ribbon_triangles(ribbons)
    mesh = PolyMesh(vertices, 3 * np.arange(len(triangles) + 1), triangles.ravel())
    return len(self_intersections(mesh))


@dataclass(frozen=True, eq=False)
class Laid:
    """Ribbons as a job lays them, and what is too near."""

    woven: WovenObject
    check: RibbonCheck
    n_near: int
    n_through: int


def laid(mesh: str, size_mm: float, **options) -> Laid:
    """Lay the ribbons of a mesh as a job does, with room for laps where it plans joints."""
    settings, supplies = complete_settings(Settings(mesh=mesh, size_mm=size_mm, **options))
    woven = weave_object(settings, supplies)
    joined = split_object(woven, settings, supplies, hole_rules(settings, supplies))
    woven = joined.woven
    limits = ribbon_limits(supplies.only, settings.clearance_mm)
    near, _ = measure_clearance(woven.ribbons, woven.weave, limits)
    check = check_joined(woven, settings, supplies, joined.repeats)
    return Laid(woven, check, len(near.value), intersecting(woven.ribbons))
