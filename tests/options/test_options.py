"""The table of options: it fits Settings, and all that is made of it fits the table."""

import math
import shutil
import tomllib
from dataclasses import fields
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.cli.guide import options_page
from fabweave.core.errors import InputError
from fabweave.nest.layout import effort_named
from fabweave.options.machines import machine_profile
from fabweave.options.option import SECTIONS
from fabweave.options.settings import (
    Settings,
    job_toml,
    settings_from_job,
    settings_from_options,
    settings_table,
)
from fabweave.options.table import OPTIONS, option_named
from fabweave.ribbon.width import WidthRule
from fabweave.sheet.kerf import MicroJoints
from fabweave.sheet.presets import preset_named
from fabweave.sheet.write.dxf import DXF_VERSIONS
from fabweave.sheet.write.template import PAPERS_MM
from fabweave.show.sticks import PAPERS as STICK_PAPERS
from fabweave.stock.sheet_size import SheetSize

NAMES = [option.name for option in OPTIONS]
GROUPED = {
    field.name: group.name
    for group in fields(Settings)
    for field in fields(getattr(Settings.of("shape:cube"), group.name))
}
FIELDS = list(GROUPED)

EXAMPLES = Path(__file__).parents[2] / "examples"


# ---- the table and the settings -------------------------------------------------------------


def test_every_field_of_settings_is_an_option_and_every_option_a_field() -> None:
    held = {option.field: option.group for option in OPTIONS}
    assert held == GROUPED
    assert len(set(NAMES)) == len(NAMES)
    assert {option.section for option in OPTIONS} == set(SECTIONS)
    twice = [option.name for option in OPTIONS if option.field == "sheets"]
    assert len(FIELDS) == len(NAMES) - 1
    assert twice == ["sheet", "stock"]


def test_defaults_are_those_of_the_table_and_are_taken_when_they_are_typed() -> None:
    settings = Settings.of("shape:cube")
    for option in OPTIONS[1:]:
        if option.name == "stock":
            continue
        value = getattr(getattr(settings, option.group), option.field)
        assert value == option.default_value, option.name
        if value is not None:
            assert option.kind.hold(value) == value, option.name
    assert settings.ribbons.width is None
    assert settings.machine.preset == preset_named()
    assert (settings.ribbons.clearance_mm, settings.stock.margin_mm, settings.machine.kerf_mm) == (
        0.1,
        10.0,
        0.0,
    )


def test_choices_that_other_rooms_have_too_are_the_same() -> None:
    choices = {option.name: option.kind.choices for option in OPTIONS}
    assert choices["dxf"] == DXF_VERSIONS
    assert set(choices["template"]) == {"sheet", "none", *PAPERS_MM}
    assert set(choices["sticks"]) == {"roll", "none", *STICK_PAPERS}
    assert choices["preset"] == tuple(sorted(choices["preset"]))
    for name in choices["effort"]:
        assert effort_named(name)
    with pytest.raises(InputError, match=", ".join(choices["effort"])):
        effort_named("utmost")


# ---- what is refused ------------------------------------------------------------------------

