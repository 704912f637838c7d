"""The catalogue of fasteners: what is sold goes through the holes and holds the stacks it says."""

import pytest

from fabweave.job.ask import brief_of, complete_settings
from fabweave.options.settings import Settings
from fabweave.stock.hardware import hardware_catalogue, hardware_named
from fabweave.stock.material import hole_edge_mm, material_named

SORTS = tuple(hardware_catalogue().values())


def fitting(hole_mm: float, grip_mm: float) -> set[str]:
    return {sort.name for sort in SORTS if sort.fits(hole_mm, grip_mm)}


@pytest.mark.parametrize("sort", SORTS, ids=lambda sort: sort.name)
def test_every_entry_can_be_used(sort):
    low, high = sort.hole_mm
    assert low <= sort.cut_mm <= high
    assert not sort.lengths or len(sort.lengths) == len(sort.grips_mm)
    assert sorted(sort.grips_mm) == list(sort.grips_mm)
    assert all(least < most for least, most in sort.grips_mm)
    assert sort.fits(sort.cut_mm, sum(sort.grips_mm[0]) / 2)
    assert set(sort.assumed) <= {"hole_mm", "grips_mm", "head_mm", "seconds", "each"}
    # A head holds only if it is wider than its hole; thread has none.
    assert sort.head_mm == 0.0 or sort.head_mm > low


def test_what_practice_says_of_thin_stacks():
    # Two layers of 0.2 mm shim are below any blind rivet, and no book screw holds under 2 mm.
    assert not any("rivet" in name for name in fitting(3.3, 0.4))
    assert "blind-rivet-3.2" in fitting(3.3, 1.2)
    assert fitting(5.1, 1.9) == set()
    assert fitting(5.1, 2.0) == {"book-screw"}
    assert hardware_named("blind-rivet-3.2").length_for(4.5) == "blind rivet 3.2 x 8"


def test_hardware_sets_the_hole_and_keeps_its_head_off_the_edge():
    settings, supplies = complete_settings(Settings.of("shape:cube", fastener="brad"))
    (rule,) = brief_of(settings, supplies).rules
    card = material_named("card")
    assert (rule.hole_mm, rule.edge_mm) == (3.3, max(hole_edge_mm(card, 3.3), 3.2))
    thin = Settings.of("shape:cube", fastener="mini-brad, 2mm")
    assert [rule.hole_mm for rule in brief_of(*complete_settings(thin)).rules] == [2.0]


def test_holes_are_offered_only_if_something_holds_such_a_stack():
    offered = [
        [
            rule.hole_mm
            for rule in brief_of(*complete_settings(Settings.of("shape:cube", **told))).rules
        ]
        for told in ({"material": "card"}, {"material": "birch-ply-1.5"})
    ]
    # A 4 mm rivet holds 1 mm and more: two layers of card are 0.8 mm.
    assert offered[0][0] == 3.3
    assert offered[1][0] == 4.1
