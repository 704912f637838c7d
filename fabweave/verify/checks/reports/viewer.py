"""Check that the viewer shows what the map says and where the model has it, and loads nothing."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from fabweave.verify.checks.reports.hands import seconds_of_steps
from fabweave.verify.crossing_map import CrossingMap, Piece, Thread
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.geometry import panel_bounds
from fabweave.verify.measure.threads import station_run
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import MOST_VIEWED, Job, required
from fabweave.verify.read.manual import ManualPage
from fabweave.verify.read.viewer import Viewer
from fabweave.verify.statement import Place, Tally

#: The page as it is shipped: policy, styles and scripts. A change of the viewer changes it.
FRAME = "678b1e37a85bd19bf8d8022f97edb6f7def6d85c44a91c835dc1ca4c62a61caa"
#: The three.js that trimesh brings along from 4.12 on; older releases have none, and the page says
#: that it cannot show space.
THREE = (
    "1baf8525cd80caceabd6eb50da7961aa47f191ac7a68adb454c3a761b29244e2",
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
)
#: The page rounds the map's numbers to a thousandth.
ROUNDED = 5.1e-4
#: Seconds of steps are rounded to a tenth.
ROUNDED_S = 0.051
#: Bytes of light in the model are rounded by as much, and a little.
SAME_LIGHT = 0.0025
#: From where the manual shows steps: from higher than this it is straight above.
_AROUND = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")
_STEEP_DEG = 60.0
_SEEN = re.compile(
    r"Next: steps? (\d+)(?: to (\d+))? (?:Seen|Turn the object to see it) from ([^.]+)\."
)
#: Coordinates in space may be this coarse, for looking.
COARSE_MM = 0.1


def check_viewer(job: Job, tally: Tally) -> None:
    """Check assembly.html against the crossing map, the model and the hours of waste.json."""
    viewer, plan, place = job.viewer, required(job.map), tally.at("assembly.html")
    if viewer is None:
        place.expect(len(plan.crossings) > MOST_VIEWED, "not checked, because it could not be read")
        return
    place.equal("the digest of the page around its data", viewer.frame, FRAME)
    place.expect(
        viewer.three in THREE,
        f"its copy of three.js is unknown ({viewer.three[:16]}…): it is none that fabweave ships",
    )
    for key in sorted({*viewer.plan, *(job.document or {})}):
        where = _difference(viewer.plan.get(key), (job.document or {}).get(key), key)
        place.expect(where is None, f"it differs from crossing_map.json in {where}")
    if job.waste is not None:
        _check_hands(plan, job.waste.get("estimate"), viewer.hands, place)
    if job.manual is not None:
        sides = [_side(*view) for view in viewer.views_deg]
        place.equal("the sides from which steps are seen", sides, _sides(job.manual))
    if place.equal(
        "the numbers of pieces in space, with rungs, with panels and with colours,",
        (len(viewer.counts), len(viewer.panels), len(viewer.colours)),
        (len(plan.pieces), len(plan.pieces), len(plan.pieces)),
    ):
        _check_space(plan, required(job.model), viewer, place)


def _check_hands(
    plan: CrossingMap, estimate: dict[str, Any] | None, hands: Any, place: Place
) -> None:
    """Check how long steps take, and all of them; another check counts the hours of waste.json."""
    if estimate is None:
        place.expect(hands is None, "it tells hours, and waste.json has none")
        return
    place.equal("its hours", hands["hours"], estimate["assembly"]["hours"])
    wanted = seconds_of_steps(plan)
    if place.equal("the number of steps with a time", len(hands["seconds"]), len(wanted)):
        off = np.abs(np.array(hands["seconds"], dtype=np.float64) - wanted).max(initial=0.0)
        place.expect(bool(off <= ROUNDED_S), "a step takes another time")


def _side(azimuth_deg: float, rise_deg: float) -> str:
    """Say from where something is seen, as the manual does."""
    high = "above" if rise_deg > 0.0 else "below"
    if abs(rise_deg) > _STEEP_DEG:
        return f"straight {high}"
    side = _AROUND[int(np.floor((azimuth_deg + 90.0) / 45.0 + 0.5)) % 8]
    return f"the {side}" + (f" and {high}" if rise_deg else "")


def _sides(manual: Sequence[ManualPage]) -> list[str]:
    """Return from where the manual shows each step that it shows."""
    text = " ".join(text for page in manual for text in page.texts)
    sides: list[str] = []
    for first, last, side in _SEEN.findall(text):
        sides += [side] * (int(last or first) - int(first) + 1)
    return sides


def _difference(shown: Any, true: Any, where: str) -> str | None:
    """Return where a value of the page is not the map's, rounded; None if nowhere."""
    if isinstance(true, dict):
        if not isinstance(shown, dict) or shown.keys() != true.keys():
            return where
        pairs = [(shown[key], true[key], f"{where}.{key}") for key in true]
    elif isinstance(true, list):
        if not isinstance(shown, list) or len(shown) != len(true):
            return where
        pairs = [(shown[at], true[at], f"{where}[{at}]") for at in range(len(true))]
    elif isinstance(true, float):
        good = type(shown) in (int, float) and abs(shown - true) <= ROUNDED
        return None if good else where
    else:
        return None if type(shown) is type(true) and shown == true else where
    places = (_difference(*pair) for pair in pairs)
    return next((place for place in places if place is not None), None)


