"""Write the manual: everything that a person needs beside the pieces, on paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fabweave.assembly.manual.book import Book
from fabweave.assembly.manual.cover import Facts, write_cover, write_legend
from fabweave.assembly.manual.sheets import drawn_pieces, write_parts, write_sheets
from fabweave.assembly.manual.steps import write_steps
from fabweave.assembly.manual.tables import write_tables
from fabweave.assembly.manual.thread_map import write_map
from fabweave.assembly.manual.views import StepPicture, step_pictures
from fabweave.cut.drawing import SheetDrawing
from fabweave.flat.piece import Piece
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave


def manual_pdf(
    plan: dict[str, Any],
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    pictures: Sequence[StepPicture],
    *,
    paper: str = "a4",
) -> bytes:
    """Return the manual as a PDF.

    Overview, how to read a piece, threads, parts list, a page or more for each sheet, the steps,
    and a table of stations for each piece.

    Parameters
    ----------
    plan : dict
        The crossing map.
    facts : Facts
        What it tells besides.
    drawings : sequence of SheetDrawing
        The sheets.
    pictures : sequence of StepPicture
        One for each step.
    paper : {"a4", "letter"}

    Returns
    -------
    bytes
        The same for the same input. Its texts are in the fonts that every reader has.
    """
    book = Book(paper, facts.title)
    write_cover(book, plan, facts)
    drawn = {key: one for drawing in drawings for key, one in drawn_pieces(drawing).items()}
    write_legend(book, plan, drawn)
    write_map(book, plan, facts.colours)
    write_parts(book, plan, drawings)
    write_sheets(book, plan, drawings)
    write_steps(book, plan, list(pictures))
    write_tables(book, plan)
    return book.finish()


def write_manual(
    path: Path,
    plan: dict[str, Any],
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    woven: tuple[Ribbons, Weave, Sequence[Piece]],
    paper: str,
) -> None:
    """Make the pictures of the steps and write the manual; see ``manual_pdf``."""
    pictures = step_pictures(*woven, plan)
    path.write_bytes(manual_pdf(plan, facts, drawings, pictures, paper=paper))
