"""Read the folder of offcuts: their drawings, and the list of stock beside them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.verify.drawing import Drawing
from fabweave.verify.read.dxf import read_dxf

#: Where offcuts lie in a job's folder, and the list of stock that names them.
FOLDER = "offcuts"
STOCK = f"{FOLDER}/stock.toml"


@dataclass(frozen=True, eq=False)
class Offcuts:
    """What is in the folder of offcuts: drawings by where they are, and the list of stock."""

    drawings: dict[str, Drawing]
    stock: dict[str, Any] | None


def read_offcuts(
    directory: Path,
    read: Callable[[str, Callable[[Path], Any]], Any],
    read_toml: Callable[[Path], dict[str, Any]],
) -> Offcuts | None:
    """Read all that is in the folder of offcuts; None if there is none.

    Parameters
    ----------
    directory : Path
        The job's folder.
    read : callable
        Reads a file by its name and a reader, or tells why not.
    read_toml : callable
        The reader of the list.
    """
    if not (directory / FOLDER).is_dir():
        return None
    names = sorted(f"{FOLDER}/{path.name}" for path in (directory / FOLDER).iterdir())
    files = {name: read(name, read_dxf) for name in names if name != STOCK}
    drawings = {name: drawing for name, drawing in files.items() if drawing is not None}
    return Offcuts(drawings, read(STOCK, read_toml))
