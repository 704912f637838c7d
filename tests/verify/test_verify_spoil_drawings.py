"""Spoil the sheets' drawings: the checks that must object do, and no other."""

import re

import pytest
from sealing import told
from slow import slow_but
from spoiling import swap
from verify_writers import dxf_text, sheet_shapes, svg_text

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg

# --- shapes -------------------------------------------------------------------------------------


def index(shapes, layer, nth=0):
    return [k for k, shape in enumerate(shapes) if shape[1] == layer][nth]


def changed(shapes, k, **parts):
    """Replace parts of one shape."""
    names = ("piece", "layer", "kind", "data", "closed")
    result = list(shapes)
    result[k] = tuple(parts.get(name, value) for name, value in zip(names, shapes[k], strict=True))
    return result


def first_to(layer, place):
    """Return an edit that moves the first shape of a layer to the first place, or before holes."""

    def edit(shapes):
        rest = list(shapes)
        one = rest.pop(index(shapes, layer))
        rest.insert(place(shapes), one)
        return rest

    return edit


def engraving_last(shapes):
    k = index(shapes, "CUT_OUTER")
    return [*shapes[1 : k + 1], shapes[0], *shapes[k + 1 :]]


def engraving_of_all_first(shapes):
    return sorted(shapes, key=lambda s: not s[1].startswith("ENGRAVE"))


def note_amid_a_piece(shapes):
    return [shapes[0], shapes[-1], *shapes[1:-1]]


def notes_first(shapes):
    return sorted(shapes, key=lambda s: s[1] != "NOTES")


def circle(**by):
    """Return an edit of the first hole."""

    def edit(shapes):
        k = index(shapes, "CUT_INNER")
        x, y, r = shapes[k][3]
        return changed(shapes, k, data=(x + by.get("x", 0.0), y, r + by.get("r", 0.0)))

    return edit


def leave_out(layer):
    def edit(shapes):
        k = index(shapes, layer)
        return shapes[:k] + shapes[k + 1 :]

    return edit


move_hole, leave_out_hole = circle(x=0.05), leave_out("CUT_INNER")


def draw_hole_twice_and_leave_one_out(shapes):
    a, b = index(shapes, "CUT_INNER"), index(shapes, "CUT_INNER", 1)
    return changed(shapes, b, data=shapes[a][3])


def add_hole_of_no_piece(shapes):
    return [*shapes, (None, "CUT_INNER", "circle", (30.0, 30.0, 1.0), True)]


def move_outline_vertex(shapes):
    k = index(shapes, "CUT_OUTER")
    points = [list(point) for point in shapes[k][3]]
    points[5][1] += 0.05
    return changed(shapes, k, data=points)


def add_outline_vertex(shapes):
    k = index(shapes, "CUT_OUTER")
    (x, y), (u, v) = shapes[k][3][:2]
    return changed(shapes, k, data=[shapes[k][3][0], [(x + u) / 2, (y + v) / 2], *shapes[k][3][1:]])


def leave_outline_open(shapes):
    return changed(shapes, index(shapes, "CUT_OUTER"), closed=False)


def draw_outline_twice(shapes):
    k = index(shapes, "CUT_OUTER")
    return [*shapes[: k + 1], shapes[k], *shapes[k + 1 :]]


def turn_outline_round(shapes):
    # Another start and direction cut the same.
    k = index(shapes, "CUT_OUTER")
    points = shapes[k][3][::-1]
    return changed(shapes, k, data=points[5:] + points[:5])


def exchange_names_of_outlines(shapes):
    a, b = index(shapes, "CUT_OUTER"), index(shapes, "CUT_OUTER", 1)
    return changed(changed(shapes, a, data=shapes[b][3]), b, data=shapes[a][3])


def engrave_twice(shapes):
    return [shapes[0], *shapes]


def engrave_beyond_the_outline(shapes):
    (x, y), *rest = shapes[0][3]
    shift = 80.0
    return changed(shapes, 0, data=[[a, b + shift] for a, b in [(x, y), *rest]])


def engrave_for_another_sheet(shapes):
    return changed(shapes, 0, piece="Z9")


def move_engraving(shapes):
    return changed(shapes, 0, data=[[x + 0.05, y] for x, y in shapes[0][3]])


