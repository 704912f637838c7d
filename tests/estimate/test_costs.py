"""Costs add up, agree before and after nesting, and grow without steps."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from jobs import make_job

from fabweave.core.errors import InputError
from fabweave.estimate.assembly_time import (
    assembly_time,
    difficulty,
    planned_hands,
)
from fabweave.estimate.costs import job_costs, pieces_costs, side_costs
from fabweave.estimate.machine_time import add_times
from fabweave.estimate.money import hardware_price, machine_price, priced, sheet_price, sum_prices
from fabweave.options.file_kinds import parse_calibration
from fabweave.options.settings import Settings, settings_from_options
from fabweave.plan.bill_of_materials import (
    INSTEAD,
    BillOfMaterials,
    FastenerRow,
    GlueRow,
    TapeRow,
    bill_of_materials,
    buy_lines,
    sorts_for,
)
from fabweave.stock.hardware import hardware_catalogue, hardware_named
from fabweave.stock.machine import HOLDING_S, machines
from fabweave.stock.material import material_named

pytestmark = pytest.mark.usefixtures("quick_jobs")

CARD = material_named("card")


@cache
def job_of(mesh="shape:torus?m=8&n=4", **changed):
    return make_job(Settings.of(mesh, size_mm=300.0, effort="quick", **changed))


def foretold(job):
    """Return what a job costs, as far as that is known before nesting."""
    return pieces_costs(
        job.piece_set, job.woven, job.settings.pieces, job.supplies,
        job.settings.machine.calibrate, common=job.settings.common_cuts,
    )  # fmt: skip


def costs_of(job, materials=None, calibration=1.0):
    """Return the costs of a job again, of other materials."""
    return job_costs(
        job.piece_set,
        job.drawings,
        job.layout.sheets,
        materials or job.allotment.sheet_materials,
        (),
        bill_of_materials(job.piece_set),
        calibration=calibration,
    )


# ---- the machine --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "joint"),
    [
        ("shape:torus?m=8&n=4", "rivet"),
        ("shape:torus?m=8&n=4", "slot"),
        # Of more than forty pieces, letters are laid on some.
        ("shape:torus?m=16&n=8", "rivet"),
    ],
)
def test_plan_and_drawing_agree_on_all_lines_and_nearly_on_the_ways(mesh, joint):
    job = job_of(mesh, joint=joint)
    planned = foretold(job)
    drawn = job.costs
    # Numbers of steps differ before the order is known; an outline may be cut from its other end,
    # which changes where the head rests.
    assert planned.machine.engrave_s == pytest.approx(drawn.machine.engrave_s, rel=0.02)
    assert planned.machine.cut_s == pytest.approx(drawn.machine.cut_s, rel=1e-3)
    assert planned.machine.travel_s == pytest.approx(drawn.machine.travel_s, rel=0.1)
    assert planned.hardware_price == drawn.hardware_price
    assert planned.assembly.practised_h == pytest.approx(drawn.assembly.practised_h, rel=0.1)
    assert planned.planned
    assert not drawn.planned


@pytest.mark.slow
def test_letters_take_longer_than_their_length_at_full_speed():
    job = job_of()
    length = sum(
        float(np.hypot(*np.diff(line.points, axis=0).T).sum())
        for drawing in job.drawings
        for piece in drawing.pieces
        for line in piece.entities
        if line.layer.value.startswith("ENGRAVE")
    )
    fastest = length / machines()["co2"].engrave_mm_s[1]
    assert job.costs.machine.engrave_s[0] > 4 * fastest


@pytest.mark.slow
def test_a_better_machine_is_faster_and_a_pierce_rests():
    job = job_of()
    sheets = len(job.drawings)
    usual, quick, slow = (
        costs_of(job, [material] * sheets).machine
        for material in (
            CARD,
            replace(
                CARD, acceleration_mm_s2=(1000.0, 9000.0), rapid_mm_s=500.0, engrave_mm_s=300.0
            ),
            replace(CARD, pierce_s=(1.0, 1.05)),
        )
    )
    assert all(a < b for a, b in zip(quick.engrave_s, usual.engrave_s, strict=True))
    assert all(a < b for a, b in zip(quick.travel_s, usual.travel_s, strict=True))
    pierces = sum(
        entity.layer.value.startswith("CUT")
        for drawing in job.drawings
        for piece in drawing.pieces
        for entity in piece.entities
    )
    rests = [b - a for a, b in zip(usual.cut_s, slow.cut_s, strict=True)]
    assert rests == pytest.approx([pierces, pierces], abs=2e-3)


@pytest.mark.slow
def test_calibration_multiplies_the_machine_and_nothing_else():
    job = job_of()
    once, twice = costs_of(job), costs_of(job, calibration=2.0)
    assert twice.machine_s == pytest.approx([2 * end for end in once.machine_s], abs=5e-3)
    assert twice.assembly == once.assembly
    assert twice.price == once.price
    assert any("multiplied by 2" in text for text in twice.assumptions)
    assert not any("multiplied" in text for text in once.assumptions)


# ---- hands --------------------------------------------------------------------------------------


def bill_with(hole_mm, needed, *fits):
    """Return a bill of fasteners of one sort of hole, which these sorts fit."""
    row = FastenerRow(
        diameter_mm=hole_mm, layers=2, grip_mm=0.8, needed=needed, spare=2, buy=needed + 2,
        fits=fits,
    )  # fmt: skip
    glue, tape = GlueRow(joints=0, area_mm2=0.0), TapeRow(joints=0, length_mm=0.0)
    return BillOfMaterials(fasteners=(row,), glue=glue, tape=tape)


@pytest.mark.parametrize("sort", hardware_catalogue().values(), ids=lambda sort: sort.name)
def test_a_fastener_takes_and_costs_what_the_catalogue_says(sort):
    bill = bill_with(sort.cut_mm, 100, sort.name)
    (action,) = (one for one in assembly_time(0, 0, 0, [], bill).actions if "fasten" in one.action)
    assert (action.count, action.each_s) == (100, sort.seconds)
    assert hardware_price(bill) == priced((102 * sort.each[0], 102 * sort.each[1]), "EUR")


def test_hours_are_those_of_the_sort_that_is_listed_first():
    bill = bill_with(2.5, 10, "mini-brad", "blind-rivet-2.4", "screw-m2")
    (row,) = bill.fasteners
    blind = replace(row, outside=4, fits=("screw-m2", "blind-rivet-2.4"))
    none = replace(row, outside=4, fits=("screw-m2",))
    for one, names, total in (
        (row, ["mini-brad", "blind-rivet-2.4", "screw-m2"], 80.0),
        (replace(blind, outside=0), ["screw-m2", "blind-rivet-2.4"], 200.0),
        (blind, ["blind-rivet-2.4", "screw-m2"], 80.0),
        (none, ["screw-m2"], 6 * 20.0 + 4 * HOLDING_S["glue"]),
    ):
        changed = replace(bill, fasteners=(one,))
        *_, action = assembly_time(0, 0, 0, [], changed).actions
        assert [sort.name for sort in sorts_for(one)] == names
        assert action.count * action.each_s == pytest.approx(total)
        # What cannot be set from outside is said, with its number.
        (_, text), *washers = buy_lines(changed)
        assert len(washers) == sorts_for(one)[0].washer
        assert (INSTEAD in text) == (one is none)
        assert ("4 of them" in text) == (bool(one.outside))
    # Thread alone goes anywhere: nothing is to be told apart.
    thread = replace(row, outside=4, fits=("thread",), diameter_mm=1.3)
    *_, action = assembly_time(0, 0, 0, [], replace(bill, fasteners=(thread,))).actions
    assert action.each_s == 30.0
    assert "of them" not in buy_lines(replace(bill, fasteners=(thread,)))[0][1]


def test_the_time_of_hands_is_that_of_every_action():
    found = assembly_time(3, 4, 5, ["glue", "rivet", "glue"], bill_with(2.5, 6, "mini-brad"))
    brad_s = hardware_named("mini-brad").seconds
    seconds = 3 * (5 + 5 + 4.5) + 4 * 2.5 + 5 * 8.5 + (6 + 2) * 6 + 2 * 15 + 6 * brad_s
    assert found.practised_h == pytest.approx(seconds / 3600, abs=1e-4)
    assert found.hours == pytest.approx((1.5 * seconds / 3600, 3 * seconds / 3600), abs=1e-4)
    assert sum(action.count * action.each_s for action in found.actions) == seconds


def test_clips_and_the_marks_of_strips_off_a_roll_take_their_time():
    bill = bill_with(2.5, 6, "mini-brad")
    bare, clipped, marked = (
        assembly_time(3, 4, 5, [], bill, **more) for more in ({}, {"clips": 7}, {"marks": 50})
    )
    assert clipped.practised_h - bare.practised_h == pytest.approx(7 * 4 / 3600, abs=2e-4)
    # A strip is measured and cut in place of being sorted: both take as long.
    assert marked.practised_h - bare.practised_h == pytest.approx(50 * 4 / 3600, abs=2e-4)


def test_actions_are_counted_in_steps_and_predicted_before():
    job = job_of()
    bill, joints = bill_of_materials(job.piece_set), ["rivet"] * len(job.piece_set.joints)
    steps = [action.count for action in job.costs.assembly.actions]
    assert steps[:3] == [len(job.piece_set.pieces)] * 3
    crossings = job.weave.threads.n_crossings
    planned = planned_hands(len(job.piece_set.pieces), crossings, joints, bill)
    assert planned.often("over") + planned.often("under") == crossings + len(joints) // 2
    assert planned.actions[-1] == job.costs.assembly.actions[-1]  # fasteners


def test_difficulty_grows_without_steps():
    """No step of a hundredth in anything changes the score by more than a few hundredths."""
    for at, ends in enumerate([(0.0, 60.0), (0.0, 12.0), (40.0, 2.0)]):
        scores = []
        for value in np.linspace(*ends, 2000).tolist():
            figures = [4.0, 1.5, 15.0]
            figures[at] = value
            scores.append(difficulty(*figures).score)
        steps = np.diff(scores)
        assert np.all(steps >= 0.0)
        assert np.all(steps < 0.05)
        assert all(0.0 < score < 10.0 for score in scores)


# ---- money --------------------------------------------------------------------------------------


def test_sheets_cost_their_area_or_what_the_stock_says():
    assert sheet_price(7e5, CARD) == priced((1.4, 3.5), "EUR")
    assert sheet_price((1e6, 2e6), CARD) == priced((2.0, 10.0), "EUR")
    assert sheet_price(7e5, CARD, 2.8) == priced((2.8, 2.8), "EUR")
    one = replace(CARD, price_per_m2=8.0, currency="USD")
    assert sheet_price(5e5, one) == priced((4.0, 4.0), "USD")
    assert sheet_price(5e5, replace(one, price_per_m2=None)) is None


def test_the_machine_costs_what_its_hours_do():
    rented = replace(CARD, machine_per_h=(20.0, 30.0))
    assert machine_price([(1800.0, 3600.0)], [rented]) == priced((10.0, 30.0), "EUR")
    assert machine_price([(1800.0, 3600.0)] * 2, [rented, CARD]) is None
    assert machine_price([None], [rented]) is None
    job = job_of()
    costs = costs_of(job, [rented] * len(job.drawings))
    parts = costs.sheet_price, costs.hardware_price, costs.machine_price
    assert costs.price.low == pytest.approx(sum(part.low for part in parts), abs=1e-3)
    assert costs.price.high == pytest.approx(sum(part.high for part in parts), abs=1e-3)


@pytest.mark.slow
def test_sums_count_the_sheets_of_rings_and_of_a_former():
    job = job_of("shape:sphere?n=3", leave_out="top:120mm", rim="ring", former="auto")
    costs, more = job.costs, [side_costs(each, 1.0) for each in job.beside]
    rows = [*costs.sheets, *(one for each in more for one in each)]
    assert len(more) == 2
    assert len(rows) == len(costs.sheets) + costs.beside
    summed = add_times(row.machine for row in rows)
    for span, wanted in ((costs.machine.cut_s, summed.cut_s), (costs.machine_s, summed.total_s)):
        assert span == pytest.approx(wanted)
    assert costs.sheet_price == sum_prices(row.price for row in rows)
    assert costs.price == sum_prices([costs.sheet_price, costs.hardware_price])
    # Before they are drawn, they are not known, and nothing says otherwise.
    assert set(foretold(job).without) == {"rings", "former"}


# ---- calibration --------------------------------------------------------------------------------


def write_waste(folder, estimate):
    (folder / "waste.json").write_text(json.dumps({"estimate": estimate}), encoding="utf-8")
    return folder


def test_a_measured_job_gives_the_factor_to_the_middle_of_its_estimate(tmp_path):
    folder = write_waste(tmp_path, {"machine_s": [900.0, 3600.0], "calibration": 1.0})
    assert parse_calibration(f"{folder}:30min") == 1.0
    assert parse_calibration(f"{folder}: 0.75 h") == 1.5
    assert parse_calibration(f"{folder}:900s") == 0.5
    # A job that was itself made with a factor says the same of the machine.
    write_waste(tmp_path, {"machine_s": [1800.0, 7200.0], "calibration": 2.0})
    assert parse_calibration(f"{folder}:45min") == 1.5
    settings = settings_from_options("shape:cube", calibrate=f"{folder}:45min")
    assert settings.machine.calibrate == 1.5


@pytest.mark.parametrize(
    "text", ["fast", "42min", ":42min", "x:42", "x:-3min", "x:times.json", "1.3,hands:0.9", ""]
)
def test_what_is_no_calibration_is_told(text):
    with pytest.raises(InputError, match="neither a number such as"):
        parse_calibration(text)


@pytest.mark.parametrize(
    "estimate",
    [
        None,
        {"machine_s": None, "calibration": 1.0},
        {"machine_s": [1.0, 2.0]},
        {"machine_s": [1.0, 2.0], "calibration": 0.0},
        {"machine_s": [1.0], "calibration": 1.0},
        {"machine_s": ["a", 2.0], "calibration": 1.0},
        {"machine_s": [-1.0, 2.0], "calibration": 1.0},
    ],
)
def test_a_job_without_a_time_cannot_calibrate(tmp_path, estimate):
    folder = write_waste(tmp_path, estimate)
    with pytest.raises(InputError, match="has no estimate of the machine's time"):
        parse_calibration(f"{folder}:42min")
    write_waste(tmp_path, {"machine_s": [0.0, 0.0], "calibration": 1.0})
    with pytest.raises(InputError, match="nothing can be calibrated"):
        parse_calibration(f"{folder}:42min")
