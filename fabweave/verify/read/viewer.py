"""Read the viewer: the data that its page holds, and what the page would load."""

import base64
import binascii
import json
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.verify.drawing import Floats, Ints, ReadError

SCHEMA = "fabweave.viewer/1"

#: The policy that keeps a browser from loading anything, whatever a script asks for.
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"

_LOADS = ("src", "href", "srcset", "data", "action", "formaction", "poster", "background")


@dataclass(frozen=True, eq=False)
class Viewer:
    """What the viewer's page holds.

    Parameters
    ----------
    plan : dict
        The crossing map as the page has it.
    colours : list
        What it has as the threads' colours.
    policies : tuple of str
        The content security policies that stand in it.
    loads : tuple of str
        Every address in an attribute of an element that would be loaded or gone to.
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
    colours: list[Any]
    policies: tuple[str, ...]
    loads: tuple[str, ...]
    counts: Ints
    panels: list[Ints]
    rungs: Floats
    from_right: Ints
    step_mm: float


class _Page(HTMLParser):
    """Collect what matters of a page."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.data: list[str] = []
        self.policies: list[str] = []
        self.loads: list[str] = []
        self.documents = 0
        self._in_data = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Look at an element's attributes."""
        values = {name: value or "" for name, value in attrs}
        if tag == "meta" and values.get("http-equiv", "").lower() == "content-security-policy":
            self.policies.append(values.get("content", ""))
        self.loads += [values[name] for name in _LOADS if name in values]
        if tag == "script" and values.get("id") == "data":
            self.documents += 1
            self._in_data = True

    def handle_endtag(self, tag: str) -> None:
        """Leave the data."""
        if tag == "script":
            self._in_data = False

    def handle_data(self, data: str) -> None:
        """Keep the data."""
        if self._in_data:
            self.data.append(data)


def read_viewer(path: Path) -> Viewer:
    """Read the viewer's page.

    Raises
    ------
    ReadError
        If the page has no data, or they break their schema.
    """
    page = _Page()
    page.feed(path.read_text("utf-8"))
    if page.documents != 1:
        raise ReadError(f"it has {page.documents} scripts with the id 'data' instead of one")
    try:
        document = json.loads("".join(page.data))
    except (ValueError, RecursionError) as error:
        raise ReadError(f"its data are not JSON: {error}") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise ReadError(f"the schema of its data is not {SCHEMA!r}")
    try:
        return _viewer(page, document)
    except (LookupError, TypeError, ValueError, OverflowError, binascii.Error) as error:
        raise ReadError(f"its data lack something: {type(error).__name__}: {error}") from error


def _viewer(page: _Page, document: dict[str, Any]) -> Viewer:
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
        colours=document["colours"],
        policies=tuple(page.policies),
        loads=tuple(page.loads),
        counts=counts,
        panels=[np.array(panel, dtype=np.int64) for panel in space["panels"]],
        rungs=rungs + np.array(space["origin_mm"], dtype=np.float64).reshape(3),
        from_right=flags.astype(np.int64),
        step_mm=step,
    )
