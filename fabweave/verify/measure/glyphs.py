"""Tell letters apart by their strokes, without a font: the same letter always looks the same.

Every label is taken apart into its letters at the gaps between them. The first time that a letter
is met it is learnt; ever after it must look so, and no two letters may look alike. A text in the
place of another, or one that is mirrored, contradicts what the other labels have taught.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from fabweave.verify.drawing import Floats

# In parts of the height of a letter: the least gap between letters, how far points may be from
# where they were learnt, and how far from another letter's at least.
_GAP, _SAME, _UNLIKE = 0.21, 0.02, 0.05
# Letters of any font whose corners lie rather above, or below, the middle.
_TOP_HEAVY, _FOOT_HEAVY = frozenset("FPTVY7"), frozenset("AL")


class Glyphs:
    """Learn letters from labels, and object to what does not look like them.

    Examples
    --------
    >>> upright = [np.array([[0.0, 1.0], [0.0, -1.0]]), np.array([[1.0, -1.0], [2.0, -1.0]])]
    >>> glyphs = Glyphs()
    >>> glyphs.read("1-", 2.0, 1.0, upright, "the first label")
    >>> glyphs.read("-1", 2.0, 1.0, upright, "the second label")
    >>> len(list(glyphs.problems()))
    2
    """

    def __init__(self) -> None:
        self._learnt: dict[str, list[Floats]] = {}
        self._problems: list[str] = []

    def read(
        self, text: str, height: float, top: float, strokes: Sequence[Floats], where: str
    ) -> None:
        """Compare the letters of a label with what was learnt.

        Parameters
        ----------
        text : str
            What it says.
        height, top : float
            How high a capital is, and where the capitals end.
        strokes : sequence of (N, 2) arrays
            Along the text, and up.
        where : str
            How to name the label in a finding.
        """
        letters = _letters(strokes, _GAP * height)
        if len(letters) != len(text):
            self._problems.append(f"{where}: it has {len(letters)} letters that stand apart")
            return
        for sign, runs in zip(text, letters, strict=True):
            corner = min(float(run[:, 0].min()) for run in runs), top - height
            drawn = [(run - corner) / height for run in runs]
            if _unlike(self._learnt.setdefault(sign, drawn), drawn) > _SAME:
                self._problems.append(f"{where}: its {sign!r} looks unlike another {sign!r}")

    def problems(self) -> Iterator[str]:
        """Yield what is wrong with the letters."""
        for (one, looks), (two, other) in combinations(self._learnt.items(), 2):
            if _unlike(looks, other) < _UNLIKE:
                yield f"{one!r} and {two!r} look alike"
        for sign, runs in self._learnt.items():
            high = float(np.concatenate(runs)[:, 1].mean())
            if (high < 0.5 and sign in _TOP_HEAVY) or (high > 0.5 and sign in _FOOT_HEAVY):
                yield f"{sign!r} stands on its head"
        yield from self._problems


def _unlike(one: Sequence[Floats], two: Sequence[Floats]) -> float:
    """Return how far two letters are from the same strokes, in whichever order and direction."""
    if sorted(map(len, one)) != sorted(map(len, two)):
        return np.inf
    left, worst = list(two), 0.0
    for run in one:
        misses = [
            min(float(np.abs(run - way).max()) for way in (other, other[::-1]))
            if len(other) == len(run)
            else np.inf
            for other in left
        ]
        nearest = int(np.argmin(misses))
        worst = max(worst, misses[nearest])
        left.pop(nearest)
    return worst


def _letters(strokes: Sequence[Floats], gap: float) -> list[list[Floats]]:
    """Return the strokes of each letter, from left to right, in the order they came."""
    begin = np.array([run[:, 0].min() for run in strokes])
    end = np.array([run[:, 0].max() for run in strokes])
    order = np.argsort(begin, kind="stable")
    reach = np.maximum.accumulate(end[order])
    fresh = np.zeros(len(strokes), dtype=np.int64)
    fresh[1:] = begin[order][1:] > reach[:-1] + gap
    letter = np.empty(len(strokes), dtype=np.int64)
    letter[order] = np.cumsum(fresh)
    letters: list[list[Floats]] = [[] for _ in range(int(letter.max()) + 1)]
    for run, number in zip(strokes, letter.tolist(), strict=True):
        letters[number].append(run)
    return letters
