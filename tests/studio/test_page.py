"""The page of the studio in a real browser: every control, undo, tools, tabs, files, the job."""

import os
import random
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from live_studio import Studio
from studio_tab import Tab, tap

from fabweave.options.settings import settings_from_options

pytestmark = pytest.mark.apt
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def fields(tab, kind):
    """Return the names of the controls of a kind."""
    return tab.page.evaluate(
        f"[...document.querySelectorAll('#controls {kind}')].map((one) => one.dataset.field)"
    )


def test_every_slider_changes_one_option_and_undo_takes_it_back(tab):
    first = tab.state()
    names = fields(tab, "input[type=range]")
    assert {"size-Size", "width-Gaps", "thickness-Thickness"} <= set(names)
    for name in names:
        slider = tab.page.locator(f'#controls input[type=range][data-field="{name}"]')
        slider.focus()
        slider.press("ArrowRight")
        after = tab.state()
        option = name.split("-")[0]
        changed = {
            key for key in {*first["options"], *after["options"]}
            if first["options"].get(key) != after["options"].get(key)
        }  # fmt: skip
        assert changed == set() if option == "mesh" else changed == {option}
        assert (first["mesh"] != after["mesh"]) == (option == "mesh")
        settings_from_options(after["mesh"], **after["options"])
        tab.page.locator("#undo").click()
        assert tab.state() == first
    tab.settle()


@pytest.mark.slow
def test_every_choice_can_be_made(tab):
    for name in fields(tab, "select"):
        if name == "mesh-Model":
            continue
        field = tab.page.locator(f'#controls select[data-field="{name}"]')
        for value in field.locator("option").evaluate_all("(all) => all.map((o) => o.value)")[:3]:
            field.select_option(value)
            state = tab.state()
            settings_from_options(state["mesh"], **state["options"])
            assert (state["options"].get(name.split("-")[0]) or "") in (value, "")
        tab.page.evaluate("document.getElementById('undo').click()")
    tab.page.locator('select[data-field="mesh-Model"]').select_option("shape:octahedron")
    tab.until("studio.seen.title === 'Octahedron'")
    tab.settle()


@pytest.mark.slow
def test_fifty_changes_are_undone_and_done_again_and_a_reload_keeps_them(browser, studio):
    # Few pixels are drawn sooner.
    tab = Tab(browser, studio, (720, 500))
    dice, seen = random.Random(4), [tab.state()]  # noqa: S311 - no secret
    size = tab.page.locator('input[type=number][data-field="size-Size"]')
    for _ in range(50):
        size.fill(str(dice.randrange(150, 900)))
        size.press("Enter")
        if (now := tab.state()) != seen[-1]:
            seen.append(now)
    tab.page.reload()
    tab.until("Boolean(window.studio && studio.seen)")
    for states in (seen[::-1], seen):
        for state in states[1:]:
            tab.page.locator("#undo" if states is not seen else "#redo").click()
            assert tab.state() == state
    tab.settle()
    tab.close()


@pytest.mark.slow
def test_a_strand_shows_its_piece_and_a_piece_its_strand(tab):
    for y in (0.3, 0.4, 0.5, 0.6, 0.7):
        tap(tab, 0.42, y)
        if words := tab.page.locator("#chosen").inner_text():
            break
    assert "sheet" in words
    assert "step" in words
    assert tab.page.locator("#panel-strips .piece.chosen").count() == 1
    tab.page.locator("#tab-sheets").click()
    assert tab.page.locator("#panel-sheets .piece.chosen").count() == 1
    other = tab.page.locator("#panel-sheets .piece:not(.chosen)").first
    other.dispatch_event("click")
    assert tab.page.locator("#chosen").inner_text() != words
    tab.page.locator("#tab-steps").click()
    tab.page.locator("#panel-steps button").first.click()
    assert "step 1" in tab.page.locator("#chosen").inner_text()


@pytest.mark.slow
def test_a_face_is_left_out_and_a_crossing_fastened_by_a_tap(tab):
    tab.page.locator('[data-tool="fasten"]').click()
    for y in (0.3, 0.4, 0.5, 0.6):
        tap(tab, 0.42, y)
        if "fasten" in tab.state()["options"]:
            break
    rule, number = tab.state()["options"]["fasten"].split(",")
    assert rule == "form"
    tab.settle()
    assert int(number) in tab.page.evaluate("studio.plan.fastened")
    tap(tab, 0.42, y)
    assert "fasten" not in tab.state()["options"]
    tab.page.locator('[data-tool="leave"]').click()
    tab.until("document.body.dataset.seen && studio.seen.arrays.some((one) => one.name === 'face')")
    before = tab.page.evaluate("studio.seen.faces")
    tap(tab, 0.42, y)
    assert tab.state()["options"]["leave_out"].isdigit()
    tab.until(f"studio.seen.faces === {before - 1}")
    tap(tab, 0.42, y)
    assert "leave_out" not in tab.state()["options"]
    tab.settle()


