"""Read the content of a file, if it is one that a job may have."""

import stat
from pathlib import Path

from fabweave.verify.drawing import ReadError

#: No file of a job is larger.
_LARGEST = 1 << 30


def read_content(path: Path) -> bytes:
    """Return what is in a file.

    Raises
    ------
    ReadError
        If it is a device, a pipe or the like, which may have no end, or too large for a job's.
    OSError
        If it cannot be read.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(f"{path.name} is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise ReadError("it is no regular file")
    if status.st_size > _LARGEST:
        raise ReadError(f"it has {status.st_size} bytes, more than any file of a job")
    return path.read_bytes()


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, line ends as they are; errors as for its content."""
    return read_content(path).decode("utf-8")
