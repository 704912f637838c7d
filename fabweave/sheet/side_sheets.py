"""Nest and draw what is cut beside the pieces, on sheets of its own: rings, and formers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.nesting import nest
from fabweave.sheet.drawing import PieceDrawing, SheetDrawing
from fabweave.sheet.kerf import kerfed_sheets
from fabweave.sheet.labels.lettering import lettered
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.sheet_notes import sheet_notes
from fabweave.stock.material import Material
from fabweave.stock.rotations import AUTO, parse_rotations
from fabweave.stock.supplies import Supply


@frozen_value
class SideSheets:
    """Sheets beside those of the pieces, in a folder of their own.

    Parameters
    ----------
    folder : str
        Its name, and that of its sheets before their numbers.
    material : Material
    layout : Layout
    areas_mm2 : tuple of float
        Of what lies on them, without holes.
    drawings, kerfed : tuples of SheetDrawing
        Nominal, and as they are cut, where that differs.
    record : mapping
        What ``rim.json`` or the like holds.
    text : str
        What ``rim.txt`` or the like says to people.
    """

    folder: str
    material: Material
    layout: Layout
    areas_mm2: tuple[float, ...]
    drawings: tuple[SheetDrawing, ...]
    kerfed: tuple[SheetDrawing, ...]
    record: Mapping[str, Any]
    text: str


def side_sheets(
    folder: str,
    title: str,
    outlines: Sequence[FloatArray],
    areas_mm2: Sequence[float],
    draw: Callable[[Placement], PieceDrawing],
    supply: Supply,
    machine: MachineSettings,
    *,
    ids: Sequence[str],
    margin_mm: float,
    rotations: str = AUTO,
    record: Callable[[Layout], Mapping[str, Any]],
    text: str,
) -> SideSheets:
    """Nest flat parts on sheets of a supply, and draw these.

    Parameters
    ----------
    folder, title : str
        Where they are written, and the title of the job.
    outlines : sequence of (K, 2) float arrays
    areas_mm2 : sequence of float
    draw : callable
        Draws the part that a placement names, where it stands.
    supply : Supply
    machine : MachineSettings
    ids : sequence of str
    margin_mm : float
    rotations : str
    record : callable
        Returns what tells machines of the parts, from where they lie.
    text : str
        What tells people of them.

    Raises
    ------
    CannotMakeError
        If a part fits no sheet, or sheets run out.
    """
    layout = nest(
        outlines,
        supply.sheets,
        margin_mm=margin_mm,
        gap_mm=supply.gap_mm,
        effort="quick",
        ids=ids,
        rotations=parse_rotations(rotations),
    )
    drawn: list[list[PieceDrawing]] = [[] for _ in layout.sheets]
    for placement in layout.placements:
        drawn[placement.sheet].append(draw(placement))
    drawings = []
    for number, (sheet, own) in enumerate(zip(layout.sheets, drawn, strict=True)):
        notes = sheet_notes(
            # Whichever way the grain goes.
            replace(sheet, grain_deg=None),
            [f"{lettered(title)} {folder.upper()} {number + 1}/{len(layout.sheets)}".strip()],
            margin_mm=margin_mm,
            pieces=own,
        )
        drawings.append(
            SheetDrawing(
                name=sheet_name(folder, number),
                width_mm=sheet.width_mm,
                height_mm=sheet.height_mm,
                pieces=tuple(own),
                notes=notes.drawn,
                left_out=notes.left_out,
            )
        )
    kerfed = kerfed_sheets(drawings, machine.kerf_mm, machine.micro_joints)
    return SideSheets(
        folder,
        supply.material,
        layout,
        tuple(areas_mm2),
        tuple(drawings),
        kerfed,
        record(layout),
        text,
    )


def sheet_name(folder: str, number: int) -> str:
    """Return what a sheet of a folder is called; numbers count from 0.

    Examples
    --------
    >>> sheet_name("rim", 0)
    'rim_01'
    """
    return f"{folder}_{number + 1:02d}"
