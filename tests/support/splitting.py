"""Cut threads into pieces, as a step of a job does."""

from collections.abc import Callable, Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.piece.development import Runs
from fabweave.piece.split.candidates import Bed, list_candidates
from fabweave.piece.split.splitting import choose_runs
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave


def split_threads(
    ribbons: Ribbons,
    weave: Weave,
    *,
    length_mm: float = np.inf,
    max_length_mm: float = np.inf,
    fits: Callable[[FloatArray], bool],
    labels: tuple[str, ...],
    usable: Sequence[tuple[float, float]] = (),
) -> Runs:
    """Cut every thread, from all candidates."""
    bed = Bed(fits, tuple(usable))
    every = np.arange(weave.threads.n_threads)
    candidates = list_candidates(ribbons, weave, bed, min(length_mm, max_length_mm), every)
    return choose_runs(candidates, weave, bed, labels, length_mm, max_length_mm, None)
