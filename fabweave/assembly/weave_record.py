"""Say what the crossing map tells of a weave."""

import numpy as np

from fabweave.flat.file_records import WeaveRecord
from fabweave.weave.weave_pattern import WeaveResult


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