BOTH = [
    (first_to("CUT_OUTER", lambda shapes: index(shapes, "CUT_INNER")), "order", ""),
    (first_to("CUT_INNER", lambda _: 0), "order", ""),
    (engraving_last, "order", "order outlines-svg"),
    (engraving_of_all_first, "order", ""),
    (note_amid_a_piece, "order", "order outlines-svg"),
    (notes_first, "", ""),
    (turn_outline_round, "", "outlines-svg"),
    (move_hole, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (circle(r=0.05), "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (leave_out_hole, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (draw_hole_twice_and_leave_one_out, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (add_hole_of_no_piece, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (move_outline_vertex, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (add_outline_vertex, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (leave_outline_open, "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (draw_outline_twice, "outlines-dxf outlines-svg lines", "outlines-dxf outlines-svg lines"),
    (leave_out("CUT_OUTER"), "outlines-dxf outlines-svg", "outlines-dxf outlines-svg"),
    (exchange_names_of_outlines, "outlines-dxf outlines-svg order labels", None),
    (engrave_twice, "lines", None),
    (engrave_beyond_the_outline, "order", "order outlines-svg"),
    (engrave_for_another_sheet, "outlines-dxf outlines-svg", None),
    (move_engraving, "", "outlines-svg"),
]
SVG_ALONE = [move_hole, move_outline_vertex, leave_out_hole, add_outline_vertex, move_engraving]
CASES = [
    *[(edit, "dxf svg", in_both) for edit, in_both, _ in BOTH],
    # Order is the DXF's alone.
    *[(edit, "dxf", in_dxf or in_both) for edit, in_both, in_dxf in BOTH if in_dxf is not None],
    *[(edit, "svg", "outlines-svg") for edit in SVG_ALONE],
]


@pytest.mark.parametrize(
    ("edit", "formats", "objecting"),
    slow_but(CASES, every=3),
    ids=[f"{e.__name__}-{suffix}" for e, suffix, _ in CASES],
)
def test_exactly_the_right_checks_object(specimen, job, edit, formats, objecting):
    folder, source = job("octahedron"), specimen("octahedron")
    sheet = source.plan["sheets"][0]
    shapes = edit(sheet_shapes(source, source.plan, sheet))
    for suffix in formats.split():
        text = (dxf_text if suffix == "dxf" else svg_text)(shapes, sheet)
        (folder / "sheets" / f"sheet_01.{suffix}").write_text(text)
    found = told(folder)
    assert set(found) == set(objecting.split()), found


# --- text of the files --------------------------------------------------------------------------


def bend_outline(text):
    at = text.index("CUT_OUTER\n 90")
    vertex = re.compile(r" 20\n[-0-9.]+\n").search(text, at)
    return text[: vertex.end()] + " 42\n0.5\n" + text[vertex.end() :]


def mirror_extrusion(text):
    at = text.index("CIRCLE")
    end = text.index(" 40\n", at)
    return text[:end] + "230\n-1.0\n" + text[end:]


def at_circle(old, new):
    """Return an edit of what comes from the first circle on."""

    def edit(text):
        at = text.index("CIRCLE")
        return text[:at] + swap(old, new)(text[at:])

    return edit


def leave_corners_behind(text):
    """Put a corner after an entity that has none."""
    at = text.index("  0\nCIRCLE")
    return text[:at] + "  0\nVERTEX\n  8\nCUT_OUTER\n 10\n1.0\n 20\n1.0\n" + text[at:]


DXF_EDITS = [
    (leave_corners_behind, "outlines-dxf"),
    (swap("CIRCLE\n", "CIRCLE\n 62\n1\n"), "outlines-dxf"),
    (swap("  2\nTABLES\n", ""), "files outlines-dxf outlines-svg order"),
    (swap(" 70\n1\n 10", " 70\ninf\n 10"), "files outlines-dxf outlines-svg order"),
    (swap("$INSUNITS\n 70\n4", "$INSUNITS\n 70\n1"), "outlines-dxf"),
    (swap("  9\n$INSUNITS\n 70\n4\n", ""), "outlines-dxf"),
    (swap("$MEASUREMENT\n 70\n1", "$MEASUREMENT\n 70\n0"), "outlines-dxf"),
    (bend_outline, "outlines-dxf outlines-svg"),
    (mirror_extrusion, "outlines-dxf"),
    (swap("CIRCLE\n", "CIRCLE\n 67\n1\n"), "outlines-dxf"),
    (swap("  8\nCUT_OUTER", "  8\nOUTER"), "outlines-dxf outlines-svg"),
    (swap("ENTITIES\n", "ENTITIES\n  0\nSPLINE\n  8\nCUT_OUTER\n"), "outlines-dxf"),
    (at_circle("1000\nA1", "1000\nA2"), "outlines-dxf outlines-svg order"),
    (at_circle("1001\nFABWEAVE\n1000\nA1\n", ""), "outlines-dxf outlines-svg"),
    (at_circle("1001\nFABWEAVE", "1001\nOTHER"), "outlines-dxf outlines-svg"),
    (swap("  0\nEOF\n", ""), "files outlines-dxf outlines-svg order"),
    (swap(" 62\n7", "x\n7"), "files outlines-dxf outlines-svg order"),
    (swap("CIRCLE", "CIRCLE\n 40\nnan"), "files outlines-dxf outlines-svg order"),
]


def mirror_svg(text):
    """Do not turn y: what a writer would write that forgot that y points down."""

    def path(match):
        points = [point.split(",") for point in match.group(1).rstrip("Z").split("L")]
        run = "L".join(f"{x},{400 - float(y):.4f}" for x, y in points)
        return f'd="M{run}{"Z" if match.group(1).endswith("Z") else ""}"'

    text = re.sub(r'd="M([^"]*)"', path, text)
    return re.sub(r'cy="([^"]*)"', lambda m: f'cy="{400 - float(m.group(1)):.4f}"', text)


def exchange_layers(text):
    groups = re.findall(r"<g id.*?</g>\n", text, re.DOTALL)
    assert len(groups) == 5
    return text.replace(groups[2], "@").replace(groups[3], groups[2]).replace("@", groups[3])


def scale_to_pixels(text):
    """Write 96 units an inch: as good for who reads sizes, but nobody asked for it."""
    scale = 96 / 25.4
    text = text.replace('viewBox="0 0 600 400"', f'viewBox="0 0 {600 * scale} {400 * scale}"')
    text = re.sub(
        r'd="M([^"]*)"',
        lambda m: 'd="M' + re.sub(r"[0-9.]+", lambda n: f"{float(n[0]) * scale:.6f}", m[1]) + '"',
        text,
    )
    return re.sub(r'(cx|cy|r)="([^"]*)"', lambda m: f'{m[1]}="{float(m[2]) * scale:.6f}"', text)


SVG_EDITS = [
    (mirror_svg, "outlines-svg"),
    (exchange_layers, "order"),
    # A group that is no layer.
    (swap('inkscape:groupmode="layer" inkscape:label="CUT_INNER"', ""), "outlines-svg"),
    (scale_to_pixels, "colours"),
    (swap('viewBox="0 0 600 400"', 'viewBox="0 0 300 200"'), "outlines-svg colours"),
    (swap('viewBox="0 0 600 400"', 'viewBox="0 0 600 300"'), "outlines-svg"),
    (swap('width="600mm"', 'width="610mm"'), "outlines-svg colours"),
    (swap('width="600mm"', 'width="600"'), "files outlines-svg order"),
    (swap('viewBox="0 0 600 400"', ""), "files outlines-svg order"),
    (swap("<path id", '<path transform="scale(1)" id'), "outlines-svg"),
    (swap("<g id", '<g style="opacity:1" id'), "outlines-svg"),
    (swap("<svg ", '<svg class="a" '), "outlines-svg"),
    (swap('fill="none"', 'fill="#000"'), "outlines-svg"),
    (swap('.outline"', '.outline" x="0"'), "outlines-svg"),
    (swap("<title>A1</title></circle>", "</circle>"), "outlines-svg"),
    (swap("<title>A1</title></circle>", "<title>A2</title></circle>"), "outlines-svg order"),
    (swap("</svg>", "<rect/></svg>"), "outlines-svg"),
    (swap('d="M', 'd="C1,1 2,2 3,3 M'), "files outlines-svg order"),
    (swap("</svg>", ""), "files outlines-svg order"),
    (swap('cx="', 'cx="a'), "files outlines-svg order"),
    (swap(' r="', ' r="nan" x="'), "files outlines-svg order"),
    (swap('d="M', 'd="M9,9M'), "outlines-svg order"),
    (swap('d="M', 'd="M9,9,8L9,7M'), "files outlines-svg order"),
    (swap('inkscape:label="CUT_INNER"', 'inkscape:label="HOLES"'), "outlines-svg"),
]


@pytest.mark.parametrize(
    ("suffix", "edit", "objecting"),
    slow_but(
        (
            pytest.param(suffix, *row, id=f"{suffix}-{row[0].__name__}")
            for suffix, rows in (("dxf", DXF_EDITS), ("svg", SVG_EDITS))
            for row in rows
        ),
        every=3,
    ),
)
def test_edited_text(job, suffix, edit, objecting):
    folder = job("octahedron")
    path = folder / "sheets" / f"sheet_01.{suffix}"
    path.write_text(edit(path.read_text()))
    found = told(folder)
    assert set(found) == set(objecting.split()), found


# --- readers ------------------------------------------------------------------------------------


def test_dxf_arcs_and_open_runs(tmp_path):
    path = tmp_path / "a.dxf"
    half = "0\nLWPOLYLINE\n8\nNOTES\n90\n2\n70\n0\n10\n0\n20\n0\n42\n1\n10\n2\n20\n0\n"
    path.write_text(f"0\nSECTION\n2\nENTITIES\n{half}0\nENDSEC\n0\nEOF\n")
    drawing = read_dxf(path)
    (shape,) = drawing.shapes
    # A bulge of 1 is a half circle to the right of the chord, counter-clockwise.
    assert shape.traced[:, 1].min() == pytest.approx(-1.0)
    assert shape.traced[-1] == pytest.approx([2.0, 0.0])


@pytest.mark.parametrize(
    ("read", "text"),
    [
        *[(read_dxf, text) for text in ("", "0\nEOF\n", "hello\nworld\n")],
        (read_dxf, "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n0\nEOF\n"),
        *[(read_svg, text) for text in ("", "<a/>", "<svg/>", "no xml", "<svg")],
    ],
)
def test_a_bad_drawing_is_a_read_error(tmp_path, read, text):
    path = tmp_path / "drawing"
    path.write_text(text)
    with pytest.raises(ReadError):
        read(path)
