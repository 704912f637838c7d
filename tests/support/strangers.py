"""Run other people's programs on our sheets, and say what they measured."""

import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

#: One operation for each colour of the cut; nothing may fall under two.
_MEERK40T = """\
service device start -i grbl 0
set -p planner opt_effect_combine False
set -p planner opt_inners_grouped True
set -p elements classify_black_as_raster False
set -p elements classify_autogenerate False
set -p elements classify_new False
operation* delete
engrave -c #000000 -s 100 -p 200
cut -c #0000ff -s 20 -p 900
cut -c #ff0000 -s 20 -p 1000
load {file}
element* classify
tree list
planA copy preprocess validate blob preopt optimize
planA save_job {gcode}
quit
"""
#: Laser power tells the operations apart in the G-code.
ENGRAVED, INNER, OUTER = 200, 900, 1000


@dataclass(frozen=True)
class Burn:
    """A run of the beam: its power, its path's points, and its length in millimetres."""

    power: int
    points: tuple[tuple[float, float], ...]

    @property
    def length(self) -> float:
        """Length of the path."""
        return sum(map(math.dist, self.points, self.points[1:]))


@dataclass(frozen=True)
class Meerk40t:
    """What MeerK40t made of a file: entities read, entities under each operation, the G-code."""

    added: int
    assigned: tuple[int, ...]
    burns: tuple[Burn, ...]


def ask_meerk40t(file: Path, folder: Path) -> Meerk40t:
    """Have MeerK40t plan a file for a GRBL laser."""
    gcode, script = folder / "job.gcode", folder / "script.txt"
    script.write_text(_MEERK40T.format(file=file, gcode=gcode), encoding="utf-8")
    home = folder / "home"  # it remembers operations there
    home.mkdir()
    run = subprocess.run(
        [Path(sys.executable).parent / "meerk40t", "-z", "-A", "-X", "-P", "9", "-b", script],
        env={**os.environ, "HOME": str(home)},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert "Export succeeded" in run.stdout, run.stdout[-2000:]
    added = int(re.findall(r"added: (\d+)", run.stdout)[0])
    assigned = [0, 0, 0]
    for number in re.findall(r"^\S*\s*0\.(\d)\.\d+\s+: reference", run.stdout, re.MULTILINE):
        assigned[int(number)] += 1
    return Meerk40t(added, tuple(assigned), tuple(_burns(gcode)))


def _burns(gcode: Path) -> list[Burn]:
    """Read G-code: every stretch between two travels is one run of the beam."""
    power, points, here = 0, [], (0.0, 0.0)
    found: list[Burn] = []

    def close() -> None:
        if len(points) > 1:
            found.append(Burn(power, tuple(points)))
        points.clear()

    mode = "0"
    # MeerK40t ends lines with a carriage return.
    for line in gcode.read_text(encoding="ascii").replace("\r", "\n").split("\n"):
        words = dict(re.findall(r"([A-Z])(-?[0-9.]+)", line))
        if words.get("G") in ("0", "1"):
            mode = words["G"]
        if "S" in words and mode == "1" and int(words["S"]) != power:
            close()
            power = int(words["S"])
        if "X" in words or "Y" in words:
            there = (float(words.get("X", here[0])), float(words.get("Y", here[1])))
            if mode == "0":
                close()
            else:
                points.extend([there] if points else [here, there])
            here = there
    close()
    return found


def librecad_pdf(file: Path, folder: Path) -> Path:
    """Have LibreCAD print a drawing at 1:1."""
    subprocess.run(
        ["librecad", "dxf2pdf", "-c", "-s", "1", "-t", str(folder), str(file)],  # noqa: S607 - on the path
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(folder)},
        capture_output=True,
        timeout=300,
        check=True,
    )
    return folder / f"{file.stem}.pdf"


def draw_pdf(file: Path, dpi: int, folder: Path) -> Path:
    """Have poppler draw the first page of a PDF file."""
    subprocess.run(
        ["pdftoppm", "-r", str(dpi), "-png", "-singlefile", str(file), str(folder / "page")],  # noqa: S607 - on the path
        capture_output=True,
        timeout=300,
        check=True,
    )
    return folder / "page.png"


def rsvg_png(file: Path, dpi: int, folder: Path) -> Path:
    """Have librsvg draw a sheet."""
    target, scale = folder / "rsvg.png", str(dpi)
    subprocess.run(
        ["rsvg-convert", "-d", scale, "-p", scale, "-b", "white", "-o", target, file],  # noqa: S607 - on the path
        capture_output=True,
        timeout=300,
        check=True,
    )
    return target
