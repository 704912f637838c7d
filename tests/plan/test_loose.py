"""What lies loose in a half-built object, by the words of the definition; and orders that hold."""

import numpy as np
import pytest
from assembly_models import model_of
from slow import slow_but

from fabweave.plan.loose import count_loose, find_clips, find_holds, strands_of
from fabweave.plan.order import plan_order

SMALL = ("shape:octahedron", "shape:torus?m=6&n=4", "shape:tube?m=6&n=2", "shape:hypar?m=4&n=3")


def joints_of(piece):
    return (piece.start_joint, piece.end_joint)


def loose_by_hand(pieces, fastened, order):
    """Return how many pieces lie loose after each, straight from what a maker sees."""
    due = np.zeros(len(fastened), dtype=int)
    for piece in pieces:
        np.add.at(due, piece.crossings, 1)
    there, result = [], []
    for number in order:
        there.append(number)
        np.subtract.at(due, pieces[number].crossings, 1)
        strands = [
            (other, crossing, over)
            for other in there
            for crossing, over in zip(pieces[other].crossings, pieces[other].over, strict=True)
        ]

        def is_held(own, stations, joint, strands=strands):
            tied = [due[crossing] == 0 for crossing, _ in stations if fastened[crossing]]
            if joint is not None and not fastened[stations[0][0]]:
                ends = [at for at, one in enumerate(pieces) if joint in joints_of(one)]
                tied.append(set(ends) <= set(there))
            if tied:
                return any(tied)
            ways = {
                over
                for crossing, over in stations
                if any(s[0] != own and s[1:] == (crossing, not over) for s in strands)
            }
            return len(ways) == 2

        loose = 0
        for own in there:
            piece = pieces[own]
            stations = list(zip(piece.crossings, piece.over, strict=True))
            half = max((len(stations) + 1) // 2, 2)
            loose += not (
                is_held(own, stations[:half], piece.start_joint)
                and is_held(own, stations[::-1][:half], piece.end_joint)
            )
        result.append(loose)
    return result


@pytest.mark.slow
@pytest.mark.parametrize("shape", SMALL)
@pytest.mark.parametrize("seed", [0, 1])
def test_what_lies_loose_is_what_the_words_say(shape, seed):
    made, random = model_of(shape).made, np.random.default_rng(seed)
    order = random.permutation(len(made.pieces)).tolist()
    for fastened in (made.fastened, ~made.fastened, random.random(len(made.fastened)) < 0.3):
        found = count_loose(find_holds(made.pieces, fastened), order)
        assert found.tolist() == loose_by_hand(made.pieces, fastened, order)


def test_nothing_is_loose_at_the_end_if_all_is_fastened():
    made = model_of("shape:torus?m=6&n=4").made
    every = np.ones_like(made.fastened)
    assert count_loose(find_holds(made.pieces, every), range(len(made.pieces)))[-1] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "changed"),
    slow_but(
        [
            ("shape:sphere?n=6", {}),
            ("shape:torus?m=24&n=12", {"pattern": "twill"}),
            ("shape:icosahedron", {"pattern": "triaxial", "refine": "loop:1"}),
        ]
    ),
)
def test_few_pieces_lie_loose_and_none_in_the_end(shape, changed):
    woven = model_of(shape, 400.0, **changed)
    found = plan_order(
        woven.made.pieces, woven.centres, woven.normals, woven.made.fastened,
        enclosed=True, effort="quick", seed=0,
    )  # fmt: skip
    by_number = count_loose(
        find_holds(woven.made.pieces, woven.made.fastened), range(len(woven.made.pieces))
    )
    assert found.loose.max() <= 9
    assert found.loose.sum() < 0.5 * by_number.sum()
    assert found.loose[-1] == 0


@pytest.mark.parametrize("shape", SMALL)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_ends_that_stay_loose_are_clipped_to_what_is_there(shape, seed):
    pieces, fastened = model_of(shape).made.pieces, model_of(shape).made.fastened
    order = np.random.default_rng(seed).permutation(len(pieces)).tolist()
    holds, rank = find_holds(pieces, fastened), np.argsort(order).tolist()
    clips, strands = find_clips(pieces, holds, order), strands_of(pieces)
    for clip in clips:
        one, other = clip.pieces
        assert max(rank[one], rank[other]) <= clip.since < clip.until
        assert set(pieces[one].crossings) & set(pieces[other].crossings)
    for now in range(len(order)):
        held = [set(clip.pieces) for clip in clips if clip.since <= now < clip.until]
        for piece in order[: now + 1]:
            own = list(zip(pieces[piece].crossings, pieces[piece].over, strict=True))
            half = max((len(own) + 1) // 2, 2)
            for end, near in zip(holds.ends[piece], (own[:half], own[-half:]), strict=True):
                facing = {(crossing, not over) for crossing, over in near}
                met = {other for strand in facing for other in strands.get(strand, ())}
                met = {other for other in met - {piece} if rank[other] <= now}
                if met and holds.end_from(end, rank, len(order)) > now:
                    assert any(piece in two and two - {piece} <= met for two in held)


def test_a_ring_of_one_piece_is_clipped_to_itself_until_its_fastener_is_set():
    made = model_of("shape:icosahedron", 80.0, pattern="kagome", strips="straight").made
    pieces, order = made.pieces, list(range(len(made.pieces)))
    rings = [at for at, one in enumerate(pieces) if one.start_joint == one.end_joint is not None]
    assert rings == order
    holds = find_holds(pieces, made.fastened)
    to_itself = [clip for clip in find_clips(pieces, holds, order) if len(set(clip.pieces)) == 1]
    # Nothing else is there that could hold the first.
    assert (to_itself[0].pieces, to_itself[0].since) == ((0, 0), 0)
    for clip in to_itself:
        piece = pieces[clip.pieces[0]]
        assert clip.crossing == piece.crossings[0] == piece.crossings[-1]
        assert clip.since == clip.pieces[0]
        assert clip.until == holds.set_at(clip.crossing, order) > clip.since
