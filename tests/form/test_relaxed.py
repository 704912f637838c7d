"""The strips of an object that was let go are those that are cut; what is told was found."""

import numpy as np
import pytest
from jobs import laid

from fabweave.core.records import from_json, to_json
from fabweave.form.body import BARE, body_of
from fabweave.form.relaxed import (
    PARTS,
    FormRecord,
    form_record,
    relaxed_ribbons,
    shown_relaxed,
)
from fabweave.form.settle import settle
from fabweave.job.ask import brief_of
from fabweave.job.write import json_text
from fabweave.piece.development import run_rungs, unfold


def flat(ribbons):
    """Return where rungs lie in the plane, strip after strip."""
    threads = np.arange(len(ribbons.closed))
    offsets, rung = run_rungs(ribbons, threads, 0 * threads, np.diff(ribbons.offsets) - 1)
    return unfold(ribbons, offsets, rung)


@pytest.fixture(
    scope="module",
    params=[
        ("shape:tube?m=8&n=4", {"size_mm": 200.0, "boundary": "end", "load": "10g@top"}),
        ("shape:tube?m=8&n=4", {"size_mm": 200.0, "boundary": "turn", "load": "10g@top"}),
        ("shape:icosahedron", {"size_mm": 200.0, "pattern": "kagome", "strips": "straight",
                               "refine": "loop:1"}),
    ],
)  # fmt: skip
def shade(request):
    """An object, what becomes of it, and its strips then."""
    asked, options = request.param
    woven, settings, supplies = laid(asked, **options)
    body = body_of(woven, brief_of(settings, supplies))
    settled = settle(body, np.full(len(body.places), BARE))
    state = settled.states["let go"].state
    return woven, settled, relaxed_ribbons(woven.ribbons, woven.weave, body, state)


def test_relaxed_strips_unfold_to_those_that_are_cut(shade):
    woven, _, bands = shade
    cut = flat(woven.ribbons)
    thread = np.repeat(np.arange(len(bands.closed)), np.diff(woven.ribbons.offsets))
    within = np.arange(woven.ribbons.n_rungs) - woven.ribbons.offsets[thread]
    fine = flat(bands)
    at = bands.offsets[thread] + PARTS * within
    assert fine.right[at] == pytest.approx(cut.right, abs=1e-4)
    assert fine.left[at] == pytest.approx(cut.left, abs=1e-4)


def test_pictures_show_flat_panels_that_lie_on_one_another(shade):
    woven, settled, _ = shade
    state = settled.states["let go"].state
    shown = shown_relaxed(woven.ribbons, woven.weave, settled.body, state)
    own, panel = woven.weave.threads.crossing, shown.entry
    sides = (shown.right[panel], shown.left[panel], shown.right[panel + 1], shown.left[panel + 1])
    corners = np.stack(sides, axis=1) - shown.centre[own][:, None]
    height = np.einsum("pcd,pd->pc", corners, shown.normal[own])
    assert np.ptp(height, axis=1).max() < 1e-6


def test_what_is_told_comes_back_from_what_is_written(shade):
    record = form_record(shade[1], 0.25)
    loaded = int(shade[1].body.load.any())
    assert [one.name for one in record.states] == ["let go", "standing", "loaded"][: 2 + loaded]
    assert from_json(FormRecord, json_text(to_json(record))) == record
    assert record.strips_mm == 0.25
    assert [mass for _, mass in record.load_n] == pytest.approx([0.0981] * loaded)
