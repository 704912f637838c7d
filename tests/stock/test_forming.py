"""What is known of softened materials is told where bends ask for it, and only there."""

import pytest

from fabweave.stock.material import (
    formed_radius_mm,
    forming_advice,
    material_library,
    material_named,
    min_bend_radius_mm,
    with_thickness,
)

FORMED = [material for material in material_library() if material.formed_table_mm]


@pytest.mark.parametrize("material", FORMED)
def test_what_was_softened_bends_more_tightly_at_any_thickness(material) -> None:
    for thickness in (0.3, 0.89, 1.0, 1.78, 3.1, 3.94, 6.0):
        sheet = with_thickness(material, thickness)
        formed = formed_radius_mm(sheet)
        assert formed is not None
        # The table of the FAA has a quarter to a third.
        assert 0.24 < formed / min_bend_radius_mm(sheet) < 0.34
        assert forming_advice(sheet, formed) is not None
        assert forming_advice(sheet, 0.99 * formed) is None


def test_all_plywood_and_nothing_else_is_known() -> None:
    assert [material.name for material in FORMED] == [
        "birch-veneer", "birch-ply-1.5", "birch-ply-3"
    ]  # fmt: skip
    assert forming_advice(material_named("acrylic-3"), 500.0) is None
