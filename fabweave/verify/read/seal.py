"""Hold every file of a job to the list of all files, by its SHA-256."""

import hashlib
import json
import os
from pathlib import Path

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_text
from fabweave.verify.statement import Tally

#: The list of a job's files; it does not list itself, nor what the proof itself writes last.
SEAL, PROOF = "contents.json", "verify.json"
#: What file managers leave in folders that somebody looks at.
_LITTER = (".DS_Store", "Thumbs.db", "desktop.ini")


def check_seal(directory: Path, tally: Tally) -> None:
    """Check that a folder holds the files that its list names, unchanged, and no others.

    Parameters
    ----------
    directory : Path
        The job's folder.
    tally : Tally
        Told every file that is missing, added or changed.
    """
    try:
        listed = dict(json.loads(read_text(directory / SEAL))["files"].items())
    except FileNotFoundError:
        tally.fail(f"{SEAL} is missing")
        return
    except (
        ReadError, OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError
    ) as error:  # fmt: skip
        tally.fail(f"{SEAL} cannot be read: {error}")
        return
    there = set()
    for where, _, names in os.walk(directory):
        folder = Path(where).relative_to(directory)
        there |= {(folder / name).as_posix() for name in names if name not in _LITTER}
    for name in sorted((there - {SEAL, PROOF}) | set(listed)):
        wrong = ""
        if name not in listed:
            wrong = f"{SEAL} does not list it"
        elif name not in there:
            wrong = "it is missing"
        elif _digest(directory / name) != listed[name]:
            wrong = f"it was changed: it is not what {SEAL} says"
        tally.at(name).expect(not wrong, wrong)


def _digest(path: Path) -> str | None:
    """Return the SHA-256 of a file; None of what is no plain file."""
    if path.is_symlink() or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
