"""Draw rings around openings on sheets of their own, and say how they are laid."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.nest.layout import Layout, Placement
from fabweave.piece.congruence import DECIMALS
from fabweave.piece.on_stock import FLAT_MM
from fabweave.piece.rim_ring import RimRing, RingPiece
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, draw_flat
from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.side_sheets import SideSheets, sheet_name, side_sheets
from fabweave.stock.supplies import Supplies

#: The folder with rings in a job's folder, and the files that tell of them.
FOLDER, RECORD, TEXT = "rim", "rim.json", "rim.txt"
_MEASURES = ("side", "opening_mm", "width_mm", "slope_deg", "off_mm", "thickness_mm")


def _drawn(piece: RingPiece, placement: Placement) -> PieceDrawing:
    """Return a piece's entities where it stands."""
    x, y, angle, height = piece.label.tolist()
    centre = placement.apply(np.array([[x, y]]))[0]
    outline, bulges = placement.apply(piece.path.points), np.array(piece.path.bulges)
    holes = np.column_stack((placement.apply(piece.holes[:, :2]), piece.holes[:, 2]))
    return draw_flat(
        piece.id,
        place_text(piece.id, height, centre, angle + placement.rotation_deg),
        (),
        holes.tolist(),
        Polyline(Layer.CUT_OUTER, outline, closed=True, bulges=bulges),
    )


def rim_record(rings: Sequence[RimRing], layout: Layout) -> dict[str, Any]:
    """Return what ``rim/rim.json`` holds of rings whose pieces are laid out.

    Of each ring it tells the measures and the pieces; of each piece the file that it is cut from,
    and where its holes are on that sheet, each with the crossing whose fastener goes through it.
    """
    placements = iter(layout.placements)
    return {
        "schema": "fabweave.rim/1",
        "units": "mm",
        "rings": [
            {
                **{name: getattr(ring, name) for name in _MEASURES},
                "pieces": [_record(piece, next(placements)) for piece in ring.pieces],
            }
            for ring in rings
        ],
    }


def _record(piece: RingPiece, placement: Placement) -> dict[str, Any]:
    """Return a piece where it stands on its sheet."""
    places = placement.apply(piece.holes[:, :2]).round(DECIMALS).tolist()
    return {
        "id": piece.id,
        "sheet": sheet_name(FOLDER, placement.sheet),
        "holes": [
            {"crossing": crossing, "x": x, "y": y, "hole_mm": diameter}
            for crossing, (x, y), diameter in zip(
                piece.crossings.tolist(), places, piece.holes[:, 2].tolist(), strict=True
            )
        ],
    }


def rim_text(rings: Sequence[RimRing]) -> str:
    """Return how rings are laid, for people: ``rim/rim.txt``."""
    told = ["The last step: the ring around each opening.\n"]
    for ring in rings:
        names = [piece.id for piece in ring.pieces]
        told.append(
            f"Opening at the {ring.side}: {', '.join(names)}, counter-clockwise as seen from above."
        )
        for piece, after in zip(ring.pieces, [*ring.pieces[1:], ring.pieces[0]], strict=True):
            told.append(
                f"  {piece.id}: letters up. Its holes go over crossings "
                f"{', '.join(map(str, piece.crossings.tolist()))}; its last hole goes over the "
                f"first of {after.id}, and covers that id."
            )
        told.append("")
    told.append(
        "Leave the fasteners of these crossings out until then, and put them through ring and "
        "strands together; they are counted with the ring. Bend each piece round first.\n"
    )
    return "\n".join(told)


def rim_notes(rings: Sequence[RimRing]) -> list[Note]:
    """Say which rings there are.

    Examples
    --------
    >>> rim_notes([])
    []
    """
    return [
        Note(
            "ring",
            f"ring at the {ring.side}: "
            + agree(len(ring.pieces), "{n} piece[|s]")
            + f" ({', '.join(piece.id for piece in ring.pieces)}) of {ring.width_mm:.1f} mm, "
            f"{ring.slope_deg:.0f}° from flat, around an opening of {ring.opening_mm:.1f} mm, "
            f"over {len(set(ring.crossings.tolist()))} fasteners; the strands there lie "
            f"within {max(ring.off_mm, 0.05):.1f} mm of it",
            f"rim/{TEXT} says how it is laid, as the last step. It is cut from sheets of its own, "
            "which cost what waste.html says, on top of the rest",
        )
        for ring in rings
    ]


def ring_sheets(
    rings: Sequence[RimRing], supplies: Supplies, machine: MachineSettings, title: str
) -> SideSheets | None:
    """Nest the pieces of rings on sheets of their own, of the first material; None without rings.

    Raises
    ------
    CannotMakeError
        If a piece fits no sheet, or sheets run out.
    """
    pieces = [piece for ring in rings for piece in ring.pieces]
    if not pieces:
        return None
    return side_sheets(
        FOLDER,
        title,
        [piece.path.flattened(FLAT_MM) for piece in pieces],
        [piece.net_area_mm2 for piece in pieces],
        lambda placement: _drawn(pieces[placement.piece], placement),
        supplies.each[0],
        machine,
        ids=[piece.id for piece in pieces],
        margin_mm=supplies.margin_mm,
        rotations=supplies.rotations,
    )
