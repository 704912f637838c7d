"""What the map says of the drawings' looks is held to them and to the settings."""

import json

import pytest
from sealing import verify_job
from verify_specimen import COLOURS


def judged(folder, change=None, settings=""):
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    if change is not None:
        change(plan["cut"])
        path.write_text(json.dumps(plan))
    with (folder / "job.toml").open("a") as file:
        file.write(settings)
    checks = {check.name: check for check in verify_job(folder).checks}
    return " ".join(checks["looks"].findings)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda cut: cut.update(dxf="R2000"), "its version is 'AC1024', but should be 'AC1015'"),
        (
            lambda cut: cut.update(svg_units="px96"),
            "its unit in mm is 1, but should be 0.264583333",
        ),
        (lambda cut: cut.update(svg_units="inch"), "its unit in mm is 1, but should be nan"),
        (lambda cut: cut.update(hairline_mm=0.1), "instead of 0.1"),
        (lambda cut: cut["layers"].pop(), "layers with colours lack NOTES"),
        (lambda cut: cut["layers"][3].update(colour="#FF0001"), "but should be ('#FF0001', 1)"),
        (lambda cut: cut["layers"][3].update(aci=10), "but should be ('#FF0000', 10)"),
    ],
)
def test_a_map_that_says_something_else_is_found(job, change, words) -> None:
    assert words in judged(job(), change)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ('dxf = "R2010"\npreset = "own"\nprofile = "maker"\nhairline = "0.05mm"', ""),
        ('dxf = "R12"', "dxf is 'R2010', but should be 'R12', as in job.toml"),
        ('svg_units = "px96"', "svg_units is 'mm', but should be 'px96'"),
        ('profile = "service"', "profile is 'maker', but should be 'service'"),
        ('preset = "boxes"', "preset is 'own', but should be 'boxes'"),
        ('hairline = "0.1mm"', "lines are 0.05 mm wide, and in job.toml 0.1mm"),
    ],
)
def test_settings_that_say_something_else_are_found(job, settings, words) -> None:
    found = judged(job(), settings=f"[job]\n{settings}\n")
    assert words in found if words else found == ""


def test_a_preset_of_ones_own_in_the_settings_is_compared(job) -> None:
    layers = {layer: {"colour": colour, "aci": aci} for layer, (colour, aci) in COLOURS.items()}
    rows = "".join(
        f'{layer} = {{ colour = "{entry["colour"]}", aci = {entry["aci"]} }}\n'
        for layer, entry in layers.items()
    )
    head = '[job.preset]\nname = "own"\nhairline_mm = 0.05\n[job.preset.layers]\n'
    assert judged(job(), settings=head + rows) == ""
    spoilt = head + rows.replace("#0000FF", "#0000FE")
    folder = job()
    (folder / "job.toml").write_text("")
    assert "the list of its colours is" in judged(folder, settings=spoilt)
