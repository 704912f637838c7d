"""Ribbons are as wide as they are asked to be, where there is room, and heights fit the layers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.app.request import complete_settings
from fabweave.app.settings import Settings
from fabweave.app.split_job import plan_pieces
from fabweave.app.woven_object import lay_ribbons, weave_object
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import project_ribbons
from fabweave.ribbon.widest import widest_width
from fabweave.ribbon.width import WidthRule, parse_width
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads


def widths(shape: str, rule: WidthRule | float) -> np.ndarray:
    mesh = resize_mesh(parse_shape(f"shape:{shape}"), size_mm=400.0)[0]
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    return ribbon_widths(project_ribbons(mesh, halfedges, weave, height_mm=0.25, width=rule))


@pytest.mark.parametrize("shape", ["torus?m=12&n=8", "sphere?n=4", "hypar", "dodecahedron"])
def test_widths_in_millimetres_are_kept_where_there_is_room(shape: str) -> None:
    room = widths(shape, 0.5) / 0.5
    narrow = 0.4 * room.min()
    assert widths(shape, WidthRule(0.65, narrow, narrow)) == pytest.approx(narrow, rel=1e-9)
    wide = float(np.median(room))
    found = widths(shape, WidthRule(0.65, wide, wide))
    assert found == pytest.approx(np.minimum(wide, 0.7 * room), rel=1e-9)
    between = widths(shape, WidthRule(0.65, 0.5 * wide, 0.6 * wide))
    expected = np.minimum(np.clip(0.65 * room, 0.5 * wide, 0.6 * wide), 0.7 * room)
    assert between == pytest.approx(expected, rel=1e-9)


@given(
    st.floats(0.01, 0.99),
    st.floats(0.1, 50),
    st.floats(0.1, 50),
    st.sampled_from("rcb><"),
    st.booleans(),
)
def test_widths_are_written_as_they_are_read(relative, a, b, kind, auto) -> None:
    rule = {
        "r": WidthRule(relative),
        "c": WidthRule(0.65, a, a),
        "b": WidthRule(relative, min(a, b), max(a, b)),
        ">": WidthRule(relative, least_mm=a),
        "<": WidthRule(relative, most_mm=a),
    }[kind]
    rule = replace(rule, auto=auto)
    again = parse_width(str(rule))
    assert str(again) == str(rule)
    assert again.auto == auto
    assert again.least_mm == pytest.approx(rule.least_mm, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wide", "is not a number with a unit"),
        ("1.5", "between 0 and 1"),
        ("0", "between 0 and 1"),
        ("9mm..6mm", "at least 9 mm and at most 6 mm"),
        ("0.5,6mm", "is not a width"),
        ("half,6mm..9mm", "is not a width"),
        ("auto,auto", "is not a width"),
        ("auto,", "is not a number with a unit"),
        ("-3mm", "must be positive"),
    ],
)
def test_widths_that_make_no_sense_are_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_width(text)


def test_two_layers_fit_at_a_crossing_and_three_at_a_lap() -> None:
    settings, supplies = complete_settings(
        Settings(mesh="shape:torus?m=12&n=6", size_mm=400.0, material="museum-board")
    )
    woven = weave_object(settings, supplies)
    runs = plan_pieces(woven.ribbons, woven.weave, woven.labels, settings, (), supplies).runs
    threads = woven.weave.threads
    laps = runs.laps(threads)
    # Every ring is jointed, each joint where its thread goes under, and no crossing twice.
    assert len(laps) == len(runs.thread) == len(np.unique(laps))
    ribbons = lay_ribbons(
        woven.source, woven.weave, settings, supplies.thickness_mm(woven.bunches), laps
    )
    corners = ribbons.right[ribbons.entry] + ribbons.right[ribbons.entry + 1]
    corners = corners + ribbons.left[ribbons.entry] + ribbons.left[ribbons.entry + 1]
    height = np.einsum(
        "pd,pd->p", corners / 4 - ribbons.centre[threads.crossing], ribbons.normal[threads.crossing]
    )
    apart = np.zeros(threads.n_crossings)
    np.add.at(apart, threads.crossing, np.where(woven.weave.over, height, -height))
    layers = supplies.only.thickness_mm + settings.clearance_mm
    expected = np.full(threads.n_crossings, layers)
    expected[laps] += supplies.only.thickness_mm / 2
    assert apart == pytest.approx(expected, abs=1e-9)


def test_runs_of_open_threads_lap_only_between_pieces() -> None:
    settings, supplies = complete_settings(
        replace(Settings(mesh="shape:hypar", size_mm=400.0), max_length_mm=150.0)
    )
    woven = weave_object(settings, supplies)
    runs = plan_pieces(woven.ribbons, woven.weave, woven.labels, settings, (), supplies).runs
    crossed = np.count_nonzero(woven.weave.threads.lengths)
    assert len(runs.laps(woven.weave.threads)) == len(runs.thread) - crossed


@pytest.mark.parametrize("shape", ["torus?m=12&n=8", "sphere?n=4", "hypar"])
def test_the_widest_width_for_all_is_reached_and_no_wider_one(shape: str) -> None:
    mesh = resize_mesh(parse_shape(f"shape:{shape}"), size_mm=400.0)[0]
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    widest = widest_width(mesh, halfedges, weave, length=0.7)
    assert widths(shape, WidthRule(0.65, widest, widest)) == pytest.approx(widest, rel=1e-9)
    wider = 1.01 * widest
    assert widths(shape, WidthRule(0.65, wider, wider)).min() < 0.995 * wider
