"""Whatever may be drawn otherwise than coordinates say is found: programs obey much else."""

import json
import re
import struct

import pytest
from jobs import OCTAHEDRON
from sealing import verify_job

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.glb import read_model
from fabweave.verify.read.svg import read_svg


@pytest.fixture(scope="module")
def sheet(finished):
    return finished(*OCTAHEDRON) / "sheets" / "sheet_01.dxf"


def problems(read, path, text):
    """Return what is said of a file, whether it can be read or not."""
    path.write_text(text, encoding="utf-8")
    try:
        return list(read(path).problems)
    except ReadError as error:
        return [str(error)]


def after(first, more):
    """Put something after the first place where a text is."""

    def edit(text):
        assert first in text, first
        return text.replace(first, first + more, 1)

    return edit


def swap(first, other):
    def edit(text):
        assert first in text, first
        return text.replace(first, other, 1)

    return edit


def drawn(first, other):
    """Change the first place among the entities where a text is."""
    return lambda text: "\nENTITIES\n".join(
        [*text.split("\nENTITIES\n")[:1], swap(first, other)(text.split("\nENTITIES\n")[1])]
    )


def layer(name, before, now):
    """Change a group of a layer's entry in the table of layers."""

    def edit(text):
        at = text.index(f"\n  2\n{name}\n")
        end = text.index("\n  0\n", at + 1)
        entry = text[at:end]
        assert before in entry, entry
        return text[:at] + entry.replace(before, now, 1) + text[end:]

    return edit


def groups(kind, more):
    """Give the first entity of a kind more groups, before its own coordinates."""

    def edit(text):
        found = re.search(rf"\n  0\n{kind}\n(?:  5\n\w+\n)?", text[text.index("\nENTITIES\n") :])
        at = text.index("\nENTITIES\n") + found.end()
        return text[:at] + more + text[at:]

    return edit


BLOCK = ("  0\nBLOCK\n  8\n0\n  2\n{0}\n 70\n0\n 10\n0.0\n 20\n0.0\n 30\n0.0\n  3\n{0}\n"
         "  0\n{1}  0\nENDBLK\n  8\n0\n")  # fmt: skip
LINE = "LINE\n  8\nCUT_OUTER\n 10\n1.0\n 20\n1.0\n 11\n9.0\n 21\n9.0\n"

