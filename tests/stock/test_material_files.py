"""Materials and targets from files: one reader and one set of checks, for ours and for others'."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w

from fabweave.core.entries import entry_keys, entry_table, read_toml
from fabweave.core.errors import InputError
from fabweave.sheet.targets import Target, target_named, targets, targets_of
from fabweave.stock.material import (
    Material,
    material_library,
    material_named,
    materials_of,
)
from fabweave.stock.supplies import materials_in_use, parse_materials

EXAMPLES = Path(__file__).parents[2] / "examples"
FELT = {
    "title": "Felt, 2 mm",
    "thickness_mm": 2.0,
    "density_kg_m3": 250.0,
    "kerf_mm": 0.2,
    "gap_mm": 2.0,
    "sheet_mm": [900.0, 600.0],
    "metal": False,
    "min_bend_radius_t": 2.0,
}


def test_examples_are_read() -> None:
    materials = materials_of(read_toml(EXAMPLES / "materials.toml", "materials"), "there")
    assert [one.name for one in materials] == ["wool-felt", "beech-veneer-0.6"]
    (school,) = targets_of(read_toml(EXAMPLES / "targets.toml", "targets"), "there")
    assert (school.name, school.sheet_mm) == ("school-laser", (600.0, 300.0))


@pytest.mark.parametrize("material", [*material_library(), *materials_of({"felt": FELT}, "here")])
def test_a_material_comes_back_from_its_entry(material) -> None:
    entry = tomllib.loads(tomli_w.dumps({material.name: entry_table(material)}))
    assert materials_of(entry, "there") == (material,)


@pytest.mark.parametrize("target", targets())
def test_a_target_comes_back_from_its_entry(target) -> None:
    entry = tomllib.loads(tomli_w.dumps({target.name: entry_table(target)}))
    # All of it: whatever the default asks for.
    wide = {"default": {**entry_table(target_named("default")), "hole_mm": 9.0, "title": "wide"}}
    assert targets_of(wide | entry, "there")[-1 if target.name != "default" else 0] == target


def test_users_materials_come_to_ours_and_stand_in_for_them() -> None:
    felt, card = materials_of({"felt": FELT, "card": FELT}, "mine.toml")
    assert material_named("Felt", [felt, card]) == felt
    assert material_named("card", [felt, card]) == card
    assert material_named("card", [felt]) == material_named("card") != card
    with pytest.raises(InputError, match="choose one of felt"):
        material_named("velt", [felt])
    with pytest.raises(InputError, match="'felt'"):
        material_named("felt")


def test_only_materials_in_use_are_kept_and_none_that_is_ours() -> None:
    felt, card = materials_of({"felt": FELT, "card": FELT}, "mine.toml")
    assert materials_in_use(parse_materials("felt:red"), [card, felt]) == (felt,)
    assert materials_in_use(parse_materials("warp=felt,weft=card"), [felt, card]) == (card, felt)
    assert materials_in_use(parse_materials("card"), [felt]) == ()
    assert materials_in_use(parse_materials("card"), [material_named("card")]) == ()
    # Of two of one name the later counts.
    thin = replace(felt, thickness_mm=1.0)
    assert materials_in_use(parse_materials("felt"), [felt, thin]) == (thin,)


def test_what_a_target_does_not_say_is_as_in_the_default() -> None:
    own = {"default": {"title": "mine", "web_mm": 3.0}, "school": {"title": "school", "gap_mm": 2}}
    default, school = targets_of(own, "mine.toml")
    ours = target_named("default")
    assert default == replace(ours, title="mine", web_mm=3.0)
    assert school == replace(default, name="school", title="school", gap_mm=2.0)
    assert target_named("default", [default, school]) == default
    assert target_named("default") == ours


#: Of each key of a material, values that none can have; None for a key that is missing.
SPOILT = {
    "thicknes_mm": [1.0],
    "title": [None, "", "two\nlines"],
    "thickness_mm": ["2mm", 0, True],
    "density_kg_m3": [float("nan")],
    "gap_mm": [float("inf")],
    "kerf_mm": [None],
    "sheet_mm": [600.0, [600.0], [600.0, 0.0]],
    "metal": ["no"],
    "colour": ["red"],
    "young_mpa": [[4500.0], [0.0, 1.0], 3000.0],
    "turning_nmm": [[1.0], [0.0, 25.0], 25.0],
    "poisson": [0.5, -0.1],
    "young_source": [7],
    "min_bend_radius_t": [None],
    "bend_table_mm": [[[2.0, 9.0], [1.0, 5.0]], []],
    "across_table_mm": [[[1.0, 9.0, 2.0]]],
    "formed_across_table_mm": [2.5],
    "formed_table_mm": [[[2.0, 9.0], [1.0, 5.0]]],
    "formed": [""],
    "speed_mm_s": [[1.0, 2.0, 3.0]],
    "machine": ["saw", ["co2"]],
    "engrave_mm_s": [[3.0, 2.0]],
    "acceleration_mm_s2": [0.0],
    "rapid_mm_s": ["fast"],
    "pierce_s": [[0.1, 0.2, 0.3]],
    "speed_source": [""],
    "price_source": [3],
    "machine_per_h": [9.0],  # of no currency
    "price_per_m2": [3.0],
    "currency": [3],
    "assumed": [["weight"], [["title"]]],
    "notes": [3],
}


@pytest.mark.parametrize("key", SPOILT)
def test_an_entry_that_is_no_material_is_told_with_its_place(key) -> None:
    for value in SPOILT[key]:
        entry = {k: one for k, one in (FELT | {key: value}).items() if one is not None}
        with pytest.raises(InputError, match=rf"^mine.toml, \[felt\]: .*{key}"):
            materials_of({"card": FELT, "felt": entry}, "mine.toml")


def test_every_key_of_a_material_and_of_a_target_has_a_spoilt_example() -> None:
    assert entry_keys(Material).keys() <= SPOILT.keys()
    for key in entry_keys(Target):
        entry = entry_table(target_named("snijlab")) | {key: "wide" * 99}
        with pytest.raises(InputError, match=rf"^mine.toml, \[me\]: {key} is 'wide"):
            targets_of({"me": entry}, "mine.toml")


@pytest.mark.parametrize(
    "document",
    [{"felt": 3}, {"felt": [FELT]}, {"title": "felt"}]
    + [{name: FELT} for name in ("Felt", "felt:red", "warp=felt", "", "-f", "f" * 41, "ß")]
    + [{name: {"title": "me"}} for name in ("Me", "me:red")],
)
def test_what_is_no_entry_or_no_name_is_refused(document) -> None:
    for read in (materials_of, targets_of):
        with pytest.raises(InputError, match=r"^mine.toml"):
            read(document, "mine.toml")


@pytest.mark.parametrize("key", entry_keys(Target))
def test_targets_made_in_python_are_checked_too(key) -> None:
    with pytest.raises(InputError, match=f"^target 'snijlab': {key} is"):
        replace(target_named("snijlab"), **{key: -1.0})
