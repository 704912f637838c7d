"""Of the files that users name, ordinary ones of bounded size are read; others are told."""

import os
import socket
import time

import pytest

from fabweave.core.entries import parse_toml, read_toml
from fabweave.core.errors import InputError
from fabweave.core.files import read_input, read_text


def test_an_ordinary_file_is_read_and_what_a_link_leads_to(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfone\n")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    assert read_input(tmp_path / "link", "it") == b"\xef\xbb\xbfone\n"
    assert read_text(tmp_path / "a", "it") == "one\n"  # without the mark of some editors


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes have no names here")
def test_what_may_never_end_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    cases = {"pipe": "it is a pipe", "link": "it is a device", ".": "it is a folder"}
    with socket.socket(socket.AF_UNIX) as server:
        os.chdir(tmp_path)  # names of sockets are short
        server.bind("socket")
        cases["socket"] = "cannot read the list in"
        for name, words in cases.items():
            with pytest.raises(InputError, match=words):
                read_input(tmp_path / name, "the list")


def test_the_size_is_looked_at_before_anything_is_read(tmp_path):
    with open(tmp_path / "large", "wb") as file:
        file.truncate(2**40)  # a hole, which takes no room
    with pytest.raises(InputError, match=r"1,099,511,627,776 bytes, and at most 1,000 are read"):
        read_input(tmp_path / "large", "the list", 1000)


@pytest.mark.parametrize(
    ("name", "words"),
    [("no\0name", "null"), ("x" * 5000, "too long"), ("none", "there is no such file")],
)
def test_names_that_are_none_are_told(name, words, tmp_path):
    with pytest.raises(InputError, match=words):
        read_input(tmp_path / name, "the list")


def test_text_that_is_not_utf_8_is_told_with_its_line(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"a = 1\nb = 'gr\xfcn'\n")
    with pytest.raises(InputError, match="line 2 is not in UTF-8; save the file as UTF-8"):
        read_toml(tmp_path / "a.toml", "the list")


@pytest.mark.parametrize(
    "text", ["a=" + "[" * 100_000, "a." * 60_000 + "a=1", "[" + '"a" . ' * 60_000 + "a]"]
)
def test_deep_and_giant_toml_is_refused_in_linear_time(text):
    started = time.process_time()
    with pytest.raises(InputError, match=r"^cannot: "):
        parse_toml(text, "cannot")
    # Minutes, where it grows with the square.
    assert time.process_time() - started < 30.0
