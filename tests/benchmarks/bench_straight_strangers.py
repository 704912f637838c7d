"""Read woven designs of RibbonSim (Vekhter and others, "Weaving geodesic foliations", 2019).

    python tests/benchmarks/bench_straight_strangers.py FOLDER [--size 300mm] [--lists DIR]

FOLDER has .rod files, as https://github.com/evouga/RibbonSim keeps them in configs. Their strips
are straight by design: lines near geodesics, with a normal for each segment. One row each: strips,
crossings, and by how much strips turn in their plane from crossing to crossing; --lists writes for
each a list of strips with their lengths and the marks of their crossings, scaled to a size, as
sticks.csv has them for jobs of ours.
"""

import argparse
import csv
import itertools
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from fabweave.core.units import parse_length

#: Files that say so have a version, and more of each rod.
_VERSIONED = -217
#: Marks that are nearer to one another are of one crossing.
_TIED_MM = 3.0


def read_rods(path):
    """Return rods, each closed or not with points and normals, and crossings of two each.

    A crossing is (rod, place) twice, a place being a segment's number and a share of it.
    """
    words = iter(path.read_text("utf-8").split())

    def numbers(count):
        return np.array([float(next(words)) for _ in range(count)])

    first, version = int(next(words)), 0
    if first == _VERSIONED:
        version, first = int(next(words)), int(next(words))
    n_crossings, rods = int(next(words)), []
    numbers(3)
    for _ in range(first):
        count, closed = int(next(words)), next(words) != "0"
        segments = count if closed else count - 1
        if version:
            numbers(2)
        points, normals = numbers(3 * count).reshape(-1, 3), numbers(3 * segments).reshape(-1, 3)
        numbers(segments * (1 + (version > 0) + (version > 1)))
        rods.append((closed, points, normals))
    crossings = []
    for _ in range(n_crossings):
        row = [float(word) for word in itertools.islice(words, 7 + 2 * (version > 1))]
        if len(row) < 7:  # some files end before they say
            break
        one, other, here, there, *shares = row[:6]
        crossings.append(((int(one), here + shares[0]), (int(other), there + shares[1])))
    return rods, crossings


def strip_of(closed, points, normals):
    """Return how far along each point is, and by how much a strip has turned in its plane there."""
    ends = np.concatenate([points, points[:1]]) if closed else points
    way = np.diff(ends, axis=0)
    length = np.linalg.norm(way, axis=1)
    way = way / length[:, None]
    before, after = way[:-1], way[1:]
    up = normals[:-1] * np.sign(np.einsum("nd,nd->n", normals[:-1], normals[1:]))[:, None]
    up = up + normals[1:]
    up /= np.maximum(np.linalg.norm(up, axis=1), 1e-12)[:, None]
    turn = np.degrees(np.einsum("nd,nd->n", np.cross(before, after), up))
    # A normal's sign is no one's concern: turns are told by size alone, span by span.
    return np.concatenate([[0.0], np.cumsum(length)]), np.concatenate([[0.0], turn, [0.0]])


def main():
    """Print a row for each design."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="300mm")
    parser.add_argument("--lists", type=Path)
    asked = parser.parse_args()
    size = parse_length(asked.size, what="size:")
    print("| design | strips | crossings | turn at a crossing, deg: median, 95 % | length m |")
    print("|---|--:|--:|--:|--:|")
    for path in sorted(asked.folder.glob("*.rod")):
        rods, crossings = read_rods(path)
        every = np.concatenate([points for _, points, _ in rods])
        scale = size / np.ptp(every, axis=0).max()
        marks = defaultdict(list)
        for number, (one, other) in enumerate(crossings):
            for (rod, place), (partner, _) in ((one, other), (other, one)):
                marks[rod].append((place, number, partner))
        turns, rows, total = [], [], 0.0
        for rod, (closed, points, normals) in enumerate(rods):
            if len(points) < 3:
                continue
            run, turn = strip_of(closed, points, normals)
            total += scale * run[-1]
            places, last = [], 0.0
            for mark in sorted(marks[rod]):
                # Strands are often tied in several places of one crossing.
                at = scale * np.interp(mark[0], np.arange(len(run)), run)
                if not places or at - last > _TIED_MM:
                    places.append(mark)
                    last = at
            for (start, *_), (end, *_) in itertools.pairwise(places):
                turns.append(abs(turn[int(start) + 1 : int(end) + 1].sum()))
            for station, (place, number, partner) in enumerate(places, start=1):
                along = scale * np.interp(place, np.arange(len(run)), run)
                rows.append([f"S{rod + 1}", f"{scale * run[-1]:.2f}", station, f"{along:.2f}",
                             number, f"S{partner + 1}"])  # fmt: skip
        middle, most = np.quantile(turns, [0.5, 0.95]) if turns else (0.0, 0.0)
        print(
            f"| {path.stem} | {len(rods)} | {len(rows) // 2} | {middle:.1f}, {most:.1f} | "
            f"{total / 1000:.1f} |"
        )
        if asked.lists is not None:
            asked.lists.mkdir(parents=True, exist_ok=True)
            with (asked.lists / f"{path.stem}.csv").open("w", newline="", encoding="utf-8") as file:
                table = csv.writer(file, lineterminator="\n")
                table.writerow(["strip", "length_mm", "mark", "at_mm", "crossing", "partner"])
                table.writerows(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
