"""Lay the ribbons of a job as it asks for them: wavy, or straight."""

from fabweave.core.arrays import Progress, no_progress
from fabweave.form.straight import straightened
from fabweave.ribbon.lay import WovenObject, lay_object
from fabweave.ribbon.settings import RibbonSettings
from fabweave.stock.supplies import Supplies
from fabweave.weave.weave_mesh import WovenMesh


def lay_strips(
    woven: WovenMesh, settings: RibbonSettings, supplies: Supplies, progress: Progress = no_progress
) -> WovenObject:
    """Lay the ribbons of a woven mesh as asked: as wide, and wavy or straight.

    There is room for a lap at every crossing: before pieces are planned, a joint may come to lie
    at any.
    """
    laid = lay_object(woven, settings, supplies, progress)
    return straightened(laid, settings, supplies, progress) if settings.straight else laid
