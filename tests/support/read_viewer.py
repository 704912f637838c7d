"""Read what the viewer's page holds, apart from the maker and from a browser."""

import base64
import json
import re
from types import SimpleNamespace

import numpy as np

_DATA = re.compile(r'<script id="data" type="application/json">([^<]*)</script>')


def read_viewer(path):
    """Return the plan, the views, the colour of each rung, and the rungs, (R, 2, 3), in mm."""
    (text,) = _DATA.findall(path.read_text("utf-8"))
    document = json.loads(text)
    assert document["schema"] == "fabweave.viewer/1"
    space = document["space"]
    step = float(space["step_mm"])
    steps = np.frombuffer(base64.b64decode(space["rungs"], validate=True), "<u2")
    rungs = steps.reshape(-1, 2, 3).astype(np.float64) * step + space["origin_mm"]
    flags = np.frombuffer(base64.b64decode(space["from_right"], validate=True), np.uint8)
    counts = np.array(space["counts"], dtype=np.int64)
    assert len(rungs) == len(flags) == counts.sum()
    return SimpleNamespace(
        plan=document["plan"],
        hands=document["hands"],
        views_deg=document["views_deg"],
        colours=[
            np.repeat([colour for colour, _ in runs], [count for _, count in runs])
            for runs in document["colours"]
        ],
        counts=counts,
        panels=[np.array(panel, dtype=np.int64) for panel in space["panels"]],
        rungs=rungs,
        from_right=flags.astype(np.int64),
        step_mm=step,
    )
