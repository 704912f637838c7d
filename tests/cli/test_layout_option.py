"""A job is made again from the layout that it recorded, byte for byte."""

import json
import tomllib

import pytest

from fabweave.cli.main import main

MESH = ("shape:octahedron", "--size", "300mm", "--effort", "quick", "-q")


def run(*arguments):
    try:
        main(["make", *map(str, arguments)])
    except SystemExit as stop:
        return stop.code
    return 0


def files(folder):
    return {
        path.relative_to(folder): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.slow
def test_recorded_layout_gives_the_same_bytes_and_other_pieces_are_refused(tmp_path, capsys):
    first, again, third = tmp_path / "first", tmp_path / "again", tmp_path / "third"
    assert run(*MESH, "-o", first) == 0
    assert "layout" not in tomllib.loads((first / "job.toml").read_text())["job"]
    assert run(*MESH, "--layout", first / "crossing_map.json", "-o", again) == 0
    assert tomllib.loads((again / "job.toml").read_text())["job"]["layout"] == "crossing_map.json"
    one, two = files(first), files(again)
    assert one.keys() == two.keys()
    # The code on a sheet tells of the layout; all that it does not stand on is the same.
    coded = {"crossing_map.json", "assembly.html", "verify.json"}
    coded |= {f"sheets/sheet_01.{suffix}" for suffix in ("dxf", "svg", "png", "pdf")}
    differing = {str(name) for name in one if one[name] != two[name]}
    assert "job.toml" in differing
    assert differing <= {"job.toml", *coded}
    plans = [json.loads((folder / "crossing_map.json").read_text()) for folder in (first, again)]
    assert [plan["layout"].pop("recorded") for plan in plans] == [False, True]
    for plan in plans:
        del plan["cut"]["code"]
        for sheet in plan["sheets"]:
            del sheet["code"]
    assert plans[0] == plans[1]
    # The job.toml finds the layout beside it.
    assert run("--config", again / "job.toml", "-q", "-o", third) == 0
    assert files(third) == two
    capsys.readouterr()
    smaller = (*MESH[:2], "290mm", *MESH[3:])
    assert run(*smaller, "--layout", first / "crossing_map.json", "-o", tmp_path / "no") == 2
    assert "is of other pieces" in capsys.readouterr().err
