"""Bends, turns and twists are measured anew from the model: claims that are not true are found."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from jobs import laid
from sealing import result_of, told
from spoiling import edit_json, put
from verify_writers import glb_bytes

from fabweave.core.records import to_json
from fabweave.job.ribbon_report import ribbon_report
from fabweave.picture.model_files import woven_glb
from fabweave.ribbon.lay import check_object
from fabweave.verify.check.ribbons import check_bends, measure_bending, rung_widths
from fabweave.verify.read.glb import read_model
from fabweave.weave.strand_colours import thread_colours


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return models with true reports, in which every rule is broken somewhere."""
    models = {}
    for shape, options in (
        ("torus?m=8&n=4", {"smooth": 0}),
        ("torus?m=24&n=12", {"material": "birch-veneer", "size_mm": 240.0}),
        ("tetrahedron", {}),
        ("hypar", {"boundary": "end", "material": "aluminium-5052"}),
        ("hemisphere", {"boundary": "turn", "size_mm": 150.0}),
        ("slit", {"material": "warp=card,weft=polypropylene", "size_mm": 100.0}),
    ):
        woven, settings, supplies = laid(f"shape:{shape}", **{"size_mm": 300.0, **options})
        check = check_object(woven, settings.ribbons, supplies)
        path = tmp_path_factory.mktemp("bends") / "model.glb"
        colours = thread_colours(woven.bunches, "safe")
        path.write_bytes(woven_glb(woven.ribbons, woven.labels, colours, ()))
        report = ribbon_report(check, woven.ribbons, woven.labels)
        models[shape] = (json.dumps(to_json(report)), read_model(path))
    return models


def found(report, model) -> list[str]:
    # Only what the check of bends asks of a job.
    return list(result_of(check_bends, SimpleNamespace(ribbons=report, model=model)).findings)


def test_verify_and_the_makers_measure_the_same(made) -> None:
    rules = set()
    for text, model in made.values():
        report = json.loads(text)
        rules |= {one["rule"] for one in report["findings"]}
        assert found(report, model) == []
    assert rules >= {"bend", "crease", "twist"}


def test_a_finding_that_is_left_out_is_missed(made) -> None:
    for text, model in made.values():
        for one in json.loads(text)["findings"]:
            if one["rule"] in ("bend", "crease", "twist", "width"):
                report = json.loads(text)
                report["findings"] = [
                    other for other in report["findings"] if other["rule"] != one["rule"]
                ]
                (message,) = found(report, model)
                assert message.startswith(f"ribbons.json, {one['rule']}: in ")


@pytest.mark.parametrize(
    ("key", "by"), [("value", 1.1), ("value", 0.9), ("limit", 1.1), ("count", 2.5), ("count", 0.2)]
)
def test_a_finding_that_says_something_else_is_found_out(made, key, by) -> None:
    objected = 0
    for text, model in made.values():
        for number, one in enumerate(json.loads(text)["findings"]):
            if one["rule"] in ("bend", "crease", "twist", "width"):
                report = json.loads(text)
                report["findings"][number][key] = one[key] * by
                (message,) = found(report, model)
                assert one["rule"] in message
                objected += 1
    assert objected > 4


def test_a_finding_of_nothing_is_found_out(made) -> None:
    text, model = made["torus?m=8&n=4"]
    report = json.loads(text)
    assert "bend" not in {one["rule"] for one in report["findings"]}
    limit = report["limits"]["bend_mm"]
    report["findings"].append({"rule": "bend", "value": 0.9 * limit, "limit": limit, "count": 3})
    messages = found(report, model)
    assert any("bend: it is said not to hold in 3 places" in message for message in messages), (
        messages
    )


def test_a_rung_that_is_turned_in_the_model_is_found(job, specimen) -> None:
    folder = job("torus")
    source = specimen("torus")
    label = source.plan["threads"][1]["label"]
    rungs = np.array(source.strips[label]["rungs"], dtype=float)
    # Tipped about its middle: the middle line and all other rungs stay where they are.
    middle, reach = rungs[2].mean(axis=0), np.linalg.norm(rungs[2, 1] - rungs[2, 0]) / 2
    rungs[2] = middle + reach * np.array([[0.0, 0.6, -0.8], [0.0, -0.6, 0.8]])
    source.strips[label]["rungs"] = rungs
    (folder / "model.glb").write_bytes(glb_bytes(source.strips))
    # So that twists are too strong in 12 places of the true one.
    edit_json(folder / "ribbons.json", put("limits", "bend_mm", 5.0))
    assert "twist: in 13 places" in told(folder)["bends"][0]


def test_a_strip_on_a_cylinder_bends_to_its_radius(made) -> None:
    _, model = made["torus?m=8&n=4"]
    strip = next(iter(model.values()))
    angles = np.radians(np.arange(0, 120, 4.0))
    rim = np.stack((50 * np.cos(angles), 50 * np.sin(angles), 0 * angles), axis=1)
    rungs = np.stack((rim, rim + np.array([0.0, 0.0, 12.0])), axis=1)
    entry = np.array([1, 9, 17, 25])
    bent = replace(
        strip, closed=False, entry=entry, exit=entry + 1, rungs=rungs, grain_mm=0.0,
        from_right=np.ones(len(rungs) - 1, dtype=bool),
    )  # fmt: skip
    bending = measure_bending(bent, rung_widths(bent))
    assert bending.span_radius_mm[:-1] == pytest.approx(50.0, rel=1e-3)
    assert np.isnan(bending.span_radius_mm[-1])
    assert bending.turn_deg[1:-1] == pytest.approx(4.0)
    assert bending.span_twist_deg[:-1] == pytest.approx(0.0, abs=1e-9)
    assert bending.span_mm[:-1] == pytest.approx(8 * 2 * 50 * np.sin(np.radians(2.0)))
