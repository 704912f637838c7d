"""Findings name the right place, and the sizes that they propose are the smallest that do."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid
from ribbon_strips import shifted

from fabweave.core.errors import CannotMakeError
from fabweave.options.settings import Settings
from fabweave.ribbon.lay import WovenObject, check_object, require_stiffness
from fabweave.ribbon.rules.broken_rule import BrokenRule, sentence
from fabweave.ribbon.rules.remedy import smallest_size
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons
from fabweave.ribbon.width import WidthRule
from fabweave.stock.material import material_library, material_named
from fabweave.stock.ribbon_limits import ribbon_limits
from fabweave.stock.supplies import Supplies


def woven(mesh: str, **options) -> tuple[WovenObject, Settings, Supplies]:
    return laid(f"shape:{mesh}", **options)


def checked(mesh: str, **options) -> RibbonCheck:
    object_, settings, supplies = woven(mesh, **options)
    return check_object(object_, settings.ribbons, supplies)


def rules(check: RibbonCheck) -> dict:
    return {found.rule: found for found in check.findings}


@given(
    st.floats(1.0, 1e5), st.sampled_from([0.5, 1.0, 1.7]), st.integers(1, 5000), st.floats(0, 0.5)
)
def test_the_smallest_size_is_the_smallest(needed, power, start, bend) -> None:
    def margin(size: int) -> float:
        share = size / needed
        return share**power * (1 + bend * share) / (1 + bend)

    size = smallest_size(margin, start, most=10**6)
    assert size is not None
    assert margin(size) >= 1
    step = max(1, size // 1000)
    assert size == 1 or margin(size - step) < 1


def test_a_rule_that_no_size_mends_has_none() -> None:
    assert smallest_size(lambda _: 0.0, 10, most=1000) is None
    assert smallest_size(lambda _: np.inf, 10, most=1000) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "material", "size"),
    [
        ("sphere?n=6", "aluminium-5052", 300.0),
        ("torus?m=24&n=12", "birch-veneer", 250.0),
        ("hypar", "birch-ply-1.5", 300.0),
    ],
)
def test_at_the_size_proposed_every_rule_just_holds(mesh, material, size) -> None:
    before = checked(mesh, material=material, size_mm=size)
    assert before.findings
    assert before.smallest_mm is not None
    after = checked(mesh, material=material, size_mm=float(before.smallest_mm))
    assert set(rules(after)) <= {"twist"}
    smaller = checked(mesh, material=material, size_mm=0.98 * before.smallest_mm)
    assert set(rules(smaller)) & {"width", "bend", "clearance"}
    # Asked from the other side, the answer is the same.
    assert after.smallest_mm == pytest.approx(before.smallest_mm, abs=1)
    for rule, found in rules(before).items():
        if found.size_mm is not None:
            assert rule not in rules(checked(mesh, material=material, size_mm=found.size_mm))
            less = min(0.98 * found.size_mm, size)
            assert rule in rules(checked(mesh, material=material, size_mm=less))


def test_a_material_too_stiff_is_refused_with_the_size_that_would_do() -> None:
    woven_object, settings, supplies = woven("sphere?n=6", material="stainless-304", size_mm=300.0)
    check = check_object(woven_object, settings.ribbons, supplies)
    (found,) = check.refused
    with pytest.raises(CannotMakeError, match=f"--size {found.size_mm}mm") as error:
        require_stiffness(woven_object, settings.ribbons, supplies)
    options = {"material": "stainless-304"}
    do = checked("sphere?n=6", size_mm=float(found.may_be_mm), **options)
    assert not do.refused
    assert rules(do)["bend"].severity == "warn"
    assert checked("sphere?n=6", size_mm=0.98 * found.may_be_mm, **options).refused
    # So would the thinner sheet.
    thin = float(str(error.value).split("--thickness ")[1].split("mm")[0])
    assert thin < supplies.only.thickness_mm
    assert not checked("sphere?n=6", size_mm=300.0, thickness_mm=thin, **options).findings


def test_a_ribbon_that_sags_onto_its_partner_is_found_at_its_crossing() -> None:
    woven_object, _, supplies = woven("torus?m=12&n=8", size_mm=300.0)
    ribbons, threads = woven_object.ribbons, woven_object.weave.threads
    at = int(np.flatnonzero(woven_object.weave.over)[7])
    crossing = int(threads.crossing[at])
    right, left = ribbons.right.copy(), ribbons.left.copy()
    rungs = ribbons.entry[at] + np.array([0, 1])
    # Only just touching: the middles are half a thickness apart.
    drop = 0.9 * supplies.only.thickness_mm * ribbons.normal[crossing]
    right[rungs] -= drop
    left[rungs] -= drop
    limits = ribbon_limits(supplies.only)
    labels = woven_object.labels
    good = check_ribbons(ribbons, woven_object.weave, labels, limits, size_mm=300.0)
    assert not good.findings
    bad = check_ribbons(
        replace(ribbons, right=right, left=left), woven_object.weave, labels, limits, size_mm=300.0
    )
    found = rules(bad)["layers"]
    owner = int(threads.thread_of_pass[at])
    assert (found.crossing, found.count, found.thread) == (crossing, 1, labels[owner])
    assert found.station == at - threads.offsets[owner]
    assert found.position == pytest.approx(ribbons.centre[crossing], abs=1e-3)
    gap = good.measured["layers"].value[crossing] - 0.9 * supplies.only.thickness_mm
    assert found.value == pytest.approx(gap, abs=1e-6)


def test_a_shifted_ribbon_is_found_by_name() -> None:
    woven_object, _, supplies = woven("sphere?n=4", size_mm=300.0)
    spoilt = shifted(woven_object.ribbons, 3, np.array([8.0, 5.0, 2.0]))
    check = check_ribbons(
        spoilt, woven_object.weave, woven_object.labels, ribbon_limits(supplies.only), size_mm=300.0
    )
    found = rules(check)["clearance"]
    assert found.value == 0
    measured = check.measured["clearance"]
    threads = woven_object.weave.threads.thread_of_pass
    # All that is too near now concerns the ribbon that was moved.
    pairs = np.column_stack((threads[measured.passes], threads[measured.others]))
    assert np.all((pairs == 3).any(axis=1))
    assert woven_object.labels[3] in (found.thread, found.other)


def test_a_pinched_ribbon_is_found_at_its_place() -> None:
    woven_object, _, supplies = woven("sphere?n=4", size_mm=300.0)
    ribbons, threads = woven_object.ribbons, woven_object.weave.threads
    at = 29
    rung = int(ribbons.entry[at])
    left = ribbons.left.copy()
    left[rung] = ribbons.right[rung] + 0.04 * (left[rung] - ribbons.right[rung])
    check = check_ribbons(
        replace(ribbons, left=left), woven_object.weave, woven_object.labels,
        ribbon_limits(supplies.only),
        size_mm=300.0,
    )  # fmt: skip
    found = rules(check)["width"]
    assert found.count == 1
    assert found.crossing == threads.crossing[at]
    assert found.thread == woven_object.labels[threads.thread_of_pass[at]]
    assert found.value < 1.0


def test_clearance_is_mended_by_the_width_proposed() -> None:
    width = WidthRule(0.65)
    options = {"size_mm": 400.0, "course": "projection"}
    before = rules(checked("tetrahedron", width=width, **options))["clearance"]
    assert before.size_mm is None
    factor = before.width_factor
    assert factor is not None
    for share, holds in ((factor, True), (factor + 0.05, False)):
        narrower = width.times(share)
        found = rules(checked("tetrahedron", width=narrower, **options))
        assert ("clearance" not in found) == holds


@pytest.mark.parametrize("material", [m.name for m in material_library()])
def test_limits_follow_the_material(material: str) -> None:
    limits = ribbon_limits(material_named(material))
    assert limits.width_mm >= max(limits.thickness_mm, 1.0)
    # At the limit the edges stretch as the surface does in the tightest bend.
    twist = np.radians(limits.twist_deg)
    assert twist**2 / 12 == pytest.approx(limits.thickness_mm / (2 * limits.bend_mm))


@given(st.floats(1.0, 60.0), st.integers(1, 300))
def test_a_finding_never_says_that_a_value_breaks_a_limit_equal_to_it(limit, thousandths) -> None:
    place = ("A", 3, 17, None, (0.0, 0.0, 0.0), 2, 128)
    found = BrokenRule("twist", "warn", limit + thousandths / 1000, limit, "degrees", *place)
    said = re.findall(r"([\d.]+)°", sentence(found))
    assert float(said[0]) > float(said[1])
