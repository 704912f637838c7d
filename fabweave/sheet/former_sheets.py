"""Draw a former on sheets of its own, and say how it is put together and comes out."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.nest.layout import Placement
from fabweave.piece.congruence import DECIMALS
from fabweave.piece.former import Former, Laid, Mark, Plate
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline
from fabweave.sheet.labels.lettering import place_text, text_box
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.side_sheets import SideSheets, sheet_name, side_sheets
from fabweave.stock.supplies import Supply

#: The folder of a former in a job's folder, and the files that tell of it.
FOLDER, RECORD, TEXT = "former", "former.json", "former.txt"
#: What is said of a former that nothing lets out.
STAYS = "The former stays inside: no gap is wide enough for a hand and for its parts."
#: How high names are, of large plates and others; and how long a tick is, millimetres. The radius
#: of a circle that a large plate has room for.
_OWN_MM, _NAME_MM, _TICK_MM, _LARGE_MM = 5.0, 2.5, 3.0, 20.0
#: A name keeps so far off a cut, and off another name, and an edge is there to this, millimetres.
_ROOM_MM, _APART_MM, _ON_EDGE_MM = 0.8, 1.0, 0.02


def former_sheets(
    laid: Laid,
    pieces: Sequence[Piece],
    supply: Supply,
    machine: MachineSettings,
    title: str,
    margin_mm: float,
) -> SideSheets:
    """Nest the plates of a former on sheets of their own, and draw these.

    Raises
    ------
    CannotMakeError
        If a plate fits no sheet, or sheets run out.
    """
    plates = laid.former.plates
    return side_sheets(
        FOLDER,
        title,
        [np.array(plate.outline.exterior.coords)[:-1] for plate in plates],
        [plate.outline.area for plate in plates],
        lambda placement: _drawn(laid.former, plates[placement.piece], pieces, placement),
        supply,
        machine,
        ids=[plate.id for plate in plates],
        margin_mm=margin_mm,
    )


def with_room(laid: Laid, pieces: Sequence[Piece]) -> Laid:
    """Return a former without the marks whose names have no room on their plates, and these."""
    plates, unnamed = [], []
    for plate in laid.former.plates:
        named = _lettered(laid.former, plate, pieces)[1]
        plates.append(replace(plate, marks=named))
        unnamed += [(plate.id, pieces[one.piece].id) for one in plate.marks if one not in named]
    return Laid(replace(laid.former, plates=tuple(plates)), laid.way, tuple(unnamed))


def _lettered(
    former: Former, plate: Plate, pieces: Sequence[Piece]
) -> tuple[list[FloatArray], tuple[Mark, ...]]:
    """Return the strokes of all names on a plate, and the marks whose names have room.

    A name stands at its place, or, where another is in the way, behind that one.
    """
    room = plate.outline.buffer(-_ROOM_MM)
    strokes: list[FloatArray] = []
    named: list[Mark] = []
    taken: list[shapely.Geometry] = []

    def place(name: str, point: FloatArray, way: FloatArray, height: float, off: float) -> bool:
        width = text_box(name, height).width
        # Upright or read from the right, whichever way it goes in.
        turn = (np.degrees(np.arctan2(way[1], way[0])) + 90.0) % 180.0 - 90.0
        across = np.array([-way[1], way[0]]) * height / 2.0
        along = way * width / 2.0
        centre = point + (off * way + along if off else 0.0)
        box = shapely.Polygon(
            [centre - along - across, centre + along - across, centre + along + across,
             centre - along + across]
        )  # fmt: skip
        if not room.contains(box) or any(box.intersects(other) for other in taken):
            return False
        taken.append(box.buffer(_APART_MM, join_style="mitre"))
        strokes.extend(place_text(name, height, centre, turn))
        return True

    circle = shapely.maximum_inscribed_circle(plate.outline, tolerance=0.5)
    middle = np.array(circle.coords[0])
    height = _OWN_MM if circle.length > _LARGE_MM else _NAME_MM
    place(plate.id, middle, np.array([1.0, 0.0]), height, 0.0)
    for join in plate.joins:
        place(former.plates[join.plate].id, join.point, join.way, _NAME_MM, 2.0)
    # A row of slits may have cut the edge away.
    edge = plate.outline.boundary
    left = [m for m in plate.marks if edge.distance(shapely.Point(m.point)) < _ON_EDGE_MM]
    for behind in (False, True):
        for mark in tuple(left):
            name = pieces[mark.piece].id
            off = _TICK_MM + 1.0
            off += text_box(name, _NAME_MM).width + 2.0 * _APART_MM if behind else 0.0
            if place(name, mark.point, mark.inward, _NAME_MM, off):
                named.append(mark)
                left.remove(mark)
    return strokes, tuple(named)


def _drawn(
    former: Former, plate: Plate, pieces: Sequence[Piece], placement: Placement
) -> PieceDrawing:
    """Return the entities of a plate where it stands: names, ticks, slits, outline."""
    strokes, named = _lettered(former, plate, pieces)
    ticks = [np.array([m.point + 0.3 * m.inward, m.point + _TICK_MM * m.inward]) for m in named]
    lines = [Polyline(Layer.ENGRAVE_LABEL, placement.apply(stroke)) for stroke in strokes]
    lines += [Polyline(Layer.ENGRAVE_MARK, placement.apply(tick)) for tick in ticks]
    rings = [(Layer.CUT_INNER, ring) for ring in plate.outline.interiors]
    rings.append((Layer.CUT_OUTER, plate.outline.exterior))
    lines += [
        Polyline(layer, placement.apply(np.array(ring.coords)[:-1]), closed=True)
        for layer, ring in rings
    ]
    return PieceDrawing(plate.id, tuple(lines))


def former_record(laid: Laid, sheets: SideSheets, pieces: Sequence[Piece]) -> dict[str, Any]:
    """Return what ``former/former.json`` holds.

    Of each plate it tells the sheet, and how that lies in space: a point (x, y) of the sheet is at
    ``origin`` + x times the first of ``axes`` + y times the second.
    """
    former, way = laid.former, laid.way
    return {
        "schema": "fabweave.former/1",
        "units": "mm",
        "material": sheets.material.name,
        "thickness_mm": former.thickness_mm,
        "way_out": None
        if way is None
        else {
            "at": way.at.round(DECIMALS).tolist(),
            "inward": way.inward.round(DECIMALS).tolist(),
            "wide_mm": round(way.wide_mm, DECIMALS),
            "deep_mm": round(way.deep_mm, DECIMALS),
            "before": way.before,
        },
        "sheets": [
            {
                "name": drawing.name,
                "width_mm": drawing.width_mm,
                "height_mm": drawing.height_mm,
                "margin_mm": sheets.layout.margin_mm,
                "gap_mm": sheets.layout.gap_mm,
            }
            for drawing in sheets.drawings
        ],
        "plates": [
            _record(plate, former, pieces, placement)
            for plate, placement in zip(former.plates, sheets.layout.placements, strict=True)
        ],
    }


def _record(
    plate: Plate, former: Former, pieces: Sequence[Piece], placement: Placement
) -> dict[str, Any]:
    """Return a plate where it stands on its sheet."""

    def at(points: FloatArray) -> list[Any]:
        placed: list[Any] = placement.apply(np.atleast_2d(points)).round(DECIMALS).tolist()
        return placed

    corners = placement.apply(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    turned = (corners[1:] - corners[0]).T @ plate.plane.axes
    return {
        "id": plate.id,
        "spine": plate.spine,
        "sheet": sheet_name(FOLDER, placement.sheet),
        "origin": (plate.plane.origin - corners[0] @ turned).round(DECIMALS).tolist(),
        "axes": turned.round(12).tolist(),
        "slots": [
            {"plate": former.plates[join.plate].id, "end": at(join.point)[0]}
            for join in plate.joins
        ],
        "strips": [
            {"piece": pieces[mark.piece].id, "at": at(mark.point)[0]} for mark in plate.marks
        ],
        "snaps": [at(line) for line in plate.snaps],
    }


def former_notes(laid: Laid | None) -> list[Note]:
    """Say which names have no room on a former, and that it stays inside, if it does."""
    if laid is None:
        return []
    stays = [STAYS] if laid.way is None else []
    return Note.each("former", (f"former: {text}" for text in (*_unnamed(laid), *stays)))


def _unnamed(laid: Laid) -> list[str]:
    """Say which strips pass plates on which their names have no room."""
    if not laid.unnamed:
        return []
    named = sum(len(plate.marks) for plate in laid.former.plates)
    told = f"Of {named + len(laid.unnamed)} names, {len(laid.unnamed)} had no room, on "
    return [told + f"{', '.join(dict.fromkeys(plate for plate, _ in laid.unnamed))}."]


def former_steps(laid: Laid, order: Sequence[str]) -> list[str]:
    """Say how a former is put together, used and taken out, a sentence or two each.

    Parameters
    ----------
    laid : Laid
    order : sequence of str
        The ids of pieces in the order of assembly.
    """
    plates, way = laid.former.plates, laid.way
    slices = [plate.id for plate in plates if not plate.spine]
    spines = [plate.id for plate in plates if plate.spine]
    breaks = [plate.id for plate in plates if plate.snaps]
    told = [
        f"Hold the {agree(len(spines), 'spine[|s]')} {', '.join(spines)} as in the picture. Push "
        f"on the slices one by one, {slices[0]} to {slices[-1]}, slot into slot: beside each slot "
        "stands the name of what goes into it.",
        " ".join(
            ["Lay each strip where ticks on the edges bear its name.", *_unnamed(laid),
             "Fasten as the steps say."]
        ),
    ]  # fmt: skip
    if way is None:
        return [*told, STAYS]
    apart = "break the former along its rows of slits" if breaks else "pull the former apart"
    where = (
        "When all strips are in place"
        if way.before is None
        else f"Before you place {order[way.before]}"
    )
    out = f"take its parts out through the {way.gap}, which is {way.wide_mm:.0f} mm wide"
    return [*told, f"{where}, {apart}, and {out}."]
