"""A ring along a rim unfolds exactly: to a strip, a sector, an annulus, or with corners."""

import numpy as np
import pytest
import shapely
from rims import ABOVE, rim_of, ring_of

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.piece.rim_ring import beside_rims, plan_ring, rim_rungs
from fabweave.weave.threads import trace_threads

#: Tube, cones of several slopes, a disc with a hole, and the border of a disc.
REVOLVED = {
    "tube": ((60.0, 0.0), (60.0, -15.0)),
    "cone": ((60.0, 0.0), (70.0, -15.0)),
    "funnel": ((60.0, 0.0), (52.0, -20.0)),
    "hole": ((60.0, 0.0), (75.0, 0.0)),
    "plate": ((60.0, 0.0), (45.0, 0.0)),
}


def lengths(ways):
    return np.linalg.norm(ways, axis=-1)


def rungs_of(mesh):
    threads = trace_threads(build_halfedges(mesh))
    return rim_rungs(build_halfedges(mesh), threads), threads


@pytest.mark.parametrize("name", REVOLVED)
@pytest.mark.parametrize("double", [False, True])
def test_lengths_are_those_of_the_surface(name, double):
    places = REVOLVED[name]
    ring = ring_of(*places, double=double)
    assert len(ring.courses) == 1 + double
    for course, sign in zip(ring.courses, (1.0, -1.0), strict=False):
        rim, foot = (at + sign * ABOVE * out for at, out in rim_of(*places))
        for piece in course:
            for flat, solid in ((piece.rim, rim[piece.vertices]), (piece.foot, foot[piece.feet])):
                np.testing.assert_allclose(
                    lengths(np.diff(flat, axis=0)), lengths(np.diff(solid, axis=0))
                )
            across = rim[piece.vertices] - foot[piece.feet]
            np.testing.assert_allclose(lengths(piece.rim - piece.foot), lengths(across))
            np.testing.assert_allclose(piece.holes[:, :2], piece.foot)
            # Facets of such a surface are flat, so both diagonals keep their lengths.
            skew = rim[piece.vertices[:-1]] - foot[piece.feet[1:]]
            np.testing.assert_allclose(lengths(piece.rim[:-1] - piece.foot[1:]), lengths(skew))
        around = [vertex for piece in course for vertex in piece.vertices[:-1]]
        assert sorted(around) == list(range(16))


def test_a_tube_has_a_straight_strip_as_long_as_its_rim():
    ring = ring_of(*REVOLVED["tube"])
    chords = 16 * 2 * (60.0 + ABOVE) * np.sin(np.pi / 16)
    assert sum(np.ptp(piece.rim[:, 0]) for piece in ring.pieces) == pytest.approx(chords)
    for piece in ring.pieces:
        assert len(piece.path.points) == 4
        assert not piece.path.bulges.any()
        wide, high = np.ptp(piece.path.points, axis=0)
        # The holes are 15 mm off the rim, and 6 off every edge.
        assert (wide, high) == pytest.approx((np.ptp(piece.holes[:, 0]) + 12.0, 21.0), abs=0.3)


@pytest.mark.parametrize("name", ["cone", "funnel", "hole", "plate"])
def test_a_cone_has_an_annular_sector_about_its_apex(name):
    (near, top), (far, low) = (
        np.array(place) + ABOVE * np.array(out)
        for place, out in zip(REVOLVED[name], [_out(*REVOLVED[name])] * 2, strict=True)
    )
    # By similar triangles; a disc is its own cone.
    stretch = np.hypot(far - near, low - top) / abs(far - near)
    ring = ring_of(*REVOLVED[name])
    for piece in ring.pieces:
        flat = np.concatenate((piece.rim, piece.foot))
        centre, inner = _circle(piece.rim)
        assert inner == pytest.approx(near * stretch)
        np.testing.assert_allclose(lengths(piece.foot - centre), far * stretch)
        away = lengths(piece.path.flattened(0.005) - centre)
        edge = 6.0 if far > near else -6.0
        assert abs(away - inner).min() < 0.03
        assert abs(away - (far * stretch + edge)).min() < 0.03
        assert len(flat) == 2 * len(piece.vertices)


def _out(rim, foot):
    away = np.array(foot) - rim
    return np.array([-away[1], away[0]]) / np.hypot(*away)


def _circle(points):
    """Return middle and radius of the circle through points, by linear least squares."""
    system = np.column_stack((2 * points, np.ones(len(points))))
    x, y, rest = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)[0]
    return np.array([x, y]), np.sqrt(rest + x * x + y * y)


@pytest.mark.parametrize("name", REVOLVED)
@pytest.mark.parametrize("least", [2, 3, 5])
def test_pieces_go_all_round_lap_at_a_hole_and_keep_holes_off_their_edges(name, least):
    ring = ring_of(*REVOLVED[name], double=True, first=4, fits=lambda pieces: len(pieces) >= least)
    assert [piece.id for piece in ring.pieces] == [f"R{4 + k}" for k in range(2 * least)]
    for course in ring.courses:
        for piece, after in zip(course, [*course[1:], course[0]], strict=True):
            assert piece.crossings[-1] == after.crossings[0]
            outline = shapely.Polygon(piece.path.flattened(0.005))
            assert outline.is_valid
            assert piece.path.area == pytest.approx(outline.area, rel=1e-3)
            assert shapely.distance(shapely.points(piece.foot), outline.exterior).min() > 5.97
            # The id is where the piece before covers it, and clear of the hole.
            x, y, _, height = piece.label
            assert outline.contains(shapely.Point(x, y).buffer(height / 2))
            assert 1.5 + height / 2 < np.hypot(x - piece.holes[0, 0], y - piece.holes[0, 1])
            # No other hole is under a lap.
            gaps = lengths(np.diff(piece.holes[:, :2], axis=0))
            assert min(gaps[0], gaps[-1]) > 9.0
        assert len(set(np.concatenate([piece.crossings for piece in course]).tolist())) == 16
    outside, inside = ({int(one.crossings[0]) for one in course} for course in ring.courses)
    assert not outside & inside


