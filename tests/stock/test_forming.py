"""What is known of softened materials is told where bends ask for it, and only there."""

import pytest

from fabweave.design.inspection.facts import inspect_mesh
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
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


@pytest.mark.parametrize(("size", "helps"), [(60.0, False), (95.0, True)])
def test_it_is_told_where_a_material_is_too_stiff_and_softening_helps(size, helps) -> None:
    options = {"material": "birch-veneer", "rotations": "free"}
    torus = Settings.of("shape:torus?m=8&n=4", size_mm=size, **options)
    veneer = material_named("birch-veneer")
    advice = forming_advice(veneer, formed_radius_mm(veneer)).lower()
    assert (advice in inspect_mesh(Stations(torus)).facts["pieces"]["because"].lower()) == helps
