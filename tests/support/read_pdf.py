"""Read a PDF as strictly as it is written: its pages in order, and what each draws.

Programs forgive much in a PDF, each something else; what is not as our own files are is refused.
"""

import base64
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_content

#: No page of ours unpacks to more.
_LARGEST = 1 << 28

_HEADER = re.compile(rb"%PDF-1\.[34]\r?\n(?:%[^\r\n]*\r?\n)*")
_OBJECT = re.compile(rb"(\d+) 0 obj\s")
_STRING = rb"\((?:[^()\\]|\\.)*\)"
_PART = re.compile(_STRING + rb"|\bstream\r?\n|\bendobj\s*", re.DOTALL)
_END = re.compile(rb"\s*endstream\s+endobj\s*")
_NAME = re.compile(rb"/([^\s/<>\[\]()]*)")
_TABLE = re.compile(rb"xref\s+0 (\d+)\s+0000000000 65535 f\s+((?:\d{10} 00000 n\s+)*)trailer\s")
_TAIL = re.compile(rb"startxref\s+(\d+)\s+%%EOF\s*")
_REFERENCE = re.compile(rb"(\d+) 0 R")
#: What our files need; whatever else a program would obey is refused.
_NAMES = frozenset(
    b"Type Font Filter ASCII85Decode FlateDecode Length Resources ProcSet PDF Text ImageB ImageC "
    b"ImageI XObject Contents MediaBox Parent Rotate Trans Page Subtype Pages BaseFont Helvetica "
    b"Helvetica-Bold Helvetica-Oblique Helvetica-BoldOblique Encoding WinAnsiEncoding Name Type1 "
    b"BBox FormType Matrix Form PageMode UseNone UseOutlines Catalog Author CreationDate Creator "
    b"Keywords ModDate Producer Subject Title Trapped False Count Kids ID Info Root Size "
    b"BitsPerComponent ColorSpace Height Image Width DeviceGray DeviceRGB Indexed Dest Fit Next "
    b"Prev First Last Outlines".split()
)
_OWN_NAME = re.compile(rb"F\d+|FormXob\.[\w.]+")
_UNMOVED = re.compile(rb"/Matrix \[ 1 0 0 1 0 0 \]")


@dataclass(frozen=True)
class Stream:
    """A page, a form or a picture: its size in points, and what it draws; a picture has none."""

    width: float
    height: float
    content: bytes
    #: The forms and pictures that it may draw, by name.
    parts: dict[bytes, "Stream"]


def read_pages(path: Path) -> list[Stream]:
    """Return the pages of a PDF in the order in which programs show them.

    Raises
    ------
    ReadError
        If it is no complete PDF as ours are.
    """
    objects, root = _objects(read_content(path))
    catalog = _object(objects, root)
    tree = _object(objects, _one(rb"/Pages (\d+) 0 R", catalog, "a catalog"))
    kids = re.search(rb"/Kids\s*\[([^\]]*)\]", tree[0])
    numbers = [] if kids is None else [int(n) for n in _REFERENCE.findall(kids[1])]
    typed = [number for number, (text, _) in objects.items() if _is(text, b"Page")]
    if not numbers or sorted(numbers) != sorted(typed):
        raise ReadError(f"it has {len(typed)} pages, and {len(numbers)} are in its list of pages")
    if _one(rb"/Count (\d+)", tree, "a list of pages") != len(numbers):
        raise ReadError("its list of pages states another number of them")
    return [_page(objects, number) for number in numbers]


_Object = tuple[bytes, bytes]


def _objects(data: bytes) -> tuple[dict[int, _Object], int]:
    """Split a file into its objects, each a description and a stream; and name its root."""
    header = _HEADER.match(data)
    if header is None:
        raise ReadError("it is not a PDF")
    objects: dict[int, _Object] = {}
    places: dict[int, int] = {}
    at = header.end()
    while (match := _OBJECT.match(data, at)) is not None:
        number = int(match[1])
        if number in objects:
            raise ReadError(f"object {number} is there twice")
        places[number] = at
        text, stream, at = _body(data, match.end())
        _require_known(text)
        objects[number] = text, stream
    table = _TABLE.match(data, at)
    if table is None:
        raise ReadError("it is not complete: there is no table of its objects after them")
    listed = [int(word) for word in table[2].split()[::3]]
    if dict(enumerate(listed, start=1)) != places or int(table[1]) != len(listed) + 1:
        raise ReadError("the table of its objects does not say where they are")
    end = data.find(b"startxref", table.end())
    tail = _TAIL.fullmatch(data, end) if end >= 0 else None
    if tail is None or int(tail[1]) != at:
        raise ReadError("it is not complete, or something comes after its end")
    trailer = data[table.end() : end]
    _require_known(trailer)
    return objects, _one(rb"/Root (\d+) 0 R", (trailer, b""), "a trailer")


