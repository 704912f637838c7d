"""Small jobs with the pictures of their steps, made once for all tests of the manual."""

from functools import cache
from types import SimpleNamespace
from unittest import mock

from jobs import make_job, quick_jobs

from fabweave.job.write import job_map
from fabweave.options.settings import Settings
from fabweave.show.manual.painting import build_scene
from fabweave.show.manual.step_pictures import step_pictures


@cache
def drawn_job(mesh="shape:torus?m=8&n=4", *, size_mm=300.0, **changed):
    """Return a job, its crossing map (``plan``), its scene, and the pictures of its steps.

    Nothing is let go: the manual does not show what comes of that.
    """
    with quick_jobs(), mock.patch("fabweave.job.draw.let_job_go", return_value=None):
        job = make_job(Settings.of(mesh, size_mm=size_mm, effort="quick", **changed))
    plan = job_map(job)
    pieces, colours = job.piece_set.pieces, job.piece_colours
    scene = build_scene(job.woven.ribbons, job.weave, pieces, plan, colours, job.laid)
    return SimpleNamespace(job=job, plan=plan, scene=scene, pictures=step_pictures(scene, plan))
