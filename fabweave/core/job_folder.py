"""Write a finished job's folder: all of it, or nothing, and nothing of anybody else's is lost."""

import hashlib
import json
import os
import shlex
import shutil
import tempfile
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of, shown
from fabweave.core.parallel.interrupt import held_back, lock_file

#: The list of a finished job's files; it is written last, and does not list itself.
CONTENTS_FILE = "contents.json"
#: What file managers leave in folders that somebody looks at: nobody misses it.
_LITTER = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
_LARGEST_LIST = 64 * 2**20
#: No file of a job is larger, and none is read to compare it that is.
_LARGEST_FILE = 2**30


def write_contents(folder: Path) -> None:
    """Write the list of all files in a job's folder, each with its SHA-256 and its size."""
    names = file_names(folder)
    listed = {
        "files": {name: _sha256(folder / name) for name in names},
        "bytes": {name: (folder / name).stat().st_size for name in names},
    }
    text = json.dumps(listed, indent=1, ensure_ascii=False)
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
            elif path.resolve() not in spared and _is_changed(path, *listed[name]):
                foreign.append(f"{name} (changed since)")
        elif PurePosixPath(name) in folders and path.is_dir() and not path.is_symlink():
            continue
        elif path.name not in _LITTER and name != CONTENTS_FILE:
            foreign.append(name)
    # What lies in a folder that was added goes without saying.
    return [name for name in foreign if PurePosixPath(name).parent in folders]


def _is_changed(path: Path, digest: str, size: int | None) -> bool:
    """Return whether a file is another one; its size tells most, and older lists say none."""
    there = path.stat().st_size
    return there > _LARGEST_FILE or size not in (None, there) or _sha256(path) != digest


def _listed(path: Path) -> dict[str, tuple[str, int | None]]:
    """Return SHA-256 and size of a job's files; without a list that can be read, nothing."""
    try:
        if path.is_symlink() or not path.is_file() or path.stat().st_size > _LARGEST_LIST:
            return {}
        listed = json.loads(path.read_bytes())
        sizes = listed.get("bytes", {})
        files = listed["files"].items()
        return {name: (sha, sizes.get(name)) for name, sha in files if isinstance(sha, str)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return {}


def file_names(folder: Path) -> list[str]:
    """Return the names of all files in a folder, in order, but that of the list."""
    names = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    return sorted(name for name in names if name != CONTENTS_FILE)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


#: What a run has in its temporary folder: the new job, the older one for a moment, and a lock that
#: is taken as long as the run lives.
_NEW, _OLD, _LOCK = "new", "old", "fabweave.lock"


def check_destination(
    directory: Path, replaced: Collection[Path] = (), *, mesh: str | None = None
) -> None:
    """Raise InputError unless a job may be written to this folder.

    It may if there is nothing there yet, or an empty folder, or nothing but what an older job
    wrote.

    Parameters
    ----------
    directory : Path
        A link to a folder stands for that folder.
    replaced : collection of Path
        Files that may have been changed since, as their content is taken into the new job.
    mesh : str, optional
        What is woven: not to be a file in this folder.
    """
    directory = _followed(directory)
    if mesh is not None and directory in Path(mesh).resolve().parents and os.path.isfile(mesh):
        raise InputError(
            f"the mesh {mesh} is in {directory}, which the new job replaces; choose another folder "
            "with -o, or move the mesh"
        )
    # All of them: where a generator is left half-way, Ctrl-C may come to nothing.
    above = [*(folder for folder in directory.parents if folder.exists()), directory][0]
    if not above.is_dir():
        raise InputError(f"{above} is a file, not a folder; choose another folder with -o")
    # The new folder is made beside the older one, and takes its place.
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"you may not write to {above}; choose another folder with -o")
    if not directory.exists():
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file; choose a folder with -o")
    here = Path.cwd()
    root = os.path.ismount(directory)
    if root or directory == here or directory in here.parents:
        where = "is the root of a volume" if root else "is where you are"
        raise InputError(
            f"{directory} {where}, and cannot be replaced by a new folder; name a folder in it: "
            f"-o {shlex.quote(str(directory / 'job'))}"
        )
    if not os.access(directory, os.R_OK | os.X_OK):
        raise InputError(f"you may not read {directory}; choose another folder with -o")
    foreign = foreign_files(directory, replaced)
    if foreign:
        count = agree(len(foreign), "{n} [entry|entries]")
        listed = (directory / CONTENTS_FILE).is_file()
        unlisted = "" if listed else f" (there is no {CONTENTS_FILE})"
        raise InputError(
            f"{directory} holds {count} that no job wrote{unlisted} and that would be lost: "
            f"{few_of(foreign)}; choose another folder with -o, or move them elsewhere"
        )


