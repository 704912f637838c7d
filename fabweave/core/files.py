"""Read files that people give, and write files whole or not at all."""

import csv
import difflib
import io
import logging
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

from fabweave.core.errors import InputError


def check_file(path: Path, suffix: str = "", *, source: str | None = None) -> None:
    """Raise InputError unless a file may be written there; before the work, not after it.

    Parameters
    ----------
    path : Path
        The file, which is replaced if it exists. A link stands for the file that it leads to; a
        device, such as ``/dev/null``, or a pipe that somebody reads, is written to.
    suffix : str
        How its name must end, such as ``.png``; empty for any name.
    source : str, optional
        A file that is read, and that the new one is not to replace.
    """
    if path.is_symlink() and not path.exists():
        raise InputError(
            f"{path} is a link to {os.readlink(path)}, which is not there; name another file"
        )
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    special = path.exists() and not path.is_file()
    if suffix and path.suffix.lower() != suffix and not special:
        raise InputError(
            f"{path} will be a {suffix[1:].upper()} file, so its name has to end with {suffix}: "
            f"{path.name}{suffix}"
        )
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} to write {path.name} in; make it first")
    if source is not None and path.exists() and Path(source).exists() and path.samefile(source):
        raise InputError(f"{path} is the mesh itself and would be lost; name another file")
    written = [path] if path.exists() else []
    if not special:
        written.append(path.resolve().parent)  # a file is replaced by a new one beside it
    if not all(os.access(place, os.W_OK) for place in written):
        raise InputError(f"you may not write {path}; name a file in another folder")


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files; if one cannot be written, none is, and older ones stay as they are.

    Links are followed, and devices are written to: neither is replaced.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    written: dict[Path, Path] = {}
    try:
        special = {path: data for path, data in contents.items() if _is_special(path)}
        for path, content in contents.items():
            if path not in special:
                target = path.resolve()
                handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
                written[target] = Path(name)
                with os.fdopen(handle, "wb") as file:
                    file.write(content)
        for path, content in special.items():
            # A pipe that nobody reads is an error, and not waited for.
            handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
            if hasattr(os, "set_blocking"):
                os.set_blocking(handle, True)
            with os.fdopen(handle, "wb") as file:
                file.write(content)
        for target, fresh in written.items():
            fresh.chmod(_mode(target))
            fresh.replace(target)
    except OSError as error:
        names = ", ".join(map(str, contents))
        raise InputError(f"cannot write {names}: {error.strerror or error}") from error
    finally:
        for fresh in written.values():
            with suppress(OSError):
                fresh.unlink(missing_ok=True)


def _is_special(path: Path) -> bool:
    """Return whether something is there that is no file: a device, a pipe or a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _mode(target: Path) -> int:
    """Return the rights that a file has, or that a new one gets."""
    if target.exists():
        return stat.S_IMODE(target.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


#: Lists and tables that people write, and drawings of outlines, are far smaller, in bytes.
MOST_TEXT_BYTES = 16 * 2**20
#: Meshes of two million edges, and crossing maps of as many crossings, are smaller.
MOST_BYTES = 2 * 2**30

_CHUNK = 2**20
#: Among so many names of a folder one is looked for that resembles a missing one.
_MOST_NAMES = 2000


def read_input(path: Path, what: str, most_bytes: int = MOST_TEXT_BYTES) -> bytes:
    """Return the bytes of a file that a user names.

    Only ordinary files are read, or what links lead to: a device or a pipe may never end. The size
    is looked at before anything is read.

    Parameters
    ----------
    path : Path
    what : str
        What is to be read, for the message, such as ``"the preset"``.
    most_bytes : int
        Larger files are refused.

    Raises
    ------
    InputError
        If it cannot be read, is no ordinary file, or is too large; the message says why.
    """
    try:
        # Without O_NONBLOCK, a pipe would be waited for before it could be looked at.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        handle = os.open(path, flags)
        with os.fdopen(handle, "rb") as file:
            found = os.fstat(handle)
            if not stat.S_ISREG(found.st_mode):
                raise InputError(
                    f"cannot read {what} in {path}: it is {_sort_of(found.st_mode)}; name a file"
                )
            data = b"" if found.st_size > most_bytes else file.read(found.st_size + 1)
            while found.st_size < len(data) <= most_bytes:  # it grows while it is read
                more = file.read(_CHUNK)
                if not more:
                    break
                data += more
            if max(found.st_size, len(data)) > most_bytes:
                raise InputError(
                    f"cannot read {what} in {path}: it has {max(found.st_size, len(data)):,} "
                    f"bytes, and at most {most_bytes:,} are read; is it the right file?"
                )
            return data
    except FileNotFoundError:
        raise InputError(
            f"cannot read {what} in {path}: there is no such file{_resembling(path)}"
        ) from None
    except IsADirectoryError:
        raise InputError(f"cannot read {what} in {path}: it is a folder; name a file") from None
    except OSError as error:
        raise InputError(f"cannot read {what} in {path}: {error.strerror or error}") from error
    except ValueError as error:  # a name with a null character
        if isinstance(error, InputError):
            raise
        raise InputError(f"cannot read {what} in {str(path)!r}: {error}") from error


def _resembling(path: Path) -> str:
    """Ask whether a file beside one that is missing is meant; nothing where none is called so."""
    try:
        names = [entry.name for entry in islice(path.parent.iterdir(), _MOST_NAMES)]
    except (OSError, ValueError):
        return ""
    near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.7)
    return f"; did you mean {path.with_name(near[0])}?" if near else ""


def read_text(path: Path, what: str, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Return the text of a file that a user names, as :func:`read_input` reads it.

    Raises
    ------
    InputError
        If it cannot be read, or is not in UTF-8; the message says in which line.
    """
    data = read_input(path, what, most_bytes)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"cannot read {what} in {path}: line {line} is not in UTF-8; save the file as UTF-8"
        ) from error


@contextmanager
def silenced(library: str) -> Iterator[None]:
    """Keep a library from logging what we tell in our own words."""
    logger = logging.getLogger(library)
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


def _sort_of(mode: int) -> str:
    """Say what is not an ordinary file."""
    known = {
        stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
    }  # fmt: skip
    return known.get(stat.S_IFMT(mode), "no ordinary file")


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    r"""Return a table as CSV; None is an empty cell.

    Examples
    --------
    >>> csv_text(["id", "hole_mm"], [("A1", 3.3), ("A2", None)])
    'id,hole_mm\nA1,3.3\nA2,\n'
    """
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(rows)
    return text.getvalue()
