"""Pieces and what is on them are cut in an order of little travel; nothing is lost on the way."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import at_most

from fabweave.core.arc_path import Path
from fabweave.nest.layout import Layout, Placement
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import Circle, Layer
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.labels.texts import Label
from fabweave.sheet.sheets import draw_sheets, short_route
from fabweave.stock.sheet_size import SheetSize


def way(ends, order, backwards):
    """How far it is to and between the pieces, added up one by one."""
    here, total = np.zeros(2), 0.0
    for piece, back in zip(order, backwards, strict=True):
        enter, leave = ends[piece][::-1] if back else ends[piece]
        total += np.hypot(*(enter - here))
        here = leave
    return total


places = st.floats(0.0, 600.0, allow_subnormal=False)
some_ends = st.integers(0, 9).flatmap(
    lambda n: st.lists(places, min_size=4 * n, max_size=4 * n).map(
        lambda values: np.array(values, dtype=float).reshape(-1, 2, 2)
    )
)


@at_most(60)
@given(some_ends)
def test_every_piece_once_and_no_run_is_shorter_backwards(ends):
    order, backwards = short_route(ends)
    assert sorted(order.tolist()) == list(range(len(ends)))
    length = way(ends, order, backwards)
    for a, b in itertools.combinations(range(len(ends) + 1), 2):
        turned, back = order.copy(), backwards.copy()
        turned[a:b], back[a:b] = order[a:b][::-1], ~backwards[a:b][::-1]
        assert way(ends, turned, back) >= length - 0.002


def test_it_is_not_far_from_the_shortest():
    ratios = []
    for seed in range(20):
        ends = np.random.default_rng(seed).uniform(0.0, 600.0, (4, 2, 2))
        best = min(
            way(ends, some, back)
            for some in itertools.permutations(range(4))
            for back in itertools.product((False, True), repeat=4)
        )
        ratios.append(way(ends, *short_route(ends)) / best)
    assert min(ratios) >= 1.0 - 1e-12
    assert np.mean(ratios) < 1.1
    assert ratios.count(min(ratios)) >= 10


def test_rows_are_walked_to_and_fro():
    # Twelve long pieces, one above the other: each is entered where the one before was left.
    ends = np.array([[[0.0, 10.0 * k], [300.0, 10.0 * k]] for k in range(12)])
    shuffled = np.random.default_rng(1).permutation(12)
    order, backwards = short_route(ends[shuffled])
    assert shuffled[order].tolist() == list(range(12))
    assert backwards.tolist() == [k % 2 == 1 for k in range(12)]


def strip(name):
    """A piece with an arc, four holes, eight ticks and three labels, none of them in order."""
    x = np.array([10.0, 30.0, 50.0, 70.0])
    points = np.stack([x, np.full(4, 5.0)], axis=1)
    half = np.array([0.0, 5.0])
    corners = np.array([[0.0, 0.0], [80.0, 0.0], [80.0, 10.0], [0.0, 10.0]])
    piece = Piece(
        id=name,
        thread=0,
        path=Path(corners, np.array([0.01, 0.0, 0.0, 0.2])),
        outline=corners,
        crossings=np.arange(4),
        points=points,
        directions=np.tile([1.0, 0.0], (4, 1)),
        rails=np.stack([points - half, points + half], axis=1),
        over=np.zeros(4, dtype=bool),
        hole_mm=np.array([2.0, 2.0, np.nan, 3.0]),
        start_joint=None,
        end_joint=None,
    )
    labels = tuple(
        Label(
            text="I",
            kinds=("id",),
            station=None,
            height_mm=3.0,
            centre=np.array([u, 3.0]),
            rotation_deg=0.0,
            box_mm=(1.0, 3.0),
            strokes=(np.array([[u, 2.0], [u, 4.0]]), np.array([[u, 5.0], [u + 1, 5.0]])),
        )
        for u in (40.0, 20.0, 60.0)
    )
    ticks = tuple(np.array([[u, v], [u, v + 1]]) for v in (0.0, 9.0) for u in x.tolist())
    return piece, Marks(labels, ticks, ())


@pytest.fixture(params=[False, True], ids=["outside", "inside"])
def drawn(request):
    """Nine strips on a sheet, as drawn, as they were, and where their points are drawn."""
    pieces, marks = zip(*(strip(f"A{k}") for k in range(9)), strict=True)
    turns = (0.0, 90.0, 180.0)
    placements = tuple(
        Placement(k, 0, turns[k % 3], 100.0 + 120.0 * (4 * k % 9 % 3), 100.0 + 110.0 * (k % 4))
        for k in range(9)
    )
    layout = Layout((SheetSize(500.0, 560.0),), placements, 10.0, 3.0)
    (sheet,) = draw_sheets(pieces, marks, layout, title="t", mirrored=request.param)

    def put(number, points):
        placed = placements[number].apply(np.asarray(points, dtype=float))
        return placed * (-1.0, 1.0) + (500.0, 0.0) if request.param else placed

    return pieces, marks, put, sheet, -1.0 if request.param else 1.0


def corners_of(entity):
    if isinstance(entity, Circle):
        return frozenset([(round(entity.x, 4), round(entity.y, 4), entity.radius)])
    return frozenset(map(tuple, entity.points.round(4).tolist()))


def test_nothing_is_lost_and_layers_keep_their_order(drawn):
    pieces, marks, put, sheet, sense = drawn
    assert sorted(piece.piece_id for piece in sheet.pieces) == [piece.id for piece in pieces]
    for own in sheet.pieces:
        number = int(own.piece_id[1:])
        piece = pieces[number]
        layers = [list(Layer).index(entity.layer) for entity in own.entities]
        assert layers == sorted(layers)
        strokes = [stroke for label in marks[number].labels for stroke in label.strokes]
        wanted = [frozenset(map(tuple, put(number, run).round(4).tolist()))
                  for run in (*strokes, *marks[number].ticks, piece.path.points)]  # fmt: skip
        wanted += [
            frozenset([(*put(number, [point])[0].round(4).tolist(), hole / 2)])
            for point, hole in zip(piece.points, piece.hole_mm, strict=True)
            if not np.isnan(hole)
        ]
        assert set(map(corners_of, own.entities)) == set(wanted)
        assert len(own.entities) == len(wanted)
        # Bulges go with their sides, wherever the outline begins.
        outline = own.entities[-1]
        begin = np.flatnonzero(outline.bulges == 0.01 * sense)[0]
        assert outline.points[begin] == pytest.approx(put(number, piece.path.points[:1])[0])
        assert (sense * np.roll(outline.bulges, -begin)).tolist() == piece.path.bulges.tolist()


def test_each_piece_is_walked_to_and_fro_and_to(drawn):
    _, _, put, sheet, _ = drawn
    ways = set()
    for own in sheet.pieces:
        start, end = put(int(own.piece_id[1:]), [[0.0, 0.0], [1.0, 0.0]])

        def along(point, start=start, end=end):
            return (np.asarray(point) - start) @ (end - start)

        first = [along(e.points[0]) for e in own.entities if e.layer is Layer.ENGRAVE_LABEL][::2]
        ticks = [along(e.points[0]) for e in own.entities if e.layer is Layer.ENGRAVE_MARK]
        holes = [along((e.x, e.y)) for e in own.entities if isinstance(e, Circle)]
        forward = first[0] < first[-1]
        ways.add(forward)
        sign = 1.0 if forward else -1.0
        assert np.all(np.diff(first) * sign > 0.0)
        assert np.all(np.diff(ticks) * sign < 1e-9)
        assert np.all(np.diff(holes) * sign > 0.0)
        assert along(own.entities[-1].points[0]) == pytest.approx(80.0 if forward else 0.0)
    assert ways == {True, False}
