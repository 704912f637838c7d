"""Colours, widths, layers and lists that a maker or a machine obeys: what is spoilt is found.

The seal agrees with every spoilt folder.
"""

import re
import shutil
from pathlib import Path

import pytest
from jobs import FORMED, RINGED
from sealing import told
from slow import slow_but
from spoiling import edit_json, put, swap

from fabweave.sheet.presets import preset_named, preset_names
from fabweave.verify.read.preset import wanted_preset
from fabweave.verify.report import Tally

SVG, DXF = "sheets/sheet_01.svg", "sheets/sheet_01.dxf"
#: In the specimen: the stroke of each layer, and its width.
LETTER, MARK, HOLE, OUTLINE, NOTE = (
    f'stroke="{colour}"' for colour in ("#112233", "#000000", "#0000FF", "#FF0000", "#00FF00")
)
WIDTH = 'stroke-width="0.05"'


def every(old, new):
    """Return an edit of all that matches, which there must be."""

    def edit(text):
        assert old in text, old
        return text.replace(old, new)

    return edit


def layer(name, old, new):
    """Return an edit of the entry of a layer in DXF."""

    def edit(text):
        begin = text.index(f"LAYER\n  2\n{name}\n")
        end = text.index("  0\n", begin)
        return text[:begin] + swap(old, new)(text[begin:end]) + text[end:]

    return edit


def once_more(name, index):
    """Return an edit that states a layer again, with another colour."""
    entry = f"  0\nLAYER\n  2\n{name}\n 70\n0\n 62\n{index}\n  6\nContinuous\n370\n0\n"
    return swap("  0\nENDTAB\n", f"{entry}  0\nENDTAB\n")


def without_layer(text):
    return re.sub(r"  0\nLAYER\n  2\nCUT_OUTER\n.*?(?=  0\n)", "", text, count=1, flags=re.DOTALL)


def engraved_as_outline(text):
    """Put the first letters on the layer that is cut."""
    return swap("  8\nENGRAVE_LABEL\n", "  8\nCUT_OUTER\n")(text)


OF_SVG = {
    "outlines in the engraver's black": (every(OUTLINE, MARK), "colours"),
    "one outline in black": (swap(OUTLINE, MARK), "colours"),
    "letters in the cutter's red": (every(LETTER, OUTLINE), "colours"),
    "one letter in red": (swap(LETTER, OUTLINE), "colours"),
    "holes in red": (every(HOLE, OUTLINE), "colours"),
    "notes in red": (every(NOTE, OUTLINE), "colours"),
    "ticks in blue": (every(MARK, HOLE), "colours"),
    "a colour by its name": (swap(OUTLINE, 'stroke="red"'), "colours"),
    "no stroke": (every(OUTLINE, 'stroke="none"'), "colours"),
    "no word of a stroke": (swap(OUTLINE, ""), "colours"),
    "lines of 5 mm": (every(WIDTH, 'stroke-width="5"'), "colours"),
    "one line of 5 mm": (swap(WIDTH, 'stroke-width="5"'), "colours"),
    "lines of no width": (swap(WIDTH, 'stroke-width="0"'), "colours"),
    "no word of a width": (swap(WIDTH, ""), "colours"),
    "a width in pixels": (swap(WIDTH, 'stroke-width="0.05px"'), "colours"),
    "a width that is no number": (swap(WIDTH, 'stroke-width="nan"'), "colours"),
    "a wide note": (swap(f"{NOTE} {WIDTH}", f'{NOTE} stroke-width="5"'), "colours"),
    "a style of a layer": (swap("<g id", '<g style="display:none" id'), "outlines-svg"),
    "a colour of a layer": (swap("<g id", '<g stroke="#000000" id'), "outlines-svg"),
    "a hidden drawing": (swap("<svg ", '<svg display="none" '), "outlines-svg"),
    "a layer under another id": (swap('<g id="CUT_OUTER"', '<g id="NOTES"'), "outlines-svg"),
}  # fmt: skip
OF_DXF = {
    "outlines in black": (layer("CUT_OUTER", " 62\n1\n", " 62\n7\n"), "colours"),
    "outlines in exact black": (layer("CUT_OUTER", f"420\n{0xFF0000}", "420\n0"), "colours"),
    "no exact colour": (layer("CUT_OUTER", f"420\n{0xFF0000}\n", ""), "colours"),
    "letters in red": (layer("ENGRAVE_LABEL", " 62\n8\n", " 62\n1\n"), "colours"),
    "notes in exact red": (layer("NOTES", f"420\n{0x00FF00}", f"420\n{0xFF0000}"), "colours"),
    "two colours": (layer("CUT_OUTER", " 62\n1\n", " 62\n1\n 62\n7\n"), "colours"),
    "a layer that is off": (layer("CUT_OUTER", " 62\n1\n", " 62\n-1\n"), "colours"),
    "wide lines": (layer("CUT_OUTER", "370\n0\n", "370\n211\n"), "colours"),
    "dashes": (layer("CUT_OUTER", "Continuous", "DASHED"), "colours"),
    "a transparent layer": (layer("CUT_OUTER", "370\n0\n", "370\n0\n440\n9\n"), "colours"),
    "a layer that is not stated": (without_layer, "colours"),
    "a layer that is stated again": (once_more("CUT_OUTER", 7), "colours"),
    "a strange layer": (once_more("CUT", 1), "colours"),
    "another version": (swap("AC1024", "AC1015"), "colours"),
    "letters that are notes": (swap("  8\nENGRAVE_LABEL\n", "  8\nNOTES\n"), "outlines-dxf"),
    "letters that are cut": (engraved_as_outline, "outlines-dxf"),
}  # fmt: skip
OF_TABLES = {
    "pieces.csv": [every("A1,A,1,", "A1,A,2,"), every("\nA2,", "\nA9,")],
    "stations.csv": [swap("over", "under"), lambda text: text[: text.rindex("\n", 0, -1) + 1]],
    "crossing_map.csv": [swap("2.0", "3.0"), lambda text: re.sub("(?m)^100,", "101,", text)],
}
SETTINGS = {
    "another preset": swap("[job.preset]", '[job]\npreset = "trotec"\n[strange]'),
    "no preset": lambda text: text.partition("[job.preset]")[0],
    "a preset that nobody knows": swap("[job.preset]", '[job]\npreset = "glow"\n[strange]'),
    "another colour": swap("#FF0000", "#FE0000"),
    "notes in the colour of cuts": swap("#00FF00", "#FF0000"),
    "another width": swap("hairline_mm = 0.05", "hairline_mm = 0.06"),
    "no lines to any machine": swap("hairline_mm = 0.05", "hairline_mm = 5.0"),
    "a layer less": lambda text: re.sub("(?m)^NOTES.*$", "", text),
    "another version": lambda text: f'{text}[job]\ndxf = "R12"\n',
    "another unit": lambda text: f'{text}[job]\nsvg_units = "px96"\n',
    "another profile": lambda text: f'{text}[job]\nprofile = "service"\n',
}
MAPS = [
    put("cut", "layers", 3, "colour", "#000000"),
    put("cut", "layers", 3, "aci", 7),
    put("cut", "layers", lambda layers: layers[:4]),
    put("cut", "hairline_mm", 5.0),
    put("cut", "preset", "lightburn"),
    put("cut", "dxf", "R2000"),
    put("cut", "svg_units", "px96"),
]


