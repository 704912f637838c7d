"""What is foretold of a greatest length is what is made of it, and the maker's wish decides."""

import pytest
from jobs import laid, plan_job

from fabweave.core.errors import CannotMakeError
from fabweave.options.settings import Settings, settings_from_options
from fabweave.piece.split import length_curve
from fabweave.piece.split.length_curve import Choice, preferred
from fabweave.piece.split.preferences import StockSheet, sheets_for
from fabweave.ribbon.lay import WovenObject

pytestmark = pytest.mark.usefixtures("quick_jobs")

TORUS = ("shape:torus?m=16&n=8", {"size": "400mm", "pattern": "twill"})
JOBS = {
    "torus": TORUS,
    "cube": ("shape:cube", {"size": "300mm", "refine": "catmull-clark:2"}),
    "grain": ("shape:torus?m=16&n=8", {"size": "300mm", "rotations": "grain:5deg"}),
    "open": ("shape:hypar?m=7&n=6", {"size": "400mm"}),
    "two materials": (
        "shape:torus?m=6&n=4",
        {"size": "300mm", "material": "warp=card,weft=birch-veneer"},
    ),
    "long laps": ("shape:torus?m=16&n=8", {"size": "300mm", "joint": "rivet,lap=40mm"}),
}


def ribbons_of(mesh: str, **options) -> tuple[WovenObject, Settings]:
    settings = settings_from_options(mesh, sheet=["600x400mm"], force=True, **options)
    woven, settings, _ = laid(settings)
    return woven, settings


@pytest.mark.slow
@pytest.mark.parametrize("name", JOBS)
def test_a_job_of_each_length_has_the_pieces_and_joints_that_were_foretold(name) -> None:
    mesh, options = JOBS[name]
    woven, settings = ribbons_of(mesh, **options)
    plan = plan_job(woven, settings).split_plan
    lengths = [choice.length_mm for choice in plan.choices]
    assert len(lengths) >= 3
    assert lengths == sorted(set(lengths))
    assert plan.chosen in plan.choices
    for choice in plan.choices[:: max(len(plan.choices) // 3, 1)]:
        asked = settings.but(max_length_mm=choice.length_mm)
        if choice.longer:
            with pytest.raises(CannotMakeError):
                plan_job(woven, asked)
            continue
        made = plan_job(woven, asked)
        pieces = made.piece_set
        assert (len(pieces.pieces), len(pieces.joints)) == (choice.pieces, choice.joints)
        assert made.split_plan.chosen == choice
        assert made.split_plan.prefer is None


@pytest.mark.parametrize("prefer", ["balanced", "work", "waste"])
def test_in_a_hurry_the_same_length_is_taken(prefer) -> None:
    woven, settings = ribbons_of("shape:hypar?m=7&n=6", size="400mm", prefer=prefer)
    hurried, usual = (
        plan_job(woven, settings.but(effort=effort)).split_plan for effort in ("quick", "normal")
    )
    assert hurried.chosen == usual.chosen
    assert hurried.runs.thread.tolist() == usual.runs.thread.tolist()


@pytest.fixture(scope="module")
def torus():
    mesh, options = TORUS
    planned = ribbons_of(mesh, **options)
    return planned, plan_job(*planned).split_plan


@pytest.mark.slow
def test_few_threads_of_very_many_stand_for_all(torus, monkeypatch) -> None:
    planned, exact = torus
    monkeypatch.setattr(length_curve, "_MOST_SITES", 100)
    about = plan_job(*planned).split_plan
    assert not any(choice.exact for choice in about.choices)
    # What is made of the length that is taken is counted all the same.
    assert about.chosen.exact
    assert about.chosen.pieces == len(about.runs.thread)
    for choice, guess in zip(exact.choices, about.choices, strict=True):
        assert guess.pieces == pytest.approx(choice.pieces, rel=0.15)


def test_what_the_stock_suffices_for_goes_before_what_costs_less() -> None:
    dear = Choice(200.0, 9, 9, 1.0, 2.0, hours=2.0, cost=9.0)
    lacking = Choice(900.0, 5, 5, 1.0, 2.0, hours=1.0, cost=5.0, lacking_mm2=1.0)
    for prefer in ("work", "waste", "balanced"):
        assert preferred([dear, lacking], prefer) is dear


def test_each_wish_takes_what_has_least_of_it() -> None:
    waste = Choice(1.0, 9, 9, 1.0, 2.0, sheets_mm2=1.0, hours=3.0, cost=3.0)
    work = Choice(2.0, 9, 9, 1.0, 2.0, sheets_mm2=3.0, hours=1.0, cost=2.0)
    balanced = Choice(3.0, 9, 9, 1.0, 2.0, sheets_mm2=2.0, hours=2.0, cost=1.0)
    # Of two that take as many sheets, the one with fewer joints.
    full = Choice(4.0, 8, 8, 1.0, 3.0, sheets_mm2=1.0, hours=3.0, cost=3.0)
    every = waste, work, balanced
    assert preferred(every, "waste") is waste
    assert preferred((*every, full), "waste") is full
    assert preferred(every, "work") is work
    assert preferred(every, "balanced") is balanced


def test_sheets_are_whole_and_those_at_hand_are_used_first() -> None:
    stock = [StockSheet(1.0, 0.0, 2), StockSheet(4.0, 6.0)]
    assert sheets_for(1.5, stock).price == 0.0
    needed = sheets_for(7.0, stock)
    assert (needed.count, needed.area_mm2, needed.price) == (4, 10.0, 12.0)
    assert sheets_for(7.0, stock[:1]).lacking_mm2 == pytest.approx(5.0)
    # Nine sheets, the last one nearly empty, cost as much as nine full ones.
    one = [StockSheet(1.0, 2.0)]
    assert sheets_for(8.01, one) == sheets_for(9.0, one)
