"""What a person sees of the studio in a real browser: pixels, words, what hands and keys do."""

import time
from collections import Counter

import numpy as np
import pytest
from live_studio import Studio
from meshes_shared import shared_mesh
from studio_tab import Tab, pixels, still

pytestmark = pytest.mark.apt
TORUS = "shape:torus?m=8&n=4"


def test_before_anything_is_there_the_canvas_is_paper_with_words_on_it(browser, studio):
    page = browser.new_page(viewport={"width": 900, "height": 640})
    page.add_init_script("window.WebSocket = class { send() {} }; WebSocket.OPEN = 1;")
    page.goto(studio.address)
    time.sleep(1.5)
    assert page.locator("#waiting").is_visible()
    assert page.locator("#waiting").inner_text()
    # Paper: nearly all of it, in the light theme of this browser.
    assert (pixels(page).min(axis=2) > 200).mean() > 0.9
    page.close()


def test_where_nothing_is_named_there_is_a_place_to_drop_a_model(browser, tmp_path):
    studio = Studio(tmp_path / "studio")
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.goto(studio.address)
    page.locator("#start-drop").wait_for()
    assert "Drop your model" in page.locator("#start").inner_text()
    page.locator("#examples img").first.wait_for(timeout=60_000)
    source = page.locator("#examples img").first.get_attribute("src")
    assert source.startswith("data:image/")
    page.locator("[data-example]").first.click()
    page.locator("#figures dd").first.wait_for(timeout=90_000)
    assert not page.locator("#start").is_visible()
    # What was done is listed, and goes on with a tap, in a tab that knows nothing of it.
    page.close()
    late = time.monotonic() + 20.0
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.goto(studio.address)
    page.locator("[data-session]").first.wait_for(timeout=20_000)
    assert time.monotonic() < late
    page.locator("[data-session]").first.click()
    page.locator("#figures dd").first.wait_for(timeout=90_000)
    assert page.evaluate("studio.state.mesh").startswith("shape:")
    page.close()
    assert studio.end()[0] == 0


def test_fasteners_are_seen_as_dots(tab):
    first = tab.state()
    # Where they are few, most crossings have none.
    tab.page.evaluate("studio.set({ fasten: 'none' })")
    tab.settle()
    plain = still(tab.page)
    tab.page.locator('[data-tool="fasten"]').click()
    dotted = still(tab.page)
    changed = np.abs(plain - dotted).max(axis=2) > 60
    # Each dot has some sixty pixels; most of the half that is turned to the eye are seen.
    assert changed.sum() > 60 * 0.3 * 64
    blue = (dotted[..., 2] - dotted[..., 0] > 40) & changed
    assert blue.sum() > 300
    tab.page.locator('[data-tool="choose"]').click()
    tab.page.evaluate("state => studio.change(state)", first)
    tab.settle()


def reddish(picture):
    return ((picture[..., 0] - picture[..., 2] > 70) & (picture[..., 0] > 110)).sum()


@pytest.mark.slow
def test_trouble_is_coloured_on_the_object_and_a_button_mends_it(tab):
    for field, value in (("size-Size", "90"), ("thickness-Thickness", "0.8")):
        number = tab.page.locator(f'input[type=number][data-field="{field}"]')
        number.fill(value)
        number.press("Enter")
    tab.settle()
    calm, counts = reddish(still(tab.page)), tab.page.evaluate("studio.plan.trouble")
    chip = tab.page.locator('[data-trouble="bend"]')
    assert counts["bend"] > 0
    assert str(counts["bend"]) in chip.inner_text()
    chip.click()
    assert tab.page.locator("#legend").is_visible()
    assert reddish(still(tab.page)) > calm + 800
    chip.click()
    assert reddish(still(tab.page)) < calm + 200
    before = tab.page.evaluate("studio.plan.verdict.reasons.length")
    cure = tab.page.locator("[data-fix]").first
    option = next(iter(cure.evaluate("(one) => Object.keys(JSON.parse(one.dataset.fix))")))
    cure.click()
    assert option in tab.state()["options"]
    tab.settle()
    assert tab.page.evaluate("studio.plan.verdict.reasons.length") < before
    # The page says what that came to.
    assert tab.page.locator("#change").inner_text()
    for _ in range(3):
        tab.page.locator("#undo").click()
    tab.settle()


