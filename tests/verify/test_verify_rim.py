"""A ring around an opening is held to the crossings beside it, and to its drawings."""

import json
import shutil

import pytest
from jobs import DOUBLED, RINGED
from sealing import told
from spoiling import edit_json, edit_text


@pytest.fixture
def ringed(finished, tmp_path):
    return finished.copy(tmp_path / "job", *RINGED)


@pytest.mark.slow
def test_a_ring_passes_and_is_bought_for(ringed):
    assert told(ringed) == {}
    record = json.loads((ringed / "rim" / "rim.json").read_text("utf-8"))
    crossings = {hole["crossing"] for ring in record["rings"] for piece in ring["pieces"]
                 for hole in piece["holes"]}  # fmt: skip
    plan = json.loads((ringed / "crossing_map.json").read_text("utf-8"))
    assert crossings <= {one["id"] for one in plan["crossings"] if one["fastened"]}
    rows = json.loads((ringed / "waste.json").read_text("utf-8"))["fasteners"]
    assert sum(row["needed"] for row in rows if row["layers"] >= 3) >= len(crossings)
    assert "R2: letters" in (ringed / "rim" / "rim.txt").read_text("utf-8")


@pytest.mark.slow
def test_a_doubled_ring_around_corners_passes_and_its_courses_differ(finished, tmp_path):
    doubled = finished.copy(tmp_path / "job", *DOUBLED)
    assert told(doubled) == {}
    path = doubled / "rim" / "rim.json"
    (ring,) = json.loads(path.read_text("utf-8"))["rings"]
    assert [one["inside"] for one in ring["pieces"]] == [False, False, True, True]
    edit_json(path, lambda document: flipped(document["rings"][0]))
    assert "do not follow one another" in str(told(doubled)["rim"])
    edit_text(doubled / "job.toml", 'rim = "double"', 'rim = "ring"')
    assert "whether it has pieces inside" in str(told(doubled)["rim"])


def flipped(ring):
    """Lay outside what is to be inside, and the other way."""
    for one in ring["pieces"]:
        one["inside"] = not one["inside"]
    ring["pieces"] = ring["pieces"][2:] + ring["pieces"][:2]


def piece(ring):
    return ring["pieces"][0]


def moved(ring, what, at, by=0.2):
    piece(ring)["rungs"][at][what][0] += by


def mirrored(ring):
    """All lengths stay, but the letters would be inside."""
    for rung in piece(ring)["rungs"]:
        for what in ("rim", "foot"):
            rung[what][0] *= -1
    for hole in piece(ring)["holes"]:
        hole["x"] *= -1


def shifted(ring):
    """The band lies on other crossings, as far apart as its own."""
    for rung in piece(ring)["rungs"]:
        rung["crossing"] = rung["crossing"] + 1


SPOILT = [
    (lambda r: piece(r)["holes"][1].update(x=piece(r)["holes"][1]["x"] + 0.2),
     "from where its crossing comes to lie"),
    (lambda r: piece(r)["holes"][0].update(hole_mm=9.0), "other holes than the record"),
    (lambda r: piece(r)["holes"][1].update(crossing=0), "crossings of its holes"),
    (lambda r: piece(r)["holes"].pop(1), "crossings of its holes"),
    (lambda r: moved(r, "foot", 1), "from that of the surface"),
    (lambda r: moved(r, "rim", 2), "from that of the surface"),
    (mirrored, "it is turned over"),
    (shifted, "do not follow one another along the rim"),
    (lambda r: piece(r)["rungs"].pop(1), "do not follow one another along the rim"),
    (lambda r: r.update(width_mm=50.0), "width_mm is"),
    (lambda r: r.update(over_mm=3.0), "the border is"),
    (lambda r: r.update(side="bottom"), "its side"),
    (lambda r: r.update(thickness_mm=3.0), "it is of no material here"),
    (lambda r: piece(r).update(inside=True), "whether it has pieces inside"),
    (lambda r: piece(r).update(sheet="rim_09"), "rim_09.dxf could not be read"),
    (lambda r: piece(r)["rungs"][1].update(vertex=10**6), "do not follow one another"),
    (lambda r: piece(r).pop("rungs"), "rungs"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("change", "words"), SPOILT)
def test_another_ring_is_found(ringed, change, words):
    edit_json(ringed / "rim" / "rim.json", lambda document: change(document["rings"][0]))
    assert words in str(told(ringed)["rim"])


@pytest.mark.slow
def test_a_ring_in_another_order_is_not_the_one_that_the_last_step_lays(ringed):
    edit_json(
        ringed / "rim" / "rim.json", lambda document: document["rings"][0]["pieces"].reverse()
    )
    assert "its ring" in str(told(ringed)["steps"])


def last_step(document):
    return document["steps"][-1]


def loosened(document):
    """Fasten a crossing of the ring for good as soon as its last layer comes."""
    key = last_step(document)["fasten"].pop()
    document["steps"][-2]["fasten"].append(key)


SPOILT_STEPS = [
    (loosened, "crossings to fasten"),
    (lambda d: last_step(d).pop("ring"), "the last steps lay not each one of the rings"),
    (lambda d: last_step(d)["ring"].reverse(), "its ring"),
    (lambda d: last_step(d)["pieces"].append(d["pieces"][0]["id"]), "more than to lay a ring"),
    (lambda d: d["steps"].insert(0, d["steps"].pop()), "the last steps lay not"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("change", "words"), SPOILT_STEPS)
def test_a_ring_that_is_laid_otherwise_is_found(ringed, change, words):
    edit_json(ringed / "crossing_map.json", change)
    assert words in str(told(ringed)["steps"])


@pytest.mark.slow
def test_a_ring_that_is_cut_without_its_kerf_is_found(ringed):
    for suffix in ("dxf", "svg"):
        shutil.copy(
            ringed / "rim" / f"rim_01.{suffix}", ringed / "cut" / f"rim_01_kerf0.15mm.{suffix}"
        )
    assert "piece R1, outline: it is cut too near" in str(told(ringed)["cut"])


@pytest.mark.slow
def test_a_ring_that_is_gone_or_was_not_asked_for_is_found(ringed):
    edit_text(ringed / "job.toml", 'rim = "ring"', 'rim = "none"')
    assert "nobody asked for it" in str(told(ringed)["rim"])
    edit_text(ringed / "job.toml", 'rim = "none"', 'rim = "ring"')
    shutil.rmtree(ringed / "rim")
    assert "there is no such folder" in str(told(ringed)["rim"])
