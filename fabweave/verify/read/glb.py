"""Read the strips of the woven model from binary glTF, independently of any glTF library."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Floats, Ints, ReadError, read_content

Json: TypeAlias = dict[str, Any]

_MILLIMETRES = 1000.0
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True, eq=False)
class Strip:
    """One thread's ribbon in space, millimetres.

    Parameters
    ----------
    label : str
        The thread's label.
    closed : bool
        Whether the last rung is joined to the first.
    entry, exit : (K,) int arrays
        The rungs between which the crossing panel of each station lies.
    rungs : (R, 2, 3) float array
        Right and left end of each rung.
    from_right : (S,) bool array
        For each step between neighbouring rungs, whether its diagonal starts at the right rail.
    grain_mm : float
        How far rounding to 32 bits may have moved a coordinate.
    """

    label: str
    closed: bool
    entry: Ints
    exit: Ints
    rungs: Floats
    from_right: npt.NDArray[np.bool_]
    grain_mm: float


def read_model(path: Path) -> dict[str, Strip]:
    """Read the strips of a GLB file by their labels: every mesh node is one, or marks a finding.

    Raises
    ------
    ReadError
        If the file is not GLB, or a node is not a strip of rungs as agreed.
    """
    try:
        document, binary = _chunks(read_content(path))
        scenes, nodes = document["scenes"], document["nodes"]
        if len(scenes) != 1 or sorted(scenes[0]["nodes"]) != list(range(len(nodes))):
            raise ReadError("it has not one scene that shows every node, each once")
        strips: dict[str, Strip] = {}
        for number, node in enumerate(nodes):
            # What is turned, moved or scaled does not stand where its mesh says.
            if {*node} - {"name", "mesh", "extras"}:
                raise ReadError(f"node {number} has more than a name, a mesh and extras")
            mesh = document["meshes"][node["mesh"]]
            extras = {**(node.get("extras") or {}), **(mesh.get("extras") or {})}
            if "finding" in extras:
                continue  # a ball to look at
            label = str(node.get("name", f"node {number}"))
            if label in strips:
                raise ReadError(f"two nodes are named {label!r}")
            strips[label] = _strip(label, mesh, extras, document, binary)
    except (KeyError, IndexError, TypeError, AttributeError, ValueError, struct.error) as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"it is not the agreed model: {type(error).__name__}: {error}") from error
    return strips


def _chunks(data: bytes) -> tuple[Json, bytes]:
    """Split a GLB file into its JSON document and its binary chunk."""
    if len(data) < 20 or data[:4] != b"glTF":
        raise ReadError("it does not begin with 'glTF'")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2 or length != len(data):
        raise ReadError(f"it is version {version} of {length} bytes, but has {len(data)} bytes")
    text_end = 20 + struct.unpack_from("<I", data, 12)[0]
    kinds = data[16:20], data[text_end + 4 : text_end + 8]
    if kinds != (b"JSON", b"BIN\0"):
        raise ReadError(f"its chunks are {kinds}, not JSON and a binary one")
    return json.loads(data[20:text_end]), data[text_end + 8 :]


def _accessor(document: Json, binary: bytes, number: int) -> npt.NDArray[Any]:
    """Read an accessor as a (count, width) array."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    if "sparse" in accessor or view.get("buffer", 0) != 0:
        raise ReadError(f"accessor {number} is sparse or outside the file")
    kind = np.dtype(_COMPONENTS[accessor["componentType"]])
    width = _WIDTHS[accessor["type"]]
    count = int(accessor["count"])
    stride = int(view.get("byteStride", kind.itemsize * width))
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    if count < 1 or start < 0 or start + stride * (count - 1) + kind.itemsize * width > len(binary):
        raise ReadError(f"accessor {number} reaches outside the binary chunk")
    return np.ndarray(
        (count, width), kind, buffer=binary, offset=start, strides=(stride, kind.itemsize)
    )


