"""The QR code outlives the cut: strangers read it on paper and as it is engraved on a tag."""

import io
import json
import shlex
import shutil

import ezdxf
import numpy as np
import pytest
import zxingcpp
from fabweave.verify.checks.sheets.qr_code import check_code
from fabweave.verify.read.qr_code import read_code, read_dots
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import OCTAHEDRON
from PIL import Image, ImageDraw

from fabweave.cut.drawing import Layer
from fabweave.cut.drawing_check import check_drawing
from fabweave.cut.notes.qr_tag import code_png, draw_tag
from fabweave.verify.read.job_files import load_job
from fabweave.verify.statement import Tally

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
@settings(max_examples=10)
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


def test_the_picture_is_read_dot_by_dot(tmp_path) -> None:
    path = tmp_path / "qr_code.png"
    path.write_bytes(code_png("fabweave make shape:cube -o again"))
    assert read_code(read_dots(path)) == "fabweave make shape:cube -o again"


@pytest.fixture(scope="module")
def made(finished):
    return finished(*OCTAHEDRON, "--qr", "offcut")


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "job")


def found(folder) -> str:
    files, code = Tally("files"), Tally("code")
    check_code(load_job(folder, files), code)
    return " | ".join([*files.result().findings, *code.result().findings])


@pytest.mark.slow
def test_a_tag_is_made_where_it_is_asked_for(made) -> None:
    assert found(made) == ""
    text = json.loads((made / "crossing_map.json").read_text())["cut"]["code"]
    words = shlex.split(text)
    assert words[words.index("--qr") + 1] == "offcut"
    assert scanned(Image.open(made / "qr_code.png")) == [text]
    assert 'src="qr_code.png"' in (made / "index.html").read_text("utf-8")
    assert 'href="tag/qr_tag.dxf"' in (made / "index.html").read_text("utf-8")


@pytest.mark.slow
def test_without_a_code_there_is_none(finished) -> None:
    bare = finished(*OCTAHEDRON, "--qr", "none")
    assert found(bare) == ""
    plan = json.loads((bare / "crossing_map.json").read_text())
    assert plan["cut"]["code"] == ""
    assert [sheet["code"] for sheet in plan["sheets"]] == [None]
    assert not (bare / "qr_code.png").exists()
    assert not (bare / "tag").exists()


def spoil_picture(job) -> None:
    """Turn one dot of the data over."""
    path = job / "qr_code.png"
    picture = Image.open(path).convert("L")
    at = 8 * (4 + 14)
    patch = picture.crop((at, at, at + 8, at + 8)).point(lambda grey: 255 - grey)
    picture.paste(patch, (at, at))
    picture.save(path)


def cut_the_border(job) -> None:
    path = job / "qr_code.png"
    picture = Image.open(path)
    picture.crop((8, 0, *picture.size)).save(path)


def spoil_tag(change):
    def spoil(job) -> None:
        path = job / "tag" / "qr_tag.dxf"
        document = ezdxf.readfile(path)
        space = document.modelspace()
        lines = [one for one in space.query("LWPOLYLINE") if one.dxf.layer == "ENGRAVE_MARK"]
        change(space, lines)
        document.saveas(path)

    return spoil


def another_text(job) -> None:
    (job / "qr_code.png").write_bytes(code_png("fabweave make shape:cube -o again"))


def not_asked_for(job) -> None:
    path = job / "job.toml"
    path.write_text(path.read_text().replace('qr = "offcut"', 'qr = "paper"'))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (spoil_picture, "the code cannot be read"),
        (cut_the_border, "its border is 3.0 dots wide"),
        (another_text, "what the code says is 'fabweave make shape:cube"),
        (lambda job: (job / "qr_code.png").unlink(), "qr_code.png is missing"),
        (lambda job: (job / "tag" / "qr_tag.svg").unlink(), "there is no SVG beside it"),
        (not_asked_for, "nobody asked for it"),
        (spoil_tag(lambda space, lines: space.delete_entity(lines[40])), "cannot be read"),
        (spoil_tag(lambda _, lines: lines[40].translate(0.4, 0.0, 0.0)), "engraved in part"),
        (spoil_tag(lambda _, lines: lines[40].translate(90.0, 0.0, 0.0)), "leaves the tag"),
    ],
)
def test_spoilt_codes_are_found(job, spoil, words) -> None:
    spoil(job)
    assert words in found(job)
