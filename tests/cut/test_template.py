"""A sheet at full size is a PDF in true millimetres, whole or in tiles."""

import numpy as np
import pytest
from pypdf import PdfReader

from fabweave.cut.drawing import Circle, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.write.template import PAPERS_MM, template_pdf, tiles
from fabweave.verify.read.template import read_template

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


@pytest.mark.parametrize("paper", sorted(PAPERS_MM))
def test_tiles_lap_by_ten_millimetres_and_show_everything(drawing, paper, tmp_path):
    (tmp_path / "a.pdf").write_bytes(template_pdf(drawing, paper))
    read = read_template(tmp_path / "a.pdf")
    columns, rows = tiles(paper, 600.0, 400.0)
    assert len(read.pages) == len(PdfReader(tmp_path / "a.pdf").pages) == columns * rows
    assert read.pages == pytest.approx(np.tile(PAPERS_MM[paper], (columns * rows, 1)), abs=1e-3)
    for axis, count, whole in ((0, columns, 600.0), (1, rows, 400.0)):
        starts = np.unique((10.0 - read.origins[:, axis]).round(2))
        shown = PAPERS_MM[paper][axis] - 20.0
        assert len(starts) == count
        assert np.diff(starts) == pytest.approx([shown - 10.0] * (count - 1), abs=0.02)
        assert starts[-1] + shown >= whole
        # One row fewer would not have done.
        assert count == 1 or starts[-2] + shown < whole


def test_the_same_sheet_is_the_same_file(drawing, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(template_pdf(drawing, "a4"))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