def _check_space(plan: CrossingMap, model: dict[str, Strip], viewer: Viewer, place: Place) -> None:
    """Check every piece's stretch of ribbon against the model."""
    first = 0
    for number, piece in enumerate(plan.pieces):
        rows = slice(first, first + int(viewer.counts[number]))
        first = rows.stop
        thread = plan.thread.get(piece.thread)
        strip = model.get(thread.label) if thread is not None else None
        if thread is None or strip is None or len(strip.entry) != len(thread.crossings):
            place.fail(f"piece {piece.id} is not checked, because the model has no strip for it")
            continue
        begin = station_run(thread, piece)
        if begin is None:
            continue  # its stations are no run of its thread: another check says so
        here = place.at(f"piece {piece.id}")
        _check_piece(piece, thread, strip, begin, viewer, rows, number, here)


def _check_piece(
    piece: Piece,
    thread: Thread,
    strip: Strip,
    begin: int,
    viewer: Viewer,
    rows: slice,
    number: int,
    place: Place,
) -> None:
    """Check one piece's stretch of ribbon: its rungs, its panels, its diagonals."""
    entry, leave = panel_bounds(strip, begin, len(piece.stations))
    start, end = int(entry[0]), int(leave[-1])
    if not strip.closed and begin == 0:
        start = 0
    if not strip.closed and begin + len(piece.stations) == len(thread.crossings):
        end = len(strip.rungs) - 1
    rung = np.arange(start, end + 1) % len(strip.rungs)
    if not place.expect(
        rows.stop - rows.start == len(rung)
        and np.array_equal(viewer.panels[number], entry - start),
        f"it has {rows.stop - rows.start} rungs, the model {len(rung)}; or its stations are not at "
        "the model's panels",
    ):
        return
    place.expect(
        np.array_equal(viewer.from_right[rows][:-1] != 0, strip.from_right[rung[:-1]]),
        "a quad has the other diagonal than in the model",
    )
    told = viewer.colours[number]
    if place.expect(
        len(told) == len(rung) and all(re.fullmatch("#[0-9a-f]{6}", word) for word in set(told)),
        f"it has {len(told)} colours for {len(rung)} rungs, or one is none",
    ):
        place.at_most(
            "viewer_light",
            float(np.abs(_light_of_words(told)[:, None] - strip.light[rung]).max()),
            SAME_LIGHT,
            "its colour is {} of light from that in the model",
        )
    place.at_most(
        "viewer_mm",
        float(np.abs(viewer.rungs[rows] - strip.rungs[rung]).max()),
        min(viewer.step_mm, COARSE_MM) + strip.grain_mm,
        "it stands {} from its place in the model",
    )


def _light_of_words(words: Iterable[str]) -> Floats:
    """Return the linear light, (N, 3), of colours such as ``#0072b2``."""
    coded = np.array([list(bytes.fromhex(word[1:])) for word in words], dtype=np.float64) / 255.0
    coded = coded.reshape(-1, 3)
    return np.where(coded > 0.04045, ((coded + 0.055) / 1.055) ** 2.4, coded / 12.92)
