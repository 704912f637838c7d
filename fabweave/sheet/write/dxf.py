"""Write a sheet as DXF for laser cutters, mills and services.

ezdxf makes the frame of the file (header, tables, objects); the entities are written here, in
the order of the cut, because an old machine cuts in the order of the file, whatever its colours.
Only closed LWPOLYLINE, CIRCLE, LINE and open LWPOLYLINE occur (R12: POLYLINE), with bulges for
arcs; nothing that an importer could read in two ways.
"""

import io
import logging
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.sheet.drawing import (
    Circle,
    Entity,
    Layer,
    Polyline,
    SheetDrawing,
    check_drawing,
    on_grid,
)
from fabweave.sheet.presets import Preset, preset_named

if TYPE_CHECKING:
    from ezdxf.document import Drawing

#: The DXF versions that can be written, the default first.
DXF_VERSIONS = ("R2010", "R2000", "R12")
#: The application under which the piece id stands in the extended data of every entity.
APPID = "FABWEAVE"

_MILLIMETRES = 4
_NAMES = {layer: layer.value for layer in Layer}
#: What entities stand after in every DXF file, however its numbers are spaced.
_ENTITIES = re.compile(r"^ *0\nSECTION\n *2\nENTITIES\n", re.MULTILINE)


def dxf_bytes(
    drawing: SheetDrawing,
    *,
    version: str = "R2010",
    colours: Preset | None = None,
    plain: bool = False,
) -> bytes:
    """Return a sheet as the content of a DXF file.

    Entities stand in the file as in the drawing: piece by piece, and the notes last. Colours,
    line type and width are those of the layer. Every entity of a piece carries the piece id as
    extended data (application ``FABWEAVE``, group 1000). Coordinates are rounded to 1e-4 mm. The
    same drawing gives the same bytes: the file holds no date and no random id.

    Parameters
    ----------
    drawing : SheetDrawing
        One sheet, millimetres.
    version : str
        One of ``DXF_VERSIONS``. R12 has neither units nor true colours; R2000 no true colours.
    colours : Preset or None
        The colours of the layers; None takes the default preset.
    plain : bool
        Whether everything stands on layer 0 in colour 7, and nothing says what piece it is of.

    Raises
    ------
    InputError
        If the version is unknown, or the drawing cannot be cut (see ``check_drawing``).

    Examples
    --------
    >>> import ezdxf
    >>> from fabweave.sheet.drawing import PieceDrawing
    >>> square = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]]), True)
    >>> sheet = SheetDrawing("sheet 1", 20.0, 10.0, (PieceDrawing("A1", (square,)),), ())
    >>> document = ezdxf.read(io.StringIO(dxf_bytes(sheet).decode()))
    >>> [entity.dxftype() for entity in document.modelspace()]
    ['LWPOLYLINE']
    """
    if version not in DXF_VERSIONS:
        raise InputError(
            f"DXF version {version!r} cannot be written; choose one of {', '.join(DXF_VERSIONS)}"
        )
    check_drawing(drawing)
    preset = preset_named() if colours is None else colours
    with _fixed_metadata():
        document = _skeleton(drawing, version, None if plain else preset)
        names = dict.fromkeys(Layer, "0") if plain else _NAMES
        writer = (_R12Writer if version == "R12" else _Writer)(document, names)
        body = _entities(drawing, writer, marked=not plain)
        stream = io.StringIO()
        document.write(stream)
    whole = _ENTITIES.sub(lambda found: found[0] + body, stream.getvalue())
    return whole.encode(document.output_encoding)


@contextmanager
def _fixed_metadata() -> Iterator[None]:
    """Keep dates and random ids out of the file, and ezdxf's remarks out of the log."""
    import ezdxf  # noqa: PLC0415 - it takes long to import

    options = ezdxf.options  # type: ignore[attr-defined]  # documented, but not declared as public
    logger = logging.getLogger("ezdxf")
    before, level = options.write_fixed_meta_data_for_testing, logger.level
    options.write_fixed_meta_data_for_testing = True
    logger.setLevel(logging.ERROR)  # it warns that R12 has no units, which we know
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before
        logger.setLevel(level)


