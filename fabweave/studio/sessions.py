"""Keep what pages do in files, so that no closed tab, restart or lost process takes it away."""

import json
import re
import time
from pathlib import Path
from typing import Any

from fabweave.core.errors import InputError

#: What pages call a session; a file of it has no more bytes, and so many are listed.
_NAME, _MOST_BYTES, _LISTED = re.compile(r"[a-z0-9]{8,32}"), 8 * 2**20, 12


class Sessions:
    """The sessions of a studio, a file each: its states, where in them it is, and what is kept.

    Parameters
    ----------
    folder : Path
        Where the files are; it is made with the first.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def _path(self, name: str) -> Path:
        if not _NAME.fullmatch(name):
            raise InputError("a session is called by 8 to 32 small letters and digits")
        return self._folder / f"{name}.json"

    def save(self, name: str, data: bytes) -> None:
        """Write a session, whole or not at all.

        Raises
        ------
        InputError
            If it is none, or too large.
        """
        path = self._path(name)
        if len(data) > _MOST_BYTES:
            raise InputError(f"the session has more than {_MOST_BYTES >> 20} MB")
        try:
            told = json.loads(data)
            known = isinstance(told["states"], list) and isinstance(told["at"], int)
        except (ValueError, KeyError, TypeError, RecursionError):
            known = False
        if not known:
            raise InputError("a session has states, and which of them it is at")
        self._folder.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_bytes(data)
        part.replace(path)

    def read(self, name: str) -> Any:
        """Return a session; InputError if there is none that reads."""
        try:
            return json.loads(self._path(name).read_bytes())
        except (OSError, ValueError):
            raise InputError("there is no such session any more") from None

    def forget(self, name: str) -> None:
        """Take a session away."""
        self._path(name).unlink(missing_ok=True)

    def listed(self) -> list[dict[str, Any]]:
        """Return the last sessions, the latest first, with title and picture."""
        try:
            paths = sorted(self._folder.glob("*.json"), key=lambda path: -path.stat().st_mtime)
        except OSError:
            return []
        found = []
        for path in paths[:_LISTED]:
            try:
                told = self.read(path.stem)
                when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
            except (InputError, OSError):
                continue
            titles = {name: str(told.get(name, "")) for name in ("title", "picture", "words")}
            titles["title"] = titles["title"] or _called(told)
            found.append({"name": path.stem, "when": when, **titles})
        return found


def _called(told: dict[str, Any]) -> str:
    """Return the name of the model of a session that was left before anything was seen of it.

    Examples
    --------
    >>> _called({"at": 0, "states": [{"mesh": "shape:torus?m=8"}]})
    'torus'
    """
    try:
        mesh = str(told["states"][told["at"]]["mesh"])
    except (IndexError, KeyError, TypeError):
        return ""
    return Path(mesh.partition("?")[0].removeprefix("shape:")).stem
