"""Write single files beside a job: all of them, or none."""

import os
import stat
import tempfile
from collections.abc import Mapping
from contextlib import suppress
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