def _body(data: bytes, at: int) -> tuple[bytes, bytes, int]:
    """Return the description and the stream of an object, and where the next one begins."""
    for part in _PART.finditer(data, at):
        text = data[at : part.start()]
        if part[0].startswith(b"endobj"):
            return text, b"", part.end()
        if part[0].startswith(b"stream"):
            start = part.end()
            stop = start + _one(rb"/Length (\d+)", (text, b""), "a stream")
            end = _END.match(data, stop)
            if end is None:
                raise ReadError("a stream has another length than it states")
            return text, data[start:stop], end.end()
    raise ReadError("it is not complete: an object has no end")


def _require_known(text: bytes) -> None:
    """Refuse a description that names anything that our files do not need."""
    bare = re.sub(_STRING, b"()", text, flags=re.DOTALL)
    for name in _NAME.findall(bare):
        if name not in _NAMES and _OWN_NAME.fullmatch(name) is None:
            raise ReadError(f"it has /{name.decode('latin-1')}, which our files do not need")


def _is(text: bytes, kind: bytes) -> bool:
    return re.search(rb"/Type\s*/" + kind + rb"\b", text) is not None


def _object(objects: dict[int, _Object], number: int) -> _Object:
    if number not in objects:
        raise ReadError(f"object {number} is not there")
    return objects[number]


def _one(pattern: bytes, thing: _Object, what: str) -> int:
    """Return the one number that a description has in some place."""
    found = re.findall(pattern, thing[0])
    if len(found) != 1:
        raise ReadError(f"{what} has {len(found)} of what it needs one of: {pattern.decode()}")
    return int(found[0])


def _page(objects: dict[int, _Object], number: int) -> Stream:
    """Read a page, and the forms and pictures that it may draw."""
    page = _object(objects, number)
    if re.findall(rb"/Rotate (\S+)", page[0]) not in ([], [b"0"]):
        raise ReadError("a page is turned")
    parts = {}
    for name, reference in re.findall(rb"/(FormXob\.[\w.]+) (\d+) 0 R", page[0]):
        part = _object(objects, int(reference))
        if re.search(rb"/Subtype\s*/Image", part[0]):
            parts[name] = Stream(0.0, 0.0, b"", {})
            continue
        if not _UNMOVED.search(part[0]):
            raise ReadError("a form is moved or scaled")
        parts[name] = Stream(*_size(part[0], b"BBox"), _unpacked(part), {})
    content = _object(objects, _one(rb"/Contents (\d+) 0 R", page, "a page"))
    return Stream(*_size(page[0], b"MediaBox"), _unpacked(content), parts)


def _size(text: bytes, name: bytes) -> tuple[float, float]:
    """Return the size of a box that begins at the origin."""
    boxes = re.findall(rb"/" + name + rb"\s*\[([^\]]*)\]", text)
    try:
        box = [float(word) for word in boxes[0].split()] if len(boxes) == 1 else []
    except ValueError:
        box = []
    if len(box) != 4 or box[:2] != [0.0, 0.0] or not (0.0 < box[2] < 1e6 and 0.0 < box[3] < 1e6):
        raise ReadError(f"a page or a form has no {name.decode()} from 0 0, or several")
    return box[2], box[3]


def _unpacked(thing: _Object) -> bytes:
    """Undo the packing that a stream's description names."""
    text, content = thing
    try:
        if b"/ASCII85Decode" in text:
            content = base64.a85decode(content.strip().removesuffix(b"~>"))
        if b"/FlateDecode" in text:
            unpacker = zlib.decompressobj()
            content = unpacker.decompress(content, _LARGEST)
            if unpacker.unconsumed_tail or not unpacker.eof:
                raise ReadError("a page unpacks to more than any page has, or is cut short")
    except (ValueError, zlib.error) as error:
        raise ReadError(f"a page cannot be unpacked: {error}") from error
    return content


#: What draws our pages; others (such as Tr, gs, sh, BI and marked content) may hide what is drawn.
_OPERATORS = frozenset(
    b"n m l c h re W* S B B* f f* q Q cm w d j J g G rg RG BT ET Tf TL Tm Tj T* Do".split()
)
_WORD = re.compile(_STRING + rb"|[^\s()]+", re.DOTALL)
_VALUE = re.compile(rb"[-+.\d]+|/\S+|\(.*\)|\[[-+.\d]*|[-+.\d]*\]|\[\]", re.DOTALL)


def steps_of(content: bytes) -> list[tuple[bytes, list[bytes]]]:
    """Return the operators of a page or form in order, each with its values.

    Raises
    ------
    ReadError
        If there is one that our files do not need.
    """
    steps: list[tuple[bytes, list[bytes]]] = []
    values: list[bytes] = []
    for match in _WORD.finditer(content):
        word = match[0]
        if _VALUE.fullmatch(word):
            values.append(word)
        elif word in _OPERATORS:
            steps.append((word, values))
            values = []
        else:
            raise ReadError(f"a page has the operator {word[:20].decode('latin-1')!r}")
    return steps
