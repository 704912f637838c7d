"""Creases are measured where they are, and held to what can be softened between crossings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid
from ribbon_strips import strip

from fabweave.ribbon.lay import check_object
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.ribbon_check import check_ribbons
from fabweave.ribbon.rules.rules import measure_along
from fabweave.stock.ribbon_limits import Limits, ribbon_limits


def folded(angle_deg: float, at: int, width: float = 8.0) -> Ribbons:
    """Lay a strip of eight rungs 10 mm apart, flat but for a fold at one; panels from 1 and 5."""
    along = np.array([10.0 * (k - at) for k in range(8)])
    turn = np.radians(angle_deg)
    beyond = np.maximum(along, 0.0)
    x = np.minimum(along, 0.0) + beyond * np.cos(turn)
    z = -beyond * np.sin(turn)
    right, left = (np.column_stack((x, np.full(8, y), z)) for y in (0.0, width))
    return strip(right, left, entry=np.array([1, 5]))


LIMITS = Limits(thickness_mm=0.4, bend_mm=50.0, width_mm=1.0, twist_deg=30.0)


@given(st.integers(-1700, 1700).map(lambda n: n / 10), st.sampled_from([3, 4]))
def test_a_fold_between_crossings_is_the_crease(angle, at) -> None:
    found = measure_along(folded(angle, at), LIMITS)["crease"]
    # From the middle of one panel to that of the next it is 40 mm, however it is folded.
    assert found.limit_at(0) == pytest.approx(np.degrees(40.0 / 50.0))
    assert found.value.max() == pytest.approx(abs(angle), abs=1e-6)
    assert np.sort(found.value)[:-1] == pytest.approx(0.0, abs=1e-6)
    place = found.position[np.argmax(found.value)]
    if abs(angle) > 1e-3:
        assert place == pytest.approx([0.0, 4.0, 0.0], abs=1e-9)
        assert found.passes[np.argmax(found.value)] == 0
    assert len(found.broken) == (abs(angle) > np.degrees(0.8))


def test_a_crease_too_sharp_is_told_with_thread_station_and_place() -> None:
    woven, settings, supplies = laid("shape:sphere?n=4", size_mm=300.0, material="birch-veneer")
    assert "crease" not in {
        one.rule for one in check_object(woven, settings.ribbons, supplies).findings
    }
    ribbons = woven.ribbons
    at = 29
    rung = int(ribbons.entry[at]) + 2
    # The first cross-line after a panel is pushed inwards, so that it turns sharply.
    pushed = 12.0 * ribbons.normal[woven.weave.threads.crossing[at]]
    sides = [rail.copy() for rail in (ribbons.right, ribbons.left)]
    for rail in sides:
        rail[rung] -= pushed
    spoilt = Ribbons(**{**vars(ribbons), "right": sides[0], "left": sides[1]})
    limits = ribbon_limits(supplies.only)
    check = check_ribbons(spoilt, woven.weave, woven.labels, limits, size_mm=300.0)
    (found,) = (one for one in check.findings if one.rule == "crease")
    threads = woven.weave.threads
    owner = int(threads.thread_of_pass[at])
    assert found.thread == woven.labels[owner]
    assert found.crossing == threads.crossing[at]
    assert found.station == at - threads.offsets[owner]
    assert found.value > found.limit
    middle = (spoilt.right[rung] + spoilt.left[rung]) / 2
    assert found.position == pytest.approx(middle, abs=1e-3)