NO_NUMBERS = ("1", b"1", math.nan, math.inf, -math.inf, -1.0, True, 1j, 10**400)
#: For every field, values that no job can be made with.
SPOILT = {
    "source": (None, "", " ", 3, "a\0b"),
    "title": ("", " ", 3, "a" * 81, "a\0b", "a\ud800"),
    "up": ("", "up", "Z", 2, "1,2", "0,0,0", "nan,0,1", "1e999,0,1", "1,2,3,4", "--z", (0, 0, 1)),
    "weld": ("yes", 1),
    "bodies": ("some", "0", 3, None),
    "walls": ("inside", True, None),
    "size_mm": (*NO_NUMBERS, 0, "400mm", ("", 400.0)),
    "remesh": ("triangles", "quads:0", "quads:many", 3000),
    "refine": ("spline:2", "loop:x", 2),
    "symmetrise": ("yes", 1, None),
    "fair": (-1, 1001, 1.5, "3", True, math.nan, 10**30),
    "leave_out": ("", "top", "top:0mm", "top:80mm,top:9mm", "side:8mm", "-1", "1:2", "a.txt", 3),
    "pattern": ("nonsense", "satin:5", 3, None),
    "twists": ("", 3),
    "twill_method": ("vote", None, 1),
    "twill_weights": ("2", "0/1", "1/11", "1/1.25", "a/b", 2, None),
    "boundary": ("open", None, 0),
    "course": ("wavy", None, 0),
    "material": ("marble", "warp=card,warp=card", "warp=", "card:!", 3, None),
    "library": ("felt.toml", [3], {"felt": 3}, None),
    "thickness_mm": (*NO_NUMBERS, 0, (), ("warp", 1.0), (("warp", 0.0),), (("warp", "1mm"),),
                     (("warp", 1.0), ("warp", 2.0)), (("woof", 1.0),), (("", 1.0),)),
    "width": ("12mm", 0.65, math.nan),
    "as_drawn": ("yes", True),
    "strips": ("bent", 3),
    "smooth": (-1, 51, 0.5, "3", None),
    "crossing": (*NO_NUMBERS, 0, 1, 1.5),
    "clearance_mm": (*NO_NUMBERS, None),
    "max_length_mm": (*NO_NUMBERS, 0, "auto"),
    "prefer": ("speed", "", 3, None),
    "kinds": ("few", "", 3, None),
    "spares": ("some", "", "0", "0%", "101%", "2.5", "-1", "200", 0, 1.5),
    "hole_mm": (*NO_NUMBERS, "none"),
    "holes": ("some", "", 3),
    "fasten": ("some", "every:1", "form:0mm", 3),
    "former": ("marble", "", "card:!", 3),
    "fastener": ("nail", "m99", "screw-m3,9mm", "2m", 3),
    "joint": ("weld", "rivet:9", "glue:2", "tuck,lap=30mm", 2, None),
    "lap_mm": (*NO_NUMBERS, 0, "auto"),
    "sheets": ("600x400mm", [(600, 400)], (SheetSize(0.0, 5.0),), (SheetSize(math.nan, 5.0),),
               (SheetSize(9e9, 5.0),), (SheetSize(9.0, 9.0, 0),), (SheetSize(9.0, 9.0, "3"),),
               (SheetSize(9.0, 9.0, bunch="woof"),), (SheetSize("9", 9.0),), None),
    "margin_mm": (*NO_NUMBERS, None),
    "gap_mm": (*NO_NUMBERS, (("warp", -1.0),), ("warp", 1.0), (("warp", math.nan),)),
    "rotations": ("45", "grain:80deg", "across:46", 90, None),
    "effort": ("utmost", None),
    "seed": (-1, 2**63, 0.0, "0", None),
    "layout": ("", 3),
    "pin": ("", "A3", "A3@0:1,2,3", "A3@1:1,2", "A3@1:1,2,3/A3@2:1,2,3", 3),
    "colours": ("grey", None),
    "profile": ("friend", None),
    "preset": ("lightburn", None),
    "dxf": ("R14", 12, None),
    "svg_units": ("in", None),
    "hairline_mm": (*NO_NUMBERS, 0, 1.5),
    "target": ("nobody", 3, None),
    "rules": ("school.toml", [3], {"school": 3}, None),
    "strict": ("yes", 0, None),
    "force": ("yes", 0, None),
    "labels": ("some", None),
    "hang": ("", "top:0", "left", "bottom:3:4", "-1", 3),
    "base": ("board", "", 3),
    "load": ("", "200", "0g", "200g@left", "1kg@top:0", 3),
    "rim": ("round", None),
    "label_side": ("both", None),
    "paper": ("a3", None),
    "sticks": ("a5", 4),
    "kerf_mm": (*NO_NUMBERS, None),
    "micro_joints": ("4", 4, MicroJoints(0), MicroJoints(4, math.nan), MicroJoints(2, 9.0)),
    "cut_order": ("long", None),
    "template": ("a5", None),
    "calibrate": (*NO_NUMBERS, 0, "1.3", 51.0, None),
    "bed": ("600x400mm", 600.0, SheetSize(0.0, 5.0), SheetSize(9.0, 9.0, 2),
            SheetSize(9.0, 9.0, bunch="warp"), (SheetSize(9.0, 9.0), SheetSize(8.0, 8.0)), ()),
}  # fmt: skip


@pytest.mark.parametrize("name", FIELDS)
def test_settings_refuse_what_no_job_can_be_made_with(name: str) -> None:
    assert SPOILT[name]
    said = "mesh" if name == "source" else name
    for value in (*SPOILT[name], object(), b"\0", [[]], {1: 2}):
        with pytest.raises(InputError, match=f"^{said}: "):
            Settings.of(**{"source": "shape:cube", name: value})
    with pytest.raises(InputError, match=f"^{said}: "):
        Settings.of("shape:cube").but(**{name: SPOILT[name][0]})


