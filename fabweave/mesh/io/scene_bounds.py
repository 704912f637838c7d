"""Bound what scene files unpack to, before any memory is taken for it.

A few kilobytes of a 3MF archive can stand for gigabytes, and a few lines of 3MF or glTF that place
one object over and over for billions of triangles.
"""

import io
import json
import re
import zipfile
from collections import defaultdict
from collections.abc import Iterable
from typing import Any
from xml.parsers import expat

from fabweave.core.errors import InputError
from fabweave.core.files import read_input

#: Meshes of many more triangles than can be woven, even after a remeshing.
MOST_TRIANGLES = 10_000_000
#: Such a mesh takes about as many bytes in 3MF, unpacked.
MOST_UNPACKED = 512 * 2**20
#: The text of a mesh packs to a tenth or a twentieth; only a bomb packs so well ...
MOST_RATIO = 200
#: ... and is worth the word from so many bytes on.
_SMALL = 16 * 2**20
_MOST_ENTRIES = 10_000
#: Objects that are placed, in all; each becomes a part of its own.
_MOST_PLACED = 100_000
#: Bytes that the arrays of a glTF file come to.
_MOST_ARRAYS = 512 * 2**20
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_EXTERNAL = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


def bounded_archive(data: bytes, name: str) -> bytes:
    """Return an archive of the models alone, not packed, that a 3MF archive holds.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Raises
    ------
    InputError
        If it unpacks to more than its share, is broken, or places too many objects. What it says
        of its sizes is checked, and nothing beyond that is unpacked.
    """
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except (zipfile.BadZipFile, ValueError, OverflowError, NotImplementedError) as error:
        raise InputError(
            f"{name}: this is not a 3MF file, which is a ZIP archive ({error}); export it again"
        ) from error
    with archive:
        entries = archive.infolist()
        unpacked = sum(entry.file_size for entry in entries)
        if len(entries) > _MOST_ENTRIES:
            raise InputError(
                f"{name}: the archive has {len(entries)} entries, and at most {_MOST_ENTRIES} are "
                "unpacked; export the mesh alone"
            )
        ratio = unpacked / max(len(data), 1)
        if unpacked > MOST_UNPACKED or (unpacked > _SMALL and ratio > MOST_RATIO):
            raise InputError(
                f"{name}: its {len(data):,} bytes would unpack to {unpacked:,}, {ratio:.0f} times "
                f"as many; at most {MOST_UNPACKED:,} are unpacked, and {MOST_RATIO} times as many. "
                "Export the mesh again, coarser, or as OBJ"
            )
        for entry in entries:
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise InputError(
                    f"{name}: {entry.filename[:60]!r} is packed in a way that 3MF does not have "
                    "(only stored or deflated); export it again"
                )
        models = _unpacked_models(archive, name)
    _check_models(models.values(), name)
    plain = io.BytesIO()
    with zipfile.ZipFile(plain, "w", zipfile.ZIP_STORED) as copy:
        for number, (path, model) in enumerate(models.items()):
            copy.writestr(path or str(number), model)
    return plain.getvalue()


def _unpacked_models(archive: zipfile.ZipFile, name: str) -> dict[str, bytes]:
    """Return the models of an archive, each of the size that is stated."""
    models = {}
    for entry in archive.infolist():
        if not entry.filename.lower().endswith(".model"):
            continue
        try:
            with archive.open(entry) as file:
                # Asked for all, Python unpacks what there is, whatever size is stated.
                model = file.read(entry.file_size + 1)
        except Exception as error:  # a broken archive fails in many ways
            raise InputError(
                f"{name}: {entry.filename[:60]!r} in it cannot be unpacked ({error}); export it "
                "again"
            ) from error
        if _EXTERNAL.search(model, 0, 1 << 16):
            raise InputError(f"{name}: its XML defines entities of its own; export it again")
        models[entry.filename] = model
    return models


def _check_models(models: Iterable[bytes], name: str) -> None:
    """Raise InputError if the objects of a 3MF file, each as often as placed, are too many."""
    parts: dict[str, list[str]] = defaultdict(list)
    triangles: dict[str, int] = defaultdict(int)
    for model in models:
        if b"component" in model:
            _list_parts(model, name, parts, triangles)
    placed, count = _unfolded("world", parts, triangles, name)
    _require_few(placed, count, name)


def _list_parts(
    model: bytes, name: str, parts: dict[str, list[str]], triangles: dict[str, int]
) -> None:
    """List which objects each object of a model places, and how many triangles it has."""
    at = "world"

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal at
        kind = tag.rpartition(":")[2]
        if kind == "object":
            at = attributes.get("id", "")
        elif kind == "build":
            at = "world"
        elif kind in ("component", "item"):
            parts[at].append(attributes.get("objectid", ""))
        elif kind == "triangle":
            triangles[at] += 1

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    try:
        parser.Parse(model, True)
    except expat.ExpatError as error:
        raise InputError(f"{name}: its XML is broken ({error}); export it again") from error


