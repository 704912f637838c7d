"""A warp of one material and a weft of another: heights, grips, sheets, masses, and their proof."""

import csv
import json
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jobs import laid
from spoiling import edit_json, put, swap

from fabweave.core.errors import InputError
from fabweave.job.ask import complete_settings
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.ribbon.rules.rules import measure_along, measure_layers
from fabweave.stock.per_bunch import split_by_bunch
from fabweave.stock.ribbon_limits import ribbon_limits, thread_limits
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.supplies import plan_supplies
from fabweave.verify.proof import verify_job

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]

WARP, WEFT = 0.4, 0.7
SETTINGS = Settings.of(
    "shape:torus?m=4&n=4",
    size_mm=260.0,
    fasten="all",
    effort="quick",
    kinds="any",  # else there is room for a lap everywhere
    force=True,  # veneer bends too much on so small a ring
    material="warp=card,weft=birch-veneer",
    thickness_mm=(("warp", WARP), ("weft", WEFT)),
    gap_mm=(("warp", 1.5), ("weft", 3.0)),
    sheets=(SheetSize(600.0, 400.0), SheetSize(610.0, 410.0, 9, bunch="weft")),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a job of two materials and its folder, written once."""
    folder = tmp_path_factory.mktemp("two") / "job"
    job, proof, *_ = run_job(Stations(SETTINGS), folder)
    assert proof.ok
    return job, folder


def read(folder: Path, name: str) -> dict:
    return json.loads((folder / name).read_text(encoding="utf-8"))


def test_strands_are_as_far_apart_as_their_own_layers_take(made) -> None:
    job, _ = made
    threads, ribbons = job.weave.threads, job.woven.ribbons
    thickness = np.where(job.woven.bunches == 0, WARP, WEFT)[threads.thread_of_pass]
    lapped = {joint.crossing for joint in job.piece_set.joints if joint.lap_mm > 0}
    corners = [rail[ribbons.entry + at] for rail in (ribbons.right, ribbons.left) for at in (0, 1)]
    away = np.mean(corners, axis=0) - ribbons.centre[threads.crossing]
    height = np.einsum("pd,pd->p", away, ribbons.normal[threads.crossing])
    for crossing in range(threads.n_crossings):
        (one, other) = np.flatnonzero(threads.crossing == crossing)
        over, under = (one, other) if job.weave.over[one] else (other, one)
        # Faces, not middles: the under side of the upper layer, the upper side of what lies below.
        lower_face = height[over] - thickness[over] / 2
        upper_face = height[under] + thickness[under] * (1.0 if crossing in lapped else 0.5)
        assert lower_face - upper_face == pytest.approx(0.1, abs=1e-9)


def test_sheets_pieces_and_fasteners_are_of_their_threads_materials(made) -> None:
    job, folder = made
    plan, waste = read(folder, "crossing_map.json"), read(folder, "waste.json")
    bunch = {thread["id"]: thread["bunch"] for thread in plan["threads"]}
    sheets = {sheet["sheet"]: sheet for sheet in plan["sheets"]}
    names = ("card", "birch-veneer")
    for piece in plan["pieces"]:
        sheet = sheets[piece["sheet"]]
        assert sheet["material"] == names[bunch[piece["thread"]]]
        assert sheet["thickness_mm"] == (WARP, WEFT)[bunch[piece["thread"]]]
    # Sheets are numbered through, the warp's first.
    assert [sheet["sheet"] for sheet in plan["sheets"]] == list(range(1, len(sheets) + 1))
    order = [sheet["material"] for sheet in plan["sheets"]]
    assert order == sorted(order, key=names.index)
    assert set(order) == set(names)
    with (folder / "pieces.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    area: Counter[str] = Counter()
    mass: Counter[str] = Counter()
    for row in rows:
        assert row["material"] == sheets[int(row["sheet"])]["material"]
        area[row["material"]] += float(row["area_mm2"])
        mass[row["material"]] += float(row["mass_g"])
    density = {"card": 750.0, "birch-veneer": job.supplies.materials[1].density_kg_m3}
    for record in waste["materials"]:
        name = record["material"]
        weight = area[name] * record["thickness_mm"] * density[name] * 1e-6
        assert mass[name] == pytest.approx(weight, rel=1e-3)
        assert record["mass_g"] == pytest.approx(weight, rel=1e-6)
    assert waste["totals"]["mass_g"] == pytest.approx(sum(mass.values()), rel=1e-3)
    grips = {(row["layers"], row["grip_mm"]) for row in waste["fasteners"]}
    assert grips <= {(2, 1.1), (3, 1.5), (3, 1.8)}
    assert {layers for layers, _ in grips} == {2, 3}
    assert sum(row["needed"] for row in waste["fasteners"] if row["layers"] == 3) == len(
        [joint for joint in plan["joints"] if joint["grip_mm"]]
    )


def exchange_bunches(plan):
    for thread in plan["threads"]:
        thread["bunch"] = 1 - thread["bunch"]


MAP, JOB = "crossing_map.json", "job.toml"
#: What is changed in which file, and which checks object.
SPOILS = [
    (MAP, put("sheets", 0, "material", "birch-veneer"), "materials"),
    (MAP, put("sheets", -1, "thickness_mm", 0.8), "materials"),
    (MAP, exchange_bunches, "materials joints space clearance"),
    (MAP, put("threads", 0, "bunch", 1), "materials joints space kinds clearance"),
    # The weft is thicker than there is room.
    (JOB, swap("weft=0.7mm", "weft=0.9mm"), "materials space joints clearance"),
    # Another material was asked for, a third bunch, a larger gap, a small sheet under the warp.
    (JOB, swap("weft=birch-veneer", "weft=museum-board"), "materials"),
    (JOB, swap("warp=card,", "warp=card,2=card,"), "materials"),
    (JOB, swap("warp=1.5mm", "warp=30mm"), "materials sheets"),
    (JOB, swap('"600x400mm",', '"weft=600x400mm",'), "materials"),
    ("ribbons.json", put("threads", 0, "limits", "thickness_mm", 0.5), "clearance"),
]


@pytest.mark.parametrize(("name", "spoil", "objecting"), SPOILS)
def test_verify_objects_to_the_wrong_material(made, tmp_path, name, spoil, objecting) -> None:
    folder = Path(shutil.copytree(made[1], tmp_path / "job"))
    if name == JOB:
        (folder / name).write_text(spoil((folder / name).read_text("utf-8")), "utf-8")
    else:
        edit_json(folder / name, spoil)
    told = {check.name for check in verify_job(folder).checks if not check.ok}
    expected = {*objecting.split(), "seal"}
    # Whether pieces stand nearer than the gap of the other material is up to the layout, and so is
    # what is left of a sheet and is of its material.
    # Lists and what weighs on it are of that material, too.
    assert expected <= told <= expected | {"sheets", "offcuts", "tables", "form"}


def test_warp_and_weft_name_two_bunches_only() -> None:
    settings, _supplies = complete_settings(
        Settings.of("shape:cube", size_mm=200.0, material="warp=card,weft=birch-veneer")
    )
    with pytest.raises(InputError, match="no bunch warp, weft and no material is given for 2"):
        _ = Stations(settings).ribbons


def test_bunches_by_number() -> None:
    # A cube has four threads, each of which crosses the others.
    names = "0=card,1=birch-veneer,2=card,3=polypropylene"
    settings, supplies = complete_settings(Settings.of("shape:cube", size_mm=300.0, material=names))
    woven = Stations(settings).ribbons
    bunches = woven.bunches
    assert sorted(bunches.tolist()) == [0, 1, 2, 3]
    told = [supplies.materials[index].name for index in supplies.of(bunches)]
    assert told == [dict(split_by_bunch(names, what="material"))[str(b)] for b in bunches.tolist()]
    assert [supply.bunches for supply in supplies.each] == [("0", "2"), ("1",), ("3",)]
    upper, lower = (
        measure_layers(woven.ribbons, woven.weave, thread_limits(supplies, bunches)).__dict__[key]
        for key in ("passes", "others")
    )
    thick = supplies.thickness_mm(bunches)[woven.weave.threads.thread_of_pass]
    wanted = measure_layers(woven.ribbons, woven.weave, thread_limits(supplies, bunches)).limit
    assert wanted == pytest.approx((thick[upper] + thick[lower]) / 2)


NONE = (("", None),)


def test_what_is_equal_is_one_supply_unless_its_sort_or_its_sheets_differ() -> None:
    both = (("warp", "card"), ("weft", "card"))
    one = plan_supplies(both, NONE, NONE, ())
    assert not one.several
    assert one.each[0].bunches == ("warp", "weft")
    red = plan_supplies((("warp", "card:red"), ("weft", "card:blue")), NONE, NONE, ())
    assert [m.name for m in red.materials] == ["card:red", "card:blue"]
    sheets = [SheetSize(600.0, 400.0), SheetSize(9.0, 9.0, 1, bunch="weft")]
    own = plan_supplies(both, NONE, NONE, sheets)
    assert [len(supply.sheets) for supply in own.each] == [1, 2]
    # Settings keep the stock as it was given, and the default of a bunch that has none.
    assert own.sheets == tuple(sheets)
    alone = plan_supplies(both, NONE, NONE, sheets[1:])
    assert alone.sheets == (sheets[1], SheetSize(1000.0, 700.0, bunch="warp"))


def test_sheets_of_a_material_are_for_its_threads_only() -> None:
    both = (("warp", "card:red"), ("weft", "birch-veneer"))
    card, veneer, other, any_of = (
        SheetSize(500.0, 400.0, 2, name=name, material=name)
        for name in ("card", "birch-veneer", "birch-ply-3", None)
    )
    made = plan_supplies(both, NONE, NONE, [card, veneer, other])
    assert [supply.sheets for supply in made.each] == [(card,), (veneer,)]
    assert made.sheets == (card, veneer)
    with pytest.raises(InputError, match="the stock has no sheets of birch-veneer"):
        plan_supplies(both, NONE, NONE, [card])
    # Two sheets that might be of either cannot be counted twice.
    with pytest.raises(InputError, match="could be of any of the 2 materials"):
        plan_supplies(both, NONE, NONE, [replace(any_of, name="A")])


def test_every_thread_is_held_to_its_own_limits() -> None:
    woven, _settings, supplies = laid(SETTINGS)
    mixed = measure_along(woven.ribbons, thread_limits(supplies, woven.bunches))
    thread = woven.weave.threads.thread_of_pass
    for index, material in enumerate(supplies.materials):
        alone = measure_along(woven.ribbons, ribbon_limits(material))
        for rule, measured in mixed.items():
            own = supplies.of(woven.bunches)[thread[measured.passes]] == index
            assert measured.margins[own] == pytest.approx(alone[rule].margins[own])
