"""Read triangles in 3MF, with the production extension: parts of a model in files of their own.

What the archive unpacks to is bounded before any memory is taken for it. XML is read as it comes;
documents that define entities, which can unpack without end, are refused, as the standard does.
"""

import io
import lzma
import re
import struct
import zipfile
import zlib
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar
from urllib.parse import unquote
from xml.parsers import expat

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, shown
from fabweave.mesh.io.mesh_file import MOST_PLACED, MeshFile, Placed, faults_of

#: A mesh of as many triangles as are read takes about as many bytes, unpacked.
MOST_UNPACKED = 512 * 2**20
#: The text of a mesh packs to a tenth or a twentieth; only a bomb packs so well ...
_MOST_RATIO = 200
#: ... and is worth the word from so many bytes on.
_SMALL = 16 * 2**20

#: What 3MF calls its units, and what fabweave calls them.
_UNITS = {
    "micron": "um",
    "millimeter": "mm",
    "centimeter": "cm",
    "meter": "m",
    "inch": "in",
    "foot": "ft",
}
_USUAL = "3d/3dmodel.model"
_ROOT = re.compile(r"http://schemas\.microsoft\.com/3dmanufacturing/\d+/\d+/3dmodel")
#: Extensions that are honoured, or that say nothing about where triangles are; slices do not if the
#: mesh is as fine as they are.
_HONOURED = re.compile(r".*/(production|material|trianglesets?|slice)/\d+/\d+")
#: Objects that are no part of what is to be made.
_NOT_MADE = ("support", "solidsupport", "other")

#: What unpacking raises where an archive is damaged.
_DAMAGED = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error,
    ArithmeticError, EOFError, LookupError, OSError, RuntimeError, ValueError,
)  # fmt: skip

_Unpacked = TypeVar("_Unpacked")
#: An object: the file that holds it, and its number there.
_Key = tuple[str, str]


@dataclass
class _Object:
    """One object: its points and triangles, and the objects in it, at their places."""

    name: str
    kind: str
    points: "array[float]" = field(default_factory=lambda: array("d"))
    triangles: "array[int]" = field(default_factory=lambda: array("q"))
    components: list[tuple[_Key, FloatArray]] = field(default_factory=list)


def read_3mf(data: bytes, name: str) -> MeshFile:
    """Read the bytes of a 3MF file.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    MeshFile
        Everything that is to be built, each object at its place; supports are left out.

    Raises
    ------
    InputError
        If the file cannot be understood, requires an extension that is not honoured, or unpacks to
        more than can be meant.
    """
    with faults_of(name):
        archive = _unpacked(lambda: zipfile.ZipFile(io.BytesIO(data)))
        with archive:
            _require_bounded(archive, len(data))
            return _Package(archive).read()


