"""The viewer as a file: what is in it, whence, and where the strips are."""

import re
from pathlib import Path

import numpy as np
import pytest
import shapely
from read_viewer import read_viewer
from viewer_scene import make_page, page_data, triangles_of

import fabweave
from fabweave.show.bundle import bundled
from fabweave.show.viewer.page import space_record, viewer_page

PACKAGE = Path(fabweave.__file__).parent
#: A module of a script: its name, and what is in it.
MODULE = r'^modules\["([^"]*)"\] = \(\(\) => \{$(.*?)^\}\)\(\);$'
SCRIPTS = PACKAGE / "show" / "scripts"


@pytest.fixture(scope="module")
def torus():
    return make_page("shape:torus?m=8&n=4", 300.0)


def test_three_has_what_the_pages_use_and_its_licence(torus):
    licence, bundle = (SCRIPTS / "three.js").read_text("utf-8").split("*/", 1)
    assert "Permission is hereby granted" in licence
    assert licence in torus[0]
    assert "</script" not in bundle
    ours = [path.read_text("utf-8") for path in PACKAGE.rglob("*.js") if path.name != "three.js"]
    used = {name for text in ours for name in re.findall(r"\bTHREE\.(\w+)", text)}
    assert len(used) > 30
    assert used == set(re.findall(r"^export const (\w+) = THREE\.\1;$", bundle, re.MULTILINE))


def test_pages_hold_all_scripts_each_after_those_that_it_imports():
    pages = ("viewer/viewer_page/page.js", "studio.js", "widget.js")
    entries = ["show/" + pages[0], *("studio/page/" + name for name in pages[1:])]
    held = set()
    for entry in entries:
        script, made = bundled(entry), set()
        for name, body in re.findall(MODULE, script, re.DOTALL | re.MULTILINE):
            assert name not in made
            assert set(re.findall(r'= modules\["(.*?)"\];$', body, re.MULTILINE)) <= made
            made.add(name)
        assert name == entry
        held |= made
    assert held == {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.js")}


def space_of(job):
    return space_record(job.woven.ribbons, job.weave, job.piece_set.pieces, layer_mm=0.4)


def black(job):
    return np.zeros((sum(space_of(job).counts), 3), np.uint8)


def test_the_page_holds_the_map_to_a_thousandth(torus):
    page, crossing_map, _ = torus
    held = page_data(page)["plan"]

    def same(a, b):
        if isinstance(b, dict):
            return a.keys() == b.keys() and all(same(a[key], b[key]) for key in b)
        if isinstance(b, list):
            return len(a) == len(b) and all(map(same, a, b))
        return abs(a - b) <= 5.01e-4 if isinstance(b, float) else a == b and type(a) is type(b)

    assert same(held, crossing_map.to_json())


def test_titles_cannot_break_out(torus):
    _, crossing_map, job = torus
    space = space_of(job)
    colours = black(job)
    evil = "</script><script>alert(1)</script>{{DATA}}\u2028&amp;"
    page = viewer_page(crossing_map, space, title=evil, colours=colours, view_deg=(0, 0), hands={})
    assert page.count("<script") == torus[0].count("<script")
    assert page_data(page)["title"] == evil
    assert "&lt;/script&gt;&lt;script&gt;alert(1)&lt;/script&gt;{{DATA}}" in page


@pytest.mark.slow
def test_same_job_same_page_other_job_other_memory(torus):
    page, crossing_map, job = torus
    again = make_page("shape:torus?m=8&n=4", 300.0)[0]
    assert again == page
    other = make_page("shape:torus?m=8&n=4", 310.0)[0]
    assert page_data(other)["job"] != page_data(page)["job"]
    told, space = page_data(page)["colours"], page_data(page)["space"]
    assert [sum(count for _, count in runs) for runs in told] == space["counts"]
    # Warp and weft are told apart by their bunches: every piece has one colour.
    assert [[word for word, _ in runs] for runs in told] == [
        ["#" + bytes(colour).hex()] for colour in job.piece_colours
    ]
    assert len(crossing_map.pieces) == len(told)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "settings"),
    [
        ("shape:torus?m=8&n=4", {}),
        ("shape:octahedron", {}),
        ("shape:hypar", {}),
        ("shape:hypar", {"boundary": "turn"}),
        ("shape:tetrahedron", {"max_length_mm": 5000.0}),
    ],
)
def test_strips_are_the_pieces_in_space(tmp_path, shape, settings):
    """Lengths between stations, widths and crossings: the flat piece and the strip agree."""
    page, _, job = make_page(shape, 300.0, **settings)
    made, woven = job.piece_set, job.woven
    path = tmp_path / "assembly.html"
    path.write_text(page, encoding="utf-8")
    read = read_viewer(path)
    ribbons = woven.ribbons
    corners, owner = triangles_of(read)
    piece_number = {piece.id: number for number, piece in enumerate(made.pieces)}
    first = 0
    for piece, count, panels in zip(made.pieces, read.counts, read.panels, strict=True):
        rungs = read.rungs[first : first + count]
        first += count
        middle = (rungs[panels] + rungs[panels + 1]).mean(axis=1) / 2
        # Each station's panel lies at its crossing, half a layer out or in.
        away = middle - ribbons.centre[piece.crossings]
        height = np.einsum("ij,ij->i", away, ribbons.normal[piece.crossings])
        assert np.all((height > 0) == piece.over)
        assert np.abs(height).max() < 1.0
        # Width abreast of a station is that of the flat piece.
        wide = np.linalg.norm(
            (rungs[panels, 0] + rungs[panels + 1, 0]) / 2
            - (rungs[panels, 1] + rungs[panels + 1, 1]) / 2,
            axis=1,
        )
        flat = np.linalg.norm(piece.rails[:, 0] - piece.rails[:, 1], axis=1)
        np.testing.assert_allclose(wide, flat, atol=0.03)
        # The strip is not stretched: its area is that of the flat outline.
        own = owner == piece_number[piece.id]
        u, v = corners[own, 1] - corners[own, 0], corners[own, 2] - corners[own, 0]
        area = np.linalg.norm(np.cross(u, v), axis=1).sum() / 2
        assert area == pytest.approx(shapely.Polygon(piece.outline).area, rel=2e-3)
        # Open ends belong to the piece: nothing of the thread is lost.
        if piece.start_joint is None:
            assert panels[0] > 0
        else:
            assert panels[0] == 0
        assert (panels[-1] + 1 == count - 1) == (piece.end_joint is not None)
    assert first == len(read.rungs)
    total = sum(len(piece.crossings) for piece in made.pieces)
    assert sum(len(panel) for panel in read.panels) == total
