"""What can be no piece is named with its cause and its measure."""

import re

import numpy as np
import pytest

import fabweave as fw
from fabweave.core.errors import CannotMakeError
from fabweave.piece.development import Strips
from fabweave.piece.split.candidates import Bed, Candidates, Sites, WholeStrips, Windows
from fabweave.piece.split.splitting import splitting_refusal

pytestmark = pytest.mark.usefixtures("quick_jobs")

STEPS = 40


def said_of(turn_deg, *, fits=True, longest_mm=np.inf, clear=True, free_mm=None) -> str:
    """What is said of a thread of one stretch: a band of 10 mm along a circle of 55 mm."""
    angle = np.deg2rad(np.linspace(0.0, turn_deg, STEPS + 1))
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    rungs = np.arange(STEPS + 1)
    strips = Strips(np.array([0, STEPS + 1]), rungs, 60.0 * ring, 50.0 * ring)
    course = WholeStrips(strips, np.array([0, 2]), np.array([0, STEPS - 1]), np.array([1, STEPS]))
    sites = Sites(np.array([0, 2]), np.array([0, 1]), np.array([0, 1]), np.array([False]),
                  np.array([2]))  # fmt: skip
    table = np.full((2, 1), np.inf)
    windows = Windows(np.array([[2], [0]]), table, table, table, table, table, table)
    candidates = Candidates(None, sites, course, windows, np.array([[clear], [False]]))
    bed = Bed(lambda _: fits, free_mm=free_mm)
    return splitting_refusal(candidates, bed, [0], ["A"], longest_mm)


@pytest.mark.parametrize(
    ("stretch", "measures", "helps"),
    [
        ({"turn_deg": 400.0}, [0.5], {"--width", "--fair", "--refine"}),
        ({"turn_deg": 359.7}, [0.5], {"--width", "--fair", "--refine"}),
        # Half a ring: 120 mm from end to end, 60 mm high.
        (
            {"turn_deg": 180.0, "fits": False, "free_mm": (50.0, 100.0)},
            [120.0, 60.0, 100.0, 50.0],
            {"--sheet", "--size", "--refine"},
        ),
        (
            {"turn_deg": 180.0, "fits": False, "free_mm": (100.0, 200.0)},
            [120.0, 60.0],
            {"--rotations"},
        ),
        ({"turn_deg": 180.0, "longest_mm": 150.0}, [55.0 * np.pi], {"--max-length"}),
        ({"turn_deg": 180.0, "clear": False}, [], {"--width"}),
    ],
    ids=["lies on itself", "nearly closes", "too large", "only angles lack", "too long", "crosses"],
)
def test_a_stretch_is_told_with_its_measure_and_what_helps(stretch, measures, helps):
    said = said_of(**stretch)
    assert "A between its crossings 0 and 1" in said
    told = [float(number) for number in re.findall(r"\d+\.\d+", said)]
    for measure in measures:
        assert min(abs(measure - number) for number in told) < 0.2
    assert helps <= set(re.findall(r"--[a-z-]+\b", said))


def test_a_job_on_too_small_a_sheet_is_refused_with_both_sizes():
    with pytest.raises(CannotMakeError, match=r"^12 .*: A between its crossings 1 and 3 "
                       r"\(\d+\.\d × \d+\.\d mm\), .* 280\.0 × 180\.0 mm "):  # fmt: skip
        fw.weave(fw.shape("octahedron"), size="900mm", sheet="300x200mm").ribbons().pieces()
