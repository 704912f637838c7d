"""Words agree with their number, in the sentences that a user meets."""

import pytest

from fabweave.core.messages import agree


@pytest.mark.parametrize(
    ("count", "said"),
    [(0, "0 men are"), (1, "1 man is"), (2, "2 men are"), (-1, "-1 men are"), (11, "11 men are")],
)
def test_only_one_is_singular(count, said) -> None:
    assert agree(count, "{n} [man is|men are]") == said


def test_an_ending_may_be_empty_and_text_without_choices_stays() -> None:
    assert agree(1, "{n} piece[|s] touch[es|] (a | b)") == "1 piece touches (a | b)"
    assert agree(3, "{n} piece[|s] touch[es|] (a | b)") == "3 pieces touch (a | b)"
