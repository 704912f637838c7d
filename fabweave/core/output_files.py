"""Write single files beside a job: all of them, or none."""

import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from fabweave.core.errors import InputError


def check_file(path: Path, suffix: str = "") -> None:
    """Raise InputError unless a file may be written there; before the work, not after it.

    Parameters
    ----------
    path : Path
        The file, which is replaced if it exists.
    suffix : str
        How its name must end, such as ``.png``; empty for any name.
    """
    if suffix and path.suffix.lower() != suffix:
        raise InputError(
            f"{path} is to be a {suffix[1:].upper()} file: name it {path.name}{suffix}"
        )
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} to write {path.name} in; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"{path} may not be written; name a file in another folder")


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files; if one cannot be written, none is, and older ones stay as they are.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    written: dict[Path, Path] = {}
    try:
        for path, content in contents.items():
            handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
            written[path] = Path(name)
            with os.fdopen(handle, "wb") as file:
                file.write(content)
        for path, fresh in written.items():
            fresh.chmod(0o666 & ~_umask())
            fresh.replace(path)
    except OSError as error:
        names = ", ".join(map(str, contents))
        raise InputError(f"cannot write {names}: {error.strerror or error}") from error
    finally:
        for fresh in written.values():
            with suppress(OSError):
                fresh.unlink(missing_ok=True)


def _umask() -> int:
    """Return which rights new files do not get."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
