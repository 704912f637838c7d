"""How much engraving is seen is proved from sheets and model: what is not true is found out."""

from dataclasses import replace

import numpy as np
import pytest

from fabweave.verify.checks.sheets.exposure import check_exposure
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.statement import Tally

HIDDEN = "shape:octahedron --size 200mm --effort quick"


@pytest.fixture(scope="module")
def job(finished) -> Job:
    return load_job(finished(*HIDDEN.split()), Tally("files"))


def findings(job: Job) -> tuple[str, ...]:
    tally = Tally("seen")
    check_exposure(job, tally)
    return tally.result().findings


def with_pieces(job: Job, change) -> Job:
    """The job with other pieces in its map, which is read anew: its lookups are its own."""
    plan = job.map
    pieces = tuple(map(change, plan.pieces))
    lookups = ("thread", "crossing", "piece", "joint", "sheet")
    return replace(job, map=replace(plan, pieces=pieces, **{name: {} for name in lookups}))


def with_totals(job: Job, **changes) -> Job:
    totals = {**job.waste["totals"], **changes}
    return replace(job, waste={**job.waste, "totals": totals})


def moved(piece, by: np.ndarray):
    return tuple(replace(one, x=one.x + by[0], y=one.y + by[1]) for one in piece.labels)


def test_a_job_shows_none_of_its_letters(job):
    assert findings(job) == ()
    assert job.waste["totals"]["engrave_seen_mm"] == 0.0
    assert isinstance(job.map, CrossingMap)
    assert all(label.hidden for piece in job.map.pieces for label in piece.labels)


def test_letters_beside_their_cover_are_seen(job):
    # The sheets stay as they are; the map says that the pieces lie elsewhere below them.
    def shift(piece):
        away = np.array([30.0, 0.0])
        turn = np.deg2rad(piece.rotation_deg)
        back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ away
        return replace(piece, shift=piece.shift - away, labels=moved(piece, back))

    found = findings(with_pieces(job, shift))
    assert any("of the hidden" in finding and "is seen" in finding for finding in found), found
    # Where the map leaves the labels behind, what is seen is missed in the sum.
    found = findings(with_pieces(job, lambda piece: replace(shift(piece), labels=())))
    assert any("engrave_seen_mm" in finding for finding in found), found


def test_a_strand_that_is_not_above_covers_nothing(job):
    def swap(piece):
        stations = tuple(replace(one, over=not one.over) for one in piece.stations)
        return replace(piece, stations=stations)

    found = findings(with_pieces(job, swap))
    assert any("is seen" in finding for finding in found), found


@pytest.mark.parametrize("stated", [12.0, None])
def test_a_length_that_is_not_so_is_found(job, stated):
    assert any(
        "engrave_seen_mm" in one for one in findings(with_totals(job, engrave_seen_mm=stated))
    )


def test_only_ids_may_be_seen(job):
    def show(piece):
        labels = tuple(replace(one, hidden=None) for one in piece.labels)
        return replace(piece, labels=labels)

    found = findings(with_pieces(job, show))
    assert any("is not hidden, and is no id" in finding for finding in found)
    assert not any("id label" in finding for finding in found)


def test_nothing_is_hidden_that_was_not_to_be(job):
    settings = {**job.settings, "job": {**job.settings["job"], "labels": "brief"}}
    brief = replace(job, settings=settings)
    assert any("none was to be" in finding for finding in findings(brief))
    bare = with_pieces(brief, lambda piece: replace(piece, labels=()))
    (found,) = findings(bare)
    assert "engrave_seen_mm is told where labels are not hidden" in found
