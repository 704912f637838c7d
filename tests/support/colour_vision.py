"""Simulate colour blindness, and measure how much colours differ to everybody."""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.colour_space import Colours, light_of, oklab_of

#: How light reaches those who lack one kind of cone: Machado, Oliveira, Fernandes, "A
#: physiologically-based model for simulation of color vision deficiency" (2009), severity 1.
COLOUR_BLINDNESS = {
    "protanopia": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deuteranopia": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritanopia": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
}


def as_seen_with(light: FloatArray, blindness: str) -> FloatArray:
    """Return the light that looks to anyone as the given light does to the colour-blind.

    Parameters
    ----------
    light : (..., 3) float array
        Linear light.
    blindness : str
        A name in ``COLOUR_BLINDNESS``.
    """
    return np.clip(light @ np.array(COLOUR_BLINDNESS[blindness]).T, 0.0, 1.0)


def least_differences(colours: Colours) -> FloatArray:
    """Return how much colours (N, 3) differ at least, (N, N), for people with any colour vision.

    Distances are those of OKLab in hundredths: 2 is just seen beside one another, 10 is clear.
    """
    light = light_of(colours)
    views = [light, *(as_seen_with(light, name) for name in COLOUR_BLINDNESS)]
    labs = [oklab_of(view) for view in views]
    away = [np.linalg.norm(lab[:, None] - lab[None], axis=2) for lab in labs]
    return 100.0 * np.min(away, axis=0)
