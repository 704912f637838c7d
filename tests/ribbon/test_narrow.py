"""With the width left to fabweave, no two ribbons come too near; and no others are narrowed."""

import numpy as np
import pytest
from clear_ribbons import intersecting
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from jobs import laid
from meshes_shared import shared_mesh

from fabweave.mesh.shapes.catalogue import SHAPES
from fabweave.ribbon.lay import (
    WovenObject,
    check_object,
    keep_clear,
    lay_ribbons,
    widest_clear,
    widest_width,
)
from fabweave.ribbon.project import Ribbons, convex_quads, following_rung, straighten_panels
from fabweave.ribbon.rules.bends import measure_bends
from fabweave.ribbon.rules.rules import measure_clearance, pass_of_rungs
from fabweave.ribbon.width import PROPORTIONAL, WidthRule
from fabweave.stock.ribbon_limits import ribbon_limits

#: Built-in shapes that are large as they come.
LARGE = ("slit", "bipyramid", "regular", "cage")


def object_and_limits(mesh: str, **options):
    options = {"size_mm": 400.0, **options}
    woven, settings, supplies = laid(mesh, **options)
    return woven, settings, supplies, ribbon_limits(supplies.only, settings.ribbons.clearance_mm)


def assert_clear(mesh: str, **options) -> WovenObject:
    woven, settings, supplies, limits = object_and_limits(mesh, **options)
    # With laps everywhere, and with laps at some crossings only, as a job has them.
    some = np.arange(0, woven.weave.threads.n_crossings, 5)
    for laps in (None, some):
        clear = keep_clear(woven, settings.ribbons, supplies, laps)
        assert len(measure_clearance(clear.ribbons, woven.weave, limits)[0].value) == 0
        assert intersecting(clear.ribbons) == 0
    return clear


@pytest.mark.parametrize(
    "shape",
    [
        pytest.param(shape.name, marks=pytest.mark.slow if shape.name in LARGE else ())
        for shape in SHAPES
    ],
)
def test_no_two_ribbons_intersect_on_any_shape(shape: str) -> None:
    assert_clear(f"shape:{shape}")
    if shape == "tetrahedron":  # where there is least room
        for smooth in (0, 1, 8):
            assert_clear("shape:tetrahedron", smooth=smooth, material="birch-ply-3")


def test_a_width_that_is_asked_for_is_kept_and_the_collision_told() -> None:
    woven, settings, supplies, _ = object_and_limits(
        "shape:tetrahedron", width=WidthRule(0.65), course="projection"
    )
    kept = keep_clear(woven, settings.ribbons, supplies)
    assert kept.narrowed is None
    assert np.array_equal(kept.ribbons.right, woven.ribbons.right)
    findings = check_object(kept, settings.ribbons, supplies).findings
    assert "clearance" in {found.rule for found in findings}


@pytest.mark.parametrize("shape", ["torus?m=12&n=6", "hypar", "cube"])
def test_where_all_have_room_nothing_changes(shape: str) -> None:
    woven, settings, supplies, _ = object_and_limits(f"shape:{shape}")
    clear = keep_clear(woven, settings.ribbons, supplies)
    assert clear.narrowed.factor.min() == 1.0
    for name in ("right", "left", "from_right"):
        assert np.array_equal(getattr(clear.ribbons, name), getattr(woven.ribbons, name))


def test_only_what_is_too_near_gets_narrower() -> None:
    # Of the five solids only the tetrahedron has too little room, if strands bend.
    woven, settings, supplies, limits = object_and_limits(
        str(shared_mesh("ngon/platonic_shelf.obj")), course="projection", width=PROPORTIONAL
    )
    clear = keep_clear(woven, settings.ribbons, supplies)
    threads = woven.weave.threads
    changed = np.unique(threads.thread_of_pass[clear.narrowed.factor < 1])
    assert len(changed) == 3
    assert (threads.lengths[changed] == 4).all()
    assert len(measure_clearance(woven.ribbons, woven.weave, limits)[0].value) > 0


@pytest.mark.parametrize("name", ["tri/csaszar.obj", "ngon/spot_control_mesh.obj"])
def test_ribbons_taper_and_stay_fit_to_be_handled(name: str) -> None:
    woven, settings, supplies, limits = object_and_limits(str(shared_mesh(name)))
    clear = keep_clear(woven, settings.ribbons, supplies)
    factor, least = clear.narrowed.factor, np.minimum(clear.narrowed.least, 1.0)
    assert (factor >= least).all()
    following = following_rung(clear.ribbons.pass_offsets, clear.ribbons.closed)
    here = np.flatnonzero(following >= 0)
    # No ribbon narrows faster than to three quarters, unless it may be no narrower: it would soon
    # be too thin to handle between its panels.
    narrower = lay_ribbons(
        woven.source,
        woven.weave,
        settings.ribbons,
        supplies.thickness_mm(woven.bunches),
        None,
        0.9 * factor,
    )
    width = np.nan_to_num(measure_bends(narrower).width_mm, nan=np.inf)
    beside = np.full(len(factor), np.inf)
    passes = pass_of_rungs(narrower)
    np.minimum.at(beside, passes, width)
    np.minimum.at(beside, following[passes], width)
    for one, other in ((here, following[here]), (following[here], here)):
        free = (factor[one] > least[one]) & (beside[one] > 1.05 * limits.width_mm)
        assert (factor[one] <= factor[other] / 0.75 + 1e-12)[free].all()
    before = measure_bends(woven.ribbons).width_mm
    after = measure_bends(clear.ribbons).width_mm
    assert np.nanmin(after) >= min(np.nanmin(before), limits.width_mm) * 0.99


