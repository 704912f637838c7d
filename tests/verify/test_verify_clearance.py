"""How near ribbons are is proved from the model: claims that are not true are found out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from jobs import laid
from sealing import told
from spoiling import edit_json
from strategies import TRIANGLES, require_gap
from verify_writers import LIMITS, glb_bytes

from fabweave.picture.model_files import woven_glb
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.stock.ribbon_limits import ribbon_limits
from fabweave.verify.measure.nearness import cut_steps, near_parts, triangle_gaps
from fabweave.verify.read.glb import read_model
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally
from fabweave.weave.strand_colours import thread_colours


def change(folder, **changes) -> None:
    """Change what ribbons.json says of limits, and what it says is too near."""

    def edit(document):
        document["limits"] |= changes.pop("limits", {})
        if changes:
            document["findings"] = [changes]

    edit_json(folder / "ribbons.json", edit)


def nearest(folder, clearance_mm: float) -> dict:
    """Say truly what is too near in a specimen at some clearance."""
    found = load_job(folder, Tally("files"))
    thickness_mm = LIMITS["thickness_mm"]
    near = near_parts(cut_steps(found.map, found.model), thickness_mm + clearance_mm)
    wanted = thickness_mm + np.where(near.parting, 0.0, clearance_mm)
    at = int(np.argmin(near.gap_mm / wanted))
    assert not ((near.gap_mm > wanted - 0.01) & (near.gap_mm < wanted + 0.01)).any()
    count = int((near.gap_mm < wanted).sum())
    return {"rule": "clearance", "value": near.gap_mm[at], "limit": wanted[at], "count": count}


@given(TRIANGLES, TRIANGLES)
def test_gaps_agree_with_libigl_on_many_points(one, other) -> None:
    require_gap(float(triangle_gaps(one[None], other[None], 99.0)[0]), one, other)


@pytest.mark.parametrize(
    ("shape", "smooth"),
    [("torus?m=8&n=4", 0), ("hypar", 3), ("tetrahedron", 3), ("hemisphere", 1)],
)
@pytest.mark.parametrize("by", [(0.0, 0.0, 0.0), (6.0, 1.0, 4.0), (-3.0, 9.0, 2.0)])
def test_verify_and_the_makers_find_the_same(shape, smooth, by, tmp_path) -> None:
    woven, settings, supplies = laid(f"shape:{shape}", size_mm=200.0, smooth=smooth, boundary="end")
    ribbons, threads = woven.ribbons, woven.weave.threads
    longest = int(np.argmax(threads.lengths))
    moved = slice(*ribbons.offsets[longest : longest + 2])
    right, left = ribbons.right.copy(), ribbons.left.copy()
    right[moved] += by
    left[moved] += by
    ribbons = replace(ribbons, right=right, left=left)
    limits = ribbon_limits(supplies.only, settings.ribbons.clearance_mm)
    measured, near = measure_clearance(ribbons, woven.weave, limits)
    path = tmp_path / "model.glb"
    path.write_bytes(woven_glb(ribbons, woven.labels, thread_colours(woven.bunches, "safe"), ()))
    plan = SimpleNamespace(
        threads=[
            SimpleNamespace(
                id=t,
                label=label,
                crossings=tuple(threads.crossing[slice(*threads.offsets[t : t + 2])]),
            )
            for t, label in enumerate(woven.labels)
        ]
    )
    found = near_parts(cut_steps(plan, read_model(path)), 0.502)
    wanted = 0.4 + np.where(found.parting, 0.0, 0.1)
    fewest, most = ((found.gap_mm < wanted + slack).sum() for slack in (-0.002, 0.002))
    assert fewest <= len(near.pairs) <= most
    assert fewest > 0 or by[0] >= 0
    if fewest:
        assert (found.gap_mm / wanted).min() == pytest.approx(measured.margins.min(), abs=1e-4)


def test_a_strand_that_is_moved_onto_others_is_found(job, specimen) -> None:
    folder = job("torus")
    source = specimen("torus")
    label = source.plan["threads"][1]["label"]
    source.strips[label]["rungs"] = source.strips[label]["rungs"] + [3.0, 4.0, -2.0]
    (folder / "model.glb").write_bytes(glb_bytes(source.strips))
    (found,) = told(folder)["clearance"]
    assert f"thread {label} after crossing" in found
    assert "no finding says so" in found


def claimed(job):
    """Return the folder of a job that wants more air than there is, and says so truly."""
    folder = job("torus")
    change(folder, limits={"clearance_mm": 15.0})
    assert set(told(folder)) == {"clearance"}
    claim = nearest(folder, 15.0)
    change(folder, **claim)
    assert not told(folder)
    return folder, claim


@pytest.mark.slow
def test_a_true_claim_is_true_and_a_raised_one_is_not(job) -> None:
    folder, claim = claimed(job)
    for key, value in (
        ("value", claim["value"] + 0.02),
        ("value", claim["value"] - 0.02),
        ("value", None),
        ("count", claim["count"] + 1),
        ("count", claim["count"] - 1),
        ("count", "many"),
        ("limit", claim["limit"] + 0.05),
        ("rule", "hole"),
    ):
        change(folder, **(claim | {key: value}))
        assert set(told(folder)) == {"clearance"}, (key, value)


@pytest.mark.parametrize(
    "limits",
    [{"clearance_mm": None}, {"thickness_mm": "0.5"}, {"thickness_mm": float("nan")},
     {"clearance_mm": -1.0}],
)  # fmt: skip
def test_limits_that_are_none(job, limits) -> None:
    folder = job()
    change(folder, limits=limits)
    # The widths that bends ask for follow from the thickness. What is no number is no JSON.
    unread = "nan" in str(limits)
    most = {"clearance", "bends"} | ({"files", "grain"} if unread else set())
    found = set(told(folder))
    assert {"clearance"} <= found <= most


@pytest.mark.parametrize("option", ["thickness", "clearance"])
def test_limits_other_than_the_settings(job, option) -> None:
    folder = job()
    path = folder / "job.toml"
    plain = path.read_text()
    true = {"thickness": "0.2mm", "clearance": "0.05mm"}
    path.write_text(f'{plain}[job]\n{option} = "{true[option]}"\n')
    assert "clearance" not in told(folder)
    path.write_text(f'{plain}[job]\n{option} = "0.3mm"\n')
    assert "clearance" in told(folder)
