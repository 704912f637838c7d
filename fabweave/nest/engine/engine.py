"""Pack the pieces of one sheet with an engine that is kept in a child process.

spyrrow (https://github.com/PaulDL-RS/spyrrow, MIT) packs strips; its budgets are seconds, so what
it finds depends on the machine. Whatever it returns is only a proposal.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.nest.engine import child as engine_child
from fabweave.nest.item_shape import rotated
from fabweave.nest.separate.item_field import Body
from fabweave.stock.rotations import FREE, Turns

_COLLISION_MM = 0.1  # by how much outlines are inflated, and simplified, for the engine
_GRACE_S = 20.0  # beyond its budget, before it is stopped
_LOWER_MM = 1.0  # than the strip a body must be: the engine panics at what just fits
_ANGLES = 24  # of a full turn, where not all are allowed
_OVER_MM = 2.0  # a strip longer than the sheet by this may still be pushed together

#: How the engine is started; tests put something else in its place.
COMMAND = (sys.executable, engine_child.__file__)


def engine_is_there() -> bool:
    """Return whether spyrrow is installed."""
    return find_spec("spyrrow") is not None


def packed(
    bodies: Sequence[Body],
    usable_mm: tuple[float, float],
    gap_mm: float,
    *,
    seconds: int,
    seed: int,
    turns: Turns = FREE,
    grace_s: float = _GRACE_S,
    command: Sequence[str] = COMMAND,
) -> FloatArray | None:
    """Return poses that the engine proposes for the bodies of one sheet; None if it has none.

    Parameters
    ----------
    bodies : sequence of Body
        N bodies.
    usable_mm : (float, float)
        Usable width and height of the sheet.
    gap_mm : float
        Least distance.
    seconds : int
        The engine's budget.
    seed : int
        The engine's; it does not make the result reproducible.
    turns : Turns
        The angles at which bodies may stand.
    grace_s : float
        How long beyond its budget it may run before it is stopped.
    command : sequence of str
        What to run.

    Returns
    -------
    (N, 3) float array or None
        Not proved: a panic, a hang, a crash and nonsense all come to None, or fail the proof.
    """
    outlines = [_collision(body) for body in bodies]
    if not all(_is_safe(outline, usable_mm) for outline in outlines):
        return None
    angles = [_angles(outline, usable_mm, turns) for outline in outlines]
    if turns.step_deg is not None and not all(angles):
        return None
    task = {
        "outlines": [outline.tolist() for outline in outlines],
        "angles_deg": angles,
        "gap_mm": gap_mm,
        # The engine keeps the gap from the borders of the strip, too.
        "height_mm": usable_mm[1] + 2.0 * gap_mm,
        "seconds": seconds,
        "seed": seed,
    }
    with tempfile.TemporaryDirectory(prefix="fabweave-") as folder:
        target = Path(folder) / "result.json"
        try:
            subprocess.run(  # noqa: S603 -- our own script; the child is killed at the timeout
                [*command, str(target)],
                input=json.dumps(task),
                text=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=seconds + grace_s,
                check=True,
            )
            found = json.loads(target.read_text(encoding="utf-8"))
            width, poses = float(found["width_mm"]), np.array(found["poses"], dtype=np.float64)
        except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError):
            return None
    if poses.shape != (len(bodies), 3) or not np.isfinite(poses).all():
        return None
    if not width <= usable_mm[0] + 2.0 * gap_mm + _OVER_MM:
        return None
    poses[:, :2] -= gap_mm
    poses[:, 2] = np.deg2rad(poses[:, 2])
    return poses


def _collision(body: Body) -> FloatArray:
    """Return a simpler outline around a body's."""
    grown = shapely.buffer(shapely.polygons(body.outline), _COLLISION_MM, quad_segs=2)
    simple = shapely.simplify(shapely.polygons(grown.exterior.coords), _COLLISION_MM)
    result: FloatArray = shapely.get_coordinates(shapely.normalize(simple))[:-1]
    return result


def _angles(
    outline: FloatArray, usable_mm: tuple[float, float], turns: Turns
) -> list[float] | None:
    """Return the allowed angles at which an outline is lower than the strip; None for any."""
    if turns.step_deg is None:
        return None
    angles = turns.angles_deg(_ANGLES)
    high = np.ptp(rotated(outline, angles)[..., 1], axis=1)
    allowed: list[float] = angles[high < usable_mm[1] - _LOWER_MM].tolist()
    return allowed


def _is_safe(outline: FloatArray, usable_mm: tuple[float, float]) -> bool:
    """Return whether an outline is one that the engine takes: simple, and lower than the strip."""
    polygon = shapely.polygons(outline)
    if len(outline) < 3 or not shapely.is_valid(polygon) or not polygon.area > 0.0:
        return False
    if len(np.unique(outline, axis=0)) < len(outline):
        return False
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))
    sides = np.hypot(*np.diff(box, axis=0).T)
    return bool(sides.min() < usable_mm[1] - _LOWER_MM)
