"""Ribbons go with their crossings when an object is let go; what is told is what was found."""

import numpy as np
import pytest
from jobs import laid

from fabweave.core.records import from_json, to_json
from fabweave.form.body import BARE, body_of
from fabweave.form.relaxed import FormRecord, form_record, relaxed_ribbons
from fabweave.form.settle import settle
from fabweave.plan.ask import brief_of
from fabweave.show.files import json_text


@pytest.fixture(scope="module", params=["end", "turn"])
def shade(request):
    """A lampshade, and what becomes of it."""
    woven, settings, supplies = laid(
        "shape:tube?m=8&n=4", size_mm=200.0, boundary=request.param, load="10g@top"
    )
    body = body_of(woven, brief_of(settings, supplies))
    return woven, settle(body, np.full(len(body.places), BARE))


def test_nothing_moves_that_was_not_let_go(shade):
    woven, settled = shade
    same = relaxed_ribbons(woven.ribbons, woven.weave, settled.body.wished, settled.body.wished)
    for name in ("right", "left", "centre", "normal"):
        assert getattr(same, name) == pytest.approx(getattr(woven.ribbons, name), abs=1e-9)


def test_panels_go_with_their_crossings_and_keep_their_form(shade):
    woven, settled = shade
    before = woven.ribbons
    after = relaxed_ribbons(
        before, woven.weave, settled.body.wished, settled.states["let go"].state
    )
    assert after.centre == pytest.approx(settled.rested, abs=1e-12)
    assert np.linalg.norm(after.normal, axis=1) == pytest.approx(1.0)
    corners = [
        np.stack([each.right[at], each.left[at], each.right[at + 1], each.left[at + 1]], axis=1)
        for each, at in ((before, before.entry), (after, before.entry))
    ]
    sides = [np.linalg.norm(each[:, :, None] - each[:, None], axis=3) for each in corners]
    assert sides[0] == pytest.approx(sides[1], abs=1e-9)
    # Panels stay as far above and below their crossings, and level with them.
    own = woven.weave.threads.crossing
    for each, ribbons in zip(corners, (before, after), strict=True):
        height = np.einsum("pcd,pd->pc", each - ribbons.centre[own][:, None], ribbons.normal[own])
        assert np.ptp(height, axis=1).max() < 1e-6
    moved = np.linalg.norm(corners[1].mean(axis=1) - corners[0].mean(axis=1), axis=1)
    assert moved.max() == pytest.approx(settled.form.settles_mm, rel=0.2)


def test_strands_turn_on_one_another_as_angles_tell(shade):
    woven, settled = shade
    state, wished = settled.states["let go"].state, settled.body.wished
    after = relaxed_ribbons(woven.ribbons, woven.weave, wished, state)

    def angles(ribbons):
        middle = (ribbons.right + ribbons.left) / 2
        way = middle[ribbons.entry + 1] - middle[ribbons.entry]
        way /= np.linalg.norm(way, axis=1)[:, None]
        own, over = woven.weave.threads.crossing, woven.weave.over
        pair = np.empty((len(ribbons.centre), 2, 3))
        pair[own, over.astype(int)] = way
        below, above = pair[:, 0], pair[:, 1]
        return np.arctan2(
            np.einsum("nd,nd->n", np.cross(above, below), ribbons.normal),
            np.einsum("nd,nd->n", above, below),
        )

    turned = angles(after) - angles(woven.ribbons)
    assert turned == pytest.approx(state.angles - wished.angles, abs=1e-6)
    assert np.abs(turned).max() > 1e-3


def test_what_is_told_comes_back_from_what_is_written(shade):
    record = form_record(shade[1])
    assert [one.name for one in record.states] == ["let go", "standing", "loaded"]
    assert from_json(FormRecord, json_text(to_json(record))) == record
    assert record.load_n[0][1] == pytest.approx(0.0981)
