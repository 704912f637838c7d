"""Materials and targets of the user's own: found, listed, made, embedded, made again and proved."""

import json
import shutil
import tomllib
from pathlib import Path

import pytest
from jobs import run

from fabweave.job.remake import remake_job
from fabweave.options.settings import settings_from_job, settings_from_options
from fabweave.options.user_files import FOLDER_VARIABLE, user_file
from fabweave.verify.proof import verify_job

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]

#: One material is new; the other stands in for one of ours, and bends by a table.
MATERIALS = """
[felt]
title = "Filz <b>& \\"co\\" 漢字"
thickness_mm = 1.0
density_kg_m3 = 250
kerf_mm = 0.2
gap_mm = 3.0
sheet_mm = [500, 400]
metal = false
min_bend_radius_t = 2.0
speed_mm_s = [20.0, 30.0]
price_per_m2 = 38.0
machine = "diode"
acceleration_mm_s2 = 700.0
pierce_s = [0.1, 0.2]
machine_per_h = [10.0, 12.0]
currency = "EUR"

[card]
title = "Card from the attic"
thickness_mm = 0.5
density_kg_m3 = 810.0
kerf_mm = 0.1
gap_mm = 2.5
sheet_mm = [450.0, 350.0]
metal = false
bend_table_mm = [[0.4, 9.0], [0.6, 12.0]]

[velvet]
title = "Velvet, which nothing is made of"
thickness_mm = 1.0
density_kg_m3 = 300.0
kerf_mm = 0.2
gap_mm = 3.0
sheet_mm = [500.0, 400.0]
metal = false
min_bend_radius_t = 1.0
"""
#: Nobody keeps these.
TARGETS = """
[school]
title = "the laser at school"
hole_mm = 9.0
edge_mm = 9.0
web_mm = 30.0
gap_mm = 2.8
piece_mm = [100.0, 90.0]
sheet_mm = [300.0, 200.0]
"""
JOB = ("shape:torus?m=8&n=4", "--size", "240mm", "--effort", "quick", "-q")


@pytest.fixture(scope="module")
def own(tmp_path_factory) -> Path:
    """Return a folder with a user's own files, which is no configuration folder."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "materials.toml").write_text(MATERIALS, encoding="utf-8")
    (folder / "targets.toml").write_text(TARGETS, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made(own, tmp_path_factory) -> Path:
    """Return a job of two own materials, one of which stands in for ours, and an own target."""
    folder = tmp_path_factory.mktemp("made") / "job"
    typed = ("--library", own / "materials.toml", "--rules", own / "targets.toml")
    chosen = ("--material", "warp=felt:red,weft=card", "--target", "School", "--gap", "2.5mm")
    assert run("make", *JOB, *typed, *chosen, "-o", folder) == 0
    return folder


@pytest.fixture
def configured(own, monkeypatch) -> Path:
    """Make the user's files those of the configuration folder."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(own))
    return own


def test_the_job_is_of_the_users_materials(made) -> None:
    waste = json.loads((made / "waste.json").read_text())
    found = {one["material"]: one for one in waste["materials"]}
    assert {name: (one["thickness_mm"], one["density_kg_m3"]) for name, one in found.items()} == {
        "felt:red": (1.0, 250.0),
        "card": (0.5, 810.0),
    }
    sheets = {(one["material"], one["width_mm"], one["height_mm"]) for one in waste["sheets"]}
    assert sheets == {("felt:red", 500.0, 400.0), ("card", 450.0, 350.0)}
    prices = {one["material"]: one["currency"] for one in waste["estimate"]["materials"]}
    assert prices == {"felt:red": "EUR", "card": ""}
    broken = json.loads((made / "preflight.json").read_text())["findings"]
    rules = {finding["rule"] for finding in broken}
    assert rules >= {"hole", "hole-edge", "web", "piece", "sheet", "gap"}


def test_what_is_used_is_embedded_whole_and_nothing_else(made) -> None:
    job = tomllib.loads((made / "job.toml").read_text())["job"]
    own = tomllib.loads(MATERIALS)
    assert job["library"] == {"card": own["card"], "felt": own["felt"]}
    assert job["rules"]["school"]["web_mm"] == 30.0
    # All of it, so that another default changes nothing.
    assert job["rules"]["school"]["web_t"] == 1.0


def test_what_is_proved_needs_no_file_of_the_users(made, tmp_path) -> None:
    assert remake_job(made).ok
    spoiled = Path(shutil.copytree(made, tmp_path / "spoiled"))
    text = (spoiled / "job.toml").read_text()
    (spoiled / "job.toml").write_text(text.replace("density_kg_m3 = 250", "density_kg_m3 = 251"))
    assert verify_job(spoiled).failed == ("seal",)


def test_the_configuration_folder_is_honoured(configured) -> None:
    settings = settings_from_options("shape:cube", material="felt", target="school")
    assert [one.name for one in (*settings.stock.library, *settings.machine.rules)] == [
        "felt",
        "school",
    ]
    assert user_file("library") == configured / "materials.toml"
    # What is asked for without a word is the user's, too.
    assert settings_from_options("shape:cube").stock.library[0].title == "Card from the attic"
    assert settings_from_options("shape:cube", material="birch-veneer").stock.library == ()


@pytest.mark.usefixtures("configured")
def test_a_finished_job_keeps_its_materials_whatever_the_folder_has(tmp_path) -> None:
    job = tmp_path / "job.toml"
    job.write_text('[job]\nmesh = "shape:cube"\nmaterial = "card"\ntarget = "default"\n')
    assert settings_from_job(job).stock.library == ()
    # What is asked for anew is looked for there.
    assert settings_from_job(job, material="felt").stock.library[0].name == "felt"
    assert settings_from_job(job, target="school").machine.rules[0].name == "school"
