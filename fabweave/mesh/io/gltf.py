"""Read triangles in glTF 2.0, text or binary.

Geometry is read as the specification has it: strided, sparse and normalised accessors, triangles,
strips and fans, nodes, skins at rest, the weights of morph targets, instances. What a file requires
beyond is refused by name: a reader that passed it over would make another object.
"""

import base64
import binascii
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar
from urllib.parse import unquote, unquote_to_bytes

import msgspec
import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input
from fabweave.core.messages import agree
from fabweave.core.records import from_json
from fabweave.mesh.io.mesh_file import MOST_PLACED, MOST_TRIANGLES, MeshFile, Placed, faults_of

_Item = TypeVar("_Item")
_Array = npt.NDArray[Any]
#: A number of a thing in a list, or a count of bytes or rows.
_Number = Annotated[int, msgspec.Meta(ge=0, le=2**53)]

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
#: Numbers that are read, in all: a small file could have the same ones read very often ...
_MOST_NUMBERS = 9 * MOST_TRIANGLES
#: ... or state any number of rows without data.
_MOST_ZEROS = 1_000_000

_DRACO, _MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"
_COMPRESSIONS = {_DRACO: "Draco", _MESHOPT: "meshopt", "KHR_meshopt_compression": "meshopt"}
_INSTANCES = "EXT_mesh_gpu_instancing"
#: Extensions that are honoured, or that say nothing about where triangles are.
_HONOURED = re.compile(
    rf"{_INSTANCES}|KHR_mesh_quantization"
    r"|(KHR|EXT|MSFT|ADOBE|NV)_(texture|materials?|lights?|image|xmp|animation|physics|audio)_?\w*"
    r"|KHR_techniques_webgl|KHR_node_(hover|select)ability|KHR_interactivity"
    r"|EXT_(mesh_features|structural_metadata|instance_features|mesh_manifold)|AGI_articulations"
)


class _Struct(msgspec.Struct, rename="camel"):
    """A part of the document; keys that are not known are passed over."""


class _Asset(_Struct):
    version: str = "2.0"
    extras: Any = None


class _Head(_Struct):
    asset: _Asset = msgspec.field(default_factory=_Asset)


class _Scene(_Struct):
    nodes: list[_Number] = []


class _Instances(_Struct):
    attributes: dict[str, _Number] = {}


class _NodeExtensions(_Struct):
    instances: _Instances | None = msgspec.field(default=None, name=_INSTANCES)


class _Node(_Struct):
    name: str = ""
    children: list[_Number] = []
    mesh: _Number | None = None
    skin: _Number | None = None
    matrix: Annotated[list[float], msgspec.Meta(min_length=16, max_length=16)] | None = None
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    weights: list[float] | None = None
    extensions: _NodeExtensions = msgspec.field(default_factory=_NodeExtensions)


class _Primitive(_Struct):
    attributes: dict[str, _Number] = {}
    indices: _Number | None = None
    mode: int = _TRIANGLES
    targets: list[dict[str, _Number]] = []
    extensions: dict[str, msgspec.Raw] = {}


class _Mesh(_Struct):
    primitives: list[_Primitive] = []
    weights: list[float] = []
    name: str = ""


class _Skin(_Struct):
    joints: list[_Number] = []
    inverse_bind_matrices: _Number | None = None


class _Sparse(_Struct):
    class Rows(_Struct):
        buffer_view: _Number
        byte_offset: _Number = 0
        component_type: int = 0

    count: _Number
    indices: Rows
    values: Rows


class _Accessor(_Struct):
    component_type: int
    count: _Number
    type: str
    buffer_view: _Number | None = None
    byte_offset: _Number = 0
    normalized: bool = False
    sparse: _Sparse | None = None


class _View(_Struct):
    buffer: _Number
    byte_length: _Number
    byte_offset: _Number = 0
    byte_stride: _Number = 0
    extensions: dict[str, msgspec.Raw] = {}


class _Buffer(_Struct):
    uri: str | None = None


class _Document(_Struct):
    asset: _Asset = msgspec.field(default_factory=_Asset)
    scene: _Number | None = None
    scenes: list[_Scene] = []
    nodes: list[_Node] = []
    meshes: list[_Mesh] = []
    skins: list[_Skin] = []
    accessors: list[_Accessor] = []
    buffer_views: list[_View] = []
    buffers: list[_Buffer] = []
    extensions_required: list[str] = []


