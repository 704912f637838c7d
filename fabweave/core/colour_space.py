"""Convert colours: sRGB, light, and the perceptual space OKLab."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray

#: Bytes of red, green and blue.
Colours: TypeAlias = npt.NDArray[np.uint8]

# Ottosson, "A perceptual color space for image processing" (2020): linear sRGB to cone responses,
# and their cube roots to lightness and two opponent colours.
_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_OPPONENT = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
for _matrix in (_CONES, _OPPONENT):
    _matrix.setflags(write=False)


def light_of(colours: npt.ArrayLike) -> FloatArray:
    """Return linear light, 0 to 1, of bytes of sRGB, (..., 3).

    Examples
    --------
    >>> light_of([0, 255, 10]).round(6).tolist()
    [0.0, 1.0, 0.003035]
    """
    share = np.asarray(colours, dtype=np.float64) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def bytes_of(light: FloatArray) -> Colours:
    """Return bytes of sRGB of linear light; what is out of range is clipped.

    Examples
    --------
    >>> bytes_of(light_of([1, 128, 254])).tolist()
    [1, 128, 254]
    """
    share = np.clip(light, 0.0, 1.0)
    coded = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    return np.round(255.0 * coded).astype(np.uint8)


def oklab_of(light: FloatArray) -> FloatArray:
    """Return OKLab (lightness 0 to 1, greenish to reddish, bluish to yellowish) of light.

    Examples
    --------
    >>> oklab_of(np.array([1.0, 1.0, 1.0])).round(3).tolist()
    [1.0, 0.0, 0.0]
    """
    return np.cbrt(light @ _CONES.T) @ _OPPONENT.T


def light_of_hue(lightness: FloatArray, chroma: FloatArray, hue_deg: FloatArray) -> FloatArray:
    """Return the light of OKLab colours given as lightness, chroma and hue.

    Colours that a screen cannot show lose chroma until it can.

    Parameters
    ----------
    lightness, chroma, hue_deg : (N,) float arrays
        Lightness 0 to 1, chroma about 0 to 0.3, hue in degrees.

    Returns
    -------
    (N, 3) float array
        Linear light, 0 to 1.

    Examples
    --------
    >>> grey = light_of_hue(np.array([0.5]), np.array([0.0]), np.array([0.0]))
    >>> bytes_of(grey).tolist()
    [[99, 99, 99]]
    """
    low, high = np.zeros_like(chroma), np.array(chroma, dtype=np.float64)
    shown = _light_of_lch(lightness, high, hue_deg)
    fits = _showable(shown)
    for _ in range(14):
        middle = np.where(fits, high, (low + high) / 2.0)
        good = _showable(_light_of_lch(lightness, middle, hue_deg))
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    chosen = np.where(fits, chroma, low)
    return np.clip(_light_of_lch(lightness, chosen, hue_deg), 0.0, 1.0)


def _light_of_lch(lightness: FloatArray, chroma: FloatArray, hue_deg: FloatArray) -> FloatArray:
    """Return linear light of OKLab colours in cylinder coordinates, out of range or not."""
    turn = np.radians(hue_deg)
    lab = np.stack((lightness, chroma * np.cos(turn), chroma * np.sin(turn)), axis=-1)
    return (lab @ np.linalg.inv(_OPPONENT).T) ** 3 @ np.linalg.inv(_CONES).T


def _showable(light: FloatArray) -> npt.NDArray[np.bool_]:
    return np.asarray(np.all((light >= -1e-6) & (light <= 1.0 + 1e-6), axis=-1))