def _unfolded(
    root: str, parts: dict[str, list[str]], triangles: dict[str, int], name: str
) -> tuple[int, int]:
    """Return how many objects are placed below one, and how many triangles that makes."""
    known: dict[str, tuple[int, int]] = {}
    open_: set[str] = set()
    stack = [root]
    while stack:
        at = stack[-1]
        below = parts.get(at, [])
        waiting = [part for part in dict.fromkeys(below) if part not in known]
        if at not in known and at not in open_ and waiting:
            if open_.intersection(waiting):
                raise InputError(f"{name}: an object in it is part of itself; export it again")
            open_.add(at)
            stack += waiting
            continue
        if at not in known:
            if waiting:
                raise InputError(f"{name}: an object in it is part of itself; export it again")
            known[at] = (
                1 + sum(known[part][0] for part in below),
                triangles.get(at, 0) + sum(known[part][1] for part in below),
            )
        open_.discard(at)
        stack.pop()
    return known[root]


def _require_few(placed: int, triangles: int, name: str) -> None:
    """Raise InputError for more objects or triangles than are read."""
    if placed > _MOST_PLACED or triangles > MOST_TRIANGLES:
        raise InputError(
            f"{name}: its objects, each as often as it is placed, come to {_told(placed)} objects "
            f"with {_told(triangles)} triangles; at most {_MOST_PLACED:,} and {MOST_TRIANGLES:,} "
            "are read. Export one coarser mesh"
        )


def _told(count: int) -> str:
    return f"{count:,}" if count < 10**12 else "more than 10^12"


def check_triangles(count: int, placed: int, name: str) -> None:
    """Raise InputError for more triangles, or more placed parts, than are read."""
    _require_few(placed, count, name)


def check_gltf(document: Any, name: str) -> None:
    """Raise InputError for a glTF document whose arrays, or meshes, come to more than is read."""
    accessors = _tables(document, "accessors")
    sizes = [
        _whole(one.get("count")) * _COMPONENTS.get(str(one.get("type")), 16) * 4
        for one in accessors
    ]
    corners = [0]
    for mesh in _tables(document, "meshes"):
        for primitive in _tables(mesh, "primitives"):
            attributes = primitive.get("attributes")
            position = attributes.get("POSITION") if isinstance(attributes, dict) else None
            for at in (primitive.get("indices"), position):
                if isinstance(at, int) and 0 <= at < len(accessors):
                    corners.append(_whole(accessors[at].get("count")))
    if sum(sizes) > _MOST_ARRAYS or sum(corners) > 6 * MOST_TRIANGLES:
        raise InputError(
            f"{name}: its arrays come to {_told(sum(sizes))} bytes, its meshes to "
            f"{_told(sum(corners))} numbers of vertices and corners; at most {_MOST_ARRAYS:,} and "
            f"{6 * MOST_TRIANGLES:,} are read. Export a coarser mesh"
        )


def _tables(holder: Any, key: str) -> list[dict[str, Any]]:
    """Return those entries of a list that are tables; broken ones are left to the reader."""
    entries = holder.get(key) if isinstance(holder, dict) else None
    return [e if isinstance(e, dict) else {} for e in entries] if isinstance(entries, list) else []


def _whole(value: Any) -> int:
    return value if isinstance(value, int) and value > 0 else 0


def gltf_document(data: bytes, kind: str) -> Any:
    """Return the JSON of a glTF file, text or binary.

    Raises
    ------
    ValueError, RecursionError
        If there is none.
    """
    if kind == "glb":
        length = int.from_bytes(data[12:16], "little")
        if data[:4] != b"glTF" or data[16:20] != b"JSON" or 20 + length > len(data):
            raise ValueError("it does not begin as a GLB file of version 2")
        data = data[20 : 20 + length]
    document = json.loads(data)
    if not isinstance(document, dict):
        raise ValueError("its JSON is not an object")  # noqa: TRY004 -- as all else that is wrong
    return document


def bounded_files(folder_of: str, most_bytes: int) -> Any:
    """Return what finds the files that a glTF file names beside it: ordinary, bounded ones."""
    from pathlib import Path  # noqa: PLC0415

    import trimesh  # noqa: PLC0415 -- it takes long to import

    class Beside(trimesh.resolvers.FilePathResolver):
        def get(self, name: str) -> bytes:
            path = Path(self.parent, name)
            if not path.resolve().is_relative_to(Path(self.parent).resolve()):
                raise InputError(f"it names {name[:60]!r}, which is not beside it")
            return read_input(path, "a part of the mesh", most_bytes)

    return Beside(folder_of)
