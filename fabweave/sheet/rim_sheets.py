"""Draw rings along rims on sheets of their own, and say how they are laid."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.nest.layout import Layout, Placement
from fabweave.piece.congruence import DECIMALS
from fabweave.piece.rim_ring import FLAT_MM, RimRing, RingPiece
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, draw_flat
from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.side_sheets import SideSheets, sheet_name, side_sheets
from fabweave.stock.material import Material, forming_advice, min_bend_radius_mm
from fabweave.stock.supplies import Supplies

#: The folder with rings in a job's folder.
FOLDER = "rim"
_MEASURES = ("side", "width_mm", "over_mm", "thickness_mm", "radius_mm")


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


def _rim_record(rings: Sequence[RimRing], layout: Layout) -> dict[str, Any]:
    """Return what ``rim/rim.json`` holds of rings whose pieces are laid out.

    Of each ring it tells the measures and the pieces; of each piece the file that it is cut from,
    where its holes are on that sheet, each with the crossing whose fastener goes through it, and
    where its rungs are, each with the vertex of the rim and the crossing between which it runs.
    """
    placements = iter(layout.placements)
    return {
        "schema": "fabweave.rim/2",
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
        "inside": piece.inside,
        "sheet": sheet_name(FOLDER, placement.sheet),
        "holes": [
            {"crossing": crossing, "x": x, "y": y, "hole_mm": diameter}
            for crossing, (x, y), diameter in zip(
                piece.crossings.tolist(), places, piece.holes[:, 2].tolist(), strict=True
            )
        ],
        "rungs": [
            {"vertex": vertex, "rim": rim, "crossing": crossing, "foot": foot}
            for vertex, rim, crossing, foot in zip(
                piece.vertices.tolist(),
                placement.apply(piece.rim).round(DECIMALS).tolist(),
                piece.feet.tolist(),
                placement.apply(piece.foot).round(DECIMALS).tolist(),
                strict=True,
            )
        ],
    }


def _rim_text(rings: Sequence[RimRing]) -> str:
    """Return how rings are laid, for people: ``rim/rim.txt``."""
    told = ["The last steps: a ring along each rim.\n"]
    for ring in rings:
        told.append(f"Rim at the {ring.side}:")
        for course in ring.courses:
            face = "Inside" if course[0].inside else "Outside"
            names = ", ".join(piece.id for piece in course)
            told.append(f"  {face}, to the right as seen with the rim above: {names}.")
            for piece, after in zip(course, [*course[1:], course[0]], strict=True):
                told.append(
                    f"    {piece.id}: letters towards you. Its holes go over crossings "
                    f"{', '.join(map(str, piece.crossings.tolist()))}; its last hole goes over "
                    f"the first of {after.id}, and covers that id."
                )
        told.append("")
    told.append(
        "Leave the fasteners of these crossings out until then, and put them through ring and "
        "strands together; they are counted with the ring. Bend each piece round first.\n"
    )
    return "\n".join(told)


def rim_notes(rings: Sequence[RimRing], material: Material) -> list[Note]:
    """Say which rings there are, and what helps where one bends more than its material takes.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> rim_notes([], material_named("card"))
    []
    """
    return [
        Note(
            "ring",
            f"ring along the rim at the {ring.side}"
            + (", outside and inside" if ring.courses[1:] else "")
            + ": "
            + agree(len(ring.pieces), "{n} piece[|s]")
            + f" ({', '.join(piece.id for piece in ring.pieces)}) of {ring.width_mm:.1f} mm, over "
            + f"{len(set(ring.crossings.tolist()))} fasteners"
            + (f"; it stands out {ring.over_mm:.1f} mm over the rim" if ring.over_mm else "")
            + _bent(ring, material),
            "rim/rim.txt says how it is laid, as the last step. It is cut from sheets of its own, "
            "which cost what waste.html says, on top of the rest",
        )
        for ring in rings
    ]


def _bent(ring: RimRing, material: Material) -> str:
    """Say to which radius a ring is bent, and what helps if that is too tight."""
    if ring.radius_mm is None:
        return ""
    told, least = f"; it bends to a radius of {ring.radius_mm:.0f} mm", min_bend_radius_mm(material)
    if ring.radius_mm >= least:
        return told
    helps = forming_advice(material, ring.radius_mm) or "a thinner material helps"
    return f"{told}, and the material takes {least:.0f} mm: {helps}"


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
        record=lambda layout: _rim_record(rings, layout),
        text=_rim_text(rings),
    )
