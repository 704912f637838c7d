"""Build the former of a job, and lay it on sheets; where that cannot be, say which board would do.

What a former is stands in ``fabweave/former``.
"""

from contextlib import suppress

from fabweave.core.errors import CannotMakeError
from fabweave.former.plates import Former, Laid, build_former
from fabweave.former.sheets import former_sheets, former_steps
from fabweave.job.ask import FORMER_BOARD, former_supply
from fabweave.job.planned import PlannedJob
from fabweave.piece.rim_ring import free_prefix
from fabweave.plan.order import Order
from fabweave.sheet.side_sheets import SideSheets
from fabweave.stock.supplies import Supply


def former_of(planned: PlannedJob) -> Former | None:
    """Build the former of a job, if one is asked for.

    Raises
    ------
    CannotMakeError
        If it has no room.
    """
    supply = planned.supplies.former
    if supply is None:
        return None
    try:
        return _built(planned, supply)
    except CannotMakeError as error:
        raise CannotMakeError(error.reason, _cure(planned)) from None


def told_steps(planned: PlannedJob, laid: Laid | None, order: Order) -> list[str]:
    """Say how the former of a job is put together, used and taken out; nothing without one."""
    ids = [planned.piece_set.pieces[at].id for at in order.order.tolist()]
    return [] if laid is None else former_steps(laid, ids)


def former_on_sheets(planned: PlannedJob, laid: Laid | None, steps: list[str]) -> SideSheets | None:
    """Return the sheets of a job's former, if it has one, with the steps that its text tells.

    Raises
    ------
    CannotMakeError
        If a plate fits no sheet, or sheets run out.
    """
    supply = planned.supplies.former
    if laid is None or supply is None:
        return None
    try:
        return _on_sheets(planned, laid, supply, steps)
    except CannotMakeError as error:
        # What that proposes would not change a former.
        raise CannotMakeError(f"of the former, {error.reason}", _cure(planned)) from None


def _built(planned: PlannedJob, supply: Supply) -> Former:
    """Build the former of a job from a supply."""
    return build_former(
        planned.woven,
        planned.split_plan.runs,
        layer_mm=max(material.thickness_mm for material in planned.supplies.materials),
        thickness_mm=supply.material.thickness_mm,
        prefix=free_prefix("F", planned.woven.labels),
    )


def _on_sheets(planned: PlannedJob, laid: Laid, supply: Supply, steps: list[str]) -> SideSheets:
    """Nest a former on the sheets of a supply, and draw these."""
    return former_sheets(
        laid,
        planned.piece_set.pieces,
        supply,
        planned.settings.machine,
        planned.woven.title,
        planned.settings.stock.margin_mm,
        steps,
    )


def _cure(planned: PlannedJob) -> str:
    """Say what to do about a former that cannot be made: another board, if that was seen to do."""
    board = former_supply(planned.settings.but(former=FORMER_BOARD), planned.supplies)
    with suppress(CannotMakeError):
        _on_sheets(planned, Laid(_built(planned, board), None), board, [])
        return f"--former {FORMER_BOARD} has room, and fits its sheets"
    return "leave --former out"
