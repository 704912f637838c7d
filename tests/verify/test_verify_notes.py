"""Notes off the sheet, over pieces, or too small are found; others are good, however fine."""

import numpy as np
import pytest
from sealing import found_by

from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.sheet_notes import sheet_notes
from fabweave.stock.sheet_size import SheetSize
from fabweave.verify.check.notes import check_notes
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

#: The specimen's sheet; nothing is cut in its uppermost strip.
WIDE, HIGH = 600.0, 400.0
FREE = np.array([300.0, 385.0])


def found(folder, lines) -> str:
    """Add lines to the notes of the first sheet, and say what is found."""
    path = folder / "sheets" / "sheet_01.dxf"
    drawn = ""
    for line in lines:
        drawn += f"  0\nLWPOLYLINE\n  8\nNOTES\n 90\n{len(line)}\n 70\n0\n"
        drawn += "".join(f" 10\n{x:.4f}\n 20\n{y:.4f}\n" for x, y in np.asarray(line).tolist())
    head = "  2\nENTITIES\n"
    path.write_text(path.read_text().replace(head, head + drawn, 1))
    return found_by(check_notes, load_job(folder, Tally("files")))


@pytest.mark.parametrize("margin", [0.0, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("grain", [None, 0.0, 37.0, 90.0])
def test_notes_of_sheets_are_good(job, margin, grain):
    texts = ["A SHEET 1/1 CARD", "● THIS PIECE PASSES OVER, ○ UNDER"]
    for size in ((400.0, 12.0), (25.0, 12.0)):
        notes = sheet_notes(SheetSize(*size, grain_deg=grain), texts, margin_mm=margin)
        corner = FREE - [290.0, 0.0]
        assert found(job(), [note.points + corner for note in notes.drawn[1:]]) == ""


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (place_text("TITLE", 0.5, FREE, 30.0), "letters are 0.6"),
        (place_text("TITLE", 2.5, (WIDE, 385.0), 0.0), "is not within the sheet"),
        ([[(-9.0, 385.0), (-9.0, 390.0)]], "is not within the sheet"),
        ([[(1.0, 1.0), (WIDE - 1.0, HIGH - 1.0)]], "a note runs over a piece"),
    ],
    ids=["tiny", "half-out", "out", "over-pieces"],
)
def test_spoilt_notes_are_found(job, lines, words):
    assert words in found(job(), lines)
