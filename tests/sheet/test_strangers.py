"""Acceptance by strangers: CAM, CAD and SVG programs find in the files what we say is there."""

import json
import re
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from jobs import OCTAHEDRON
from PIL import Image
from strangers import ENGRAVED, INNER, OUTER, ask_meerk40t, draw_pdf, librecad_pdf, rsvg_png

#: MeerK40t shrinks a DXF drawing that is larger than its bed.
SHEET = (230.0, 225.0)
BED_MM = 235.0
#: A stroke of a picture is a pixel wide, or two where it lies between them.
PIXEL_MM = 25.4 / 254

FILES = (
    ("R2010", "dxf"),
    pytest.param(("R2000", "dxf"), marks=pytest.mark.slow),
    pytest.param(("R12", "dxf"), marks=pytest.mark.slow),
    pytest.param(("R2010", "svg"), marks=pytest.mark.slow),
)
drawings = FILES[:3]


@pytest.fixture(scope="module")
def made(finished):
    """Return a function that makes a job of one small sheet in one version of DXF, once."""

    @cache
    def make(version):
        folder = finished(*OCTAHEDRON, *(() if version == "R2010" else ("--dxf", version)))
        (sheet,) = plan_of(folder)["sheets"]
        assert (sheet["width_mm"], sheet["height_mm"]) == SHEET
        assert totals(folder)["holes"] > 20
        return folder

    return make


@pytest.fixture(scope="module")
def planned(made, tmp_path_factory):
    """Return a function that has MeerK40t plan the sheet of a job, once for each file."""

    @cache
    def plan(version, suffix):
        sheet = made(version) / "sheets" / f"sheet_01.{suffix}"
        return ask_meerk40t(sheet, tmp_path_factory.mktemp("meerk40t"))

    return plan


def plan_of(folder):
    return json.loads((folder / "crossing_map.json").read_text(encoding="utf-8"))


def totals(folder):
    return json.loads((folder / "waste.json").read_text(encoding="utf-8"))["totals"]


