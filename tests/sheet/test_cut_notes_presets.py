import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, SheetDrawing, check_drawing
from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.presets import LayerColour, preset_named, preset_names
from fabweave.sheet.sheet_notes import left_out_notes, sheet_notes
from fabweave.stock.sheet_size import SheetSize

sides = st.floats(12.0, 2000.0)
lines = st.lists(st.text(alphabet="ABC 069-/.", max_size=60), max_size=4)


@given(sides, sides, lines, st.floats(0.0, 20.0), st.none() | st.floats(0.0, 180.0))
@example(18.0, 12.0, ["", "B"], 12.0, None)
def test_notes_stay_on_the_sheet_on_their_layer_and_can_be_written(
    width, height, texts, margin, grain
):
    notes, _ = sheet_notes(SheetSize(width, height, grain_deg=grain), texts, margin_mm=margin)
    assert {note.layer for note in notes} == {Layer.NOTES}
    points = np.concatenate([note.points for note in notes])
    assert points.min() >= -1e-9
    assert (points.max(axis=0) <= np.array([width, height]) + 1e-9).all()
    check_drawing(SheetDrawing("s", width, height, (), notes))


@pytest.mark.parametrize(
    ("width", "length"), [(600.0, 100.0), (110.0, 100.0), (109.0, 50.0), (50.0, 20.0), (12.0, 10.0)]
)
def test_the_bar_is_as_long_as_it_says(width, length):
    _, bar, *letters = sheet_notes(SheetSize(width, 100.0), []).drawn
    assert np.ptp(bar.points[:, 0]) == pytest.approx(length, abs=1e-9)
    # Its ends are marked by strokes that stand on it.
    np.testing.assert_allclose(bar.points[[0, 3], 0], bar.points[[1, 2], 0])
    if width == 600.0:
        expected = place_text("100 MM", 2.5, (0.0, 0.0), 0.0)
        assert len(letters) == len(expected)
        shift = letters[0].points[0] - expected[0][0]
        for letter, wanted in zip(letters, expected, strict=True):
            np.testing.assert_allclose(letter.points - shift, wanted, atol=1e-9)
        assert letters[0].points[:, 0].min() > bar.points[:, 0].max()


@st.composite
def outlines(draw):
    """Draw polygons around a middle, with its least corner at the origin."""
    count = draw(st.integers(3, 40))
    reach = draw(st.lists(st.floats(60.0, 400.0), min_size=count, max_size=count))
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + draw(st.floats(0.0, 1.0))
    ring = np.array(reach)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return (ring - ring.min(axis=0)).round(4)


@given(outlines(), lines, st.floats(0.0, 20.0), st.floats(0.0, 180.0))
def test_notes_on_odd_stock_are_on_good_material(ring, texts, margin, grain):
    material = shapely.Polygon(ring)
    x, y = shapely.get_coordinates(material.representative_point())[0].tolist()
    knot = ((x - 9.0, y - 9.0), (x + 9.0, y - 9.0), (x + 9.0, y + 9.0), (x - 9.0, y + 9.0))
    width, height = ring.max(axis=0).tolist()
    outline = tuple(map(tuple, ring.tolist()))
    stock = SheetSize(width, height, grain_deg=grain, outline=outline, defects=(knot,))
    notes, _ = sheet_notes(stock, texts, margin_mm=margin)
    check_drawing(SheetDrawing("s", width, height, (), notes))
    frame, bar, *_ = notes
    assert shapely.Polygon(frame.points).symmetric_difference(material).area < 1.0
    good = material.difference(shapely.Polygon(knot)).buffer(1e-6)
    assert np.all(shapely.covers(good, [shapely.LineString(note.points) for note in notes[1:]]))
    # The bar is as long as it says, whichever way it lies.
    length = np.hypot(*(bar.points[2] - bar.points[1]))
    assert round(length) in (100, 50, 20, 10)
    assert length == pytest.approx(round(length), abs=1e-9)