def edited(path, change):
    text = path.read_text("utf-8")
    new = change(text)
    assert new != text
    path.write_text(new, "utf-8", newline="\n")


def found_in(folder, name, check):
    """Return what a check finds, which names the file."""
    found = told(folder)
    assert check in found, found
    assert Path(name).name in str(found[check]), found
    return found


@pytest.mark.parametrize(
    ("name", "change", "check"),
    slow_but(
        (
            pytest.param(name, *row, id=f"{name[-3:]}-{what}")
            for name, rows in ((SVG, OF_SVG), (DXF, OF_DXF))
            for what, row in rows.items()
        ),
        every=3,
    ),
)
def test_a_spoilt_drawing_is_found(job, name, change, check):
    folder = job("octahedron")
    edited(folder / name, change)
    found_in(folder, name, check)


@pytest.mark.parametrize("change", SETTINGS.values(), ids=SETTINGS)
def test_settings_at_odds_with_the_drawings_are_found(job, change):
    folder = job("octahedron")
    edited(folder / "job.toml", change)
    assert "colours" in told(folder)


@pytest.mark.parametrize("change", MAPS, ids=lambda change: change.__name__)
def test_a_map_at_odds_with_the_settings_is_found(job, change):
    folder = job("octahedron")
    edit_json(folder / "crossing_map.json", change)
    assert set(told(folder)) == {"colours"}


@pytest.mark.parametrize("name", OF_TABLES)
def test_a_table_that_is_gone_or_spoilt_is_found(job, name):
    folder = job("octahedron")
    for change in OF_TABLES[name]:
        kept = (folder / name).read_bytes()
        edited(folder / name, change)
        assert set(found_in(folder, name, "tables")) == {"tables"}
        (folder / name).write_bytes(kept)
    (folder / name).unlink()
    assert set(found_in(folder, name, "tables")) == {"files", "tables"}


@pytest.mark.parametrize("name", ["waste.json", "preflight.json", "verdict.json"])
def test_what_every_plan_has_is_missed(job, name):
    folder = job("octahedron")
    (folder / name).unlink()
    assert set(found_in(folder, name, "files")) == {"files"}


def test_a_drawing_where_none_belongs_is_found(job):
    folder = job("octahedron")
    (folder / "more").mkdir()
    shutil.copy(folder / SVG, folder / "more" / "extra.svg")
    assert set(found_in(folder, "extra.svg", "files")) == {"files"}


# --- what only some jobs have -------------------------------------------------------------------

