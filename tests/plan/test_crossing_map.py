"""The crossing map of a job comes back from its file as it was; a spoiled file is refused."""

import json
from functools import cache

import numpy as np
import pytest
from crossing_maps import piece_record, sheet_record, small_map
from hypothesis import given
from hypothesis import strategies as st
from slow import slow_but
from viewer_scene import make_page

from fabweave.core.errors import InputError
from fabweave.job.write import json_text
from fabweave.plan.crossing_map import CrossingMap, read_crossing_map

pytestmark = pytest.mark.usefixtures("quick_jobs")

JOBS = {
    "octahedron": ("shape:octahedron", {}),
    "slotted satin": (
        "shape:torus?m=5&n=5",
        {"pattern": "satin:5/2", "joint": "rivet,slots", "label_side": "inside", "force": True},
    ),
    "inexact twill": ("shape:cube", {"pattern": "twill"}),
    "two materials": (
        "shape:torus?m=4&n=4",
        {"material": "warp=card,weft=birch-veneer", "force": True},
    ),
}


@cache
def map_of(name):
    shape, settings = JOBS[name]
    return make_page(shape, 300.0, **settings)[1]


@pytest.mark.parametrize("name", slow_but(JOBS))
def test_a_map_comes_back_from_its_file(name, tmp_path):
    crossing_map = map_of(name)
    path = tmp_path / "crossing_map.json"
    path.write_text(json_text(crossing_map.to_json()), encoding="utf-8")
    again = read_crossing_map(path)
    assert again == crossing_map
    assert json_text(again.to_json()) == path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_jobs_hold_every_kind_of_record():
    assert map_of("octahedron").pieces[0].labels
    assert any(c.kind == "slot" for p in map_of("slotted satin").pieces for c in p.cutouts)
    assert map_of("slotted satin").weave.labels
    assert map_of("slotted satin").sheets[0].mirrored
    assert map_of("inexact twill").weave.at_least_broken
    assert {sheet.material for sheet in map_of("two materials").sheets} == {"card", "birch-veneer"}


def places(value, path=()):
    """Yield the path of every value in a document."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for step, item in items:
        if isinstance(item, dict | list):
            yield from places(item, (*path, step))
        else:
            yield (*path, step)


@cache
def document_text():
    return json.dumps(map_of("octahedron").to_json())


PLACES = st.deferred(lambda: st.sampled_from(list(places(json.loads(document_text())))))
#: What may be absent, so that older files can be read.
OPTIONAL = {
    ("sheets", "rest"),
    ("layout", "recorded"),
    ("pieces", "hidden"),
    ("cut", "labels"),
}


def spoil(path, value=None):
    """Return the document with another value at a place, or without it."""
    document = json.loads(document_text())
    *way, last = path
    holder = document
    for step in way:
        holder = holder[step]
    if value is None:
        del holder[last]
    else:
        holder[last] = value
    return json.dumps(document)


@given(PLACES, st.sampled_from([{"no": "such"}, float("nan"), [[[]]]]))
def test_a_value_of_the_wrong_type_is_refused(path, value):
    with pytest.raises(InputError):
        CrossingMap.from_json(spoil(path, value))


@given(PLACES.filter(lambda path: isinstance(path[-1], str)))
def test_a_missing_key_is_named(path):
    if (path[0], path[-1]) in OPTIONAL:
        assert CrossingMap.from_json(spoil(path)).sheets
    else:
        with pytest.raises(InputError, match=rf"\b{path[-1]}\b"):
            CrossingMap.from_json(spoil(path))


@pytest.mark.parametrize(
    ("path", "unknown", "words"),
    [
        (("pieces", 0, "sheet"), 9, "it names sheet 9, which it does not list"),
        (("sheets", 0, "sheet"), 2, "its sheets are numbered 2, 2, not from 1"),
        (("schema",), "fabweave.crossing-map/2", "'fabweave.crossing-map/2' - at `$.schema`"),
        (("units",), "inch", "'inch' - at `$.units`"),
    ],
)
def test_a_reference_that_leads_nowhere_is_named(path, unknown, words):
    with pytest.raises(InputError) as caught:
        CrossingMap.from_json(spoil(path, unknown))
    assert words in str(caught.value)


def test_a_piece_stands_on_its_sheet():
    piece = piece_record("A1", [], sheet=2, turn=90.0, at=(50.0, 5.0))
    plain = [sheet_record(1), sheet_record(2, width_mm=300.0)]
    mirrored = [sheet_record(1), sheet_record(2, width_mm=300.0, mirrored=True)]
    corner = np.array([[20.0, 10.0]])
    # R(90°)(20, 10) + (50, 5) = (-10 + 50, 20 + 5)
    for sheets, place in ((plain, (40.0, 25.0)), (mirrored, (260.0, 25.0))):
        placed = small_map(sheets=sheets, pieces=[piece]).on_sheet(piece, corner)
        assert placed[0] == pytest.approx(place)
