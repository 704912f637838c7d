"""Measure the pictures of random late steps of a job's manual, and print a table.

Usage: ``python tests/tools/measure_manual.py FOLDER [STEPS [SEED]]``: the job is made again from
``FOLDER/job.toml``. What new pieces fill of their picture and of its width, what is seen of them
against the best of all views, what the step names that the picture hides, and of the names: how
many cover one another, their area against that of what is new, and the longest line to one.
"""

import sys
from pathlib import Path

import numpy as np

from fabweave.app.job_files import job_map
from fabweave.app.pipeline import make_job
from fabweave.app.settings import settings_from_job
from fabweave.assembly.manual.painting import NEW
from fabweave.assembly.manual.scene import build_scene
from fabweave.assembly.manual.step_pictures import step_pictures
from fabweave.assembly.manual.tags import place_tags
from fabweave.assembly.manual.views import VIEWS, seen_from_views
from fabweave.core.colour_space import light_of

#: The heads of the table, and from which share of the steps on they are late.
HEADS = ("step", "share", "width", "view", "hidden", "names", "covered", "tags/new", "longest mm")
LATE = 0.5


def measures(picture, seen):
    """Return what a row of the table says of a picture; ``seen`` of it from each view."""
    grey = light_of(np.asarray(picture.painted.image)) @ (0.2126, 0.7152, 0.0722)
    # Outlines of what is in place are darker than the lightest of what is new, but thin.
    columns = (grey < max(NEW) + 0.005).sum(axis=0)
    share = columns.sum() / grey.size
    bands = np.concatenate([ends.mean(axis=1) for ends in picture.ends])
    tags = place_tags(picture.marks, picture.size, picture.crossings, picture.radius, bands)
    covered = sum(
        bool(np.all(np.abs(one.middle - other.middle) < one.half + other.half))
        for at, one in enumerate(tags)
        for other in tags[:at]
    )
    area = sum(4.0 * tag.half.prod() for tag in tags) / np.prod(picture.size)
    return (
        f"{share:.1%}",
        f"{np.count_nonzero(columns) / len(columns):.0%}",
        f"{seen[VIEWS.index(picture.view)] / max(seen.max(), 1e-9):.2f}",
        sum(mark.hidden for mark in picture.marks),
        len(tags),
        covered,
        f"{area / max(share, 1e-9):.1f}",
        f"{max(np.linalg.norm(tag.line[1] - tag.line[0]) for tag in tags) * 25.4 / 72:.0f}",
    )


def main(folder, count=10, seed=7):
    """Print the table of a job."""
    job = make_job(settings_from_job(Path(folder) / "job.toml"))
    crossing_map = job_map(job)
    scene = build_scene(
        job.woven.ribbons, job.weave, job.piece_set.pieces, crossing_map, job.piece_colours
    )
    pictures = [picture for whole in step_pictures(scene, crossing_map) for picture in whole.steps]
    seen = seen_from_views(scene)[:, :, 1]
    late = np.arange(int(LATE * len(pictures)), len(pictures))
    rows = [HEADS]
    dice = np.random.default_rng(seed)
    for at in np.sort(dice.choice(late, min(count, len(late)), replace=False)).tolist():
        rows.append((crossing_map.steps[at].number, *measures(pictures[at], seen[:, at])))
    for row in rows:
        print("  ".join(str(cell).rjust(len(head)) for cell, head in zip(row, HEADS, strict=True)))


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