#: Straight strips in rows, with kerf, for a service, with offcuts: nearly all lists there are.
STRIPS = (
    "shape:octahedron", "--strips", "straight", "--size", "250mm", "--sheet", "900x160mm",
    "--kerf", "0.2mm", "--profile", "service", "--preset", "trotec", "--effort", "quick",
    "--template", "none", "--sticks", "none",
)  # fmt: skip


def one_of(folder, pattern):
    """Return the first file of a pattern."""
    return sorted(folder.glob(pattern))[0]


def layers_turned_round(text):
    groups = re.findall(r"<g id.*?</g>\n", text, re.DOTALL)
    return text.replace("".join(groups), "".join(reversed(groups)))


def entities_turned_round(text):
    """Cut what comes last in a DXF file first."""
    head, mark, rest = text.partition("  2\nENTITIES\n")
    body, end, tail = rest.partition("  0\nENDSEC\n")
    entities = re.split(r"(?m)^(?=  0\n[A-Z])", body)
    return head + mark + "".join(reversed(entities)) + end + tail


#: Pieces that share no cuts.
KERFED = (
    "shape:octahedron", "--size", "200mm", "--kerf", "0.2mm", "--effort", "quick", "--template",
    "none",
)  # fmt: skip

BLACK, RED, BLUE = 'stroke="#000000"', 'stroke="#FF0000"', 'stroke="#0000FF"'
ELSEWHERE = [
    ("cut/*.svg", every(BLUE, BLACK), "colours"),
    ("cut/*.svg", every('stroke-width="0.025"', 'stroke-width="5"'), "colours"),
    ("cut/*.dxf", every("CUT_OUTER\n 70\n0\n 62\n5\n", "CUT_OUTER\n 70\n0\n 62\n7\n"), "colours"),
    ("service/*/*.svg", every(BLUE, RED), "colours"),
    ("service/*/*.svg", every('stroke-width="0.025"', 'stroke-width="1"'), "colours"),
    ("service/*/*.dxf", swap("  2\n0\n 70\n0\n 62\n7\n", "  2\n0\n 70\n0\n 62\n1\n"), "colours"),
    ("offcuts/*.dxf", every("NOTES\n 70\n0\n 62\n2\n", "NOTES\n 70\n0\n 62\n1\n"), "colours"),
    ("offcuts/stock.toml", swap("offcut_01.dxf", "offcut_02.dxf"), "offcuts"),
    ("offcuts/stock.toml", swap('material = "', 'material = "not-'), "offcuts"),
    ("offcuts/stock.toml", None, "offcuts"),
]


@pytest.fixture(scope="module")
def strips(finished):
    folder = finished(*STRIPS)
    assert told(folder) == {}
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(("pattern", "change", "check"), ELSEWHERE)
def test_spoilt_files_of_other_kinds_are_found(strips, tmp_path, pattern, change, check):
    folder = shutil.copytree(strips, tmp_path / "job")
    path = one_of(folder, pattern)
    if change is None:
        path.unlink()
    else:
        edited(path, change)
    # A service's drawings are told by the names of their DXF files.
    found_in(folder, path.name.replace(".svg", "") if check == "service" else path.name, check)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "change"),
    [("cut/*.svg", layers_turned_round), ("cut/*.dxf", entities_turned_round)],
)
def test_sheets_to_cut_keep_the_order_of_cutting(finished, pattern, change, tmp_path):
    folder = shutil.copytree(finished(*KERFED), tmp_path / "job")
    path = one_of(folder, pattern)
    edited(path, change)
    found_in(folder, path.name, "order")


def test_every_preset_is_known_to_the_proof_as_it_is():
    for name in preset_names():
        shipped = preset_named(name)
        wanted = wanted_preset({"preset": name}, Tally("colours").at("job.toml"))
        colours = {layer.value: (one.colour, one.aci) for layer, one in shipped.colours.items()}
        assert (wanted.name, wanted.colours) == (name, colours)
        assert wanted.line_mm == shipped.hairline_mm


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "pattern"), [(RINGED, "rim/*.svg"), (FORMED, "former/*.svg")], ids=["rim", "former"]
)
def test_spoilt_sheets_beside_those_of_pieces_are_found(finished, tmp_path, words, pattern):
    folder = finished.copy(tmp_path / "job", *words)
    path = one_of(folder, pattern)
    true = path.read_text("utf-8")
    for check, change in (
        ("colours", every(RED, BLACK)),
        (path.parent.name, swap(RED, f'{RED} opacity="0"')),
    ):
        path.write_text(change(true), "utf-8")
        found_in(folder, path.stem, check)
    path.write_text(true, "utf-8")
    shutil.copy(path, path.with_name("more.svg"))
    found_in(folder, "more.svg", "files")
    path.with_name("more.svg").unlink()
    path.with_name(f"{path.parent.name}.txt").unlink()
    found_in(folder, f"{path.parent.name}.txt", "files")