def test_a_long_text_is_made_smaller_and_then_cut_off():
    short = sheet_notes(SheetSize(300.0, 200.0), ["ABC"]).drawn
    long = sheet_notes(SheetSize(300.0, 200.0), ["ABC" * 40]).drawn
    dots = sheet_notes(SheetSize(300.0, 200.0), ["ABC" * 4000]).drawn
    assert len(short) < len(long) < len(dots) + 200
    assert np.ptp(long[-1].points[:, 1]) < np.ptp(short[-1].points[:, 1])
    for dot in dots[-2:]:
        assert np.ptp(dot.points[:, 0]) == 0.0
        assert np.ptp(dot.points[:, 1]) == pytest.approx(1.0 / 6.0)


@given(
    st.tuples(st.floats(1.0, 300.0), st.floats(1.0, 300.0)),
    st.just(0.0) | st.floats(0.001, 3.0),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.01, 1.0)), max_size=9),
    st.none() | st.floats(0.0, 180.0),
)
@example((300.0, 200.0), 0.0, [(0.0, 0.0, 1.0)], None)
def test_notes_that_find_no_room_beside_pieces_are_left_out_and_said(size, margin, places, grain):
    # Pieces lie anywhere inside the margin.
    room = np.maximum(np.array(size) - 2.0 * margin, 0.0)
    pieces = []
    for x, y, part in places if room.min() > 0.0 else ():
        low = margin + room * (x, y) * (1.0 - part)
        (a, b), (c, d) = low, low + part * room
        corners = np.array([[a, b], [c, b], [c, d], [a, d]])
        pieces.append(PieceDrawing("A1", (Polyline(Layer.CUT_OUTER, corners, closed=True),)))
    texts = ["JOB SHEET 1/4", "ONE", "TWO"]
    stock = SheetSize(*size, grain_deg=grain)
    notes = sheet_notes(stock, texts, margin_mm=margin, pieces=pieces)
    frame, *others = (shapely.LineString(note.points) for note in notes.drawn)
    sheet = shapely.box(0.0, 0.0, *size).buffer(1e-6)
    assert sheet.covers(shapely.union_all([frame, *others]))
    cut = [shapely.Polygon(piece.entities[0].points) for piece in pieces]
    assert not shapely.union_all(cut).buffer(-1e-6).intersects(shapely.union_all(others))
    parts = {"the reference bar", "the title", "'ONE'", "'TWO'"}
    assert bool(others) == bool(parts - set(notes.left_out))
    told = left_out_notes([SheetDrawing("sheet_07", *size, (), (), left_out=notes.left_out)])
    assert all(part in told[0] for part in (*notes.left_out, "sheet_07") if notes.left_out)


# ---- presets --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_tells_cuts_from_engraving_and_from_notes(name):
    preset = preset_named(name)
    assert preset.name == name
    assert preset.description
    assert list(preset.colours) == list(Layer)
    engraved = {preset.colours[Layer.ENGRAVE_LABEL], preset.colours[Layer.ENGRAVE_MARK]}
    rest = [preset.colours[layer] for layer in (Layer.CUT_INNER, Layer.CUT_OUTER, Layer.NOTES)]
    for table in ("colour", "aci"):
        values = [getattr(colour, table) for colour in rest]
        # A service that has one colour for all cuts puts holes first itself.
        assert len(set(values)) == (2 if name == "snijlab" else 3)
        assert not set(values) & {getattr(colour, table) for colour in engraved}


#: In which order programs burn colours, of those who say so.
PALETTES = {
    "lightburn": ["#000000", "#0000FF", "#FF0000", "#F36926"],
    "trotec": ["#000000", "#FF0000", "#0000FF", "#FFFF00"],
    "boxes": ["#00FF00", "#0000FF", "#000000", "#FF0000"],
}


@pytest.mark.parametrize("name", PALETTES)
def test_colours_burn_in_the_order_of_the_layers(name):
    # LightBurn's palette C00, C01, C02 and its tool layer T1; JobControl's table of colours, of
    # which yellow is the last; boxes.py's manual.
    colours = [entry.colour for entry in preset_named(name).colours.values()]
    assert [PALETTES[name].index(colour) for colour in colours] == [0, 0, 1, 2, 3]
    assert preset_named() == preset_named("lightburn")


@pytest.mark.parametrize(
    ("colour", "aci"),
    [("red", 1), ("#ff0000", 1), ("#FF00001", 1), ("#FF0000", 0), ("#FF0000", 256)],
)
def test_a_colour_that_must_be_guessed_is_refused(colour, aci):
    with pytest.raises(InputError):
        LayerColour(colour, aci)
