"""The command that is shown for settings makes them again, as the command line reads it."""

import shlex
from dataclasses import replace

import pytest
from jobs import typed

from fabweave.options.command import long_command
from fabweave.options.settings import Settings
from fabweave.sheet.presets import preset_named
from fabweave.stock.material import material_named


@pytest.mark.parametrize(
    "options",
    [
        "",
        "--size 300mm --effort quick --seed 7",
        "--sheet 600x400mm:2 --sheet 620x450mm --margin 0mm --gap 3mm --material birch-veneer",
        "--strict --fastener none --labels none --label-side inside --preset epilog",
        "--width 6mm..14mm --max-length 20cm --joint rivet:2,lap=30mm,slots --svg-units px96",
        "--hairline 0.001in --profile service --dxf R12 --refine catmull-clark:2",
        "--material card --thickness 0.5mm --pattern 3/1 --boundary turn --up y --fair 50",
    ],
)
def test_the_command_makes_the_same_job(options) -> None:
    settings = typed(f"fabweave make 'shape:torus?m=8&n=4' {options} -o out")
    text = long_command(settings)
    assert typed(text) == settings
    # What is usual is not told.
    assert text.count("--") <= options.count("--")


def test_what_only_a_file_can_tell_is_no_option() -> None:
    settings = Settings.of(
        "shape:cube",
        size_mm=300.0,
        preset=replace(preset_named(), hairline_mm=0.1),
        material="felt",
        library=(replace(material_named("card"), name="felt"),),
    )
    words = shlex.split(long_command(settings))
    assert words == [
        "fabweave",
        "make",
        "shape:cube",
        "--size",
        "300mm",
        "--material",
        "felt",
        "-o",
        "job",
    ]
