"""Every kind of joint is proved from the files, and a joint that does not fit is found."""

import json
import shutil
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
import shapely
from jobs import make_job
from sealing import found_by
from spoiling import edit_json

from fabweave.job.write import write_plan
from fabweave.options.settings import Settings
from fabweave.piece import joined_object
from fabweave.piece.joint import kinds
from fabweave.piece.joint import kinds as interlock
from fabweave.stock.sheet_size import SheetSize
from fabweave.verify.check.joints import check_joints
from fabweave.verify.check.pieces import check_crossing_holes, check_unfolding
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = pytest.mark.usefixtures("quick_jobs")

CHECKS = {
    "joints": check_joints,
    "crossing-holes": check_crossing_holes,
    "unfolding": check_unfolding,
}
BASE = Settings.of(
    "shape:octahedron", size_mm=160.0, effort="quick", sheets=(SheetSize(400.0, 300.0),)
)
KINDS = {
    "rivet": {},
    "rivet:2": {"joint": "rivet:2"},
    "slots": {"joint": "rivet,slots"},
    "glue": {"joint": "glue,lap=14mm"},
    "tuck": {"joint": "tuck", "source": "shape:torus?m=16&n=8", "fasten": "all"},
    "none": {"joint": "none"},
    "dovetail": {"joint": "dovetail"},
    "slot": {"joint": "slot"},
}


def write(folder, **options):
    write_plan(make_job(BASE.but(**options)), folder)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return a function that gives the folder of a true job, which no test may change."""
    root = tmp_path_factory.mktemp("joints")

    def made(kind):
        folder = root / kind.replace(":", "")
        if not folder.exists():
            folder.mkdir()
            write(folder, **KINDS[kind])
        return folder

    return made


def objections(folder) -> dict[str, str]:
    """Return what each check finds in a folder, by name; nothing if it finds nothing."""
    tally = Tally("files")
    job = load_job(folder, tally)
    assert job.map is not None, tally.result().findings
    found = {name: found_by(check, job) for name, check in CHECKS.items()}
    return {name: words for name, words in found.items() if words}


@pytest.fixture
def spoiled(folders, tmp_path):
    """Return a function that spoils the plan of a job and tells what the checks find."""

    def run(kind, spoil):
        folder = tmp_path / "job"
        shutil.copytree(folders(kind), folder)
        edit_json(folder / "crossing_map.json", lambda plan: spoil(plan, plan["joints"][0]))
        return objections(folder)

    return run


def without_tucks(rows):
    """Return rows of which those are slow that want a job of tucks: it has long laps to plan."""
    slow = pytest.mark.slow
    return [pytest.param(*row, marks=[slow] * (row[0] == "tuck")) for row in rows]


@pytest.mark.parametrize("kind", without_tucks((kind,) for kind in KINDS))
def test_true_joints_pass(kind, folders):
    plan = json.loads((folders(kind) / "crossing_map.json").read_text("utf-8"))
    wanted = plan["joints"][0]["kind"]
    assert {joint["kind"] for joint in plan["joints"]} == {wanted}
    assert wanted == KINDS[kind].get("joint", "rivet").partition(",")[0].partition(":")[0]
    assert len(plan["joints"][0]["holes"]) == {"rivet": 1, "slots": 1, "rivet:2": 2}.get(kind, 0)
    assert objections(folders(kind)) == {}


# --- what spoils a plan -------------------------------------------------------------------------


def piece_of(plan, joint, side):
    return next(piece for piece in plan["pieces"] if piece["id"] == joint["pieces"][side])


def end_station(plan, joint, side):
    return piece_of(plan, joint, side)["stations"][-1 if side == 0 else 0]


def reshape(plan, joint, side, change):
    """Change a piece's figure: what is cut and its outline."""
    piece, station = piece_of(plan, joint, side), end_station(plan, joint, side)
    figure = change(shapely.Polygon(piece["outline"]), shapely.Point(station["x"], station["y"]))
    ring = shapely.get_coordinates(shapely.normalize(figure).exterior)[:-1][::-1].tolist()
    piece["outline"] = ring
    piece["path"] = [[x, y, 0.0] for x, y in ring]


def holes_at(plan, joint, side):
    at = {0: len(piece_of(plan, joint, 0)["stations"]) - 1, 1: 0}[side]
    cutouts = piece_of(plan, joint, side)["cutouts"]
    return [one for one in cutouts if one["station"] == at]


def over(plan, joint):
    """Return the piece that lies above a joint, and its holes there."""
    strand = next(one for one in plan["crossings"] if one["id"] == joint["crossing"])["over"]
    piece = next(piece for piece in plan["pieces"] if piece["id"] == strand["piece"])
    return piece, [one for one in piece["cutouts"] if one["station"] == strand["station"]]


def move_hole_of_one_lap(plan, joint):
    holes_at(plan, joint, 1)[0]["x"] += 0.1
    joint["holes"][0][1][0] += 0.1