@pytest.mark.parametrize("shape", ["tetrahedron", "torus?m=12&n=6", "icosahedron"])
def test_the_widest_width_is_clear_and_a_wider_one_is_not(shape: str) -> None:
    woven, settings, supplies, limits = object_and_limits(f"shape:{shape}", course="projection")

    def lay(width_mm: float) -> Ribbons:
        rule = WidthRule(least_mm=width_mm, most_mm=width_mm)
        changed = settings.but(width=rule).ribbons
        return lay_ribbons(woven.source, woven.weave, changed, supplies.thickness_mm(woven.bunches))

    def near(width_mm: float) -> int:
        return len(measure_clearance(lay(width_mm), woven.weave, limits)[0].value)

    share = {"length": settings.ribbons.panel_share, "portals": woven.source.portals}
    room = widest_width(woven.mesh, woven.halfedges, woven.weave, **share)
    widest = widest_clear(lay, woven.weave, limits, room)
    assert near(widest) == 0
    assert widest == room or near(1.021 * widest) > 0
    assert (widest < room) == (shape == "tetrahedron")
    # Where there is room for nothing that can be handled, there is no such width.
    assert widest_clear(lay, woven.weave, limits, 0.99 * limits.width_mm) is None


@given(arrays(float, (40, 4, 2), elements=st.integers(-40, 40).map(lambda n: n / 8)))
def test_quads_become_convex_and_keep_their_middle(corners) -> None:
    quads = np.concatenate((corners, np.zeros((40, 4, 1))), axis=2)
    edge, across = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    area = np.cross(edge, across)[:, 2]
    longer = np.maximum(np.linalg.norm(edge, axis=1), np.linalg.norm(across, axis=1))
    quads, area, longer = (part[np.abs(area) > 0.05 * longer**2] for part in (quads, area, longer))
    moved = convex_quads(quads)

    def corners_of(some):
        """Return twice the signed areas of the triangles at the corners, (4, N)."""
        sides = np.roll(some, -1, axis=1) - some
        return np.cross(np.roll(sides, 1, axis=1), sides)[:, :, 2].T * np.sign(area)

    assert moved.mean(axis=1) == pytest.approx(quads.mean(axis=1))
    # Neither the diagonals nor, with them, the normal change; only where they cross.
    for a, b in ((0, 2), (1, 3)):
        assert moved[:, b] - moved[:, a] == pytest.approx(quads[:, b] - quads[:, a])
    shift = np.linalg.norm(moved[:, 0] - quads[:, 0], axis=1) * 2
    free = shift < 0.499 * longer
    assert (corners_of(moved) > 0)[:, free].all()
    # Each corner's triangle is a tenth of the quad at least: nothing is to be moved.
    fine = (corners_of(quads) >= 0.1001 * np.abs(area)).all(axis=0)
    assert (shift[fine] == 0).all()


def turns_of_panels(right, left, entry, normal):
    panel = np.stack((right[entry], right[entry + 1], left[entry + 1], left[entry]), axis=1)
    before, after = (np.roll(panel, shift, axis=1) - panel for shift in (1, -1))
    return np.einsum("pkd,pd->pk", np.cross(after, before), normal)


@given(arrays(float, (60, 2, 2), elements=st.integers(-40, 40).map(lambda n: n / 8)))
def test_panels_that_run_through_themselves_are_straightened_and_no_others(halves) -> None:
    # Two rungs each, with their middles on the y-axis, somehow slanted.
    half = np.concatenate((halves, np.zeros((60, 2, 1))), axis=2).reshape(-1, 3)
    half = half[np.repeat((half.reshape(60, 2, 3) != 0).any(axis=2).all(axis=1), 2)]
    entry = np.arange(0, len(half), 2)
    middle = np.tile([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]], (len(entry), 1))
    normal = np.tile([0.0, 0.0, 1.0], (len(entry), 1))
    right, left = middle + half, middle - half
    fine = (turns_of_panels(right, left, entry, normal) > 0.0).all(axis=1)
    straightened = right.copy(), left.copy()
    straighten_panels(*straightened, entry, normal)
    assert (turns_of_panels(*straightened, entry, normal) > 0.0).all()
    assert sum(straightened) / 2 == pytest.approx(middle)
    long = np.linalg.norm(straightened[1] - straightened[0], axis=1)
    assert long == pytest.approx(2 * np.linalg.norm(half, axis=1))
    same = np.repeat(fine, 2)
    assert np.array_equal(straightened[0][same], right[same])
    assert np.array_equal(straightened[1][same], left[same])


def test_no_panel_of_a_scan_runs_through_itself() -> None:
    # Some of its faces are nearly folded onto their neighbours.
    woven, settings, supplies, _ = object_and_limits(str(shared_mesh("ngon/spot_control_mesh.obj")))
    ribbons = keep_clear(woven, settings.ribbons, supplies).ribbons
    normal = ribbons.normal[woven.weave.threads.crossing]
    assert (turns_of_panels(ribbons.right, ribbons.left, ribbons.entry, normal) > 0.0).all()
