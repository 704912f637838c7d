"""Read the sheets that are to be cut, with kerf and micro-joints, if a job has any."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.verify.crossing_map import Sheet
from fabweave.verify.drawing import Drawing
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.rim import FOLDER as RIM
from fabweave.verify.read.svg import read_svg
from fabweave.verify.statement import Tally

#: Where these sheets lie in a job's folder.
FOLDER = "cut"
_MICRO = re.compile(r"(\d+):([\d.]+)mm")


@dataclass(frozen=True)
class Ready:
    """The sheets to cut as read, by their numbers, and what the settings say was done to them."""

    kerf_mm: float
    #: How many interruptions an outline has at most, and how wide the bridges are.
    micro: tuple[int, float] | None
    dxf: dict[int, Drawing]
    svg: dict[int, Drawing]
    #: Those of rings, by the names of their nominal sheets.
    rim_dxf: dict[str, Drawing]
    rim_svg: dict[str, Drawing]

    def name_of(self, sheet: str) -> str:
        """Return what the files of a sheet are to be called, without suffix."""
        words = [sheet]
        if self.kerf_mm:
            words.append(f"kerf{self.kerf_mm:g}mm")
        if self.micro is not None:
            words.append(f"micro{self.micro[0]}x{self.micro[1]:g}mm")
        return "_".join(words)


def read_ready(
    directory: Path,
    options: dict[str, Any],
    sheets: tuple[Sheet, ...],
    read: Callable[[str, Callable[[Path], Drawing]], Drawing | None],
    tally: Tally,
) -> Ready | None:
    """Read the sheets that are to be cut; None where the settings want none.

    Parameters
    ----------
    directory : Path
        The job's folder.
    options : dict
        The settings of job.toml.
    sheets : tuple of Sheet
    read : callable
        Reads a file by its name and a reader, or tells why not.
    tally : Tally
        Where files are told that do not belong there.
    """
    kerf, micro = _wanted(options, tally)
    ready = Ready(kerf, micro, {}, {}, {}, {})
    known = set()
    if kerf or micro is not None:
        for sheet in sheets:
            for suffix, drawings, reader in (
                ("dxf", ready.dxf, read_dxf),
                ("svg", ready.svg, read_svg),
            ):
                name = f"{ready.name_of(sheet.name)}.{suffix}"
                known.add(name)
                drawing = read(f"{FOLDER}/{name}", reader)
                if drawing is not None:
                    drawings[sheet.number] = drawing
        for ring in sorted(path.stem for path in (directory / RIM).glob("*.dxf")):
            for suffix, rings, reader in (
                ("dxf", ready.rim_dxf, read_dxf),
                ("svg", ready.rim_svg, read_svg),
            ):
                name = f"{ready.name_of(ring)}.{suffix}"
                known.add(name)
                drawing = read(f"{FOLDER}/{name}", reader)
                if drawing is not None:
                    rings[ring] = drawing
    if (directory / FOLDER).is_dir():
        for path in sorted((directory / FOLDER).iterdir()):
            # A sheet left over from an earlier run would be cut too.
            tally.at(FOLDER, path.name).expect(path.name in known, "it is no sheet of this job")
    return ready if known else None


def _wanted(options: dict[str, Any], tally: Tally) -> tuple[float, tuple[int, float] | None]:
    """Return the kerf and the micro-joints that the settings state."""
    kerf, micro, place = 0.0, None, tally.at("job.toml")
    try:
        kerf = float(str(options.get("kerf", 0.0)).removesuffix("mm"))
    except ValueError:
        place.fail(f"the kerf {options['kerf']!r} is no length")
    if "micro_joints" in options:
        words = _MICRO.fullmatch(str(options["micro_joints"]))
        if place.expect(words, "micro_joints are not NUMBER:WIDTH") and words:
            micro = int(words[1]), float(words[2])
    return kerf, micro
