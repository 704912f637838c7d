"""Marks for tables of cases of which most are slow together."""

from collections.abc import Iterable

import pytest


def slow_but(cases: Iterable[object], *quick: int) -> list[object]:
    """Return the cases of a test, all slow but those at these places (the first, if none is named).

    >>> [len(case.marks) for case in slow_but("abcd", 0, 2)]
    [0, 1, 0, 1]
    """
    kept = quick or (0,)
    return [
        pytest.param(
            *(case if isinstance(case, tuple) else (case,)),
            marks=[] if number in kept else [pytest.mark.slow],
        )
        for number, case in enumerate(cases)
    ]
