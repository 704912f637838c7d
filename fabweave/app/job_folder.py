"""Write a finished job's folder: all of it, or nothing."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fabweave.core.errors import InputError
from fabweave.core.parallel.interrupt import held_back


def check_destination(directory: Path) -> None:
    """Raise InputError unless a job may be written to this folder.

    It may if there is nothing there yet, or an empty folder, or an older job of fabweave's.
    """
    if not directory.exists():
        above = next(folder for folder in directory.absolute().parents if folder.exists())
        if not above.is_dir():
            raise InputError(f"{above} is a file, not a folder; choose another folder with -o")
        if not os.access(above, os.W_OK):
            raise InputError(f"you may not write to {above}; choose another folder with -o")
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file; choose a folder with -o")
    # All of it: where a generator is left half-way, Ctrl-C may come to nothing.
    if list(directory.iterdir()) and not (directory / "job.toml").is_file():
        raise InputError(
            f"{directory} holds files but no fabweave job (there is no job.toml), and the files "
            "would be lost; choose another folder with -o, or empty this one"
        )


@contextmanager
def finished_folder(directory: Path) -> Iterator[Path]:
    """Give a temporary folder beside the destination and move it there when all went well.

    An older job stays in place until the new one is complete. If the block fails or is
    interrupted, nothing is left behind.
    """
    check_destination(directory)
    directory = directory.absolute()
    directory.parent.mkdir(parents=True, exist_ok=True)
    with held_back():
        temporary = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
    try:
        fresh = temporary / "new"
        fresh.mkdir()
        yield fresh
        with held_back():
            _put_in_place(fresh, directory, temporary / "old")
    finally:
        with held_back():
            shutil.rmtree(temporary, ignore_errors=True)


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


def folder_is_readable(directory: Path) -> None:
    """Raise InputError unless the folder is there and can be listed."""
    if not directory.is_dir() or not os.access(directory, os.R_OK):
        raise InputError(f"{directory} is not a readable folder; give the folder of a finished job")