def test_a_number_beyond_the_slider_is_honoured_and_a_bad_one_refused_in_words(tab):
    first = tab.state()
    size = tab.page.locator('input[type=number][data-field="size-Size"]')
    size.fill("2600")
    size.press("Enter")
    assert tab.state()["options"]["size"] == "2600mm"
    tab.until("studio.seen.controls.find((one) => one.option === 'size').value > 2599")
    size.fill("-4")
    size.press("Enter")
    assert tab.page.locator("#hint.wrong").is_visible()
    assert "-4" in tab.page.locator("#hint").inner_text()
    assert float(size.input_value()) == 2600
    # What only the server can refuse is said, too, and can be taken back.
    quads = tab.page.locator('input[type=number][data-field="mesh-Quads_around_the_tube"]')
    quads.fill("1.5")
    quads.press("Enter")
    tab.page.locator("#take-back").click(timeout=20_000)
    assert tab.state()["options"]["size"] == "2600mm"
    tab.page.locator("#undo").click()
    assert tab.state() == first
    tab.settle()


@pytest.mark.slow
def test_a_piece_that_is_dropped_over_the_edge_stays_on_its_sheet(tab):
    tab.page.locator("#tab-sheets").click()
    piece = tab.page.locator("#panel-sheets .piece").first
    sheet = tab.page.locator("#panel-sheets svg").first.bounding_box()
    x, y = piece.evaluate("""(one) => {
      const box = one.getBoundingClientRect();
      for (let k = 0; k < 400; k++) {
        const at = [box.x + box.width * ((k % 20) + 0.5) / 20, box.y + box.height * (Math.floor(k / 20) + 0.5) / 20];
        if (document.elementFromPoint(...at) === one) return at;
      }
    }""")  # noqa: E501 - a script
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(sheet["x"] + sheet["width"] + 60, y, steps=4)
    tab.page.mouse.up()
    assert "pin" in tab.state()["options"]
    tab.settle()
    plan = tab.page.evaluate("studio.plan")
    name = tab.state()["options"]["pin"].partition("@")[0]
    number = [one["id"] for one in plan["pieces"]].index(name)
    _, _, x_mm, _, turn = next(place for place in plan["placed"] if place[0] == number)
    outline = np.array(plan["pieces"][number]["outline"])
    way = np.array([np.cos(np.radians(turn)), -np.sin(np.radians(turn))])
    assert (outline @ way + x_mm).max() <= plan["sheets"][0]["width"] - 9.9
    tab.page.locator("#undo").click()
    tab.settle()


@pytest.mark.slow
def test_what_is_stopped_says_so_and_goes_on(tab):
    first = tab.state()
    for field, value in (("Quads_around_the_ring", 60), ("Quads_around_the_tube", 40)):
        number = tab.page.locator(f'input[type=number][data-field="mesh-{field}"]')
        number.fill(str(value))
        number.press("Enter")
    tab.until("!document.getElementById('busy').hidden")
    tab.page.locator("#stop").click()
    tab.page.locator("#go-on").wait_for(timeout=20_000)
    assert "Stopped" in tab.page.locator("#hint").inner_text()
    tab.page.locator("#undo").click()
    tab.page.locator("#undo").click()
    assert tab.state() == first
    tab.settle()


def test_help_is_there_for_a_finger(browser, studio):
    tab = Tab(browser, studio, (390, 844), has_touch=True)
    ask = tab.page.locator(".ask").first
    box = ask.bounding_box()
    assert min(box["width"], box["height"]) >= 20
    ask.tap()
    assert len(tab.page.locator(".help:visible").inner_text()) > 20
    ask.tap()
    assert not tab.page.locator(".help:visible").count()
    # While a control moves, the object is in view.
    slider = tab.page.locator('#controls input[type=range][data-field="size-Size"]')
    slider.scroll_into_view_if_needed()
    tab.page.mouse.wheel(0, 200)
    time.sleep(0.3)
    view, room = tab.page.locator("#view").bounding_box(), tab.page.viewport_size
    assert view["y"] >= -1
    assert view["y"] + view["height"] <= room["height"]
    tab.close()


