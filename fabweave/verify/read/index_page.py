"""Read the page that opens a job, and which files lie beside it."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_text
from fabweave.verify.read.waste_page import Seen, read_page

INDEX, CONTENTS = "index.html", "contents.json"
#: The SHA-256 of the page's style, which decides what of it is seen. A change there changes it.
STYLE = "82f84c500bb5b077f221b73a68c93a00daf17739e9f679a447d32b95a76d792d"
_TAGS = frozenset({
    "html", "head", "body", "meta", "title", "style", "h1", "h2", "h3", "p", "table", "tr", "th",
    "td", "div", "span", "ul", "li", "a", "img", "strong", "em", "br", "svg", "text", "polyline",
})  # fmt: skip
#: Those of links, pictures and bars are held to values of their own.
_ATTRIBUTES = frozenset({
    "alt", "aria-label", "charset", "class", "content", "fill", "lang", "name", "points", "role",
    "viewbox", "x", "y",
})  # fmt: skip
#: Where a job has files.
_FOLDERS = ("sheets", "cut", "service", "rim", "tag", "offcuts")


@dataclass(frozen=True)
class Index:
    """What is seen on the page, in order, and which files there are.

    ``files`` are those in the job's folder and in the folders that jobs have; ``listed`` those of
    ``contents.json``, none where there is none yet.
    """

    seen: tuple[Seen, ...]
    files: frozenset[str]
    listed: frozenset[str]


def read_index(directory: Path, read: Callable[[str, Callable[[Path], Any]], Any]) -> Index | None:
    """Read the page; None where it cannot be read, or the job is older than such pages.

    Parameters
    ----------
    directory : Path
        The job's folder.
    read : callable
        Reads a file by its name and a reader, or tells why not.
    """
    listed = _listed(directory / CONTENTS)
    if INDEX not in listed and not os.path.lexists(directory / INDEX):
        return None
    seen = read(INDEX, lambda path: read_page(path, STYLE, _TAGS, _ATTRIBUTES))
    return None if seen is None else Index(seen, frozenset(_files(directory)), listed)


def _listed(path: Path) -> frozenset[str]:
    """Return the files of a job as they were when it was finished; none where that is untold."""
    try:
        files = json.loads(read_text(path))["files"]
    except (ReadError, OSError, ValueError, LookupError, TypeError, RecursionError):
        return frozenset()
    return frozenset(files) if isinstance(files, dict) else frozenset()


def _files(directory: Path) -> list[str]:
    """Return the paths of all files of a folder and of the folders that a job may have in it."""
    names = [path.name for path in directory.iterdir() if not path.is_dir()]
    for folder in _FOLDERS:
        for where, _, files in os.walk(directory / folder):
            stem = Path(where).relative_to(directory).as_posix()
            names += [f"{stem}/{name}" for name in files]
    return names
