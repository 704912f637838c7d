"""Measure colours: light from sRGB, and how much two of them differ to the eye."""

from collections.abc import Iterable

import numpy as np

from fabweave.verify.drawing import Floats

# CIE XYZ of linear sRGB (IEC 61966-2-1), and its white.
_XYZ = np.array(
    [
        [0.4123908, 0.3575843, 0.1804808],
        [0.2126390, 0.7151687, 0.0721923],
        [0.0193308, 0.1191948, 0.9505322],
    ]
)
_EDGE = (6.0 / 29.0) ** 3


def light_of_words(words: Iterable[str]) -> Floats:
    """Return the linear light, (N, 3), of colours such as ``#0072b2``."""
    coded = np.array([list(bytes.fromhex(word[1:])) for word in words], dtype=np.float64) / 255.0
    coded = coded.reshape(-1, 3)
    return np.where(coded > 0.04045, ((coded + 0.055) / 1.055) ** 2.4, coded / 12.92)


def lab_of(light: Floats) -> Floats:
    """Return CIE L*a*b* of linear light, (..., 3)."""
    share = light @ _XYZ.T / _XYZ.sum(axis=1)
    root = np.where(share > _EDGE, np.cbrt(share), (share / _EDGE * 8.0 / 29.0 * 3.0 + 4.0) / 29.0)
    x, y, z = root[..., 0], root[..., 1], root[..., 2]
    return np.stack((116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)), axis=-1)
