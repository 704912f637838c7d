"""Spoil the plan and write every file from it: the checks that must object do, and no other."""

import numpy as np
import pytest
import shapely
from sealing import verify_job
from verify_specimen import make_specimen, octahedron, placed, torus
from verify_writers import write_job


def find(items, key):
    return next(item for item in items if item["id"] == key)


def plain_crossing(plan):
    """Return a crossing that is no joint."""
    joints = {joint["crossing"] for joint in plan["joints"]}
    return next(c for c in plan["crossings"] if c["id"] not in joints)


def stations_at(plan, key):
    return [s for p in plan["pieces"] for s in p["stations"] if s["crossing"] == key]


def inner_station(plan):
    """Return a piece and the place of a station between its ends."""
    piece = next(p for p in plan["pieces"] if len(p["stations"]) > 4)
    return piece, 2


# --- weave --------------------------------------------------------------------------------------


def turn_crossing_over(specimen):
    plan = specimen.plan
    crossing = plain_crossing(plan)
    crossing["over"], crossing["under"] = crossing["under"], crossing["over"]
    for thread in plan["threads"]:
        for k, key in enumerate(thread["crossings"]):
            if key == crossing["id"]:
                thread["over"][k] = not thread["over"][k]
    for station in stations_at(plan, crossing["id"]):
        station["over"] = not station["over"]


def turn_flags_of_one_thread(specimen):
    thread = specimen.plan["threads"][0]
    thread["over"][3] = not thread["over"][3]


def swap_strands_of_crossing(specimen):
    crossing = plain_crossing(specimen.plan)
    crossing["over"], crossing["under"] = crossing["under"], crossing["over"]


def name_another_thread(specimen):
    crossing = plain_crossing(specimen.plan)
    crossing["over"]["thread"] = (crossing["over"]["thread"] + 1) % len(specimen.plan["threads"])


def name_another_station(specimen):
    crossing = plain_crossing(specimen.plan)
    crossing["under"]["station"] += 1 if crossing["under"]["station"] == 0 else -1


def turn_one_station(specimen):
    piece, at = inner_station(specimen.plan)
    piece["stations"][at]["over"] = not piece["stations"][at]["over"]


def name_another_partner(specimen):
    piece, at = inner_station(specimen.plan)
    piece["stations"][at]["partner"] = piece["id"]


def name_the_piece_that_begins(specimen):
    joint = specimen.plan["joints"][0]
    crossing = find(specimen.plan["crossings"], joint["crossing"])
    crossing["under"] = {
        "thread": crossing["under"]["thread"], "piece": joint["pieces"][1], "station": 0,
    }  # fmt: skip


def claim_broken_edges(specimen):
    specimen.plan["weave"]["broken"]["edge"] = 1


def claim_inexact(specimen):
    specimen.plan["weave"]["exact"] = False


def claim_unknown_pattern(specimen):
    specimen.plan["weave"]["pattern"] = "houndstooth"


def claim_twill(specimen):
    specimen.plan["weave"]["pattern"] = "twill"


def claim_plain(specimen):
    specimen.plan["weave"]["pattern"] = "plain"


def exchange_crossings_of_thread(specimen):
    thread = specimen.plan["threads"][0]
    ids = thread["crossings"]
    ids[2], ids[4] = ids[4], ids[2]


def exchange_edges_of_crossings(specimen):
    first, second = specimen.plan["crossings"][0], specimen.plan["crossings"][9]
    first["edge"], second["edge"] = second["edge"], first["edge"]


def name_a_diagonal(specimen):
    specimen.plan["crossings"][0]["edge"] = [0, 7]


def open_a_thread(specimen):
    specimen.plan["threads"][0]["closed"] = False


def move_position(specimen):
    specimen.plan["crossings"][0]["position"][2] += 0.05


# --- pieces and joints --------------------------------------------------------------------------


def mirror_piece(specimen):
    """Mirror a piece with everything on it; it keeps its bounding box."""
    plan = specimen.plan
    upright = [p for p in plan["pieces"] if p["placement"]["rotation_deg"] in (0.0, 180.0)]
    piece = max(upright, key=lambda p: len(p["stations"]))
    height = max(y for _, y in piece["outline"])
    piece["outline"] = [[x, height - y] for x, y in piece["outline"][::-1]]
    for station in piece["stations"]:
        station["y"] = height - station["y"]
    for joint in plan["joints"]:
        for side in (0, 1):
            if joint["pieces"][side] == piece["id"]:
                for both in joint["holes"]:
                    both[side][1] = height - both[side][1]
    specimen.engraving[piece["id"]] = [
        (layer, [[x, height - y] for x, y in points], closed)
        for layer, points, closed in specimen.engraving[piece["id"]]
    ]


