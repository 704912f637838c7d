"""Presets of users' own: taken from their files, kept in job.toml, refused with one message."""

import pickle
import re
import tomllib
from dataclasses import replace

import pytest
import tomli_w

from fabweave.cli.main import cli
from fabweave.cli.options import job_settings
from fabweave.core.errors import InputError
from fabweave.options.settings import job_toml
from fabweave.sheet.drawing import Layer
from fabweave.sheet.presets import LayerColour, find_preset, preset_named, preset_names, read_preset

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
    assert settings.machine.preset == find_preset(str(mine))
    assert settings.machine.line_mm == pytest.approx(0.0254)
    (tmp_path / "job.toml").write_text(job_toml(settings, {}))
    mine.unlink()
    assert settings_from(["--config", str(tmp_path / "job.toml")]) == settings
    again = settings_from(["--config", str(tmp_path / "job.toml"), "--preset", "boxes"])
    assert again == settings.but(preset=preset_named("boxes"))


SPOILT = [
    ("[layers", "", ""),
    ("[layers]", "[colours]", "colours"),
    ("[layers]", "[layers.CUT]", "CUT"),
    ('NOTES = "#f36926"', "", "NOTES"),
    ('"#f36926"', '"orange"', "ORANGE"),
    ('"#f36926"', '"#ff0000"', "CUT_OUTER and NOTES"),
    ('"#0000ff"', '"#101010"', "CUT_INNER and ENGRAVE_LABEL"),
    ("aci = 250", "aci = 5", "CUT_INNER and ENGRAVE_MARK"),
    ("aci = 250", "aci = 0", "0"),
    ("aci = 250", "aci = 7.0", "7.0"),
    ("aci = 250", "width = 1", "width"),
    ('"#f36926"', "3", "3"),
    ("0.1", "inf", "inf mm"),
    ("0.1", "true", "hairline_mm"),
    ('"mine"', '""', "name"),
    ('"our K40"', "7", "description"),
]


@pytest.mark.parametrize(("old", "new", "place"), SPOILT)
def test_a_spoilt_file_is_refused_with_its_place(mine, old, new, place) -> None:
    assert old in MINE
    mine.write_text(MINE.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(str(mine))) as refusal:
        find_preset(str(mine))
    assert place in str(refusal.value)
