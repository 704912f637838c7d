"""Weave found models by the plain command, and tell how even their strips come out.

    python tests/benchmarks/bench_found.py FOLDER [--size 400mm] [--material card] [--only A,B]

FOLDER has models as OBJ, STL, PLY or OFF. Each is made by ``fabweave make MODEL --size 400mm``
alone, in a folder of its own below FOLDER/jobs, and stopped after five minutes. One row a model:

made      whether a job was made, and with which verdict
ratio     widest over narrowest place of one piece between its first and last crossing: the median
          of all pieces, and the worst
corners   turns of more than 20 degrees in an outline between these crossings, a piece
narrowest the narrowest such place of all, mm
turn      how much a flat strip turns from crossing to crossing, degrees, in the mean
off       how much of the model is lost, and added, in the mean, and at most, as a share of the size
"""

import argparse
import json
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import shapely
from scipy.interpolate import CubicSpline

#: Nobody waits longer for a first answer; strips are measured so often, millimetres.
_LONGEST_S, _EACH_MM = 300, 2.0
_SHARP_DEG = 20.0
_MODELS = (".obj", ".stl", ".ply", ".off")


def strip(piece):
    """Return widths of a flat piece between its first and last crossing, corners, and turns."""
    outline = shapely.Polygon(piece["outline"])
    stations = np.array([(one["x"], one["y"]) for one in piece["stations"]])
    if len(stations) < 3:
        return np.ones(1), 0, np.zeros(0)
    chords = np.diff(stations, axis=0)
    lengths = np.linalg.norm(chords, axis=1)
    middle = CubicSpline(np.append(0.0, np.cumsum(lengths)), stations)
    places = np.arange(0.0, lengths.sum(), _EACH_MM)
    points, way = middle(places), middle(places, 1)
    across = 100 * np.column_stack([-way[:, 1], way[:, 0]])
    cuts = shapely.linestrings(np.stack([points - across, points + across], axis=1))
    widths = [
        min(shapely.get_parts(part), key=point.distance).length
        for part, point in zip(
            shapely.intersection(cuts, outline), shapely.points(points), strict=True
        )
        if not part.is_empty
    ]
    ring = np.array(outline.exterior.coords)[:-1]
    sides = np.roll(ring, -1, axis=0) - ring
    bend = np.abs(_turn(np.roll(sides, 1, axis=0), sides))
    line = shapely.LineString(points)
    along = line.project(shapely.points(ring))
    inside = (along > 0) & (along < line.length)
    turns = np.abs(_turn(chords[:-1], chords[1:]))
    return np.array(widths), int((bend[inside] > _SHARP_DEG).sum()), turns


def _turn(one, other):
    """Return the angle from one direction to another, degrees."""
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return np.degrees(np.arctan2(cross, np.einsum("nd,nd->n", one, other)))


def row(folder):
    """Return the figures of a finished job as text."""
    plan = json.loads((folder / "crossing_map.json").read_text())
    measured = [strip(piece) for piece in plan["pieces"]]
    ratios = np.array([widths.max() / widths.min() for widths, _, _ in measured])
    verdict = json.loads((folder / "verdict.json").read_text())
    text = (
        f"{verdict['level']:10} {len(measured):4} pieces {len(plan['sheets']):3} sheets  ratio "
        f"{np.median(ratios):.2f} / {ratios.max():5.2f}  corners "
        f"{np.mean([corners for _, corners, _ in measured]):.2f}  narrowest "
        f"{min(widths.min() for widths, _, _ in measured):4.1f}  turn "
        f"{np.concatenate([turns for _, _, turns in measured]).mean():4.1f}"
    )
    off = re.search(
        r"within ([0-9.]+) mm .*?([0-9.]+) mm lost and ([0-9.]+) mm added in the mean",
        (folder / "job.toml").read_text(),
    )
    if off is not None:
        size = np.ptp([one["position"] for one in plan["crossings"]], axis=0).max()
        most, lost, added = (100 * float(text) / size for text in off.groups())
        text += f"  off {lost:.2f} + {added:.2f} %, {most:.1f} % at most"
    return text


def main():
    """Print one row for each model of a folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="400mm")
    parser.add_argument("--material", default="card")
    parser.add_argument("--only", default="")
    parser.add_argument("--again", action="store_true", help="measure jobs that are there")
    asked = parser.parse_args()
    models = sorted(path for path in asked.folder.iterdir() if path.suffix in _MODELS)
    only = set(filter(None, asked.only.split(",")))
    for model in models:
        if only and model.stem not in only:
            continue
        job, start = asked.folder / "jobs" / model.stem, time.monotonic()
        command = [sys.executable, "-m", "fabweave", "make", model, "-o", job, "-q"]
        command += ["--size", asked.size, "--material", asked.material]
        said = ""
        if not asked.again:
            try:
                ended = subprocess.run(
                    command, capture_output=True, text=True, timeout=_LONGEST_S, check=False
                )
                said = "" if ended.returncode == 0 else ended.stderr.strip().splitlines()[0][:90]
            except subprocess.TimeoutExpired:
                said = f"not finished after {_LONGEST_S} s"
        took = time.monotonic() - start
        text = said or row(job)
        print(f"{model.stem:14} {took:5.0f} s  {text}", flush=True)


if __name__ == "__main__":
    main()
