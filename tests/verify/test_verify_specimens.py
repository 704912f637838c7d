"""The verifier passes jobs that hand-written code made, and shares nothing with the makers."""

import json

import pytest
from sealing import verify_job
from verify_specimen import exact_twill, make_specimen, octahedron, saddle, torus
from verify_writers import write_job

from fabweave.verify.report import MEANINGS

CLEAN = {
    "plain torus, three pieces a ring": (torus(6, 4), {}),
    "rings of one piece": (octahedron(), {"joints": 1}),
    "open threads, some without a crossing": (saddle(), {"joints": 1}),
    "open threads of one crossing": (saddle(2), {"joints": 0}),
    "a thread that crosses itself": (torus(5, 4), {"joints": 6}),
    "sides that are arcs": (torus(6, 4), {"bent": True}),
    "exact twill": (torus(6, 4), {"pattern": "twill"}),
    "threads that turn at the boundary": (saddle(), {"turning": True}),
    "one thread that turns": (saddle(3, across=4), {"turning": True, "joints": 8}),
}


@pytest.mark.parametrize("name", CLEAN)
def test_a_true_job_is_proved(name, tmp_path):
    mesh, options = CLEAN[name]
    specimen = make_specimen(mesh, **options)
    report = verify_job(write_job(specimen, tmp_path))
    assert [finding for check in report.checks for finding in check.findings] == []
    assert report.ok
    assert [check.name for check in report.checks] == list(MEANINGS)
    n_crossings = len(specimen.plan["crossings"])
    counts = {check.name: check.count for check in report.checks}
    # Nothing passes by not having been looked at.
    idle = {name for name, count in counts.items() if count == 0}
    # No specimen asks for these files, or says what mesh it comes from.
    assert idle == {"cut", "source"}
    assert counts["space"] >= 6 * n_crossings
    assert counts["crossing-holes"] >= 2 * n_crossings
    assert counts["unfolding"] >= 2 * len(specimen.plan["pieces"])


def test_the_worst_values_are_those_of_32_bit_rounding(tmp_path):
    # Independent unfoldings of the same strip agree to what float32 metres can hold.
    report = verify_job(write_job(make_specimen(torus(6, 4)), tmp_path))
    measured = {
        (check.name, quantity): measure.value
        for check in report.checks
        for quantity, measure in check.measured.items()
    }
    assert measured["unfolding", "station_mm"] < 1e-4
    assert measured["unfolding", "outline_mm"] < 1e-4
    assert measured["joints", "hole_mm"] < 1e-4
    assert measured["space", "apart_mm"] == pytest.approx(1.2, abs=1e-4)
    assert measured["outlines-dxf", "outline_mm"] < 1e-4


def test_a_thread_may_start_anywhere(tmp_path):
    specimen = make_specimen(torus(6, 4))
    for thread in specimen.plan["threads"]:
        strip = specimen.strips[thread["label"]]
        for values in (thread["crossings"], thread["over"], strip["entry"], strip["exit"]):
            values[:] = values[5:] + values[:5]
    assert verify_job(write_job(specimen, tmp_path)).failed == ()


@pytest.mark.slow
def test_broken_twill_is_counted_not_just_refused(tmp_path):
    # A weave with one sense turned breaks conditions; the claim must be the very numbers.
    from verify_specimen import Corners, count_broken, walk_threads  # noqa: PLC0415 - only here

    mesh = torus(6, 4)
    corners = Corners(mesh[1])
    threads = walk_threads(corners)
    sense = exact_twill(corners, threads)
    edge = sorted(sense)[7]
    sense[edge] = not sense[edge]
    broken = count_broken(corners, threads, sense)
    assert min(broken) > 0
    specimen = make_specimen(mesh, pattern="twill", sense=sense)
    claim = specimen.plan["weave"]
    claim["exact"] = False
    claim["broken"] = dict(zip(("edge", "face", "vertex"), broken, strict=True))
    assert verify_job(write_job(specimen, tmp_path / "told")).failed == ()
    for key in claim["broken"]:
        claim["broken"][key] += 1
        assert verify_job(write_job(specimen, tmp_path / key)).failed == ("pattern",)
        claim["broken"][key] -= 1


def test_the_report_is_plain_json(tmp_path):
    report = verify_job(write_job(make_specimen(octahedron(), joints=2), tmp_path))
    document = json.loads(json.dumps(report.to_json()))
    assert document["schema"] == "fabweave.verify/1"
    assert document["ok"] is True
    assert {check["name"] for check in document["checks"]} == set(MEANINGS)
    assert all(
        set(check) == {"name", "meaning", "ok", "count", "worst", "findings", "found", "measured"}
        for check in document["checks"]
    )
