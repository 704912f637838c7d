"""What is seen in the viewer: the manual's views, ghosts, halos, contrast, and room for fingers."""

import re

import numpy as np
import pytest
from viewer_tab import Scene, Tab, all_of

from fabweave.job.papers import job_viewer
from fabweave.show.manual.step_pictures import VIEWS, side_words

pytestmark = [pytest.mark.apt, pytest.mark.slow]

SIZES = {
    "phone": (390, 844), "phone on its side": (844, 390), "tablet upright": (820, 1180),
    "laptop": (1280, 800),
}  # fmt: skip


@pytest.fixture(scope="module")
def led(torus, tmp_path_factory):
    """The same job with views as a manual has them: the last step is not in it."""
    scene = Scene.__new__(Scene)
    vars(scene).update(vars(torus))
    scene.views = [VIEWS[(3 * at) % len(VIEWS)] for at in range(len(torus.plan.steps) - 1)]
    scene.path = tmp_path_factory.mktemp("led") / "assembly.html"
    scene.path.write_text(
        job_viewer(torus.job, torus.plan, torus.job.costs, scene.views), encoding="utf-8"
    )
    return scene


def way_to_eye(tab):
    """Return the direction in which the eye is, of unit length."""
    lens = np.array(tab.page.evaluate("fabweave.lens.matrixWorld.elements")).reshape(4, 4).T
    return lens[:3, 2]


def test_steps_are_seen_from_where_the_manual_shows_them(browser, led):
    opened = Tab(browser, led)
    followed, told = 0, ""
    for number, view in enumerate(led.views, start=1):
        opened.go_to(number)
        azimuth, rise = np.radians((view.azimuth_deg, view.elevation_deg))
        wanted = (np.cos(rise) * np.cos(azimuth), np.cos(rise) * np.sin(azimuth), np.sin(rise))
        if np.allclose(way_to_eye(opened), wanted, rtol=0.0, atol=1e-6):
            followed += 1
            # What is seen from another side than before is said.
            told = opened.page.locator("#spoken").inner_text() or told
            assert number == 1 or told.startswith(f"Seen from {side_words(view)}"), number
    # From a view that somebody else chose, a piece may not be seen at all: then it is turned up.
    assert followed >= 0.6 * len(led.views)
    # Whoever turns the object by hand, and does not want to be led, is not.
    opened.page.click("#follow")
    held = way_to_eye(opened)
    opened.go_to(3)
    assert way_to_eye(opened) == pytest.approx(held)
    opened.page.click("#follow")
    opened.settle()
    assert way_to_eye(opened) @ held < 0.9999
    opened.close()


def test_the_first_steps_stand_on_the_table_and_it_can_be_left_out(tab, torus):
    """What is to come is there as a ghost, and lines are drawn where nothing is seen."""
    at = np.array([torus.step_of[label] for label in torus.ids])
    early = np.array([np.sum(at < step) < len(at) / 4 for step in range(1, at.max() + 1)])
    first, later = 2, int(np.argmin(early)) + 1
    assert early[first - 1]
    tab.page.click("#follow")
    shown = {}
    for on in (True, False):
        if not on:
            tab.page.click("#view summary")
            tab.page.click("#table")
            tab.page.click("#view summary")
        for step in (first, later):
            tab.go_to(step)
            shown[step, on] = tab.pixels()
            codes = np.array(tab.page.evaluate("fabweave.codes()"))
            assert np.all((codes == 5) == ((at > step) & on & early[step - 1]))
    changed = [np.any(shown[step, True] != shown[step, False], axis=2) for step in (first, later)]
    assert np.mean(changed[0]) > 0.01
    assert not changed[1].any()


def test_what_is_in_place_is_as_strong_as_is_asked(tab, torus):
    step = len(torus.plan.steps) // 2
    tab.page.click("#follow")
    tab.go_to(step)
    seen = tab.page.evaluate(
        "() => Array.from({length: 400}, (_, k) => [40 + (k % 20) * 25, 40 + (k / 20 | 0) * 8])"
        ".map(([x, y]) => [x, y, fabweave.pick(x, y)])"
    )
    at = [torus.step_of[label] for label in torus.ids]
    spots = [(x, y) for x, y, piece in seen if piece >= 0 and at[piece] < step]
    assert len(spots) > 20
    x, y = np.array(spots).T
    shown = {}
    for value in (0.2, 0.5, 1.0):
        tab.slide("there", value)
        shown[value] = tab.pixels()[y, x]
    # Strips lose their colour to a pale grey in proportion, not to the paper: see STRIP_FRAGMENT.
    lost = {value: np.linalg.norm(shown[1.0] - shown[value], axis=1) for value in (0.2, 0.5)}
    assert np.allclose(lost[0.5], lost[0.2] * (1.0 - 0.5) / (1.0 - 0.2), atol=3.0)
    assert np.median(lost[0.2]) > 30.0
    tab.page.click("#view summary")
    tab.page.click("#home")
    assert tab.page.evaluate("document.getElementById('there').value") == "0.5"


