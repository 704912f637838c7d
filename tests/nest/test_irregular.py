"""Pieces on sheets with outlines, defects and grain: every effort keeps off what is barred."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from sheet_fit import bar

from fabweave.core.errors import CannotMakeError
from fabweave.nest import nesting
from fabweave.nest.container import container_of
from fabweave.nest.layout import effort_named
from fabweave.nest.nesting import nest
from fabweave.nest.separate.separation import obstacle_field
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import FREE, Rotations, parse_rotations
from fabweave.stock.sheet_size import SheetSize

MARGIN, GAP = 4.0, 1.0
EL = ((0.0, 0.0), (260.0, 0.0), (260.0, 70.0), (110.0, 90.0), (80.0, 180.0), (0.0, 180.0))
DISC = tuple(
    (round(50.0 + 12.0 * math.cos(k * math.pi / 12), 6), 50.0 + 12.0 * math.sin(k * math.pi / 12))
    for k in range(24)
)
SLIT = ((150.0, 20.0), (230.0, 30.0), (230.0, 32.0), (150.0, 22.0))
SHEETS = {
    "outline": SheetSize(260.0, 180.0, outline=EL),
    "defects": SheetSize(260.0, 180.0, defects=(DISC, SLIT)),
    "both": SheetSize(260.0, 180.0, outline=EL, defects=(DISC, SLIT)),
}


def require_kept(layout, pieces, sheet, rotations=FREE):
    """Check margin, gap and angles with nothing of the package but where pieces placed."""
    inside = shapely.Polygon(sheet.outline or sheet.ring).buffer(-MARGIN + 1e-6)
    for placement in layout.placements:
        polygon = shapely.Polygon(placement.apply(pieces[placement.piece]))
        assert inside.buffer(1e-4).covers(polygon)
        for defect in sheet.defects:
            assert polygon.distance(shapely.Polygon(defect)) >= GAP - 1e-6
        if rotations.step_deg is not None:
            middle = (sheet.grain_deg or 0.0) + (90.0 if rotations.across else 0.0)
            aside = (placement.rotation_deg - middle) % rotations.step_deg
            assert min(aside, rotations.step_deg - aside) <= rotations.tolerance_deg + 1e-6
    assert check_layout(layout, pieces) == []


@pytest.fixture(autouse=True)
def few_rounds(monkeypatch):
    """Let normal effort try a little only: what it keeps does not depend on how long it looks."""

    def named(name):
        return replace(effort_named(name), rounds=10 if name == "normal" else 0, patience=5)

    monkeypatch.setattr(nesting, "effort_named", named)


def strips(piece_sets, count, seed):
    return [0.25 * piece for piece in piece_sets["measured_set"](count, seed=seed)]


@pytest.mark.parametrize("effort", ["quick", pytest.param("normal", marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", sorted(SHEETS))
def test_pieces_keep_the_margin_inside_and_the_gap_from_defects(piece_sets, kind, effort):
    pieces, sheet = strips(piece_sets, 30, 1), SHEETS[kind]
    layout = nest(pieces, [sheet], margin_mm=MARGIN, gap_mm=GAP, effort=effort)
    require_kept(layout, pieces, sheet)
    assert all(one.outline == sheet.outline for one in layout.sheets)


@pytest.mark.parametrize("text", ["90", "180", "grain:8deg", "across:8deg"])
@pytest.mark.parametrize("effort", ["quick", pytest.param("normal", marks=pytest.mark.slow)])
def test_every_effort_keeps_the_angles(piece_sets, text, effort):
    pieces, rotations = strips(piece_sets, 24, 2), parse_rotations(text)
    # Turned as a caller may have them: angles are those of the pieces as given.
    pieces[::3] = [piece @ np.array([[0.0, 1.0], [-1.0, 0.0]]) for piece in pieces[::3]]
    for grain in (None, 30.0):
        sheet = SheetSize(200.0, 150.0, grain_deg=grain, defects=(DISC,))
        layout = nest(
            pieces, [sheet], margin_mm=MARGIN, gap_mm=GAP, effort=effort, rotations=rotations
        )
        require_kept(layout, pieces, sheet, rotations)
        if text == "grain:8deg" and effort == "normal":
            # The tolerance is used, not only allowed.
            aside = np.array([p.rotation_deg for p in layout.placements]) - (grain or 0.0)
            assert np.any(np.abs(np.sin(np.deg2rad(aside))) > 0.01)


def test_a_checker_of_layouts_objects_to_each_fault(piece_sets):
    pieces, sheet = strips(piece_sets, 12, 3), SHEETS["both"]
    layout = nest(pieces, [sheet], margin_mm=MARGIN, gap_mm=GAP, effort="quick")

    def faults(**change):
        sheets = tuple(replace(one, **change) for one in layout.sheets)
        return " ".join(check_layout(replace(layout, sheets=sheets), pieces))

    assert faults() == ""
    smaller = tuple((0.6 * x, 0.6 * y) for x, y in EL)
    assert "reaches over the border of sheet 1" in faults(outline=smaller)
    first = layout.placements[0]
    x, y = first.apply(pieces[0]).mean(axis=0)
    knot = ((x - 30, y - 30), (x + 30, y - 30), (x + 30, y + 30), (x - 30, y + 30))
    assert "from a defect of sheet 1" in faults(defects=(knot,))
    turned = " ".join(check_layout(replace(layout, rotations=Rotations(90.0)), pieces))
    assert "is turned" in turned


def test_a_piece_with_no_room_beside_a_defect_fits_on_no_sheet():
    square = bar(80.0, 80.0)
    free, barred = SheetSize(100.0, 100.0), SheetSize(100.0, 100.0, defects=(DISC,))
    assert len(nest([square], [free], margin_mm=4, gap_mm=1).placements) == 1
    with pytest.raises(CannotMakeError, match="on no sheet"):
        nest([square], [barred], margin_mm=4, gap_mm=1)
    # With both in stock, it stands on the one that takes it.
    layout = nest([square], [barred, free], margin_mm=4, gap_mm=1)
    assert layout.sheets[0].defects == ()


def test_grain_bars_a_piece_that_would_fit_across_it():
    plank = bar(150.0, 10.0)
    sheet = SheetSize(100.0, 200.0)
    assert nest([plank], [sheet], margin_mm=4, gap_mm=1).placements
    with pytest.raises(CannotMakeError, match="on no sheet"):
        nest([plank], [sheet], margin_mm=4, gap_mm=1, rotations=parse_rotations("grain:5deg"))
    upright = SheetSize(100.0, 200.0, grain_deg=90.0)
    layout = nest([plank], [upright], margin_mm=4, gap_mm=1, rotations=parse_rotations("180"))
    assert layout.placements[0].rotation_deg in (90.0, 270.0)


def test_the_usable_area_of_an_outline_is_what_the_margin_leaves():
    # A point of the area is usable for a dot if it is the gap from what is barred.
    rng = np.random.default_rng(0)
    for sheet in SHEETS.values():
        area = container_of(sheet, MARGIN, GAP)
        points = rng.uniform(0.0, 1.0, (4000, 2)) * np.array(area.size_mm)
        dots = shapely.points(points)
        usable = shapely.distance(dots, area.barred) >= GAP
        here, inside = shapely.points(points + MARGIN), shapely.Polygon(sheet.ring)
        away = shapely.distance(here, inside.exterior)
        room = np.where(shapely.contains(inside, here), away, -1.0)
        far = np.full(len(here), np.inf)
        for defect in sheet.defects:
            far = np.minimum(far, shapely.distance(here, shapely.Polygon(defect)))
        true = (room >= MARGIN) & (far >= GAP)
        unsure = (np.abs(room - MARGIN) < 0.02) | (np.abs(far - GAP) < 1e-9)
        assert np.array_equal(usable[~unsure], true[~unsure])
        assert unsure.mean() < 0.01
        assert not np.any(usable & ~true)  # never less than the margin
        field = obstacle_field(area, GAP).distances(points)
        signed = shapely.distance(dots, area.barred)
        out = signed > 0.0
        assert np.abs(field - signed)[out].max() < 1.0


@pytest.mark.parametrize("text", ["", "45", "free:5", "grain:-1", "grain:46", "grain:5mm", "nan"])
def test_rotations_that_mean_nothing_are_refused(text):
    with pytest.raises(ValueError, match="free, 90, 180"):
        parse_rotations(text)
