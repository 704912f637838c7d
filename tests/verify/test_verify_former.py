"""A former is held to the strips that it carries, to its slots, its names and its way out."""

import json
import shutil

import numpy as np
import pytest
from jobs import FORMED
from sealing import told
from spoiling import drop, edit_json, edit_text, more, put


@pytest.fixture(scope="module")
def formed(finished):
    return finished(*FORMED)


@pytest.fixture
def copied(finished, tmp_path):
    return finished.copy(tmp_path / "job", *FORMED)


def record_of(folder):
    return json.loads((folder / "former" / "former.json").read_text("utf-8"))


def in_space(plate, points):
    return np.array(plate["origin"]) + np.atleast_2d(points) @ np.array(plate["axes"])


def test_a_former_carries_nearly_all_pieces_and_hangs_together(formed):
    record = record_of(formed)
    plan = json.loads((formed / "crossing_map.json").read_text("utf-8"))
    carried = {strip["piece"] for plate in record["plates"] for strip in plate["strips"]}
    assert len(carried) >= 0.9 * len(plan["pieces"])
    slots = {(plate["id"], slot["plate"]) for plate in record["plates"] for slot in plate["slots"]}
    assert slots == {(other, one) for one, other in slots}
    assert {one for one, _ in slots} == {plate["id"] for plate in record["plates"]}


def test_slots_of_two_plates_end_in_one_place_and_planes_are_square(formed):
    plates = {plate["id"]: plate for plate in record_of(formed)["plates"]}
    for plate in plates.values():
        axes = np.array(plate["axes"])
        assert np.allclose(axes @ axes.T, np.eye(2), atol=1e-9)
        for slot in plate["slots"]:
            other = plates[slot["plate"]]
            end = next(one["end"] for one in other["slots"] if one["plate"] == plate["id"])
            assert np.allclose(in_space(plate, slot["end"]), in_space(other, end), atol=1e-5)


def far_ones(strips):
    """Exchange the names of two places that are far from one another."""
    first, other = (
        strips[0],
        max(strips, key=lambda one: np.hypot(*np.subtract(one["at"], strips[0]["at"]))),
    )
    first["piece"], other["piece"] = other["piece"], first["piece"]
    return strips


SPOILT = [
    (("plates", 0, "origin", 0), more(3.0), "a strip is"),
    (("plates", 0, "axes", 0, 0), more(0.1), "not of length 1"),
    (("plates", 0, "sheet"), lambda _: "former_09", "could not be read"),
    (("plates", 0, "strips", 0, "at", 0), more(4.0), "off it"),
    (("plates", 0, "strips", 0, "piece"), lambda _: "Z99", "no such piece"),
    (("plates", 0, "slots", 0, "end", 0), more(5.0), "their slots end"),
    (("thickness_mm",), lambda _: 3.0, "into one another"),
    (("way_out", "wide_mm"), more(0.1), "wide"),
    (("way_out", "deep_mm"), more(0.1), "deep"),
    (("plates", 0, "strips"), lambda strips: strips[:-1], "ticks"),
    (("plates", 0, "strips"), far_ones, "the strip passes"),
    (("way_out", "inward", 0), more(1.0), "inward"),
    (("way_out", "before"), lambda _: 10_000, "before no piece"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("path", "change", "words"), SPOILT)
def test_another_former_is_found(copied, path, change, words):
    edit_json(copied / "former" / "former.json", put(*path, change))
    assert words in str(told(copied)["former"])


@pytest.mark.slow
def test_a_former_that_falls_apart_or_does_not_come_out_is_found(copied):
    def apart(document):
        for plate in document["plates"]:
            plate["slots"] = [] if plate["spine"] else plate["slots"]

    edit_json(copied / "former" / "former.json", apart)
    assert "only one of them" in str(told(copied)["former"])
    edit_json(copied / "former" / "former.json", put("way_out", "wide_mm", lambda _: 20.0))
    assert "a part is" in str(told(copied)["former"])


@pytest.mark.slow
def test_a_plate_that_nobody_drew_or_names_is_found(copied):
    edit_json(copied / "former" / "former.json", drop("plates", 0))
    assert "plates that are drawn" in str(told(copied)["former"])


@pytest.mark.slow
def test_a_former_that_is_gone_or_was_not_asked_for_is_found(copied):
    edit_text(copied / "job.toml", 'former = "auto"', "")
    assert "nobody asked for it" in str(told(copied)["former"])
    edit_text(copied / "job.toml", r"\[job\]", '[job]\nformer = "auto"')
    shutil.rmtree(copied / "former")
    assert "there is none" in str(told(copied)["former"])
