"""The steps of the manual: what is new is seen and named, and the object is turned seldom.

Measures and their sources: share of what is new, contrast (WCAG 2.2, 1.4.11), height of capitals
(NUREG-0700, 11.4.1.5), turns.
"""

from itertools import pairwise, product

import numpy as np
import pytest
from drawn_jobs import drawn_job
from slow import slow_but

from fabweave.core.colour_space import light_of
from fabweave.estimate.assembly_time import step_seconds
from fabweave.picture.camera import frame_object
from fabweave.picture.zbuffer import nearest_triangles
from fabweave.show.manual.painting import (
    BLACK,
    BOARD,
    FIXED,
    NEW,
    OUTLINE,
    POINTS_PX,
    THERE,
    make_palette,
)
from fabweave.show.manual.step_pictures import (
    MOST_NUMBERS,
    MOST_TAGS,
    VIEWS,
    choose_views,
    seen_from_views,
    shown_shares,
    stations_of_half,
    strand_pieces,
)
from fabweave.show.manual.tags import place_tags

LARGE = pytest.param(
    {"mesh": "shape:torus?m=16&n=8", "pattern": "twill", "size_mm": 400.0},
    marks=pytest.mark.slow,
)
SMALL = {}
KAGOME = pytest.param(
    {"mesh": "shape:icosahedron", "pattern": "kagome", "refine": "loop:1"}, marks=pytest.mark.slow
)


def made(settings):
    found = drawn_job(**settings)
    return found.job, found.plan, found.scene, found.pictures


def steps_of(pictures):
    return [picture for whole in pictures for picture in whole.steps]


def halves_of(picture):
    """Return the pictures of a step, each with the half that it shows, or none."""
    if picture.other is None:
        return [(None, picture)]
    return [(0, picture), (1, picture.other)]


def all_pictures(pictures):
    return [one for picture in steps_of(pictures) for _, one in halves_of(picture)]


def luminance(colours):
    return light_of(np.asarray(colours)) @ (0.2126, 0.7152, 0.0722)


def contrast(one, other):
    light, dark = max(one, other), min(one, other)
    return (light + 0.05) / (dark + 0.05)


# --- tones --------------------------------------------------------------------------------------


