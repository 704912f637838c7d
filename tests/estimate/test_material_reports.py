"""The same sphere in six materials: different, sensible reports, and a refusal that helps."""

import re
from itertools import pairwise

import numpy as np
import pytest
from jobs import laid

from fabweave.core.errors import CannotMakeError
from fabweave.job.ask import brief_of
from fabweave.piece.joined_object import split_object
from fabweave.ribbon.lay import check_object
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.material import material_named

#: From the most pliable to the stiffest that can be made at 300 mm.
MADE = ("spring-shim-0.1", "card", "polypropylene", "birch-veneer", "aluminium-5052")
REFUSED = "stainless-304"


def checked(material: str, size_mm: float = 300.0) -> RibbonCheck:
    woven, settings, supplies = laid(
        "shape:sphere", size_mm=size_mm, material=material, max_length_mm=250.0
    )
    woven = split_object(woven, brief_of(settings, supplies)).woven
    return check_object(woven, settings.ribbons, supplies)


@pytest.fixture(scope="module")
def checks() -> dict[str, RibbonCheck]:
    return {name: checked(name) for name in MADE}


@pytest.mark.slow
def test_stiffer_materials_want_larger_objects(checks) -> None:
    sizes = [checks[name].smallest_mm for name in MADE]
    assert all(one < other for one, other in pairwise(sizes))
    # What fits at 300 mm has no finding that a size would mend; what does not has one.
    for check in checks.values():
        sized = [found for found in check.findings if found.size_mm is not None]
        assert bool(sized) == (check.smallest_mm > 300)


@pytest.mark.slow
def test_thick_layers_bend_ribbons_more(checks) -> None:
    by_thickness = sorted(MADE, key=lambda name: material_named(name).thickness_mm)
    tightest = [checks[name].measured["bend"].value.min() for name in by_thickness]
    assert np.all(np.diff(tightest) < 0)


@pytest.mark.slow
def test_each_size_is_nearly_the_least_at_which_all_rules_hold(checks) -> None:
    for name in ("card", "aluminium-5052"):
        size = checks[name].smallest_mm
        assert not {found.rule for found in checked(name, float(size)).findings} - {"twist"}
        smaller = {found.rule for found in checked(name, 0.93 * size).findings}
        assert smaller & {"width", "bend", "crease", "clearance"}


@pytest.mark.slow
def test_what_is_too_stiff_is_refused_with_a_size_that_does() -> None:
    with pytest.raises(CannotMakeError, match="is too stiff") as error:
        checked(REFUSED)
    message = str(error.value)
    told = re.findall(r"(\d+)mm", message.split("use ")[1])[:2]
    within, with_care = (int(size) for size in told)
    assert 300 < with_care < within
    care = checked(REFUSED, float(with_care))
    assert not care.refused
    assert "bend" in {found.rule for found in care.findings}
    assert "bend" not in {found.rule for found in checked(REFUSED, float(within)).findings}
    with pytest.raises(CannotMakeError, match="too stiff"):
        checked(REFUSED, 0.97 * with_care)