def test_what_is_to_come_is_a_veil_that_hides_nothing(tab, torus):
    step = len(torus.plan.steps) // 2
    tab.page.click("#follow")
    tab.go_to(step)
    bare = tab.pixels()
    hits = tab.page.evaluate("fabweave.codes().filter((code) => code).length")
    tab.slide("later", 0.25)
    veiled = tab.pixels()
    changed = np.mean(np.any(np.abs(veiled - bare) > 12.0, axis=2))
    tab.slide("later", 1.0)
    solid = np.mean(np.any(np.abs(tab.pixels() - bare) > 12.0, axis=2))
    assert 0.02 < changed < solid
    codes = tab.page.evaluate("fabweave.codes()")
    at = [torus.step_of[label] for label in torus.ids]
    assert codes == [5 if own > step else 3 if own == step else 2 for own in at]
    assert sum(code != 5 for code in codes) == hits
    # Nothing that is to come can be tapped, named, or found on the sheet as new.
    for x, y, label in tab.points(np.array(at) <= step, 12, seed=2):
        tab.tap(x, y)
        assert tab.chosen() == label
    tab.slide("later", 0.0)
    tab.go_to(step)
    assert np.count_nonzero(np.any(np.abs(tab.pixels() - bare) > 12.0, axis=2)) <= 40


def test_crossings_have_halos(tab, torus):
    """Beside the rails of the strand above, the paper is seen: not where it dives."""
    tab.page.evaluate("fabweave.draw()")
    tab.look()
    pixels, paper = tab.pixels(), tab.pixels()[-30, 10]
    ends = np.cumsum(torus.read.counts)
    pale = {True: [], False: []}
    for piece, (end, count, panels) in enumerate(
        zip(ends, torus.read.counts, torus.read.panels, strict=True)
    ):
        rungs = torus.read.rungs[end - count : end]
        for station, panel in zip(torus.plan.pieces[piece].stations, panels, strict=True):
            quad = (rungs[panel] + rungs[panel + 1]) / 2.0
            places = np.array([quad[0] + share * (quad[1] - quad[0]) for share in (0.025, 0.5)])
            (ex, ey), (mx, my) = tab.project(places).round().astype(int)
            inside = all(
                5 < x < tab.box["width"] - 5 and 5 < y < tab.box["height"] - 5
                for x, y in ((ex, ey), (mx, my))
            )
            if not inside or tab.page.evaluate(f"fabweave.pick({mx}, {my})") != piece:
                continue
            if tab.page.evaluate(f"fabweave.pick({ex}, {ey})") != piece:
                continue
            near = pixels[ey - 1 : ey + 2, ex - 1 : ex + 2].reshape(-1, 3)
            pale[station.over].append(np.linalg.norm(near - paper, axis=1).min() < 60.0)
    assert len(pale[True]) > 20
    assert np.mean(pale[True]) > 0.6


#: The places of all that can be pressed and is smaller than 24 pixels, with what it is.
SMALL = """() => [...document.querySelectorAll('button, a, input, select, summary, [role=link]')]
    .map((one) => [one, one.getBoundingClientRect()])
    .filter(([one, box]) => box.width && Math.min(box.width, box.height) < 23.5
        && one.checkVisibility({ visibilityProperty: true }))
    .map(([one, box]) => `${one.id} ${one.textContent} ${box.width} ${box.height}`)"""
