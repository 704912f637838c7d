"""A job is made again from the layout that it recorded, byte for byte."""

import json
import tomllib

from jobs import OCTAHEDRON, run


def files(folder):
    return {
        path.relative_to(folder): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_recorded_layout_gives_the_same_bytes_and_other_pieces_are_refused(
    finished, tmp_path, capsys
):
    first, again, third = finished(*OCTAHEDRON), tmp_path / "again", tmp_path / "third"
    assert "layout" not in tomllib.loads((first / "job.toml").read_text())["job"]
    layout = ("--layout", first / "crossing_map.json", "-q")
    assert run("make", *OCTAHEDRON, *layout, "-o", again) == 0
    assert tomllib.loads((again / "job.toml").read_text())["job"]["layout"] == "crossing_map.json"
    one, two = files(first), files(again)
    assert one.keys() == two.keys()
    # The code tells of the layout; all that it does not stand on is the same.
    coded = {"crossing_map.json", "assembly.html", "verify.json", "contents.json", "qr_code.png"}
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
    assert run("make", "--config", again / "job.toml", "-q", "-o", third) == 0
    assert files(third) == two
    capsys.readouterr()
    assert run("make", *OCTAHEDRON, "--size", "88mm", *layout, "-o", tmp_path / "no") == 2
    assert "is for other pieces" in capsys.readouterr().err
