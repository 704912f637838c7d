"""Spoil the verdict: its check objects, and no other."""

import json
import shutil

import numpy as np
import pytest
from irregular_meshes import together
from jobs import OCTAHEDRON

from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.verify import verify_job


@pytest.fixture(scope="module")
def ball(finished):
    """A job with a verdict that wants care: a small ball bends veneer nearly too much."""
    return finished(*OCTAHEDRON)


def edited(tmp_path, folder, name, edit):
    copy = tmp_path / "job"
    shutil.copytree(folder, copy)
    document = json.loads((copy / name).read_text())
    edit(document)
    (copy / name).write_text(json.dumps(document))
    return set(verify_job(copy).failed)


def level(value):
    return lambda verdict: verdict.update(level=value)


def finding(**changes):
    """Return an edit that adds a finding to ribbons.json."""
    whole = {"rule": "twist", "severity": "warn", "value": 40.0, "limit": 30.0, "unit": "degrees",
             "thread": "A", "station": 0, "crossing": 0, "other": None, "position": [0, 0, 0],
             "count": 1, "of": 100, "far": 0} | changes  # fmt: skip
    return lambda ribbons: ribbons["findings"].append(whole)


SPOILED = {
    "better": level("makeable"),
    "worse": level("not makeable"),
    "unknown": level("fine"),
    "forced": lambda verdict: verdict.update(forced=True),
    "a reason lost": lambda verdict: verdict["reasons"].pop(),
    "a reason more": lambda verdict: verdict["reasons"].append(
        {"rule": "bend", "level": "with care", "text": "", "advice": ""}
    ),
    "a reason in other words": lambda verdict: verdict["reasons"][0].update(text="all is well"),
    "other advice": lambda verdict: verdict["reasons"][0].update(advice="pull hard"),
    "a reason made light of": lambda verdict: verdict["reasons"][0].update(level="makeable"),
}


@pytest.fixture(scope="module")
def careful(tmp_path_factory, ball):
    """The same job with a reason: a finding, which has the words of some note."""
    folder = tmp_path_factory.mktemp("careful") / "job"
    shutil.copytree(ball, folder)
    ribbons = json.loads((folder / "ribbons.json").read_text())
    text = json.loads((folder / "waste.json").read_text())["notes"][0]
    finding(text=text)(ribbons)
    (folder / "ribbons.json").write_text(json.dumps(ribbons))
    verdict = json.loads((folder / "verdict.json").read_text())
    verdict["level"] = "with care"
    advice = "ease the strip in slowly, or narrow it there by hand"
    verdict["reasons"].append(
        {"rule": "twist", "level": "with care", "text": text, "advice": advice}
    )
    (folder / "verdict.json").write_text(json.dumps(verdict))
    toml = folder / "job.toml"
    toml.write_text(toml.read_text().replace('verdict = "makeable"', 'verdict = "with care"'))
    assert "verdict" not in verify_job(folder).failed
    return folder


@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED.keys())
def test_another_verdict_is_objected_to(careful, tmp_path, spoil):
    assert "verdict" in edited(tmp_path, careful, "verdict.json", spoil)


@pytest.mark.parametrize(
    "changes", [{"count": 26}, {"far": 2}, {"severity": "refuse"}, {"far": None}]
)
def test_findings_that_come_to_more_are_objected_to(ball, tmp_path, changes):
    assert "verdict" in edited(tmp_path, ball, "ribbons.json", finding(**changes))


def test_the_settings_say_the_same(ball, tmp_path):
    copy = tmp_path / "job"
    shutil.copytree(ball, copy)
    toml = copy / "job.toml"
    toml.write_text(toml.read_text().replace('verdict = "', 'verdict = "not '))
    assert "verdict" in verify_job(copy).failed


@pytest.fixture(scope="module")
def half(tmp_path_factory, finished):
    """A job of which a body was left out: a third of the surface."""
    path = tmp_path_factory.mktemp("half") / "two.obj"
    ball = parse_shape("shape:octahedron")
    small = ball.with_vertices(ball.vertices / np.sqrt(2.0) + 3.0 * np.ptp(ball.vertices))
    write_mesh(path, together(ball, small))
    return finished(path, *OCTAHEDRON[1:], "--bodies", "largest")


def test_what_was_left_out_is_told_in_the_verdict_and_proved(half, tmp_path):
    verdict = json.loads((half / "verdict.json").read_text())
    told = [reason["text"] for reason in verdict["reasons"] if reason["rule"] == "left-out"]
    assert told == ["bodies with 33% of the model's surface were left out"]
    assert verdict["level"] == "with care"
    assert verify_job(half).ok

    def silent(verdict):
        verdict["reasons"] = [one for one in verdict["reasons"] if one["rule"] != "left-out"]

    assert "verdict" in edited(tmp_path, half, "verdict.json", silent)
    shutil.rmtree(tmp_path / "job")

    def less(verdict):
        for one in verdict["reasons"]:
            one["text"] = one["text"].replace("33%", "3%")

    assert "verdict" in edited(tmp_path, half, "verdict.json", less)
