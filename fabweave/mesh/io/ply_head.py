"""Read the header of a PLY file."""

import re
from dataclasses import dataclass

from fabweave.core.errors import InputError

#: Byte-order mark of numpy for each binary format.
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
_END = re.compile(rb"^[ \t]*end_header[ \t]*(\r\n|\n|\r|\Z)", re.MULTILINE)
_END_OLD_MAC = re.compile(rb"\r[ \t]*end_header[ \t]*\r")

#: Scanners write some twenty properties; time grows with the square of their number.
_MOST_NAMED = 1000


@dataclass(frozen=True)
class Property:
    """One property: its name, numpy type code, and for a list the type code of its count."""

    name: str
    kind: str
    count: str | None = None


@dataclass(frozen=True)
class Element:
    """One element: its name, how many there are, and their properties in order."""

    name: str
    number: int
    properties: tuple[Property, ...]


@dataclass(frozen=True)
class Head:
    """The header: byte order (None for text), elements in order, its bytes and lines."""

    order: str | None
    elements: tuple[Element, ...]
    size: int
    lines: int


def read_head(data: bytes, name: str) -> Head:
    r"""Read the header of a PLY file.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    Head
        What the body holds and where it starts.

    Raises
    ------
    InputError
        If a line of the header cannot be understood; the message names it.

    Examples
    --------
    >>> head = read_head(b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
    ...                  b"end_header\n", "a.ply")
    >>> head.order, head.elements[0].number, head.lines
    (None, 2, 5)
    """
    if data[:3] != b"ply" or data[3:4] not in (b"\n", b"\r", b" ", b"\t"):
        raise InputError(f"{name}, line 1: expected the word ply here")
    end = _END_OLD_MAC.search(data) if b"\n" not in data[:4] + data[4:5] else None
    end = end or _END.search(data)
    if end is None:
        raise InputError(f"{name}: the header has no line end_header")
    text = data[: end.start()].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.rstrip("\n").split("\n")
    order: str | None = None
    known = False
    elements: list[Element] = []
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order, known = _order(words), True
            elif words[0] == "element":
                elements.append(_element(words))
            elif words[0] == "property" and elements:
                last = elements[-1]
                elements[-1] = Element(last.name, last.number, (*last.properties, _property(words)))
            else:
                raise ValueError("this line is not a format, an element, a property or a comment")  # noqa: TRY301 -- one place adds the line number
            _require_few(elements)
        except ValueError as error:
            raise InputError(f"{name}, line {number}: {line[:60]!r}: {error}") from None
    if not known:
        raise InputError(f"{name}: the header has no line that begins with format")
    return Head(order, tuple(elements), end.end(), len(lines) + 1)


def _require_few(elements: list[Element]) -> None:
    """Raise ValueError for more elements, or properties of one, than any mesh has."""
    if len(elements) > _MOST_NAMED or (elements and len(elements[-1].properties) > _MOST_NAMED):
        raise ValueError(
            f"there are more than {_MOST_NAMED} elements, or properties of an element; export "
            "positions and faces only"
        )


def _order(words: list[str]) -> str | None:
    kind = words[1] if len(words) > 1 else ""
    if kind == "ascii":
        return None
    if kind not in ORDERS:
        raise ValueError(f"the format must be ascii, {' or '.join(ORDERS)}")
    return ORDERS[kind]


def _element(words: list[str]) -> Element:
    if len(words) != 3 or not (words[2].isascii() and words[2].isdigit() and len(words[2]) < 19):
        raise ValueError("an element needs a name and a number")
    return Element(words[1], int(words[2]), ())


def _property(words: list[str]) -> Property:
    is_list = words[1:2] == ["list"]
    kinds = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3):
        raise ValueError(
            "a property needs a type and a name, or the word list, two types and a name"
        )
    unknown = [kind for kind in kinds if kind not in _TYPES]
    if unknown:
        raise ValueError(f"unknown type {unknown[0]!r}; the types are {', '.join(_TYPES)}")
    codes = [_TYPES[kind] for kind in kinds]
    if not is_list:
        return Property(words[-1], codes[0])
    if codes[0][0] == "f":
        raise ValueError("the length of a list must be a whole number")
    return Property(words[-1], codes[1], codes[0])
