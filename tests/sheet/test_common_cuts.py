"""What pieces side by side share is cut once, and nothing is left uncut."""

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.sheet.drawing import Circle, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.kerf import with_common_cuts

ROWS = st.lists(
    st.lists(st.integers(3, 60), min_size=1, max_size=5), min_size=1, max_size=5
)  # fmt: skip


def sheet(rows, wide=7.0):
    """Return rows of strips that lie edge on edge; strips of a row end on end."""
    pieces = []
    for number, row in enumerate(rows):
        ends = np.cumsum([0, *row])
        for start, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            low, high = number * wide, (number + 1) * wide
            corners = np.array([[start, low], [end, low], [end, high], [start, high]], dtype=float)
            hole = Circle(Layer.CUT_INNER, (start + end) / 2, (low + high) / 2, 0.5)
            outline = Polyline(Layer.CUT_OUTER, corners, closed=True)
            pieces.append(PieceDrawing(f"P{len(pieces)}", (hole, outline)))
    return SheetDrawing("sheet_01", 300.0, 40.0, tuple(pieces), ())


@given(ROWS, st.randoms(use_true_random=False))
def test_all_outlines_are_cut_and_each_line_once(rows, random):
    drawing = sheet(rows)
    pieces = list(drawing.pieces)
    random.shuffle(pieces)
    outlines = [shapely.LinearRing(piece.entities[1].points) for piece in pieces]
    cut = with_common_cuts(SheetDrawing("sheet_01", 300.0, 40.0, tuple(pieces), ()))
    runs = [
        shapely.LineString(entity.points)
        for piece in cut.pieces
        for entity in piece.entities
        if entity.layer is Layer.CUT_OUTER
    ]
    there, due = shapely.union_all(runs), shapely.union_all(outlines)
    assert there.symmetric_difference(due).length < 1e-6
    assert sum(run.length for run in runs) - due.length < 1e-6
    assert [piece.entities[0] for piece in cut.pieces] == [piece.entities[0] for piece in pieces]


def test_what_shares_nothing_stays_in_one_run():
    cut = with_common_cuts(sheet([[20]]))
    (run,) = (one for one in cut.pieces[0].entities if one.layer is Layer.CUT_OUTER)
    assert len(run.points) == 5
    assert run.points[0].tolist() == run.points[-1].tolist()