def has_model(data: bytes) -> bool:
    """Tell whether an archive looks like a 3MF file."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return any(entry.lower().endswith(".model") for entry in archive.namelist())
    except _DAMAGED:
        return False


def _unpacked(unpack: Callable[[], _Unpacked]) -> _Unpacked:
    """Return what is unpacked, or say that it is damaged."""
    try:
        return unpack()
    except _DAMAGED as error:
        told = shown(str(error))
        raise InputError(f"this archive cannot be unpacked ({told}); export it again") from error


def _require_bounded(archive: zipfile.ZipFile, size: int) -> None:
    """Raise InputError for an archive that would unpack to more than its share."""
    unpacked = sum(entry.file_size for entry in archive.infolist())
    ratio = unpacked / size
    if unpacked > MOST_UNPACKED or (unpacked > _SMALL and ratio > _MOST_RATIO):
        raise InputError(
            f"its {size:,} bytes would unpack to {unpacked:,}, {ratio:.0f} times as many; at most "
            f"{MOST_UNPACKED:,} are unpacked, and {_MOST_RATIO} times as many. Export the mesh "
            "again, coarser, or as OBJ"
        )


class _Package:
    """Reads the files of an archive, and places what is to be built."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        # Names of parts are the same in lower and upper case.
        self._entries = {_plain(entry.filename): entry for entry in archive.infolist()}
        self._models: dict[str, _Model] = {}
        self._n_objects = 0

    def read(self) -> MeshFile:
        """Return all that is to be built."""
        root = self._root()
        model = self._model(root)
        if model.unit not in _UNITS:
            units = ", ".join(_UNITS)
            raise InputError(f"it states the unit {shown(model.unit)}; 3MF has {units}")
        notes = []
        items = model.items
        if not items and model.objects:
            held = {key for one in model.objects.values() for key, _ in one.components}
            own = [(_plain(root), number) for number in model.objects]
            whole = [key for key in own if key not in held]
            items = [(key, np.eye(4)) for key in whole]
            notes.append("the file says of no object that it is to be built, and all were read")
        placed = Placed()
        left_out: dict[str, int] = {}
        stack = [(key, matrix, 0) for key, matrix in reversed(items)]
        for _ in range(MOST_PLACED):
            if not stack:
                break
            key, matrix, depth = stack.pop()
            part = self._object(key)
            if part.kind in _NOT_MADE:
                left_out[part.kind] = left_out.get(part.kind, 0) + 1
                continue
            if depth > self._n_objects:
                raise InputError(f"object {key[1]} is a component of itself; export it again")
            if part.triangles:
                points = np.array(part.points).reshape(-1, 3)
                placed.add(part.name, points, np.array(part.triangles).reshape(-1, 3), matrix.T)
            # In 3MF, points are rows: a component's own matrix comes first.
            stack += [(k, own @ matrix, depth + 1) for k, own in reversed(part.components)]
        if stack:
            raise InputError(
                f"its objects are placed more than {MOST_PLACED:,} times; export one coarser mesh"
            )
        notes += [
            agree(count, "{n} [object|objects] of type ")
            + f"{kind!r} {agree(count, '[was|were]')} left out"
            for kind, count in sorted(left_out.items())
        ]
        return MeshFile(
            placed.mesh(), "3mf", _UNITS[model.unit], tuple(notes), None, placed.objects
        )

    def _root(self) -> str:
        """Return the name of the file where reading begins, by the relations of the archive."""
        found: list[str] = []

        def start(tag: str, values: dict[str, str]) -> None:
            if tag.endswith("Relationship") and _ROOT.fullmatch(values.get("Type", "")):
                found.append(values.get("Target", ""))

        if "_rels/.rels" in self._entries:
            _parse(self._bytes("_rels/.rels"), start)
        models = found or [entry for entry in self._entries if entry.endswith(".model")]
        if not models:
            raise InputError("this archive holds no 3D model; export it again, or as OBJ")
        # Where no relation says so, it is called as most programs call it.
        return _USUAL if not found and _USUAL in models else models[0]

    def _model(self, path: str) -> "_Model":
        """Return a model of the archive, read once."""
        if _plain(path) not in self._models:
            model = self._models[_plain(path)] = _Model(path, self._bytes(path))
            self._n_objects += len(model.objects)
        return self._models[_plain(path)]

    def _object(self, key: _Key) -> _Object:
        path, number = key
        model = self._model(path)
        first = next(iter(self._models.values()))
        if model.unit != first.unit:
            raise InputError(
                f"{shown(path)} is in the unit {shown(model.unit)}, but the file in {first.unit}; "
                "export it again"
            )
        if number not in model.objects:
            raise InputError(f"it places object {shown(number)} of {shown(path)}, which is absent")
        return model.objects[number]

    def _bytes(self, path: str) -> bytes:
        found = [self._entries.get(_plain(name)) for name in (path, unquote(path))]
        entry = found[0] or found[1]
        if entry is None:
            raise InputError(f"it names the part {shown(path)}, which is absent; export it again")
        return _unpacked(lambda: self._archive.read(entry))


def _plain(name: str) -> str:
    """Return the name of a part as it is compared with others."""
    return name.replace("\\", "/").lstrip("/").lower()


