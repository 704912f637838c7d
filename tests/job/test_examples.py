"""Every example runs and prints what it says."""

import re
import runpy
import shutil
import sys
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import fabweave as fw
from fabweave.verify.report import MEANINGS

pytestmark = pytest.mark.usefixtures("quick_jobs")

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


@pytest.mark.slow
def test_make_a_job(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_a_job.py", str(tmp_path / "out")])
    runpy.run_path(str(EXAMPLES / "make_a_job.py"))
    assert capsys.readouterr().out == f"8 pieces on 1 sheet\nproved by {len(MEANINGS)} checks\n"
    assert (tmp_path / "out" / "verify.json").is_file()


@pytest.mark.slow
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


@pytest.mark.slow
def test_make_figures(tmp_path, capsys, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    monkeypatch.setattr(sys, "argv", ["make_figures.py", str(tmp_path), "4", "17"])
    runpy.run_path(str(EXAMPLES / "make_figures.py"))
    assert capsys.readouterr().out == "figure_04.png\nfigure_17.png\n"
    for name, tiles in (("figure_04.png", 2), ("figure_17.png", 3)):
        with Image.open(tmp_path / name) as picture:
            assert picture.width >= tiles * 560
            assert 460 <= picture.height < 2 * 460


@pytest.mark.slow
def test_weave_any_mesh(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["weave_any_mesh.py", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / "weave_any_mesh.py"))
    triangles, quads, refined, made = capsys.readouterr().out.splitlines()
    assert triangles.startswith("30 faces of 3 sides; 9 threads; no twill: vertex 0 has valence 6")
    # Theory: 2 gcd(m, n) threads on an m × n torus.
    assert quads.startswith("15 faces of 4 sides; 2 threads; no twill: the number of crossings")
    assert refined == "60 faces of 4 sides; 4 threads; exact twill"
    assert re.fullmatch(r"exact: True; \d+ pieces, proved: True", made)
    assert (tmp_path / "job" / "verify.json").is_file()


def test_no_example_is_left_out():
    tested = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    # What these make is looked at in test_gallery.py and test_paper_theory.py.
    tested |= {"make_gallery", "make_notebook", "paper_theory"}
    assert {path.stem for path in EXAMPLES.glob("*.py")} == tested - {"no_example_is_left_out"}


def test_make_knot(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_knot.py", str(tmp_path / "knot.obj")])
    runpy.run_path(str(EXAMPLES / "make_knot.py"))
    kept = EXAMPLES / "meshes" / "knot.obj"
    assert (tmp_path / "knot.obj").read_bytes() == kept.read_bytes()


def test_make_lampshade(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_lampshade.py", str(tmp_path / "lampshade.obj")])
    runpy.run_path(str(EXAMPLES / "make_lampshade.py"))
    made, kept = tmp_path / "lampshade.obj", EXAMPLES / "lampshade.obj"
    assert made.read_bytes() == kept.read_bytes()
    facts = fw.inspect(kept, boundary="turn").facts
    # As the README says: 16 × 6 quads, two rims, a twill that is exact but where threads turn.
    assert facts["mesh"]["faces"] == 16 * 6
    assert facts["mesh"]["boundary_loops"] == 2
    assert facts["twill"]["exact"]
    assert facts["twill"]["broken_at_turns"] == 32
    assert facts["threads"] | {"count": 4, "crossings": 176} == facts["threads"]


def test_make_glossary(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_glossary.py", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / "make_glossary.py"))
    kept = sorted((EXAMPLES / "glossary").iterdir())
    assert [path.name for path in kept] == sorted(path.name for path in tmp_path.iterdir())
    for path in kept:
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
        root = ElementTree.fromstring(path.read_text("utf-8"))  # noqa: S314 - it is ours
        assert root.get("viewBox") == "0 0 160 120"
        # Something is marked, and nothing is there twice.
        drawn = [ElementTree.tostring(element) for element in root]
        assert len(drawn) == len(set(drawn)) > 3


@pytest.mark.slow
@pytest.mark.apt
@pytest.mark.skipif(not shutil.which("pdftoppm"), reason="poppler-utils is not installed")
def test_make_job_picture(tmp_path, monkeypatch, finished):
    job = finished("shape:octahedron", "--size", "200mm", "--effort", "quick")
    target = tmp_path / "job.png"
    monkeypatch.setattr(sys, "argv", ["make_job_picture.py", str(job), "1", str(target)])
    runpy.run_path(str(EXAMPLES / "make_job_picture.py"))
    pixels, sheet, kept = (
        np.asarray(Image.open(path).convert("L"), dtype=float)
        for path in (target, job / "sheets" / "sheet_01.png", EXAMPLES / "lampshade.png")
    )
    assert len(pixels) == len(kept) == 400
    # Object, sheet and page, with white between them; each shows something.
    wide, page, space = round(sheet.shape[1] * 400 / len(sheet)), 283, 12
    ends = np.cumsum([0, pixels.shape[1] - wide - page - 2 * space, wide + space, page + space])
    for left, right in pairwise(ends):
        assert pixels[:, left + space * bool(left) : right].std() > 5.0
    for left in ends[1:-1]:
        assert (pixels[:, left : left + space] > 250.0).all()