def read_gltf(data: bytes, path: Path) -> MeshFile:
    """Read the bytes of a glTF file, text or binary.

    Parameters
    ----------
    data : bytes
        The file.
    path : Path
        Where it is: it may name files beside it.

    Returns
    -------
    MeshFile
        Every mesh of the scene at its place, in metres; the objects are nodes with a mesh.

    Raises
    ------
    InputError
        If the file cannot be understood, is cut short, requires an extension that is not honoured,
        or places more than can be meant.
    """
    with faults_of(path.name):
        kind, text, binary = _chunks(data)
        version = from_json(_Head, text).asset.version
        if not re.match(r"2(\.|$)", version):
            raise InputError(f"it is glTF {version[:20]}; export it as glTF 2.0")
        document = from_json(_Document, text)
        for name in document.extensions_required:
            if not _HONOURED.fullmatch(name):
                raise _refused(name)
        placed = Placed()
        notes = _Reader(document, binary, path).place(placed)
    extras = document.asset.extras
    # The standard has y up; our own models say otherwise.
    z_up = isinstance(extras, dict) and extras.get("up") == "z"
    return MeshFile(placed.mesh(), kind, "m", notes, "z" if z_up else "y", placed.objects)


def _refused(extension: str) -> InputError:
    """Say what cannot be read of a file, by the name of the extension that it needs."""
    if extension in _COMPRESSIONS:
        how = _COMPRESSIONS[extension]
        return InputError(f"it is compressed with {how} ({extension}); export without compression")
    return InputError(
        f"it requires the glTF extension {extension[:60]}, which fabweave does not know; export "
        "without it, or as OBJ"
    )


