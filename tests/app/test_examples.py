"""Every example runs and prints what it says."""

import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fabweave.verify.report import MEANINGS

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_count_threads(capsys):
    runpy.run_path(str(EXAMPLES / "count_threads.py"))
    told = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1].split()[::3] for line in told] == [
        ["3", "4"],
        ["4", "6"],
        ["4", "6"],
        ["6", "10"],
        ["6", "10"],
    ]


def test_make_a_job(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_a_job.py", str(tmp_path / "out")])
    runpy.run_path(str(EXAMPLES / "make_a_job.py"))
    assert capsys.readouterr().out == f"8 pieces on 1 sheet\nproved by {len(MEANINGS)} checks\n"
    assert (tmp_path / "out" / "verify.json").is_file()


def test_exact_twill(capsys):
    runpy.run_path(str(EXAMPLES / "exact_twill.py"))
    table, told = capsys.readouterr().out.split("shape:", 1)
    # Theory: exact if a side is even.
    for m, row in enumerate(table.splitlines()[1:], start=3):
        expected = ["T" if m * n % 2 == 0 else "." for n in range(3, 9)]
        assert row.split() == ["m", "=", str(m), *expected]
    torus, slit, cube, best = told.splitlines()
    assert torus == "torus?m=8&n=6: exact; thread A goes UOOUUOOU …"
    assert slit == "shape:slit?genus=2: exact; thread A goes UOOUUOOU …"
    assert cube.startswith("shape:cube?n=2: vertex 0 has valence 3; in all, 8 vertices")
    assert best == "  of 264 conditions 16 are broken, and every weave breaks 16 or more"


def test_link_of_a_weave(capsys):
    runpy.run_path(str(EXAMPLES / "link_of_a_weave.py"))
    rings, *gauss, one, two, three, diagram = capsys.readouterr().out.splitlines()
    assert rings == "3 rings, 6 crossings"
    # Every ring goes over and under in turn, each crossing once over and once under.
    passes = [re.findall(r"([OU])(\d)[+-]", line) for line in gauss]
    assert ["".join(side for side, _ in ring) for ring in passes] == ["OUOU"] * 3
    walked = sorted(one_pass for ring in passes for one_pass in ring)
    assert walked == [(side, str(n)) for side in "OU" for n in range(1, 7)]
    assert [line.split(": ")[1] for line in (one, two, three)] == ["0"] * 3
    arcs = [int(number) for number in re.findall(r"\d+", diagram)]
    assert sorted(arcs) == sorted([*range(1, 13), *range(1, 13)])
    assert diagram.count("X[") == 6


@pytest.mark.slow
def test_weave_any_mesh(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["weave_any_mesh.py", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / "weave_any_mesh.py"))
    triangles, quads, refined, made = capsys.readouterr().out.splitlines()
    assert triangles.startswith("30 faces of 3 sides; 9 threads; no twill: vertex 0 has valence 6")
    # Theory: 2 gcd(m, n) threads on an m × n torus.
    assert quads.startswith("15 faces of 4 sides; 2 threads; no twill: a ring needs a number")
    assert refined == "60 faces of 4 sides; 4 threads; exact twill"
    assert re.fullmatch(r"exact: True; \d+ pieces, proved: True", made)
    assert (tmp_path / "job" / "verify.json").is_file()


def test_no_example_is_left_out():
    tested = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert {path.stem for path in EXAMPLES.glob("*.py")} == tested - {"no_example_is_left_out"}


@pytest.mark.slow
def test_make_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", str(tmp_path / "woven.png")])
    runpy.run_path(str(EXAMPLES / "make_pictures.py"))
    made, kept = (
        np.asarray(Image.open(path).convert("RGB"), dtype=float)
        for path in (tmp_path / "woven.png", EXAMPLES / "woven.png")
    )
    # Other versions of numpy and Pillow may differ in the last bits, and so in single pixels.
    assert np.abs(made - kept).mean() < 1.0
