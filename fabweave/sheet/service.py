"""Draw each distinct piece by itself, as services want it that cut one file many times.

Such a service takes one file for each distinct piece, cuts every line that it finds, and asks for
the quantity beside it. So a file holds the holes and the outline of one piece and nothing else,
and a table says how often it is wanted.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.files import csv_text
from fabweave.nest.layout import Placement
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import PieceDrawing, SheetDrawing
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.sheets import draw_piece
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.stock.material import Material

#: The table of quantities.
TABLE = "parts.csv"
_COLUMNS = (
    "file", "quantity", "kind", "pieces", "material", "thickness_mm", "length_mm", "width_mm",
    "area_mm2", "cut_length_mm", "holes",
)  # fmt: skip
# Arcs are flattened so finely to find how far they reach.
_FLAT_MM = 1e-4
_DECIMALS = 4


@frozen_value
class KindFile:
    """A distinct piece: how its files are called, what they hold, and which pieces it makes."""

    material: Material
    kind: int
    ids: tuple[str, ...]
    piece: Piece
    drawing: SheetDrawing

    @property
    def folder(self) -> str:
        """The folder that holds all of its material."""
        return material_folder(self.material)


def material_folder(material: Material) -> str:
    """Return the folder that holds the pieces of a material.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> material_folder(material_named("card"))
    'card_0.4mm'
    """
    # No colon, which names of folders may not have everywhere.
    return f"{material.name.replace(':', '-')}_{material.thickness_mm:g}mm"


def kind_files(
    pieces: Sequence[Piece], kinds: Sequence[int], materials: Sequence[Material]
) -> tuple[KindFile, ...]:
    """Draw one piece of each kind and material, with its lower left corner in the origin.

    Parameters
    ----------
    pieces : sequence of Piece
    kinds : sequence of int
        The kind of each piece: pieces of one kind are congruent, face up.
    materials : sequence of Material
        What each piece is cut from.

    Returns
    -------
    tuple of KindFile
        By material and kind. Pieces lie face up, along their length, nominal, and bear nothing.
    """
    members_by_kind: dict[tuple[str, int], list[int]] = {}
    for index, (kind, material) in enumerate(zip(kinds, materials, strict=True)):
        members_by_kind.setdefault((material_folder(material), kind), []).append(index)
    digits = max(3, len(str(max(kinds, default=0))))
    most = max(2, len(str(max(map(len, members_by_kind.values()), default=0))))
    files = []
    for (_, kind), members in sorted(members_by_kind.items()):
        name = f"kind_{kind:0{digits}d}_qty_{len(members):0{most}d}"
        piece = pieces[members[0]]
        files.append(
            KindFile(
                material=materials[members[0]],
                kind=kind,
                ids=tuple(pieces[index].id for index in members),
                piece=piece,
                drawing=_draw_alone(piece, name),
            )
        )
    return tuple(files)


def _draw_alone(piece: Piece, name: str) -> SheetDrawing:
    """Draw the holes and the outline of a piece; the sheet is as large as the piece."""
    reach = np.round(piece.path.flattened(_FLAT_MM), _DECIMALS)
    low, size = reach.min(axis=0), np.ptp(reach, axis=0).round(_DECIMALS)
    place = Placement(0, 0, 0.0, float(-low[0]), float(-low[1]))
    bare = Marks(labels=(), ticks=(), dropped=())
    drawn = draw_piece(piece, bare, place, None, 1.0)
    alone = PieceDrawing(name, drawn.entities)
    return SheetDrawing(name, float(size[0]), float(size[1]), (alone,), ())


def quantity_table(files: Sequence[KindFile]) -> str:
    """Return the table of quantities as CSV: one row a file.

    Length and width are those of what the file holds; the area is without holes, the length of
    the cut with them.
    """
    rows = []
    for file in files:
        piece = file.piece
        length = piece.path.length + float(np.sum(np.pi * piece.holes[:, 3]))
        length += sum(slot.path.length for slot in piece.slots)
        rows.append(
            (
                f"{file.folder}/{file.drawing.name}.dxf",
                len(file.ids),
                file.kind,
                " ".join(file.ids),
                file.material.name,
                f"{file.material.thickness_mm:g}",
                f"{file.drawing.width_mm:.3f}",
                f"{file.drawing.height_mm:.3f}",
                f"{piece.net_area_mm2:.3f}",
                f"{length:.3f}",
                len(piece.holes) + len(piece.slots),
            )
        )
    return csv_text(_COLUMNS, rows)


def write_service(
    directory: Path,
    pieces: Sequence[Piece],
    kinds: Sequence[int],
    materials: Sequence[Material],
    machine: MachineSettings,
) -> None:
    """Write a DXF and an SVG for each kind into a folder for each material, and the table.

    Parameters are those of :func:`kind_files`, and how files are written.
    """
    files = kind_files(pieces, kinds, materials)
    for file in files:
        (directory / file.folder).mkdir(parents=True, exist_ok=True)
        stem = directory / file.folder / file.drawing.name
        dxf = dxf_bytes(file.drawing, version=machine.dxf, plain=True)
        stem.with_name(f"{stem.name}.dxf").write_bytes(dxf)
        svg = svg_text(
            file.drawing,
            colours=machine.preset,
            units=machine.svg_units,
            stroke_width_mm=machine.line_mm,
            plain=True,
        )
        stem.with_name(f"{stem.name}.svg").write_bytes(svg.encode())
    (directory / TABLE).write_bytes(quantity_table(files).encode())