def placed(piece):
    place = piece["placement"]
    angle = np.deg2rad(place["rotation_deg"])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = [place["x_mm"], place["y_mm"]]
    outline = shapely.Polygon(np.array(piece["outline"]) @ turn.T + shift)
    holes = [s for s in piece["stations"] if s["hole_mm"] is not None]
    centres = np.array([[s["x"], s["y"]] for s in holes]).reshape(-1, 2) @ turn.T + shift
    return outline, centres, np.array([s["hole_mm"] for s in holes])


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_meerk40t_cuts_what_we_say(made, planned, file) -> None:
    job, found = made(file[0]), planned(*file)
    pieces = [placed(piece) for piece in plan_of(job)["pieces"]]
    n_holes = sum(len(holes) for _, holes, _ in pieces)
    # Each entity under one operation: holes, outlines, and what is engraved. Notes under none.
    assert found.assigned[1:] == (n_holes, len(pieces))
    assert 0 < found.assigned[0] <= found.added - n_holes - len(pieces)
    assert {burn.power for burn in found.burns} == {ENGRAVED, INNER, OUTER}
    length = {
        p: sum(b.length for b in found.burns if b.power == p) for p in (ENGRAVED, INNER, OUTER)
    }
    told = totals(job)
    assert length[INNER] + length[OUTER] == pytest.approx(told["cut_length_mm"], rel=1e-3)
    assert length[ENGRAVED] == pytest.approx(told["engrave_length_mm"], rel=5e-3)
    holes = sum(np.pi * sizes.sum() for _, _, sizes in pieces)
    assert length[INNER] == pytest.approx(holes, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_meerk40t_cuts_holes_before_the_outline_around_them(made, planned, file) -> None:
    job, found = made(file[0]), planned(*file)
    when: dict[int, list[int]] = {INNER: [], OUTER: []}
    where: dict[int, list[shapely.Polygon]] = {INNER: [], OUTER: []}
    # In SVG, lengths go down from the top of the bed.
    drop = 0.0 if file[1] == "dxf" else BED_MM - SHEET[1]
    for number, burn in enumerate(found.burns):
        if burn.power in when:
            when[burn.power].append(number)
            where[burn.power].append(shapely.Polygon(np.array(burn.points) - [0.0, drop]))
    pieces = [placed(piece) for piece in plan_of(job)["pieces"]]
    for outline, centres, sizes in pieces:
        own = [
            k
            for k, cut in enumerate(where[OUTER])
            if cut.intersection(outline).area > 0.99 * outline.area
        ]
        assert len(own) == 1
        # What it cuts is the piece, where it stands on the sheet.
        assert where[OUTER][own[0]].symmetric_difference(outline).area < 0.02 * outline.length
        for centre, size in zip(centres, sizes, strict=True):
            at = shapely.Point(centre)
            holes = [k for k, cut in enumerate(where[INNER]) if cut.contains(at)]
            assert len(holes) == 1
            assert where[INNER][holes[0]].area == pytest.approx(np.pi * size**2 / 4, rel=0.02)
            assert when[INNER][holes[0]] < when[OUTER][own[0]]


def ink_box(image: Path, dpi: float) -> tuple[float, ...]:
    """Return the box around everything that is drawn, in millimetres: left, top, right, bottom."""
    with Image.open(image) as picture:
        dark = np.asarray(picture.convert("L")) < 200
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    edges = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    return tuple(float(edge) * 25.4 / dpi for edge in edges)


def ink_size(image: Path, dpi: float) -> tuple[float, float]:
    left, top, right, bottom = ink_box(image, dpi)
    return right - left, bottom - top


@pytest.mark.apt
@pytest.mark.parametrize("file", drawings)
@pytest.mark.skipif(not shutil.which("librecad"), reason="LibreCAD is not installed")
@pytest.mark.skipif(not shutil.which("pdftoppm"), reason="poppler-utils is not installed")
def test_librecad_prints_the_sheet_at_its_size(made, file, tmp_path) -> None:
    job = made(file[0])
    page = draw_pdf(librecad_pdf(job / "sheets" / "sheet_01.dxf", tmp_path), 254, tmp_path)
    # The frame of the sheet is the outermost line.
    assert ink_size(page, 254) == pytest.approx(SHEET, abs=4 * PIXEL_MM)


@pytest.mark.apt
@pytest.mark.skipif(not shutil.which("rsvg-convert"), reason="librsvg is not installed")
def test_librsvg_draws_the_sheet_at_its_size(made, tmp_path) -> None:
    job = made("R2010")
    picture = rsvg_png(job / "sheets" / "sheet_01.svg", 254, tmp_path)
    with Image.open(picture) as image:
        wide, high = image.size
    assert (wide * PIXEL_MM, high * PIXEL_MM) == pytest.approx(SHEET, abs=PIXEL_MM)


@pytest.mark.slow
def test_a_spoilt_sheet_is_noticed(made, tmp_path) -> None:
    """The strangers' measure can object: one outline less is less length."""
    job = made("R2010")
    text = (job / "sheets" / "sheet_01.svg").read_text(encoding="utf-8")
    outline = re.findall(r"<path[^>]*#FF0000[^>]*?(?:/>|>.*?</path>)", text, re.DOTALL)[0]
    spoilt = tmp_path / "spoilt.svg"
    spoilt.write_text(text.replace(outline, "", 1), encoding="utf-8")
    found = ask_meerk40t(spoilt, tmp_path)
    assert found.assigned[2] == len(plan_of(job)["pieces"]) - 1
    cut = sum(burn.length for burn in found.burns if burn.power != ENGRAVED)
    assert cut < 0.97 * totals(job)["cut_length_mm"]


#: A beam, and bridges that hold pieces in their sheet, millimetres.
KERF, BRIDGES, BRIDGE = 0.2, 2, 2.0


@pytest.fixture(scope="module")
def kerfed(finished):
    ready = ("--kerf", f"{KERF}mm", "--micro-joints", f"{BRIDGES}:{BRIDGE}mm")
    return finished(*OCTAHEDRON, "--template", "none", *ready)


@pytest.mark.parametrize("suffix", [pytest.param("dxf", marks=pytest.mark.slow), "svg"])
def test_the_beam_keeps_half_the_kerf_off_and_stops_at_bridges(kerfed, suffix, tmp_path):
    found = ask_meerk40t(kerfed / "cut" / f"sheet_01_kerf0.2mm_micro2x2mm.{suffix}", tmp_path)
    pieces = plan_of(kerfed)["pieces"]
    holes = [s["hole_mm"] for piece in pieces for s in piece["stations"] if s["hole_mm"]]
    n_runs = BRIDGES * len(pieces)
    assert found.assigned[1:] == (len(holes), n_runs)
    length = {p: sum(b.length for b in found.burns if b.power == p) for p in (INNER, OUTER)}
    assert length[INNER] == pytest.approx(np.pi * (sum(holes) - KERF * len(holes)), rel=3e-3)
    around = sum(
        shapely.Polygon(piece["outline"]).buffer(KERF / 2, join_style="mitre").length
        for piece in pieces
    )
    assert length[OUTER] == pytest.approx(around - n_runs * (BRIDGE + KERF), rel=1e-3)
    # The nominal sheet would differ by far more than that.
    nominal = sum(shapely.Polygon(piece["outline"]).length for piece in pieces)
    assert abs(length[OUTER] - nominal) > 5e-3 * nominal