def test_how_open_a_weave_is_stands_for_its_width() -> None:
    settings = settings_from_options("shape:cube", width="open:0.1")
    assert settings.ribbons.width_rule == WidthRule(0.9, auto=True)
    # Panels are never shorter than ribbons are wide, and stay as long with other widths.
    assert settings.ribbons.panel_share == 0.9
    other = settings.ribbons.with_width(WidthRule(0.5))
    assert (other.width_rule, other.panel_share) == (WidthRule(0.5), 0.9)
    assert Settings.of("shape:cube").ribbons.panel_share == 0.7


def test_numbers_of_other_kinds_are_held_as_plain_ones() -> None:
    settings = Settings.of(
        "shape:cube", size_mm=400, fair=np.int64(3), kerf_mm=np.float32(0.25),
        margin_mm=Fraction(1, 2), sheets=[SheetSize(600.0, 400.0)], material=" Card: Red ",
        target="FICTIV", rotations="grain: 5°",
    )  # fmt: skip
    held = (
        settings.mesh.size_mm,
        settings.mesh.fair,
        settings.machine.kerf_mm,
        settings.stock.margin_mm,
    )
    assert held == (400.0, 3, 0.25, 0.5)
    assert [type(value) for value in held] == [float, int, float, float]
    assert settings.stock.sheets == (SheetSize(600.0, 400.0),)
    assert (settings.stock.material, settings.machine.target) == ("card:red", "fictiv")
    assert settings.stock.rotations == "grain:5deg"
    # As they are, job.toml takes them.
    assert tomllib.loads(job_toml(settings, {}))["job"]["fair"] == 3


# ---- text, value, text ----------------------------------------------------------------------


def _units(least: float, most: float) -> st.SearchStrategy[str]:
    return st.builds(
        lambda value, unit: f"{value:.6g}{unit}",
        st.floats(least, most),
        st.sampled_from(["mm", "cm", "in", ""]),
    )


