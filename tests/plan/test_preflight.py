"""Preflight: every rule objects to what breaks it, at the right place, and to nothing else."""

import json
import re
import tomllib
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from crossing_maps import piece_record, sheet_record, small_map
from hypothesis import example, given
from hypothesis import strategies as st
from jobs import run

from fabweave.core.finding import Finding
from fabweave.plan.preflight import finding_lines, preflight, preflight_record
from fabweave.sheet.targets import target_named
from fabweave.stock.material import material_named, with_thickness

pytestmark = pytest.mark.usefixtures("quick_jobs")

CARD = material_named("card")
PLY = with_thickness(material_named("birch-ply-3"), 3.0)
DEFAULT = target_named("default")


def bar(length=100.0, width=20.0):
    return [[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]]


def plan(*pieces, width=600.0, height=400.0):
    numbers = range(1, 1 + max(piece.sheet for piece in pieces))
    return small_map(
        pieces=pieces, sheets=[sheet_record(number, width, height) for number in numbers]
    )


class Flaw(NamedTuple):
    """What a finding says, taken apart."""

    rule: str
    count: int
    value: float
    limit: float
    piece: str | None
    sheet: int | None
    place: tuple[float, ...]
    cure: str


def taken_apart(finding: Finding) -> Flaw:
    value, limit = map(float, re.findall(r"([\d.]+) mm", finding.text))
    piece, sheet, at = re.fullmatch(
        r"(?:(\w+), )?(?:sheet (\d+))?(?: at \((.*)\))?", finding.where
    ).groups()
    place = tuple(map(float, at.split(", "))) if at else ()
    count = int(finding.text.split()[0])
    number = None if sheet is None else int(sheet)
    return Flaw(finding.rule, count, value, limit, piece, number, place, finding.cure)


def flaws_of(job, material=CARD, target=DEFAULT, findings=()):
    return tuple(map(taken_apart, preflight(job, findings, [material], target)))


def test_a_sound_piece_has_no_flaw() -> None:
    assert flaws_of(plan(piece_record("A1", bar(), [(20, 10, 4.0), (80, 10, 4.0)]))) == ()


def test_small_holes_are_found_where_they_are() -> None:
    turned = piece_record("A1", bar(), [(20, 10, 2.0), (80, 10, 3.0)], turn=90.0, at=(50.0, 5.0))
    flaws = flaws_of(plan(turned), PLY)
    assert [flaw.rule for flaw in flaws] == ["hole"]
    # R(90°)(20, 10) + (50, 5) = (-10 + 50, 20 + 5)
    assert flaws[0].place == (40.0, 25.0)
    assert (flaws[0].value, flaws[0].limit, flaws[0].count) == (2.0, 3.0, 1)
    assert flaws[0].cure == "--fastener 3mm"


@pytest.mark.parametrize(("y", "bad"), [(8.0, False), (7.9, True)])
def test_holes_keep_two_diameters_from_edges(y, bad) -> None:
    flaws = flaws_of(plan(piece_record("A1", bar(), [(50, y, 4.0)])))
    assert [flaw.rule for flaw in flaws] == ["hole-edge"] * bad
    if bad:
        assert (flaws[0].value, flaws[0].limit) == (pytest.approx(7.9), 8.0)


@given(st.floats(0.2, 8.0), st.floats(0.0, 360.0))
@example(1.5, 2.0)  # half of the limit: the first halving is a tie
def test_necks_are_as_wide_as_they_are(neck, turn) -> None:
    side = (20 - neck) / 2
    outline = [
        [0, 0], [40, 0], [40, side], [60, side], [60, 0], [100, 0],
        [100, 20], [60, 20], [60, 20 - side], [40, 20 - side], [40, 20], [0, 20],
    ]  # fmt: skip
    flaws = flaws_of(plan(piece_record("A1", outline, turn=turn, at=(200.0, 200.0))), PLY)
    assert [flaw.rule for flaw in flaws] == ["web"] * (neck < 3.0 - 1e-3)
    if flaws:
        assert flaws[0].value == pytest.approx(neck, abs=0.01)
        back = np.deg2rad(-turn)
        x, y = np.array(flaws[0].place) - 200.0
        at = (x * np.cos(back) - y * np.sin(back), x * np.sin(back) + y * np.cos(back))
        assert 38 < at[0] < 62
        assert abs(at[1] - 10) < 1.5


