import string
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.sheet.labels.lettering import characters, place_text, text_box

VISIBLE = characters().replace(" ", "")

heights = st.floats(0.8, 50.0)


def strokes(text, height):
    """Return the strokes of a text that begins at the origin and stands on y = 0."""
    box = text_box(text, height)
    return place_text(text, height, (box.width / 2, (box.bottom + box.top) / 2), 0.0)


def segments_of(lines):
    """Return all segments as an (N, 2, 2) array."""
    return np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])


def picture(lines):
    """Return the union of the strokes as a geometry."""
    return shapely.unary_union([shapely.LineString(line) for line in lines])


def distance(one, other):
    """Return the Hausdorff distance, points within segments counted too."""
    return shapely.hausdorff_distance(one, other, densify=0.05)


def upside_down(lines, width, top=12.0):
    return [np.array([width, top]) - line for line in lines]


@pytest.mark.parametrize("sign", VISIBLE)
def test_glyph_stays_in_its_box_and_fills_its_width(sign):
    points = np.concatenate(strokes(sign, 12.0))
    box = text_box(sign, 12.0)
    assert points[:, 0].min() >= 0.0
    assert points[:, 0].max() <= box.width
    assert box.bottom == min(points[:, 1].min(), 0.0)
    assert box.bottom >= -12.0 / 4.0
    assert points[:, 1].max() <= box.top == 12.0
    if sign.isascii() and sign.isalnum():
        assert np.ptp(points[:, 0]) == box.width
        assert points[:, 1].max() == 12.0
        assert 0.0 in points[:, 1]


@pytest.mark.parametrize("sign", VISIBLE)
def test_no_segment_is_shorter_than_an_eighth_and_no_line_is_doubled(sign):
    lines = strokes(sign, 12.0)
    segments = segments_of(lines)
    lengths = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    assert lengths.min() >= 12.0 / (12.0 if sign == "●" else 8.0)
    # Where strokes lie on one another, the union is shorter than their sum.
    assert picture(lines).length == pytest.approx(lengths.sum(), abs=1e-9)


def test_distinct_glyphs_are_distinct_at_reading_size():
    drawn = {sign: picture(strokes(sign, 2.5)) for sign in VISIBLE}
    for (one, first), (other, second) in combinations(drawn.items(), 2):
        assert distance(first, second) > 0.25, (one, other)


@pytest.mark.parametrize("pair", ["0O", "1I", "5S", "2Z", "8B", "UV", "CG", "OQ", "PR", "EF"])
def test_lookalikes_differ_by_more_than_the_width_of_a_burn(pair):
    one, other = (picture(strokes(sign, 2.5)) for sign in pair)
    # Burnt 0.2 mm wide, one of the two still shows 0.5 mm of line that the other has not.
    shown = max(one.difference(other.buffer(0.2)).length, other.difference(one.buffer(0.2)).length)
    assert shown > 0.5


def test_no_letter_or_digit_is_another_one_upside_down():
    signs = string.ascii_uppercase + string.digits
    turned = {
        sign: picture(upside_down(strokes(sign, 12.0), text_box(sign, 12.0).width))
        for sign in signs
    }
    for one in signs:
        for other in signs:
            if one != other:
                upright = picture(strokes(other, 12.0))
                assert distance(turned[one], upright) > 1.0, (one, other)


@given(st.text(alphabet=VISIBLE, min_size=2, max_size=6), heights)
def test_a_text_is_its_glyphs_side_by_side(text, height):
    expected = []
    left = 0.0
    for sign in text:
        expected += [line + np.array([left, 0.0]) for line in strokes(sign, height)]
        left += text_box(sign, height).width + height / 4.0
    lines = strokes(text, height)
    assert len(lines) == len(expected)
    for line, wanted in zip(lines, expected, strict=True):
        np.testing.assert_allclose(line, wanted, atol=1e-9)


@given(
    st.text(alphabet=VISIBLE, min_size=1, max_size=6),
    heights,
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    st.floats(-360, 360),
)
def test_placing_is_a_rigid_motion_that_centres_the_box(text, height, centre, angle_deg):
    box = text_box(text, height)
    middle = np.array([box.width / 2.0, (box.bottom + box.top) / 2.0])
    turn = np.exp(1j * np.deg2rad(angle_deg))
    for line, placed in zip(
        strokes(text, height), place_text(text, height, centre, angle_deg), strict=True
    ):
        local = (line - middle) @ np.array([1.0, 1j])
        expected = local * turn + complex(*centre)
        np.testing.assert_allclose(placed @ np.array([1.0, 1j]), expected, atol=1e-6)


def test_an_empty_text_has_no_strokes_and_a_space_has_width():
    assert strokes("", 2.5) == []
    assert place_text("", 2.5, (0.0, 0.0), 0.0) == []
    assert strokes("  ", 2.5) == []
    assert text_box("A A", 2.5).width > text_box("AA", 2.5).width + 1.0


def test_missing_glyphs_are_named():
    with pytest.raises(InputError, match=r"2 character.*'é'|2 character.*'É'.*'漢' \(U\+6F22\)"):
        strokes("A漢éA", 2.5)
    with pytest.raises(InputError):
        text_box("\n", 2.5)


@pytest.mark.parametrize("turn_deg", range(0, 360, 15))
def test_disc_and_ring_are_told_apart_at_2_mm_however_they_are_turned(turn_deg):
    disc, ring = (
        np.concatenate(place_text(sign, 2.0, (0.0, 0.0), turn_deg)) - middle
        for sign in "●○"
        for middle in [np.mean(place_text(sign, 2.0, (0.0, 0.0), turn_deg)[0][-14:], axis=0)]
    )
    assert len(place_text("●", 2.0, (0.0, 0.0), 0.0)) == len(place_text("○", 2.0, (0.0, 0.0), 0.0))
    # With a burn of 0.2 mm the disc is full, and the ring has a hole of more than a millimetre.
    burnt = [
        shapely.buffer(picture(place_text(sign, 2.0, (0.0, 0.0), turn_deg)), 0.1) for sign in "●○"
    ]
    filled, hollow = (shapely.area(ink) / shapely.area(shapely.convex_hull(ink)) for ink in burnt)
    assert filled > 0.95
    assert hollow < 0.45
    assert len(disc) > len(ring)
