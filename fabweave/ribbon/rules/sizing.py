"""Find the smallest size at which a rule holds."""

import math
from collections.abc import Callable

#: A search goes no further than this many times the size that was asked for.
FARTHEST = 100
#: After this many guesses, every other one is in the middle.
_GUESSES = 5


def smallest_size(margin: Callable[[int], float], start: int, *, most: int) -> int | None:
    """Return the smallest whole size at which a margin is at least 1, to a part in a thousand.

    The margin of a rule (what there is over what is wanted) is tried at one size after the other,
    guessed by the power law through the last two: most margins go nearly as the size, so few
    trials do.

    Parameters
    ----------
    margin : callable
        Tells the margin at a size. It is taken to rise with the size.
    start : int
        Where to begin, in millimetres.
    most : int
        No larger size is tried.

    Returns
    -------
    int or None
        Up to 2 m the margin is below 1 at one millimetre less, else at most a thousandth less;
        None if it is below 1 up to ``most``.

    Examples
    --------
    >>> smallest_size(lambda size: size / 321.5, 100, most=1000)
    322
    >>> smallest_size(lambda size: 0.5, 100, most=1000) is None
    True
    """
    low: tuple[int, float] | None = None
    high: tuple[int, float] | None = None
    size, guesses = max(start, 1), 0
    stride = 1.02  # a little beyond the guess, and farther each time that falls short
    while True:
        value = margin(size)
        if value >= 1:
            high = (size, value)
        else:
            low = (size, value)
        if low is None and high is not None:
            if size <= 1:
                return size
            size = max(1, min(size - 1, math.floor(size / stride / min(value, 10.0))))
            stride = stride**2
        elif high is None:
            if size >= most:
                return None
            size = min(most, max(size + 1, math.ceil(stride * size / max(value, 0.1))))
            stride = stride**2
        elif low is not None:
            if high[0] - low[0] <= max(1, high[0] // 1000):
                return high[0]
            guesses += 1
            # Where guesses do not close in soon, halving does.
            halve = guesses > _GUESSES and guesses % 2 == 0
            size = (low[0] + high[0]) // 2 if halve else _between(low, high)


def _between(low: tuple[int, float], high: tuple[int, float]) -> int:
    """Guess where the margin is 1, between a size where it is less and one where it is not."""
    (below, small), (above, large) = low, high
    guess = (below + above) / 2
    if 0 < small < large < math.inf:
        power = math.log(large / small) / math.log(above / below)
        guess = below * (1 / small) ** (1 / power)
        # Trials just beside the guess close in from both sides.
        guess += math.copysign(0.01 * (above - below), (above - guess) - (guess - below))
    return min(max(math.ceil(guess), below + 1), above - 1)
