"""What the tests of the viewer share: jobs to look at, and rays of their own."""

import json
import re
from dataclasses import replace
from unittest import mock

import numpy as np
from jobs import make_job, quick_jobs

from fabweave.job.papers import job_viewer
from fabweave.job.write import job_map
from fabweave.nest.layout import Layout, Placement
from fabweave.options.settings import Settings
from fabweave.stock.sheet_size import SheetSize


def make_page(shape, size_mm, *, across=2, **settings):
    """Make a job's viewer without the work of nesting and letting go: pieces are put down in rows.

    Returns
    -------
    (page, crossing_map, job)
        The page, the crossing map, and the job.
    """

    def laid(outlines, *_, **__):
        return put_down(outlines, across)

    with (
        quick_jobs(),
        mock.patch("fabweave.nest.pins.nest", laid),
        mock.patch("fabweave.job.draw.let_job_go", return_value=None),
    ):
        job = make_job(Settings.of(shape, size_mm=size_mm, effort="quick", **settings))
    crossing_map = job_map(job)
    return job_viewer(job, crossing_map, job.costs), crossing_map, job


def put_down(outlines, across):
    """Lay pieces in rows, each turned a little; nothing overlaps, and nothing is saved."""
    placements, tops = [], [10.0] * across
    wide = max(np.hypot(*np.ptp(outline, axis=0)) for outline in outlines) + 20.0
    for number, outline in enumerate(outlines):
        turn = 5.0 * (number % 5)
        turned = Placement(number, 0, turn, 0.0, 0.0).apply(outline)
        low, sheet = turned.min(axis=0), number % across
        placements.append(
            Placement(number, sheet, turn, float(10.0 - low[0]), float(tops[sheet] - low[1]))
        )
        tops[sheet] += float(np.ptp(turned[:, 1])) + 3.0
    sheets = [SheetSize(float(wide), top + 10.0) for top in tops]
    # The last one lacks a corner, and has a hole in it.
    wide, high = sheets[-1].width_mm, sheets[-1].height_mm
    sheets[-1] = replace(
        sheets[-1],
        outline=((0.0, 0.0), (wide, 0.0), (wide, high - 8.0), (wide - 8.0, high), (0.0, high)),
        defects=(((1.0, 1.0), (6.0, 1.0), (1.0, 6.0)),),
    )
    return Layout(tuple(sheets), tuple(placements), 10.0, 3.0)


def page_data(page):
    """Return the data of a page."""
    return json.loads(re.search(r'<script id="data"[^>]*>(.*?)</script>', page, re.S)[1])


def triangles_of(viewer):
    """Return corners (T, 3, 3) and piece (T,) of all strips, from what the verifier read."""
    corners, owners, first = [], [], 0
    for piece, count in enumerate(viewer.counts.tolist()):
        for k in range(first, first + count - 1):
            (a, d), (b, c) = viewer.rungs[k], viewer.rungs[k + 1]
            quad = [(a, c, d), (a, b, c)] if viewer.from_right[k] else [(a, b, d), (b, c, d)]
            corners += quad
            owners += [piece, piece]
        first += count
    return np.array(corners), np.array(owners)


def shoot(corners, origin, way):
    """Return for each triangle how far along a ray it is hit; infinity where it is not."""
    a = corners[:, 0]
    u, v = corners[:, 1] - a, corners[:, 2] - a
    across = np.cross(way, v)
    det = np.einsum("ij,ij->i", u, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.einsum("ij,ij->i", origin - a, across) / det
        q = np.cross(origin - a, u)
        t = np.einsum("j,ij->i", way, q) / det
        far = np.einsum("ij,ij->i", v, q) / det
    return np.where((s >= 0) & (t >= 0) & (s + t <= 1) & (far > 0), far, np.inf)
