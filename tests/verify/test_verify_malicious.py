"""Whatever a folder holds, verify ends with findings: it never raises and never hangs."""

import os
import struct
import time
from pathlib import Path

import pytest
from slow import slow_but
from spoiling import edit_json

from fabweave.cli.main import main
from fabweave.verify import proof
from fabweave.verify.proof import verify_job

FILES = (
    "crossing_map.json", "woven_mesh.obj", "model.glb", "ribbons.json", "job.toml",
    "sheets/sheet_01.dxf", "sheets/sheet_01.svg",
)  # fmt: skip
DEEP = 100_000


def replaced(content):
    def spoil(path):
        path.write_bytes(content)

    return spoil


def fifo(path):
    path.unlink()
    os.mkfifo(path)


def linked(target):
    def spoil(path):
        path.unlink()
        path.symlink_to(target)

    return spoil


def folder(path):
    path.unlink()
    path.mkdir()


def sparse(path):
    """Make a file that says it is larger than any disk."""
    with path.open("wb") as file:
        file.truncate(1 << 41)


#: Whatever the kind of file.
ANY = {
    "a pipe": fifo,
    "an endless device": linked("/dev/zero"),
    "a link to itself": lambda path: linked(path)(path),
    "a folder": folder,
    "very large": sparse,
    "not UTF-8": replaced(b"\xff\xfe\x00" * 50),
}
JSON = {
    "deep lists": replaced(b"[" * DEEP),
    "deep objects": replaced(b'{"a":' * DEEP),
    "a giant integer": replaced(b'{"schema": ' + b"9" * 5_000 + b"}"),
    "a list": replaced(b"[1, 2]"),
    "a number": replaced(b"1e999"),
}
KINDS = {
    ".json": JSON,
    ".toml": {
        "deep lists": replaced(b"a = " + b"[" * DEEP),
        "deep tables": replaced(b"[" + b"a." * 20_000 + b"]"),
        "a giant integer": replaced(b"a = " + b"9" * 5_000),
    },
    ".dxf": {
        "one line": replaced(b"0" * 1_000_000),
        "giant codes": replaced(b"9" * 400 + b"\n1\n0\nEOF\n"),
        "sections without end": replaced(b"0\nSECTION\n2\nENTITIES\n" * 20_000 + b"0\nEOF\n"),
    },
    ".svg": {
        "deep groups": replaced(b"<g>" * DEEP),
        "laughs": replaced(
            b'<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa">' +
            b"".join(b'<!ENTITY a%d "%s">' % (n, b"&a%d;" % (n - 1) * 10) for n in range(1, 12)) +
            b"]><svg>&a11;</svg>"
        ),
        "a path of points": replaced(
            b'<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">'
            b'<path d="' + b"M1,1" * 200_000 + b'"/></svg>'
        ),
    },
    ".glb": {
        "giant counts": replaced(b"glTF" + struct.pack("<II", 2, 1 << 31)),
        "deep": replaced(
            b"glTF" + struct.pack("<IIII", 2, 20 + DEEP, DEEP, 0x4E4F534A) + b"[" * DEEP
        ),
    },
    ".obj": {
        "giant indices": replaced(b"v 0 0 0\nf 1 " + b"9" * 4_000 + b" 3\n"),
        "one face": replaced(b"v 0 0 0\nf" + b" 1" * 300_000),
    },
}  # fmt: skip


CASES = [
    pytest.param(name, spoil, id=f"{name}-{what}")
    for name in FILES
    for what, spoil in {**ANY, **KINDS.get(Path(name).suffix, {})}.items()
]


@pytest.mark.skipif(os.name != "posix", reason="needs pipes and links")
@pytest.mark.parametrize(("name", "spoil"), slow_but(CASES, every=5))
def test_a_malicious_file_is_a_finding(job, name, spoil):
    directory = job("octahedron")
    spoil(directory / name)
    report = verify_job(directory)
    assert not report.ok
    assert not [fault for check in report.checks for fault in check.faults]


def many_sheets(plan):
    plan["sheets"] = [{**plan["sheets"][0], "sheet": n, "name": f"s{n}"} for n in range(1, 50_001)]


#: What a map may say that leads elsewhere, or to very much work.
MAPS = {
    "a sheet elsewhere": lambda plan: plan["sheets"][0].update(name="../../../etc/passwd"),
    "an absolute sheet": lambda plan: plan["sheets"][0].update(name="/dev/zero"),
    "a name with a zero": lambda plan: plan["sheets"][0].update(name="a\0b"),
    "a very long name": lambda plan: plan["sheets"][0].update(name="a" * 100_000),
    "a giant sheet": lambda plan: plan["sheets"][0].update(width_mm=1e300, height_mm=1e300),
    "a piece far away": lambda plan: plan["pieces"][0].update(x=1e300),
    "giant numbers": lambda plan: plan["pieces"][0].update(thread=10**400),
    "giant crossings": lambda plan: plan["threads"][0]["crossings"].append(10**18),
    "a hole of any size": lambda plan: plan["crossings"][0].update(hole_mm=1e308),
    "50,000 sheets": many_sheets,
    "a kind of pieces": lambda plan: plan["pieces"][0].update(kind=[[]]),
}


@pytest.mark.parametrize("name", slow_but(MAPS, 0, 4))
def test_a_malicious_map_is_a_finding(job, name):
    directory = job("octahedron")
    edit_json(directory / "crossing_map.json", MAPS[name])
    began = time.process_time()
    report = verify_job(directory)
    assert not report.ok
    assert not [fault for check in report.checks for fault in check.faults]
    # Not a limit of speed: some of these made work without end.
    assert time.process_time() - began < 300


def test_a_fault_of_the_verifier_is_told_as_such(job, monkeypatch, capsys):
    def faulty(_job, _tally):
        raise NotImplementedError("the other half")

    tasks = [task if task.name != "joints" else proof._Task("joints", (), faulty)
             for task in proof._TASKS]  # fmt: skip
    monkeypatch.setattr(proof, "_TASKS", tasks)
    directory = job("octahedron")
    report = verify_job(directory)
    (check,) = (check for check in report.checks if not check.ok)
    assert "a fault of the verifier, which says nothing about the job" in check.findings[0]
    assert "NotImplementedError" in check.faults[0]
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(directory)])
    assert stop.value.code == 1
    told = capsys.readouterr()
    assert "Traceback" not in told.out + told.err
    name = told.err.partition("report it with ")[2].partition(" and")[0]
    assert "the other half" in Path(name).read_text()
    Path(name).unlink()