def _skeleton(drawing: SheetDrawing, version: str, preset: Preset | None) -> "Drawing":
    """Return a document with header and layers, but without entities; None for layer 0 alone."""
    from ezdxf.filemanagement import new  # noqa: PLC0415 - it takes long to import

    document = new(version, setup=False, units=_MILLIMETRES)
    document.header["$MEASUREMENT"] = 1
    if version != "R12":
        # ezdxf adds these at writing in an order that changes from run to run; it leaves alone
        # those that are there.
        for name in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(name)
    document.layers.remove("Defpoints")
    if preset is not None:
        document.appids.new(APPID)
        for layer, colour in preset.colours.items():
            entry = document.layers.add(
                layer.value, color=colour.aci, linetype="Continuous", lineweight=0
            )
            if version == "R2010":
                entry.rgb = colour.rgb
    # This forgets the extents: it comes before them.
    document.set_modelspace_vport(
        height=drawing.height_mm * 1.1, center=(drawing.width_mm / 2, drawing.height_mm / 2)
    )
    low, high = extents(drawing)
    modelspace = document.modelspace()
    # ezdxf copies the layout's extents into the header only if no corner is the origin.
    modelspace.dxf.extmin = document.header["$EXTMIN"] = (*low.tolist(), 0.0)
    modelspace.dxf.extmax = document.header["$EXTMAX"] = (*high.tolist(), 0.0)
    modelspace.dxf.limmin = (0.0, 0.0)
    modelspace.dxf.limmax = (drawing.width_mm, drawing.height_mm)
    return document


