"""A card shows what its piece meets, in order, with names clear of one another."""

from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest
import shapely
from drawn_jobs import drawn_job

from fabweave.show.manual.cards import lay_card, spread, what_is_met
from fabweave.show.manual.step_pictures import strand_pieces

WIDE = 254.0
SMALL = {}
LARGE = pytest.param(
    {"mesh": "shape:torus?m=16&n=8", "pattern": "twill", "size_mm": 400.0},
    marks=pytest.mark.slow,
)


def cards_of(crossing_map):
    """Yield each piece with its step and its card."""
    strands, pieces = strand_pieces(crossing_map), {one.id: one for one in crossing_map.pieces}
    joints = {joint.id: joint for joint in crossing_map.joints}
    step_of = {key: step.step for step in crossing_map.steps for key in step.pieces}
    for step in crossing_map.steps:
        for key in step.pieces:
            met = what_is_met(pieces[key], step, strands, joints, step_of, set())
            yield pieces[key], step, lay_card(pieces[key], met, WIDE, back=False)


@pytest.mark.slow
@pytest.mark.parametrize("job", [SMALL, LARGE])
def test_cards_tell_each_crossing_and_joint_of_all_steps_once(job):
    crossing_map = drawn_job(**job).plan
    crossings, joints, fastened = [], [], []
    # Where two pieces are joined, either may be there already.
    strands = defaultdict(set)
    for piece in crossing_map.pieces:
        for station in piece.stations:
            strands[station.crossing, station.over].add(piece.id)
    for piece, step, card in cards_of(crossing_map):
        stations = [name.met.station for name in card.names if name.met.over is not None]
        assert stations == sorted(set(stations))
        for name in card.names:
            station = piece.stations[name.met.station]
            if name.met.over is None:
                joints.append(int(name.met.text[1:].split(">")[0]))
                continue
            assert name.met.over == station.over
            met = strands[station.crossing, not station.over]
            assert set(name.met.text.split(" ")) & met or piece.id in name.met.text
            crossings.append((station.crossing, step.step))
            if name.met.complete:
                fastened.append((station.crossing, step.step))
    made = {(key, step.step) for step in crossing_map.steps for key in step.over + step.under}
    assert set(crossings) == made
    # Of two pieces that are joined while both are new, each has the joint on its card.
    ends = {one.id: one.joints for one in crossing_map.pieces}
    new = [(key, step) for step in crossing_map.steps for one in step.pieces for key in ends[one]]
    assert sorted(joints) == sorted(key for key, step in new if key in step.joints)
    assert set(joints) == {key for step in crossing_map.steps for key in step.joints}
    assert set(fastened) <= {(key, one.step) for one in crossing_map.steps for key in one.fasten}


@pytest.mark.parametrize("job", [SMALL, LARGE])
def test_names_stand_on_the_card_clear_of_one_another_and_of_the_piece(job):
    for _, _, card in cards_of(drawn_job(**job).plan):
        boxes = []
        for name in card.names:
            x, y = name.name
            boxes.append(shapely.box(x, y - 4.5, x + name.met.wide, y + 4.5))
            assert -0.5 <= x <= x + name.met.wide <= WIDE + 0.5
            assert -card.high <= y - 4.5
            assert y + 4.5 <= 0.0
        assert not any(
            one.intersects(other) for at, one in enumerate(boxes) for other in boxes[:at]
        )
        piece = shapely.Polygon(card.outline)
        assert not any(box.intersects(piece) for box in boxes)


def test_a_card_is_the_piece_drawn_smaller_with_its_start_at_the_left():
    for piece, _, card in cards_of(drawn_job(**SMALL).plan):
        true = np.array(piece.outline)
        ratio = [np.linalg.norm(np.roll(one, 1, 0) - one, axis=1) for one in (card.outline, true)]
        scale = ratio[0].sum() / ratio[1].sum()
        assert ratio[0] == pytest.approx(scale * ratio[1], abs=1e-6)
        # Its outer face is up: it is turned, never turned over.
        areas = [shapely.LinearRing(one).is_ccw for one in (card.outline, true)]
        assert areas[0] == areas[1]
        order = [name.at[0] for name in card.names if name.met.over is not None]
        assert all(one < other for one, other in pairwise(order))


@pytest.mark.parametrize("seed", range(20))
def test_names_in_a_row_are_clear_of_one_another_and_in_their_room(seed):
    dice = np.random.default_rng(seed)
    widths = dice.uniform(5.0, 30.0, 7).tolist()
    starts = spread(np.sort(dice.uniform(0.0, 254.0, 7)).tolist(), widths, 254.0)
    ends = [start + width for start, width in zip(starts, widths, strict=True)]
    assert starts[0] >= -1e-9
    assert ends[-1] <= 254.0 + 1e-9
    assert all(other - end >= 5.0 - 1e-9 for end, other in zip(ends, starts[1:], strict=False))
