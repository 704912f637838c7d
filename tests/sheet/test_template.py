"""A sheet at full size is a PDF in true millimetres, whole or in tiles."""

import re

import numpy as np
import pytest
from pypdf import PdfReader
from pypdf.generic import ContentStream
from read_template import read_template

from fabweave.sheet.drawing import Circle, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.write.template import PAPERS_MM, page_tiles, template_pdf, window_sizes

MM = 72.0 / 25.4


@pytest.fixture
def drawing():
    half = np.array([[100.0, 20.0], [140.0, 20.0], [140.0, 90.0], [100.0, 90.0]])
    outline = Polyline(Layer.CUT_OUTER, half, True, np.array([0.0, 0.3, 0.0, -0.2]))
    hole = Circle(Layer.CUT_INNER, 120.0, 50.0, 4.0)
    frame = np.array([[0.0, 0], [600, 0], [600, 400], [0, 400]])
    note = Polyline(Layer.NOTES, frame, closed=True)
    return SheetDrawing("sheet_01", 600.0, 400.0, (PieceDrawing("A1", (hole, outline)),), (note,))


def test_one_page_is_the_sheet(drawing, tmp_path):
    (tmp_path / "a.pdf").write_bytes(template_pdf(drawing))
    (page,) = PdfReader(tmp_path / "a.pdf").pages
    size = [float(side) / MM for side in page.mediabox.upper_right]
    assert size == pytest.approx([600.0, 400.0], abs=1e-3)
    read = read_template(tmp_path / "a.pdf")
    for corner in [*drawing.pieces[0].entities[1].points, (124.0, 50.0), (600.0, 400.0)]:
        assert np.hypot(*(read.points - corner).T).min() < 1e-3


def test_printers_are_told_not_to_scale(drawing, tmp_path):
    for paper in ("sheet", "a4"):
        (tmp_path / "a.pdf").write_bytes(template_pdf(drawing, paper))
        told = PdfReader(tmp_path / "a.pdf").trailer["/Root"]["/ViewerPreferences"]
        assert told["/PrintScaling"] == "/None"


def test_a_sheet_of_more_than_five_metres_has_pages_of_a_larger_unit(tmp_path):
    roll = sheet(strip("A1", 10.0, 10.0, 11900.0, 80.0), size=(12000.0, 300.0))
    (tmp_path / "a.pdf").write_bytes(template_pdf(roll))
    reader = PdfReader(tmp_path / "a.pdf")
    (page,) = reader.pages
    assert reader.pdf_header == "%PDF-1.6"
    assert page.user_unit == 3
    assert max(page.mediabox.upper_right) <= 14400
    size = [float(side) * page.user_unit / MM for side in page.mediabox.upper_right]
    assert size == pytest.approx([12000.0, 300.0], abs=1e-2)
    ((values, _),) = [
        step for step in ContentStream(page["/Contents"], reader).operations
        if step[1] == b"cm" and float(step[0][0]) != 1.0
    ]  # fmt: skip
    assert [float(each) * page.user_unit for each in values] == pytest.approx(
        [1, 0, 0, 1, 0, 0], abs=1e-8
    )


def strip(name, x, y, wide, high):
    corners = np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]], dtype=float)
    return PieceDrawing(name, (Polyline(Layer.CUT_OUTER, corners, closed=True),))


def sheet(*pieces, size=(600.0, 400.0)):
    return SheetDrawing("sheet_01", *size, pieces, ())


def shown_by(tiles):
    return np.array([window.corners for window in tiles.windows])


@pytest.mark.parametrize("paper", sorted(PAPERS_MM))
def test_pages_show_a_paper_upright_or_on_its_side_within_its_border(drawing, paper, tmp_path):
    (tmp_path / "a.pdf").write_bytes(template_pdf(drawing, paper))
    read = read_template(tmp_path / "a.pdf")
    (window,) = page_tiles(drawing, paper).windows
    sizes = np.array(window_sizes(paper))
    assert read.pages[0] - [10.0, 14.0] == pytest.approx([window.wide, window.high], abs=1e-3)
    assert np.abs(sizes - [window.wide, window.high]).sum(axis=1).min() < 1e-9
    assert np.sort(read.pages[0]) == pytest.approx(sorted(PAPERS_MM[paper]), abs=1e-3)
    assert read.windows[0, :2] == pytest.approx([5.0, 9.0], abs=1e-3)
    assert [5.0, 9.0] - read.origins[0] == pytest.approx([window.left, window.low], abs=1e-3)
    corners = drawing.pieces[0].entities[1].flattened(0.1)
    assert np.all(corners > window.corners[:2])
    assert np.all(corners < window.corners[2:])


