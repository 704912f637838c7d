"""Read what is to be left out of a mesh: an opening at its top or bottom, or faces by number."""

import os
import re
from pathlib import Path
from typing import Literal, TypeAlias

from fabweave.core.arrays import frozen_value
from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import shown
from fabweave.core.units import parse_length

#: Where an opening may be.
Side: TypeAlias = Literal["top", "bottom"]
_SIDES: tuple[Side, ...] = ("top", "bottom")
#: What a text may look like that is no name of a file.
_FACES = re.compile(r"[\s,0-9]+", re.ASCII)
_FACE = re.compile(r"[0-9]{1,9}", re.ASCII)
_LEAST_MM, _MOST_MM = 0.01, 1e6
_TAKEN = (
    "write top:80mm or bottom:80mm for an opening of that diameter, the numbers of faces such as "
    "12,13, counted from 0, or the name of a file that lists them"
)


@frozen_value
class LeaveOut:
    """What is to be left out of a mesh.

    Parameters
    ----------
    diameters_mm : tuple of (str, float)
        ``top`` or ``bottom``, each at most once, and the diameter of the opening there.
    faces : tuple of int
        Numbers of faces, rising.
    """

    diameters_mm: tuple[tuple[Side, float], ...]
    faces: tuple[int, ...]

    def __str__(self) -> str:
        """Return the text that says so."""
        return ",".join(
            [*(f"{side}:{mm:.10g}mm" for side, mm in self.diameters_mm), *map(str, self.faces)]
        )


def parse_leave_out(text: str | None) -> LeaveOut:
    """Read openings and numbers of faces, with commas between them; none if nothing is said.

    Raises
    ------
    InputError
        If it reads otherwise, or names a side twice.

    Examples
    --------
    >>> parse_leave_out("top:8cm, 13, 12").diameters_mm, str(parse_leave_out("top:8cm, 13, 12"))
    ((('top', 80.0),), 'top:80mm,12,13')
    """
    diameters: dict[Side, float] = {}
    faces = set()
    for part in [] if text is None else text.split(","):
        name, colon, length = part.strip().partition(":")
        side = next((side for side in _SIDES if side == name.strip().lower()), None)
        if side is not None and colon:
            if side in diameters:
                raise InputError(f"an opening at the {side} is named twice; name it once")
            diameters[side] = _diameter(length)
        elif _FACE.fullmatch(part.strip()):
            faces.add(int(part))
        else:
            raise InputError(f"{shown(part.strip())} says nothing to leave out: {_TAKEN}")
    return LeaveOut(tuple(diameters.items()), tuple(sorted(faces)))


def tidy_leave_out(text: str) -> str:
    """Return what is to be left out in its usual form.

    Examples
    --------
    >>> tidy_leave_out("13, 12,bottom: 1in")
    'bottom:25.4mm,12,13'
    """
    return str(parse_leave_out(text))


def read_leave_out(text: str) -> str:
    """Return what a text says is to be left out, in its usual form, or the faces a file lists.

    The numbers take the file's place, so that job.toml says all and needs no file. A file has
    numbers of faces with commas or spaces between them; ``#`` begins a comment.

    Raises
    ------
    InputError
        If it is neither, or the file cannot be read or lists no faces.

    Examples
    --------
    >>> read_leave_out("7,7,3")
    '3,7'
    """
    first = text.partition(",")[0].partition(":")[0].strip().lower()
    if first in _SIDES or _FACES.fullmatch(text):
        return tidy_leave_out(text)
    path = Path(text)
    if not os.path.exists(path):
        raise InputError(f"there is no file {shown(text)}, nor is it an opening: {_TAKEN}")
    return _listed(read_text(path, "the list of faces"), path.name)


def _listed(content: str, name: str) -> str:
    """Return the faces that a file lists, with commas between them."""
    faces = set()
    for number, line in enumerate(content.splitlines(), start=1):
        for word in line.partition("#")[0].replace(",", " ").split():
            if not _FACE.fullmatch(word):
                raise InputError(
                    f"line {number} of {name} has {shown(word)}, which is no number of a face; "
                    "write whole numbers, counted from 0"
                )
            faces.add(int(word))
    if not faces:
        raise InputError(f"{name} lists no faces; write their numbers, counted from 0")
    return ",".join(map(str, sorted(faces)))


def _diameter(text: str) -> float:
    """Return the diameter of an opening, in millimetres."""
    diameter = parse_length(text.strip())
    if not _LEAST_MM <= diameter <= _MOST_MM:
        raise InputError(
            f"an opening of {diameter:g} mm is none; its diameter is {_LEAST_MM:g} to "
            f"{_MOST_MM:.0f} mm, such as top:80mm"
        )
    return diameter
