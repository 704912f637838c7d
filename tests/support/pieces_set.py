"""Generate the synthetic pieces on which nesting is measured."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray


def strip(
    length: float, width: float, points: int, kind: str, rng: np.random.Generator
) -> FloatArray:
    """Return the outline of one strip: a curve of the given kind with parallel rails."""
    while True:
        t = np.linspace(0.0, 1.0, points // 2)
        if kind == "wavy":
            turn = np.deg2rad(rng.uniform(5.0, 25.0)) * np.sin(
                2.0 * np.pi * (rng.uniform(0.5, 3.0) * t + rng.uniform())
            )
        elif kind == "s":
            turn = np.deg2rad(rng.uniform(30.0, 80.0)) * np.sin(2.0 * np.pi * t)
        elif kind == "curved":
            turn = np.deg2rad(rng.uniform(90.0, 280.0)) * (t - 0.5)
        else:
            raise ValueError(kind)
        heading = turn + 0.0
        step = length / (len(t) - 1) * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        axis = np.concatenate([np.zeros((1, 2)), np.cumsum(step[:-1], axis=0)])
        normal = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        outline = np.concatenate([axis + normal * width / 2.0, (axis - normal * width / 2.0)[::-1]])
        outline = outline[::-1] - outline.mean(axis=0)
        if shapely.polygons(outline).is_valid:
            return np.ascontiguousarray(outline)


def measured_set(count: int = 300, seed: int = 0) -> list[FloatArray]:
    """Return strips of 100–500 mm × 5–30 mm, 20–200 vertices: 70 % wavy, 20 % S, 10 % curved."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["wavy", "s", "curved"], size=count, p=[0.7, 0.2, 0.1])
    return [
        strip(rng.uniform(100, 500), rng.uniform(5, 30), int(rng.integers(20, 201)), str(kind), rng)
        for kind in kinds
    ]
