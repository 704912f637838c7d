"""Spoil the sheets to cut and the sheets at full size: their checks object, and no other."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from sealing import verify_job

from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.sheet.drawing import Circle, Layer, PieceDrawing, Polyline
from fabweave.sheet.kerf import MicroJoints, kerfed_sheets
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.stock.sheet_size import SheetSize

pytestmark = pytest.mark.usefixtures("quick_jobs")

SETTINGS = Settings.of(
    "shape:octahedron",
    size_mm=150.0,
    sheets=(SheetSize(500.0, 300.0),),
    effort="quick",
    joint="rivet,slots",
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
    job, proof, *_ = run_job(Stations(SETTINGS), folder)
    assert "cut" in {check.name for check in proof.checks if check.ok}
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


@pytest.mark.slow
@pytest.mark.parametrize(
    "spoil",
    [
        lambda nominal, _: kerfed_sheets([nominal], 0.0, SETTINGS.machine.micro_joints)[0],
        lambda nominal, _: kerfed_sheets([nominal], 0.4, SETTINGS.machine.micro_joints)[0],
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