def middle(tab, place):
    box = tab.page.locator(place).bounding_box()
    return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])


@pytest.mark.slow
def test_the_arrow_is_dragged_to_what_is_to_point_up_and_back(tab):
    first, mouse, arrow = tab.state(), tab.page.mouse, tab.page.locator("#arrow")
    assert not arrow.is_visible()
    tab.page.locator('[data-tool="up"]').click()
    time.sleep(0.3)
    start = middle(tab, "#arrow")
    mouse.move(*start)
    mouse.down()
    mouse.move(*(start + np.array([90, 60])), steps=5)
    # The arrow follows before anything is asked for.
    tab.until("document.getElementById('hint').textContent.startsWith('Up: ')")
    time.sleep(0.3)
    assert np.abs(middle(tab, "#arrow") - start - (90, 60)).max() < 2
    assert tab.state() == first
    mouse.up()
    up = tab.state()["options"]["up"]
    way = np.array([float(number) for number in up.split(",")])
    # To the right as it is seen, and towards the eye, which is in front on the left.
    assert way @ (np.cos(np.radians(30)), np.sin(np.radians(30)), 0.0) > 0.2
    assert settings_from_options(first["mesh"], up=up).mesh.up == up
    tab.settle()
    turn = np.array(tab.page.evaluate("studio.seen.turn"))
    assert np.abs(turn @ way / np.linalg.norm(way) - (0, 0, 1)).max() < 1e-9
    assert np.abs(middle(tab, "#arrow") - start).max() < 60
    select = tab.page.locator('select[data-field="up-Up"]')
    assert select.input_value() == up
    tab.page.locator("#undo").click()
    assert tab.state() == first
    tab.settle()
    # A little to the side it stops at the axis where it was; that is no change.
    start = middle(tab, "#arrow")
    mouse.move(*start)
    mouse.down()
    mouse.move(*(start + np.array([6, 0])), steps=3)
    mouse.up()
    assert tab.state() == first
    arrow.focus()
    arrow.press("ArrowLeft")
    assert "up" in tab.state()["options"]
    tab.settle()
    arrow.dblclick()
    assert tab.state() == first
    tab.settle()


@pytest.mark.slow
def test_a_piece_that_is_dragged_stays_and_the_rest_is_nested_around_it(tab):
    tab.page.locator("#tab-sheets").click()
    piece = tab.page.locator("#panel-sheets .piece").first
    name = piece.evaluate("(one) => studio.plan.pieces[Number(one.dataset.piece)].id")
    sheet = tab.page.locator("#panel-sheets svg").first.bounding_box()
    # Somewhere on the outline's inside, found by trying.
    x, y = piece.evaluate("""(one) => {
      const box = one.getBoundingClientRect();
      for (let k = 0; k < 400; k++) {
        const at = [box.x + box.width * ((k % 20) + 0.5) / 20, box.y + box.height * (Math.floor(k / 20) + 0.5) / 20];
        if (document.elementFromPoint(...at) === one) return at;
      }
    }""")  # noqa: E501 - a script
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 0.35 * sheet["width"], y - 5, steps=4)
    tab.page.mouse.up()
    pinned = tab.state()["options"]["pin"]
    assert pinned.startswith(f"{name}@1:")
    tab.settle()
    assert tab.page.locator("#panel-sheets .pinned").count() == 1
    placed = tab.page.evaluate("studio.plan.placed")
    number = tab.page.evaluate("studio.plan.pieces.map((one) => one.id)").index(name)
    _, _, x_mm, y_mm, turn = next(place for place in placed if place[0] == number)
    assert pinned == f"{name}@1:{x_mm:g},{y_mm:g},{turn:g}" or pinned.startswith(
        f"{name}@1:{x_mm:g}"
    )
    tab.page.locator("#panel-sheets .pinned").dblclick(force=True)
    tab.until("!studio.state.options.pin")
    tab.settle()


@pytest.mark.slow
def test_variants_are_kept_and_come_back(tab):
    first = tab.state()
    tab.page.locator("#keep").click()
    size = tab.page.locator('input[type=number][data-field="size-Size"]')
    size.fill("444")
    size.press("Enter")
    assert tab.state() != first
    tab.page.locator("[data-kept]").click()
    assert tab.state() == first
    tab.page.locator("[data-gone]").click()
    assert tab.page.locator("[data-kept]").count() == 0
    tab.settle()


@pytest.mark.slow
def test_yarns_shadows_and_both_themes_are_drawn(tab):
    pictures = set()
    for button in ("#shadows", "#shadows", "#theme", "#theme", "#yarns", "#yarns"):
        tab.page.locator(button).click()
        time.sleep(0.6)
        pictures.add(tab.page.locator("#object").screenshot())
    assert len(pictures) >= 4
    tab.settle()