def _chunks(data: bytes) -> tuple[str, bytes, bytes | None]:
    """Return whether a file is text or binary, its JSON, and its binary chunk."""
    if data[:4] != b"glTF":
        return "gltf", data.removeprefix(b"\xef\xbb\xbf"), None
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if version != 2:
        raise InputError(f"it is a GLB file of version {version}; export it as glTF 2.0")
    if length > len(data):
        raise InputError(
            f"it is cut short: {len(data):,} of {length:,} bytes; copy or export it again"
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        end = at + 8 + int.from_bytes(data[at : at + 4], "little")
        if end > length:
            raise InputError(f"a chunk at byte {at} reaches beyond the end; export it again")
        chunks.setdefault(data[at + 4 : at + 8], data[at + 8 : end])
        at = end
    if b"JSON" not in chunks:
        raise InputError("it has no JSON chunk; export it again")
    return "glb", chunks[b"JSON"].rstrip(b"\0 "), chunks.get(b"BIN\0")


def _one(items: Sequence[_Item], number: int, what: str) -> _Item:
    """Return an item of a list of the document."""
    if number >= len(items):
        raise InputError(f"it names {what} {number}, but has only {len(items)}; export it again")
    return items[number]


class _Reader:
    """Reads the arrays that a document describes, and places its meshes."""

    def __init__(self, document: _Document, binary: bytes | None, path: Path) -> None:
        self._document = document
        self._path = path
        ours = binary is not None and bool(document.buffers) and document.buffers[0].uri is None
        self._buffers: dict[int, bytes] = {0: binary or b""} if ours else {}
        self._others = 0  # primitives that are points or lines
        self._numbers = self._zeros = 0  # that were read so far

    def place(self, placed: Placed) -> tuple[str, ...]:
        """Place every mesh of the scene, and return what a person should know."""
        document = self._document
        shapes: dict[int, list[tuple[_Primitive, FloatArray, IntArray]]] = {}
        nodes = document.nodes or [_Node(mesh=at) for at in range(len(document.meshes))]
        order, parents = _order(nodes)
        world = _world(nodes, order, parents)
        shown = set(range(len(nodes)))
        if document.scenes and document.nodes:
            first = _one(document.scenes, document.scene or 0, "scene").nodes
            shown = {at for at in first if _one(nodes, at, "node")}
        for at in order:
            node, parent = nodes[at], parents[at]
            if at not in shown and parent not in shown:
                continue
            shown.add(at)
            if node.mesh is None:
                continue
            mesh = _one(document.meshes, node.mesh, "mesh")
            if node.mesh not in shapes:
                shapes[node.mesh] = self._shape(mesh)
            weights = mesh.weights if node.weights is None else node.weights
            name = node.name or mesh.name
            for primitive, points, triangles in shapes[node.mesh]:
                moved = self._morphed(points, primitive, weights)
                if node.skin is not None:
                    # By the specification, a skin stands where its joints are, whatever the node.
                    skinned = self._skinned(moved, primitive, node.skin, world)
                    placed.add(name, skinned, triangles)
                    continue
                for matrix in world[at] @ self._instances(node):
                    placed.add(name, moved, triangles, matrix)
        notes = [
            agree(count, text)
            for count, text in (
                (self._others, "{n} [primitive|primitives] of points or lines [was|were] left out"),
                (
                    max(0, len(document.scenes) - 1),
                    "the file has {n} more [scene|scenes], and [it was|they were] left out",
                ),
            )
            if count
        ]
        return tuple(notes)

    def _shape(self, mesh: _Mesh) -> list[tuple[_Primitive, FloatArray, IntArray]]:
        """Return the triangles of a mesh; primitives that have their vertices in common are one."""
        alike: dict[str, tuple[_Primitive, FloatArray, list[IntArray]]] = {}
        for primitive in mesh.primitives:
            if primitive.mode not in (_TRIANGLES, _STRIP, _FAN) or not primitive.attributes:
                self._others += 1
                continue
            position = primitive.attributes.get("POSITION")
            if position is None:
                raise InputError("a primitive has no POSITION; export it again")
            accessor = _one(self._document.accessors, position, "accessor")
            if accessor.buffer_view is None and accessor.sparse is None:
                for name in primitive.extensions:
                    if name in _COMPRESSIONS:
                        raise _refused(name)
            key = str((sorted(primitive.attributes.items()), primitive.targets))
            if key not in alike:
                points = self._array(position, "VEC3").astype(np.float64)
                alike[key] = primitive, points, []
            _, points, found = alike[key]
            corners = np.arange(len(points))
            if primitive.indices is not None:
                corners = self._array(primitive.indices, "SCALAR", whole=True)[:, 0]
            self._count(len(corners))
            found.append(_triangles(primitive.mode, corners.astype(np.int64)))
        return [(first, points, np.concatenate(found)) for first, points, found in alike.values()]

    def _morphed(
        self, points: FloatArray, primitive: _Primitive, weights: Sequence[float]
    ) -> FloatArray:
        """Return points that are moved to the targets as far as their weights say."""
        for weight, target in zip(weights, primitive.targets, strict=False):
            if weight and "POSITION" in target:
                steps = self._array(target["POSITION"], "VEC3")
                if len(steps) != len(points):
                    raise InputError("a morph target has not as many vertices as its primitive")
                points = points + weight * steps
        return points

    def _skinned(
        self, points: FloatArray, primitive: _Primitive, number: int, world: FloatArray
    ) -> FloatArray:
        """Return points where the joints of a skin put them, at rest."""
        skin = _one(self._document.skins, number, "skin")
        if max(skin.joints, default=0) >= len(world) or not skin.joints:
            raise InputError(f"skin {number} has no joints, or names one that does not exist")
        bones = world[skin.joints]
        if skin.inverse_bind_matrices is not None:
            inverse = self._array(skin.inverse_bind_matrices, "MAT4").reshape(-1, 4, 4)
            if len(inverse) < len(bones):
                raise InputError(f"skin {number} has fewer matrices than joints; export it again")
            bones = bones @ inverse[: len(bones)].swapaxes(1, 2)
        moved, total = np.zeros_like(points), np.zeros((len(points), 1))
        for name, at in sorted(primitive.attributes.items()):
            held = primitive.attributes.get(name.replace("JOINTS", "WEIGHTS"))
            if not name.startswith("JOINTS_") or held is None:
                continue
            joints, weights = self._array(at, "VEC4", whole=True), self._array(held, "VEC4")
            if not len(joints) == len(weights) == len(points):
                raise InputError(f"a primitive has not as many {name} as vertices")
            if len(joints) and joints.max() >= len(bones):
                raise InputError(f"a vertex hangs on joint {joints.max()} of {len(bones)}")
            for joint, weight in zip(joints.T.astype(np.int64), weights.T[..., None], strict=True):
                bone = bones[joint]
                moved += weight * (
                    np.einsum("vab,vb->va", bone[:, :3, :3], points) + bone[:, :3, 3]
                )
                total += weight
        return np.where(total > 0, moved / np.where(total > 0, total, 1.0), points)

    def _instances(self, node: _Node) -> FloatArray:
        """Return where the instances of a node are in it, (N, 4, 4); one that is not moved."""
        if node.extensions.instances is None:
            return np.eye(4)[None]
        attributes = node.extensions.instances.attributes
        found = [
            None if at is None else self._array(at, kind).astype(np.float64)
            for at, kind in (
                (attributes.get("TRANSLATION"), "VEC3"),
                (attributes.get("ROTATION"), "VEC4"),
                (attributes.get("SCALE"), "VEC3"),
            )
        ]
        counts = {len(one) for one in found if one is not None}
        if len(counts) != 1:
            raise InputError(f"{_INSTANCES} of a node has {len(counts)} counts of instances, not 1")
        count = counts.pop()
        if count > MOST_PLACED:
            raise InputError(f"it places {count:,} instances; at most {MOST_PLACED:,} are read")
        resting = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
        return _matrices(
            *(
                np.broadcast_to(rest, (count, len(rest))) if one is None else one
                for one, rest in zip(found, resting, strict=True)
            )
        )

    def _count(self, numbers: int, zeros: int = 0) -> None:
        """Count numbers, and rows without data, before they are read."""
        self._numbers += numbers
        self._zeros += zeros
        if self._numbers > _MOST_NUMBERS or self._zeros > _MOST_ZEROS:
            raise InputError(
                f"its arrays, each as often as it is read, come to {self._numbers:,} numbers and "
                f"{self._zeros:,} rows without data; at most {_MOST_NUMBERS:,} and "
                f"{_MOST_ZEROS:,} are read. Export one coarser mesh"
            )

    def _array(self, number: int, kind: str, *, whole: bool = False) -> _Array:
        """Return the rows of an accessor, (N, width), normalised if it says so."""
        accessor = _one(self._document.accessors, number, "accessor")
        if accessor.type != kind:
            raise InputError(f"accessor {number} is {accessor.type[:20]!r}, and not {kind}")
        component = _component(accessor.component_type, whole=whole)
        shape = accessor.count, _WIDTHS[kind]
        self._count(shape[0] * shape[1], accessor.count if accessor.buffer_view is None else 0)
        if accessor.buffer_view is not None:
            rows = self._rows(accessor.buffer_view, accessor.byte_offset, shape, component)
        else:
            rows = np.zeros(shape, component)
        if accessor.sparse is not None:
            sparse, rows = accessor.sparse, rows.copy()
            where, values = sparse.indices, sparse.values
            at = self._rows(
                where.buffer_view,
                where.byte_offset,
                (sparse.count, 1),
                _component(where.component_type, whole=True),
            )[:, 0]
            if len(at) and at.max() >= len(rows):
                raise InputError(f"accessor {number} has a value for row {at.max()} of {len(rows)}")
            shape = sparse.count, _WIDTHS[kind]
            rows[at] = self._rows(values.buffer_view, values.byte_offset, shape, component)
        if accessor.normalized and component.kind != "f" and not whole:
            return np.maximum(rows / np.iinfo(component).max, -1.0)
        return rows

    def _rows(
        self, number: int, offset: int, shape: tuple[int, int], component: "np.dtype[Any]"
    ) -> _Array:
        """Return rows of a view of a buffer."""
        view = _one(self._document.buffer_views, number, "buffer view")
        data = self._buffer(view)
        count, width = shape
        stride = view.byte_stride or width * component.itemsize
        needed = offset + stride * (count - 1) + width * component.itemsize if count else 0
        start = view.byte_offset + offset
        if needed > view.byte_length or view.byte_offset + needed > len(data):
            there = min(view.byte_length, max(0, len(data) - view.byte_offset))
            raise InputError(
                f"it is cut short, or damaged: {count} rows in buffer view {number} need "
                f"{needed:,} bytes, and {there:,} are there; export it again"
            )
        return np.ndarray(
            shape, component, data, start if count else 0, (stride, component.itemsize)
        )

    def _buffer(self, view: _View) -> bytes:
        """Return the bytes of the buffer of a view; those beside the file are read once."""
        number = view.buffer
        if number not in self._buffers:
            uri = _one(self._document.buffers, number, "buffer").uri
            if uri is None:
                for name in view.extensions:
                    if name in _COMPRESSIONS:
                        raise _refused(name)
                raise InputError(f"buffer {number} has no data; export it again")
            data = self._fetched(uri)
            if sum(map(len, self._buffers.values())) + len(data) > MOST_BYTES:
                raise InputError(f"its buffers have more than {MOST_BYTES:,} bytes")
            self._buffers[number] = data
        return self._buffers[number]

    def _fetched(self, uri: str) -> bytes:
        """Return the bytes of a data URI, or of an ordinary file beside this one."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            try:
                return (
                    base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body)
                )
            except (binascii.Error, ValueError) as error:
                raise InputError(f"its data in base64 are damaged: {error}") from None
        folder = self._path.parent
        part = folder / unquote(uri)
        if "%" in uri and not part.is_file() and (folder / uri).is_file():
            part = folder / uri  # as some programs write the name, against the standard
        if ":" in uri or not part.resolve().is_relative_to(folder.resolve()):
            raise InputError(f"it names {uri[:60]!r}, which is not beside it")
        return read_input(part, "a part of the mesh", MOST_BYTES)


def _component(code: int, *, whole: bool = False) -> "np.dtype[Any]":
    """Return the type of numbers that a code stands for; those of things are whole ones."""
    component = np.dtype(_COMPONENTS.get(code, "O"))
    if component.kind not in ("u" if whole else "uif"):
        raise InputError(f"it names the type of numbers {code}, which glTF does not have there")
    return component


def _triangles(mode: int, corners: IntArray) -> IntArray:
    """Return the triangles of a primitive, (T, 3); those that only join strips are none."""
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise InputError(f"a primitive of triangles has {len(corners)} corners, not 3 for each")
        return corners.reshape(-1, 3)
    at = np.arange(max(0, len(corners) - 2))
    odd = at % 2 if mode == _STRIP else 0
    first = corners[at] if mode == _STRIP else np.broadcast_to(corners[:1], at.shape)
    a, b, c = first, corners[at + 1 + odd], corners[at + 2 - odd]
    return np.column_stack([a, b, c])[(a != b) & (b != c) & (c != a)]


def _order(nodes: Sequence[_Node]) -> tuple[list[int], list[int]]:
    """Return the numbers of nodes, parents before children, and the parent of each or -1."""
    parents = [-1] * len(nodes)
    for at, node in enumerate(nodes):
        for child in node.children:
            _one(nodes, child, "node")
            if parents[child] != -1:
                raise InputError(f"node {child} has two parents; export it again")
            parents[child] = at
    order = [at for at, parent in enumerate(parents) if parent == -1]
    for at in order:  # it grows
        order += nodes[at].children
    if len(order) < len(nodes):
        raise InputError("nodes are their own parents; export it again")
    return order, parents


def _world(nodes: Sequence[_Node], order: Sequence[int], parents: Sequence[int]) -> FloatArray:
    """Return where each node is, (N, 4, 4)."""
    world = _matrices(
        np.array([node.translation for node in nodes]).reshape(-1, 3),
        np.array([node.rotation for node in nodes]).reshape(-1, 4),
        np.array([node.scale for node in nodes]).reshape(-1, 3),
    )
    for at in order:
        matrix = nodes[at].matrix
        if matrix is not None:
            world[at] = np.array(matrix).reshape(4, 4).T
        if parents[at] != -1:
            world[at] = world[parents[at]] @ world[at]
    return world


def _matrices(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> FloatArray:
    """Return matrices, (N, 4, 4), for rows of translations, quaternions and scales."""
    length = np.linalg.norm(rotation, axis=1, keepdims=True)
    x, y, z, w = (rotation / np.where(length > 0, length, 1.0)).T
    matrices = np.zeros((len(rotation), 4, 4))
    matrices[:, :3, :3] = np.moveaxis(
        np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        ),
        2,
        0,
    )
    matrices[:, :3, :3] *= scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1.0
    return matrices