def exchange_holes_of_one_lap(_, joint):
    (_, first), (_, second) = joint["holes"]
    first[:], second[:] = second[:], first[:]


def move_hole_of_the_strand_above(plan, joint):
    over(plan, joint)[1][0]["y"] += 0.1


def drop_hole_of_the_strand_above(plan, joint):
    piece, holes = over(plan, joint)
    piece["cutouts"].remove(holes[0])


def change_hole(number, key, by):
    def edit(plan, joint):
        holes_at(plan, joint, 0)[number][key] += by

    return edit


def state(**changes):
    """Return an edit of what is stated of a joint."""
    return lambda _plan, joint: joint.update(changes)


def tuck_two_crossings_only(_plan, joint):
    """Let a lap end with the panel of the next crossing, as the map says."""
    joint["ahead_mm"] -= 0.5 * joint["ahead_mm"]


def fasten_a_lap(plan, joint):
    piece_of(plan, joint, 1)["stations"][1]["hole_mm"] = 3.3


def lay_the_end_on_top(plan, joint):
    piece_of(plan, joint, 1)["stations"][2]["over"] = True


def state_more(key, by):
    return lambda _plan, joint: joint.update({key: joint[key] + by})


def shorten_a_lap(plan, joint):
    def change(figure, station):
        end = figure.exterior.interpolate(figure.exterior.project(station))
        return figure - end.buffer(2.0)

    reshape(plan, joint, 0, change)


def leave_a_gap(plan, joint):
    reshape(plan, joint, 1, lambda figure, station: figure - station.buffer(9.0))


def let_pieces_overlap(plan, joint):
    reshape(plan, joint, 1, lambda figure, station: figure | station.buffer(3.0))


def widen_the_tab(plan, joint):
    reshape(plan, joint, 0, lambda figure, station: figure | station.buffer(9.0, quad_segs=3))


def lose_the_slot(plan, joint):
    piece_of(plan, joint, 1)["cutouts"] = [
        one for one in piece_of(plan, joint, 1)["cutouts"] if one["kind"] != "slot"
    ]


def narrow_the_slot(plan, joint):
    slot = holes_at(plan, joint, 1)[0]
    path = np.array(slot["path"])
    short = np.argmin(np.hypot(*np.diff(path[:, :2], axis=0).T))
    side = path[short + 1, :2] - path[short, :2]
    middle = path[:, :2].mean(axis=0)
    unit = side / np.hypot(*side)
    path[:, :2] -= 0.5 * np.outer((path[:, :2] - middle) @ unit, unit)
    slot["path"] = path.tolist()


def move_the_slot(plan, joint):
    slot = holes_at(plan, joint, 1)[0]
    slot["path"] = [[x + 4.0, y + 4.0, b] for x, y, b in slot["path"]]


def sliding(plan):
    """Return a slot in place of a hole, and its piece."""
    piece = next(p for p in plan["pieces"] if any(one["kind"] == "slot" for one in p["cutouts"]))
    return piece, next(one for one in piece["cutouts"] if one["kind"] == "slot")


def shift_a_sliding_slot(plan, _joint):
    _, slot = sliding(plan)
    slot["path"] = [[x + 0.2, y, b] for x, y, b in slot["path"]]


def widen_a_sliding_slot(plan, _joint):
    _, slot = sliding(plan)
    path = np.array(slot["path"])
    path[:, :2] += 0.1 * (path[:, :2] - path[:, :2].mean(axis=0))
    slot["path"] = path.tolist()


def put_a_slot_at_the_joint(plan, joint):
    _, slot = sliding(plan)
    hole = holes_at(plan, joint, 0)[0]
    shift = np.array([hole["x"], hole["y"]]) - np.array(slot["path"])[:, :2].mean(axis=0)
    own = {"station": hole["station"], "kind": "slot",
           "path": [[x + shift[0], y + shift[1], b] for x, y, b in slot["path"]]}  # fmt: skip
    cutouts = piece_of(plan, joint, 0)["cutouts"]
    cutouts[cutouts.index(hole)] = own


def cut_out_something_more(plan, joint):
    piece = piece_of(plan, joint, 0)
    piece["cutouts"].append({**piece["cutouts"][0], "x": piece["cutouts"][0]["x"] + 4.0})


