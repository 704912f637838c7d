"""Designs with figures that a test chooses."""

from fabweave.design.tried import Tried
from fabweave.job.figures import Figures
from fabweave.options.settings import Settings
from fabweave.plan.verdict import judge


def figures(**changes):
    values = {"faces": 9, "threads": 2, "crossings": 18, "broken": 0, "pieces": 10, "joints": 10,
              "sheets": 2, "use": 0.5, "narrowest_mm": 5.0, "median_mm": 10.0, "widest_mm": 20.0,
              "longest_mm": 300.0, "likeness_mm": None, "likeness_mean_mm": None, "lost": (),
              "hours": None, "cutting_h": None, "price": None}  # fmt: skip
    if "grade" in changes:
        values["points_lost"] = 10.0 - changes["grade"]
    return Figures(**(values | changes))


def outcome(name="D", verdict=None, design=None, **changes):
    return Tried(
        design or Settings.of(f"{name}.obj"), name, verdict or judge([], narrowest_mm=9.0),
        figures(**changes),
    )  # fmt: skip