def test_new_and_in_place_and_paper_differ_in_grey_too():
    dice = np.random.default_rng(1)
    tones = luminance(make_palette(dice.integers(0, 256, (200, 3)).astype(np.uint8)).tones)
    there, new = tones[:, : len(THERE)], tones[:, len(THERE) :]
    assert contrast(new.max(), there.min()) >= 3.0
    outline, black = luminance(FIXED)[[OUTLINE, BLACK]]
    assert contrast(outline, 1.0) >= 3.0
    assert contrast(black, there.min()) >= 7.0
    assert tones == pytest.approx(np.tile((*THERE, *NEW), (len(tones), 1)), abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("settings", [SMALL, LARGE])
def test_what_is_new_is_seen(settings):
    """The new pieces fill a fair share of the picture; once all of it was 0.7 %."""
    _, _, _, pictures = made(settings)
    dark = []
    for picture in steps_of(pictures):
        grey = luminance(np.asarray(picture.painted.image))
        # Outlines of what is in place are darker than the lightest of what is new, but thin.
        columns = (grey < max(NEW) + 0.005).sum(axis=0)
        dark.append((columns.sum() / grey.size, np.count_nonzero(columns) / grey.shape[1]))
    share, wide = np.array(dark).T
    assert np.mean(share >= 0.007) >= 0.95
    assert np.mean((share >= 0.02) | (wide >= 0.5)) >= 0.7
    assert np.median(share) >= 0.03


@pytest.mark.parametrize("settings", [SMALL, LARGE])
def test_a_picture_is_drawn_to_its_scale_and_holds_what_is_new(settings):
    _, crossing_map, scene, pictures = made(settings)
    numbers = {piece.id: at for at, piece in enumerate(crossing_map.pieces)}
    for step, picture in zip(crossing_map.steps, steps_of(pictures), strict=True):
        for key, ends in zip(step.pieces, picture.ends, strict=True):
            inside = np.all((ends >= 0.0) & (ends <= picture.size), axis=2)
            # What is drawn so large that not all of it has room is seen whole beside that.
            assert inside.all() or (inside.any() and picture.place)
            true = scene.rung_ends(numbers[key]) @ picture.view.axes()[:2].T
            spans = [np.ptp(points.reshape(-1, 2), axis=0) for points in (ends, true)]
            assert spans[0] * 25.4 / 72 * picture.ratio == pytest.approx(spans[1], rel=1e-6)


def test_what_is_hidden_of_a_new_piece_is_hatched():
    """Wherever a new piece is, its own dark tone is near, whatever is in front of it."""
    _, _, _, pictures = made(SMALL)
    for at, picture in enumerate(all_pictures(pictures)):
        size = picture.painted.width_px, picture.painted.height_px
        points = np.concatenate([ends.reshape(-1, 2) for ends in picture.ends]) / POINTS_PX
        dark = luminance(np.asarray(picture.painted.image)) < max(NEW) + 0.005
        middles = points.reshape(-1, 2, 2).mean(axis=1)
        middles = middles[np.all((middles > 0.0) & (middles < size), axis=1)]
        for across, up in middles.round().astype(int).tolist():
            down = size[1] - up
            around = dark[max(down - 12, 0) : down + 12, max(across - 12, 0) : across + 12]
            assert around.any(), (at, across, down)


# --- names --------------------------------------------------------------------------------------


def tags_of(picture):
    bands = np.concatenate([ends.mean(axis=1) for ends in picture.ends])
    return place_tags(picture.marks, picture.size, picture.crossings, picture.radius, bands)


@pytest.mark.parametrize("settings", [SMALL, LARGE])
def test_every_piece_that_a_step_names_is_named_in_its_picture(settings):
    _, crossing_map, _, pictures = made(settings)
    strands, there = strand_pieces(crossing_map), set()
    pieces = {piece.id: piece for piece in crossing_map.pieces}
    for step, picture in zip(crossing_map.steps, steps_of(pictures), strict=True):
        (key,) = step.pieces
        there.add(key)
        piece, met = pieces[key], []
        for at, one in enumerate(piece.stations):
            if one.crossing in (step.over if one.over else step.under):
                others = strands[one.crossing, not one.over]
                names = " ".join(other for other in others if other in there)
                met.append((at, "over" if one.over else "under", names))
        ways = [word for _, word, _ in met]
        for half, shown in halves_of(picture):
            own = stations_of_half(len(piece.stations), half)
            # What is met is numbered, as on the card; where that is much, by numbers alone.
            wanted = {("new", key)}
            ends = [one for one, at in zip(piece.joints, (0, len(piece.stations) - 1), strict=True)
                    if at in own]  # fmt: skip
            made_there = [one for one in step.joints if one in ends]
            wanted |= {("joint", f"#{one}") for one in made_there}
            count = sum(at in own for at, _, _ in met)
            names = count + len(made_there) + 1 + (half != 1)
            many = names > MOST_TAGS
            for number, (at, word, others) in enumerate(met, start=1):
                # Where over and under take turns in a long run, only its ends are numbered.
                turns = ways[number - 2 : number + 1] in (["over", "under", "over"],
                                                          ["under", "over", "under"])  # fmt: skip
                bare = many and count > MOST_NUMBERS and turns and 1 < number < len(met)
                if at in own and not bare:
                    wanted.add((word, f"{number}" if many else f"{number} {others}"))
            named = {(mark.kind, mark.text) for mark in shown.marks} - {("start", "start")}
            if piece.joints[0] == piece.joints[1]:
                named -= {one for one in named if one[0] == "joint"}
                wanted -= {one for one in wanted if one[0] == "joint"}
            assert named == wanted
            starts = [mark.at for mark in shown.marks if mark.kind == "start"]
            first = shown.ends[0][0].mean(axis=0)
            seen = half != 1 and np.all((first > 0.0) & (first < shown.size))
            assert np.array(starts).reshape(-1, 2) == pytest.approx(
                np.array([first] * bool(seen)).reshape(-1, 2), abs=0.5
            )
            tags = {tag.mark.text for tag in tags_of(shown)} - {"start"}
            assert {text for _, text in wanted} <= tags


@pytest.mark.parametrize("settings", [SMALL, LARGE])
def test_names_are_in_the_picture_clear_of_one_another_and_of_crossings(settings):
    _, _, _, pictures = made(settings)
    crowded = covered = far = count = 0
    for picture in all_pictures(pictures):
        tags = tags_of(picture)
        count += len(tags)
        for tag in tags:
            assert np.all(tag.middle - tag.half >= 0.0)
            assert np.all(tag.middle + tag.half <= picture.size)
            away = np.maximum(np.abs(picture.crossings - tag.middle) - tag.half, 0.0)
            covered += bool(np.any(np.linalg.norm(away, axis=1) < picture.radius))
            far += float(np.linalg.norm(tag.line[1] - tag.line[0])) > 15.0 / 25.4 * 72.0
        for at, tag in enumerate(tags):
            crowded += any(
                np.all(np.abs(tag.middle - other.middle) < tag.half + other.half)
                for other in tags[:at]
            )
    assert crowded == 0
    assert far == 0
    assert covered <= 0.03 * count


# --- views --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("enough", [0.4, 0.9])
def test_every_view_shows_enough_and_none_turns_the_object_less(seed, enough):
    seen = np.random.default_rng(seed).integers(1, 9, (3, 6)).astype(float)
    shares = shown_shares(seen, seen)
    assert shares == pytest.approx(seen / seen.max(axis=0))
    way = choose_views(shares, enough)
    assert shares[way, np.arange(6)].min() >= enough
    turns = [
        sum(one != other for one, other in pairwise(some))
        for some in product(range(3), repeat=6)
        if shares[list(some), np.arange(6)].min() >= enough
    ]
    assert np.count_nonzero(np.diff(way)) == min(turns)


def test_what_a_view_shows_is_what_is_seen_when_it_is_placed():
    """Step by step, as a plain z-buffer of all that is there finds it."""
    _, _, scene, _ = made(SMALL)
    seen = seen_from_views(scene)[0]
    frame = scene.frame(VIEWS[0], (180, 140))
    points = frame.pixels(scene.points)
    for step in range(scene.n_steps):
        there = np.flatnonzero(scene.step <= step)
        there = there[np.argsort(scene.step[there], kind="stable")]
        found, _ = nearest_triangles(points, scene.triangles[there], width=180, height=140)
        shown = there[found[found >= 0]]
        inner = scene.normals[shown] @ VIEWS[0].axes()[2] < 0.0
        new = np.flatnonzero(scene.step_of_piece == step)
        outside, inside = (
            [np.count_nonzero(scene.piece[shown[way]] == one) for one in new]
            for way in (~inner, inner)
        )
        assert seen[step][:3].tolist() == [min(outside), sum(outside), sum(inside)]
        assert seen[step][3:].sum() == sum(outside)


@pytest.mark.parametrize("settings", [SMALL, LARGE])
def test_the_object_is_turned_in_an_eighth_of_the_steps_and_that_is_told(settings):
    _, crossing_map, _, pictures = made(settings)
    turned = [False, *(one.view != other.view for one, other in pairwise(pictures))]
    assert [whole.turned for whole in pictures] == turned
    assert sum(turned) <= len(crossing_map.steps) / 8
    for whole in pictures:
        # What is drawn from elsewhere is shown as it is held, too.
        assert all(picture.view == whole.view or picture.place for picture in whole.steps)


@pytest.mark.parametrize("settings", [SMALL, KAGOME, LARGE])
def test_early_steps_are_seen_from_a_seat_and_no_strip_from_its_edge(settings):
    """The share of a strip that faces the eye, by the areas of its triangles in space and flat."""
    _, crossing_map, scene, pictures = made(settings)
    views = [(whole.view, picture) for whole in pictures for picture in whole.steps]
    there = 0
    for at, (step, (held, picture)) in enumerate(zip(crossing_map.steps, views, strict=True)):
        early = there < len(crossing_map.pieces) / 4
        assert scene.early[at] == early
        if early:
            assert picture.place
            assert 20.0 <= held.elevation_deg <= 55.0
        there += len(step.pieces)
        worst = {view: least_faced(scene, at, view) for view in VIEWS}
        seats = [view for view in VIEWS if not early or 20.0 <= view.elevation_deg <= 55.0]
        assert worst[picture.view] >= min(0.35, max(worst[view] for view in seats)) - 1e-9


TUBE = {"mesh": "shape:tube?m=8&n=6"}
FORMED = {"mesh": "shape:sphere?n=3", "size_mm": 250.0, "former": "auto"}


@pytest.mark.parametrize("settings", slow_but([SMALL, TUBE, FORMED], 0))
def test_what_is_seen_from_inside_is_told_and_is_rare_on_closed_objects(settings):
    """What is seen in large, found anew with the former as one more thing that hides."""
    job, plan, scene, pictures = made(settings)
    told = 0
    for at, picture in enumerate(steps_of(pictures)):
        number = {piece.id: at for at, piece in enumerate(plan.pieces)}
        new = [number[key] for key in plan.steps[at].pieces]
        outer = shares_seen_from_outside(job, scene, at, picture, new)
        low = [plan.pieces[piece].id for piece, share in outer.items() if share < 0.5]
        assert list(picture.inside) == low
        told += bool(low)
    assert told < len(plan.steps) / 4 if settings is TUBE else told <= len(plan.steps) / 10


def shares_seen_from_outside(job, scene, at, picture, new):
    """The outer share of what is seen of each new piece, in order, in the picture of a step."""
    corners = np.concatenate([ends.reshape(-1, 2) for ends in picture.ends])
    ends = np.concatenate([scene.rung_ends(piece).reshape(-1, 3) for piece in new])
    # The picture's scale and place, from where the ends of the new pieces' rungs are in it.
    frame = frame_object(ends, picture.view, (100, 100))
    flat = frame.pixels(ends)
    per_point = np.ptp(corners, axis=0).max() / np.ptp(flat[:, :2], axis=0).max() / POINTS_PX
    high, wide = picture.painted.height_px, picture.painted.width_px
    left, top = corners[0] / POINTS_PX * (1.0, -1.0) - flat[0, :2] * per_point + (0.0, high)

    def placed(points):
        return frame.pixels(points) * per_point + (left, top, 0.0)

    plates = scene.plate_corners.reshape(-1, 3)
    inside = job.laid is not None and at + 1 < scene.leaving.until
    there = np.flatnonzero(scene.step <= at)
    there = there[np.argsort(-scene.step[there], kind="stable")]
    boards = np.arange(len(plates) if inside else 0).reshape(-1, 3) + len(scene.points)
    found, _ = nearest_triangles(
        placed(np.concatenate((scene.points, plates))),
        np.concatenate((scene.triangles[there], boards)),
        width=wide,
        height=high,
    )
    shown = there[found[(found >= 0) & (found < len(there))]]
    outer = scene.normals[shown] @ picture.view.axes()[2] > 0.0
    return {
        piece: outer[own].mean() if (own := scene.piece[shown] == piece).any() else 1.0
        for piece in new
    }


@pytest.mark.slow
def test_a_former_is_drawn_until_it_is_taken_out():
    _, plan, scene, pictures = made(FORMED)
    leaves = scene.leaving.until
    assert 1 < leaves <= len(plan.steps)
    drawn = [
        bool((np.asarray(picture.painted.image) == FIXED[BOARD]).all(axis=2).any())
        for picture in steps_of(pictures)
    ]
    assert all(drawn[: len(drawn) // 3])
    assert not any(drawn[leaves - 1 :])
    assert luminance(FIXED)[BOARD] > THERE[-1]


def least_faced(scene, at, view):
    shares = []
    for piece in np.flatnonzero(scene.step_of_piece == at):
        corners = scene.points[scene.triangles[scene.piece == piece]]
        sides = [corners[:, k] - corners[:, 0] for k in (1, 2)]
        flat = [side @ view.axes()[:2].T for side in sides]
        area = np.abs(flat[0][:, 0] * flat[1][:, 1] - flat[0][:, 1] * flat[1][:, 0]).sum()
        shares.append(area / np.linalg.norm(np.cross(*sides), axis=1).sum())
    return min(shares)


# --- times --------------------------------------------------------------------------------------


BASED = {"mesh": "shape:tube?m=8&n=4", "size_mm": 200.0, "base": "on"}


@pytest.mark.parametrize("settings", slow_but([SMALL, BASED], 0))
def test_steps_take_as_long_as_the_whole(settings):
    job, crossing_map, _, _ = made(settings)
    whole = job.costs.assembly
    told = sum(step_seconds(crossing_map, whole)) / 3600.0
    assert told == pytest.approx(np.sqrt(np.prod(whole.hours)), rel=1e-3)


@pytest.mark.slow
def test_a_wire_takes_the_place_of_a_fastener_at_each_foot():
    job, _, _, _ = made(BASED)
    feet, fastened = job.piece_set.hanging, job.piece_set.fastened
    assert feet.sum() == 8
    assert fastened[feet].all()
    assert sum(row.needed for row in job.bill.fasteners) == (fastened & ~feet).sum()
    (tied,) = (one for one in job.costs.assembly.actions if one.action == "tie")
    assert tied.count == feet.sum()
