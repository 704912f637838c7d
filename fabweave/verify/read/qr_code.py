"""Read a QR code from its dots, all of which must be right (ISO/IEC 18004, level L, bytes).

And find the dots where a job has them besides its sheets: a picture, and a tag to engrave.
Nothing is corrected: error correction is for cameras, and here a wrong dot is a fault. Codes of
versions 1 to 9 are read, which hold up to 230 bytes.
"""

import io
import os
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from fabweave.verify.drawing import Drawing, Flags, Ints, ReadError
from fabweave.verify.read.content import read_content
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg
from fabweave.verify.statement import Tally

#: Of each version at level L: blocks, codewords with data in each, and with corrections in each.
_BLOCKS = {
    1: (1, 19, 7),
    2: (1, 34, 10),
    3: (1, 55, 15),
    4: (1, 80, 20),
    5: (1, 108, 26),
    6: (2, 68, 18),
    7: (2, 78, 20),
    8: (2, 97, 24),
    9: (2, 116, 30),
}
_ALIGNED = {7: (6, 22, 38), 8: (6, 24, 42), 9: (6, 26, 46)}
_FORMAT_MASK = 0b10101
_LEVEL_L = 0b01
_BYTES, _ECI, _UTF8 = 0b0100, 0b0111, 26

#: The picture of the code, and the folder of the tag and its file there without suffix.
CODE, TAG_FOLDER, TAG = "qr_code.png", "tag", "qr_tag"
#: Readers want a border of so many dots to be free.
QUIET = 4
#: A corner of a code begins with a run of so many dark dots.
_CORNER = 7
#: No picture of a code has more pixels to a side.
_MOST_SIDE = 4096


def read_code(dots: Flags) -> str:
    """Return what a QR code says.

    Parameters
    ----------
    dots : (N, N) bool array
        True for dark, the uppermost row first, without a border.

    Raises
    ------
    ReadError
        If a dot is wrong, or the code is of a kind that is not read here.
    """
    size = len(dots)
    version, rest = divmod(size - 17, 4)
    if dots.shape != (size, size) or rest or version not in _BLOCKS:
        raise ReadError(f"{dots.shape[0]} x {dots.shape[-1]} dots are no code that is known")
    fixed, wanted = _patterns(size, version)
    wrong = int(np.sum(wanted[fixed == 1] != dots[fixed == 1]))
    if wrong:
        raise ReadError(f"{wrong} dots of its patterns are wrong")
    mask = _mask(dots, version)
    words = _words(dots, mask, fixed > 0)
    blocks, n_data, n_more = _BLOCKS[version]
    count = blocks * (n_data + n_more)
    data = [words[: blocks * n_data][block::blocks] for block in range(blocks)]
    more = [words[blocks * n_data : count][block::blocks] for block in range(blocks)]
    for one, two in zip(data, more, strict=True):
        if not _is_codeword([*one, *two], n_more):
            raise ReadError("dots of its data are wrong: they contradict their corrections")
    return _text("".join(f"{word:08b}" for block in data for word in block), version)


def _patterns(size: int, version: int) -> tuple[Ints, Flags]:
    """Return which dots are no data (1 of patterns, 2 of numbers), and what the patterns are."""
    fixed, dark = np.zeros((size, size), dtype=np.int64), np.zeros((size, size), dtype=bool)
    # Both copies of the format, and of the version.
    fixed[8, :9] = fixed[:9, 8] = fixed[8, size - 8 :] = fixed[size - 8 :, 8] = 2
    if version >= 7:
        fixed[:6, size - 11 : size - 8] = fixed[size - 11 : size - 8, :6] = 2
    place = np.arange(size)
    fixed[6, :] = fixed[:, 6] = 1
    dark[6, :] = dark[:, 6] = place % 2 == 0
    centres = _ALIGNED.get(version, (6, size - 7) if version > 1 else ())
    for row, column in product(centres, centres):
        if (row, column) not in ((6, 6), (6, size - 7), (size - 7, 6)):
            _square(fixed, dark, row, column, 2)
    for row, column in ((3, 3), (3, size - 4), (size - 4, 3)):
        _square(fixed, dark, row, column, 4)
    fixed[size - 8, 8], dark[size - 8, 8] = 1, True
    return fixed, dark


def _square(fixed: Ints, dark: Flags, row: int, column: int, reach: int) -> None:
    """Put a square of rings about a dot, as far as it is on the code."""
    place = np.arange(len(fixed))
    ring = np.maximum(np.abs(place - row)[:, None], np.abs(place - column)[None])
    inside = ring <= reach
    fixed[inside] = 1
    # A finder's rings are dark at 0, 1 and 3; an alignment's at 0 and 2.
    dark[inside] = np.isin(ring[inside], (0, 1, 3) if reach == 4 else (0, 2))


def _mask(dots: Flags, version: int) -> int:
    """Return which mask lies over the data, and require level L and two equal copies."""
    size = len(dots)
    first = [*dots[8, [0, 1, 2, 3, 4, 5, 7, 8]], *dots[[7, 5, 4, 3, 2, 1, 0], 8]]
    second = [*dots[size - 1 : size - 8 : -1, 8], *dots[8, size - 8 :]]
    if first != second:
        raise ReadError("the two copies of its format differ")
    if version >= 7 and np.any(dots[:6, size - 11 : size - 8] != dots[size - 11 : size - 8, :6].T):
        raise ReadError("the two copies of its version differ")
    level, mask = divmod(int("".join(str(int(bit)) for bit in first[:5]), 2) ^ _FORMAT_MASK, 8)
    if level != _LEVEL_L:
        raise ReadError("it is not of level L")
    return mask


