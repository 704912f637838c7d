"""Single files are written all or none."""

import os

import pytest

from fabweave.cli.main import main
from fabweave.core.errors import InputError
from fabweave.core.output_files import check_file, write_files


def test_files_are_written_and_replaced(tmp_path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("before")
    write_files({old: b"after", new: b"\x00\xff"})
    assert (old.read_bytes(), new.read_bytes()) == (b"after", b"\x00\xff")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "old"]
    plain = tmp_path / "plain"
    plain.touch()
    assert new.stat().st_mode == plain.stat().st_mode


def test_one_that_fails_leaves_all_as_they_were(tmp_path) -> None:
    old = tmp_path / "old"
    old.write_text("before")
    with pytest.raises(InputError, match=r"cannot write .*nowhere"):
        write_files({old: b"after", tmp_path / "nowhere" / "new": b""})
    assert old.read_text() == "before"
    assert list(tmp_path.iterdir()) == [old]


@pytest.mark.parametrize(
    ("name", "suffix", "words"),
    [
        ("a.jpg", ".png", r"is to be a PNG file: name it a\.jpg\.png"),
        ("nowhere/a.png", ".png", "there is no folder"),
        (".", "", "is a folder"),
    ],
)
def test_what_cannot_be_written_is_told_before(name, suffix, words, tmp_path) -> None:
    with pytest.raises(InputError, match=words):
        check_file(tmp_path / name, suffix)


def test_what_can_be_written_is_not_touched(tmp_path) -> None:
    check_file(tmp_path / "a.PNG", ".png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="needs a folder kept from us")
def test_a_folder_without_leave_is_told_before(tmp_path) -> None:
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match="may not be written"):
        check_file(tmp_path / "a")
    tmp_path.chmod(0o755)


def test_a_job_under_a_file_gets_one_message(tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit) as stop:
        main(["make", "shape:cube", "--effort", "quick", "-q", "-o", str(tmp_path / "file" / "x")])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("fabweave: ")
    assert "is a file" in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
