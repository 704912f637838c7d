"""Draw rings around openings on sheets of their own, and say how they are laid."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.cut.drawing import Circle, Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.labels.lettering import place_text
from fabweave.cut.notes.notes import sheet_notes
from fabweave.cut.sheets import lettered
from fabweave.flat.rim_ring import RimRing, RingPiece
from fabweave.nest.layout import Layout, Placement

#: The folder with rings in a job's folder, and the files that tell of them.
FOLDER, RECORD, TEXT = "rim", "rim.json", "rim.txt"
_DECIMALS = 6


def draw_rim_sheets(
    rings: Sequence[RimRing], layout: Layout, title: str
) -> tuple[SheetDrawing, ...]:
    """Draw the pieces of rings: the id where the next piece covers it, holes, outline.

    Parameters
    ----------
    rings : sequence of RimRing
    layout : Layout
        Their pieces, one after another.
    title : str
        Of the job.
    """
    pieces = [piece for ring in rings for piece in ring.pieces]
    drawn: list[list[PieceDrawing]] = [[] for _ in layout.sheets]
    for placement in layout.placements:
        drawn[placement.sheet].append(_drawn(pieces[placement.piece], placement))
    return tuple(
        SheetDrawing(
            name=f"rim_{number:02d}",
            width_mm=sheet.width_mm,
            height_mm=sheet.height_mm,
            pieces=tuple(drawn[number - 1]),
            notes=sheet_notes(
                sheet.width_mm,
                sheet.height_mm,
                [f"{lettered(title)} RIM {number}/{len(layout.sheets)}"],
                margin_mm=layout.margin_mm,
                outline=sheet.outline,
                defects=sheet.defects,
            ),
        )
        for number, sheet in enumerate(layout.sheets, start=1)
    )


def _drawn(piece: RingPiece, placement: Placement) -> PieceDrawing:
    """Return a piece's entities where it stands: engraving, holes, outline."""
    x, y, angle, height = piece.label.tolist()
    centre = placement.apply(np.array([[x, y]]))[0]
    entities: list[Entity] = [
        Polyline(Layer.ENGRAVE_LABEL, stroke)
        for stroke in place_text(piece.id, height, centre, angle + placement.rotation_deg)
    ]
    centres = placement.apply(piece.holes[:, :2])
    entities += [
        Circle(Layer.CUT_INNER, at[0], at[1], diameter / 2.0)
        for at, diameter in zip(centres.tolist(), piece.holes[:, 2].tolist(), strict=True)
    ]
    outline = placement.apply(piece.path.points)
    entities.append(
        Polyline(Layer.CUT_OUTER, outline, closed=True, bulges=np.array(piece.path.bulges))
    )
    return PieceDrawing(piece.id, tuple(entities))


@record
class RimHole:
    """A hole of a ring's piece: whose fastener goes through it, and where it is on its sheet."""

    crossing: int
    x: float
    y: float
    hole_mm: float


@record
class RimPieceRecord:
    """A piece of a ring, and the file that it is cut from."""

    id: str
    sheet: str
    holes: tuple[RimHole, ...]


@record
class RingRecord:
    """A ring around an opening."""

    side: str
    opening_mm: float
    width_mm: float
    slope_deg: float
    off_mm: float
    thickness_mm: float
    pieces: tuple[RimPieceRecord, ...]


@record
class RimRecord:
    """The rings of a job: ``rim/rim.json``."""

    schema: str = "fabweave.rim/1"
    units: str = "mm"
    rings: tuple[RingRecord, ...]


def rim_record(rings: Sequence[RimRing], layout: Layout) -> RimRecord:
    """Return what rim.json holds of rings whose pieces are laid out."""
    placements = iter(layout.placements)
    return RimRecord(
        rings=tuple(
            RingRecord(
                side=ring.side,
                opening_mm=ring.opening_mm,
                width_mm=ring.width_mm,
                slope_deg=ring.slope_deg,
                off_mm=ring.off_mm,
                thickness_mm=ring.thickness_mm,
                pieces=tuple(_record(piece, next(placements)) for piece in ring.pieces),
            )
            for ring in rings
        )
    )


def _record(piece: RingPiece, placement: Placement) -> RimPieceRecord:
    """Return a piece where it stands on its sheet."""
    places = placement.apply(piece.holes[:, :2]).round(_DECIMALS).tolist()
    return RimPieceRecord(
        id=piece.id,
        sheet=f"rim_{placement.sheet + 1:02d}",
        holes=tuple(
            RimHole(crossing=crossing, x=x, y=y, hole_mm=diameter)
            for crossing, (x, y), diameter in zip(
                piece.crossings.tolist(), places, piece.holes[:, 2].tolist(), strict=True
            )
        ),
    )


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


def rim_notes(rings: Sequence[RimRing]) -> list[str]:
    """Say which rings there are.

    Examples
    --------
    >>> rim_notes([])
    []
    """
    return [
        f"ring at the {ring.side}: "
        + agree(len(ring.pieces), "{n} piece[|s]")
        + f" ({', '.join(piece.id for piece in ring.pieces)}) of {ring.width_mm:.1f} mm, "
        f"{ring.slope_deg:.0f}° from flat, around an opening of {ring.opening_mm:.1f} mm, "
        f"over {len(set(ring.crossings.tolist()))} fasteners; the strands there lie "
        f"within {max(ring.off_mm, 0.05):.1f} mm of it. rim/{TEXT} says how it is laid, as the "
        "last step. It is cut from sheets of its own, which cost what waste.html says, on top of "
        "the rest"
        for ring in rings
    ]
