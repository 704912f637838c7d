"""Presets of users' own: taken from their files, kept in job.toml, refused with one message."""

import pickle
import tomllib
from dataclasses import replace

import click
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from fabweave.app.settings import Settings, job_toml, settings_table
from fabweave.cli.main import cli, main
from fabweave.cli.options import job_settings
from fabweave.core.errors import InputError
from fabweave.cut.drawing import Layer
from fabweave.cut.presets import (
    LayerColour,
    Preset,
    find_preset,
    preset_named,
    preset_names,
    read_preset,
)

MINE = """
name = "mine"
description = "our K40"
hairline_mm = 0.1
[layers]
ENGRAVE_LABEL = "#101010"
ENGRAVE_MARK = { colour = "#101010", aci = 250 }
CUT_INNER = "#0000ff"
CUT_OUTER = { colour = "#FF0000" }
NOTES = "#f36926"
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "k40.toml"
    path.write_text(MINE)
    return path


def test_a_preset_of_ones_own_is_taken(mine) -> None:
    preset = find_preset(str(mine))
    assert (preset.name, preset.description, preset.hairline_mm) == ("mine", "our K40", 0.1)
    assert preset.colours[Layer.CUT_OUTER] == LayerColour("#FF0000", 1)
    assert preset.colours[Layer.CUT_INNER] == LayerColour("#0000FF", 5)
    assert preset.colours[Layer.NOTES] == LayerColour("#F36926", 30)
    mine.write_text(MINE.replace('name = "mine"', ""))
    assert find_preset(str(mine)) == replace(preset, name="k40")


@pytest.mark.parametrize("name", [*preset_names(), "mine"])
def test_a_preset_comes_back_from_its_table_and_from_other_processes(name, mine) -> None:
    preset = find_preset(str(mine)) if name == "mine" else preset_named(name)
    assert read_preset(tomllib.loads(tomli_w.dumps(preset.table)), "there") == preset
    assert pickle.loads(pickle.dumps(preset)) == preset  # noqa: S301 - pickled here


def settings_from(arguments):
    context = cli.commands["make"].make_context("make", [*arguments, "-o", "out"])
    with context:
        return job_settings(context.params.pop("mesh"), context.params)


def test_a_job_repeats_without_the_file(mine, tmp_path) -> None:
    typed = ["--preset", str(mine), "--svg-units", "px96", "--profile", "service"]
    settings = settings_from(["shape:cube", *typed, "--hairline", "0.001in"])
    assert settings.preset == find_preset(str(mine))
    assert settings.line_mm == pytest.approx(0.0254)
    (tmp_path / "job.toml").write_text(job_toml(settings, {}))
    mine.unlink()
    assert settings_from(["--config", str(tmp_path / "job.toml")]) == settings
    again = settings_from(["--config", str(tmp_path / "job.toml"), "--preset", "boxes"])
    assert again == replace(settings, preset=preset_named("boxes"))


def test_presets_that_are_known_are_named_and_others_embedded() -> None:
    assert settings_table(Settings("a", preset=preset_named("epilog")))["preset"] == "epilog"
    changed = replace(preset_named("epilog"), hairline_mm=0.2)
    assert settings_table(Settings("a", preset=changed))["preset"] == changed.table
    assert settings_from(["shape:cube", "--hairline", "epilog"]).line_mm == 0.0254


SPOILT = [
    ("[layers", "", "cannot read the preset"),
    ("[layers]", "[colours]", "unknown key 'colours'; a preset has name"),
    ("[layers]", "[layers.CUT]", "no layer is called 'CUT'"),
    ('NOTES = "#f36926"', "", "no colour for 1 layer(s): NOTES"),
    ('"#f36926"', '"orange"', "'ORANGE' is not of the form '#RRGGBB'"),
    ('"#f36926"', '"#ff0000"', "CUT_OUTER and NOTES the same colour"),
    ('"#0000ff"', '"#101010"', "CUT_INNER and ENGRAVE_LABEL the same colour"),
    ("aci = 250", "aci = 5", "CUT_INNER and ENGRAVE_MARK the same colour"),
    ("aci = 250", "aci = 0", "is not from 1 to 255"),
    ("aci = 250", "aci = 7.0", "7.0 is not a number from 1 to 255"),
    ("aci = 250", "width = 1", "is not a colour; write '#RRGGBB'"),
    ('"#f36926"', "3", "3 is not a colour; write"),
    ("0.1", "inf", "lines cannot be inf mm wide"),
    ("0.1", "true", "hairline_mm is True; write a number"),
    ('"mine"', '""', "its name is ''"),
    ('"our K40"', "7", "its description must be one line of text"),
]


@pytest.mark.parametrize(("old", "new", "words"), SPOILT)
def test_a_spoilt_file_gets_one_message(mine, old, new, words, tmp_path, capsys) -> None:
    assert old in MINE
    mine.write_text(MINE.replace(old, new, 1))
    folder = tmp_path / "out"
    with pytest.raises(SystemExit) as stop:
        main(["make", "shape:cube", "--preset", str(mine), "-q", "-o", str(folder)])
    assert stop.value.code == 2
    error = " ".join(capsys.readouterr().err.split())
    assert words in error
    assert str(mine) in error
    assert not folder.exists()


@pytest.mark.parametrize("value", ["none.toml", "glow", "", "a\0.toml"])
def test_a_preset_that_is_not_there_gets_one_message(value, capsys, tmp_path) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["make", "shape:cube", "--preset", value, "-o", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "preset" in capsys.readouterr().err


@pytest.mark.parametrize("width", [0.0, -1.0, 1.5, float("nan")])
def test_lines_that_are_none_are_refused(width) -> None:
    with pytest.raises(
        InputError,
        match=r"hairline_mm: .* is not a length from 0.001 to 1 mm",
    ):
        Settings("shape:cube", hairline_mm=width)


words = st.sampled_from(["name", "description", "hairline_mm", "layers", "colour", "aci"])
layers = st.sampled_from([layer.value for layer in Layer])
leaves = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8),
    st.from_regex(r"#[0-9a-fA-F]{6}", fullmatch=True),
)  # fmt: skip
entries = st.one_of(
    leaves, st.dictionaries(st.one_of(words, st.text(max_size=3)), leaves, max_size=3)
)
tables = st.fixed_dictionaries(
    {},
    optional={
        "name": leaves,
        "description": leaves,
        "hairline_mm": leaves,
        "layers": st.one_of(leaves, st.dictionaries(layers, entries)),
        "more": leaves,
    },
)


@given(tables)
def test_any_table_is_a_preset_or_refused(table) -> None:
    try:
        preset = read_preset(table, "there")
    except InputError as error:
        assert str(error).startswith("there: ")  # noqa: PT017 - it need not be raised
    else:
        assert isinstance(preset, Preset)
        assert read_preset(preset.table, "again") == preset


@given(st.binary(max_size=60))
def test_any_bytes_are_a_preset_or_refused(tmp_path_factory, data) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz.toml"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"fuzz\.toml"):
        find_preset(str(path))


def test_help_names_every_preset() -> None:
    command = cli.commands["make"]
    told = command.get_help(click.Context(command, info_name="make"))
    assert all(name in told for name in preset_names())