#: By class, and the words that the finding has to have.
DXF = {
    # What an entity has beside its place.
    "an invisible hole": (groups("CIRCLE", " 60\n1\n"), "invisible"),
    "a line type": (groups("CIRCLE", "  6\nDASHED\n"), "a line type"),
    "a line type of its layer": (groups("CIRCLE", "  6\nByLayer\n"), "a line type"),
    "a line type scale": (groups("LINE", " 48\n9.0\n"), "a line type scale"),
    "a thickness": (groups("CIRCLE", " 39\n5.0\n"), "a thickness"),
    "a line width": (groups("CIRCLE", "370\n200\n"), "a line width"),
    "a transparency": (groups("CIRCLE", "440\n33554687\n"), "a transparency"),
    "a colour": (groups("LWPOLYLINE", " 62\n3\n"), "a colour of its own"),
    "an exact colour": (groups("LWPOLYLINE", "420\n255\n"), "a colour of its own"),
    "a mirrored extrusion": (groups("CIRCLE", "210\n0.0\n220\n0.0\n230\n-1.0\n"), "extrusion"),
    "a slanted extrusion": (groups("CIRCLE", "210\n0.6\n220\n0.0\n230\n0.8\n"), "extrusion"),
    "a usual extrusion": (groups("CIRCLE", "210\n0.0\n220\n0.0\n230\n1.0\n"), "extrusion"),
    "an elevation": (groups("LWPOLYLINE", " 38\n3.0\n"), "an elevation"),
    "a height": (swap(" 30\n0.0\n 40\n", " 30\n7.0\n 40\n"), "a height above the sheet"),
    "a width": (drawn(" 43\n0.0", " 43\n2.5"), "a width"),
    "a width at a corner": (groups("LWPOLYLINE", " 41\n2.5\n"), "a width"),
    "paper space": (groups("LWPOLYLINE", " 67\n1\n"), "paper space"),
    "a strange group": (groups("LINE", "284\n1\n"), "a group 284"),
    "two layers": (groups("CIRCLE", "  8\nNOTES\n"), "group 8 twice"),
    "two radii": (swap(" 30\n0.0\n 40\n", " 30\n0.0\n 40\n9.0\n 40\n"), "group 40 twice"),
    "curve flags": (swap(" 70\n1\n 43", " 70\n129\n 43"), "flags that are not open or closed"),
    "a wrong count": (drawn(" 90\n", " 90\n1"), "another number of corners"),
    # What a layer hides.
    "a frozen layer": (layer("CUT_INNER", " 70\n0", " 70\n1"), "has flags 1"),
    "a locked layer": (layer("CUT_OUTER", " 70\n0", " 70\n4"), "has flags 4"),
    "a layer from elsewhere": (layer("CUT_OUTER", " 70\n0", " 70\n16"), "has flags 16"),
    "a layer switched off": (layer("CUT_INNER", " 62\n", " 62\n-"), "switched off"),
    "a layer not plotted": (layer("CUT_INNER", " 70\n0", " 70\n0\n290\n0"), "a plot flag 0"),
    "a dashed layer": (layer("CUT_INNER", "Continuous", "DASHED"), "line type DASHED"),
    "a wide layer": (layer("CUT_INNER", "370\n0", "370\n200"), "line width 200"),
    "a layer twice": (
        after("  0\nLAYER\n", "  2\ncut_inner\n 70\n0\n 62\n5\n  6\nContinuous\n  0\nLAYER\n"),
        "2 layers called CUT_INNER",
    ),
    "dashes in the usual line type": (layer("Continuous", " 73\n0", " 73\n2"), "has dashes"),
    # What is drawn from elsewhere.
    "a block": (
        after("  2\nBLOCKS\n", BLOCK.format("part", LINE)), "block 'part' may not be there",
    ),
    "lines in the block of the drawing": (
        lambda text: re.sub(
            r"  0\nENDBLK", "  0\n" + LINE + "  0\nENDBLK", text, count=1
        ), "BLOCKS has LINE",
    ),
    "an insert": (
        drawn("  0\nLINE\n", "  0\nINSERT\n  2\n*Model_Space\n  8\nNOTES\n  0\nLINE\n"),
        "INSERT",
    ),
    "an order of drawing": (
        after("  2\nOBJECTS\n", "  0\nSORTENTSTABLE\n  5\nFFFF\n"), "OBJECTS has SORTENTSTABLE",
    ),
    "another section": (
        swap("  0\nEOF", "  0\nSECTION\n  2\nACDSDATA\n  0\nENDSEC\n  0\nEOF"),
        "section ACDSDATA may not be there",
    ),
    "comments": (after("  2\nENTITIES\n", "999\nread me\n"), "comments"),
    "a layout shown": (swap("$TILEMODE\n 70\n1", "$TILEMODE\n 70\n0"), "$TILEMODE"),
    "moved where inserted": (swap("$INSBASE\n 10\n0.0", "$INSBASE\n 10\n50.0"), "$INSBASE"),
    # What not every program reads alike.
    "two sections of entities": (
        swap("  0\nEOF", "  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF"), "two sections",
    ),
    "more after the end": (lambda text: text + "  0\nEOF\n", "goes on after EOF"),
    "blanks around a layer": (drawn("\nCUT_OUTER\n", "\nCUT_OUTER \n"), "blanks around"),
}  # fmt: skip


@pytest.mark.parametrize("name", DXF)
def test_dxf(sheet, tmp_path, name):
    edit, words = DXF[name]
    text = sheet.read_text(encoding="utf-8")
    assert problems(read_dxf, tmp_path / "a.dxf", text) == []
    said = problems(read_dxf, tmp_path / "a.dxf", edit(text))
    assert any(words in line for line in said), said


SVG = {
    "not shown": (after("<path ", 'display="none" '), "has a display"),
    "not visible": (after("<g ", 'visibility="hidden" '), "has a visibility"),
    "see-through": (after("<g ", 'opacity="0" '), "has a opacity"),
    "see-through lines": (after("<circle ", 'stroke-opacity="0" '), "has a stroke-opacity"),
    "dashes": (after("<path ", 'stroke-dasharray="1 9" '), "has a stroke-dasharray"),
    "a marker": (after("<path ", 'marker-end="url(#a)" '), "has a marker-end"),
    "a filter": (after("<g ", 'filter="url(#a)" '), "has a filter"),
    "an event": (after("<svg ", 'onload="alert(1)" '), "has a onload"),
    "sliced": (after("<svg ", 'preserveAspectRatio="xMidYMid slice" '), "has a preserveAspectR"),
    "a link": (after("<path ", 'href="#A1" '), "has a href"),
    "a vector effect": (after("<path ", 'vector-effect="non-scaling-stroke" '), "vector-effect"),
    "a path length": (after("<path ", 'pathLength="1" '), "has a pathLength"),
    "another namespace": (swap("<circle ", '<circle xmlns="http://a.b" '), "namespace"),
    "an animation": (
        swap("</title></circle>", '</title><animate attributeName="r"/></circle>'),
        "has elements in it",
    ),
    "a script": (swap("</svg>", "<script>1</script></svg>"), "is a <script>"),
    "a stylesheet": (swap("</svg>", "<style>path{display:none}</style></svg>"), "is a <style>"),
    "definitions": (swap("</svg>", "<defs><style>g{display:none}</style></defs></svg>"), "<defs>"),
    "a stylesheet elsewhere": (
        swap("<svg ", '<?xml-stylesheet href="a.css"?><svg '), "processing instruction",
    ),
    "a DOCTYPE": (
        swap("<svg ", '<!DOCTYPE svg [<!ATTLIST path display CDATA "none">]><svg '), "DOCTYPE",
    ),
    "entities": (
        swap("<svg ", '<!DOCTYPE svg [<!ENTITY a "aaa">]><svg '), "DOCTYPE",
    ),
    "a drawing in the drawing": (swap("</svg>", "<svg></svg></svg>"), "<svg>"),
    "a switch": (swap("</svg>", "<switch/></svg>"), "is a <switch>"),
    "text": (swap("</svg>", "cut this</svg>"), "has text"),
    "a group in a layer": (after('inkscape:label="CUT_INNER">', "<g/>"), "within layer"),
    "filled as usual": (swap('fill="none" ', ""), "filled with black"),
}  # fmt: skip