@pytest.mark.slow
def test_everything_by_hand_can_be_done_by_keys(tab):
    page = tab.page
    page.locator("#tab-strips").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.activeElement.id") == "tab-sheets"
    assert page.locator("#panel-sheets").is_visible()
    page.keyboard.press("Home")
    assert page.locator("#panel-choices").is_visible()
    page.locator("#tab-strips").click()
    page.locator("#panel-strips .piece").first.focus()
    page.keyboard.press("Enter")
    first = page.locator("#chosen").inner_text()
    page.keyboard.press("ArrowRight")
    assert page.locator("#chosen").inner_text() not in ("", first)
    page.locator("#object").focus()
    page.keyboard.press("n")
    assert page.locator("#chosen").inner_text()
    page.locator('[data-tool="fasten"]').click()
    page.locator("#object").focus()
    page.keyboard.press("n")
    page.keyboard.press("n")
    page.keyboard.press("Enter")
    assert tab.state()["options"]["fasten"] == "form,1"
    page.locator("#undo").click()
    page.locator('[data-tool="leave"]').click()
    tab.until("studio.seen.arrays.some((one) => one.name === 'face')")
    page.locator("#object").focus()
    page.keyboard.press("n")
    page.keyboard.press("Enter")
    assert tab.state()["options"]["leave_out"].isdigit()
    page.locator("#undo").click()
    page.locator('[data-tool="choose"]').click()
    tab.settle()
    page.locator("#tab-sheets").click()
    page.locator("#panel-sheets .piece").first.focus()
    page.keyboard.press("Shift+ArrowRight")
    assert "pin" in tab.state()["options"]
    page.locator("#undo").click()
    tab.settle()


@pytest.mark.slow
def test_the_sheet_is_a_stage_with_zoom_and_the_cut_is_played(tab):
    page = tab.page
    page.locator("#tab-sheets").click()
    small = page.locator("#panel-sheets svg").first.bounding_box()
    page.locator("#stage").click()
    time.sleep(0.3)
    large = page.locator("#panel-sheets svg").first.bounding_box()
    assert large["height"] > 1.8 * small["height"]
    page.locator('[data-zoom="1"]').click()
    assert page.locator("#panel-sheets svg").first.bounding_box()["height"] > 1.4 * large["height"]
    slider = page.locator("#cut-time")
    slider.evaluate(
        "(one) => { one.value = 0.5; one.dispatchEvent(new Event('input', { bubbles: true })); }"
    )
    cut, pieces = (page.locator(f"#panel-sheets .piece{more}").count() for more in (".cut", ""))
    assert 0 < cut < pieces
    assert "min" in page.locator("#cut-said").inner_text()
    page.locator("#stage").click()


@pytest.mark.slow
def test_a_reload_and_another_tab_find_all_that_was_done(browser, studio):
    tab = Tab(browser, studio)
    size = tab.page.locator('input[type=number][data-field="size-Size"]')
    for value in ("333", "355"):
        size.fill(value)
        size.press("Enter")
    state = tab.state()
    tab.settle()
    address = tab.page.evaluate("location.href")
    tab.close()
    other = browser.new_page(viewport={"width": 900, "height": 640})
    other.goto(address)
    other.locator("#figures dd").first.wait_for(timeout=60_000)
    assert other.evaluate("studio.state") == state
    other.locator("#undo").click()
    assert other.evaluate("studio.state.options.size") == "333mm"
    other.close()


@pytest.mark.slow
def test_an_object_runs_in_strand_by_strand_unless_nothing_is_to_move(browser, studio):
    def opened(motion):
        page = browser.new_page(viewport={"width": 700, "height": 560}, reduced_motion=motion)
        # The page's clock goes as slowly as is told: however busy the machine, its film is seen.
        page.add_init_script(
            "const clock = performance.now.bind(performance); window.pace = 1e-3;"
            "performance.now = () => clock() * window.pace;"
        )
        page.goto(studio.address)
        page.wait_for_selector("body[data-seen]", timeout=60_000)
        return page

    def covered(page):
        return (pixels(page).max(axis=2) < 215).mean()

    still, moving = opened("reduce"), opened("no-preference")
    whole = covered(still)
    assert covered(moving) < 0.6 * whole
    moving.evaluate("window.pace = 1e3")
    assert any(covered(moving) > 0.95 * whole for _ in range(50))
    still.close()
    moving.close()


@pytest.mark.slow
def test_a_found_model_is_grey_at_once_then_cards_to_choose_from(browser, tmp_path):
    studio = Studio(tmp_path / "studio", str(shared_mesh("quad/catmark_torus.obj")))
    page = browser.new_page(viewport={"width": 1100, "height": 760})
    page.emulate_media(reduced_motion="reduce")
    page.goto(studio.address)
    page.wait_for_selector("body[data-seen]", timeout=60_000)
    page.locator("[data-card]").first.wait_for(timeout=240_000)
    page.locator("#figures dd").first.wait_for(timeout=300_000)
    state = page.evaluate("studio.state")
    assert state["options"]["remesh"]
    chosen = page.locator('[data-card][aria-pressed="true"]')
    assert chosen.count() == 1
    assert "Usual" in chosen.inner_text()
    assert "pieces" in chosen.inner_text()
    assert chosen.locator("img").get_attribute("src").startswith("data:image/")
    # Undo does not go to a model that has to be chosen for once more.
    assert page.locator("#undo").is_disabled()
    page.close()
    assert studio.end()[0] == 0


