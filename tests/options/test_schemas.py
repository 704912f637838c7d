"""The schemas that are shipped describe the files that are written, and nothing else."""

import copy
import json
import runpy
import tomllib
from pathlib import Path

import pytest
from jobs import DOUBLED, FORMED, OCTAHEDRON, RINGED, STRAIGHT
from slow import slow_but

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fabweave"
MAP, JOB = PACKAGE / "plan/crossing_map.schema.json", PACKAGE / "options/job.schema.json"


def test_they_are_those_of_the_records_and_the_table_of_options():
    made = runpy.run_path(str(ROOT / "tests/tools/make_schemas.py"))["texts"]()
    assert set(made) == {MAP, JOB}
    assert all(path.read_text("utf-8") == text for path, text in made.items())


@pytest.fixture(scope="module")
def check():
    """Return what says what a schema finds wrong with a document."""
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is absent")

    def faults(schema, document):
        validator = jsonschema.Draft202012Validator(json.loads(schema.read_text("utf-8")))
        validator.check_schema(validator.schema)
        return list(validator.iter_errors(document))

    return faults


@pytest.mark.parametrize(
    "words", slow_but([(OCTAHEDRON,), (STRAIGHT,), (DOUBLED,), (RINGED,), (FORMED,)])
)
def test_files_keep_them(words, finished, check):
    folder = finished(*words)
    assert check(MAP, json.loads((folder / "crossing_map.json").read_bytes())) == []
    assert check(JOB, tomllib.loads((folder / "job.toml").read_text("utf-8"))) == []


@pytest.mark.parametrize("folder", ["torus", "kagome_ball", "fish"])
def test_outputs_keep_them(folder, check):
    there = ROOT / "outputs" / folder
    assert check(MAP, json.loads((there / "crossing_map.json").read_bytes())) == []
    assert check(JOB, tomllib.loads((there / "job.toml").read_text("utf-8"))) == []


def test_they_object_to_what_is_no_such_file(finished, check):
    folder = finished(*OCTAHEDRON)
    plan = json.loads((folder / "crossing_map.json").read_bytes())
    job = tomllib.loads((folder / "job.toml").read_text("utf-8"))
    for path, value in (
        (("schema",), "other"), (("pieces", 0, "id"), 3), (("steps",), None),
        (("crossings", 0, "position"), [1.0, 2.0]), (("sheets", 0, "width_mm"), "600"),
        (("threads", 0, "over", 0), "yes"),
    ):  # fmt: skip
        spoilt = copy.deepcopy(plan)
        *way, last = path
        at = spoilt
        for step in way:
            at = at[step]
        at[last] = value
        assert len(check(MAP, spoilt)) > 0, path
    for name in ("pieces", "layout", "units"):
        assert len(check(MAP, {key: one for key, one in plan.items() if key != name})) > 0
    for name, value in (
        ("luck", 1),
        ("force", "yes"),
        ("effort", "some"),
        ("size", [3]),
        ("mesh", True),
    ):
        assert len(check(JOB, {**job, "job": {**job["job"], name: value}})) > 0, name
    assert len(check(JOB, {"job": job["job"]})) > 0
