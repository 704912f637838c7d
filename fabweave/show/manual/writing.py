"""Write the manual: everything that a person needs beside the pieces, on paper."""

from collections.abc import Sequence
from pathlib import Path

from fabweave.core.colour_space import Colours
from fabweave.picture.camera import View
from fabweave.piece.piece import Piece
from fabweave.piece.rim_ring import RimRing
from fabweave.plan.crossing_map import CrossingMap
from fabweave.plan.extent import MOST_PICTURED
from fabweave.ribbon.project import Ribbons
from fabweave.sheet.drawing import SheetDrawing
from fabweave.show.manual.book import Book
from fabweave.show.manual.cover import Facts, write_cover
from fabweave.show.manual.legend import write_legend
from fabweave.show.manual.painting import build_scene
from fabweave.show.manual.parts_list import write_parts
from fabweave.show.manual.sheets import drawn_pieces, write_sheets
from fabweave.show.manual.step_pictures import WholePicture, step_pictures
from fabweave.show.manual.steps import write_steps
from fabweave.show.manual.thread_map import write_map
from fabweave.weave.pattern import Weave


def manual_pdf(
    crossing_map: CrossingMap,
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    pictures: Sequence[WholePicture],
    seconds: Sequence[float],
    *,
    paper: str = "a4",
    rings: Sequence[RimRing] = (),
) -> bytes:
    """Return the manual as a PDF.

    Overview, how to read a piece, threads with all that their pieces meet, parts list, a page or
    more for each sheet, and the steps.

    Parameters
    ----------
    crossing_map : CrossingMap
    facts : Facts
        What it tells besides.
    drawings : sequence of SheetDrawing
        The sheets.
    pictures : sequence of WholePicture
        Of all steps; none if they are too many.
    seconds : sequence of float
        About how long each step takes.
    paper : {"a4", "letter"}
    rings : sequence of RimRing
        Those of the last steps.

    Returns
    -------
    bytes
        The same for the same input. Its texts are in the fonts that every reader has.
    """
    book = Book(paper, facts.title)
    write_cover(book, crossing_map, facts)
    write_legend(book, crossing_map, drawn_pieces(*drawings))
    write_map(book, crossing_map, facts.colours)
    write_parts(book, crossing_map, drawings)
    write_sheets(book, crossing_map, drawings)
    write_steps(book, crossing_map, pictures, seconds, rings)
    return book.finish()


def write_manual(
    path: Path,
    crossing_map: CrossingMap,
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    woven: tuple[Ribbons, Weave, Sequence[Piece], Colours],
    seconds: Sequence[float],
    paper: str,
    rings: Sequence[RimRing],
) -> tuple[View, ...]:
    """Make the pictures of the steps, unless they are too many, and write the manual.

    Returns
    -------
    tuple of View
        From where each step is seen, for others that show it; nothing of those without a picture.
    """
    pictures: Sequence[WholePicture] = ()
    if len(crossing_map.steps) <= MOST_PICTURED:
        ribbons, weave, pieces, colours = woven
        scene = build_scene(ribbons, weave, pieces, crossing_map, colours)
        pictures = step_pictures(scene, crossing_map)
    data = manual_pdf(crossing_map, facts, drawings, pictures, seconds, paper=paper, rings=rings)
    path.write_bytes(data)
    return tuple(picture.view for picture in pictures for _ in picture.steps)