@contextmanager
def finished_folder(directory: Path, replaced: Collection[Path] = ()) -> Iterator[Path]:
    """Give a temporary folder beside the destination and move it there when all went well.

    An older job stays in place until the new one is complete. If the block fails or is
    interrupted, nothing is left behind; what a run that was killed left is removed by the next.
    """
    check_destination(directory, replaced)
    directory = _followed(directory)
    directory.parent.mkdir(parents=True, exist_ok=True)
    temporary = lock = None
    try:
        with held_back():
            temporary = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
            lock = lock_file(temporary / _LOCK)
        fresh = temporary / _NEW
        fresh.mkdir()
        yield fresh
        write_contents(fresh)
        with held_back():
            # Somebody may have put something there meanwhile.
            check_destination(directory, replaced)
            _put_in_place(fresh, directory, temporary / _OLD)
    finally:
        with held_back():
            if lock is not None:  # some network drives know no locks
                os.close(lock)
            if temporary is not None:
                shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def told_where(directory: Path) -> Iterator[None]:
    """Name the folder where it cannot be written: of a full disk the system says no path."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"cannot write the job in {directory}: {error.strerror or error}; nothing was kept. "
            "Free some space, or name another folder with -o"
        ) from error


def clear_abandoned(directory: Path) -> list[str]:
    """Clear up after runs for this folder that were killed, and say what was found.

    What they had half written is removed. Where one was killed while it put its folder in place,
    so that neither job is there, the new one is put there if it is complete, else the older one.
    """
    directory = _followed(directory)
    notes = []
    for temporary in sorted(directory.parent.glob(f".{_literal(directory.name)}.*")):
        if not _is_abandoned(temporary):
            continue
        killed = f"an earlier run for {directory} was killed"
        older = temporary / _OLD
        with held_back():
            if older.exists() and not directory.exists():
                kept = temporary / _NEW if is_complete(temporary / _NEW) else older
                kept.rename(directory)
                which = "its new job was complete" if kept != older else "the older job was aside"
                notes.append(f"{killed} while it put its folder in place: {which}, and is back")
            elif older.exists() and not is_complete(directory):
                notes.append(f"{killed}; the job that it was to replace is still in {older}")
                continue
            else:
                notes.append(f"{killed}: removed what it left in {temporary.name}")
            shutil.rmtree(temporary, ignore_errors=True)
    return notes


def _is_abandoned(temporary: Path) -> bool:
    """Return whether this is a run's temporary folder, and that run is over."""
    if temporary.is_symlink() or not (temporary / _LOCK).is_file():
        return False
    if not {path.name for path in temporary.iterdir()} <= {_NEW, _OLD, _LOCK}:
        return False
    with held_back():
        lock = lock_file(temporary / _LOCK)
        if lock is not None:
            os.close(lock)
    return lock is not None


def _literal(name: str) -> str:
    """Return a name as a pattern that only it matches."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in name)


def _followed(directory: Path) -> Path:
    """Return the folder that a path stands for, links followed."""
    if directory.is_symlink() and not directory.exists():
        raise InputError(
            f"{directory} is a link to {os.readlink(directory)}, which is not there; make that "
            "folder, or choose another with -o"
        )
    return directory.resolve()


def _put_in_place(fresh: Path, directory: Path, old: Path) -> None:
    """Move a folder to its destination, and what was there aside; back if that fails."""
    if directory.exists():
        directory.rename(old)
    try:
        fresh.rename(directory)
    except OSError:
        if old.exists():
            old.rename(directory)
        raise


def folder_at(place: Any) -> Path:
    """Return the folder that a Python user names, there or not; InputError if none can be there."""
    try:
        folder = Path(place)
        with suppress(FileNotFoundError, NotADirectoryError, PermissionError):
            folder.lstat()
    except (OSError, TypeError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{shown(place)} is the path of no folder: {why}") from error
    return folder


def folder_is_readable(directory: Path) -> None:
    """Raise InputError unless the folder is there and can be listed."""
    if not directory.is_dir() or not os.access(directory, os.R_OK):
        raise InputError(f"{directory} is not a readable folder; give the folder of a finished job")
