"""Pack pieces into a strip with spyrrow, in a process of its own.

Started as a script; the task comes on standard input and the result goes to a file. It imports
nothing of fabweave: whatever the engine does (panic, hang, crash), it does to this process only.
"""

import json
import sys
from pathlib import Path


def main(target: str) -> None:
    """Read a task, pack, and write the strip's width and where each piece stands in it."""
    import spyrrow  # noqa: PLC0415 -- optional, and only wanted here

    task = json.load(sys.stdin)
    items = [
        spyrrow.Item(str(number), [tuple(point) for point in outline], 1, angles)
        for number, (outline, angles) in enumerate(
            zip(task["outlines"], task["angles_deg"], strict=True)
        )
    ]
    config = spyrrow.StripPackingConfig(
        early_termination=True,
        min_items_separation=task["gap_mm"] or None,
        total_computation_time=task["seconds"],
        seed=task["seed"],
    )
    found = spyrrow.StripPackingInstance("sheet", task["height_mm"], items).solve(config)
    poses = [[0.0, 0.0, 0.0] for _ in items]
    for placed in found.placed_items:
        poses[int(placed.id)] = [*placed.translation, placed.rotation]
    Path(target).write_text(json.dumps({"width_mm": found.width, "poses": poses}))


if __name__ == "__main__":
    main(sys.argv[1])