@pytest.mark.parametrize(
    ("name", "alike"), [("pattern-Pattern", 1), ("joint-Joint", 1), ("material-Material", 2)]
)
def test_each_choice_has_a_drawing_of_its_own(tab, name, alike):
    tab.page.locator(f'select[data-field="{name}"]').click()
    drawings = tab.page.locator(f'select[data-field="{name}"] option:not([value=""]) svg').all()
    seen = Counter(drawing.screenshot() for drawing in drawings)
    assert len(drawings) > 6
    # A material in two thicknesses looks the same.
    assert max(seen.values()) <= alike
    tab.page.keyboard.press("Escape")


def test_nothing_but_tabs_is_in_the_list_of_tabs_and_each_panel_takes_the_focus(tab):
    assert tab.page.locator("[role=tablist] > :not([role=tab])").count() == 0
    for name in tab.page.locator("[role=tab]").all():
        name.click()
        panel = tab.page.locator(f"#{name.get_attribute('aria-controls')}")
        panel.focus()
        assert panel.evaluate("panel => panel === document.activeElement")


def inside(page, part, whole):
    part, whole = page.locator(part).first.bounding_box(), page.locator(whole).bounding_box()
    return whole["y"] <= part["y"] and part["y"] + part["height"] <= whole["y"] + whole["height"]


def test_on_a_tablet_held_upright_what_it_comes_to_and_a_sheet_are_seen_whole(browser, studio):
    tab = Tab(browser, studio, (820, 1180))
    tab.page.locator("#tab-sheets").click()
    for part in ("#grade", "#trouble", "#form-row", "#figures"):
        assert inside(tab.page, part, "#outcome"), part
    assert inside(tab.page, "#panel-sheets svg", "#flat")
    tab.close()


def test_on_a_phone_buttons_leave_room_for_the_object(browser, studio):
    tab = Tab(browser, studio, (390, 844))
    assert tab.page.locator("header").bounding_box()["height"] < 0.11 * 844
    tools = tab.page.locator("#tools button:visible").all()
    assert len({button.bounding_box()["y"] for button in tools}) == 1
    tab.close()


def test_pieces_are_seen_to_fall_onto_their_sheet(browser, studio):
    tab = Tab(browser, studio)
    tab.page.emulate_media(reduced_motion="no-preference")
    tab.page.locator("#tab-sheets").click()
    tab.page.evaluate("studio.drawSheets(true)")
    tops = []
    for time_ms in (0, 9_000):
        tab.page.evaluate(
            "at => document.getAnimations().forEach(one => { one.pause(); one.currentTime = at; })",
            time_ms,
        )
        pieces = tab.page.locator("#panel-sheets .piece").all()
        tops.append(np.array([piece.bounding_box()["y"] for piece in pieces]))
    high = tab.page.locator("#panel-sheets svg").first.bounding_box()["height"]
    assert (tops[1] - tops[0] > 0.25 * high).all()
    tab.close()


#: For each rung: where it is on the canvas in pixels, how far it looks up, how far over it is, how
#: far it looks at the eye and at the light, and how bright it is painted.
RUNGS = """() => {
  const { fabric, camera, stage } = studio.scene, { position, shade, colour } = fabric.mesh.geometry.attributes;
  const key = fabric.uniforms.key.value, eye = camera.towards(), found = [], count = position.count / 2;
  for (let k = 0; k < count; k += 2) {
    const mean = (one, part) => (one[part](k) + one[part](k + 1)) / 2;
    const [x, y, z] = ["getX", "getY", "getZ"].map((part) => mean(position, part));
    const [a, b, c, dip] = ["getX", "getY", "getZ", "getW"].map((part) => mean(shade, part));
    const at = key.clone().set(x, y, z).project(camera.lens);
    found.push([
      (at.x + 1) / 2 * stage.canvas.clientWidth, (1 - at.y) / 2 * stage.canvas.clientHeight, c, dip,
      a * eye.x + b * eye.y + c * eye.z, a * key.x + b * key.y + c * key.z, mean(colour, "getY"),
    ]);
  }
  return found;
}"""  # noqa: E501 - a script


