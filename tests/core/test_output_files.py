"""Single files are written all or none."""

import os
from pathlib import Path

import pytest
from jobs import run
from mesh_writers import write_mesh

from fabweave.core.errors import InputError
from fabweave.core.files import check_file, write_files
from fabweave.mesh.shapes.catalogue import parse_shape


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
        ("a.jpg", ".png", r"has to end with \.png: a\.jpg\.png"),
        ("nowhere/a.png", ".png", "there is no folder"),
        (".", "", "is a folder"),
    ],
)
def test_what_cannot_be_written_is_told_before(name, suffix, words, tmp_path) -> None:
    with pytest.raises(InputError, match=words):
        check_file(tmp_path / name, suffix)
    check_file(tmp_path / "a.PNG", ".png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="needs a folder kept from us")
def test_a_folder_without_leave_is_told_before(tmp_path) -> None:
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match="you may not write"):
        check_file(tmp_path / "a")
    tmp_path.chmod(0o755)


posix = pytest.mark.skipif(os.name != "posix", reason="needs links, devices and pipes")


@posix
def test_links_are_followed_and_stay(tmp_path) -> None:
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_text("before")
    real.chmod(0o640)
    link.symlink_to(real)
    check_file(link)
    write_files({link: b"after"})
    assert link.is_symlink()
    assert real.read_bytes() == b"after"
    assert real.stat().st_mode & 0o777 == 0o640
    real.unlink()
    with pytest.raises(InputError, match=r"is a link to .*real, which is not there"):
        check_file(link)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link"]


@posix
def test_devices_and_pipes_are_written_to_and_stay(tmp_path) -> None:
    device = Path("/dev/null")
    check_file(device, ".png")
    write_files({device: b"1"})
    assert device.is_char_device()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="cannot write"):  # and does not wait for a reader
        write_files({tmp_path / "new": b"", pipe: b"1"})
    assert list(tmp_path.iterdir()) == [pipe]
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_files({pipe: b"1"})
    assert os.read(reader, 9) == b"1"
    os.close(reader)
    assert pipe.is_fifo()


def test_the_mesh_that_is_read_is_not_replaced(tmp_path, capsys) -> None:
    mesh = tmp_path / "cube.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    before = mesh.read_bytes()
    for words in (["model", mesh, "-o", mesh], ["inspect", mesh, "--edges", mesh]):
        assert run(*words) == 2
        assert "is the mesh itself" in capsys.readouterr().err
    assert run("inspect", mesh, "--png", tmp_path / "a.png", "--edges", tmp_path / "a.png") == 2
    assert "name the same file" in capsys.readouterr().err
    assert mesh.read_bytes() == before
    assert list(tmp_path.iterdir()) == [mesh]