def test_gaps_between_pieces_of_one_sheet() -> None:
    near = piece_record("B1", bar(), at=(0.0, 20.4))
    flaws = flaws_of(plan(piece_record("A1", bar()), near))
    assert [(flaw.rule, flaw.piece) for flaw in flaws] == [("gap", "A1")]
    assert flaws[0].value == pytest.approx(0.4)
    assert flaws[0].place[1] == pytest.approx(20.2)
    assert flaws_of(plan(piece_record("A1", bar()), replace(near, sheet=2))) == ()
    assert (
        flaws_of(plan(piece_record("A1", bar()), piece_record("B1", bar(), at=(0.0, 20.5)))) == ()
    )


def test_pieces_and_sheets_larger_than_the_target_takes() -> None:
    job = plan(piece_record("A1", bar(950.0), turn=30.0), width=1300.0, height=600.0)
    flaws = flaws_of(job, target=target_named("cutitout"))
    assert [(flaw.rule, flaw.piece) for flaw in flaws] == [("piece", "A1")]
    assert (flaws[0].value, flaws[0].limit) == (pytest.approx(950.0), 900.0)
    flaws = flaws_of(job, target=target_named("snijlab"))
    assert [(flaw.rule, flaw.sheet, flaw.value, flaw.limit) for flaw in flaws] == [
        ("sheet", 1, 1300.0, 1200.0)
    ]
    # Sheets may be turned.
    assert (
        flaws_of(
            plan(piece_record("A1", bar()), width=600.0, height=1200.0),
            target=target_named("snijlab"),
        )
        == ()
    )


def test_the_worst_place_of_each_rule_is_named() -> None:
    job = plan(
        piece_record("A1", bar(), [(20, 10, 2.5), (80, 10, 2.0)]),
        piece_record("B1", bar(), [(50, 10, 1.0)], at=(0.0, 40.0)),
    )
    found = preflight(job, [], [PLY], DEFAULT)
    (line,) = finding_lines(found)
    assert "worst 1 mm instead of 3 mm on B1, sheet 1 at (50, 50); 1 more piece." in line
    record = preflight_record(found, [PLY], DEFAULT)
    flaws = [taken_apart(Finding(**entry)) for entry in record["findings"]]
    assert [(flaw.piece, flaw.count) for flaw in flaws] == [("B1", 1), ("A1", 2)]  # worst first


# Whole jobs.


@pytest.fixture(scope="module")
def job(finished):
    """Return the folder of a job whose sheet is larger than one target takes."""
    return finished("shape:octahedron", "--size", "300mm", "--effort", "quick", "--sheet",
                    "1500x600mm", "--target", "snijlab")  # fmt: skip


def test_a_job_is_checked_against_its_own_target(job) -> None:
    record = json.loads((job / "preflight.json").read_text(encoding="utf-8"))
    assert record["target"] == "snijlab"
    flaws = [taken_apart(Finding(**entry)) for entry in record["findings"]]
    assert [(flaw.rule, flaw.value) for flaw in flaws] == [("sheet", 1500.0)]


@pytest.mark.slow
def test_strict_refuses_what_breaks_a_rule_and_keeps_nothing(job, tmp_path) -> None:
    out = tmp_path / "out"
    # Pieces that have no room for an id.
    narrow = "shape:octahedron --size 100mm --width 1.5mm --fastener none --joint glue"
    assert run("make", *narrow.split(), "--force", "--strict", "-q", "-o", out) == 1
    assert run("make", "--config", job / "job.toml", "--strict", "-q", "-o", out) == 1
    assert list(tmp_path.iterdir()) == []
    # The other way round: what was asked strictly stays so in job.toml.
    assert run("make", "--config", job / "job.toml", "--target", "default", "--strict", "-q", "-o",
               out) == 0  # fmt: skip
    assert tomllib.loads((out / "job.toml").read_text(encoding="utf-8"))["job"]["strict"] is True
