"""Arcs are read and measured by the verifier's own code; spoiled ones are found."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sealing import told
from spoiling import edit_json, put
from verify_writers import dxf_text, svg_text, write_job, write_sheets

from fabweave.verify.drawing import CHORDS_MM, ReadError, along, ring_area
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import path_runs, read_svg

# --- spoiled drawings ---------------------------------------------------------------------------


def edit_arc(change):
    """Return an edit of the first arc of the first outline that has one."""

    def edit(shapes):
        for k, (piece, layer, kind, data, closed) in enumerate(shapes):
            bent = [i for i, point in enumerate(data) if layer == "CUT_OUTER" and point[2]]
            if bent:
                points = [list(point) for point in data]
                change(points, bent[0])
                return [*shapes[:k], (piece, layer, kind, points, closed), *shapes[k + 1 :]]
        raise AssertionError("no arc")

    return edit


def bulge(change):
    def edit(points, at):
        points[at][2] = change(points[at][2])

    return edit


def two_chords_instead(points, at):
    (x, y, b), (u, v, _) = points[at], points[at + 1]
    points[at][2] = 0.0
    points.insert(at + 1, [(x + u + b * (v - y)) / 2, (y + v - b * (u - x)) / 2, 0.0])


def arc_on_the_next_side(points, at):
    points[at][2], points[at + 1][2] = points[at + 1][2], points[at][2]


#: Another sign, more, a chord, two chords; and, at last, more than half a turn.
SPOILED = [
    *map(bulge, (lambda b: -b, lambda b: 1.2 * b, lambda _: 0.0)),
    two_chords_instead,
    bulge(lambda b: 1.0 / b),
]


@pytest.mark.parametrize("change", [*SPOILED, arc_on_the_next_side])
def test_spoiled_arcs_in_both_formats(specimen, job, change):
    folder, source = job("bent"), specimen("bent")
    edit = edit_arc(change)
    write_sheets(source, folder, edit=lambda s, shapes: edit(shapes) if s["sheet"] == 1 else shapes)
    assert {"outlines-dxf", "outlines-svg"} <= set(told(folder))


ARC = r"A([0-9.]+),([0-9.]+) 0 0 ([01]) "


SVG_ARCS = {
    "sweep": (lambda m: f"A{m[1]},{m[2]} 0 0 {1 - int(m[3])} ", "outlines-svg"),
    "radius": (lambda m: f"A{float(m[1]) / 2},{float(m[2]) / 2} 0 0 {m[3]} ", "outlines-svg"),
    "small": (lambda m: f"A1,1 0 0 {m[3]} ", "files outlines-svg"),
    "chord": (lambda _: "L", "outlines-svg"),
    "large": (lambda m: f"A{m[1]},{m[2]} 0 1 {m[3]} ", "files outlines-svg"),
    "ellipse": (lambda m: f"A{m[1]},{float(m[2]) * 2} 0 0 {m[3]} ", "files outlines-svg"),
    "none": (lambda m: f"A0,0 0 0 {m[3]} ", "files outlines-svg"),
    "flag": (lambda m: f"A{m[1]},{m[2]} 0 0 7 ", "files outlines-svg"),
}


@pytest.mark.parametrize("name", SVG_ARCS)
def test_edited_svg_arcs(job, name):
    new, objecting = SVG_ARCS[name]
    folder = job("bent")
    path = folder / "sheets" / "sheet_01.svg"
    text, count = re.subn(ARC, new, path.read_text(), count=1)
    assert count == 1
    path.write_text(text)
    # Where a sheet cannot be read, or is cut elsewhere, its order may be told of, too.
    assert set(told(folder)) - {"order"} == set(objecting.split())


# --- spoiled maps: all files agree, and all are wrong -------------------------------------------


def scale_bulges(by):
    def edit(plan):
        for piece in plan["pieces"]:
            for corner in piece["path"]:
                corner[2] *= by

    return edit


def coarsen_outline(plan):
    for piece in plan["pieces"]:
        piece["outline"] = [corner[:2] for corner in piece["path"]]


def turn_path_round(plan):
    path = plan["pieces"][0]["path"]
    path.reverse()
    for corner, after in zip(path, [*path[1:], path[0]], strict=True):
        corner[2] = -after[2]


@pytest.mark.parametrize(
    "spoil", [scale_bulges(-1.0), scale_bulges(0.0), coarsen_outline, turn_path_round]
)
def test_paths_that_are_not_the_outlines(specimen, tmp_path, spoil):
    source = specimen("bent")
    spoil(source.plan)
    assert "simple" in told(write_job(source, tmp_path / "job"))


def test_a_path_may_cross_itself_by_its_arcs_alone(specimen, tmp_path):
    source = specimen("bent")
    path = source.plan["pieces"][0]["path"]
    at = next(k for k, corner in enumerate(path) if corner[2])
    path[at][2] = 0.999
    path[at - 2][2] = -0.999
    findings = told(write_job(source, tmp_path / "job"))["simple"]
    assert any("leaves its outline" in finding for finding in findings)


@pytest.mark.parametrize("path", [[], [[0.0, 0.0, 0.0]], [[0.0, 0.0]], "x", [[0, 0, None]]])
def test_a_broken_path_breaks_the_map(specimen, tmp_path, path):
    source = specimen("bent")
    folder = write_job(source, tmp_path / "job")
    edit_json(folder / "crossing_map.json", put("pieces", 0, "path", path))
    assert any("path" in finding for finding in told(folder)["files"])


# --- measuring ----------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-0.98, 0.98), min_size=3, max_size=7), st.floats(1.0, 300.0), st.booleans()
)
def test_exact_measures_are_those_of_short_chords(bulges, radius, tiny):
    turn = 2.0 * np.pi * np.arange(len(bulges)) / len(bulges)
    points = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1) + 1000.0
    bulges = np.array(bulges) * (1e-4 if tiny else 1.0)
    dense, after = along(np.concatenate([points, points[:1]]), np.append(bulges, 0.0))
    assert np.array_equal(dense[np.searchsorted(after, np.arange(len(points)))], points)
    x, y = (dense - dense[0]).T
    area = np.sum(x[:-1] * y[1:] - y[:-1] * x[1:]) / 2.0
    ring = np.column_stack((points, bulges))
    length = np.hypot(*np.diff(dense, axis=0).T).sum()
    assert ring_area(ring) == pytest.approx(area, abs=length * CHORDS_MM)


@pytest.mark.parametrize(
    "text",
    ["A1,1 0 0 0 2,0", "M1,0A1,1 0 1 0 2,1", "M0,0A1,1 0 0 0 2", "M0,0A1,1 0 0 0 2,x",
     "M0,0A1,1 0", "M0,0A1,2 0 0 0 2,0", "M0,0A1,1 0 0 0 3,0", "M0,0A0,0 0 0 0 0,0",
     "M0,0C1,1 2,2 3,3", "m0,0l1,1", "M0,0 L1,1", ""],
)  # fmt: skip
def test_broken_arcs_are_read_errors(text):
    with pytest.raises(ReadError):
        path_runs(text)


def test_both_readers_read_one_arc(tmp_path):
    arc = [["A1", "CUT_OUTER", "path", [[1, 1, 0.0], [5, 1, 0.3], [5, 4, 0.0], [1, 4, -0.1]], True]]
    sheet = {"width_mm": 9, "height_mm": 9}
    (tmp_path / "a.dxf").write_text(dxf_text(arc, sheet))
    (tmp_path / "a.svg").write_text(svg_text(arc, sheet))
    (one,), (two,) = read_dxf(tmp_path / "a.dxf").shapes, read_svg(tmp_path / "a.svg").shapes
    assert one.bulges.tolist() == pytest.approx([0.0, 0.3, 0.0, -0.1])
    assert two.bulges.tolist() == pytest.approx(one.bulges.tolist(), abs=1e-6)
    assert two.points == pytest.approx(one.points)
    # To the right of the way up from (5, 1), and inside on the way back down from (1, 4).
    dense = one.traced
    assert dense[:, 0].max() == pytest.approx(5.0 + 0.3 * 1.5, abs=2 * CHORDS_MM)
    assert dense[:, 0].min() == 1.0
