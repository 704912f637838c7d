"""Whatever may be drawn otherwise than coordinates say is found: programs obey much else."""

import json
import re
import shutil
import struct

import pytest
from jobs import OCTAHEDRON
from pdf_edits import repaired, unpacked

from fabweave.verify import verify_job
from fabweave.verify.drawing import ReadError
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.glb import read_model
from fabweave.verify.read.manual import read_manual
from fabweave.verify.read.svg import read_svg
from fabweave.verify.read.template import read_template


@pytest.fixture(scope="module")
def tiled(finished):
    return finished(*OCTAHEDRON, "--template", "a4")


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


def put(first, other, count=1):
    def edit(data):
        assert first in data, first
        return repaired(data.replace(first, other, count))

    return edit


def without_page(data):
    """Leave a page out of the list of pages, with the right count."""
    kids = re.search(rb"/Kids \[ (\d+ 0 R) ", data)[1]
    count = int(re.search(rb"/Count (\d+) /Kids", data)[1])
    data = data.replace(b"/Kids [ " + kids, b"/Kids [")
    return repaired(data.replace(b"/Count %d /Kids" % count, b"/Count %d /Kids" % (count - 1)))


def reversed_pages(data):
    kids = re.search(rb"/Kids \[ ([^\]]*) \]", data)[1]
    pages = re.findall(rb"\d+ 0 R", kids)
    return data.replace(kids, b" ".join(reversed(pages)).ljust(len(kids)))


PDF = {
    "a page left out": (without_page, "are in its list of pages"),
    "a page turned": (put(b"/Rotate 0", b"/Rotate 90"), "a page is turned"),
    "a cropped page": (put(b"/Rotate 0", b"/CropBox [ 0 0 9 9 ] /Rotate 0"), "/CropBox"),
    "a unit": (put(b"/Rotate 0", b"/UserUnit 2 /Rotate 0"), "/UserUnit"),
    "a note on a page": (put(b"/Rotate 0", b"/Annots [ ] /Rotate 0"), "/Annots"),
    "an action": (put(b"/PageMode", b"/OpenAction 1 0 R /PageMode"), "/OpenAction"),
    "a script": (put(b"/PageMode", b"/AA << /JavaScript (x) >> /PageMode"), "/AA"),
    "print at another scale": (
        put(b"/PageMode", b"/ViewerPreferences << /PrintScaling /AppDefault >> /PageMode"),
        "/ViewerPreferences",
    ),
    "a name in disguise": (put(b"/PageMode", b"/Open#41ction 1 0 R /PageMode"), "/Open#41ction"),
    "layers": (put(b"/PageMode", b"/OCProperties << >> /PageMode"), "/OCProperties"),
    "a later version of an object": (
        lambda data: repaired(
            data.replace(b"\nxref\n", b"\n1 0 obj\n<<\n/Type /Catalog\n>>\nendobj\nxref\n", 1)
        ),
        "there twice",
    ),
    "a table that leads elsewhere": (
        lambda data: re.sub(rb"\n(\d{9})(\d) 00000 n", rb"\n\g<1>9 00000 n", data, count=3),
        "does not say where they are",
    ),
    "a later part": (lambda data: data + data[data.rindex(b"xref") - 1 :], "after its end"),
    "a page larger than itself": (put(b"/MediaBox [ 0 0", b"/MediaBox [ 9 9"), "MediaBox"),
    "text that is not drawn": (put(b"Tj T* ET", b"Tj T* ET 3 Tr"), "operator 'Tr'"),
    "a state of graphics": (put(b"Tj T* ET", b"Tj T* ET /F1 gs"), "operator 'gs'"),
    "a picture in a page": (put(b"Tj T* ET", b"Tj T* ET BI"), "operator 'BI'"),
    "a length that is untrue": (
        lambda data: re.sub(rb"/Length \d", b"/Length 1", data), "another length",
    ),
    "another end": (lambda data: data.removesuffix(b"%%EOF\n"), "not complete"),
}  # fmt: skip
TEXT = re.compile(rb"1 0 0 1 ([\d.]+) ([\d.]+) Tm")
MANUAL = {
    "text beyond the page": (
        lambda data: repaired(TEXT.sub(rb"1 0 0 1 -99 \2 Tm", data, count=1)),
        "beyond its page",
    ),
    "small text": (put(b"/F1 9.5 Tf", b"/F1 .95 Tf"), "too small"),
    "mirrored text": (
        lambda data: repaired(TEXT.sub(rb"-1 0 0 1 \1 \2 Tm", data, count=1)),
        "mirrored",
    ),
}  # fmt: skip
TEMPLATE = {
    "white lines": (put(b".25 G", b"1 G"), "too light"),
    "thin lines": (put(b".510236 w", b".01 w"), "too thin"),
    "a smaller sheet": (put(b"/Matrix [ 1 0 0 1 0 0 ]", b"/Matrix [ .9 0 0 .9 0 0 ]"), "a form is"),
    "a smaller sheet on a page": (put(b"/FormXob.sheet Do", b".9 0 0 .9 0 0 cm /FormXob.sheet Do"),
                                  "scaled or turned"),
    "the sheet twice": (put(b"/FormXob.sheet Do", b"/FormXob.sheet Do /FormXob.sheet Do"),
                        "2 times"),
    "a cover": (put(b"/FormXob.sheet Do", b"/FormXob.sheet Do 0 0 999 999 re f"), "operator f"),
    "dashes": (put(b"1 j\n", b"[1 9] 0 d 1 j\n"), "operator d"),
}  # fmt: skip


def said_of(read, path, data):
    path.write_bytes(data)
    try:
        read(path)
    except ReadError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", {**PDF, **MANUAL})
def test_manual(sheet, tmp_path, name):
    edit, words = {**PDF, **MANUAL}[name]
    data = unpacked((sheet.parents[1] / "assembly.pdf").read_bytes())
    assert said_of(read_manual, tmp_path / "a.pdf", data) == ""
    assert words in said_of(read_manual, tmp_path / "a.pdf", edit(data))


@pytest.mark.parametrize("name", {**PDF, **TEMPLATE})
def test_sheet_at_full_size(tiled, tmp_path, name):
    edit, words = {**PDF, **TEMPLATE}[name]
    data = unpacked((tiled / "sheets" / "sheet_01.pdf").read_bytes())
    assert said_of(read_template, tmp_path / "a.pdf", data) == ""
    assert words in said_of(read_template, tmp_path / "a.pdf", edit(data))


def test_pages_of_the_manual_in_another_order_are_found(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    path = folder / "assembly.pdf"
    path.write_bytes(reversed_pages(path.read_bytes()))
    # The viewer shows each step as the manual does: now it does not.
    assert verify_job(folder).failed == ("viewer", "manual")


def test_a_window_that_hides_a_part_of_the_sheet_is_found(tiled, tmp_path):
    folder = tmp_path / "job"
    shutil.copytree(tiled, folder)
    path = folder / "sheets" / "sheet_01.pdf"
    data = unpacked(path.read_bytes())
    window = re.search(rb"([\d.]+ [\d.]+) [\d.]+ [\d.]+ re(?=\s+W)", data)
    path.write_bytes(put(window[0], window[1] + b" 9 9 re")(data))
    assert verify_job(folder).failed == ("templates",)


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
