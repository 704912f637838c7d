"""The better radius of plywood counts only where pieces lie across the grain, and bends do, too."""

import pytest
from sealing import told
from spoiling import drop, edit_json, put

GRAINED = (
    "shape:cube", "--refine", "catmull-clark:1", "--size", "130mm", "--material", "birch-veneer",
    "--rotations", "across:40deg", "--effort", "quick", "--force",
)  # fmt: skip


@pytest.fixture
def grained(finished, tmp_path):
    """Return a copy of a job whose pieces lie across the grain, some bends aslant."""
    return finished.copy(tmp_path / "job", *GRAINED)


def finding(ribbons):
    return next(one for one in ribbons["findings"] if one["rule"] == "grain")


@pytest.mark.slow
def test_a_true_job_passes(grained):
    assert told(grained) == {}


NOT_ACROSS = drop("layout", "rotations", "from_grain_deg")
RIBBONS, MAP = "ribbons.json", "crossing_map.json"
SPOILT = [
    (RIBBONS, lambda d: d["findings"].remove(finding(d)), "grain", "and no finding says so"),
    (RIBBONS, lambda d: finding(d).update(count=3), "grain", "said not to hold in 3 places"),
    (RIBBONS, lambda d: finding(d).update(value=50.0), "grain", "the worst is said to be 50 where"),
    (RIBBONS, lambda d: finding(d).update(limit=60.0), "grain", "where 60 is the limit"),
    (RIBBONS, put("limits", "bend_along_mm", 20.0), "grain", "its radius is not below"),
    (RIBBONS, drop("limits", "bend_along_mm"), "grain", "it does not in 0 to 0"),
    (MAP, NOT_ACROSS, "grain", "pieces need not lie across it"),
    (MAP, NOT_ACROSS, "stock", "from the nearest of the angles"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "change", "check", "words"), SPOILT)
def test_another_word_about_the_grain_is_found(grained, name, change, check, words):
    edit_json(grained / name, change)
    assert words in str(told(grained)[check])
