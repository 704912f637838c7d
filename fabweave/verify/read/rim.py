"""Read the folder with the rings around openings: their record and their drawings."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.verify.drawing import Drawing
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg

#: Where rings lie in a job's folder, and the record that tells of them.
FOLDER = "rim"
RECORD = f"{FOLDER}/rim.json"
_READERS: dict[str, Callable[[Path], Drawing]] = {".dxf": read_dxf, ".svg": read_svg}


@dataclass(frozen=True, eq=False)
class Rim:
    """The rings that are told of, and the drawings by their name without suffix."""

    rings: list[dict[str, Any]]
    dxf: dict[str, Drawing]
    svg: dict[str, Drawing]


def read_rim(
    directory: Path,
    read: Callable[[str, Callable[[Path], Any]], Any],
    read_lists: Callable[[Path], dict[str, Any]],
) -> Rim | None:
    """Read all that is in the folder of rings; None if there is none.

    Parameters
    ----------
    directory : Path
        The job's folder.
    read : callable
        Reads a file by its name and a reader, or tells why not.
    read_lists : callable
        The reader of the record.
    """
    if not (directory / FOLDER).is_dir():
        return None
    drawings: dict[str, dict[str, Drawing]] = {".dxf": {}, ".svg": {}}
    for path in sorted((directory / FOLDER).iterdir()):
        if path.suffix in _READERS:
            drawing = read(f"{FOLDER}/{path.name}", _READERS[path.suffix])
            if drawing is not None:
                drawings[path.suffix][path.stem] = drawing
    record = read(RECORD, read_lists) or {"rings": []}
    return Rim(record["rings"], drawings[".dxf"], drawings[".svg"])
