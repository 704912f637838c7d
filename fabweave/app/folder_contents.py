"""Tell the files that a job wrote into its folder from those that somebody else put there."""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

#: The list of a finished job's files; it is written last, and does not list itself.
CONTENTS_FILE = "contents.json"
#: What file managers leave in folders that somebody looks at: nobody misses it.
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
_LARGEST_LIST = 64 * 2**20


def write_contents(folder: Path) -> None:
    """Write the list of all files in a job's folder, each with its SHA-256."""
    files = {name: _sha256(folder / name) for name in file_names(folder)}
    text = json.dumps({"files": files}, indent=1, ensure_ascii=False)
    (folder / CONTENTS_FILE).write_text(text + "\n", encoding="utf-8", newline="\n")


def is_complete(folder: Path) -> bool:
    """Return whether a folder holds a finished job and nothing else."""
    return (folder / CONTENTS_FILE).is_file() and not foreign_files(folder)


def foreign_files(folder: Path, replaced: Iterable[Path] = ()) -> list[str]:
    """Return what a folder holds that no job wrote: files that were added, or changed since.

    Parameters
    ----------
    folder : Path
        Of a job, or any other folder: there, everything is foreign.
    replaced : iterable of Path
        Files that may have been changed, as their content is taken into the new job.

    Returns
    -------
    list of str
        Its name in the folder, each with what became of it if the job wrote it once.
    """
    listed = _listed(folder / CONTENTS_FILE)
    if not listed:
        # Not a job's folder: it may be as large as somebody's home.
        return sorted(path.name for path in folder.iterdir() if path.name not in _LITTER)
    folders = {up for name in listed for up in PurePosixPath(name).parents}
    spared = {path.resolve() for path in replaced}
    foreign = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if name in listed:
            if path.is_symlink() or not path.is_file():
                foreign.append(f"{name} (no longer a file)")
            elif path.resolve() not in spared and _sha256(path) != listed[name]:
                foreign.append(f"{name} (changed since)")
        elif PurePosixPath(name) in folders and path.is_dir() and not path.is_symlink():
            continue
        elif path.name not in _LITTER and name != CONTENTS_FILE:
            foreign.append(name)
    # What lies in a folder that was added goes without saying.
    return [name for name in foreign if PurePosixPath(name).parent in folders]


def _listed(path: Path) -> dict[str, str]:
    """Return a job's list of files; without one, or with one that cannot be read, none."""
    try:
        if path.is_symlink() or not path.is_file() or path.stat().st_size > _LARGEST_LIST:
            return {}
        files = json.loads(path.read_bytes())["files"]
        return {name: digest for name, digest in files.items() if isinstance(digest, str)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return {}


def file_names(folder: Path) -> list[str]:
    """Return the names of all files in a folder, in order, but that of the list."""
    names = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    return sorted(name for name in names if name != CONTENTS_FILE)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
