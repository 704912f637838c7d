"""The viewer's controls in a real browser: colours, views, flights, times, addresses and keys."""

import json
import re

import numpy as np
import pytest
from viewer_tab import Scene, Tab, all_of

from fabweave.estimate.texts import hours_text
from fabweave.stock.machine import MIDDLE_PACE

pytestmark = [pytest.mark.apt, pytest.mark.slow]


GROUPS = {
    "thread": lambda scene, piece: scene.thread[piece.thread].label,
    "direction": lambda scene, piece: ("warp", "weft")[scene.thread[piece.thread].bunch],
    "sheet": lambda _, piece: f"sheet {piece.sheet}",
    "material": lambda scene, piece: scene.plan.sheets[piece.sheet - 1].material,
    "kind": lambda _, piece: f"kind {piece.kind}",
}


@pytest.mark.parametrize("scheme", GROUPS)
def test_colours_are_those_of_groups_and_the_legend_names_them(tab, torus, scheme):
    torus.thread = {thread.id: thread for thread in torus.plan.threads}
    wanted = [GROUPS[scheme](torus, piece) for piece in torus.plan.pieces]
    tab.page.select_option("#colours", scheme)
    shown = tab.page.evaluate("fabweave.plan.colour")
    assert len(set(zip(wanted, shown, strict=True))) == len(set(wanted)) == len(set(shown))
    legend = tab.page.locator("#legend button")
    assert sorted(text.strip() for text in legend.all_inner_texts()) == sorted(set(wanted))
    # In space a strip has its colour, too, a little darker or lighter.
    tab.settle()
    hues = dict(zip(torus.ids, shown, strict=True))
    pixels, good, points = tab.pixels(), 0, [p for p in tab.points(all_of(torus), 30, 3) if p[2]]
    for x, y, label in points:
        true = np.array([int(hues[label][k : k + 2], 16) for k in (1, 3, 5)], float)
        shade = pixels[int(y), int(x)]
        good += shade @ true > 0.97 * np.linalg.norm(shade) * np.linalg.norm(true)
    assert good >= 0.6 * len(points)
    # An entry of the legend shows its group alone.
    legend.first.click()
    name = legend.first.inner_text().strip()
    codes = tab.page.evaluate("fabweave.codes()")
    assert [bool(code) for code in codes] == [group == name for group in wanted]
    # What was chosen is there again.
    tab.page.reload()
    tab.page.wait_for_function("window.fabweave !== undefined")
    assert tab.page.evaluate("fabweave.plan.colour") == shown


def test_steps_are_coloured_from_dark_to_light(tab, torus):
    tab.page.select_option("#colours", "step")
    shown = tab.page.evaluate("fabweave.plan.colour")
    light = [sum(int(colour[k : k + 2], 16) for k in (1, 3, 5)) for colour in shown]
    order = np.argsort([torus.step_of[label] for label in torus.ids])
    assert np.all(np.diff(np.array(light)[order]) >= 0)
    assert f"step {len(torus.plan.steps)}" in tab.page.locator("#legend").inner_text()


def spread_corners(scene, by):
    """Return the corners of all triangles, pieces moved apart from the middle of all."""
    middle = scene.read.rungs.reshape(-1, 3)
    middle = (middle.min(axis=0) + middle.max(axis=0)) / 2
    ends = np.cumsum(scene.read.counts)
    own = [rungs.mean(axis=(0, 1)) for rungs in np.split(scene.read.rungs, ends[:-1])]
    return scene.corners + by * (np.array(own) - middle)[scene.owner][:, None]


@pytest.mark.parametrize("parallel", [False, True])
def test_exploded_pieces_are_where_they_are_seen(tab, torus, parallel, monkeypatch):
    tab.page.click("#view summary")
    if parallel:
        tab.page.check("#parallel")
    tab.slide("explode", 0.8)
    tab.page.click("#facts")
    assert tab.page.locator("#explode").is_hidden()
    monkeypatch.setattr(torus, "corners", spread_corners(torus, 0.8))
    for x, y, label in tab.points(all_of(torus), 16, seed=4):
        tab.tap(x, y)
        assert tab.chosen() == label, (x, y)
    tab.page.click("#view summary")
    tab.page.click("#home")
    assert tab.page.evaluate("document.getElementById('explode').value") == "0"


