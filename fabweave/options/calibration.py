"""Read how long a finished job really took, and say how far the estimate was off."""

import json
import math
import re
from pathlib import Path

from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import shown

_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
_MEASURED = re.compile(r"(?P<folder>.+):\s*(?P<number>\d+(?:\.\d+)?)\s*(?P<unit>s|min|h)")


def parse_calibration(text: str) -> float:
    """Return the factor that a text means: a number, or a finished job's folder and what it took.

    The estimate of that job is the middle of its range (of the ratio of its ends), before any
    factor that it was made with itself.

    Parameters
    ----------
    text : str
        Such as ``1.3``, or ``torus:42min``: the whole time of the machine for all sheets of the job
        in the folder ``torus``, in s, min or h.

    Raises
    ------
    InputError
        If it is neither, or the folder has no estimate; the message says what is expected.

    Examples
    --------
    >>> parse_calibration("1.3")
    1.3
    """
    try:
        return float(text)
    except ValueError:
        pass
    match = _MEASURED.fullmatch(text.strip())
    if match is None:
        raise InputError(
            f"{shown(text)} is neither a number such as 1.3 nor a finished job's folder and what "
            "its machine took, such as torus:42min"
        )
    measured = float(match["number"]) * _SECONDS[match["unit"]]
    return round(measured / _estimated_s(Path(match["folder"])), 4)


def _estimated_s(folder: Path) -> float:
    """Return what was estimated for a finished job, in seconds."""
    path = folder / "waste.json"
    text = read_text(path, "the estimate of a finished job")
    try:
        estimate = json.loads(text)["estimate"]
        low, high = (float(end) for end in estimate["machine_s"])
        middle = math.sqrt(low * high) / float(estimate["calibration"])
    except (ValueError, KeyError, TypeError, ZeroDivisionError, RecursionError) as error:
        raise InputError(
            f"{path} has no estimate of the machine's time; make that job again, with a material "
            "whose cutting speed is known"
        ) from error
    if not (math.isfinite(middle) and middle > 0.0):
        raise InputError(f"{path} estimates {middle:g} s, from which nothing can be calibrated")
    return middle