def move_hole(specimen):
    piece, at = inner_station(specimen.plan)
    piece["stations"][at]["y"] += 0.05


def move_hole_at_joint(specimen):
    joint = specimen.plan["joints"][0]
    find(specimen.plan["pieces"], joint["pieces"][1])["stations"][0]["x"] += 0.05


def move_hole_of_tab(specimen):
    specimen.plan["joints"][0]["holes"][1][1][0] += 0.05


def move_listed_hole_of_joint(specimen):
    # The first listed hole is the station's own; the drawing has it right.
    specimen.plan["joints"][0]["holes"][0][0][1] += 0.05


def exchange_holes_of_tab(specimen):
    holes = specimen.plan["joints"][0]["holes"]
    holes[1][1], holes[2][1] = holes[2][1], holes[1][1]


def widen_hole_of_one_layer(specimen):
    stations_at(specimen.plan, plain_crossing(specimen.plan)["id"])[0]["hole_mm"] = 2.5


def fill_hole_of_one_layer(specimen):
    stations_at(specimen.plan, plain_crossing(specimen.plan)["id"])[1]["hole_mm"] = None


def fill_hole_of_one_tab(specimen):
    joint = specimen.plan["joints"][0]
    find(specimen.plan["pieces"], joint["pieces"][1])["stations"][0]["hole_mm"] = None
    joint["holes"] = []


def make_hole_of_no_size(specimen):
    for station in stations_at(specimen.plan, plain_crossing(specimen.plan)["id"]):
        station["hole_mm"] = -2.0


def make_holes_too_wide(specimen):
    for station in stations_at(specimen.plan, plain_crossing(specimen.plan)["id"]):
        station["hole_mm"] = 40.0


def bring_holes_together(specimen):
    # All holes of a tab on one another, in both pieces alike.
    joint = specimen.plan["joints"][0]
    for both in joint["holes"][1:]:
        for side in (0, 1):
            centre = joint["holes"][0][side]
            both[side] = [centre[k] + 0.2 * (both[side][k] - centre[k]) for k in (0, 1)]


def move_outline_vertex(specimen):
    outline = specimen.plan["pieces"][0]["outline"]
    outline[2][1] += 0.25


def leave_out_corner(specimen):
    del specimen.plan["pieces"][0]["outline"][3]


def add_tiny_side(specimen):
    outline = specimen.plan["pieces"][0]["outline"]
    (x, y), (u, v) = outline[0], outline[1]
    step = 0.05 / np.hypot(u - x, v - y)
    outline.insert(1, [x + step * (u - x), y + step * (v - y)])


def run_outline_clockwise(specimen):
    specimen.plan["pieces"][0]["outline"].reverse()


def knot_outline(specimen):
    outline = specimen.plan["pieces"][0]["outline"]
    outline[0], outline[-1] = outline[-1], outline[0]


def exchange_vertices(specimen):
    # Every vertex is still a rail's, but the sides between them are not.
    outline = specimen.plan["pieces"][0]["outline"]
    outline[2], outline[3] = outline[3], outline[2]


def drop_station(specimen):
    piece, at = inner_station(specimen.plan)
    del piece["stations"][at]
    for crossing in specimen.plan["crossings"]:
        for strand in (crossing["over"], crossing["under"]):
            if strand["piece"] == piece["id"] and strand["station"] > at:
                strand["station"] -= 1


def repeat_station(specimen):
    piece, at = inner_station(specimen.plan)
    piece["stations"].insert(at, dict(piece["stations"][at]))


def exchange_pieces_of_thread(specimen):
    names = specimen.plan["threads"][0]["pieces"]
    names[0], names[1] = names[1], names[0]


def list_piece_twice(specimen):
    first, second = specimen.plan["threads"][:2]
    second["pieces"].append(first["pieces"][0])


def give_piece_to_other_thread(specimen):
    # The ids stay what they were: only the owner is wrong.
    specimen.plan["pieces"][0]["thread"] = 1


