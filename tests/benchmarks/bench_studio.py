"""Time the studio in a browser: from input to frame for each control, while dragging, and memory.

Run by hand: ``python tests/benchmarks/bench_studio.py [minutes of random use]``. The browser draws
in software; a bound for the server alone stands beside each time: the ribbons made in this process.
"""

import random
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from live_studio import Studio
from viewer_tab import ARGUMENTS, CHROMIUM

from fabweave.job.stations import Stations

SIZES = {500: "shape:torus?m=25&n=10", 2000: "shape:torus?m=40&n=25", 8000: "shape:torus?m=80&n=50"}
#: Sets a control as a hand does, and waits until what it changes is drawn.
CHANGE = """([field, value]) => new Promise((done) => {
  const input = document.querySelector(`#controls [data-field="${field}"]:not([type=number])`);
  const before = studio.seen.n, begun = performance.now();
  input.value = value;
  input.dispatchEvent(new Event(input.type === "range" ? "input" : "change", { bubbles: true }));
  (function wait() {
    if (studio.seen.n > before) requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - begun)));
    else if (performance.now() - begun > 20000) done(NaN);
    else requestAnimationFrame(wait);
  })();
})"""  # noqa: E501 - a script
#: Drags a slider to and fro for some seconds, and counts how often the object moved.
DRAG = """([field, seconds]) => new Promise((done) => {
  const input = document.querySelector(`#controls [data-field="${field}"][type=range]`);
  const seen = new Set(), begun = performance.now();
  const [low, high] = [Number(input.min), Number(input.max)];
  (function step() {
    const part = (performance.now() - begun) / 1000;
    seen.add(studio.seen.n);
    if (part > seconds) return done((seen.size - 1) / seconds);
    input.value = low + (high - low) * (0.35 + 0.1 * Math.sin(2 * part));
    input.dispatchEvent(new Event("input", { bubbles: true }));
    requestAnimationFrame(step);
  })();
})"""
#: Turns the object by its keys, and counts frames.
TURN = """() => new Promise((done) => {
  const canvas = document.getElementById("object"), begun = performance.now();
  let count = 0;
  (function turn() {
    if (count === 20) return done((1000 * count) / (performance.now() - begun));
    count += 1;
    canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    requestAnimationFrame(turn);
  })();
})"""
CONTROLS = {
    "size-Size": ("310", "330", "350"), "width-Open": ("0.3", "0.4", "0.5"),
    "thickness-Thick": ("0.3", "0.5", "0.6"), "pattern-Pattern": ("twill", "plain", "twill"),
    "colours-Colours": ("direction", "safe"), "material-Material": ("birch-veneer", "card"),
    "refine-Refine": ("mid-edge:1", ""),
}  # fmt: skip


def opened(browser, studio):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(studio.address)
    while not page.evaluate("Boolean(window.studio && studio.seen)"):
        time.sleep(0.05)
    time.sleep(1.0)
    return page


def bound_s(mesh):
    """Return how long the ribbons take to be laid anew in this process."""
    stations = Stations.read(mesh, {"size": "300mm"})
    _ = stations.ribbons
    times = []
    for share in (0.3, 0.4, 0.5):
        begun = time.perf_counter()
        _ = stations.also({"width": f"open:{share}"}).ribbons
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def table(browser):
    for crossings, mesh in SIZES.items():
        studio = Studio(Path(tempfile.mkdtemp()) / "studio", mesh)
        page = opened(browser, studio)
        print(f"\n{crossings} crossings; ribbons alone {1000 * bound_s(mesh):.0f} ms")
        for field, values in CONTROLS.items():
            if crossings > 2000 and field == "refine-Refine":
                continue
            times = [page.evaluate(CHANGE, [field, value]) for value in values]
            name = field.partition("-")[0]
            print(f"  {name:12} input to frame {statistics.median(times):6.0f} ms")
        for field in ("width-Open", "size-Size"):
            rate = page.evaluate(DRAG, [field, 6.0])
            print(f"  {field.partition('-')[0]:12} dragged: {rate:.1f} objects a second")
        print(f"  a turn of the view: {page.evaluate(TURN):.1f} frames a second")
        page.close()
        studio.end()


def memory(browser, minutes):
    studio = Studio(Path(tempfile.mkdtemp()) / "studio", SIZES[500])
    page, dice = opened(browser, studio), random.Random(1)  # noqa: S311 - no secret
    begun, marks, changes = time.monotonic(), 0, 0
    while (gone := time.monotonic() - begun) < 60.0 * minutes:
        field = dice.choice([name for name in CONTROLS if name != "refine-Refine"])
        page.evaluate(CHANGE, [field, dice.choice(CONTROLS[field][-2:]) if "-Size" not in field
                               else str(dice.randrange(200, 500))])  # fmt: skip
        changes += 1
        time.sleep(dice.choice((0.0, 0.0, 1.5)))
        if gone > marks * 60.0 * minutes / 5:
            marks += 1
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
            print(f"  after {gone / 60:4.1f} min, {changes} changes: processes", end=" ")
            print(f"{_mb(studio.process.pid):.0f} MB, page {heap:.0f} MB")
    page.close()
    studio.end()


def _mb(pid):
    """Return the resident memory of a process and all below it."""
    total = 0
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        total += sum(_mb(int(child)) for child in path.read_text("ascii").split())
    pages = int(Path(f"/proc/{pid}/statm").read_text("ascii").split()[1])
    return total + pages * resource.getpagesize() / 1e6


if __name__ == "__main__":
    with sync_playwright() as tool:
        running = tool.chromium.launch(
            executable_path=CHROMIUM, args=[*ARGUMENTS, "--enable-precise-memory-info"]
        )
        table(running)
        if len(sys.argv) > 1:
            memory(running, float(sys.argv[1]))
        running.close()
