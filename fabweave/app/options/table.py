"""TEMPORARY."""

from typing import NamedTuple


class _O(NamedTuple):
    key: str


OPTIONS = [_O(k) for k in ("size", "scale", "up", "remesh", "refine", "fair")]
