"""Draw sheets: every piece where it stands, with its marks, holes and outline."""

from collections.abc import Sequence

import numpy as np

from fabweave.arrays import FloatArray
from fabweave.cut.drawing import Circle, Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.labels import OVER_SIGN, UNDER_SIGN
from fabweave.cut.lettering import characters
from fabweave.cut.marks import Marks
from fabweave.cut.notes import sheet_notes
from fabweave.flat.piece import Piece
from fabweave.sheet.layout import Layout, Placement


def sheet_name(number: int) -> str:
    """Return the name of a sheet and of its files; numbers start at 1."""
    return f"sheet_{number:02d}"


def draw_sheets(
    pieces: Sequence[Piece],
    marks: Sequence[Marks],
    layout: Layout,
    *,
    title: str,
    mirrored: bool = False,
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
    mirrored : bool
        Whether pieces lie face down: what stands at x on a sheet of the layout is drawn at the
        sheet's width minus x, so that the insides are engraved. Notes are not mirrored.

    Returns
    -------
    tuple of SheetDrawing
        One for each sheet, pieces in the order of their numbers; nothing that is not a piece is
        on a layer that is cut.
    """
    drawings: list[list[PieceDrawing]] = [[] for _ in layout.sheets]
    for placement in sorted(layout.placements, key=lambda placement: placement.piece):
        piece = pieces[placement.piece]
        width = layout.sheets[placement.sheet].width_mm if mirrored else None
        drawings[placement.sheet].append(
            _draw_piece(piece, marks[placement.piece], placement, width)
        )
    count = len(layout.sheets)
    legend = _legend(marks, mirrored=mirrored)
    return tuple(
        SheetDrawing(
            name=sheet_name(number),
            width_mm=sheet.width_mm,
            height_mm=sheet.height_mm,
            pieces=tuple(drawn),
            notes=sheet_notes(
                sheet.width_mm,
                sheet.height_mm,
                [f"{_lettered(title)} SHEET {number}/{count}", *legend],
            ),
        )
        for number, (sheet, drawn) in enumerate(zip(layout.sheets, drawings, strict=True), start=1)
    )


def _lettered(title: str) -> str:
    """Return a job's title without characters that cannot be lettered."""
    known = set(characters())
    return "".join(sign for sign in title.upper() if sign in known)


def _legend(marks: Sequence[Marks], *, mirrored: bool) -> list[str]:
    """Return notes that say what the engraving means."""
    kinds = {kind for one in marks for label in one.labels for kind in label.kinds}
    legend = []
    if kinds:
        legend.append(f"THE ENGRAVED FACE IS THE {'IN' if mirrored else 'OUT'}SIDE")
    elif mirrored:
        legend.append("THE UPPER FACE IS THE INSIDE")
    if "sign" in kinds:
        legend.append(f"{OVER_SIGN} THIS PIECE PASSES OVER, {UNDER_SIGN} UNDER")
    return legend


def _draw_piece(
    piece: Piece, marks: Marks, placement: Placement, mirror_mm: float | None
) -> PieceDrawing:
    """Return a piece's entities on its sheet, mirrored in its width if one is given."""
    letters = [stroke for label in marks.labels for stroke in label.strokes]
    holes, slots = piece.holes, [slot.path for slot in piece.slots]
    parts = [
        *letters,
        *marks.ticks,
        holes[:, 1:3],
        *(slot.points for slot in slots),
        piece.path.points,
    ]
    # One motion for all points: a piece has hundreds of strokes.
    points: FloatArray = placement.apply(np.concatenate(parts))
    if mirror_mm is not None:
        points = points * (-1.0, 1.0) + (mirror_mm, 0.0)
    placed = np.split(points, np.cumsum([len(part) for part in parts[:-1]]))
    layers = [Layer.ENGRAVE_LABEL] * len(letters) + [Layer.ENGRAVE_MARK] * len(marks.ticks)
    entities: list[Entity] = [
        Polyline(layer, points) for layer, points in zip(layers, placed, strict=False)
    ]
    # Turning a piece leaves its bulges as they are; seen from the back arcs turn the other way.
    sense = 1.0 if mirror_mm is None else -1.0
    entities += [
        Circle(Layer.CUT_INNER, x, y, diameter / 2)
        for (x, y), diameter in zip(placed[len(layers)].tolist(), holes[:, 3].tolist(), strict=True)
    ]
    entities += [
        Polyline(Layer.CUT_INNER, points, closed=True, bulges=sense * slot.bulges)
        for points, slot in zip(placed[len(layers) + 1 : -1], slots, strict=True)
    ]
    bulges = sense * piece.path.bulges
    entities.append(Polyline(Layer.CUT_OUTER, placed[-1], closed=True, bulges=bulges))
    return PieceDrawing(piece.id, tuple(entities))