#: Counts how often each piece is seen in a grid over the canvas.
SEEN = """() => {
    const found = {}, { width, height } = object.getBoundingClientRect();
    for (let x = 3; x < width; x += 8) for (let y = 3; y < height; y += 8) {
        const piece = fabweave.pick(x, y);
        found[piece] = (found[piece] || 0) + 1;
    }
    return found;
}"""


def seen_pieces(tab):
    """Return the numbers of the pieces that are seen, each with how often."""
    return {int(piece): often for piece, often in tab.page.evaluate(SEEN).items() if piece != "-1"}


def test_what_is_cut_away_is_not_seen_and_the_chosen_piece_is_whole(tab, torus):
    whole = tab.pixels()
    tab.slide("cut", 0.5)
    cut = tab.pixels()
    paper = whole[-60, 20]
    assert np.mean(np.any(cut != paper, axis=2)) < 0.9 * np.mean(np.any(whole != paper, axis=2))
    # The plane goes through the middle, across the view; what is this side of it is away.
    lens = np.array(tab.page.evaluate("fabweave.lens.matrixWorld.elements")).reshape(4, 4).T
    points = torus.read.rungs.reshape(-1, 3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    beyond = (torus.corners - middle) @ lens[:3, 2]
    near = np.array([beyond[torus.owner == k].min() for k in range(len(torus.ids))])
    far = np.array([beyond[torus.owner == k].max() for k in range(len(torus.ids))])
    seen = seen_pieces(tab)
    gone = set(np.flatnonzero(near > 0.5).tolist())
    assert gone
    assert not seen.keys() & gone
    assert seen.keys() & set(np.flatnonzero(far < -0.5).tolist())
    # The first of what is gone is whole when it is chosen.
    label = torus.ids[min(gone)]
    tab.search(label)
    tab.settle()
    assert min(gone) in seen_pieces(tab)


def test_pieces_come_the_way_that_the_step_says(tab, torus):
    told = set()
    for step in torus.plan.steps:
        words = step.text.partition(".")[0].lower()
        pushed = re.findall(r"push the (start|end) under", words)
        sign = tab.page.evaluate(
            "([step, piece]) => modules['show/viewer/viewer_page/flight.js']"
            ".wayIn(fabweave.plan, fabweave.plan.steps[step], piece)",
            [step.step - 1, torus.ids.index(step.pieces[0])],
        )
        assert (sign == 0) == ("under" not in words), step.step
        if len(pushed) == words.count("under") == 1:
            # An end with more strands over it leads; of two alike, the end.
            assert sign == {"start": 1, "end": -1}[pushed[0]], step.step
        told |= {sign, *pushed}
    assert {0, 1, -1, "start", "end"} <= told


def test_a_strip_slides_along_its_own_course(tab):
    """A rung that is shifted by the way to another one stands where that one is."""
    off, beyond, landed = tab.page.evaluate("""() => {
        const { shiftStrip, landStrip } = modules["show/viewer/viewer_page/flight.js"];
        const { readStrips } = modules["show/viewer/viewer_page/strips.js"];
        const strips = readStrips(fabweave.plan), piece = 5;
        const { made, placed, firsts, counts } = strips;
        const from = firsts[piece], count = counts[piece], axes = [0, 1, 2];
        const gap = (a, b) => Math.hypot(...axes.map((k) => made.position[a + k] - placed[b + k]));
        let off = 0;
        for (let k = 1; k < count; k++) {
            shiftStrip(strips, piece, made.along[2 * (from + k)], [0, 0, 0]);
            for (const side of [0, 3])
                off = Math.max(off, gap(6 * from + side, 6 * (from + k) + side));
        }
        // Beyond its end it is as wide as there, and goes straight on.
        shiftStrip(strips, piece, made.along[2 * (from + count - 1)] + 100, [0, 0, 0]);
        const beyond = gap(6 * from, 6 * (from + count - 1));
        landStrip(strips, piece);
        return [off, beyond, made.position.every((value, k) => value === placed[k])];
    }""")
    assert off < 1e-3
    assert beyond == pytest.approx(100.0, abs=0.5)
    assert landed


def test_pieces_fly_where_motion_is_wanted(browser, torus):
    opened = Tab(browser, torus, reduced_motion="no-preference")
    opened.page.click("#follow")
    opened.go_to(6)
    opened.page.wait_for_timeout(1500)
    before = opened.pixels()
    opened.page.click("#forward")
    opened.page.wait_for_timeout(120)
    coming = opened.pixels()
    opened.page.wait_for_timeout(2500)
    there = opened.pixels()
    opened.page.evaluate("fabweave.draw()")
    assert np.count_nonzero(np.any(there != opened.pixels(), axis=2)) <= 20
    moved = np.count_nonzero(np.any(np.abs(coming - there) > 40, axis=2))
    assert moved > 200
    assert np.any(before != there)
    opened.close()


def test_steps_play_and_stop(tab, torus):
    last = len(torus.plan.steps)
    tab.go_to(last - 2)
    tab.page.click("#play")
    assert tab.page.locator("#play").inner_text() == "Pause"
    tab.wait(f"fabweave.state.step === {last}")
    assert tab.page.locator("#play").inner_text() == "Play"
    # At the end it begins again; a step by hand stops it.
    tab.page.keyboard.press("p")
    assert tab.page.evaluate("fabweave.state.step") == 1
    tab.page.click("#forward")
    assert tab.page.locator("#play").inner_text() == "Play"
    assert tab.page.evaluate("fabweave.state.step") == 2


def test_a_step_says_what_is_fastened_and_marks_its_stations(tab, torus):
    fastened = {crossing.id for crossing in torus.plan.crossings if crossing.fastened}
    joint_at = {joint.crossing: joint.id for joint in torus.plan.joints}
    told = 0
    for step in torus.plan.steps:
        tab.page.evaluate(f"location.hash = '#step={step.step}'")
        tab.wait(f"document.body.dataset.step === '{step.step}'")
        card = tab.page.locator("#step-text")
        text = card.inner_text()
        assert step.text in text
        here = [key for key in step.fasten if key in fastened]
        assert ("Fasten for good" in text) == bool(here)
        if here:
            words = card.locator(".fasten").inner_text()
            assert words.count(" over ") == len(here)
            named = re.findall(r"\(joint #(\d+)\)", words)
            assert [int(number) for number in named] == [
                joint_at[key] for key in here if key in joint_at
            ]
            told += len(here)
        piece = torus.piece(step.pieces[0])
        made = {*step.crossings, *step.over, *step.under}
        marked = tab.page.locator("svg.piece .station.now").evaluate_all(
            "all => all.map(one => Number(one.dataset.station))"
        )
        assert marked == [k for k, at in enumerate(piece.stations) if at.crossing in made]
        later = tab.page.locator("svg.piece .station.later").count()
        assert later == sum(
            torus.step_of[at.partner] > step.step and at.crossing not in made
            for at in piece.stations
        )
    assert told == len(fastened) > 0
    # A partner's name on the flat piece leads to it, by keyboard, too.
    name = tab.page.locator("svg.piece .partner").nth(1)
    partner = name.get_attribute("data-piece")
    name.focus()
    tab.page.keyboard.press("Enter")
    assert tab.chosen() == partner


def first_text(span):
    """What the first of its kind takes, as pages and manual say it."""
    return hours_text(span).partition(" the first time")[0]


def test_time_is_that_of_the_job(tab, torus):
    hands = torus.job.costs.assembly
    seconds = tab.page.evaluate("fabweave.clock.seconds")
    whole = 3600.0 * hands.practised_h
    assert sum(seconds) == pytest.approx(MIDDLE_PACE * whole, abs=0.06 * len(seconds))
    span = hands.hours
    assert first_text(span) in tab.page.locator("#left").inner_text()
    half = len(seconds) // 2
    tab.page.click("#tab-steps")
    for box in tab.page.locator("#panel-steps input").all()[:half]:
        box.check()
    left = sum(seconds[half:]) / sum(seconds)
    words = first_text(tuple(left * end for end in span))
    assert tab.page.locator("#progress").inner_text().startswith(
        f"{half} of {len(seconds)} steps done. {words} left of "
    )  # fmt: skip
    for box in tab.page.locator("#panel-steps input").all()[half:]:
        box.check()
    assert tab.page.locator("#left").inner_text() == "All is done."


def test_addresses_name_step_and_piece(browser, torus):
    step = torus.plan.steps[8]
    label = step.pieces[0]
    opened = Tab(browser, torus, address=f"#step=9&piece={label}")
    assert opened.page.evaluate("document.body.dataset.step") == "9"
    assert opened.chosen() == label
    opened.go_to(4)
    assert opened.page.url.endswith("#step=4")
    opened.page.fill("#query", "A1")
    opened.page.click("#mode-whole")
    opened.page.keyboard.press("Escape")
    opened.search("A1")
    assert opened.page.url.endswith("#piece=A1")
    for nonsense in ("#step=0", "#step=x&piece=Z99", "#piece=", "#<b>"):
        opened.page.evaluate("address => { location.hash = address; }", nonsense)
        opened.page.wait_for_timeout(50)
    assert opened.page.evaluate("fabweave.state.step") == 4
    opened.close()


def corner_under(tab, torus, seed):
    """Return a point of the object, and where it is seen, away from the middle."""
    for x, y, label in tab.points(all_of(torus), 30, seed):
        if label and abs(x - tab.box["width"] / 2) > 0.15 * tab.box["width"]:
            origin, way = tab.ray(x, y)
            far = tab.shot(origin, way)
            return origin + far * way, (x, y)
    raise AssertionError("nothing is seen")


@pytest.mark.parametrize("parallel", [False, True])
def test_the_wheel_zooms_to_the_pointer(tab, torus, parallel):
    if parallel:
        tab.page.click("#view summary")
        tab.page.check("#parallel")
        tab.page.click("#facts")
        tab.settle()
    point, (x, y) = corner_under(tab, torus, seed=6)
    tab.page.mouse.move(tab.box["x"] + x, tab.box["y"] + y)
    size = tab.scale(point)
    for wheel in (-300, -500, -400, 700, -200):
        tab.page.mouse.wheel(0, wheel)
        tab.page.wait_for_timeout(60)
        tab.look()
        assert np.linalg.norm(tab.project(point[None])[0] - (x, y)) <= 2.0, wheel
    assert tab.scale(point) > 1.8 * size


def test_fingers_zoom_to_where_they_are(browser, torus):
    opened = Tab(browser, torus, size=(1180, 820), has_touch=True)
    point, (x, y) = corner_under(opened, torus, seed=8)
    x, y = x + opened.box["x"], y + opened.box["y"]
    touch, size = opened.hand(), opened.scale(point)
    touch("touchStart", (x - 30, y), (x + 30, y))
    for k in range(1, 9):
        touch("touchMove", (x - 30 - 6 * k, y), (x + 30 + 6 * k, y))
    touch("touchEnd")
    opened.settle()
    opened.look()
    held = opened.project(point[None])[0] + (opened.box["x"], opened.box["y"])
    assert np.linalg.norm(held - (x, y)) <= 2.0
    assert opened.scale(point) == pytest.approx(size * 78 / 30, rel=0.15)
    opened.close()


def test_a_double_click_sets_the_pivot(tab, torus):
    point, (x, y) = corner_under(tab, torus, seed=9)
    tab.page.locator("#object").dblclick(position={"x": x, "y": y})
    tab.settle()
    middle = np.array([tab.box["width"], tab.box["height"]]) / 2
    for _ in range(3):
        tab.look()
        assert np.linalg.norm(tab.project(point[None])[0] - middle) <= 3.0
        tab.page.click("[data-move=left]")
        tab.settle()


MOVES = {"left": "ArrowLeft", "right": "ArrowRight", "up": "ArrowUp", "down": "ArrowDown",
         "in": "+", "out": "-"}  # fmt: skip


@pytest.mark.parametrize("move", MOVES)
def test_buttons_and_keys_do_the_same(tab, move):
    home = tab.page.evaluate("fabweave.lens.position.toArray()")
    tab.page.click(f"[data-move={move}]")
    pressed = tab.page.evaluate("fabweave.lens.position.toArray()")
    assert np.linalg.norm(np.subtract(home, pressed)) > 10.0
    assert tab.page.locator("#spoken").inner_text().startswith("Seen from ")
    tab.page.locator("#object").focus()
    tab.page.keyboard.press("0")
    assert tab.page.evaluate("fabweave.lens.position.toArray()") == pytest.approx(home)
    tab.page.keyboard.press(MOVES[move])
    assert tab.page.evaluate("fabweave.lens.position.toArray()") == pytest.approx(pressed)
    # There they step no further.
    assert tab.page.evaluate("document.body.dataset.step") == ""


def test_a_hidden_piece_is_turned_up(tab, torus):
    """After each step some of its piece is seen, wherever the one before was."""
    turns, before = 0, None
    steps = range(2, len(torus.plan.steps) + 1, 5)
    for step in steps:
        tab.go_to(step)
        tab.settle()
        seen = seen_pieces(tab)
        first = torus.ids.index(torus.plan.steps[step - 1].pieces[0])
        assert seen.get(first, 0) >= 1, step
        view = tab.page.evaluate("fabweave.lens.matrixWorld.elements")
        turns += view != before
        before = view
    assert turns <= len(steps)


def test_still_edges_are_smooth(tab):
    """At rest four pixels are drawn for each that is shown."""
    tab.settle()
    size = tab.page.evaluate("[object.width, object.height, object.clientWidth]")
    assert size[0] == 2 * size[2]


def test_pieces_are_named_as_they_are_engraved(browser, tmp_path):
    scene = Scene(tmp_path, "shape:octahedron", 300.0, labels="kinds")
    opened = Tab(browser, scene)
    opened.go_to(3)
    step = scene.plan.steps[2]
    names = [f"K{scene.piece(label).kind} ({label})" for label in step.pieces]
    assert opened.page.locator("#step-text .chip").all_inner_texts() == names
    text = re.sub(
        r"\b[A-Z]+\d+\b", lambda found: f"K{scene.piece(found[0]).kind} ({found[0]})", step.text
    )
    assert text in opened.page.locator("#step-text").inner_text()
    assert opened.page.locator("#panel-piece h2").inner_text().strip() == names[0]
    opened.page.click("#tab-sheet")
    drawn = opened.page.locator("#panel-sheet g[data-piece] text").all_text_contents()
    assert set(drawn) <= {f"K{piece.kind}" for piece in scene.plan.pieces}
    opened.close()


def test_the_hardest_places_lead_to_their_stations(browser, torus, tmp_path):
    piece = torus.plan.pieces[3]
    crossing = piece.stations[2].crossing
    place = {"piece": piece.id, "crossing": crossing, "text": "is 2.0 mm wide & <b>thin</b>"}
    text = torus.path.read_text("utf-8")
    assert text.count('"worst":[]') == 1  # a torus has none
    path = tmp_path / "assembly.html"
    path.write_text(text.replace('"worst":[]', f'"worst":[{json.dumps(place)}]'), "utf-8")
    tab = Tab(browser, torus, path=path)
    assert tab.page.locator("#worst li").all_inner_texts() == [
        f"{piece.id} at crossing {crossing} {place['text']}"
    ]
    tab.page.click("#worst button")
    assert tab.chosen() == piece.id
    assert tab.page.locator("tr.chosen").get_attribute("data-station") == "2"
    tab.close()