def _strip(label: str, mesh: Json, extras: Json, document: Json, binary: bytes) -> Strip:
    """Read one node as a strip and check that it is one."""
    if len(mesh["primitives"]) != 1:
        raise ReadError(f"thread {label}: its mesh has {len(mesh['primitives'])} primitives")
    primitive = mesh["primitives"][0]
    if primitive.get("mode", 4) != 4:
        raise ReadError(f"thread {label}: its primitive is not triangles")
    positions = _accessor(document, binary, primitive["attributes"]["POSITION"]).astype(np.float64)
    triangles = _accessor(document, binary, primitive["indices"]).astype(np.int64).reshape(-1, 3)
    if not isinstance(extras.get("closed"), bool):
        raise ReadError(f"thread {label}: extras do not say whether it is closed")
    closed = bool(extras["closed"])
    if len(positions) % 2 or len(positions) < 4 or positions.shape[1] != 3:
        raise ReadError(f"thread {label}: {len(positions)} vertices do not make rungs of two")
    if not np.all(np.isfinite(positions)):
        raise ReadError(f"thread {label}: a coordinate is not finite")
    rungs = positions.reshape(-1, 2, 3) * _MILLIMETRES
    entry, leave = (np.array(extras[key], dtype=np.int64) for key in ("entry", "exit"))
    if entry.ndim != 1 or entry.shape != leave.shape:
        raise ReadError(f"thread {label}: entry and exit rungs are not two lists of one length")
    _check_panels(label, entry, leave, len(rungs), closed)
    return Strip(
        label=label,
        closed=closed,
        entry=entry,
        exit=leave,
        rungs=rungs,
        from_right=_diagonals(label, triangles, len(rungs), closed),
        grain_mm=float(np.max(np.abs(rungs))) * 2.0**-24,
    )


def _check_panels(label: str, entry: Ints, leave: Ints, count: int, closed: bool) -> None:
    """Require that the panels follow one another, once around."""
    if np.any((entry < 0) | (entry >= count) | (leave < 0) | (leave >= count)):
        raise ReadError(f"thread {label}: a crossing panel is at a rung that does not exist")
    if closed:
        panels = (leave - entry) % count
        gaps = (np.roll(entry, -1) - leave) % count
        good = bool(np.all(panels > 0)) and int(panels.sum() + gaps.sum()) == count
    else:
        good = bool(np.all(leave > entry) and np.all(entry[1:] >= leave[:-1]))
    if len(entry) and not good:
        raise ReadError(f"thread {label}: its crossing panels do not follow one another")


def _diagonals(label: str, triangles: Ints, count: int, closed: bool) -> npt.NDArray[np.bool_]:
    """Find each step's diagonal; require two triangles for each step, in order.

    Of the six corners of two triangles that share a diagonal, the diagonal's ends are two each.
    """
    steps = np.arange(count if closed else count - 1)
    if len(triangles) != 2 * len(steps):
        raise ReadError(
            f"thread {label}: {len(triangles)} triangles do not make {len(steps)} steps of two"
        )
    after = (steps + 1) % count
    corners = np.column_stack([2 * steps, 2 * steps + 1, 2 * after, 2 * after + 1])
    pairs = triangles.reshape(-1, 2, 3)
    used = (pairs[:, :, :, None] == corners[:, None, None, :]).sum(axis=2)
    from_right = np.all(used[:, :, [0, 3]] == 1, axis=(1, 2))
    from_left = np.all(used[:, :, [1, 2]] == 1, axis=(1, 2))
    strip = (used.sum(axis=2) == 3).all(axis=1) & (used.sum(axis=1) >= 1).all(axis=1)
    bad = np.flatnonzero(~(strip & (from_right ^ from_left)))
    if len(bad):
        raise ReadError(
            f"thread {label}: the triangles of {len(bad)} steps are not those of a strip "
            f"(first at rung {bad[0]})"
        )
    return from_right
