"""Find how a woven object repeats itself under rotations."""

from fabweave.app.settings import Settings
from fabweave.app.woven_mesh import WovenMesh
from fabweave.flat.split.preferences import KIND_PRICES
from fabweave.flat.split.repeats import Repeats, find_repeats
from fabweave.mesh.symmetry.search import EXACT, find_symmetry
from fabweave.stock.supplies import Supplies
from fabweave.weave.symmetry import WeaveSymmetry, find_weave_symmetry

#: Where a mesh has no exact symmetry, one to within this share of its size is looked for: 0.03 mm
#: of 300 mm, about as near as pieces of one kind are.
_NEARLY = 1e-4


def symmetry_tolerance(woven: WovenMesh) -> float:
    """Return how exactly a mesh is symmetric, as a share of its size; EXACT if it is not at all."""
    if find_symmetry(woven.mesh, woven.halfedges).order > 1:
        return EXACT
    near = find_symmetry(woven.mesh, woven.halfedges, tolerance=_NEARLY)
    return _NEARLY if near.order > 1 else EXACT


def rotations_of(woven: WovenMesh, tolerance: float) -> WeaveSymmetry:
    """Return the rotations that map a woven mesh onto itself, with over and under."""
    return find_weave_symmetry(
        woven.mesh, woven.halfedges, woven.weave, tolerance=tolerance, reflections=False
    )


def object_repeats(woven: WovenMesh, settings: Settings, supplies: Supplies) -> Repeats | None:
    """Return which stretches of threads repeat others and are to be cut alike; None if none are."""
    if KIND_PRICES[settings.kinds] is None:
        return None
    symmetry = rotations_of(woven, symmetry_tolerance(woven))
    repeats = find_repeats(symmetry, supplies.of(woven.bunches))
    return repeats if repeats.repeat else None
