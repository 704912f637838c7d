"""Spoil the viewer: the check of it objects, and no other."""

import json
import re

import pytest
from verify_writers import POLICY, rounded, write_viewer

from fabweave.verify import verify_job
from fabweave.verify.checks.reports.viewer import FRAME, THREE
from fabweave.verify.read.viewer import read_viewer


def failed(folder):
    return set(verify_job(folder).failed)


def put(*path, value):
    """Return an edit that sets a value deep in the data; a function is given the old value."""
    *path, last = path

    def edit(data):
        for key in path:
            data = data[key]
        data[last] = value(data[last]) if callable(value) else value

    return edit


def turned(flags):
    """Return the first flag's base64 with that flag turned over."""
    return ("AA" if flags[:2] != "AA" else "AQ") + flags[2:]


SPOILED = {
    "label": put("plan", "pieces", 0, "id", value="Z9"),
    "partner": put("plan", "pieces", 0, "stations", 1, "partner", value="Z9"),
    "over": put("plan", "pieces", 0, "stations", 1, "over", value=lambda over: not over),
    "one for true": put("plan", "pieces", 0, "stations", 0, "over", value=int),
    "station moved": put("plan", "pieces", 0, "stations", 1, "x", value=lambda x: x + 0.002),
    "outline moved": put("plan", "pieces", 1, "outline", 2, 0, value=lambda x: x - 0.002),
    "placement": put("plan", "pieces", 1, "placement", "rotation_deg", value=lambda a: a + 0.01),
    "sheet": put("plan", "pieces", 0, "sheet", value=2),
    "no sheet": put("plan", "sheets", value=[]),
    "mate": put("plan", "joints", 0, "pieces", value=lambda pair: [*pair[::-1], "A1"]),
    "step text": put("plan", "steps", 0, "text", value="Lay piece Z9."),
    "steps exchanged": put("plan", "steps", value=lambda steps: [steps[1], steps[0], *steps[2:]]),
    "step lost": put("plan", "steps", value=lambda steps: steps[:-1]),
    "more than the map": put("plan", "extra", value=1),
    "crossings lost": lambda data: data["plan"].pop("crossings"),
    "hours of nothing": put("hands", value={"hours": [1.0, 2.0]}),
    "a step seen from elsewhere": put("views_deg", 0, 0, value=120.0),
    "a step seen from below": put("views_deg", 1, 1, value=-35.0),
    "a view too few": put("views_deg", value=lambda views: views[1:]),
    "colours of a piece lost": put("colours", value=lambda colours: colours[1:]),
    "colour is none": put("colours", 0, 0, 0, value="red; x"),
    "another colour": put("colours", 0, 0, 0, value="#0072b8"),
    "colours exchanged": put("colours", value=lambda colours: colours[::-1]),
    "colour too short": put("colours", 0, 0, 1, value=lambda count: count - 1),
    "moved in space": put("space", "origin_mm", 0, value=lambda x: x + 0.05),
    "coarse": put("space", "step_mm", value=lambda step: step * 1.01),
    "pieces exchanged": put("space", "counts", value=lambda n: [n[0] + 1, n[1] - 1, *n[2:]]),
    "panel shifted": put("space", "panels", 0, 1, value=lambda at: at + 1),
    "diagonal": put("space", "from_right", value=turned),
    "piece lost in space": put("space", "panels", value=lambda panels: panels[:-1]),
}


@pytest.mark.parametrize("name", SPOILED)
@pytest.mark.parametrize("kind", ["octahedron", pytest.param("saddle", marks=pytest.mark.slow)])
def test_spoiled_data(job, specimen, name, kind):
    folder = job(kind)
    write_viewer(specimen(kind), folder, edit=SPOILED[name])
    assert failed(folder) == {"viewer"}


UNREADABLE = {
    "other schema": put("schema", value="fabweave.viewer/2"),
    "no space": lambda data: data.pop("space"),
    "no hours": lambda data: data.pop("hands"),
    "rungs cut off": put("space", "rungs", value=lambda text: text[:-16]),
    "no base64": put("space", "rungs", value="??"),
    "counts that do not add up": put("space", "counts", 0, value=lambda n: n + 1),
    "plan is a list": put("plan", value=[]),
    "a colour of no rungs": put("colours", 0, 0, 1, value=0),
    "a colour is a number": put("colours", 0, 0, 0, value=7),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_unreadable_data(job, specimen, name):
    folder = job()
    write_viewer(specimen("octahedron"), folder, edit=UNREADABLE[name])
    assert failed(folder) == {"files", "viewer"}


@pytest.mark.parametrize(
    "body",
    [
        '<script src="https://example.org/three.js"></script>',
        '<img src="sheets/sheet_01.png">',
        '<link rel="stylesheet" href="style.css">',
        '<a href="https://example.org">more</a>',
        '<meta http-equiv="Content-Security-Policy" content="default-src *">',
    ],
)
def test_what_could_load_something_is_found(job, specimen, body):
    folder = job()
    write_viewer(specimen("octahedron"), folder, body=body)
    assert failed(folder) == {"viewer"}


@pytest.mark.parametrize("policy", ["", POLICY.replace("'none'", "*"), POLICY + " https:"])
def test_other_policies_are_found(job, specimen, policy):
    folder = job()
    write_viewer(specimen("octahedron"), folder, policy=policy)
    assert failed(folder) == {"viewer"}


@pytest.mark.parametrize(
    ("first", "other"),
    [
        (
            '<meta name="viewport"',
            '<meta http-equiv="refresh" content="0;url=http://a.b"><meta n="',
        ),
        ("<title>", "<title>a</title><title>"),
        ("<h1>", "<h1>another "),
        ('"use strict"', '"use strict";fetch("http://a.b")'),
        ("Three.js Authors", "Three.js Author"),
        ("<style>", "<style>#panel-steps{display:none}"),
        ('<canvas id="labels"', '<canvas hidden id="labels"'),
        ("default-src 'none'", "default-src 'self'"),
        ("<html ", '<html onclick="a()" '),
    ],
)
def test_a_page_that_is_not_as_shipped_is_found(job, first, other):
    folder = job()
    page = (folder / "assembly.html").read_text()
    assert first in page
    (folder / "assembly.html").write_text(page.replace(first, other, 1))
    assert "viewer" in failed(folder)


def test_the_digests_are_those_of_the_page_that_is_written(job):
    """Where this fails after a change of the viewer, the new digests belong in the check."""
    viewer = read_viewer(job() / "assembly.html")
    assert viewer.frame == FRAME
    assert viewer.three in THREE


def test_two_documents_are_none(job):
    folder = job()
    page = (folder / "assembly.html").read_text()
    data = re.search("<script id.*</script>", page)[0]
    (folder / "assembly.html").write_text(page + data)
    assert failed(folder) == {"viewer"}


def test_a_map_of_more_than_we_know_is_compared_too(job, specimen):
    """What others add to the map is in the viewer, or the check objects."""
    folder = job()
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    plan["steps"][0]["remark"] = "slowly"
    path.write_text(json.dumps(plan))
    assert failed(folder) == {"viewer"}
    write_viewer(
        specimen("octahedron"), folder, edit=put("plan", "steps", 0, "remark", value="slowly")
    )
    assert failed(folder) == set()


def test_numbers_may_be_rounded_to_a_thousandth_and_no_coarser(job, specimen):
    folder = job()
    for digits, wrong in ((3, set()), (2, {"viewer"})):
        plan = rounded(specimen("octahedron").plan, digits)
        write_viewer(specimen("octahedron"), folder, edit=put("plan", value=plan))
        assert failed(folder) == wrong
