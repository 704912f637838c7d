"""Read the viewer: the data that its page holds, and what the page would load."""

import base64
import binascii
import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Floats, Ints, ReadError
from fabweave.verify.read.content import read_text

SCHEMA = "fabweave.viewer/1"

#: No piece has more rungs.
_LONGEST = 10_000_000

#: The page in parts: what is always the same, and what is not. Nothing in it ends a script early.
_PARTS = re.compile(
    r"(?P<a>.*?<title>)(?P<title>[^<]*)(?P<b></title>.*?<h1>)(?P<heading>[^<]*)(?P<c></h1>.*?"
    r'<script id="data" type="application/json">)(?P<data>[^<]*)(?P<d></script>\s*'
    r'<script id="three">)(?P<three>.*?)(?P<e></script>.*)',
    re.DOTALL,
)


@dataclass(frozen=True, eq=False)
class Viewer:
    """What the viewer's page holds.

    Parameters
    ----------
    plan : dict
        The crossing map as the page has it.
    hands : object
        Seconds of each step and hours of all, by which the page tells the time that is left.
    views_deg : list
        Azimuth and elevation from which each step is shown.
    colours : list of (R,) str arrays
        The colour of each rung of each piece.
    frame : str
        The SHA-256 of the page but for its title, its data and three.js.
    three : str
        The SHA-256 of three.js in it.
    counts : (P,) int array
        Rungs of each piece.
    panels : list of int arrays
        For each piece the rung, from its own first, where each station's panel begins.
    rungs : (R, 2, 3) float array
        Right and left end of each rung of all pieces one after another, millimetres.
    from_right : (R,) int array
        For the quad after each rung whether its diagonal starts at the right rail.
    step_mm : float
        Coordinates are rounded to multiples of this.
    """

    plan: dict[str, Any]
    hands: Any
    views_deg: list[list[float]]
    colours: list[npt.NDArray[np.str_]]
    frame: str
    three: str
    counts: Ints
    panels: list[Ints]
    rungs: Floats
    from_right: Ints
    step_mm: float


def read_viewer(path: Path) -> Viewer:
    """Read the viewer's page.

    Raises
    ------
    ReadError
        If the page has no data, or they break their schema.
    """
    parts = _PARTS.fullmatch(read_text(path))
    if parts is None:
        raise ReadError("it has not one title, one heading, one script with data and three.js")
    if parts["title"] != f"{parts['heading']}: assembly":
        raise ReadError("its title and its heading differ")
    try:
        document = json.loads(parts["data"])
    except (ValueError, RecursionError) as error:
        raise ReadError(f"its data are not JSON: {error}") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise ReadError(f"the schema of its data is not {SCHEMA!r}")
    try:
        return _viewer(parts, document)
    except (LookupError, TypeError, ValueError, OverflowError, binascii.Error) as error:
        raise ReadError(f"its data lack something: {type(error).__name__}: {error}") from error


def _viewer(parts: re.Match[str], document: dict[str, Any]) -> Viewer:
    """Decode the data."""
    space = document["space"]
    step = float(space["step_mm"])
    steps = np.frombuffer(base64.b64decode(space["rungs"], validate=True), "<u2")
    counts = np.array(space["counts"], dtype=np.int64).reshape(-1)
    flags = np.frombuffer(base64.b64decode(space["from_right"], validate=True), np.uint8)
    rungs = steps.reshape(-1, 2, 3).astype(np.float64) * step
    if not (len(rungs) == len(flags) == counts.sum() and np.all(counts >= 0)):
        raise ReadError(f"its pieces have {counts.sum()} rungs, and {len(rungs)} are there")
    if not isinstance(document["plan"], dict) or not isinstance(document["colours"], list):
        raise ReadError("it has no plan or no colours")
    return Viewer(
        plan=document["plan"],
        hands=document["hands"],
        views_deg=[[float(azimuth), float(rise)] for azimuth, rise in document["views_deg"]],
        colours=[_colours(runs) for runs in document["colours"]],
        frame=_sha256("\n".join(parts.group("a", "b", "c", "d", "e"))),
        three=_sha256(parts["three"]),
        counts=counts,
        panels=[np.array(panel, dtype=np.int64) for panel in space["panels"]],
        rungs=rungs + np.array(space["origin_mm"], dtype=np.float64).reshape(3),
        from_right=flags.astype(np.int64),
        step_mm=step,
    )


def _colours(runs: list[tuple[str, int]]) -> npt.NDArray[np.str_]:
    """Return a colour for each rung of a piece: they are told in runs, each with its length."""
    counts = [count for _, count in runs]
    if not all(type(count) is int and 0 < count <= _LONGEST for count in counts):
        raise ReadError("a colour has no number of rungs")
    if not all(isinstance(colour, str) for colour, _ in runs):
        raise ReadError("a colour is no text")
    return np.repeat(np.array([colour for colour, _ in runs], dtype=np.str_), counts)


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