def _parse(data: bytes, start: Any, prefix: Any = None) -> None:
    """Read XML: call what is to be called where elements and namespaces start."""

    def refuse(*_: Any) -> None:
        raise InputError("its XML defines entities, which 3MF forbids; export it again")

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = start
    parser.StartNamespaceDeclHandler = prefix
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InputError(f"its XML is damaged: {error}; export it again") from error
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"line {parser.CurrentLineNumber} of its XML: {error}") from error
    except (LookupError, OverflowError) as error:
        raise InputError(f"line {parser.CurrentLineNumber} of its XML lacks {error}") from error


class _Model:
    """One model of an archive: its unit, its objects by number, and what is to be built."""

    def __init__(self, path: str, data: bytes) -> None:
        self.unit = "millimeter"
        self.objects: dict[str, _Object] = {}
        self.items: list[tuple[_Key, FloatArray]] = []
        self._prefixes: dict[str | None, str] = {}
        self._path = path
        self._object = _Object("", "")
        # Other namespaces have names in common with the core: that of the outermost element.
        self._takes: dict[str, Callable[[dict[str, str]], None]] = {}
        _parse(data, self._start, self._prefix)

    def _prefix(self, prefix: str | None, uri: str) -> None:
        self._prefixes[prefix] = uri or ""

    def _start(self, tag: str, values: dict[str, str]) -> None:
        """Take what an element says."""
        if tag in self._takes:
            self._takes[tag](values)
        elif not self._takes:
            self._begin(tag, values)
        elif tag.endswith(" beamlattice"):
            raise _refused("beamlattice")

    def _begin(self, tag: str, values: dict[str, str]) -> None:
        """Take what the outermost element says."""
        kind = tag.rpartition(" ")[2]
        if kind != "model":
            raise InputError(f"{shown(self._path)} is no 3MF model; it begins with {shown(kind)}")
        self.unit = values.get("unit", "millimeter").strip().lower()
        for prefix in values.get("requiredextensions", "").split():
            uri = self._prefixes.get(prefix, prefix)
            if not _HONOURED.fullmatch(uri):
                raise _refused(uri)
        core = tag.removesuffix(kind)
        self._takes = {
            f"{core}vertex": self._vertex,
            f"{core}triangle": self._triangle,
            f"{core}object": self._begin_object,
            f"{core}component": lambda one: self._object.components.append(self._place(one)),
            f"{core}item": lambda one: self.items.append(self._place(one)),
        }

    def _vertex(self, values: dict[str, str]) -> None:
        self._object.points.extend((float(values["x"]), float(values["y"]), float(values["z"])))

    def _triangle(self, values: dict[str, str]) -> None:
        self._object.triangles.extend((int(values["v1"]), int(values["v2"]), int(values["v3"])))

    def _begin_object(self, values: dict[str, str]) -> None:
        if "lowres" in (value for key, value in values.items() if key.endswith(" meshresolution")):
            raise _refused("slice")
        name = values.get("name") or values.get("partnumber", "")
        self._object = _Object(name, values.get("type", "model"))
        self.objects[values["id"]] = self._object

    def _place(self, values: dict[str, str]) -> tuple[_Key, FloatArray]:
        """Return the object that is placed, and its matrix for rows."""
        path = next((value for key, value in values.items() if key.endswith(" path")), self._path)
        numbers = [float(word) for word in values.get("transform", "").split()]
        if len(numbers) not in (0, 12):
            raise ValueError(f"a transform has {len(numbers)} numbers, not 12")
        matrix = np.eye(4)
        if numbers:
            matrix[:, :3] = np.array(numbers).reshape(4, 3)
        return (_plain(path), values["objectid"]), matrix


def _refused(uri: str) -> InputError:
    """Say what cannot be read of a file, by the name of the extension that it needs."""
    name = next((word for word in reversed(uri.split("/")) if not word.isdigit()), uri)
    return InputError(
        f"it requires the 3MF extension {shown(name)}, which fabweave does not know; export a "
        "plain mesh, or as OBJ"
    )