#: Texts whose contrast is below 4.5 to 1, each with that.
PALE = """() => {
    const parts = (colour) => {
        const found = colour.match(/[\\d.]+/g).map(Number);
        return found.length < 4 ? [...found, 1] : found;
    };
    const light = (colour) => {
        const [r, g, b] = colour.slice(0, 3).map((part) => part / 255)
            .map((part) => part <= 0.03928 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const laid = (ink, on, share) => [0, 1, 2]
        .map((k) => ink[k] * ink[3] * share + on[k] * (1 - ink[3] * share)).concat(1);
    const ground = (one) => {
        const layers = [];
        for (let node = one; node; node = node.parentElement) {
            const colour = getComputedStyle(node).backgroundColor;
            if (colour.startsWith('rgb')) layers.unshift(parts(colour));
        }
        return layers.reduce((all, layer) => laid(layer, all, 1), [255, 255, 255, 1]);
    };
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
    while (texts.nextNode()) {
        const text = texts.currentNode, one = text.parentElement;
        const hidden = one.closest('script, style, .unseen, :disabled') || !one.checkVisibility();
        if (!text.data.trim() || hidden || !one.getBoundingClientRect().width) continue;
        const style = getComputedStyle(one), drawn = one.closest('svg');
        let on = ground(one), ink = parts(drawn ? style.fill : style.color), share = 1;
        const station = one.closest('.station'), chosen = one.closest('svg.sheet g.chosen');
        if (station) on = parts(getComputedStyle(station.querySelector('.dot')).fill);
        if (chosen) on = parts(getComputedStyle(chosen.querySelector('path')).fill);
        for (let node = one; node; node = node.parentElement)
            share *= Number(getComputedStyle(node).opacity);
        ink = laid(ink, on, share);
        const both = [light(ink) + 0.05, light(on) + 0.05];
        const contrast = Math.max(...both) / Math.min(...both);
        if (contrast < 4.5) found.push(`${text.data.trim().slice(0, 30)} ${contrast.toFixed(2)}`);
    }
    return found;
}"""


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_texts_are_dark_enough_and_targets_large_enough(browser, torus, size, scheme):
    opened = Tab(browser, torus, size=SIZES[size], has_touch=size != "laptop", color_scheme=scheme)
    for step in (0, 12):
        if step:
            opened.go_to(step)
        for name in ("piece", "sheet", "steps"):
            opened.page.click(f"#tab-{name}")
            assert opened.page.evaluate(PALE) == [], (step, name)
            assert opened.page.evaluate(SMALL) == [], (step, name)
    opened.page.click("#view summary")
    assert opened.page.evaluate(SMALL) == []
    box = opened.page.locator("#view > div").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= SIZES[size][0]
    assert box["y"] + box["height"] <= SIZES[size][1]
    opened.close()


@pytest.mark.parametrize("size", SIZES)
def test_nothing_stands_over_the_object(browser, torus, size):
    """What is drawn keeps clear of the buttons, before somebody comes nearer."""
    opened = Tab(browser, torus, size=SIZES[size], has_touch=size != "laptop")
    opened.settle()
    opened.look()
    places = opened.project(torus.corners.reshape(-1, 3))
    places += (opened.box["x"], opened.box["y"])
    for one in opened.page.locator("#tools button:visible, #tools summary:visible").all():
        box = one.bounding_box()
        low, size_px = np.array([[box["x"], box["y"]], [box["width"], box["height"]]])
        over = np.all((places > low) & (places < low + size_px), axis=1)
        assert not np.any(over), one.inner_text()
    opened.close()


def test_a_name_stays_with_what_ends_its_clause(browser, torus):
    opened = Tab(browser, torus, size=SIZES["phone"], has_touch=True)
    for step in range(1, len(torus.plan.steps), 3):
        opened.go_to(step)
        text = opened.page.locator("#step-text p").first.inner_text()
        assert not re.search(r"\n\s*[.,;]", text), step
        rows = opened.page.locator("#step-text .tied").evaluate_all(
            "all => all.map((one) => [one.getBoundingClientRect().height,"
            " one.querySelector('button').getBoundingClientRect().height])"
        )
        assert all(whole < 1.7 * name for whole, name in rows), step
    opened.close()


def test_all_of_the_object_is_shown_again(tab, torus):
    """After everything was changed, one button brings the first view back."""
    tab.settle()
    first = tab.pixels()
    for name, value in (("explode", 0.5), ("cut", 0.3), ("there", 1.0), ("later", 0.5)):
        tab.slide(name, value)
    tab.page.click("[data-move=left]")
    tab.page.click("#view summary")
    tab.page.click("#home")
    tab.page.click("#facts")
    tab.settle()
    assert np.count_nonzero(np.any(tab.pixels() != first, axis=2)) <= 20
    assert len(all_of(torus)) == len(torus.ids)
