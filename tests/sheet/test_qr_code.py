"""The QR code on a sheet is read back by a stranger, stands clear, and makes the same job."""

import io
import shlex
import shutil
from dataclasses import replace

import numpy as np
import pytest
import shapely
import zxingcpp
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from strangers import rsvg_png
from strategies import at_most

from fabweave.cli.main import cli
from fabweave.cli.options import job_settings
from fabweave.options.command import command_text, settings_digest
from fabweave.options.settings import Settings, settings_table
from fabweave.plan.ask import complete_settings
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, SheetDrawing, check_drawing
from fabweave.sheet.presets import preset_named
from fabweave.sheet.qr_code import (
    DOTS_MM,
    QUIET_DOTS,
    Code,
    code_notes,
    code_of,
    code_png,
    draw_code,
    with_code,
)
from fabweave.sheet.write.preview import png_bytes
from fabweave.sheet.write.svg import SVG_UNITS, svg_text

TEXT = "fabweave make 'shape:torus?m=8&n=4' --size 300mm -o again"


def read(image) -> list[str]:
    return [found.text for found in zxingcpp.read_barcodes(image.convert("L"))]


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1,
               max_size=90))  # fmt: skip
@at_most(30)
def test_a_stranger_reads_what_the_lines_say(text) -> None:
    lines = draw_code(text, Code(0.0, 0.0, 1.0))
    points = np.concatenate([line.points for line in lines])
    size = round(float(points.max()))
    picture = Image.new("L", ((size + 8) * 4,) * 2, 255)
    pixels = np.array(picture)
    for line in lines:
        (left, y), (right, same) = line.points.tolist()
        assert y == same
        assert right - left >= 1.0
        row = round((size - y - 0.5 + 4) * 4)
        pixels[row : row + 4, round((left + 4) * 4) : round((right + 4) * 4)] = 0
    assert read(Image.fromarray(pixels)) == [text]
    assert read(Image.open(io.BytesIO(code_png(text)))) == [text]


@given(st.data())
@at_most(40)
def test_a_code_stands_on_nothing(sheets, data) -> None:
    sheet = data.draw(sheets)
    coded = with_code(sheet, TEXT)
    check_drawing(coded)
    code = code_of(coded)
    if code is None:
        assert coded is sheet
        return
    assert code.dot_mm in DOTS_MM
    own = coded.notes[len(sheet.notes) :]
    assert coded.notes[: len(sheet.notes)] == sheet.notes
    assert coded.pieces == sheet.pieces
    assert {line.width_mm for line in own} == {code.dot_mm}
    points = np.concatenate([line.points for line in own])
    side = float(np.ptp(points[:, 0])) + 2 * QUIET_DOTS * code.dot_mm
    low = np.array([code.x_mm, code.y_mm]) - QUIET_DOTS * code.dot_mm
    box = shapely.box(*low, *(low + side))
    assert shapely.box(0.0, 0.0, sheet.width_mm, sheet.height_mm).covers(box.buffer(0.9))
    for entity in [e for piece in sheet.pieces for e in piece.entities if hasattr(e, "points")]:
        shape = shapely.Polygon(entity.points) if entity.closed else entity.points
        shape = shapely.LineString(shape) if isinstance(shape, np.ndarray) else shape
        assert shape.distance(box) > 0.4
    for note in sheet.notes[1:]:
        assert shapely.LineString(note.points).distance(box) > 0.4


def block(low, high):
    ring = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return PieceDrawing("A1", (Polyline(Layer.CUT_OUTER, ring, closed=True),))


