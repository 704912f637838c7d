"""Short sides, and lines that are drawn twice, are found."""

import numpy as np
import pytest
import shapely
from sealing import result_of

from fabweave.verify.check.drawings import _on_others, check_lines
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


def found(folder) -> str:
    result = result_of(check_lines, load_job(folder, Tally("files")))
    assert result.count > 100
    return " | ".join(result.findings)


def add_shapes(folder, drawn) -> str:
    """Add entities to the first sheet, and say what is found."""
    path = folder / "sheets" / "sheet_01.dxf"
    text = path.read_text()
    head = "  2\nENTITIES\n"
    assert head in text
    path.write_text(text.replace(head, head + drawn, 1))
    return found(folder)


@pytest.mark.parametrize("name", ["octahedron", "bent"])
def test_a_true_job_has_none(job, name) -> None:
    assert found(job(name)) == ""


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([(1, 1, 1.0995, 1)], "is 0.0995 mm long"),
        ([(1, 1, 1, 1)], "is 0.0000 mm long"),
        ([(1, 1, 2, 5)] * 2, "drawn more than once"),
        ([(1, 1, 2, 5), (2, 5, 1, 1)], "drawn more than once"),
        ([(1, 1, 1, 5), (1, 5, 1, 1)], "drawn more than once"),
        ([(1, 1, 7, 4), (9, 5, 3, 2)], "lies on another line for a part of its length"),
        ([(1, 1, 7, 4), (3, 2, 5, 3)], "lies on another line"),
        ([(1, 1, 7, 4), (1, 1, 5, 3)], "lies on another line"),
        # End on end, side by side, across.
        ([(1, 1, 3, 2), (3, 2, 7, 4), (1, 1.01, 7, 4.01), (1, 4, 7, 1)], ""),
        ([(1, 1, 2, 5), (1, 1, 2, 5.1), (1, 1.1, 2, 5), (1, 1, 1.0999, 1)], ""),
    ],
)
def test_spoilt_lines_are_found(job, lines, words) -> None:
    drawn = "".join(
        f"  0\nLINE\n  8\nENGRAVE_MARK\n 10\n{a}\n 20\n{b}\n 11\n{c}\n 21\n{d}\n"
        for a, b, c, d in lines
    )
    told = add_shapes(job(), drawn)
    assert words in told if words else told == ""


def test_notes_are_as_fine_as_they_are(job) -> None:
    # Nobody cuts them: they may lie along an edge, be there twice, and have sides of no length.
    run = "  0\nLINE\n  8\nNOTES\n 10\n1\n 20\n1\n 11\n{}\n 21\n1\n"
    assert add_shapes(job(), "".join(run.format(end) for end in (9, 5, 5, 1.01, 1))) == ""


@pytest.mark.parametrize(("sign", "words"), [(-1.0, ""), (1.0, "drawn more than once")])
def test_arcs_over_one_chord_are_told_apart(job, sign, words) -> None:
    folder = job("bent")
    drawing = read_dxf(folder / "sheets" / "sheet_01.dxf")
    shape = next(one for one in drawing.shapes if one.bulges.any())
    at = int(np.argmax(np.abs(shape.bulges[:-1])))
    (x, y), (u, v) = shape.points[at : at + 2].tolist()
    bent = f"  0\nLWPOLYLINE\n  8\nENGRAVE_MARK\n 90\n2\n 70\n0\n 10\n{x}\n 20\n{y}\n"
    bent += f" 42\n{sign * shape.bulges[at]}\n 10\n{u}\n 20\n{v}\n"
    told = add_shapes(folder, bent)
    assert words in told if words else told == ""


@pytest.mark.parametrize("seed", range(8))
def test_overlaps_are_those_that_lines_share(seed):
    # On a grid, turned and shifted, many lines overlap; what two share has a length or has none.
    rng = np.random.default_rng(seed)
    ends = rng.integers(0, 5, (70, 2, 2))
    ends = ends[np.any(ends[:, 0] != ends[:, 1], axis=1)]
    lines = shapely.linestrings(ends.astype(float))
    shared = shapely.length(shapely.intersection(lines[:, None], lines[None]))
    wanted = np.flatnonzero(np.any(np.tril(shared > 1e-9, -1), axis=1))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    placed = ends @ turn.T * rng.uniform(0.5, 90.0) + rng.uniform(0.0, 2000.0, 2)
    assert 5 < len(wanted) < 65
    assert _on_others(placed[:, 0], placed[:, 1]).tolist() == wanted.tolist()
