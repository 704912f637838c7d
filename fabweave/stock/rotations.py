"""Angles at which pieces may stand on a sheet: any, right angles, along or across the grain."""

import re
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError

_GRAIN = re.compile(r"(?P<way>grain|across)(?::\s*(?P<degrees>[\d.]+)\s*(?:deg|°)?)?")
#: The step of a rule for grain.
HALF_TURN_DEG = 180.0
QUARTER_TURN_DEG = 90.0
#: A wider tolerance is refused.
MOST_TOLERANCE_DEG = 45.0
#: Any angle, unless bends ask for pieces that lie across the grain.
AUTO = "auto"


@dataclass(frozen=True)
class Rotations:
    """The angles at which pieces may stand.

    A piece may be turned by ``base_deg`` and any multiple of ``step_deg``, and by up to
    ``tolerance_deg`` more or less; without a step, by any angle.

    Parameters
    ----------
    step_deg : float or None
        90 or 180; None for free.
    tolerance_deg : float
        Less than half the step.
    base_deg : float
        The direction from which angles count: that of the sheet's grain, 0 along its width, and
        ``from_grain_deg`` more.
    from_grain_deg : float
        90 for pieces that lie across the grain, else 0.
    """

    step_deg: float | None = None
    tolerance_deg: float = 0.0
    base_deg: float = 0.0
    from_grain_deg: float = 0.0

    @property
    def fixed(self) -> bool:
        """Whether a piece must not turn a little."""
        return self.step_deg is not None and self.tolerance_deg == 0.0

    @property
    def across(self) -> bool:
        """Whether pieces lie across the grain."""
        return self.from_grain_deg != 0.0

    def along(self, grain_deg: float | None) -> "Rotations":
        """Return the same rule on a sheet whose grain runs this way."""
        return replace(self, base_deg=(grain_deg or 0.0) + self.from_grain_deg)

    def angles_deg(self, count: int) -> FloatArray:
        """Return angles to try: so many of a turn, as far as they are allowed, degrees.

        With a tolerance they are five around each middle, or more if the count is large.

        Examples
        --------
        >>> Rotations().angles_deg(4).tolist()
        [0.0, 90.0, 180.0, 270.0]
        >>> Rotations(180.0, 4.0, 90.0).angles_deg(24).tolist()
        [86.0, 88.0, 90.0, 92.0, 94.0, 266.0, 268.0, 270.0, 272.0, 274.0]
        """
        if self.step_deg is None:
            return np.arange(count, dtype=np.float64) * (360.0 / count)
        middles = self.base_deg + np.arange(0.0, 360.0, self.step_deg)
        half = 0 if self.fixed else 2 * max(1, int(self.tolerance_deg * count / 720.0))
        spread = np.linspace(-1.0, 1.0, 2 * half + 1) if half else np.zeros(1)
        return np.asarray((middles[:, None] + self.tolerance_deg * spread).ravel())

    def off_deg(self, angles_deg: FloatArray) -> FloatArray:
        """Return by how much angles are beyond the nearest that is allowed, degrees.

        Examples
        --------
        >>> import numpy as np
        >>> Rotations(180.0, 5.0).off_deg(np.array([0.0, 187.0, -4.0])).tolist()
        [0.0, 2.0, 0.0]
        """
        if self.step_deg is None:
            return np.zeros_like(angles_deg)
        return np.maximum(np.abs(self._aside(angles_deg)) - self.tolerance_deg, 0.0)

    def nearest(self, angles: FloatArray) -> FloatArray:
        """Return the allowed angle nearest to each; in radians, as given.

        Examples
        --------
        >>> import numpy as np
        >>> np.rad2deg(Rotations(90.0).nearest(np.deg2rad([1.0, 92.0]))).round(6).tolist()
        [0.0, 90.0]
        """
        if self.step_deg is None:
            return angles
        degrees = np.rad2deg(angles)
        aside = self._aside(degrees)
        kept = np.clip(aside, -self.tolerance_deg, self.tolerance_deg)
        return np.asarray(np.deg2rad(degrees - aside + kept))

    def swing_deg(self, angle_deg: float) -> tuple[float, float]:
        """Return by how much an allowed angle may change, at least and at most, degrees.

        Examples
        --------
        >>> Rotations(180.0, 5.0).swing_deg(184.0)
        (-9.0, 1.0)
        """
        if self.step_deg is None:
            return -np.inf, np.inf
        aside = float(self._aside(np.array(angle_deg)))
        return min(-self.tolerance_deg - aside, 0.0), max(self.tolerance_deg - aside, 0.0)

    def _aside(self, angles_deg: FloatArray) -> FloatArray:
        """Return how far angles are from the nearest middle, with sign."""
        step = self.step_deg or 360.0
        return np.asarray((angles_deg - self.base_deg + step / 2.0) % step - step / 2.0)


#: Any angle is allowed.
FREE = Rotations()


def parse_rotations(text: str) -> Rotations:
    """Return the rule that a text such as ``free``, ``90`` or ``across:20deg`` means.

    ``auto`` means any angle, where nobody chose another rule.

    Raises
    ------
    InputError
        If it does not describe one.

    Examples
    --------
    >>> parse_rotations("grain:5deg")
    Rotations(step_deg=180.0, tolerance_deg=5.0, base_deg=0.0, from_grain_deg=0.0)
    >>> parse_rotations("across:20deg").along(30.0).angles_deg(24).tolist()[:3]
    [100.0, 110.0, 120.0]
    """
    word = text.strip().lower()
    if word in (AUTO, "free"):
        return FREE
    if word.removesuffix("deg").removesuffix("°").strip() in ("90", "180"):
        return Rotations(float(word.removesuffix("deg").removesuffix("°")))
    grain = _GRAIN.fullmatch(word)
    if grain is not None:
        try:
            tolerance = float(grain["degrees"] or 0.0)
        except ValueError:
            tolerance = np.inf
        if tolerance <= MOST_TOLERANCE_DEG:
            turned = QUARTER_TURN_DEG if grain["way"] == "across" else 0.0
            return Rotations(HALF_TURN_DEG, tolerance, turned, turned)
    raise InputError(
        f"rotations {text!r} must be auto, free, 90, 180, or grain or across with a tolerance "
        f"such as grain:5deg (at most {MOST_TOLERANCE_DEG:g}deg)"
    )