def _by_bunch(each: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return each | st.builds(lambda one, two: f"warp={one},weft={two}", each, each)


LENGTHS = _units(0.01, 900.0 / 25.4)  # of any unit
WIDTHS = st.sampled_from(["auto", "0.5", "12mm", "6mm..14mm", "0.4,6mm..14mm", "auto,..9mm"])
SHEETS = st.builds(
    lambda wide, high, end, bunch: f"{bunch}{wide}x{high}mm{end}",
    st.integers(5, 2000), st.integers(5, 2000), st.sampled_from(["", ":1", ":30"]),
    st.sampled_from(["", "warp=", "0="]),
)  # fmt: skip
#: For every option, what may be typed.
TYPED = {
    "mesh": st.sampled_from(["shape:torus?m=8&n=4", "a mesh.obj"]),
    "title": st.sampled_from(["Fruit bowl", " Schale  für Äpfel "]),
    "up": st.sampled_from(["y", "-z", "0, 0,-2"])
    | st.lists(st.floats(0.1, 9.0).map(str), min_size=3, max_size=3).map(",".join),
    "weld": st.sampled_from(["all", "none", "0.01mm"]),
    "bodies": st.sampled_from(["all", "largest", "join", "wrap", "12"]),
    "size": LENGTHS,
    "remesh": st.sampled_from(["quads", "quads:300"]),
    "refine": st.sampled_from(["catmull-clark:2", "simplest:1,loop:1", "loop"]),
    "fair": st.integers(0, 1000).map(str),
    "former": st.sampled_from(["auto", " Birch-Ply-3"]),
    "hang": st.sampled_from(["top", "Bottom: 3", "12, top:2"]),
    "load": st.sampled_from(["200g", "1.5 kg @ Top", "8oz@12,top:2"]),
    "leave_out": st.sampled_from(["top:8cm", "Bottom: 80mm, top:1in", "13, 12", "FOLDER/list.txt"]),
    "pattern": st.sampled_from(
        ["plain", "kagome", "twill", "triaxial", "3/1", "2/2/1", "satin:5/2", "serge", "denim"]
    ),
    "twists": st.just("own.csv"),
    "twill_weights": st.sampled_from(["1/1", "2/2", "0.1/10", "1.50 / 3"]),
    "material": st.sampled_from(["card", "Card:Red", "warp=card,weft=birch-veneer:dark red"]),
    "library": st.just("FOLDER/materials.toml"),
    "thickness": _by_bunch(_units(0.01, 3.9)),
    "width": WIDTHS,
    "smooth": st.integers(0, 50).map(str),
    "crossing": st.floats(0.01, 0.99).map(str),
    "clearance": _units(0.01, 3.9) | st.just("0"),
    "max_length": LENGTHS | st.just("auto"),
    "spares": st.sampled_from(["5%", "12.5 %", "2", "100%"]),
    "fasten": st.sampled_from(
        ["joints", "Form", "form:3mm", "ALL", "rim", "every:2", "none", "rim,4, 12"]
    ),
    "fastener": st.sampled_from(
        ["screw-m3", "Thread ", "BRAD", "M3", "3.3 mm", "mini-brad, 2mm", "none"]
    ),
    "joint": st.sampled_from(
        ["rivet", "rivet:3", "glue, lap=3cm", "dovetail", "slot", "none", "rivet:2,slots"]
    ),
    "sheet": SHEETS,
    "stock": st.just("FOLDER/stock.toml"),
    "margin": LENGTHS | st.just("0mm"),
    "gap": _by_bunch(LENGTHS | st.just("0")),
    "rotations": st.sampled_from(
        ["free", "auto", "90", "180 deg", "grain", "Grain: 5°", "across:12.5deg"]
    ),
    "seed": st.integers(0, 2**63 - 1).map(str),
    "layout": st.just("crossing_map.json"),
    "pin": st.sampled_from(["A3@1:120,40.5,90", "A3@1:120, 40,90 / B1@2:0,0,-7.5"]),
    "preset": st.sampled_from(["boxes", "epilog", "trotec"]),
    "hairline": _units(0.01, 0.03) | st.just("epilog"),
    "target": st.sampled_from(["default", "Fictiv"]),
    "rules": st.just("FOLDER/targets.toml"),
    "kerf": _units(0.01, 0.39) | st.just("0"),
    "micro_joints": st.sampled_from(["4", "12:0.5mm", "1:0.02in"]),
    "calibrate": st.sampled_from(["1.3", "0.5", "20"]),
    "bed": st.builds("{}x{}mm".format, st.integers(5, 2000), st.integers(5, 2000)),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("options")
    for name in ("stock.toml", "materials.toml", "targets.toml"):
        shutil.copy(EXAMPLES / name, folder)
    (folder / "list.txt").write_text("40 7, 8 # a corner\n7\n")
    return str(folder)


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
def test_what_is_typed_comes_back_from_what_job_toml_has(name, folder, data) -> None:
    kind = option_named(name).kind
    if kind.flag:
        typed = data.draw(st.booleans())
    elif name in TYPED:
        typed = data.draw(TYPED[name]).replace("FOLDER", folder)
    else:
        typed = data.draw(st.sampled_from(kind.choices))
    value = kind.parse(typed)
    written = kind.write(value)
    if written is None:
        assert value in (None, 0.0)
        return
    again = kind.parse(written)
    # job.toml has ten digits of a length.
    assert kind.write(again) == written
    assert kind.parse(kind.write(again)) == again
    if isinstance(value, float):
        assert again == pytest.approx(value, rel=1e-9)
    elif name not in ("thickness", "gap", "width", "micro_joints"):
        assert again == value
    assert kind.hold(value) == value
    assert kind.parse(value) == value


@given(st.data())
def test_all_settings_come_back_from_job_toml(folder, tmp_path_factory, data) -> None:
    names = data.draw(st.sets(st.sampled_from(sorted(TYPED)), max_size=12)) - {"mesh", "layout"}
    typed = {name: data.draw(TYPED[name]).replace("FOLDER", folder) for name in sorted(names)}
    try:
        settings = settings_from_options("shape:cube", **typed)
    except InputError as error:
        # Each is good in itself; some do not go together.
        pairs = ({"pattern", "twists"},)
        assert any(pair <= names for pair in pairs), error  # noqa: PT017
        return
    told = settings_table(settings)
    assert list(told) == [name for name in NAMES if name in told]
    path = tmp_path_factory.getbasetemp() / "job.toml"
    path.write_text(job_toml(settings, {}))
    again = settings_from_job(path)
    assert settings_table(again) == told
    assert job_toml(again, {}) == path.read_text()
    other = settings_from_job(path, seed=7, mesh="shape:torus")
    assert settings_table(other) == told | {"mesh": "shape:torus", "seed": 7}


def test_every_option_is_on_the_reference_page_in_its_section() -> None:
    page = options_page()
    for title in SECTIONS:
        section = page.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
        options = [option for option in OPTIONS if option.section == title]
        for option, entry in zip(options, section.split("\n### `")[1:], strict=True):
            assert entry.startswith("MESH" if option.name == "mesh" else option.flag)
            assert " ".join(option.text.split()) in " ".join(entry.split())


# ---- settings of options --------------------------------------------------------------------


def test_options_take_texts_numbers_and_values(folder) -> None:
    by_text = settings_from_options(
        "shape:cube", size="40cm", kerf="0.15mm", sheet=["600x400mm:3", "24x18in"], width="12mm",
        thickness="warp=0.5mm,weft=0.8mm", stock=f"{folder}/stock.toml", rotations="90",
        micro_joints="4", material="warp=card,weft=card", fastener="none", seed="3",
    )  # fmt: skip
    by_value = settings_from_options(
        "shape:cube", size=400, kerf=0.15, sheet=[SheetSize(600.0, 400.0, 3), "24x18in"],
        width=WidthRule(least_mm=12.0, most_mm=12.0), thickness=(("warp", 0.5), ("weft", 0.8)),
        stock=tomllib.loads((EXAMPLES / "stock.toml").read_text()), rotations=90, micro_joints=4,
        fastener="None", seed=np.int64(3), material="warp=card,weft=card",
    )  # fmt: skip
    assert by_text == by_value
    # A list of stock comes before plain sheets.
    assert [bool(sheet.name) for sheet in by_text.stock.sheets] == [True] * 3 + [False] * 2
    assert by_text == Settings.of(
        "shape:cube", size_mm=400.0, kerf_mm=0.15, sheets=by_text.stock.sheets, fastener="none",
        seed=3,
        width=WidthRule(0.65, 12.0, 12.0), thickness_mm=(("warp", 0.5), ("weft", 0.8)),
        rotations="90", micro_joints=MicroJoints(4), material="warp=card,weft=card",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sise", 3),
        ("joint", "dovetail,lap=9mm"),
        ("width", "open:1"),
        ("size_mm", 3),
        ("size", "12 furlongs"),
        ("seed", "many"),
        ("up", "0,0,0"),
        ("fair", {"a": 1}),
        ("sheet", "600"),
        ("library", "no.toml"),
        ("preset", "glow"),
        ("target", "snijlap"),
        ("rotations", "45"),
        ("material", "warp=card,0=card"),
        ("material", "card:red;blue"),
        ("thickness", "warp=0.4,weft=1e9"),
        ("width", "..1e9mm"),
        ("pattern", "satin:6/2"),
        ("refine", "butterfly:2"),
        ("remesh", "hexagons:5"),
    ],
)
def test_options_that_are_wrong_are_named(name, value) -> None:
    unknown = name not in NAMES
    with pytest.raises(InputError, match=f"'{name}'.* 'size'" if unknown else f"^{name}: "):
        settings_from_options("shape:cube", **{name: value})


def test_a_mesh_that_lies_beside_job_toml_is_found(tmp_path) -> None:
    (tmp_path / "my.obj").write_text("v 0 0 0\n")
    path = tmp_path / "job.toml"
    path.write_text(job_toml(Settings.of("my.obj"), {}))
    assert settings_from_job(path).mesh.source == str(tmp_path / "my.obj")
    path.write_text(job_toml(Settings.of("nowhere.obj"), {}))
    assert settings_from_job(path).mesh.source == "nowhere.obj"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[job]\nmesh = 'shape:cube'\nsise = 3\ncolor = 1", "2 .*: color, sise;"),
        ("[job]\nmesh = 'shape:cube'\nsize = 'large'", "job.toml, size: "),
        ("[job]\nmesh = 'shape:cube'\nlayout = 3", "job.toml, layout: "),
        ("[job]\nup = 'z'", "mesh"),
        ("job = 3", r"\[job\]"),
        ("[job", "job.toml"),
    ],
)
def test_a_job_toml_that_is_none_gets_one_message(text, place, tmp_path) -> None:
    (tmp_path / "job.toml").write_text(text)
    with pytest.raises(InputError, match=place):
        settings_from_job(tmp_path / "job.toml")


def test_files_of_older_versions_are_read_without_what_is_not_missed(tmp_path) -> None:
    job, profile = tmp_path / "job.toml", tmp_path / "k40.toml"
    job.write_text(
        job_toml(Settings.of("shape:cube"), {}).replace("[job]\n", '[job]\nqr = "none"\n')
    )
    assert settings_from_job(job) == Settings.of("shape:cube")
    profile.write_text('qr = "paper"\nkerf = "0.15mm"\n')
    assert machine_profile(str(profile)) == {"kerf": "0.15mm"}
