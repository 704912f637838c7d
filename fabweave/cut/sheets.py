"""Draw sheets: every piece where it stands, with its marks, holes and outline."""

from collections.abc import Sequence

import numpy as np

from fabweave.arrays import FloatArray
from fabweave.cut.drawing import Circle, Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.marks import Marks
from fabweave.cut.notes import sheet_notes
from fabweave.flat.piece import Piece
from fabweave.sheet.layout import Layout, Placement


def sheet_name(number: int) -> str:
    """Return the name of a sheet and of its files; numbers start at 1."""
    return f"sheet_{number:02d}"


def draw_sheets(
    pieces: Sequence[Piece], marks: Sequence[Marks], layout: Layout, *, title: str
) -> tuple[SheetDrawing, ...]:
    """Draw every sheet of a layout.

    Parameters
    ----------
    pieces, marks
        The pieces and what is engraved on them.
    layout : Layout
        Where each piece stands.
    title : str
        Name of the job, lettered in the margin.

    Returns
    -------
    tuple of SheetDrawing
        One for each sheet, pieces in the order of their numbers; nothing that is not a piece is
        on a layer that is cut.
    """
    drawings: list[list[PieceDrawing]] = [[] for _ in layout.sheets]
    for placement in sorted(layout.placements, key=lambda placement: placement.piece):
        piece = pieces[placement.piece]
        drawings[placement.sheet].append(_draw_piece(piece, marks[placement.piece], placement))
    count = len(layout.sheets)
    return tuple(
        SheetDrawing(
            name=sheet_name(number),
            width_mm=sheet.width_mm,
            height_mm=sheet.height_mm,
            pieces=tuple(drawn),
            notes=sheet_notes(sheet.width_mm, sheet.height_mm, [f"{title} SHEET {number}/{count}"]),
        )
        for number, (sheet, drawn) in enumerate(zip(layout.sheets, drawings, strict=True), start=1)
    )


def _draw_piece(piece: Piece, marks: Marks, placement: Placement) -> PieceDrawing:
    """Return a piece's entities on its sheet: engraving, holes, outline."""

    def line(layer: Layer, points: FloatArray, *, closed: bool = False) -> Polyline:
        return Polyline(layer, placement.apply(points), closed)

    entities: list[Entity] = [
        line(Layer.ENGRAVE_LABEL, stroke) for label in marks.labels for stroke in label.strokes
    ]
    entities += [line(Layer.ENGRAVE_MARK, tick) for tick in marks.ticks]
    drilled = np.flatnonzero(~np.isnan(piece.hole_mm))
    for (x, y), diameter in zip(
        placement.apply(piece.points[drilled]), piece.hole_mm[drilled], strict=True
    ):
        entities.append(Circle(Layer.CUT_INNER, float(x), float(y), float(diameter) / 2))
    entities.append(line(Layer.CUT_OUTER, piece.outline, closed=True))
    return PieceDrawing(piece.id, tuple(entities))
