"""Spoil the sheets to cut and the sheets at full size: their checks object, and no other."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from fabweave.app.pipeline import run_job
from fabweave.app.settings import Settings
from fabweave.cut.drawing import Circle, Layer, PieceDrawing, Polyline
from fabweave.cut.kerfed_sheets import kerfed_sheets
from fabweave.cut.micro_joints import MicroJoints
from fabweave.cut.write import template
from fabweave.cut.write.dxf import dxf_bytes
from fabweave.cut.write.svg import svg_text
from fabweave.cut.write.template import template_pdf
from fabweave.cut.write.tiles import Tiles, Window, page_tiles
from fabweave.stock.sheet_size import SheetSize
from fabweave.verify import verify_job

SETTINGS = Settings(
    "shape:octahedron",
    size_mm=150.0,
    sheets=(SheetSize(500.0, 300.0),),
    effort="quick",
    slots=True,
    label_side="inside",
    kerf_mm=0.2,
    micro_joints=MicroJoints(3, 0.4),
    cut_order="cool",
    template="a4",
)
INNER = Layer.CUT_INNER
NAME = "sheet_01_kerf0.2mm_micro3x0.4mm"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "job"
    job, proof, _ = run_job(SETTINGS, folder)
    assert {"cut", "templates"} <= {check.name for check in proof.checks if check.ok}
    return job, folder


@pytest.fixture
def job(made, tmp_path):
    """Return the job, and a copy of its folder that may be spoiled."""
    return made[0], shutil.copytree(made[1], tmp_path / "job")


def failed(folder):
    return set(verify_job(folder).failed)


def rewrite(folder, drawing):
    """Write a sheet to cut in place of the true one."""
    (folder / "cut" / f"{NAME}.dxf").write_bytes(dxf_bytes(drawing))
    (folder / "cut" / f"{NAME}.svg").write_bytes(svg_text(drawing).encode())


def with_entities(drawing, change):
    """Return a drawing with its pieces' entities changed."""
    pieces = [
        PieceDrawing(piece.piece_id, tuple(map(change, piece.entities))) for piece in drawing.pieces
    ]
    return replace(drawing, pieces=tuple(pieces))


def moved(entity, layer):
    if entity.layer is not layer or not isinstance(entity, Polyline):
        return entity
    return replace(entity, points=entity.points + np.array([0.1, 0.0]))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda nominal, _: kerfed_sheets([nominal], 0.0, SETTINGS.micro_joints)[0],
        lambda nominal, _: kerfed_sheets([nominal], 0.4, SETTINGS.micro_joints)[0],
        lambda nominal, _: kerfed_sheets([nominal], 0.2, MicroJoints(3, 0.6))[0],
        lambda nominal, _: kerfed_sheets([nominal], 0.2, MicroJoints(4, 0.4))[0],
        lambda _, ready: with_entities(ready, lambda one: moved(one, Layer.CUT_OUTER)),
        lambda _, ready: with_entities(ready, lambda one: moved(one, INNER)),
        lambda _, ready: with_entities(ready, lambda one: moved(one, Layer.ENGRAVE_LABEL)),
        lambda _, ready: with_entities(
            ready,
            lambda one: replace(one, radius=one.radius + 0.1) if isinstance(one, Circle) else one,
        ),
        lambda _, ready: replace(ready, pieces=ready.pieces[1:]),
        lambda _, ready: replace(ready, notes=ready.notes[:-1]),
    ],
    ids=[
        "no-kerf", "kerf-twice", "wide-bridges", "many-bridges", "outline-moved", "slot-moved",
        "letter-moved", "wide-holes", "piece-lost", "note-lost",
    ],
)  # fmt: skip
def test_a_sheet_to_cut_that_is_not_as_stated_is_found(job, spoil):
    made, folder = job
    cuts = [one for piece in made.kerfed[0].pieces for one in piece.entities if one.layer is INNER]
    assert {type(one) for one in cuts} == {Circle, Polyline}
    rewrite(folder, spoil(made.drawings[0], made.kerfed[0]))
    assert failed(folder) == {"cut"}