@pytest.mark.parametrize("name", SVG)
def test_svg(sheet, tmp_path, name):
    edit, words = SVG[name]
    text = sheet.with_suffix(".svg").read_text(encoding="utf-8")
    assert problems(read_svg, tmp_path / "a.svg", text) == []
    said = problems(read_svg, tmp_path / "a.svg", edit(text))
    assert any(words in line for line in said), said


@pytest.mark.parametrize(
    ("suffix", "edit", "check"),
    [
        (".dxf", DXF["a frozen layer"][0], "outlines-dxf"),
        (".svg", SVG["not shown"][0], "outlines-svg"),
    ],
)
def test_what_is_found_in_a_file_is_a_finding_of_the_job(finished, tmp_path, suffix, edit, check):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    path = folder / "sheets" / f"sheet_01{suffix}"
    path.write_text(edit(path.read_text(encoding="utf-8")), encoding="utf-8")
    assert verify_job(folder).failed == (check,)


def said_of(read, path, data):
    path.write_bytes(data)
    try:
        read(path)
    except ReadError as error:
        return str(error)
    return ""


def glb(edit):
    """Change the document of a GLB file."""

    def changed(data):
        size = struct.unpack_from("<I", data, 12)[0]
        document = json.loads(data[20 : 20 + size])
        edit(document)
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        rest = data[20 + size :]
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
        return head + text + rest

    return changed


MODEL = {
    "a strand that is not shown": lambda d: d["scenes"][0]["nodes"].pop(),
    "a strand shown twice": lambda d: d["scenes"][0]["nodes"].append(0),
    "another scene": lambda d: d["scenes"].append({"nodes": []}),
    "another scene shown": lambda d: (d["scenes"].append({"nodes": [0]}), d.update(scene=1)),
    "no scene shown": lambda d: d.pop("scene"),
    "a strand moved": lambda d: d["nodes"][0].update(translation=[0, 0, 1]),
    "a strand mirrored": lambda d: d["nodes"][0].update(scale=[1, 1, -1]),
    "a strand turned": lambda d: d["nodes"][0].update(rotation=[1, 0, 0, 0]),
    "a matrix": lambda d: d["nodes"][0].update(matrix=[1] * 16),
    "a node above": lambda d: d["nodes"].append({"children": [0], "mesh": 0}),
    "a skin": lambda d: d["nodes"][0].update(skin=0),
    "a mesh of another strand": lambda d: d["nodes"][0].update(mesh=1),
    "morphs": lambda d: d["meshes"][0].update(weights=[1.0]),
    "targets of morphs": lambda d: d["meshes"][0]["primitives"][0].update(targets=[{}]),
    "an animation": lambda d: d.update(animations=[{}]),
    "an extension": lambda d: d.update(extensionsUsed=["KHR_draco_mesh_compression"]),
    "extensions of a node": lambda d: d["nodes"][0].update(extensions={"KHR_node_visibility": {}}),
    "glass": lambda d: d["materials"][0].update(alphaMode="BLEND"),
    "clear paint": lambda d: d["materials"][0]["pbrMetallicRoughness"].update(
        baseColorFactor=[1.0, 1.0, 1.0, 0.0]
    ),
    "one side": lambda d: d["materials"][0].update(doubleSided=False),
    "a texture": lambda d: d["materials"][0]["pbrMetallicRoughness"].update(baseColorTexture={}),
    "data elsewhere": lambda d: d["buffers"][0].update(uri="http://a.b/c.bin"),
    "colours": lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(COLOR_0=0),
    "points": lambda d: d["meshes"][0]["primitives"][0].update(mode=0),
}  # fmt: skip


@pytest.mark.parametrize("name", MODEL)
def test_model(sheet, tmp_path, name):
    data = (sheet.parents[1] / "model.glb").read_bytes()
    assert said_of(read_model, tmp_path / "a.glb", glb(lambda _: None)(data)) == ""
    assert said_of(read_model, tmp_path / "a.glb", glb(MODEL[name])(data))