def forget_joint_of_piece(specimen):
    specimen.plan["pieces"][0]["joints"][1] = None


def forget_joint_of_station(specimen):
    specimen.plan["pieces"][0]["stations"][-1]["joint"] = None


def carry_joint_in_the_middle(specimen):
    piece, at = inner_station(specimen.plan)
    piece["stations"][at]["joint"] = specimen.plan["joints"][0]["id"]


def move_joint_to_other_crossing(specimen):
    joint = specimen.plan["joints"][0]
    piece = find(specimen.plan["pieces"], joint["pieces"][0])
    joint["crossing"] = piece["stations"][-2]["crossing"]


def add_idle_joint(specimen):
    joint = specimen.plan["joints"][0]
    specimen.plan["joints"].append({**joint, "id": 99})


# --- sheets -------------------------------------------------------------------------------------


def neighbours(plan, sheet=1):
    pieces = [p for p in plan["pieces"] if p["sheet"] == sheet]
    shapes = [shapely.Polygon(placed(p, p["outline"])) for p in pieces]
    pairs = [(shapes[a].distance(shapes[b]), a, b) for a in range(len(pieces)) for b in range(a)]
    _, a, b = min(pairs)
    one, two = shapely.shortest_line(shapes[a], shapes[b]).coords
    return pieces[a], np.subtract(two, one)


def move_towards_neighbour(specimen):
    # The nearest two are 3 mm apart, the gap.
    piece, way = neighbours(specimen.plan)
    shift = 0.2 * way / np.hypot(*way)
    piece["placement"]["x_mm"] += shift[0]
    piece["placement"]["y_mm"] += shift[1]


def move_onto_neighbour(specimen):
    piece, way = neighbours(specimen.plan)
    shift = (1.0 + 2.0 / np.hypot(*way)) * way
    piece["placement"]["x_mm"] += shift[0]
    piece["placement"]["y_mm"] += shift[1]


def move_into_margin(specimen):
    specimen.plan["pieces"][0]["placement"]["x_mm"] -= 0.2


def move_beyond_the_top(specimen):
    piece = specimen.plan["pieces"][-1]
    top = max(y for _, y in placed(piece, piece["outline"]))
    piece["placement"]["y_mm"] += 400.0 - top + 50.0


SPOILS = [
    # weave
    ("torus", turn_crossing_over, "pattern space steps"),
    ("torus", turn_flags_of_one_thread, "over-under pattern space piece-order"),
    ("torus", swap_strands_of_crossing, "over-under steps"),
    ("torus", name_another_thread, "over-under"),
    ("torus", name_another_station, "over-under"),
    ("torus", turn_one_station, "over-under piece-order steps"),
    ("torus", name_another_partner, "over-under"),
    ("torus", name_the_piece_that_begins, "over-under"),
    ("torus", claim_broken_edges, "pattern"),
    ("torus", claim_inexact, "pattern"),
    ("torus", claim_unknown_pattern, "pattern"),
    ("torus", claim_twill, "pattern"),
    ("twill", claim_plain, "pattern"),
    ("twill", claim_broken_edges, "pattern"),
    ("twill", claim_inexact, "pattern"),
    ("twill", turn_crossing_over, "pattern space steps"),
    (
        "torus",
        exchange_crossings_of_thread,
        "mesh-walks pattern space piece-order joints unfolding",
    ),
    ("torus", exchange_edges_of_crossings, "mesh-walks pattern space"),
    ("torus", name_a_diagonal, "mesh-walks pattern space"),
    ("torus", open_a_thread, "files mesh-walks pattern space piece-order joints unfolding"),
    ("torus", move_position, "space"),
    # pieces and joints
    ("torus", mirror_piece, "unfolding joints"),
    ("saddle", mirror_piece, "unfolding joints"),
    ("torus", move_hole, "unfolding"),
    ("torus", move_hole_at_joint, "unfolding joints"),
    ("torus", move_hole_of_tab, "joints"),
    ("torus", move_listed_hole_of_joint, "joints"),
    ("torus", exchange_holes_of_tab, "joints"),
    ("torus", widen_hole_of_one_layer, "crossing-holes"),
    ("torus", fill_hole_of_one_layer, "crossing-holes"),
    ("octahedron", fill_hole_of_one_tab, "crossing-holes"),
    ("octahedron", make_hole_of_no_size, "crossing-holes"),
    ("torus", make_holes_too_wide, "simple order"),
    ("torus", bring_holes_together, "simple"),
    ("torus", move_outline_vertex, "unfolding"),
    ("torus", leave_out_corner, "unfolding"),
    ("torus", add_tiny_side, "simple lines"),
    ("torus", run_outline_clockwise, "simple"),
    ("torus", knot_outline, "simple unfolding order"),
    ("torus", exchange_vertices, "unfolding"),
    ("torus", drop_station, "over-under piece-order unfolding joints steps"),
    (
        "torus",
        repeat_station,
        "simple outlines-dxf outlines-svg over-under piece-order unfolding joints",
    ),
    ("torus", exchange_pieces_of_thread, "piece-order steps"),
    ("torus", list_piece_twice, "piece-order steps"),
    ("torus", give_piece_to_other_thread, "over-under piece-order unfolding joints"),
    ("octahedron", forget_joint_of_piece, "piece-order"),
    ("torus", forget_joint_of_station, "piece-order"),
    ("torus", carry_joint_in_the_middle, "piece-order"),
    ("torus", move_joint_to_other_crossing, "piece-order"),
    ("octahedron", add_idle_joint, "piece-order"),
    # sheets
    ("saddle", move_towards_neighbour, "sheets"),
    ("saddle", move_onto_neighbour, "sheets"),
    ("saddle", move_into_margin, "sheets"),
    ("saddle", move_beyond_the_top, "sheets outlines-dxf"),
]