def test_formats_that_differ_are_found(job):
    made, folder = job
    changed = with_entities(made.kerfed[0], lambda one: moved(one, Layer.CUT_OUTER))
    (folder / "cut" / f"{NAME}.svg").write_bytes(svg_text(changed).encode())
    assert failed(folder) == {"cut"}


def test_a_sheet_to_cut_that_is_missing_or_left_over_is_found(job):
    _, folder = job
    (folder / "cut" / "sheet_01_kerf0.3mm.dxf").write_text("old")
    assert failed(folder) == {"files"}
    (folder / "cut" / "sheet_01_kerf0.3mm.dxf").unlink()
    (folder / "cut" / f"{NAME}.dxf").unlink()
    assert failed(folder) == {"files", "cut"}


@pytest.mark.parametrize("line", ['kerf = "0.2mm"', 'micro_joints = "3:0.4mm"'])
def test_settings_that_say_something_else_are_found(job, line):
    _, folder = job
    text = (folder / "job.toml").read_text()
    assert line in text
    (folder / "job.toml").write_text(text.replace(line, ""))
    assert {"files", "cut"} <= failed(folder)


def shrunk(drawing):
    """Return a sheet as a printer that fits to the page shows it."""

    def smaller(entity):
        if isinstance(entity, Circle):
            return replace(entity, x=0.97 * entity.x, y=0.97 * entity.y)
        return replace(entity, points=0.97 * entity.points)

    return with_entities(drawing, smaller)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "paper"),
    [
        (shrunk, "a4"),
        (lambda drawing: replace(drawing, pieces=drawing.pieces[1:]), "a4"),
        (lambda drawing: replace(drawing, height_mm=drawing.height_mm + 5.0), "sheet"),
        (lambda drawing: with_entities(drawing, lambda one: moved(one, Layer.CUT_OUTER)), "sheet"),
    ],
    ids=["shrunk", "piece-lost", "page-too-large", "outline-moved"],
)
def test_a_sheet_at_full_size_that_is_wrong_is_found(job, spoil, paper):
    made, folder = job
    if paper != "a4":
        # The settings name the paper that was asked for.
        (folder / "sheets" / "sheet_01.pdf").write_bytes(template_pdf(made.drawings[0], paper))
        assert failed(folder) == {"templates"}
    settings = folder / "job.toml"
    settings.write_text(settings.read_text().replace('template = "a4"', f'template = "{paper}"'))
    (folder / "sheets" / "sheet_01.pdf").write_bytes(template_pdf(made.drawings[0], paper))
    assert "templates" not in failed(folder)
    (folder / "sheets" / "sheet_01.pdf").write_bytes(template_pdf(spoil(made.drawings[0]), paper))
    assert "templates" in failed(folder)


@pytest.mark.parametrize("pieces", ["whole", "parted"])
def test_a_page_that_is_lost_is_found(job, pieces, monkeypatch):
    made, folder = job
    tiles = page_tiles(made.drawings[0], "a4")
    if pieces == "parted":
        # Two halves of each piece, without a lap.
        low = Window(0.0, 0.0, 287.0, 196.0)
        tiles = Tiles(tuple(low._replace(left=287.0 * x, low=196.0 * y)
                            for x in range(-1, 4) for y in range(-1, 4)), ())  # fmt: skip
    else:
        tiles = Tiles(tiles.windows[:-1], ())
    monkeypatch.setattr(template, "page_tiles", lambda *_: tiles)
    (folder / "sheets" / "sheet_01.pdf").write_bytes(template_pdf(made.drawings[0], "a4"))
    assert failed(folder) == {"templates"}


@pytest.mark.parametrize("data", [b"", b"%PDF-1.4\n%%EOF\n", b"no PDF"])
def test_what_is_no_sheet_cannot_be_read(job, data):
    _, folder = job
    (folder / "sheets" / "sheet_01.pdf").write_bytes(data)
    assert failed(folder) == {"files", "templates"}
