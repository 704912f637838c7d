"""Refinement is named as a remedy only where it was tried and holds."""

import pytest

from fabweave.core.errors import CannotMakeError
from fabweave.job.stations import REFINEMENTS, Stations
from fabweave.options.settings import Settings
from fabweave.ribbon.rules.broken_rule import sentence, written
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.ribbon.width import WidthRule


def checked(mesh: str, *, tried: bool = True, **options) -> RibbonCheck:
    job = Stations(Settings.of(mesh, **options), depth=Depth.SEARCHED if tried else Depth.NEAR)
    return job.check


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "options", "rule"),
    [
        ("shape:torus?m=8&n=4", {"size_mm": 300.0}, "twist"),
        (
            "shape:tetrahedron",
            {"size_mm": 400.0, "width": WidthRule(0.65), "course": "projection"},
            "clearance",
        ),
    ],
)
def test_what_refinement_mends_holds_when_it_is_done(mesh, options, rule) -> None:
    before = checked(mesh, **options)
    (found,) = before.findings
    assert found.rule == rule
    assert found.refine == REFINEMENTS[0]
    assert sentence(found).endswith("--refine catmull-clark:1")
    assert written(found).refine == REFINEMENTS[0]
    assert checked(mesh, tried=False, refine=found.refine, **options).findings == ()


def test_a_finer_mesh_that_is_refused_is_no_remedy() -> None:
    options = {"size_mm": 300.0, "material": "birch-ply-3", "rotations": "free"}
    (found,) = checked("shape:cube", **options).findings
    assert (found.rule, found.refine) == ("bend", None)
    with pytest.raises(CannotMakeError, match="too stiff"):
        checked("shape:cube", refine=REFINEMENTS[0], **options)


def test_where_nothing_is_wrong_nothing_is_tried() -> None:
    check = checked("shape:cube", size_mm=300.0)
    assert check.findings == ()
    assert check.untried is None