def test_it_is_as_large_as_there_is_room_for_and_else_left_out() -> None:
    # 33 dots and twice 4 of border: 41 mm, 33 mm, 25 mm, and some room on either side.
    found = {}
    for free in (49.0, 40.0, 31.0, 26.0):
        sheet = SheetDrawing("s", 200.0, 100.0, (block((0.0, 0.0), (200.0 - free, 100.0)),), ())
        found[free] = code_of(with_code(sheet, TEXT))
    assert [code and code.dot_mm for code in found.values()] == [1.0, 0.8, 0.6, None]
    # Of an irregular sheet, its first note is the outline: the code stands inside it.
    ring = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 90.0], [40.0, 90.0], [0.0, 30.0]])
    rest = SheetDrawing("s", 90.0, 90.0, (), (Polyline(Layer.NOTES, ring, closed=True),))
    code = code_of(with_code(rest, TEXT))
    assert code is not None
    side = code.dot_mm * (33 + 2 * QUIET_DOTS)
    low = np.array([code.x_mm, code.y_mm]) - QUIET_DOTS * code.dot_mm
    assert shapely.Polygon(ring).buffer(-0.4).covers(shapely.box(*low, *(low + side)))
    bare = SheetDrawing("sheet_02", 9.0, 9.0, (), ())
    assert with_code(bare, TEXT) is bare
    (note,) = code_notes([bare, with_code(SheetDrawing("s", 90.0, 90.0, (), ()), TEXT)])
    assert "1 sheet has no room" in note
    assert "(sheet_02)" in note
    assert code_notes([with_code(SheetDrawing("s", 90.0, 90.0, (), ()), TEXT)]) == ()


def test_a_stranger_reads_the_picture_of_a_sheet(sheet) -> None:
    for dot in DOTS_MM:
        notes = (*sheet.notes[:2], *draw_code(TEXT, Code(120.3, 7.7, dot)))
        coded = replace(sheet, pieces=(), notes=notes)
        assert read(Image.open(io.BytesIO(png_bytes(coded)))) == [TEXT]


@pytest.mark.apt
@pytest.mark.skipif(not shutil.which("rsvg-convert"), reason="librsvg is not installed")
@pytest.mark.parametrize("units", SVG_UNITS)
def test_a_stranger_reads_the_svg(units, tmp_path) -> None:
    coded = with_code(SheetDrawing("s", 100.0, 80.0, (), ()), TEXT)
    (tmp_path / "s.svg").write_bytes(svg_text(coded, units=units).encode())
    assert read(Image.open(rsvg_png(tmp_path / "s.svg", 150, tmp_path))) == [TEXT]


# ---- what it says ---------------------------------------------------------------------------


def typed(text):
    """Return the complete settings that a command line comes to."""
    words = shlex.split(text)
    assert words[:2] == ["fabweave", "make"]
    context = cli.commands["make"].make_context("make", words[2:])
    with context:
        return complete_settings(job_settings(context.params.pop("mesh"), context.params))[0]


@pytest.mark.parametrize(
    "options",
    [
        "",
        "--size 300mm --effort quick --seed 7",
        "--sheet 600x400mm:2 --sheet 620x450mm --margin 0mm --gap 3mm --material birch-veneer",
        "--strict --fastener none --labels none --label-side inside --preset epilog",
        "--width 6mm..14mm --max-length 20cm --joint rivet:2,lap=30mm,slots --svg-units px96",
        "--hairline 0.001in --profile service --dxf R12 --refine catmull-clark:2",
        "--material card --thickness 0.5mm --pattern 3/1 --boundary turn --up y --fair 50",
    ],
)
def test_the_command_makes_the_same_job(options) -> None:
    settings = typed(f"fabweave make 'shape:torus?m=8&n=4' {options} -o out")
    usual, _ = complete_settings(
        Settings.of(settings.mesh.source, material=settings.stock.material)
    )
    text = command_text(settings, usual)
    assert typed(text) == settings
    assert len(text) < 170
    # What is usual is not told.
    assert text.count("--") <= options.count("--")


def test_what_is_too_long_or_lies_beside_is_told_by_a_digest() -> None:
    usual, _ = complete_settings(Settings.of("m" * 200))
    for change in (
        {},
        {"source": "a", "layout": "crossing_map.json"},
        {"source": "a", "preset": replace(preset_named(), hairline_mm=0.1)},
    ):
        settings = usual.but(**change)
        text = command_text(settings, usual)
        digest = settings_digest(settings_table(settings))[:16]
        assert text == f"fabweave make --config job.toml -o again # sha256 {digest}"