@pytest.mark.slow
def test_a_file_is_dropped_and_bad_ones_are_told(tab):
    job = b'[job]\nmesh = "shape:cube"\nsize = "90mm"\n'
    for name, data in (("tetra.obj", OBJ), ("job.toml", job)):
        tab.page.locator("#open").set_input_files(
            {"name": name, "mimeType": "application/octet-stream", "buffer": data}
        )
        title = "Tetra" if name.endswith("obj") else "Cube"
        tab.until(f"studio.seen?.title === '{title}'")
    tab.page.locator("#open").set_input_files(
        {"name": "bad.toml", "mimeType": "text/plain", "buffer": b"[job"}
    )
    tab.until("document.getElementById('hint').classList.contains('wrong')")
    # What the server refuses is told by the browser, too.
    tab.wrong = [words for words in tab.wrong if "400" not in words]
    tab.settle()


@pytest.mark.slow
def test_an_answer_that_is_late_leaves_the_old_object_until_the_new_one_is_there(tab):
    before = tab.page.evaluate("studio.seen.n")
    tab.page.evaluate("""() => {
      const field = document.querySelector('select[data-field="refine-Refine"]');
      field.value = "catmull-clark:2";
      field.dispatchEvent(new Event("change", { bubbles: true }));
    }""")
    assert tab.page.evaluate("studio.seen.n") == before
    tab.page.locator("#undo").click()
    tab.settle()
    assert tab.page.evaluate("studio.seen.crossings") == 64


HOSTILE = """async (address) => {
  const tries = [];
  for (const how of [{}, { method: "POST", body: "x" }, { mode: "no-cors", method: "POST", body: "x" }])
    tries.push(await fetch(address + (how.method ? "end" : "state"), how).then((answer) => answer.type === "opaque" ? "opaque" : "read", () => "refused"));
  tries.push(await new Promise((done) => {
    const socket = new WebSocket(address.replace("http", "ws") + "live");
    socket.onopen = () => done("open");
    socket.onerror = () => done("refused");
  }));
  return tries;
}"""  # noqa: E501 - a script


def test_a_hostile_page_in_another_tab_reads_nothing_and_ends_nothing(browser, studio, tmp_path):
    # Even one that knows the secret, which it cannot.
    (tmp_path / "index.html").write_text("<title>hostile</title>")
    serve = [sys.executable, "-m", "http.server", "0", "--bind", "127.0.0.1", "-d", str(tmp_path)]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                          env={**os.environ, "PYTHONUNBUFFERED": "1"}) as other:  # fmt: skip
        port = re.search(r"port (\d+)", other.stdout.readline())[1]
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{port}/")
        tries = page.evaluate(HOSTILE, studio.address)
        page.close()
        other.terminate()
    assert set(tries) <= {"refused", "opaque"}
    assert tries[3] == "refused"
    assert studio.ask("state")[0] == 200
    assert studio.process.poll() is None


@pytest.mark.slow
def test_what_takes_long_is_stopped_by_the_button(tab):
    for field, value in (("Quads_around_the_ring", 60), ("Quads_around_the_tube", 40)):
        number = tab.page.locator(f'input[type=number][data-field="mesh-{field}"]')
        number.fill(str(value))
        number.press("Enter")
    tab.until("!document.getElementById('busy').hidden")
    tab.page.locator("#stop").click()
    tab.until("document.getElementById('busy').hidden", 20.0)
    tab.page.locator("#undo").click()
    tab.page.locator("#undo").click()
    tab.settle()


@pytest.mark.slow
def test_a_job_is_made_and_opens_in_the_page(browser, tmp_path):
    studio = Studio(tmp_path / "studio", "shape:octahedron")
    tab = Tab(browser, studio)
    try:
        tab.page.locator("#make").click()
        tab.until("!document.getElementById('job-frame').hidden", 180.0)
        frame = tab.page.frame_locator("#job-frame")
        assert "Octahedron" in frame.locator("h1").inner_text()
        assert (studio.folder / "jobs" / "octahedron" / "verify.json").is_file()
        tab.page.locator("#job-close").click()
        # End asks first, and says where the work is.
        tab.page.locator("#end").click()
        assert str(studio.folder) in tab.page.locator("#ending").inner_text()
        tab.page.locator("#ending [data-close]").click()
        assert studio.process.poll() is None
        tab.page.locator("#end").click()
        tab.page.locator("#end-now").click()
        tab.until("document.body.innerText.includes('has ended')")
    finally:
        tab.close()
        assert studio.process.wait(timeout=20) == 0
        studio.process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 800), (820, 1180), (390, 844)])
def test_nothing_hangs_over_the_sides(browser, studio, size):
    tab = Tab(browser, studio, size)
    wide = tab.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert wide[0] <= wide[1]
    names = tab.page.evaluate("""() => [...document.querySelectorAll("button, input, select, canvas, a, svg")]
      .filter((one) => one.offsetParent && !(one.getAttribute("aria-label") || one.textContent.trim() || one.title || one.closest("label")))
      .map((one) => one.outerHTML)""")  # noqa: E501 - a script
    assert names == []
    tab.close()
