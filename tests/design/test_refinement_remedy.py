"""Refinement is named as a remedy only where it was tried and holds."""

import pytest
from jobs import laid

from fabweave.core.errors import CannotMakeError
from fabweave.job.ask import REFINEMENTS, brief_of, try_refinement
from fabweave.piece.joined_strands import split_object
from fabweave.ribbon.lay import check_object
from fabweave.ribbon.rules.broken_rule import sentence, written
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.ribbon.width import WidthRule


def checked(mesh: str, *, tried: bool = True, **options) -> RibbonCheck:
    woven, settings, supplies = laid(mesh, **options)
    woven = split_object(woven, brief_of(settings, supplies)).woven
    check = check_object(woven, settings.ribbons, supplies)
    return try_refinement(check, woven, settings, supplies) if tried else check


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
    options = {"size_mm": 300.0, "material": "birch-ply-3"}
    (found,) = checked("shape:cube", **options).findings
    assert (found.rule, found.refine) == ("bend", None)
    with pytest.raises(CannotMakeError, match="too stiff"):
        checked("shape:cube", refine=REFINEMENTS[0], **options)


def test_where_nothing_is_wrong_nothing_is_tried() -> None:
    check = checked("shape:cube", size_mm=300.0)
    assert check.findings == ()
    assert check.untried is None
