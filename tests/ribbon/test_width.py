"""Ribbons are as wide as they are asked to be, where there is room, and heights fit the layers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid
from strategies import closed_surfaces, open_surfaces
from unfolding import plain_ribbons, shape_at
from weaving_meshes import walked

from fabweave.core.arrays import unit
from fabweave.core.errors import InputError
from fabweave.job.ask import brief_of
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.piece.split.split_plan import plan_pieces
from fabweave.ribbon.even import even_rails, even_widths, short_panels
from fabweave.ribbon.lay import lay_ribbons, widest_width
from fabweave.ribbon.measures import panel_widths, ribbon_widths
from fabweave.ribbon.project import following_rung, smooth_ribbons
from fabweave.ribbon.width import EVEN, PROPORTIONAL, WidthRule, parse_width
from fabweave.weave.pattern import plain_weave


def widths(shape: str, rule: WidthRule | float) -> np.ndarray:
    return ribbon_widths(plain_ribbons(shape_at(shape, 400.0), width=rule)[1])


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
    st.sampled_from("rcb><e="),
    st.booleans(),
)
def test_widths_are_written_as_they_are_read(relative, a, b, kind, auto) -> None:
    rule = {
        "r": WidthRule(relative),
        "c": WidthRule(0.65, a, a),
        "b": WidthRule(relative, min(a, b), max(a, b)),
        ">": WidthRule(relative, least_mm=a),
        "<": WidthRule(relative, most_mm=a),
        "e": replace(EVEN, relative=relative),
        "=": replace(EVEN, relative=relative, most_mm=a),
    }[kind]
    rule = replace(rule, auto=auto or rule.even)
    again = parse_width(str(rule))
    assert str(again) == str(rule)
    assert (again.auto, again.even) == (rule.auto, rule.even)
    assert again.least_mm == pytest.approx(rule.least_mm, rel=1e-9)


@pytest.mark.parametrize(
    "text", ["wide", "1.5", "0", "9mm..6mm", "0.5,6mm", "auto,auto", "even,1.5", "-3mm"]
)
def test_widths_that_make_no_sense_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        parse_width(text)


@st.composite
def uneven(draw) -> PolyMesh:
    """Give meshes whose faces are stretched, so that strands have more room here than there."""
    mesh, _ = draw(st.one_of(closed_surfaces(), open_surfaces()))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    moved = mesh.vertices * rng.uniform(0.8, 1.25, (mesh.n_vertices, 1))
    return PolyMesh(moved, mesh.offsets, mesh.indices)


def even_on(mesh, rule: WidthRule = EVEN):
    """Return weave, widths of passes and laid ribbons of one width on a mesh."""
    halfedges, threads = walked(mesh)
    width = even_widths(mesh, halfedges, plain_weave(threads), rule, length=0.7)
    weave, ribbons = plain_ribbons(mesh, width=width)
    return weave, width, ribbons


@given(uneven())
def test_one_width_is_kept_wherever_there_is_room_and_narrows_by_degrees(mesh) -> None:
    weave, width, projected = even_on(mesh)
    ribbons = short_panels(projected, weave, width, np.ones(len(width)))
    # Panels are as wide as told across themselves, at both ends, and no longer than projected.
    assert panel_widths(ribbons) == pytest.approx(np.column_stack([width, width]), rel=1e-9)
    assert (panel_lengths(ribbons) <= panel_lengths(projected) * (1 + 1e-9)).all()
    room = widths_of(mesh, WidthRule(0.7))
    one = 0.8 * np.median(room)
    bound = np.minimum(room, one)
    assert (width <= bound * (1 + 1e-12)).all()
    following = following_rung(weave.threads.offsets, weave.threads.closed)
    here = np.flatnonzero(following >= 0)
    after = following[here]
    low, high = (f(width[here], width[after]) for f in (np.minimum, np.maximum))
    assert (low >= 0.75 * high * (1 - 1e-12)).all()
    # None is narrower than it must be: for want of room there, or of a neighbour that is narrow.
    held = width >= bound * (1 - 1e-12)
    for one_, other in ((here, after), (after, here)):
        held[one_] |= width[one_] >= width[other] / 0.75 * (1 - 1e-12)
    assert held.all()


def widths_of(mesh, rule: WidthRule) -> np.ndarray:
    """Return the width at the narrower end of each panel, across it."""
    _, ribbons = plain_ribbons(mesh, height_mm=0.0, width=rule)
    return panel_widths(ribbons).min(axis=1)


def panel_lengths(ribbons) -> np.ndarray:
    """Return how long the middle line of each panel is."""
    middle = (ribbons.right + ribbons.left) / 2
    return np.linalg.norm(middle[ribbons.entry + 1] - middle[ribbons.entry], axis=1)


@given(uneven(), st.integers(0, 4))
def test_rails_move_along_their_rungs_and_strands_keep_their_crossings(mesh, steps):
    weave, width, projected = even_on(mesh)
    smooth = smooth_ribbons(short_panels(projected, weave, width, np.ones(len(width))), steps)
    ribbons = even_rails(smooth, weave, width)
    enter, leave = ribbons.entry, ribbons.entry + 1
    # Every rung stays in its line, and the middles of panels, where strands meet, in their places.
    for one, other in ((smooth, ribbons), (ribbons, smooth)):
        across = unit(one.left - one.right)
        way = other.left - one.right
        assert np.linalg.norm(np.cross(across, way), axis=1).max() <= 1e-9 * np.abs(way).max()
    for one, other in zip(middles_of_ends(smooth), middles_of_ends(ribbons), strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    # No rung gets shorter than the ribbon is wide there, nor longer than 1.7 times that.
    rung = np.linalg.norm(ribbons.left - ribbons.right, axis=1)
    for end in (enter, leave):
        assert (rung[end] >= width * (1 - 1e-9)).all()
        assert (rung[end] <= 1.7 * width * (1 + 1e-9)).all()


def middles_of_ends(ribbons):
    """Return the middle of each panel's two ends."""
    middle = (ribbons.right + ribbons.left) / 2
    return middle[ribbons.entry], middle[ribbons.entry + 1]


