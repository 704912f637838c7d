"""Hold what the crossing map says of the weave, the layout and the files for the cutter."""

import numpy as np

from fabweave.core.records import optional, record
from fabweave.weave.twill.conditions import Broken
from fabweave.weave.weave_pattern import WeaveResult

#: Lengths in the map are rounded to a millionth of a millimetre, angles to as many degrees.
DECIMALS = 6


@record
class WeaveRecord:
    """The weave: its pattern, whether it is exact, and how many conditions of a twill it breaks.

    ``voted`` is what the paper's vote breaks, and ``at_least_broken`` what every weave breaks,
    where this is known. Of a fabric, ``warp`` lists the warp threads and ``labels`` the label of
    each crossing. ``rotations`` is how many carry the weave onto itself, the one that leaves all in
    place among them, where a twill was to keep some.
    """

    pattern: str
    exact: bool
    broken: Broken
    voted: Broken | None = optional(default=None)
    at_least_broken: int | None = optional(default=None)
    warp: tuple[int, ...] | None = optional(default=None)
    labels: tuple[int, ...] | None = optional(default=None)
    rotations: int | None = optional(default=None)


def weave_record(result: WeaveResult) -> WeaveRecord:
    """Return what the map says about the weave."""
    weave, twill = result.weave, result.twill
    return WeaveRecord(
        pattern=weave.pattern,
        exact=weave.exact,
        broken=weave.broken,
        voted=None if twill is None else twill.voted,
        at_least_broken=None if twill is None or twill.bound is None else twill.bound.least,
        warp=None if result.warp is None else tuple(np.flatnonzero(result.warp).tolist()),
        labels=None if result.label is None else tuple(result.label.tolist()),
        rotations=result.rotations,
    )


@record
class RotationRecord:
    """The angles at which pieces may lie: multiples of a step, None for any, give or take.

    They count from the grain, or from so many degrees off it.
    """

    step_deg: float | None
    tolerance_deg: float
    from_grain_deg: float | None = optional()


@record
class LayoutRecord:
    """What the layout keeps: margin of sheets, gap between pieces, angles; and notes about it.

    ``recorded`` says that another run may not find it again, so that it is to be taken from here.
    """

    margin_mm: float
    gap_mm: float
    rotations: RotationRecord
    notes: tuple[str, ...]
    recorded: bool | None = optional()


@record
class LayerRecord:
    """The colour of a layer, ``#RRGGBB``, and as an AutoCAD colour index."""

    layer: str
    colour: str
    aci: int


@record
class CutRecord:
    """What the files for the cutter are like; ``code`` is the text of the sheets' QR code."""

    profile: str
    preset: str
    dxf: str
    svg_units: str
    hairline_mm: float
    labels: str | None = optional()
    layers: tuple[LayerRecord, ...]
    code: str