def extents(drawing: SheetDrawing) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and the upper right corner of the sheet and all that is on it.

    Examples
    --------
    >>> low, high = extents(SheetDrawing("sheet 1", 600.0, 400.0, (), ()))
    >>> low.tolist(), high.tolist()
    ([0.0, 0.0], [600.0, 400.0])
    """
    corners = [np.array([[0.0, 0.0], [drawing.width_mm, drawing.height_mm]])]
    entities = [entity for piece in drawing.pieces for entity in piece.entities]
    entities.extend(drawing.notes)
    # Arcs reach at most a hundredth of a millimetre farther than the points on them.
    corners.extend(entity.flattened(0.01) for entity in entities if isinstance(entity, Polyline))
    circles = [(item.x, item.y, item.radius) for item in entities if isinstance(item, Circle)]
    if circles:
        values = np.array(circles)
        corners.extend((values[:, :2] - values[:, 2:], values[:, :2] + values[:, 2:]))
    points = on_grid(np.concatenate(corners))
    return points.min(axis=0), points.max(axis=0)


def _entities(drawing: SheetDrawing, writer: "_Writer", *, marked: bool) -> str:
    """Return the group codes of all entities, in the order of the cut, maybe marked by pieces."""
    entities: list[Entity] = []
    marks: list[str] = []
    for piece in drawing.pieces:
        entities += piece.entities
        mark = f"1001\n{APPID}\n1000\n{piece.piece_id}\n" if marked else ""
        marks += [mark] * len(piece.entities)
    entities += drawing.notes
    marks += [""] * len(drawing.notes)
    # All numbers are rounded at once; a circle has its middle, then its radius twice.
    points = [
        entity.points
        if isinstance(entity, Polyline)
        else np.array([[entity.x, entity.y], [entity.radius, entity.radius]])
        for entity in entities
    ]
    numbers: list[float] = on_grid(np.concatenate([*points, np.empty((0, 2))])).ravel().tolist()
    ends: list[int] = (offsets_of(np.array([len(run) for run in points])) * 2).tolist()
    return "".join(
        writer.entity(entity, numbers[start:end], mark)
        for entity, mark, (start, end) in zip(entities, marks, pairwise(ends), strict=True)
    )


def _bent(bulge: float) -> str:
    """Return the group code of a bulge; a straight side has none."""
    return f" 42\n{bulge:.9f}\n" if bulge else ""


class _Writer:
    """Write entities as R2000 and later want them; ``mark`` is extended data to append."""

    def __init__(self, document: "Drawing", names: Mapping[Layer, str]) -> None:
        self.next_handle = document.entitydb.next_handle
        self._names = names
        self._owner = document.block_records.get("*Model_Space").dxf.handle

    def entity(self, entity: Entity, numbers: list[float], mark: str) -> str:
        """Return the group codes of one entity, given its coordinates: x, y, x, y and so on."""
        layer = self._names[entity.layer]
        if isinstance(entity, Circle):
            return self.circle(layer, numbers) + mark
        if len(numbers) == 4 and entity.bulges is None:
            return self.line(layer, numbers) + mark
        bulges = None if entity.bulges is None else entity.bulges.tolist()
        return self.polyline(layer, numbers, bulges, entity.closed, mark)

    def head(self, kind: str, layer: str, subclass: str) -> str:
        """Return what every entity begins with."""
        return (
            f"  0\n{kind}\n  5\n{self.next_handle()}\n330\n{self._owner}\n"
            f"100\nAcDbEntity\n  8\n{layer}\n100\n{subclass}\n"
        )

    def circle(self, layer: str, numbers: list[float]) -> str:
        """Return a CIRCLE."""
        head = self.head("CIRCLE", layer, "AcDbCircle")
        form = " 10\n%.4f\n 20\n%.4f\n 30\n0.0\n 40\n%.4f\n"
        return head + form % tuple(numbers[:3])

    def line(self, layer: str, numbers: list[float]) -> str:
        """Return a LINE."""
        head = self.head("LINE", layer, "AcDbLine")
        form = " 10\n%.4f\n 20\n%.4f\n 30\n0.0\n 11\n%.4f\n 21\n%.4f\n 31\n0.0\n"
        return head + form % tuple(numbers)

    def polyline(
        self, layer: str, numbers: list[float], bulges: list[float] | None, closed: bool, mark: str
    ) -> str:
        """Return an LWPOLYLINE."""
        head = self.head("LWPOLYLINE", layer, "AcDbPolyline")
        n = len(numbers) // 2
        if bulges is None:
            vertices = " 10\n%.4f\n 20\n%.4f\n" * n % tuple(numbers)
        else:
            corners = zip(numbers[::2], numbers[1::2], bulges, strict=True)
            vertices = "".join(f" 10\n{x:.4f}\n 20\n{y:.4f}\n{_bent(b)}" for x, y, b in corners)
        return f"{head} 90\n{n}\n 70\n{int(closed)}\n 43\n0.0\n{vertices}{mark}"


class _R12Writer(_Writer):
    """Write entities as R12 wants them: no subclasses, and POLYLINE with its vertices."""

    def head(self, kind: str, layer: str, subclass: str) -> str:  # noqa: ARG002 - R12 has none
        """Return what every entity begins with."""
        return f"  0\n{kind}\n  5\n{self.next_handle()}\n  8\n{layer}\n"

    def polyline(
        self, layer: str, numbers: list[float], bulges: list[float] | None, closed: bool, mark: str
    ) -> str:
        """Return a POLYLINE, one VERTEX for each point, and SEQEND."""
        bulges = [0.0] * (len(numbers) // 2) if bulges is None else bulges
        head = self.head("POLYLINE", layer, "")
        chunks = [f"{head} 66\n1\n 10\n0.0\n 20\n0.0\n 30\n0.0\n 70\n{int(closed)}\n{mark}"]
        chunks.extend(
            f"{self.head('VERTEX', layer, '')} 10\n{x:.4f}\n 20\n{y:.4f}\n 30\n0.0\n{_bent(b)}"
            for x, y, b in zip(numbers[::2], numbers[1::2], bulges, strict=True)
        )
        chunks.append(self.head("SEQEND", layer, ""))
        return "".join(chunks)