@pytest.mark.parametrize(
    ("name", "spoil", "objecting"),
    [
        # The torus has many pieces, so that each proof takes ten times as long.
        pytest.param(
            *row, marks=[pytest.mark.slow] * (row[0] == "torus"), id=f"{row[0]}-{row[1].__name__}"
        )
        for row in SPOILS
    ],
)
def test_exactly_the_right_checks_object(specimen, tmp_path, name, spoil, objecting):
    spoiled = specimen(name)
    spoil(spoiled)
    report = verify_job(write_job(spoiled, tmp_path))
    told = {check.name: check.findings for check in report.checks if not check.ok}
    torn = any("number of rungs" in text for text in told.get("files", ()))
    beside = {"files"} if torn else set()
    assert set(told) - beside == set(objecting.split()), told
    assert not report.ok
    assert all(told.values())


def test_joints_on_top_are_found(tmp_path):
    spoiled = make_specimen(torus(6, 4), on_top=True)
    report = verify_job(write_job(spoiled, tmp_path))
    assert report.failed == ("piece-order",)
    found = {check.name: check for check in report.checks}["piece-order"]
    assert found.found == len(spoiled.plan["joints"])


def test_findings_name_ids_and_numbers(specimen, tmp_path):
    spoiled = specimen("torus")
    move_hole(spoiled)
    piece, _ = inner_station(spoiled.plan)
    report = verify_job(write_job(spoiled, tmp_path))
    (check,) = [check for check in report.checks if not check.ok]
    assert f"piece {piece['id']}" in check.findings[0]
    assert check.worst == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize("shift", [0.004, -0.004])
def test_tolerances_are_tolerances(specimen, tmp_path, shift):
    spoiled = specimen("torus")
    spoiled.plan["joints"][0]["holes"][1][1][0] += shift
    assert verify_job(write_job(spoiled, tmp_path)).failed == ()


def test_two_weaves_of_one_sense_each_are_not_plain_together(tmp_path):
    """Each component alternates; only the helical senses differ."""
    one = make_specimen(octahedron())
    from verify_specimen import Corners  # noqa: PLC0415 - only here

    points = np.concatenate([one.points, one.points + np.array([200.0, 0.0, 0.0])])
    faces = [*one.faces, *[tuple(v + 6 for v in face) for face in one.faces]]
    edges = {Corners(faces).edge(h) for h in Corners(faces).all}
    same = make_specimen((points, faces))
    assert verify_job(write_job(same, tmp_path / "same")).failed == ()
    sense = {edge: edge[0] < 6 for edge in edges}
    mixed = make_specimen((points, faces), sense=sense)
    spoiled = set(verify_job(write_job(mixed, tmp_path / "mixed")).failed)
    assert spoiled == {"pattern"}
