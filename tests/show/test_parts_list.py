"""The parts list of the manual says where the pieces of every kind lie, however many there are."""

import re
from dataclasses import replace

import pytest
from jobs import make_job, quick_jobs
from pypdf import PdfReader

from fabweave.job.write import job_map
from fabweave.options.settings import Settings
from fabweave.show.manual.book import Book
from fabweave.show.manual.parts_list import PARTS, write_parts


@pytest.fixture(scope="module")
def cube():
    with quick_jobs():
        job = make_job(Settings.of("shape:cube", size_mm=120.0, effort="quick"))
    return job_map(job), job.drawings[0]


@pytest.mark.parametrize(("count", "on_each", "pages"), [(12, 4, 1), (3000, 5, 12)])
def test_a_kind_goes_on_over_pages(cube, tmp_path, count, on_each, pages):
    crossing_map, drawing = cube
    pattern, sheet = crossing_map.pieces[0], crossing_map.sheets[0]
    pieces = tuple(
        replace(pattern, id=f"A{n + 1}", kind=1, sheet=1 + n // on_each) for n in range(count)
    )
    sheets = tuple(
        replace(sheet, sheet=n + 1, name=f"sheet_{n + 1:03}") for n in range(count // on_each)
    )
    drawn = next(piece for piece in drawing.pieces if piece.piece_id == pattern.id)
    alike = tuple(replace(drawn, piece_id=piece.id) for piece in pieces)
    # Another kind stands after it.
    other = next(piece for piece in crossing_map.pieces if piece.id != pattern.id)
    last = next(piece for piece in drawing.pieces if piece.piece_id == other.id)
    plan = replace(crossing_map, pieces=(*pieces, replace(other, id="B1", kind=2)), sheets=sheets)
    book = Book("a4", "Many")
    write_parts(book, plan, [replace(drawing, pieces=(*alike, replace(last, piece_id="B1")))])
    path = tmp_path / "parts.pdf"
    path.write_bytes(book.finish())

    read = [page.extract_text() for page in PdfReader(path).pages]
    words = " ".join(read).split()
    assert [word for word in words if re.fullmatch(r"A\d+", word)][-count:] == [
        piece.id for piece in pieces
    ]
    assert [word for word in words if re.fullmatch(r"sheet_\d+:", word)] == [
        f"{one.name}:" for one in sheets
    ]
    assert words.count("B1") == 1
    assert all(PARTS in page for page in read)
    assert len(read) == pages
