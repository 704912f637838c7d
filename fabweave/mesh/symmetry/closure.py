"""Multiply generators until there is nothing new."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value


def key_of(image: int, reverses: int, mirrors: int) -> int:
    """Return the number under which a motion is remembered."""
    return 4 * image + 2 * reverses + mirrors


@frozen_value
class Elements:
    """Products of generators: where each takes the first half-edge, and how it is made."""

    image: IntArray
    reverses: IntArray
    mirrors: IntArray
    after: IntArray
    by: IntArray

    @property
    def keys(self) -> IntArray:
        """The key of each."""
        return np.asarray(4 * self.image + 2 * self.reverses + self.mirrors)


def reached_from(
    generators: Sequence[IntArray],
    signs: Sequence[tuple[bool, bool]],
    start: tuple[int, int, int],
    count: int,
) -> Elements:
    """Return all that products of generators make of one motion."""
    seen = np.zeros(4 * count, dtype=bool)
    seen[key_of(*start)] = True
    image, reverses, mirrors = (np.array([value], dtype=np.int64) for value in start)
    number = np.zeros(1, dtype=np.int64)
    rows = [np.stack((image, reverses, mirrors, number - 1, number - 1))]
    total = 1
    while len(image):
        fresh = []
        for by, (generator, (turns, flips)) in enumerate(zip(generators, signs, strict=True)):
            there = np.stack((generator[image], reverses ^ turns, mirrors ^ flips))
            key = 4 * there[0] + 2 * there[1] + there[2]
            new = ~seen[key]
            seen[key[new]] = True
            made = np.full(np.count_nonzero(new), by)
            fresh.append(np.concatenate((there[:, new], [number[new], made])))
        step = np.concatenate(fresh, axis=1) if fresh else np.zeros((5, 0), dtype=np.int64)
        rows.append(step)
        image, reverses, mirrors = step[:3]
        number = total + np.arange(step.shape[1])
        total += step.shape[1]
    return Elements(*np.concatenate(rows, axis=1))
