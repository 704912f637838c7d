"""The viewer in a real browser: what is seen, tapped, searched, remembered and printed."""

import math
import random

import numpy as np
import pytest
from PIL import Image
from pypdf import PdfReader
from viewer_tab import Scene, Tab, all_of

pytestmark = pytest.mark.apt

SIZES = {"laptop": (1280, 800), "tablet": (1024, 768), "phone": (390, 844)}


@pytest.mark.slow
def test_tapping_a_strip_chooses_the_one_that_is_seen(tab, torus):
    for x, y, label in tab.points(all_of(torus), 24, seed=1):
        tab.tap(x, y)
        assert tab.chosen() == label, (x, y)
        if label:
            assert tab.page.locator("#panel-piece h2").inner_text().strip() == label


def test_the_slider_shows_the_pieces_so_far_and_no_other(tab, torus):
    tab.page.evaluate("document.querySelector('#table').click()")  # nothing is a ghost
    last = len(torus.plan.steps)
    for step in (1, 2, last // 3, last - 3, last):
        tab.go_to(step)
        assert tab.page.evaluate("document.body.dataset.step") == str(step)
        codes = tab.page.evaluate("fabweave.codes()")
        at = [torus.step_of[label] for label in torus.ids]
        assert codes == [0 if own > step else 3 if own == step else 2 for own in at]
        visible = np.array(at) <= step
        for x, y, label in tab.points(visible, 5, seed=step):
            tab.tap(x, y)
            assert tab.chosen() == label, (step, x, y)
        text = tab.page.locator("#step-text").inner_text()
        assert torus.plan.steps[step - 1].text in text


def pixels_of(tab, path):
    tab.page.locator("#object").screenshot(path=path)
    return np.asarray(Image.open(path).convert("RGB"), dtype=float)


@pytest.mark.slow
def test_a_step_that_is_drawn_over_the_last_one_looks_like_the_whole(tab, torus, tmp_path):
    """Where nothing turns, only what changes is drawn; the picture is that of drawing all."""
    tab.page.click("#follow")
    tab.go_to(1)
    last = len(torus.plan.steps)
    for step in (2, 3, 3, last // 2, last - 1, 4, 5):
        tab.page.evaluate(
            "step => { const s = document.getElementById('slider'); s.value = step;"
            "s.dispatchEvent(new Event('input')); }", step,
        )  # fmt: skip
        if step == last // 2:
            # Two changes before the next picture.
            tab.page.evaluate("document.querySelector('#step-text .chip').click()")
        tab.page.wait_for_timeout(250)
        over = pixels_of(tab, tmp_path / "over.png")
        tab.page.evaluate("fabweave.draw()")
        whole = pixels_of(tab, tmp_path / "whole.png")
        assert np.count_nonzero(np.any(over != whole, axis=2)) <= 20, step
        assert np.ptp(whole) > 100


def numbers_of(path):
    return np.array([pair.split() for pair in path.strip("MZ").split("L")], dtype=float)


@pytest.mark.slow
@pytest.mark.parametrize("query", ["own", "lower", "part"])
def test_searching_a_label_shows_strip_piece_and_place(tab, torus, query):
    for label in random.Random(7).sample(torus.ids, 4):  # noqa: S311 - no secret
        piece = torus.piece(label)
        tab.page.fill("#query", {"own": label, "lower": f" {label.lower()} ", "part": label}[query])
        if query == "part":
            tab.page.locator(f"#found button[data-piece='{label}']").click()
        else:
            tab.page.keyboard.press("Enter")
        assert tab.chosen() == label
        assert tab.page.evaluate("fabweave.codes()").count(4) == 1
        assert tab.page.evaluate("fabweave.codes()")[torus.ids.index(label)] == 4
        # The flat piece is the outline of the map, seen with y up.
        flat = numbers_of(tab.page.locator("svg.piece .outline").get_attribute("d"))
        np.testing.assert_allclose(flat * (1, -1), piece.outline, atol=0.0061)
        # The table says station by station what the map says.
        rows = tab.page.locator("#panel-piece tbody tr").all_inner_texts()
        assert len(rows) == len(piece.stations)
        along = 0.0
        for k, (row, station) in enumerate(zip(rows, piece.stations, strict=True)):
            if k:
                last = piece.stations[k - 1]
                along += math.hypot(station.x - last.x, station.y - last.y)
            cells = row.split("\t")
            assert cells[0] == str(k)
            assert float(cells[1]) == pytest.approx(along, abs=0.06)
            assert cells[2].strip() == ("over" if station.over else "under")
            assert cells[3] == station.partner
            joint = next((j for j in torus.plan.joints if j.id == station.joint), None)
            mate = "" if joint is None else next(p for p in joint.pieces if p != label)
            assert cells[4].split() == ([] if joint is None else [f"#{joint.id}", mate])
        # Its place is on its sheet, where the map says.
        tab.page.click("#tab-sheet")
        group = tab.page.locator("#panel-sheet g.chosen")
        assert group.get_attribute("data-piece") == label
        assert f"Sheet {piece.sheet} of" in tab.page.locator("#panel-sheet .turner").inner_text()
        turn = math.radians(piece.placement.rotation_deg)
        motion = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        shift = (piece.placement.x_mm, piece.placement.y_mm)
        placed = numbers_of(group.locator("path").get_attribute("d")) * (1, -1)
        np.testing.assert_allclose(placed, np.array(piece.outline) @ motion.T + shift, atol=0.02)
        tab.page.click("#tab-piece")


def test_a_sheet_is_shown_with_its_true_edge_and_its_defects(tab, torus):
    sheet = torus.plan.sheets[1]
    assert len(sheet.outline) == 5
    tab.page.click("#tab-sheet")
    tab.page.locator("#panel-sheet [data-turn='1']").click()
    for name, ring in (("stock", sheet.outline), ("defect", sheet.defects[0])):
        drawn = numbers_of(tab.page.locator(f"#panel-sheet path.{name}").get_attribute("d"))
        np.testing.assert_allclose(drawn * [1.0, -1.0], ring, atol=0.01)
    band = float(tab.page.locator("#panel-sheet path.margin").get_attribute("stroke-width"))
    assert band == 2.0 * torus.plan.layout.margin_mm
    assert "Hatched: defects." in tab.page.locator("#sheet-hint").inner_text()


def test_tapping_a_piece_on_a_sheet_chooses_it_in_space(tab, torus):
    tab.page.click("#tab-sheet")
    tab.page.locator("#panel-sheet [data-turn='1']").click()
    here = [piece for piece in torus.plan.pieces if piece.sheet == 2]
    drawn = tab.page.locator("#panel-sheet g[data-piece]")
    assert drawn.count() == len(here)
    label = here[len(here) // 2].id
    tab.page.locator(f"#panel-sheet g[data-piece='{label}'] path").dispatch_event("click")
    assert tab.chosen() == label
    assert tab.page.evaluate("fabweave.codes()")[torus.ids.index(label)] == 4


def test_joints_threads_and_unknown_labels_are_searched_too(tab, torus):
    joint = torus.plan.joints[5]
    tab.page.fill("#query", f"#{joint.id}")
    found = tab.page.locator("#found button b").all_inner_texts()
    assert sorted(found) == sorted(set(joint.pieces))
    tab.page.fill("#query", "b")
    own = [piece.id for piece in torus.plan.pieces if piece.id[0] == "B"]
    assert tab.page.locator("#found button b").all_inner_texts() == own
    tab.page.fill("#query", "Z99<b>")
    assert "Nothing" in tab.page.locator("#found").inner_text()
    tab.page.keyboard.press("Enter")
    assert tab.chosen() == ""


def pieces_alone(tab, scene):
    """Return the pieces that are shown, and that none of them is faded."""
    codes = tab.page.evaluate("fabweave.codes()")
    assert set(codes) <= {0, 1}
    return {scene.ids[k] for k, code in enumerate(codes) if code}


@pytest.mark.slow
@pytest.mark.parametrize("query", ["a", "thread A", "kind 1", "k1", "sheet 2", "sheet_02"])
def test_threads_kinds_and_sheets_are_shown_alone(tab, torus, query):
    wanted = {
        "t": lambda piece: piece.id[0] == "A",
        "k": lambda piece: piece.kind == 1,
        "s": lambda piece: piece.sheet == 2,
    }["t" if query == "a" else query[0]]
    group = {piece.id for piece in torus.plan.pieces if wanted(piece)}
    assert 0 < len(group) < len(torus.ids)
    tab.go_to(3)
    tab.page.fill("#query", query)
    first, *others = tab.page.locator("#found button").all_inner_texts()
    assert f"{len(group)} pieces, shown alone" in first
    assert {text.split()[0] for text in others} <= group
    tab.page.keyboard.press("Enter")
    assert pieces_alone(tab, torus) == group
    assert tab.page.locator("#found").is_hidden()
    assert tab.page.locator("#panel-sheet").is_visible() == query.startswith("sheet")
    if query.startswith("sheet"):
        assert "Sheet 2 of" in tab.page.locator("#panel-sheet .turner").inner_text()
    # A piece of it is brought out among them, and the whole is one tap away.
    label = sorted(group)[0]
    tab.search(label)
    codes = dict(zip(torus.ids, tab.page.evaluate("fabweave.codes()"), strict=True))
    assert {one for one, code in codes.items() if code} == group
    assert codes[label] == 4
    tab.page.keyboard.press("Escape")
    assert pieces_alone(tab, torus) == set(torus.ids)
    tab.search(query)
    tab.page.click("#only")
    assert pieces_alone(tab, torus) == set(torus.ids)
    assert tab.page.locator("#only").is_hidden()


def test_steps_crossings_and_what_is_not_there(tab, torus):
    tab.search("step 7")
    assert tab.page.evaluate("document.body.dataset.step") == "7"
    crossing = torus.plan.crossings[12]
    tab.page.fill("#query", "crossing 12")
    assert tab.page.locator("#found button b").all_inner_texts() == [
        crossing.over.piece, crossing.under.piece,
    ]  # fmt: skip
    tab.page.locator("#found button").nth(1).click()
    assert tab.chosen() == crossing.under.piece
    assert tab.page.evaluate("fabweave.state.station") == crossing.under.station
    # A number that no joint has is that of a crossing.
    number = len(torus.plan.joints) + 1
    assert number < len(torus.plan.crossings)
    tab.page.fill("#query", f"#{number}")
    crossing = torus.plan.crossings[number]
    assert tab.page.locator("#found button b").all_inner_texts() == [
        crossing.over.piece, crossing.under.piece,
    ]  # fmt: skip
    for query in ("step 0", "step 999", "kind 99", "sheet 9", "#99999", "crossing", "thread"):
        tab.page.fill("#query", query)
        assert "Nothing" in tab.page.locator("#found").inner_text(), query


def test_partners_and_mates_are_one_tap_away(tab, torus):
    piece = torus.plan.pieces[3]
    tab.search(piece.id)
    tab.page.locator("#panel-piece tbody tr").nth(2).locator("button").first.click()
    assert tab.chosen() == piece.stations[2].partner


def test_a_piece_that_comes_later_is_shown_where_it_comes(tab, torus):
    tab.page.evaluate("document.querySelector('#table').click()")  # nothing is a ghost
    label = torus.plan.steps[9].pieces[0]
    tab.go_to(4)
    tab.search(label)
    assert tab.page.evaluate("document.body.dataset.step") == "10"
    codes = tab.page.evaluate("fabweave.codes()")
    step = torus.plan.steps[9].pieces
    assert {torus.ids[k] for k, code in enumerate(codes) if code >= 3} == set(step)
    assert [k for k, code in enumerate(codes) if code == 4] == [torus.ids.index(label)]


def test_keys_step_and_tick(tab, torus):
    tab.page.keyboard.press("ArrowRight")
    tab.page.keyboard.press("ArrowRight")
    tab.page.keyboard.press("d")
    tab.page.keyboard.press("ArrowLeft")
    assert tab.page.evaluate("[fabweave.state.step, [...fabweave.state.done]]") == [1, [2]]
    tab.page.keyboard.press("End")
    assert tab.page.evaluate("fabweave.state.step") == len(torus.plan.steps)
    assert tab.page.locator("#forward").is_disabled()
    tab.page.keyboard.press("/")
    tab.page.keyboard.type("A2")
    tab.page.keyboard.press("Enter")
    assert tab.chosen() == "A2"
    tab.page.keyboard.press("Escape")
    assert tab.chosen() == ""


@pytest.mark.slow
def test_progress_survives_a_reload(tab):
    tab.go_to(2)
    tab.page.check("#done")
    tab.page.click("#tab-steps")
    tab.page.locator("#panel-steps li[data-step='5'] input").check()
    tab.go_to(6)
    tab.page.reload()
    tab.page.wait_for_function("window.fabweave !== undefined")
    assert tab.page.evaluate("document.body.dataset.step") == "6"
    assert tab.page.evaluate("[...fabweave.state.done]") == [2, 5]
    tab.page.click("#tab-steps")
    steps = tab.page.locator("#panel-steps li:has(input:checked)")
    assert steps.evaluate_all("all => all.map(one => one.dataset.step)") == ["2", "5"]
    assert "2 of" in tab.page.locator("#progress").inner_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [
        "Object.defineProperty(window, 'localStorage', {get() { throw new Error('denied'); }})",
        'Storage.prototype.getItem = () => \'{"step": 1e9, "done": ["x", 0, 3], "stepwise": 7}\'',
        "Storage.prototype.getItem = () => '[[['",
    ],
)
def test_a_browser_without_memory_or_with_a_bad_one(browser, torus, script):
    opened = Tab(browser, torus, script=script)
    assert opened.page.evaluate("fabweave.state.step") in (1, len(torus.plan.steps))
    opened.page.click("#forward")
    opened.page.check("#done")
    assert opened.page.evaluate("fabweave.state.done.has(fabweave.state.step)")
    opened.close()


def test_without_webgl_the_rest_works_and_says_so(browser, torus, tmp_path):
    script = (
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
        "return kind.includes('webgl') ? null : get.call(this, kind, ...more) }"
    )
    opened = Tab(browser, torus, script=script)
    assert "WebGL" in opened.page.locator("#no-space").inner_text()
    opened.search("C1")
    assert opened.page.locator("#panel-piece h2").inner_text().strip() == "C1"
    opened.page.click("#tab-sheet")
    assert opened.page.locator("#panel-sheet g.chosen").get_attribute("data-piece") == "C1"
    opened.page.click("#forward")
    opened.page.screenshot(path=tmp_path / "flat.png")
    opened.close()


def eye(tab):
    tab.page.evaluate("fabweave.draw()")
    return np.array(tab.page.evaluate("fabweave.lens.position.toArray()"))


@pytest.mark.slow
def test_one_finger_turns_two_come_nearer_a_tap_chooses(browser, torus):
    opened = Tab(browser, torus, size=SIZES["tablet"], has_touch=True)
    box = opened.page.locator("#object").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    touch = opened.hand()
    first = eye(opened)
    touch("touchStart", (x, y))
    for k in range(1, 9):
        touch("touchMove", (x + 10 * k, y + 4 * k))
    touch("touchEnd")
    turned = eye(opened)
    assert opened.chosen() == ""
    way = first @ turned / (np.linalg.norm(first) * np.linalg.norm(turned))
    assert 0.3 < way < 0.98
    touch("touchStart", (x - 50, y), (x + 50, y))
    for k in range(1, 11):
        touch("touchMove", (x - 50 - 10 * k, y), (x + 50 + 10 * k, y))
    touch("touchEnd")
    nearer = eye(opened)
    # Fingers three times as far apart: three times as near.
    middle = opened.scene.read.rungs.reshape(-1, 3)
    middle = (middle.min(axis=0) + middle.max(axis=0)) / 2
    assert np.linalg.norm(nearer - middle) == pytest.approx(
        np.linalg.norm(turned - middle) / 3, rel=0.08
    )
    px, py, label = next(p for p in opened.points(all_of(torus), 20, seed=3) if p[2])
    touch("touchStart", (box["x"] + px, box["y"] + py))
    touch("touchEnd")
    assert opened.chosen() == label
    opened.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "size", ["phone", *(pytest.param(s, marks=pytest.mark.slow) for s in ("laptop", "tablet"))]
)
@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_every_size_has_room_for_everything(browser, torus, tmp_path, size, scheme):
    opened = Tab(browser, torus, size=SIZES[size], color_scheme=scheme)
    page = opened.page
    label = torus.ids[len(torus.ids) // 2]
    page.fill("#query", label)
    page.keyboard.press("Enter")
    for name in ("piece", "sheet", "steps"):
        page.click(f"#tab-{name}")
        opened.settle()
        page.screenshot(path=tmp_path / f"{size}_{scheme}_{name}.png")
        wide, high = SIZES[size]
        assert page.evaluate("document.documentElement.scrollWidth") <= wide
        assert page.evaluate("document.documentElement.scrollHeight") <= high
        box = page.locator("#object").bounding_box()
        assert box["width"] * box["height"] >= 0.3 * wide * high
        low = page.locator(f"#panel-{name}").bounding_box()
        assert low["height"] >= 180
        assert low["y"] + low["height"] <= high + 1
    for button in page.locator("button:visible:not(.link, .chip, #pad *)").all()[:20]:
        assert button.bounding_box()["height"] >= 43
    for button in page.locator("#pad button").all():
        assert min(button.bounding_box()[side] for side in ("width", "height")) >= 24
    opened.close()


@pytest.mark.slow
def test_paper_shows_piece_sheet_and_object(browser, torus, tmp_path):
    opened = Tab(browser, torus, color_scheme="dark")
    opened.search("B2")
    opened.settle()
    opened.page.pdf(path=tmp_path / "print.pdf", format="A4")
    pages = PdfReader(tmp_path / "print.pdf").pages
    text = " ".join(page.extract_text() for page in pages)
    assert torus.plan.steps[0].pieces[0] in text
    assert "Sheet 1 of" in text
    assert "A3, A, #12" not in text
    # The object is a picture of its own, at 300 dots an inch over 165 mm, on white, and not blank.
    pictures = [np.asarray(image.image.convert("RGB"), float) for image in pages[0].images]
    object_ = max(pictures, key=np.size)
    assert object_.shape[1] >= 1950
    assert np.all(object_[0] == 255.0)
    assert np.all(object_[-1] == 255.0)
    assert np.mean(object_.min(axis=2) < 250) > 0.1
    # What was chosen is named in it, in white on black.
    assert np.mean(object_.max(axis=2) < 40) > 0.002
    # Afterwards the page is as it was.
    assert opened.page.locator("#picture").get_attribute("src") is None
    opened.page.emulate_media(media="print")
    for shown in ("#panel-piece", "#panel-sheet", "#step-text"):
        assert opened.page.locator(shown).is_visible()
    for hidden in ("#query", "#tab-piece", "#slider", "#panel-steps", "#pad", "#play", "#object"):
        assert not opened.page.locator(hidden).is_visible()
    opened.close()


#: Counts the triangles that are drawn to the screen, in ``window.drawn``.
COUNT = """for (const name of ['drawElements', 'drawArrays']) {
  const real = WebGL2RenderingContext.prototype[name];
  window.drawn = 0;
  WebGL2RenderingContext.prototype[name] = function (...how) {
    if (this.getParameter(this.FRAMEBUFFER_BINDING) === null)
      window.drawn += (name === 'drawElements' ? how[1] : how[2]) / 3;
    return real.apply(this, how);
  };
}"""
#: Goes to a step by the slider; returns how many triangles the next picture is made of.
STEP = """step => new Promise(told => {
  window.drawn = 0;
  const slider = document.getElementById('slider');
  slider.value = step;
  slider.dispatchEvent(new Event('input'));
  requestAnimationFrame(() => told(window.drawn));
})"""


def require_that_steps_draw_what_changes(opened, steps):
    """Where nothing turns, a step draws its own pieces and those of the step before, no others."""
    scene = opened.scene
    at = np.array([scene.step_of[label] for label in scene.ids])[scene.owner]
    opened.page.click("#follow")
    # The step at which the ghost of the first ones goes draws everything.
    opened.page.evaluate("document.getElementById('table').click()")
    opened.go_to(steps[0] - 1)
    for step in steps:
        drawn = opened.page.evaluate(STEP, step)
        assert drawn == np.count_nonzero((at == step) | (at == step - 1)), step
    opened.page.evaluate("window.drawn = 0; fabweave.draw()")
    # All that is there is drawn where it is asked for; what comes later never is.
    assert opened.page.evaluate("window.drawn") == np.count_nonzero(at <= steps[-1])


@pytest.mark.slow
def test_a_step_draws_only_what_changes(browser, torus):
    opened = Tab(browser, torus, script=COUNT)
    require_that_steps_draw_what_changes(opened, range(2, len(torus.plan.steps) + 1))
    opened.close()


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """As large as a cow of several hundred pieces."""
    return Scene(tmp_path_factory.mktemp("large"), "shape:torus?m=60&n=30", 1250.0, labels="none")


@pytest.mark.slow
def test_a_large_object_is_shown_and_its_steps_draw_only_what_changes(browser, large, tmp_path):
    assert len(large.ids) > 300
    # More corners than sixteen bits can number.
    assert len(large.corners) > 65_536
    assert large.path.stat().st_size < 25_000_000
    opened = Tab(browser, large, size=SIZES["laptop"], script=COUNT)
    last = len(large.plan.steps)
    require_that_steps_draw_what_changes(opened, range(last - 20, last + 1))
    opened.page.screenshot(path=tmp_path / "large.png")
    assert np.ptp(np.asarray(Image.open(tmp_path / "large.png").convert("RGB"))) > 100
    opened.close()