def _words(dots: Flags, mask: int, fixed: Flags) -> list[int]:
    """Return the codewords: pairs of columns from the right, up and down by turns."""
    size = len(dots)
    y, x = np.mgrid[:size, :size]
    conditions: tuple[npt.NDArray[np.int64], ...] = (
        (x + y) % 2, y % 2, x % 3, (x + y) % 3, (x // 3 + y // 2) % 2, x * y % 2 + x * y % 3,
        (x * y % 2 + x * y % 3) % 2, ((x + y) % 2 + x * y % 3) % 2,
    )  # fmt: skip
    bits = dots ^ (conditions[mask] == 0)
    order: list[tuple[int, int]] = []
    # The column of the timing pattern belongs to no pair.
    rights = [column for column in range(size - 1, 0, -2) if column > 6] + [5, 3, 1]
    for turn, right in enumerate(rights):
        rows = range(size) if turn % 2 else range(size - 1, -1, -1)
        order += [(row, column) for row in rows for column in (right, right - 1)]
    stream = "".join(str(int(bits[at])) for at in order if not fixed[at])
    return [int(stream[at : at + 8], 2) for at in range(0, len(stream) - 7, 8)]


def _is_codeword(words: list[int], n_more: int) -> bool:
    """Say whether a block has zeros at the first powers of 2 in GF(256) modulo 0x11D."""
    root = 1
    for _ in range(n_more):
        value = 0
        for word in words:
            value = _times(value, root) ^ word
        if value:
            return False
        root = _times(root, 2)
    return True


def _times(one: int, two: int) -> int:
    """Multiply in GF(256) modulo 0x11D."""
    product_ = 0
    while two:
        if two & 1:
            product_ ^= one
        one = (one << 1) ^ (0x11D if one & 0x80 else 0)
        two >>= 1
    return product_


def _text(bits: str, version: int) -> str:
    """Return the text of one run of bytes, which may be told to be UTF-8."""
    at, ascii_only = 0, True
    if int(bits[:4], 2) == _ECI:
        if int(bits[4:12], 2) != _UTF8:
            raise ReadError("it is in an alphabet that is not read here")
        at, ascii_only = 12, False
    if int(bits[at : at + 4], 2) != _BYTES or version > 9:
        raise ReadError("it does not hold bytes")
    count, begin = int(bits[at + 4 : at + 12], 2), at + 12
    data = bytes(int(bits[k : k + 8], 2) for k in range(begin, begin + 8 * count, 8))
    try:
        return data.decode("ascii" if ascii_only else "utf-8")
    except UnicodeDecodeError as error:
        raise ReadError(f"its bytes are no text: {error}") from error


@dataclass(frozen=True, eq=False)
class CodeFiles:
    """The dots of the picture, and the drawings of the tag; None for what a job does without."""

    dots: Flags | None
    tag_dxf: Drawing | None
    tag_svg: Drawing | None


def read_code_files(
    directory: Path,
    options: dict[str, Any],
    read: Callable[[str, Callable[[Path], Any]], Any],
    tally: Tally,
) -> CodeFiles:
    """Read what the settings ask for, and tell of what they do not; older jobs ask for nothing.

    Parameters
    ----------
    directory : Path
        The job's folder.
    options : dict
        The settings of job.toml.
    read : callable
        Reads a file by its name and a reader, or tells why not.
    tally : Tally
        Where files are told that do not belong there.
    """
    asked = options.get("qr", "none")
    for name, wanted in ((CODE, asked != "none"), (TAG_FOLDER, asked == "offcut")):
        absent = not os.path.lexists(directory / name)
        tally.at(name).expect(wanted or absent, "nobody asked for it")
    dxf = svg = None
    if asked == "offcut":
        dxf = read(f"{TAG_FOLDER}/{TAG}.dxf", read_dxf)
        svg = read(f"{TAG_FOLDER}/{TAG}.svg", read_svg)
    return CodeFiles(None if asked == "none" else read(CODE, read_dots), dxf, svg)


def read_dots(path: Path) -> Flags:
    """Return the dots of a code's picture, True for dark, without its border.

    Raises
    ------
    ReadError
        If it is no picture of square dots, black on white, with a border.
    """
    data = io.BytesIO(read_content(path))
    try:
        with Image.open(data, formats=["PNG"]) as picture:
            if max(picture.size) > _MOST_SIDE:
                raise ReadError(f"it has {picture.size[0]} x {picture.size[1]} pixels")
            grey = np.asarray(picture.convert("L"))
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ReadError(f"it is not a complete PNG: {error}") from error
    dark = grey == 0
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    if not len(rows) or not np.all(dark | (grey == 255)):
        raise ReadError("it is blank, or not in black and white")
    corner = dark[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    light = np.flatnonzero(~corner[0])
    dot = int(light[0]) // _CORNER if len(light) else 0
    if not dot or corner.shape[0] != corner.shape[1] or len(corner) % dot:
        raise ReadError("it is no code")
    dots = corner[dot // 2 :: dot, dot // 2 :: dot]
    if not np.array_equal(np.kron(dots, np.ones((dot, dot), dtype=np.bool_)), corner):
        raise ReadError("its dots are no squares of one size")
    free = min(rows[0], columns[0], *(np.array(dark.shape) - 1 - (rows[-1], columns[-1])))
    if free < QUIET * dot:
        raise ReadError(f"its border is {free / dot:.1f} dots wide: less than {QUIET}")
    return dots