@pytest.mark.parametrize(
    ("pieces", "count"),
    [
        ([(10, 10, 280, 180)], 1),  # fits on its side alone
        ([(10, 10, 180, 280)], 1),  # upright alone
        ([(10, 10, 90, 180), (105, 10, 90, 180), (200, 10, 90, 180)], 1),
        ([(10, 10, 280, 180), (10, 200, 280, 180), (300, 10, 280, 180), (300, 200, 280, 180)], 4),
        ([(10, 10, 180, 10), (400, 380, 180, 10)], 2),
        ([], 1),
    ],
)
def test_pieces_that_fit_are_whole_on_as_few_pages_as_can_be(pieces, count):
    drawing = sheet(*(strip(f"A{at}", *piece) for at, piece in enumerate(pieces)))
    tiles = page_tiles(drawing, "a4")
    assert len(tiles.windows) == count
    assert tiles.pairs == ()
    shown = shown_by(tiles)
    for x, y, wide, high in pieces:
        box = np.array([x - 1, y - 1, x + wide + 1, y + high + 1])
        assert np.any(np.all((shown[:, :2] <= box[:2]) & (box[2:] <= shown[:, 2:]), axis=1))


def test_a_sheet_full_of_long_pieces_takes_six_pages_not_eight():
    drawing = sheet(*(strip(f"A{at}", 10, 10 + 20 * at, 580, 18) for at in range(19)))
    tiles = page_tiles(drawing, "a4")
    # A regular tiling with upright pages takes four times two.
    assert len(tiles.windows) == 6
    # Each place of a piece, with 5 mm around it as far as there is any, is on one page.
    shown = shown_by(tiles)
    for x in np.arange(10.0, 590.0, 2.0):
        for at in range(19):
            for y in 10 + 20 * at + np.array([0.0, 9.0, 18.0]):
                low = np.maximum([x - 5, y - 5], [9, 9 + 20 * at])
                high = np.minimum([x + 5, y + 5], [591, 29 + 20 * at])
                assert np.any(np.all((shown[:, :2] <= low) & (high <= shown[:, 2:]), axis=1))
    # Every page is laid to another, and all hang together.
    joined = {0}
    for _ in tiles.windows:
        joined |= {page for pair in tiles.pairs if set(pair) & joined for page in pair}
    assert joined == set(range(6))


def test_pages_that_are_laid_together_have_crosses_at_the_same_places_of_the_sheet(tmp_path):
    drawing = sheet(strip("A1", 10, 10, 500, 40))
    (tmp_path / "a.pdf").write_bytes(template_pdf(drawing, "a4"))
    assert page_tiles(drawing, "a4").pairs == ((0, 1),)
    origins = read_template(tmp_path / "a.pdf").origins
    places = []
    for page, origin in zip(PdfReader(tmp_path / "a.pdf").pages, origins, strict=True):
        content = page.get_contents().get_data().decode()
        lines = re.findall(r"n ([-\d.]+) ([-\d.]+) m ([-\d.]+) ([-\d.]+) l S", content)
        ends = np.array(lines, dtype=float).reshape(-1, 2, 2) / MM - origin
        level = ends[np.abs(np.ptp(ends, axis=1) - [8.0, 0.0]).max(axis=1) < 1e-2]
        places.append(level.mean(axis=1))
        assert f"page {len(places)} of 2, to print at 100 %" in page.extract_text()
        bar = np.ptp(ends, axis=1)[:, 0].max()
        assert bar == pytest.approx(50.0, abs=1e-3)
    assert len(places[0]) == 2
    assert places[0] == pytest.approx(places[1], abs=0.01)


def test_the_same_sheet_is_the_same_file(drawing, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(template_pdf(drawing, "a4"))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
