from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.stock.material import (
    hole_edge_mm,
    material_library,
    material_named,
    min_bend_radius_mm,
    with_thickness,
)

ANY = st.sampled_from(material_library())


@given(ANY, st.floats(0.05, 10), st.floats(0.05, 10))
def test_thicker_bends_less(material, one, other):
    thin, thick = sorted((one, other))
    assert min_bend_radius_mm(with_thickness(material, thin)) <= min_bend_radius_mm(
        with_thickness(material, thick)
    )


@pytest.mark.parametrize(
    ("thickness", "radius"), [(0.89, 51), (1.78, 132), (3.18, 305), (3.94, 406)]
)
def test_plywood_bends_as_ac_43_13_says(thickness, radius):
    ply = with_thickness(material_named("birch-ply-1.5"), thickness)
    assert min_bend_radius_mm(ply) == pytest.approx(radius)


@pytest.mark.parametrize(
    "change", [{"thickness_mm": 0.0}, {"gap_mm": float("nan")}, {"min_bend_radius_t": None}]
)
def test_values_that_no_material_has_are_refused(change):
    with pytest.raises(InputError):
        replace(material_named("card"), **change)


@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_thickness_and_hole_must_be_positive(value):
    with pytest.raises(InputError):
        with_thickness(material_named("card"), value)
    with pytest.raises(InputError):
        hole_edge_mm(material_named("card"), value)
