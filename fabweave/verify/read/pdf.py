"""Read the texts of a PDF: the lines that are written on its pages, in the order of the file."""

import base64
import re
import zlib
from pathlib import Path

from fabweave.verify.drawing import ReadError

_STREAM = re.compile(rb">>\s*stream\r?\n")
_IMAGE = re.compile(rb"/Subtype\s*/Image")
_SHOWN = re.compile(rb"\(((?:[^()\\]|\\.)*)\)\s*Tj", re.DOTALL)
_ESCAPED = re.compile(rb"\\([0-7]{1,3}|.)", re.DOTALL)
_SIGNS = {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"b": b"\b", b"f": b"\f"}


def read_texts(path: Path) -> tuple[str, ...]:
    """Return every line of text of a PDF whose fonts have the Latin alphabet of Windows.

    Raises
    ------
    ReadError
        If it is no complete PDF, a stream cannot be unpacked, or there is no text.
    """
    texts: list[str] = []
    for content in read_contents(path)[1]:
        texts += [_plain(shown[1]) for shown in _SHOWN.finditer(content)]
    if not texts:
        raise ReadError("it has no text")
    return tuple(texts)


def read_contents(path: Path) -> tuple[bytes, tuple[bytes, ...]]:
    """Return a PDF as it is in the file, and what its pages and forms draw, unpacked.

    Raises
    ------
    ReadError
        If it is no complete PDF, or a stream cannot be unpacked.
    """
    data = path.read_bytes()
    if not data.startswith(b"%PDF-") or not data.rstrip().endswith(b"%%EOF"):
        raise ReadError("it is not a complete PDF")
    contents, at = [], 0
    # From stream to stream: what is packed may look like anything, and is passed over.
    while (match := _STREAM.search(data, at)) is not None:
        description = data[max(data.rfind(b"obj", at, match.start()), at) : match.start()]
        end = data.find(b"endstream", match.end())
        at = end if end >= 0 else len(data)
        if not _IMAGE.search(description):
            contents.append(_unpacked(description, data[match.end() : at]))
    return data, tuple(contents)


def _unpacked(description: bytes, content: bytes) -> bytes:
    """Undo the packing that a stream's description names."""
    try:
        if b"/ASCII85Decode" in description:
            content = base64.a85decode(content.strip().removesuffix(b"~>"))
        if b"/FlateDecode" in description:
            content = zlib.decompress(content)
    except (ValueError, zlib.error) as error:
        raise ReadError(f"a page cannot be unpacked: {error}") from error
    return content


def _plain(shown: bytes) -> str:
    """Return a text without escapes."""

    def sign(match: re.Match[bytes]) -> bytes:
        name = match[1]
        return bytes([int(name, 8) % 256]) if name.isdigit() else _SIGNS.get(name, name)

    return _ESCAPED.sub(sign, shown).decode("cp1252", "replace")