def plate(m=6, n=5, size=30.0):
    x, y = np.meshgrid(np.arange(m + 1), np.arange(n + 1))
    at = np.arange((m + 1) * (n + 1)).reshape(n + 1, m + 1)
    faces = np.stack((at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]), axis=-1)
    points = np.column_stack((x.ravel(), y.ravel(), 0 * x.ravel())) * size
    return PolyMesh.from_faces(points, faces.reshape(-1, 4))


def test_a_plate_has_a_frame_with_corners_and_laps_between_them():
    mesh = plate()
    (rungs,), threads = rungs_of(mesh)
    # Each corner is of one face alone, and has no crossing of its own.
    assert len(rungs.vertices) == 22
    assert len(set(rungs.feet.tolist())) == 18
    halfedges = build_halfedges(mesh)
    one = threads.crossing_halfedge
    middle = (mesh.vertices[halfedges.tail[one]] + mesh.vertices[halfedges.head[one]]) / 2
    level = np.tile([0.0, 0.0, 1.0], (22, 1))
    ring = plan_ring(
        "side", rungs, (mesh.vertices[rungs.vertices], level), (middle[rungs.feet], level),
        np.full(threads.n_crossings, 2.0), edge_mm=4.0, thickness_mm=0.4,
    )  # fmt: skip
    assert (ring.width_mm, ring.over_mm) == (19.0, 0.0)
    whole = []
    for piece in ring.pieces:
        solid = np.concatenate((mesh.vertices[piece.vertices], middle[piece.feet]))[:, :2]
        flat = np.concatenate((piece.rim, piece.foot))
        # What is flat stays as it is: one rotation takes all of it to the sheet.
        np.testing.assert_allclose(
            lengths(flat[:, None] - flat[None]), lengths(solid[:, None] - solid[None]), atol=1e-9
        )
        turned = np.linalg.lstsq(np.column_stack((flat, np.ones(len(flat)))), solid, rcond=None)[0]
        outline = piece.path.flattened(0.01)
        laid = shapely.Polygon(np.column_stack((outline, np.ones(len(outline)))) @ turned)
        whole.append(laid)
        assert laid.area < piece.path.length / 2 * 19.0
    frame = shapely.box(0, 0, 180, 150) - shapely.box(19, 19, 161, 131)
    assert shapely.symmetric_difference(shapely.union_all(whole), frame).area < 1.0
    laps = shapely.intersection(*whole)
    corners = shapely.MultiPoint([(0, 0), (180, 0), (180, 150), (0, 150)])
    assert shapely.distance(laps, corners) > 30.0


def test_rungs_go_along_each_rim_with_the_faces_to_the_left():
    mesh = parse_shape("shape:tube?m=7&n=4")
    loops, threads = rungs_of(mesh)
    halfedges = build_halfedges(mesh)
    rim = halfedges.twin < 0
    ahead = dict(zip(halfedges.tail[rim].tolist(), halfedges.head[rim].tolist(), strict=True))
    assert len(loops) == 2
    for rungs in loops:
        assert [ahead[vertex] for vertex in rungs.vertices] == np.roll(rungs.vertices, -1).tolist()
        for vertex, crossing in zip(rungs.vertices, rungs.feet, strict=True):
            one = threads.crossing_halfedge[crossing]
            assert vertex in (halfedges.tail[one], halfedges.head[one])
    assert np.count_nonzero(beside_rims(loops, threads.n_crossings)) == 14


def test_where_holes_are_near_the_rim_the_band_stands_out_over_it():
    ring = ring_of((60.0, 0.0), (60.0, -4.0))
    assert (ring.over_mm, ring.width_mm) == (2.0, 12.0)
    for piece in ring.pieces:
        border = shapely.LinearRing(piece.path.flattened(0.005))
        off = shapely.distance(shapely.points(piece.rim[1:-1]), border)
        np.testing.assert_allclose(off, 2.0, atol=0.02)


def test_what_cannot_be_cut_is_refused():
    with pytest.raises(CannotMakeError, match="held by 3 fasteners only"):
        ring_of(*REVOLVED["tube"], count=3)
    # As wide as this, a plate would have no middle.
    with pytest.raises(CannotMakeError, match="lie on itself"):
        ring_of((60.0, 0.0), (10.0, 0.0), edge_mm=20.0, hole_mm=np.full(16, 0.5))
    with pytest.raises(CannotMakeError, match="too near to one another for laps"):
        ring_of(*REVOLVED["tube"], count=60)
    with pytest.raises(CannotMakeError, match="fits on no sheet"):
        ring_of(*REVOLVED["tube"], fits=lambda _: False)
    with pytest.raises(CannotMakeError, match="one row of faces"):
        rungs_of(parse_shape("shape:tube?m=7&n=1"))
