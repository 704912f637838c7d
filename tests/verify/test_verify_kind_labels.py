"""Any piece of a kind bears the same letters at the same place, whatever place it takes."""

import numpy as np
import pytest
from replacing import replace
from sealing import result_of

from fabweave.verify.check.labels import check_labels
from fabweave.verify.check.pieces import check_kinds
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.report import Tally

# A whole job of its own stands behind each.
pytestmark = pytest.mark.slow

JOB = "shape:octahedron --size 200mm --refine catmull-clark:1 --labels kinds --effort quick"


@pytest.fixture(scope="module")
def job(finished) -> Job:
    return load_job(finished(*JOB.split()), Tally("files"))


def findings(job: Job, check=check_kinds) -> tuple[str, ...]:
    return result_of(check, job).findings


def with_piece(job: Job, change, which) -> Job:
    """The job with another piece in its map: the first of which something holds."""
    plan = job.map
    at = next(at for at, piece in enumerate(plan.pieces) if which(piece))
    pieces = (*plan.pieces[:at], change(plan.pieces[at]), *plan.pieces[at + 1 :])
    return replace(job, map=replace(plan, pieces=pieces))


def moved(piece, **by):
    labels = tuple(
        replace(one, **{key: getattr(one, key) + value for key, value in by.items()})
        for one in piece.labels
    )
    return replace(piece, labels=labels)


def test_pieces_bear_their_kind_at_the_same_place(job):
    plan = job.map
    assert len({piece.kind for piece in plan.pieces}) < len(plan.pieces) / 4
    assert any(piece.turned for piece in plan.pieces)
    for piece in plan.pieces:
        assert {label.text.rstrip("→") for label in piece.labels} == {f"K{piece.kind}"}
        assert all(label.hidden for label in piece.labels)
    assert findings(job) == ()
    assert findings(job, check_labels) == ()
    # Told apart from how it was made: distances to the stations do not change with any motion.
    for kind in {piece.kind for piece in plan.pieces}:
        far = []
        for piece in (piece for piece in plan.pieces if piece.kind == kind):
            label = piece.labels[0]
            away = np.hypot(*(piece.points - (label.x, label.y)).T)
            far.append(away[::-1] if piece.turned else away)
        assert np.ptp(far, axis=0).max() < 2e-3


@pytest.mark.parametrize("by", [{"x": 0.2}, {"y": -0.2}, {"rotation_deg": 180.0}])
def test_a_label_at_another_place_is_found(job, by):
    second = [piece for piece in job.map.pieces if piece.kind == 1][1]
    spoilt = with_piece(job, lambda piece: moved(piece, **by), lambda piece: piece is second)
    assert any("label stands" in one for one in findings(spoilt))


def test_a_piece_that_is_not_turned_as_is_said_is_found(job):
    spoilt = with_piece(job, lambda piece: replace(piece, turned=False), lambda piece: piece.turned)
    found = findings(spoilt)
    assert any("does not cover" in one or "label stands" in one for one in found), found


def test_another_kind_on_a_piece_is_found(job):
    def other(piece):
        labels = tuple(replace(one, text="K9→") for one in piece.labels)
        return replace(piece, labels=labels)

    last = job.map.pieces[-1]
    spoilt = with_piece(job, other, lambda piece: piece is last)
    assert any("what is engraved" in one for one in findings(spoilt))
    assert any("none of what it should tell" in one for one in findings(spoilt, check_labels))


def test_what_is_engraved_is_what_was_asked_for(job):
    spoilt = replace(job, map=replace(job.map, cut=replace(job.map.cut, labels="full")))
    assert any("what is engraved" in one for one in findings(spoilt, check_labels))