def rungs_seen(tab):
    """Return what RUNGS tells of what looks at the eye, and how bright it is for its paint."""
    picture, rungs = still(tab.page), np.array(tab.page.evaluate(RUNGS))
    high, wide = picture.shape[:2]
    x, y = rungs[:, :2].astype(int).T
    there = (rungs[:, 4] > 0.35) & (x >= 0) & (x < wide) & (y > 50) & (y < high)
    rungs, bright = rungs[there], picture[y[there], x[there], 1] / 255.0
    return rungs[:, 2:].T, bright / rungs[:, 6]


def test_a_strand_is_darker_where_it_comes_from_under_another(tab):
    (_, dip, *_), bright = rungs_seen(tab)
    # Both are uncovered: a strand above, and one that dives, near the strand that covers it.
    above, below = bright[dip > 0.9], bright[(dip < -0.4) & (dip > -0.8)]
    assert min(len(above), len(below)) > 30
    assert np.median(below) < 0.93 * np.median(above)


def test_light_comes_over_the_left_shoulder_and_from_the_sky(tab):
    tab.page.evaluate("studio.scene.camera.home()")
    (rise, dip, _, lit, _), bright = rungs_seen(tab)
    over = dip > 0.9
    assert np.median(bright[over & (lit > 0.6)]) > 1.1 * np.median(bright[over & (lit < 0.1)])
    # Behind, where the key light does not reach, what looks up is brighter than what looks down.
    tab.page.evaluate("studio.scene.camera.look([120, 0], studio.scene.fabric.floor.position)")
    (rise, dip, _, lit, _), bright = rungs_seen(tab)
    dark = (dip > 0.5) & (lit < 0.0)
    up, down = (bright[dark & there] for there in (rise > -0.2, rise < -0.5))
    assert min(len(up), len(down)) > 12
    assert np.median(up) > 1.05 * np.median(down)
    # Over the left shoulder of who sees the object first, whatever the object is seen from.
    for azimuth in (-60, 35, 170):
        left = tab.page.evaluate(f"""() => {{
          const {{ scene }} = studio, across = scene.fabric.uniforms.key.value.clone();
          scene.seeFrom([{azimuth}, 20]);
          across.setFromMatrixColumn(scene.camera.lens.matrixWorld, 0);
          const {{ value }} = scene.fabric.uniforms.key;
          return [value.dot(across), value.dot(scene.camera.towards()), value.z];
        }}""")
        assert left[0] < -0.3
        assert min(left[1:]) > 0.3


@pytest.mark.parametrize("mesh", ["shape:torus?m=8&n=4", "shape:tube?m=8&n=3"])
def test_strips_are_bodies_without_a_hole_whose_thickness_is_seen(tab, mesh):
    first = tab.state()
    tab.page.evaluate("mesh => studio.change({ ...studio.state, mesh })", mesh)
    tab.settle()
    index = np.array(
        tab.page.evaluate("Array.from(studio.scene.fabric.mesh.geometry.index.array)")
    ).reshape(-1, 3)
    # A closed surface that looks outwards has each edge once in either direction.
    edges = np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]])
    ways = Counter(map(tuple, edges.tolist()))
    assert set(ways.values()) == {1}
    assert all((b, a) in ways for a, b in ways)
    seen = []
    for thick in ("0.1mm", "1.5mm"):
        tab.page.evaluate("thickness => studio.set({ thickness })", thick)
        tab.settle()
        seen.append(still(tab.page))
    assert (np.abs(seen[1] - seen[0]).max(axis=2) > 40).mean() > 0.005
    tab.page.evaluate("state => studio.change(state)", first)
    tab.settle()


def test_on_a_tablet_held_across_object_sheet_and_figures_are_beside_one_another(browser, studio):
    tab = Tab(browser, studio, (1024, 768), has_touch=True)
    tab.page.locator("#tab-sheets").click()
    view, outcome = (tab.page.locator(one).bounding_box() for one in ("#view", "#outcome"))
    assert view["height"] > 0.45 * 768
    assert view["x"] + view["width"] <= outcome["x"] + 1
    assert inside(tab.page, "#panel-sheets svg", "#flat")
    assert inside(tab.page, "#form-row", "#outcome")
    tools = tab.page.locator("#tools button:visible").all()
    assert len({button.bounding_box()["y"] for button in tools}) == 1
    tab.close()
