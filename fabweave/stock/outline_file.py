"""Read the outline of an offcut from a DXF file: one closed line, and holes in it."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from ezdxf.document import Drawing
from ezdxf.filemanagement import readfile

from fabweave.core.arc_path import flattened
from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.input_files import read_input, silenced
from fabweave.core.messages import agree

_CHORD_MM = 0.01  # how far chords may be from arcs
_MOST_CORNERS = 20_000
_MOST_RINGS = 5_000
#: What stands near the end of every DXF file, text or binary.
_END, _TAIL = b"EOF", 64


def read_outline(path: Path) -> tuple[FloatArray, list[FloatArray]]:
    """Return the outline that a DXF file draws, and the holes that it draws in it.

    The closed line around the largest area is the outline; closed lines and circles in it are
    holes. Lines that are not closed, such as texts and dimensions, are passed over.

    Parameters
    ----------
    path : Path
        LWPOLYLINE, POLYLINE and CIRCLE are read, in the file's unit; without one, millimetres.

    Returns
    -------
    outline : (K, 2) float array
        Millimetres.
    holes : list of (H, 2) float arrays

    Raises
    ------
    InputError
        If it cannot be read, or draws none or more than one outline.
    """
    data = read_input(path, "the outline")
    if _END not in data[-_TAIL:]:
        raise InputError(
            f"cannot read the outline in {path}: it does not end with EOF as DXF files do, so it "
            "is cut off, or not a DXF file; copy it again, or export it as R2010"
        )
    rings: list[FloatArray] = []
    try:
        with silenced("ezdxf"):
            document = readfile(path)
            scale = _scale(document, path)
            for entity in document.modelspace():
                rings += [scale * ring for ring in _rings(entity, _CHORD_MM / scale)]
                _require_few(rings, path)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # of a file that is no DXF, or half of one, ezdxf makes any error
        raise InputError(
            f"{path} cannot be read as a DXF file ({type(error).__name__}); export it again, as "
            "R2010 or R2000"
        ) from error
    rings = [ring for ring in rings if np.isfinite(ring).all()]
    polygons = [shapely.Polygon(ring) for ring in rings]
    order = sorted(range(len(rings)), key=lambda at: -polygons[at].area)
    if not order or not polygons[order[0]].area > 0.0:
        raise InputError(
            f"{path} has no closed line: join the lines of the outline into one closed polyline"
        )
    if not polygons[order[0]].is_valid:
        raise InputError(f"the outline in {path} crosses itself; draw it without crossings")
    inside = polygons[order[0]]
    beside = [at for at in order[1:] if not inside.covers(polygons[at])]
    if beside:
        raise InputError(
            f"{path} has {agree(len(beside), '{n} closed line[|s]')} outside the outline; keep "
            "one outline in a file, with nothing outside it"
        )
    return rings[order[0]], [rings[at] for at in order[1:] if polygons[at].area > 0.0]


def _require_few(rings: list[FloatArray], path: Path) -> None:
    """Raise InputError for more closed lines than any offcut has."""
    if len(rings) > _MOST_RINGS:
        raise InputError(
            f"{path} has more than {_MOST_RINGS} closed lines; keep the outline of the offcut and "
            "the holes in it"
        )


def _scale(document: Drawing, path: Path) -> float:
    """Return how many millimetres a unit of the drawing is long."""
    known = {0: 1.0, 1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0}
    unit = int(document.header.get("$INSUNITS", 0))
    if unit not in known:
        raise InputError(
            f"{path} is in unit {unit} ($INSUNITS), which is not supported; use millimetres"
        )
    return known[unit]


def _rings(entity: Any, chord: float) -> list[FloatArray]:
    """Return the closed line that an entity draws, if it does; arcs with chords so near."""
    kind = entity.dxftype()
    if kind == "CIRCLE":
        radius = float(entity.dxf.radius)
        if not 0.0 < radius < math.inf:
            return []
        count = int(np.clip(np.pi / np.sqrt(2.0 * chord / radius), 16, 720))
        angle = np.arange(count) * (2.0 * np.pi / count)
        centre = np.array([entity.dxf.center.x, entity.dxf.center.y])
        # Around it: where it is a hole, nothing of it is forgotten.
        around = radius / np.cos(np.pi / count)
        return [centre + around * np.stack([np.cos(angle), np.sin(angle)], axis=1)]
    if kind == "LWPOLYLINE":
        rows = [(x, y, bulge) for x, y, bulge in entity.get_points("xyb")]
        closed = bool(entity.closed)
    elif kind == "POLYLINE" and entity.is_2d_polyline:
        rows = [
            (v.dxf.location.x, v.dxf.location.y, v.dxf.get("bulge", 0.0)) for v in entity.vertices
        ]
        closed = bool(entity.is_closed)
    else:
        return []
    if len(rows) > 2 and rows[0][:2] == rows[-1][:2]:
        rows, closed = rows[:-1], True
    if not closed or len(rows) < 2 or len(rows) > _MOST_CORNERS:
        return []
    values = np.array(rows, dtype=np.float64)
    ring = flattened(values[:, :2], values[:, 2], chord, closed=True)
    return [ring] if len(ring) >= 3 else []
