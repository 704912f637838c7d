"""What can be no piece is named with its cause, its measure, and what helps against just that."""

import numpy as np
import pytest

import fabweave as fw
from fabweave.core.errors import CannotMakeError
from fabweave.flat.split.candidate_costs import Bed, Candidates
from fabweave.flat.split.candidates import Course, Sites, Windows
from fabweave.flat.split.splitting import splitting_refusal
from fabweave.flat.unfold.development import Strips

STEPS = 40


def said_of(turn_deg, *, fits=True, longest_mm=np.inf, clear=True, free_mm=None) -> str:
    """What is said of a thread of one stretch: a band of 10 mm along a circle of 55 mm."""
    angle = np.deg2rad(np.linspace(0.0, turn_deg, STEPS + 1))
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    rungs = np.arange(STEPS + 1)
    strips = Strips(np.array([0, STEPS + 1]), rungs, 60.0 * ring, 50.0 * ring)
    course = Course(strips, np.array([0, 2]), np.array([0, STEPS - 1]), np.array([1, STEPS]))
    sites = Sites(np.array([0, 2]), np.array([0, 1]), np.array([0, 1]), np.array([False]),
                  np.array([2]))  # fmt: skip
    table = np.full((2, 1), np.inf)
    windows = Windows(np.array([[2], [0]]), table, table, table, table, table, table)
    candidates = Candidates(None, sites, course, windows, np.array([[clear], [False]]))
    bed = Bed(lambda _: fits, free_mm=free_mm)
    return splitting_refusal(candidates, bed, [0], ["A"], longest_mm)


def test_a_stretch_that_curls_onto_itself_is_told_by_what_it_covers():
    # The last four of its facets lie on the first four.
    area = 4 * (60.0**2 - 50.0**2) / 2 * np.sin(np.deg2rad(10.0))
    assert said_of(400.0) == (
        "1 stretch of thread has no crossing for a joint, and can be no piece: A between its "
        f"crossings 0 and 1 (lying on itself over {area:.1f} mm² when unfolded). A smaller "
        "--width, a smoother mesh (--fair) or a finer mesh (--refine) would help"
    )


def test_a_stretch_that_nearly_closes_is_told_to_come_too_near():
    assert "(nearer than 0.5 mm to itself when unfolded)" in said_of(359.7)


def test_a_stretch_that_is_too_large_is_told_with_its_size_and_the_room():
    # Half a ring: 120 mm from end to end, 60 mm high.
    said = said_of(180.0, fits=False, free_mm=(50.0, 100.0))
    assert "A between its crossings 0 and 1 (120.0 × 60.0 mm). The sheets have 100.0 × 50.0 mm" in (
        said
    )
    assert said.endswith("A larger --sheet, a smaller --size or a finer mesh (--refine) would help")
    assert "--width" not in said


def test_a_stretch_for_which_only_angles_lack_is_told_so():
    said = said_of(180.0, fits=False, free_mm=(100.0, 200.0))
    assert "(120.0 × 60.0 mm at no allowed angle)" in said
    assert "--rotations free" in said


def test_a_stretch_that_is_too_long_is_told_with_its_length():
    length = float(said_of(180.0, longest_mm=150.0).split("(")[1].split(" mm long")[0])
    assert length == pytest.approx(55.0 * np.pi, abs=0.2)
    assert "No piece may be longer than 150 mm. A longer --max-length" in said_of(
        180.0, longest_mm=150.0
    )


def test_a_stretch_that_crosses_itself_only_when_cut_is_told_so():
    assert "(crossing itself as it is cut, laps and all)" in said_of(180.0, clear=False)


def test_a_job_on_too_small_a_sheet_is_refused_with_both_sizes():
    with pytest.raises(CannotMakeError, match=r"^12 stretches .*: A between its crossings 1 and 3 "
                       r"\(\d+\.\d × \d+\.\d mm\); .*; and 8 more\. The sheets have "
                       r"280\.0 × 180\.0 mm free, "):  # fmt: skip
        fw.weave(fw.shape("octahedron"), size="900mm", sheet="300x200mm").ribbons().pieces()
