"""Any change of any file of a finished job is found, by its name."""

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import OCTAHEDRON
from spoiling import drop, edit_json

from fabweave.core.job_folder import foreign_files
from fabweave.job import papers
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.verify.proof import check_seal, verify_job
from fabweave.verify.report import Tally

pytestmark = pytest.mark.usefixtures("quick_jobs")


@pytest.fixture(scope="module")
def folder(finished, tmp_path_factory) -> Path:
    """Return a copy of a finished job, which each test leaves as it was."""
    return shutil.copytree(
        finished(*OCTAHEDRON, "--template", "a4"), tmp_path_factory.mktemp("seal") / "job"
    )


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def broken(folder: Path) -> str:
    """Return what the seal finds; empty if it holds."""
    tally = Tally("seal")
    check_seal(folder, tally)
    return " | ".join(tally.result().findings)


def test_a_finished_job_keeps_its_seal_and_all_files_are_in_it(folder):
    report = verify_job(folder)
    assert report.ok
    assert report.checks[0].name == "seal"
    assert report.checks[0].count == len(files(folder)) - 1


@pytest.mark.parametrize("change", ["more", "less", "gone", "linked"])
def test_a_change_of_any_file_is_found(folder, tmp_path, change):
    for path in files(folder):
        name = path.relative_to(folder).as_posix()
        kept = tmp_path / "kept"
        shutil.copy2(path, kept)
        data = path.read_bytes()
        if change in ("gone", "linked"):
            path.unlink()
        if change == "linked":
            path.symlink_to(kept)
        elif change != "gone":
            path.write_bytes(data + b" " if change == "more" else data[:-1])
        found = broken(folder)
        path.unlink(missing_ok=True)
        shutil.copy2(kept, path)
        # More space after the list itself changes nothing that it says.
        assert (name in found) != ((name, change) in KEEPS), (name, found)
    assert broken(folder) == ""


#: The list of files is not in itself.
KEEPS = {("contents.json", change) for change in ("more", "less", "linked")}


@given(st.data())
def test_a_flipped_bit_anywhere_is_found(folder, data):
    path = data.draw(st.sampled_from([one for one in files(folder) if one.stat().st_size]))
    kept = path.read_bytes()
    at = data.draw(st.integers(0, len(kept) - 1))
    changed = bytearray(kept)
    changed[at] ^= 1 << data.draw(st.integers(0, 7))
    path.write_bytes(bytes(changed))
    found = broken(folder)
    path.write_bytes(kept)
    if path.name != "contents.json":
        assert path.relative_to(folder).as_posix() in found


@pytest.mark.parametrize("older", [False, True])
def test_no_byte_is_read_of_a_file_of_another_size(folder, tmp_path, older):
    """Whatever says that it is larger than any disk is found at once, also by an older seal."""
    copy = shutil.copytree(folder, tmp_path / "job")
    if older:
        edit_json(copy / "contents.json", drop("bytes"))
        assert broken(copy) == ""
    names = ("render.png", "index.html", "job.toml", "sheets/sheet_01.dxf", "pieces.csv")
    for name in names:
        os.truncate(copy / name, 1 << 41)
    found = broken(copy)
    assert all(name in found for name in names)
    assert {name.partition(" ")[0] for name in foreign_files(copy)} == set(names)


@pytest.mark.slow
def test_a_job_is_not_lost_for_a_paper_that_cannot_be_made(tmp_path, monkeypatch):
    def broken_manual(*_):
        raise RuntimeError("a new release of something")

    monkeypatch.setattr(papers, "write_manual", broken_manual)
    monkeypatch.setattr(papers, "index_page", broken_manual)
    settings = Settings.of("shape:octahedron", size_mm=200.0, effort="quick")
    made = run_job(Stations(settings), tmp_path / "job")
    assert [text.split()[0] for text in made.missing] == ["assembly.pdf", "index.html"]
    assert not (tmp_path / "job" / "assembly.pdf").exists()
    assert verify_job(tmp_path / "job").ok
