"""The QR code outlives the cut: strangers read it on paper and as it is engraved on a tag."""

import io
import json
import shlex

import numpy as np
import pytest
import zxingcpp
from hypothesis import given
from hypothesis import strategies as st
from jobs import OCTAHEDRON
from PIL import Image, ImageDraw
from strategies import at_most

from fabweave.cut.drawing import Layer
from fabweave.cut.drawing_check import check_drawing
from fabweave.cut.notes.qr_tag import code_png, draw_tag

#: Pixels of a millimetre, and how wide a beam burns, millimetres.
SCALE, BEAM_MM = 20, 0.2


def scanned(image) -> list[str]:
    return [found.text for found in zxingcpp.read_barcodes(image.convert("L"))]


def engraved(tag) -> Image.Image:
    """Return what a beam leaves of a tag: its outline, its hole, and every engraved line."""
    size = (round(tag.width_mm * SCALE), round(tag.height_mm * SCALE))
    picture = Image.new("L", size, 255)
    draw = ImageDraw.Draw(picture)
    for entity in tag.pieces[0].entities:
        if entity.layer in (Layer.ENGRAVE_MARK, Layer.ENGRAVE_LABEL):
            points = [(x * SCALE, size[1] - y * SCALE) for x, y in entity.points.tolist()]
            draw.line(points, fill=0, width=round(BEAM_MM * SCALE), joint="curve")
    return picture


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1,
               max_size=60), st.text(max_size=40))  # fmt: skip
@at_most(10)
def test_strangers_read_the_tag_and_the_picture(text, title) -> None:
    tag = draw_tag(text, title)
    check_drawing(tag)
    assert scanned(engraved(tag)) == [text]
    picture = Image.open(io.BytesIO(code_png(text)))
    assert scanned(picture) == [text]
    # Everything engraved is on the tag, a millimetre off its edge.
    points = np.concatenate([
        entity.points for entity in tag.pieces[0].entities[:-1] if entity.layer is not
        Layer.CUT_INNER
    ])  # fmt: skip
    assert points.min() >= 1.0
    assert np.all(points <= np.array([tag.width_mm, tag.height_mm]) - 1.0)


@pytest.fixture(scope="module")
def made(finished):
    return finished(*OCTAHEDRON, "--qr", "offcut")


@pytest.mark.slow
def test_a_tag_is_made_where_it_is_asked_for(made) -> None:
    text = json.loads((made / "crossing_map.json").read_text())["cut"]["code"]
    words = shlex.split(text)
    assert words[words.index("--qr") + 1] == "offcut"
    assert scanned(Image.open(made / "qr_code.png")) == [text]
    assert 'src="qr_code.png"' in (made / "index.html").read_text("utf-8")
    assert 'href="tag/qr_tag.dxf"' in (made / "index.html").read_text("utf-8")


@pytest.mark.slow
def test_without_a_code_there_is_none(finished) -> None:
    bare = finished(*OCTAHEDRON, "--qr", "none")
    plan = json.loads((bare / "crossing_map.json").read_text())
    assert plan["cut"]["code"] == ""
    assert [sheet["code"] for sheet in plan["sheets"]] == [None]
    assert not (bare / "qr_code.png").exists()
    assert not (bare / "tag").exists()
