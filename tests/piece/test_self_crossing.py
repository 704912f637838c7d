"""Pieces that would cross themselves are cut elsewhere, made narrower, or refused with reasons."""

import contextlib

import numpy as np
import pytest
import shapely
from irregular_meshes import flat_ball, pieces_of, steep_sheet

import fabweave as fw
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.shapes.grids import torus
from fabweave.piece import joined_object
from fabweave.piece.development import Runs
from fabweave.piece.split.candidates import also_barred, last_clear, lay_course, list_sites
from fabweave.piece.split.splitting import find_self_crossing, joined_runs
from fabweave.ribbon.lay import width_notes

pytestmark = pytest.mark.usefixtures("quick_jobs")

#: The projection method bends strands at every crossing of triangles, up to kinks and loops.
BENT = {"course": "projection"}
FLAT = {
    "width": "proportional",
    "size": "600mm",
    "smooth": 0,
    "sheet": "1200x800mm",
    "max_length": "400mm",
    **BENT,
}


@pytest.fixture
def found(monkeypatch):
    """How many loops and kinks each look at the pieces found."""
    looks = []

    def look(*args):
        crossing = find_self_crossing(*args)
        looks.append((len(crossing.loops.thread), len(crossing.kinks.thread)))
        return crossing

    monkeypatch.setattr(joined_object, "find_self_crossing", look)
    return looks


def all_simple(pieces) -> bool:
    """Whether what is cut, arcs and all, crosses itself nowhere."""
    return all(
        shapely.Polygon(ring).is_valid
        for piece in pieces
        for ring in (piece.outline, piece.path.flattened(0.002))
    )


@pytest.mark.slow
def test_a_piece_that_closes_on_itself_is_cut_elsewhere(found):
    pieces = pieces_of(flat_ball(3), **FLAT)
    assert found[0][0] > 0
    assert found[-1] == (0, 0)
    assert all_simple(pieces)


@pytest.mark.slow
def test_a_kink_of_a_ribbon_is_narrowed_away(found):
    pieces = pieces_of(flat_ball(5), **FLAT)
    assert found[0][1] == 1
    assert found[-1] == (0, 0)
    assert all_simple(pieces)
    # The note tells how many places are narrow for the kink, and how many for other ribbons.
    planned = pieces.planned
    factor, apart = planned.woven.narrowed.factor, planned.woven.apart
    crowded, kinked = np.count_nonzero(apart < 1), np.count_nonzero(factor < apart)
    assert min(crowded, kinked) > 0
    said = width_notes(planned.woven, planned.settings.ribbons, planned.supplies)[0]
    assert {str(crowded), str(kinked)} <= set(said.split())


@pytest.mark.slow
def test_a_kink_in_a_ribbon_of_given_width_is_refused_with_its_place():
    options = {"size": "1500mm", "sheet": "1200x800mm", "width": 0.65, **BENT}
    mesh = steep_sheet(0, 50)
    place = r"^1 .*: [A-Z]+ between its crossings \d+ and \d+, near \(-?\d+, -?\d+, -?\d+\) mm;"
    with pytest.raises(CannotMakeError, match=place):
        pieces_of(mesh, **options)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_is_made_of_flat_balls_is_simple(seed):
    with contextlib.suppress(CannotMakeError):  # some have no crossing for a joint
        assert all_simple(pieces_of(flat_ball(seed), **FLAT))


def test_no_piece_carries_what_is_barred():
    ribbons = fw.weave(fw.mesh(torus(8, 4, 60.0, 25.0))).ribbons().woven
    course, sites = lay_course(ribbons.ribbons, 12), list_sites(ribbons.weave)
    free = last_clear(course, 12)
    count = int(sites.lengths[0])
    # One stretch over the end of the ring, one of another thread, one of them twice.
    barred = Runs(np.array([0, 1, 0]), np.array([count - 1, 2, count - 1]),
                  np.array([count + 2, 5, count + 2]))  # fmt: skip
    barred = joined_runs(barred, barred)
    assert len(barred.thread) == 2
    behind = also_barred(course, sites, free, barred)
    start = course.offsets[:-1]
    for thread in (0, 1, 2):
        stations = int(course.offsets[thread + 1] - start[thread])
        laps = int(sites.lengths[thread])
        for first in range(laps):
            for last in range(first + 1, min(first + 12, stations)):
                at = start[thread] + last
                carried = any(
                    first <= low + lap * laps and high + lap * laps <= last
                    for line, low, high in zip(*map(np.ndarray.tolist, (
                        barred.thread, barred.first, barred.last)), strict=True)
                    for lap in (0, 1)
                    if line == thread
                )  # fmt: skip
                allowed = start[thread] + first > behind[at]
                assert allowed == (start[thread] + first > free[at] and not carried)


def test_pieces_that_fit_nowhere_as_they_are_cut_are_refused_with_their_size(monkeypatch):
    def too_large(outlines, *_):
        return np.zeros(len(outlines), dtype=bool)

    monkeypatch.setattr(joined_object, "outlines_with_place", too_large)
    place = r"^\d+ .*: A from its crossing \d+ to its crossing \d+ \(\d+\.\d × \d+\.\d mm\)"
    with pytest.raises(CannotMakeError, match=place):
        fw.weave(fw.shape("octahedron"), size="160mm").ribbons().pieces()
