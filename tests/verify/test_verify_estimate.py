"""Times and prices are what lengths, speeds and areas make; anything else is found."""

import json
from dataclasses import replace

import pytest

from fabweave.core.records import from_json, to_json
from fabweave.report.accounts import SheetAccount, Totals, sum_sheets
from fabweave.report.estimate import PIERCE_S, estimate_section, estimate_sheets
from fabweave.stock.material import material_named
from fabweave.verify.checks.reports.estimate import check_estimate
from fabweave.verify.read.job_files import load_job
from fabweave.verify.statement import Tally

CARD, SHIM = material_named("card"), material_named("spring-shim-0.1")
#: What the job's account of a sheet leaves unsaid.
UNSTATED = {"stock": "", "price": None, "material": "card", "thickness_mm": 0.4}
PRICED = replace(CARD, price_per_m2=8.0, currency="EUR")


@pytest.fixture(scope="module")
def read(true_jobs):
    """Return a job as read, with the estimate that its maker would state."""
    job = load_job(true_jobs("torus"), Tally("files"))
    rows = (UNSTATED | row for row in job.waste["sheets"])
    sheets = [from_json(SheetAccount, row) for row in rows]
    estimate = estimate_sheets(sheets, [PRICED] * len(sheets))
    return replace(job, waste=job.waste | {"estimate": to_json(estimate)})


def found(job, change):
    plan, waste = job.map, json.loads(json.dumps(job.waste))
    change(waste)
    sheets = tuple(
        replace(sheet, material=PRICED.name, thickness_mm=PRICED.thickness_mm)
        for sheet in plan.sheets
    )
    tally = Tally("estimate")
    check_estimate(replace(job, map=replace(plan, sheets=sheets), waste=waste), tally)
    return " | ".join(tally.result().findings)


def first(waste):
    return waste["estimate"]["sheets"][0]


CHANGES = [
    (lambda _: None, None),
    (lambda w: w.update(estimate=None), None),
    (
        lambda w: w["sheets"][0].update(cut_length_mm=5.0),
        "sheet 1: cut_length_mm is 5, but should be",
    ),
    (lambda w: w["sheets"][0].update(pierces=5), "sheet 1: pierces is 5, but should be"),
    (lambda w: w["totals"].update(pierces=5), "totals: pierces is 5, but should be"),
    (lambda w: first(w)["cut_s"].reverse(), "sheet 1, cut_s: fastest is"),
    (lambda w: first(w).update(cut_s=None), "cut_s: slowest is nothing, but should be"),
    (lambda w: first(w).update(price=99.0), "estimate, sheet 1: price is 99, but should be"),
    (
        lambda w: first(w).update(sheet=9),
        "estimate: sheets lack 1, and have 9, which should not be there",
    ),
    (
        lambda w: w["estimate"].update(price=99.0),
        "waste.json, estimate: price is 99, but should be",
    ),
    (
        lambda w: w["estimate"].update(cut_s=[1.0, 2.0]),
        "estimate, cut_s: fastest is 1, but should be",
    ),
    (lambda w: w["estimate"].update(pierce_s=5.0), "sheet 1, cut_s: slowest is"),
    (lambda w: w["estimate"]["materials"][0].update(speed_mm_s=None), "], but should be nothing"),
    (lambda w: w["estimate"]["materials"][0].update(price_per_m2=None), "but should be nothing"),
]


@pytest.mark.parametrize("number", range(len(CHANGES)))
def test_whatever_is_spoilt_is_found(read, number):
    change, words = CHANGES[number]
    told = found(read, change)
    assert told == "" if words is None else words in told


SHEETS = [
    SheetAccount(
        number=number, width_mm=500.0, height_mm=500.0, area_mm2=2.5e5, piece_area_mm2=2e5,
        hole_area_mm2=0.0, waste_mm2=5e4, utilisation=0.8, pieces=9, cut_length_mm=6000.0 * number,
        pierces=30, stock="", price=None, material="card", thickness_mm=0.4,
    )
    for number in (1, 2)
]  # fmt: skip


def test_times_are_length_over_speed_and_piercings():
    estimate = estimate_sheets(SHEETS, [PRICED, PRICED])
    fast, slow = max(CARD.speed_mm_s), min(CARD.speed_mm_s)
    for sheet, sheet_estimate in zip(SHEETS, estimate.sheets, strict=True):
        bare = [sheet.cut_length_mm / speed for speed in (fast, slow)]
        assert sheet_estimate.cut_s == pytest.approx([time + 30 * PIERCE_S for time in bare])
        assert sheet_estimate.price == 2.0
    assert estimate.cut_s == pytest.approx([18000 / fast + 30.0, 18000 / slow + 30.0])
    assert estimate.price == 4.0


def test_what_is_not_known_is_not_guessed():
    assert SHIM.speed_mm_s is None
    assert estimate_sheets(SHEETS, [SHIM, SHIM]) is None
    estimate = estimate_sheets(SHEETS, [PRICED, SHIM])
    assert (estimate.cut_s, estimate.price) == (None, None)
    assert to_json(estimate.sheets[1]) == {"sheet": 2, "cut_s": None, "price": None}
    # Two currencies make no sum.
    other = replace(PRICED, name="else", currency="USD")
    assert estimate_sheets(SHEETS, [PRICED, other]).price is None


def test_the_page_shows_each_sheet_and_all():
    names = ["sheet_01", "sheet_02"]
    totals = Totals(
        sums=sum_sheets(SHEETS), cut_length_mm=18000.0, pierces=60, engrave_length_mm=0.0,
        holes=0, mass_g=1.0,
    )  # fmt: skip

    def page_of(*materials):
        estimate = estimate_sheets(SHEETS, materials)
        return estimate_section(estimate, SHEETS, totals, names, materials)

    page = page_of(PRICED, SHIM)
    assert "<td>sheet_01</td><td>6.0</td><td>30</td><td>1.9 to 2.8</td><td>2.00 EUR</td>" in page
    assert "<td>sheet_02</td><td>12.0</td><td>30</td><td>unknown</td><td>unknown</td>" in page
    assert "<td>all</td><td>18.0</td><td>60</td><td>unknown</td><td>unknown</td>" in page
    # A column of which nothing is known is left out.
    assert "<th>Material</th>" in page
    assert "Material" not in page_of(CARD, SHIM)
    assert page_of(SHIM, SHIM) == ""
