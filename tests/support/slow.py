"""Marks for tables of cases of which most are slow together."""

from collections.abc import Iterable

import pytest


def slow_but(cases: Iterable[object], *quick: int, every: int = 0) -> list[object]:
    """Return the cases of a test, all slow but those at these places (the first, if none is named).

    With ``every``, each so manieth case is quick.

    >>> [len(case.marks) for case in slow_but("abcd", 0, 2)]
    [0, 1, 0, 1]
    >>> [len(case.marks) for case in slow_but("abcd", every=3)]
    [0, 1, 1, 0]
    """
    told = [
        case
        if isinstance(case, type(pytest.param()))
        else pytest.param(*(case if isinstance(case, tuple) else (case,)))
        for case in cases
    ]
    kept = range(0, len(told), every) if every else quick or (0,)
    return [
        case if at in kept else pytest.param(*case.values, marks=pytest.mark.slow, id=case.id)
        for at, case in enumerate(told)
    ]
