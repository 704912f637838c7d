"""Tell whether the ribbons of a mesh keep clear of one another, and at which size."""

from dataclasses import dataclass

import jobs

from fabweave.job.ask import brief_of
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.piece.joined_strands import check_joined, split_object
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.stock.ribbon_limits import ribbon_limits


def intersecting(ribbons: Ribbons) -> int:
    """Count pairs of facets that run through one another, by libigl's exact predicates."""
    vertices, triangles, _ = ribbon_triangles(ribbons)
    return len(self_intersections(PolyMesh.from_triangles(vertices, triangles)))


@dataclass(frozen=True, eq=False)
class Laid:
    """Ribbons as a job lays them, and what is too near."""

    woven: WovenObject
    check: RibbonCheck
    n_near: int
    n_through: int


def laid(mesh: str, size_mm: float, **options) -> Laid:
    """Lay the ribbons of a mesh as a job does, with room for laps where it plans joints."""
    woven, settings, supplies = jobs.laid(mesh, size_mm=size_mm, **options)
    joined = split_object(woven, brief_of(settings, supplies))
    woven = joined.woven
    limits = ribbon_limits(supplies.only, settings.ribbons.clearance_mm)
    near, _ = measure_clearance(woven.ribbons, woven.weave, limits)
    check = check_joined(woven, brief_of(settings, supplies), joined.repeats)
    return Laid(woven, check, len(near.value), intersecting(woven.ribbons))
