import io

import numpy as np
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from strategies import at_most

from fabweave.sheet.drawing import Circle, Layer
from fabweave.sheet.labels.texts import Title, place_titles
from fabweave.sheet.presets import preset_named
from fabweave.sheet.write.preview import png_bytes, preview_frame

SCALE = 4.0


def pixels_of(data):
    image = Image.open(io.BytesIO(data))
    assert image.mode == "RGB"
    return np.asarray(image).astype(int)


def along(line, step=0.5):
    """Return points along a closed polyline."""
    ring = shapely.LinearRing(line.points)
    return shapely.get_coordinates(
        shapely.line_interpolate_point(ring, np.arange(0.0, ring.length, step))
    )


def nearest(image, places, colour):
    """Return, for each place, the least distance of a pixel around it to a colour."""
    column, row = np.floor(places).astype(int).T
    around = [
        np.abs(image[row + dy, column + dx] - colour).max(axis=1)
        for dy in (-1, 0, 1)
        for dx in (-1, 0, 1)
    ]
    return np.min(around, axis=0)


def test_outlines_and_holes_are_where_they_are_and_in_their_colours(sheet):
    image = pixels_of(png_bytes(sheet, titles={}))
    frame = preview_frame(sheet)
    colours = preset_named().colours
    for piece in sheet.pieces:
        outline = piece.entities[-1]
        red = nearest(image, frame.pixels(along(outline)), colours[Layer.CUT_OUTER].rgb)
        assert np.mean(red < 120) > 0.99
        # The check can object: four millimetres off, there is no red line.
        off = nearest(
            image, frame.pixels(along(outline) + np.array([0.0, 4.0])), colours[Layer.CUT_OUTER].rgb
        )
        assert np.mean(off < 120) < 0.25
        for hole in (entity for entity in piece.entities if isinstance(entity, Circle)):
            turn = np.linspace(0.0, 6.2, 40)
            rim = np.stack([np.cos(turn), np.sin(turn)], axis=1) * hole.radius + (hole.x, hole.y)
            blue = nearest(image, frame.pixels(rim), colours[Layer.CUT_INNER].rgb)
            assert np.mean(blue < 120) > 0.95
            middle = frame.pixels(np.array([[hole.x, hole.y]])).astype(int)[0]
            assert image[middle[1], middle[0]].tolist() == [255, 255, 255]


def test_titles_are_painted_where_they_are_asked_for_and_nowhere_else(sheet):
    frame = preview_frame(sheet)
    without = pixels_of(png_bytes(sheet, titles={}))
    title = Title(45.0, 120.0, 30.0, 8.0)
    with_one = pixels_of(png_bytes(sheet, titles={"B66": title}))
    assert with_one.shape == without.shape
    row, column = np.nonzero((with_one != without).any(axis=2))
    places = np.stack([column + 0.5, row + 0.5], axis=1)
    reach = np.hypot(*(places - frame.pixels(np.array([[45.0, 120.0]]))).T) / SCALE
    assert len(reach) > 100
    assert reach.max() < 12.0
    # The middle of what was painted is the place that was asked for.
    np.testing.assert_allclose(
        (places.max(axis=0) + places.min(axis=0)) / 2.0,
        frame.pixels(np.array([[45.0, 120.0]]))[0],
        atol=1.0 * SCALE,
    )


def test_an_id_that_is_engraved_and_can_be_read_is_not_written_again(sheet):
    ids = {piece.piece_id: 2.5 for piece in sheet.pieces}
    untitled = png_bytes(sheet, titles={})
    assert png_bytes(sheet, lettered=ids) == untitled
    # Lower letters are a smudge.
    low = png_bytes(sheet, lettered=dict.fromkeys(ids, 2.0))
    assert low == png_bytes(sheet)
    assert low != untitled


# ---- titles ---------------------------------------------------------------------------------


def box_of(text, title):
    """Return the box that the letters need, as a polygon."""
    half = np.array([0.62 * len(text) * title.height_mm, 0.7 * title.height_mm]) / 2.0
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    angle = np.deg2rad(title.angle_deg)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return shapely.Polygon(corners @ rotation.T + (title.x, title.y))


@settings(at_most(25), suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_titles_lie_in_their_pieces_clear_of_holes_and_upright(data, sheets):
    pieces = data.draw(sheets).pieces
    titles = place_titles(pieces)
    assert set(titles) == {piece.piece_id for piece in pieces}
    for piece in pieces:
        title = titles[piece.piece_id]
        assert -90.0 < title.angle_deg <= 90.0
        outline = shapely.Polygon(piece.entities[-1].points)
        if title.height_mm > 2.5 and outline.is_valid:
            box = box_of(piece.piece_id, title)
            assert outline.contains(box)
            for hole in (entity for entity in piece.entities if isinstance(entity, Circle)):
                assert box.distance(shapely.Point(hole.x, hole.y)) > hole.radius * 0.99