LONGER_LAP = state_more("lap_mm", 2.0)
SPOILS = [
    ("rivet:2", move_hole_of_one_lap, "joints", "off its partner"),
    ("rivet:2", exchange_holes_of_one_lap, "joints", "off its partner"),
    ("rivet:2", move_hole_of_the_strand_above, "joints", "off that of"),
    ("rivet:2", drop_hole_of_the_strand_above, "crossing-holes", "but should be 2"),
    ("rivet:2", change_hole(1, "diameter_mm", 0.5), "crossing-holes", "diameters"),
    ("rivet:2", change_hole(0, "x", 0.01), "crossing-holes", "from where its station"),
    ("rivet", state_more("grip_mm", 0.4), "joints", "grip"),
    ("rivet", state(kind="weld"), "joints", "no joint of kind 'weld'"),
    ("rivet", state(kind="glue"), "joints", "is of kind glue"),
    ("rivet", cut_out_something_more, "crossing-holes", "but should be 1"),
    ("rivet", LONGER_LAP, "joints", "do not lie on one another"),
    ("glue", LONGER_LAP, "joints", "do not lie on one another"),
    ("glue", LONGER_LAP, "unfolding", "leaves the unfolded ribbon"),
    ("glue", state(lap_mm=0.0), "joints", "laps by 0.0 mm"),
    ("glue", shorten_a_lap, "joints", "do not lie on one another"),
    ("tuck", tuck_two_crossings_only, "joints", "not over 3"),
    ("tuck", tuck_two_crossings_only, "unfolding", "leaves the unfolded ribbon"),
    ("tuck", fasten_a_lap, "joints", "only one of its layers"),
    ("tuck", lay_the_end_on_top, "joints", "does not end under"),
    ("tuck", state_more("ahead_mm", 2.0), "joints", "do not lie on one another"),
    ("tuck", shorten_a_lap, "joints", "do not lie on one another"),
    ("glue", state(kind="tuck"), "joints", "goes over 1 crossings"),
    ("none", leave_a_gap, "joints", "apart along their seam"),
    ("none", let_pieces_overlap, "joints", "side by side"),
    ("none", LONGER_LAP, "joints", "laps by 2.0 mm"),
    ("dovetail", leave_a_gap, "joints", "apart along their seam"),
    ("dovetail", let_pieces_overlap, "joints", "side by side"),
    ("slot", widen_the_tab, "joints", "its tab is"),
    ("slot", lose_the_slot, "joints", "has no slot"),
    ("slot", narrow_the_slot, "joints", "mm wide"),
    ("slot", move_the_slot, "joints", ""),
    ("slots", shift_a_sliding_slot, "crossing-holes", "off its station"),
    ("slots", widen_a_sliding_slot, "crossing-holes", "for a fastener"),
    ("slots", put_a_slot_at_the_joint, "crossing-holes", "where there is a joint"),
]


@pytest.mark.parametrize(("kind", "spoil", "check", "words"), without_tucks(SPOILS))
def test_spoiled_joints_are_found(kind, spoil, check, words, spoiled):
    found = spoiled(kind, spoil)
    assert words in found[check]


@pytest.mark.parametrize(
    "cutout",
    [
        {"station": 0, "kind": "star", "x": 0, "y": 0},
        {"station": 0, "kind": "slot", "path": [[0, 0, 0], [1, 0, 0]]},
        {"station": 0, "kind": "hole", "x": 0, "y": 0},
    ],
)
def test_cutouts_that_are_none_are_no_map(cutout, folders, tmp_path):
    folder = tmp_path / "job"
    shutil.copytree(folders("rivet"), folder)
    edit_json(
        folder / "crossing_map.json", lambda plan: plan["pieces"][0]["cutouts"].append(cutout)
    )
    tally = Tally("files")
    assert load_job(folder, tally).map is None
    assert "cutouts" in tally.result().findings[0]


# --- makers that err: all files agree with one another, and yet the joint does not hold ----------


def make_otherwise(monkeypatch, name, **changes):
    """Let the makers shape a kind of joint otherwise."""
    records = {**kinds.KINDS, name: replace(kinds.KINDS[name], **changes)}
    monkeypatch.setattr(kinds, "KINDS", MappingProxyType(records))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("_HEAD", 0.2, "pulled apart at"),
        ("CLEARANCE_MM", -0.4, "side by side"),
        ("CLEARANCE_MM", 0.6, "apart along their seam"),
    ],
)
def test_a_dovetail_that_is_shaped_wrongly_is_found(name, value, words, monkeypatch, tmp_path):
    monkeypatch.setattr(interlock, name, value)
    # The makers themselves would let these lap.
    monkeypatch.setattr(joined_object, "overlapping_ends", lambda *_: np.zeros(0, dtype=int))
    make_otherwise(monkeypatch, "dovetail", room_mm=lambda _: 3.0)
    write(tmp_path, joint="dovetail")
    assert words in objections(tmp_path)["joints"]


def test_a_tab_without_shoulders_is_found(monkeypatch, tmp_path):
    def bare(room, thickness):
        shape = interlock.tab_in_slot(room, thickness)
        # The tab alone is left, far back into the piece.
        back = shape.tongue - np.where(shape.tongue[:, :1] < 0, (room, 0.0), 0.0)
        return replace(shape, end_mm=-0.8 * room, tongue=back)

    make_otherwise(monkeypatch, "slot", shape=bare)
    write(tmp_path, joint="slot")
    assert "no shoulders" in objections(tmp_path)["joints"]
