"""The coupon that is written has the holes, widths and lengths that it is to test."""

import json
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from jobs import OCTAHEDRON

from fabweave.core.errors import InputError
from fabweave.job.coupon import BLOCKS, coupon_for, draw_coupon, plan_coupon, write_coupon
from fabweave.sheet.drawing import Circle, Layer, Polyline
from fabweave.stock.material import hole_edge_mm, material_library, material_named
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg

COUPONS = [plan_coupon(material) for material in material_library()]
COUPONS.append(
    plan_coupon(material_named("card"), hole_mm=4.1, lap_mm=31.7, width_mm=20.4, bend_mm=59.3)
)


def outline(piece):
    (own,) = [one.points for one in piece.entities if one.layer is Layer.CUT_OUTER]
    return shapely.Polygon(own)


def sides(piece):
    left, low, right, top = outline(piece).bounds
    return right - left, top - low


def named(drawing, name):
    return next(piece for piece in drawing.pieces if piece.piece_id == name)


def holes(piece):
    return [one for one in piece.entities if isinstance(one, Circle)]


@pytest.mark.parametrize("read", [read_dxf, read_svg])
def test_what_is_written_has_the_diameters_and_widths(tmp_path, read):
    write_coupon(plan_coupon(material_named("card"), hole_mm=2.5), tmp_path)
    drawing = read(tmp_path / f"coupon.{read.__name__[-3:]}")
    radii = np.array([hole.radius for hole in drawing.of("CUT_INNER", "HOLES")])
    np.testing.assert_allclose(np.sort(2 * radii), [2.3, 2.4, 2.5, 2.6, 2.7, 2.8], atol=1e-4)
    total = 0.0
    for number in range(1, BLOCKS + 1):
        (block,) = drawing.of("CUT_OUTER", f"KERF{number}")
        total += float(np.ptp(block.points[:, 0]))
    assert total == pytest.approx(100.0, abs=1e-3)
    assert drawing.problems == ()


def test_the_mat_weaves_plain_hole_on_hole():
    drawing = draw_coupon(COUPONS[-1])
    strips = [named(drawing, name) for name in ("P1", "P2", "Q1", "Q2")]
    along = [[hole.x - outline(one).bounds[0] for hole in holes(one)] for one in strips]
    (first, second), *others = along
    assert all(other == pytest.approx([first, second]) for other in others)
    # Strips as wide as these lie beside one another there.
    assert second - first > max(sides(one)[1] for one in strips)
    # What is written near a hole is under the strip that crosses there, and each strip is covered
    # once: its letters end within half a width of one of its holes, of the other hole on the next.
    covered = []
    for one, (near, far) in zip(strips, along, strict=True):
        left = outline(one).bounds[0]
        letters = np.concatenate([line.points[:, 0] - left for line in one.entities
                                  if line.layer is Layer.ENGRAVE_LABEL])  # fmt: skip
        half = sides(one)[1] / 2
        there = [bool(np.any(abs(letters - place) < half)) for place in (near, far)]
        assert sum(there) == 1
        covered.append(there[0])
    assert covered == [False, True, True, False]


def test_the_kerf_comes_out_of_the_instruction():
    # The beam takes half a kerf off each side of each block.
    drawing, kerf = draw_coupon(plan_coupon(material_named("card"))), 0.17
    row = sum(
        np.ptp(shapely.get_coordinates(outline(piece).buffer(-kerf / 2, join_style="mitre"))[:, 0])
        for piece in drawing.pieces
        if piece.piece_id.startswith("KERF")
    )
    assert (100 - row) / 10 == pytest.approx(kerf)


@pytest.mark.parametrize("coupon", COUPONS, ids=lambda coupon: coupon.material.name)
def test_pieces_keep_apart_and_inside_and_letters_inside_them(coupon):
    drawing = draw_coupon(coupon)
    pieces = drawing.pieces
    polygons = [outline(piece) for piece in pieces]
    sheet = shapely.box(0, 0, drawing.width_mm, drawing.height_mm).buffer(-9.999)
    assert all(sheet.covers(polygon) for polygon in polygons)
    gap = max(coupon.material.gap_mm, 3.0)
    for number, polygon in enumerate(polygons):
        assert all(polygon.distance(other) >= gap - 1e-9 for other in polygons[:number])
    for piece, polygon in zip(pieces, polygons, strict=True):
        cuts = [shapely.Point(hole.x, hole.y).buffer(hole.radius) for hole in holes(piece)]
        for one in piece.entities:
            if one.layer is Layer.ENGRAVE_LABEL:
                line = shapely.LineString(one.points)
                assert polygon.contains(line)
                assert line.distance(polygon.exterior) > 0.5
                assert all(line.distance(cut) > 0.5 for cut in cuts)
        for hole in holes(piece):
            room = shapely.Point(hole.x, hole.y).distance(polygon.exterior)
            assert room >= hole_edge_mm(coupon.material, 2 * hole.radius) - 1e-9


@pytest.mark.parametrize("coupon", COUPONS, ids=lambda coupon: coupon.material.name)
def test_the_ladder_has_rungs_far_enough_apart(coupon):
    rungs = sorted(holes(named(draw_coupon(coupon), "HOLES")), key=lambda hole: hole.x)
    sizes = [2 * hole.radius for hole in rungs]
    np.testing.assert_allclose(np.diff(sizes), 0.1)
    assert sizes[2] == pytest.approx(coupon.hole_mm)
    assert all(b.x - a.x >= 6 * b.radius - 1e-9 for a, b in pairwise(rungs))


def test_lap_and_bend_are_those_of_the_job():
    drawing = draw_coupon(COUPONS[-1])
    one, other = (named(drawing, name) for name in ("LAP-A", "LAP-B"))
    assert sides(one)[1] == sides(other)[1] == pytest.approx(20.4)
    for strip in (one, other):
        (hole,) = holes(strip)
        # Hole on hole, the end of each strip lies at the other's ticks: a lap away.
        left, low, _, top = outline(strip).bounds
        assert hole.x - left == pytest.approx(31.7 / 2)
        assert hole.y == pytest.approx((low + top) / 2)
        ticks = [one for one in strip.entities if one.layer is Layer.ENGRAVE_MARK]
        assert all(tick.points[0, 0] - left == pytest.approx(31.7) for tick in ticks)
    bend = named(drawing, "BEND")
    ticks = {
        round(float(one.points[0, 0]), 6)
        for one in bend.entities
        if isinstance(one, Polyline) and one.layer is Layer.ENGRAVE_MARK
    }
    assert max(ticks) - min(ticks) == pytest.approx(math.pi * 59.3, abs=1e-5)


def test_a_hole_that_no_laser_cuts_is_refused():
    with pytest.raises(InputError, match="too small for a laser"):
        plan_coupon(material_named("birch-ply-3"), hole_mm=1.0)


@pytest.mark.slow
def test_a_job_gives_its_figures(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    coupon = coupon_for(folder)
    assert coupon.material.name == "card"
    joints = json.loads((folder / "crossing_map.json").read_text())["joints"]
    assert coupon.hole_mm == joints[0]["hole_mm"]
    assert coupon.lap_mm == pytest.approx(np.median([joint["lap_mm"] for joint in joints]))
    thinner = coupon_for(folder, thickness_mm=0.3)
    assert thinner == coupon._replace(material=replace(coupon.material, thickness_mm=0.3))
    (folder / "ribbons.json").unlink()
    with pytest.raises(InputError, match=r"ribbons\.json"):
        coupon_for(folder)
