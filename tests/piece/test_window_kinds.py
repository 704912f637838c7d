"""Stretches of threads that are the same piece are known by numbers, and no others are taken."""

from itertools import product

import numpy as np
import pytest

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.piece.split.candidates import lay_course, list_sites, measure_windows, station_of_site
from fabweave.piece.split.repeats import KindPrices, repeating, window_kinds
from fabweave.ribbon.project import project_ribbons
from fabweave.weave.pattern import plain_weave
from fabweave.weave.symmetry import find_weave_symmetry
from fabweave.weave.threads import trace_threads

MOST = 9


def letter(cells: list[tuple[int, int, int]]) -> PolyMesh:
    """Return the surface of cubes of 10 mm, as squares."""
    corners: dict[tuple[int, ...], int] = {}
    faces = []
    for cell, axis, side in product(cells, range(3), (0, 1)):
        beyond = list(cell)
        beyond[axis] += 2 * side - 1
        if tuple(beyond) in cells:
            continue
        ring = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 2 * side - 1]:
            corner = list(cell)
            corner[axis] += side
            corner[(axis + 1) % 3] += a
            corner[(axis + 2) % 3] += b
            ring.append(corners.setdefault(tuple(corner), len(corners)))
        faces.append(ring)
    return PolyMesh.from_faces(10.0 * np.array(list(corners), dtype=float), faces)


def windows_of(mesh: PolyMesh):
    """Return the weave, the course, the sites, the windows and their kinds."""
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.5)
    course, sites = lay_course(ribbons, MOST), list_sites(weave)
    windows = measure_windows(course, sites, most_passes=MOST, longest_mm=np.inf)
    return weave, course, sites, windows, window_kinds(course, sites, windows, weave.over)


def apart(one, other) -> float:
    """Return how far two stretches of rungs are apart when they are laid on one another."""

    def off(ends: np.ndarray) -> float:
        if ends.shape != other.shape:
            return np.inf
        z, w = ((each - each.mean(axis=0)) @ [1.0, 1.0j] for each in (ends, other))
        turn = np.vdot(z, w)
        return float(np.abs(z * turn / abs(turn) - w).max())

    return min(off(one), off(one[::-1]))


@pytest.mark.parametrize(
    "cells",
    [
        [(x, 0, 0) for x in range(3)] + [(2, 1, 0), (0, 0, 1), (0, 0, 2)],
        [(x, 0, 0) for x in range(4)] + [(3, 1, 0), (1, 0, 1), (1, 0, 2)],
    ],
    ids=["six", "seven"],
)
def test_windows_are_of_one_kind_just_where_one_covers_the_other(cells):
    weave, course, sites, windows, kinds = windows_of(letter(cells))
    mesh = letter(cells)
    assert find_weave_symmetry(mesh, build_halfedges(mesh), weave).group.n_rotations == 1
    assert repeating(kinds)
    row, ahead = np.nonzero(windows.passes)
    first = station_of_site(course, sites)[row]
    strips = course.stretches(first, first + windows.passes[row, ahead] - 1)
    of_kind: dict[int, list[np.ndarray]] = {}
    for at, kind in enumerate(kinds[row, ahead].tolist()):
        rungs = slice(strips.offsets[at], strips.offsets[at + 1])
        # Turned end for end, what was right is left.
        ends = np.concatenate((strips.right[rungs], strips.left[rungs][::-1]))
        of_kind.setdefault(kind, []).append(ends)
    leaders = [some[0] for some in of_kind.values()]
    for some in of_kind.values():
        assert max(min(apart(one, some[0]), apart(half_turned(one), some[0])) for one in some) < 0.1
    for at, leader in enumerate(leaders):
        for other in leaders[:at]:
            assert min(apart(leader, other), apart(half_turned(leader), other)) > 1e-3


def half_turned(ends: np.ndarray) -> np.ndarray:
    """Return a stretch walked from its other end: its right side becomes its left one."""
    return np.roll(ends, len(ends) // 2, axis=0)


def test_a_kind_that_is_there_costs_nothing_more():
    kinds = np.array([[0, 2], [0, -1], [1, 2]])
    prices = KindPrices(kinds, 12.0)
    # Two windows of one step in kind 0, two of two steps in kind 2: half of them fit in a row.
    assert prices.costs(np.array([0, 1, 2])).tolist() == [[6.0, 12.0], [6.0, 0.0], [12.0, 12.0]]
    prices.add(np.array([0]), np.array([1]))
    assert prices.costs(np.array([0, 2])).tolist() == [[6.0, 0.0], [12.0, 0.0]]
    prices.add(np.array([2]), np.array([1]), -1)
    assert prices.costs(np.array([2])).tolist() == [[12.0, 12.0]]
