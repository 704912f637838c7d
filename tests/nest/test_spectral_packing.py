"""What pixels prove of positions, and that what is found is free and close."""

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar
from strategies import at_most

from fabweave.nest.container import Container
from fabweave.nest.item_shape import shape_of
from fabweave.nest.layout import effort_named
from fabweave.nest.place.spectral_packing import SheetPixels, grid_of, kernels_of

SHEET = (160.0, 120.0)


def strip(seed):
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, rng.uniform(30.0, 90.0), 20)
    y = rng.uniform(-6.0, 6.0) * np.sin(x / rng.uniform(6.0, 20.0))
    width = rng.uniform(3.0, 12.0)
    return np.stack([np.append(x, x[::-1]), np.append(y, y[::-1] + width)], axis=1)


def filled(seed, area, gap, count=12):
    """Put strips on a sheet until one has no place; return where they stand."""
    effort = effort_named("quick")
    grid = grid_of(area, gap, effort.pixel_mm, 8.0)
    pixels = SheetPixels(grid, effort, workers=1)
    placed = []
    for number in range(count):
        shape = shape_of(strip(seed + number))[0]
        kernels = kernels_of(shape, grid, effort.angles)
        spot = pixels.place(kernels, np.array([shape.length_mm, shape.width_mm]))
        if spot is not None:
            pixels.put(kernels, spot)
            placed.append(spot.apply(shape.outline))
    return placed


@at_most(60)
@given(st.integers(0, 10**6), st.floats(0.0, 8.0), st.floats(0.3, 3.0))
def test_radii_prove_that_shapes_do_not_meet_and_keep_off_what_is_barred(seed, gap, pixel):
    grid = grid_of(Container(SHEET), gap, pixel, 8.0)
    rng = np.random.default_rng(seed)
    piece = rng.uniform(0.0, pixel, (50, 2))
    away = rng.uniform(0.0, 2.0 * np.pi, 50)
    barred = piece + gap * np.stack([np.cos(away), np.sin(away)], axis=1)
    steps = np.arange(-3.0 - 3.0 * gap / pixel, 4.0 + 3.0 * gap / pixel) + 0.5
    centres = pixel * np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    mine = np.linalg.norm(piece[:, None] - centres[None], axis=2) <= grid.radius_mm
    theirs = np.linalg.norm(barred[:, None] - centres[None], axis=2) <= grid.barred_mm
    assert mine.any(axis=1).all()  # where two shapes meet, they share a pixel
    assert (mine & theirs).any(axis=1).all()


@at_most(15)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 1.0, 4.0]))
def test_whatever_is_placed_keeps_the_gap_and_stays_on_the_sheet(seed, gap):
    knot = shapely.Point(70.0, 50.0).buffer(15.0)
    placed = filled(seed, Container(SHEET, knot), gap)
    polygons = shapely.polygons([shapely.linearrings(one) for one in placed])
    assert len(placed) >= 3
    assert shapely.covers(shapely.box(-1e-9, -1e-9, *np.add(SHEET, 1e-9)), polygons).all()
    assert (shapely.distance(polygons, knot) >= gap - 1e-9).all()
    first, second = np.triu_indices(len(polygons), 1)
    assert (shapely.distance(polygons[first], polygons[second]) >= gap - 1e-9).all()
    assert shapely.disjoint(polygons[first], polygons[second]).all()


def test_pieces_are_placed_at_the_gap_not_a_pixel_further():
    effort = effort_named("quick")
    # Five bars and the gaps between them, and one pixel more for all; pixels alone take one each.
    grid = grid_of(Container((80.2, 5 * 9.3 + 4 * 2.0 + 2.0)), 2.0, effort.pixel_mm, 8.0)
    pixels = SheetPixels(grid, effort, workers=1)
    shape = shape_of(bar(80.0, 9.3))[0]
    kernels = kernels_of(shape, grid, effort.angles)
    size = np.array([80.0, 9.3])
    for _ in range(5):
        spot = pixels.place(kernels, size)
        assert spot is not None
        pixels.put(kernels, spot)
    assert pixels.place(kernels, size) is None
