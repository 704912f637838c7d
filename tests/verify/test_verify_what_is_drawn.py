"""Whatever may be drawn otherwise than coordinates say is found: programs obey much else."""

import json
import re
import struct

import pytest
from jobs import OCTAHEDRON
from sealing import verify_job
from spoiling import swap

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
    return swap(first, first + more)


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


LINE = "LINE\n  8\nCUT_OUTER\n 10\n1.0\n 20\n1.0\n 11\n9.0\n 21\n9.0\n"

#: What is done, and a word that the finding has to have.
DXF = {
    # What an entity has beside its place.
    "invisible": (groups("CIRCLE", " 60\n1\n"), "group 60"),
    "a line width": (groups("CIRCLE", "370\n200\n"), "group 370"),
    "a colour": (groups("LWPOLYLINE", " 62\n3\n"), "group 62"),
    "dashes": (groups("CIRCLE", "  6\nDASHED\n"), "group 6"),
    "a line type with dashes": (
        swap("  0\nENDTAB\n", "  0\nLTYPE\n  2\nCONTINUOUS\n 73\n2\n  0\nENDTAB\n"), "",
    ),
    "an extrusion": (groups("CIRCLE", "210\n0.0\n220\n0.0\n230\n-1.0\n"), "group 230"),
    "an elevation": (groups("LWPOLYLINE", " 38\n3.0\n"), "group 38"),
    "a height": (swap(" 30\n0.0\n 40\n", " 30\n7.0\n 40\n"), "a height"),
    "a width": (drawn(" 43\n0.0", " 43\n2.5"), "a width"),
    "paper space": (groups("LWPOLYLINE", " 67\n1\n"), "group 67"),
    "curve flags": (swap(" 70\n1\n 43", " 70\n129\n 43"), "flags"),
    "a wide corner": (groups("LWPOLYLINE", " 40\n2.5\n"), "radius"),
    # What a layer hides.
    "a frozen layer": (layer("CUT_INNER", " 70\n0", " 70\n1"), "frozen"),
    "a layer switched off": (layer("CUT_INNER", " 62\n", " 62\n-"), "switched off"),
    "a layer not plotted": (layer("CUT_INNER", " 70\n0", " 70\n0\n290\n0"), "not plotted"),
    # What is drawn from elsewhere.
    "lines in a block": (
        lambda text: re.sub(r"  0\nENDBLK", "  0\n" + LINE + "  0\nENDBLK", text, count=1),
        "BLOCKS has LINE",
    ),
    "an insert": (
        drawn("  0\nLINE\n", "  0\nINSERT\n  2\n*Model_Space\n  8\nNOTES\n  0\nLINE\n"),
        "INSERT",
    ),
    "two sections of entities": (
        swap("  0\nEOF", "  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF"), "two called",
    ),
    "coordinates in disorder": (groups("CIRCLE", " 20\n1.0\n"), "pairs"),
}  # fmt: skip


SVG = {
    "not shown": (after("<path ", 'display="none" '), "has a display"),
    "see-through lines": (after("<circle ", 'stroke-opacity="0" '), "has a stroke-opacity"),
    "dashes": (after("<path ", 'stroke-dasharray="1 9" '), "has a stroke-dasharray"),
    "sliced": (after("<svg ", 'preserveAspectRatio="xMidYMid slice" '), "has a preserveAspectR"),
    "another namespace": (swap("<circle ", '<circle xmlns="http://a.b" '), "may not be in"),
    "an animation": (
        swap("</title></circle>", '</title><animate attributeName="r"/></circle>'),
        "has elements in it",
    ),
    "a style sheet beside it": (swap("<svg ", '<?xml-stylesheet href="a.css"?>\n<svg '), ""),
    "a document type": (swap("<svg ", '<!DOCTYPE svg [<!ATTLIST title a CDATA "b">]>\n<svg '), ""),
    "a stylesheet": (swap("</svg>", "<style>path{display:none}</style></svg>"), "a <style>"),
    "a drawing in the drawing": (swap("</svg>", "<svg></svg></svg>"), "a <svg>"),
    "text": (swap("</svg>", "<text>cut this</text></svg>"), "a <text>"),
    "a group in a layer": (after('inkscape:label="CUT_INNER">', "<g/>"), "within one"),
    "filled as usual": (swap('fill="none" ', ""), "filled with black"),
}  # fmt: skip


@pytest.mark.parametrize(
    ("read", "name"), [(read_dxf, name) for name in DXF] + [(read_svg, name) for name in SVG]
)
def test_what_is_drawn_otherwise_is_found(sheet, tmp_path, read, name):
    edit, words = (DXF if read is read_dxf else SVG)[name]
    suffix = f".{read.__name__[-3:]}"
    text = sheet.with_suffix(suffix).read_text(encoding="utf-8")
    assert problems(read, tmp_path / f"a{suffix}", text) == []
    said = problems(read, tmp_path / f"a{suffix}", edit(text))
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
    "a strand moved": lambda d: d["nodes"][0].update(translation=[0, 0, 1]),
    "a matrix": lambda d: d["nodes"][0].update(matrix=[1] * 16),
    "a skin": lambda d: d["nodes"][0].update(skin=0),
    "points": lambda d: d["meshes"][0]["primitives"][0].update(mode=0),
}


@pytest.mark.parametrize("name", MODEL)
def test_model(sheet, tmp_path, name):
    data = (sheet.parents[1] / "model.glb").read_bytes()
    assert said_of(read_model, tmp_path / "a.glb", glb(lambda _: None)(data)) == ""
    assert said_of(read_model, tmp_path / "a.glb", glb(MODEL[name])(data))
