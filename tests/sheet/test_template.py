"""A sheet at full size is a PDF in true millimetres, whole or in tiles."""

import io

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from pypdf import PdfReader
from pypdf.generic import ContentStream
from read_template import read_template
from strategies import at_most

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
        ([(10, 10, 180, 10), (400, 380, 180, 10)], 2),  # the other four are empty
        ([(10, 10, 580, 380)], 6),
        ([], 1),
    ],
)
def test_pages_are_a_grid_without_the_empty_ones(pieces, count):
    drawing = sheet(*(strip(f"A{at}", *piece) for at, piece in enumerate(pieces)))
    assert len(page_tiles(drawing, "a4").windows) == count


def some_pieces():
    places = st.tuples(st.integers(0, 500), st.integers(0, 320))
    sizes = st.tuples(st.integers(5, 90), st.integers(5, 70)) | st.just((95, 5))
    return st.lists(st.tuples(places, sizes, st.integers(1, 5)), min_size=1, max_size=5)


@given(some_pieces(), st.sampled_from(sorted(PAPERS_MM)))
# A piece that ends just where the next page begins to be the only one.
@example([((93, 0), (95, 5), 2), ((0, 60), (95, 5), 1), ((300, 320), (95, 5), 2)], "a4")
@at_most(25)
def test_each_line_of_a_piece_is_on_a_page_and_marks_join_the_pages(told, paper):
    pieces = [
        strip(f"A{at}", x, y, wide * times, high)
        for at, ((x, y), (wide, high), times) in enumerate(told)
    ]
    drawing = sheet(*pieces, size=(1000.0, 400.0))
    read = read_template(io.BytesIO(template_pdf(drawing, paper)))
    outlines = [shapely.Polygon(piece.entities[0].points) for piece in pieces]
    corner = read.windows[:, :2] - read.origins
    pages = shapely.box(*corner.T, *(corner + read.windows[:, 2:]).T)
    # What is read of the form is what was drawn, and each place of it is on a page, with 5 mm of
    # what is around it, as far as anything is there.
    assert {(*point,) for point in read.points.round(3).tolist()} == {
        (*point,) for outline in outlines for point in outline.exterior.coords
    }
    places = shapely.get_coordinates(shapely.segmentize(outlines, 3.0))
    least, most = shapely.total_bounds(outlines).reshape(2, 2)
    near = shapely.box(
        *np.maximum(places - 4.999, least - 0.999).T, *np.minimum(places + 4.999, most + 0.999).T
    )
    assert shapely.covers(pages[:, None], near).any(axis=0).all()
    # No page is empty.
    assert shapely.intersects(pages[:, None], outlines).any(axis=1).all()
    # Each number is on two pages, where both show the same places of the sheet.
    joined = {}
    for page, crosses in enumerate(read.crosses):
        for number, places in crosses.items():
            joined.setdefault(number, []).append((page, places))
    for (one, places), (other, same) in joined.values():
        assert places == pytest.approx(same, abs=1e-3)
        assert len(places) == 2
        arms = shapely.buffer(shapely.points(places), 4.0)
        assert shapely.covers(pages[[one, other], None], arms).all()
        beside = np.concatenate([*read.crosses[one].values()])
        apart = np.linalg.norm(places[:, None] - beside, axis=2)
        assert np.sort(apart, axis=1)[:, 1:].min(initial=99.0) > 20.0  # no two are mistaken
    # Pages that are pasted together by them show each piece whole.
    patches = [{page} for page in range(len(pages))]
    for (one, _), (other, _) in joined.values():
        parts = [patch for patch in patches if patch & {one, other}]
        patches = [patch for patch in patches if patch not in parts] + [set.union(*parts)]
    pasted = [shapely.union_all(pages[sorted(patch)]) for patch in patches]
    for outline in outlines:
        assert shapely.covers(pasted, outline).any()


def test_a_page_says_which_it_is_and_has_a_bar_to_measure(tmp_path):
    drawing = sheet(strip("A1", 10, 10, 500, 40))
    (tmp_path / "a.pdf").write_bytes(template_pdf(drawing, "a4"))
    assert page_tiles(drawing, "a4").pairs == ((0, 1),)
    lines = read_template(tmp_path / "a.pdf").lines
    for number, page in enumerate(PdfReader(tmp_path / "a.pdf").pages):
        assert f"page {number + 1} of 2, to print at 100 %" in page.extract_text()
        bar = np.ptp(lines[number], axis=1)[:, 0].max()
        assert bar == pytest.approx(50.0, abs=1e-3)


def test_the_same_sheet_is_the_same_file(drawing, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(template_pdf(drawing, "a4"))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