@given(uneven(), st.floats(0.2, 5.0))
def test_one_width_grows_with_the_object_unless_it_is_stated(mesh, factor) -> None:
    larger = PolyMesh(mesh.vertices * factor, mesh.offsets, mesh.indices)
    _, width, _ = even_on(mesh)
    assert even_on(larger)[1] == pytest.approx(factor * width, rel=1e-9)
    stated = float(np.median(width)) / 2
    _, one, _ = even_on(larger, parse_width(f"even,{stated!r}mm"))
    assert one.max() <= stated


def test_a_width_that_is_left_to_fabweave_is_even_but_on_built_in_shapes() -> None:
    assert Settings.of("kitten.obj").width_rule == EVEN
    assert Settings.of("shape:torus").width_rule == PROPORTIONAL
    assert Settings.of("shape:torus", remesh="quads:90").width_rule == EVEN
    assert parse_width("open:0.2") == replace(PROPORTIONAL, relative=0.8)
    narrower = Settings.of("kitten.obj").narrower(0.5)
    assert (
        narrower.ribbons.width
        == parse_width(str(narrower.ribbons.width))
        == replace(EVEN, relative=0.35)
    )


@pytest.mark.slow
def test_two_layers_fit_at_a_crossing_and_three_at_a_lap() -> None:
    woven, settings, supplies = laid("shape:torus?m=12&n=6", size_mm=400.0, material="museum-board")
    runs = plan_pieces(woven.ribbons, woven.weave, woven.labels, brief_of(settings, supplies)).runs
    threads = woven.weave.threads
    laps = runs.laps(threads)
    # Every ring is jointed, each joint where its thread goes under, and no crossing twice.
    assert len(laps) == len(runs.thread) == len(np.unique(laps))
    ribbons = lay_ribbons(
        woven.source, woven.weave, settings.ribbons, supplies.thickness_mm(woven.bunches), laps
    )
    corners = ribbons.right[ribbons.entry] + ribbons.right[ribbons.entry + 1]
    corners = corners + ribbons.left[ribbons.entry] + ribbons.left[ribbons.entry + 1]
    height = np.einsum(
        "pd,pd->p", corners / 4 - ribbons.centre[threads.crossing], ribbons.normal[threads.crossing]
    )
    apart = np.zeros(threads.n_crossings)
    np.add.at(apart, threads.crossing, np.where(woven.weave.over, height, -height))
    layers = supplies.only.thickness_mm + settings.ribbons.clearance_mm
    expected = np.full(threads.n_crossings, layers)
    expected[laps] += supplies.only.thickness_mm / 2
    assert apart == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("shape", ["torus?m=12&n=8", "sphere?n=4", "hypar"])
def test_the_widest_width_for_all_is_reached_and_no_wider_one(shape: str) -> None:
    mesh = shape_at(shape, 400.0)
    halfedges, threads = walked(mesh)
    widest = widest_width(mesh, halfedges, plain_weave(threads), length=0.7)
    assert widths(shape, WidthRule(0.65, widest, widest)) == pytest.approx(widest, rel=1e-9)
    wider = 1.01 * widest
    assert widths(shape, WidthRule(0.65, wider, wider)).min() < 0.995 * wider
