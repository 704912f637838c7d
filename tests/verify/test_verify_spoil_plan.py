"""Spoil the plan and write every file from it: the checks that must object do, and no other."""

import numpy as np
import pytest
import shapely
from sealing import told, verify_job
from spoiling import drop, exchange, flip, more, put
from verify_specimen import Corners, make_specimen, octahedron, placed
from verify_writers import completed, write_job


def find(items, key):
    return next(item for item in items if item["id"] == key)


def plain_crossing(plan):
    """Return a crossing that is no joint."""
    joints = {joint["crossing"] for joint in plan["joints"]}
    return next(c for c in plan["crossings"] if c["id"] not in joints)


def layers(plan):
    """Return the stations of both strands at such a crossing."""
    key = plain_crossing(plan)["id"]
    return [s for p in plan["pieces"] for s in p["stations"] if s["crossing"] == key]


def inner_piece(plan):
    """Return a piece with stations between its ends."""
    return next(p for p in plan["pieces"] if len(p["stations"]) > 4)


def inner_station(plan):
    return inner_piece(plan)["stations"][2]


def beginning(plan):
    """Return the first station of the piece that begins at the first joint."""
    return find(plan["pieces"], plan["joints"][0]["pieces"][1])["stations"][0]


# --- weave --------------------------------------------------------------------------------------


def turn_crossing_over(plan):
    crossing = plain_crossing(plan)
    crossing["over"], crossing["under"] = crossing["under"], crossing["over"]
    for thread in plan["threads"]:
        for k, key in enumerate(thread["crossings"]):
            if key == crossing["id"]:
                thread["over"][k] = not thread["over"][k]
    for station in layers(plan):
        station["over"] = not station["over"]


def name_another_partner(plan):
    inner_station(plan)["partner"] = inner_piece(plan)["id"]


def name_the_piece_that_begins(plan):
    joint = plan["joints"][0]
    crossing = find(plan["crossings"], joint["crossing"])
    crossing["under"] |= {"piece": joint["pieces"][1], "station": 0}


def exchange_edges_of_crossings(plan):
    first, second = plan["crossings"][0], plan["crossings"][9]
    first["edge"], second["edge"] = second["edge"], first["edge"]


# --- pieces and joints --------------------------------------------------------------------------


def mirror_piece(plan, engraving):
    """Mirror a piece with everything on it; it keeps its bounding box."""
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
    engraving[piece["id"]] = [
        (layer, [[x, height - y] for x, y in points], closed)
        for layer, points, closed in engraving[piece["id"]]
    ]


def drill(diameter):
    """Return an edit that drills both strands of a crossing so."""

    def both(plan):
        for station in layers(plan):
            station["hole_mm"] = diameter

    return both


def fill_hole_of_one_tab(plan):
    beginning(plan)["hole_mm"] = None
    plan["joints"][0]["holes"] = []


def cut_a_hole_into_another(plan):
    holes = completed(plan)["pieces"][0]["cutouts"]
    holes.insert(1, {**holes[0], "x": holes[0]["x"] + 0.4})


def add_tiny_side(plan):
    outline = plan["pieces"][0]["outline"]
    (x, y), (u, v) = outline[0], outline[1]
    step = 0.05 / np.hypot(u - x, v - y)
    outline.insert(1, [x + step * (u - x), y + step * (v - y)])


def drop_station(plan):
    piece, at = inner_piece(plan), 2
    del piece["stations"][at]
    for crossing in plan["crossings"]:
        for strand in (crossing["over"], crossing["under"]):
            if strand["piece"] == piece["id"] and strand["station"] > at:
                strand["station"] -= 1


def repeat_station(plan):
    inner_piece(plan)["stations"].insert(2, dict(inner_station(plan)))


def move_joint_to_other_crossing(plan):
    joint = plan["joints"][0]
    joint["crossing"] = find(plan["pieces"], joint["pieces"][0])["stations"][-2]["crossing"]


# --- sheets -------------------------------------------------------------------------------------


def move_towards_neighbour(share, further_mm):
    """Return an edit that moves a piece by a share of the gap to its neighbour, and further."""

    def move(plan):
        pieces = [p for p in plan["pieces"] if p["sheet"] == 1]
        shapes = [shapely.Polygon(placed(p, p["outline"])) for p in pieces]
        pairs = [
            (shapes[a].distance(shapes[b]), a, b) for a in range(len(pieces)) for b in range(a)
        ]
        _, a, b = min(pairs)
        one, two = shapely.shortest_line(shapes[a], shapes[b]).coords
        way = np.subtract(two, one)
        shift = (share + further_mm / np.hypot(*way)) * way
        pieces[a]["placement"]["x_mm"] += shift[0]
        pieces[a]["placement"]["y_mm"] += shift[1]

    return move


def move_beyond_the_top(plan):
    piece = plan["pieces"][-1]
    top = max(y for _, y in placed(piece, piece["outline"]))
    piece["placement"]["y_mm"] += 400.0 - top + 50.0


OUTLINE = ("pieces", 0, "outline")
HOLES = ("joints", 0, "holes")
SPOILS = [
    # weave
    ("torus", turn_crossing_over, "pattern space steps"),
    ("torus", put("threads", 0, "over", 3, flip), "over-under pattern space piece-order"),
    ("torus", exchange(plain_crossing, "over", "under"), "over-under steps"),
    ("torus", put(plain_crossing, "over", "thread", lambda t: int(t == 0)), "over-under"),
    ("torus", put(plain_crossing, "under", "station", lambda s: s - 1 if s else 1), "over-under"),
    ("torus", put(inner_station, "over", flip), "over-under piece-order steps"),
    ("torus", name_another_partner, "over-under"),
    ("torus", name_the_piece_that_begins, "over-under"),
    ("torus", put("weave", "broken", "edge", 1), "pattern"),
    ("torus", put("weave", "exact", False), "pattern"),
    ("torus", put("weave", "pattern", "houndstooth"), "pattern"),
    ("torus", put("weave", "pattern", "twill"), "pattern"),
    ("twill", put("weave", "pattern", "plain"), "pattern"),
    ("twill", put("weave", "broken", "edge", 1), "pattern"),
    ("twill", put("weave", "exact", False), "pattern"),
    ("twill", turn_crossing_over, "pattern space steps"),
    ("torus", exchange("threads", 0, "crossings", 2, 4),
     "mesh-walks pattern space piece-order joints unfolding"),
    ("torus", exchange_edges_of_crossings, "mesh-walks pattern space"),
    ("torus", put("crossings", 0, "edge", [0, 7]), "mesh-walks pattern space"),
    ("torus", put("threads", 0, "closed", False),
     "files mesh-walks pattern space piece-order joints unfolding"),
    ("torus", put("crossings", 0, "position", 2, more(0.05)), "space"),
    # pieces and joints
    ("torus", mirror_piece, "unfolding joints"),
    ("saddle", mirror_piece, "unfolding joints"),
    ("torus", put(inner_station, "y", more(0.05)), "unfolding joints"),
    ("torus", put(beginning, "x", more(0.05)), "unfolding joints"),
    ("torus", put(*HOLES, 0, 0, 1, more(0.05)), "joints"),
    ("torus", put(layers, 0, "hole_mm", 2.5), "crossing-holes"),
    ("torus", put(layers, 1, "hole_mm", None), "crossing-holes"),
    ("octahedron", fill_hole_of_one_tab, "crossing-holes"),
    ("octahedron", drill(-2.0), "crossing-holes"),
    ("torus", drill(40.0), "simple order labels"),
    ("torus", cut_a_hole_into_another, "simple crossing-holes joints"),
    ("torus", put(*OUTLINE, 2, 1, more(0.25)), "unfolding"),
    ("torus", drop(*OUTLINE, 3), "unfolding"),
    ("torus", add_tiny_side, "simple lines"),
    ("torus", put(*OUTLINE, lambda outline: outline[::-1]), "simple"),
    # Knotted.
    ("torus", exchange(*OUTLINE, 0, -1), "simple unfolding order labels"),
    # Every vertex is still a rail's, but the sides between them are not.
    ("torus", exchange(*OUTLINE, 2, 3), "unfolding"),
    ("torus", drop_station, "over-under piece-order unfolding joints steps"),
    ("torus", repeat_station,
     "simple outlines-dxf outlines-svg over-under piece-order unfolding joints"),
    ("torus", exchange("threads", 0, "pieces", 0, 1), "piece-order"),
    ("torus", put("threads", 1, "pieces", lambda names: [*names, "A1"]), "piece-order"),
    # The ids stay what they were: only the owner is wrong.
    ("torus", put("pieces", 0, "thread", 1), "over-under piece-order unfolding joints"),
    ("octahedron", put("pieces", 0, "joints", 1, None), "piece-order"),
    ("torus", put("pieces", 0, "stations", -1, "joint", None), "piece-order"),
    ("torus", put(inner_station, "joint", 1), "piece-order"),
    ("torus", move_joint_to_other_crossing, "piece-order"),
    ("octahedron", put("joints", lambda joints: [*joints, {**joints[0], "id": 99}]),
     "piece-order"),
    # sheets: the nearest two are 3 mm apart, the gap
    ("saddle", move_towards_neighbour(0.0, 0.2), "sheets"),
    ("saddle", move_towards_neighbour(1.0, 2.0), "sheets"),
    ("saddle", put("pieces", 0, "placement", "x_mm", more(-0.2)), "sheets"),
    ("saddle", move_beyond_the_top, "sheets"),
]  # fmt: skip


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
    spoil(spoiled.plan, *[spoiled.engraving] * (spoil is mirror_piece))
    found = told(write_job(spoiled, tmp_path))
    torn = any("number of rungs" in text for text in found.get("files", ()))
    beside = {"files"} if torn else set()
    assert set(found) - beside == set(objecting.split()), found
    assert found
    assert all(found.values())


def test_findings_name_ids_and_numbers(specimen, tmp_path):
    spoiled = specimen("torus")
    inner_station(spoiled.plan)["y"] += 0.05
    report = verify_job(write_job(spoiled, tmp_path))
    check = next(check for check in report.checks if check.name == "unfolding")
    assert f"piece {inner_piece(spoiled.plan)['id']}" in check.findings[0]
    assert check.worst == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize("shift", [0.004, -0.004])
def test_tolerances_are_tolerances(specimen, tmp_path, shift):
    spoiled = specimen("torus")
    spoiled.plan["joints"][0]["holes"][0][1][0] += shift
    assert verify_job(write_job(spoiled, tmp_path)).failed == ()


def test_two_weaves_of_one_sense_each_are_not_plain_together(tmp_path):
    """Each component alternates; only the helical senses differ."""
    one = make_specimen(octahedron())
    points = np.concatenate([one.points, one.points + np.array([200.0, 0.0, 0.0])])
    faces = [*one.faces, *[tuple(v + 6 for v in face) for face in one.faces]]
    edges = {Corners(faces).edge(h) for h in Corners(faces).all}
    same = make_specimen((points, faces))
    assert verify_job(write_job(same, tmp_path / "same")).failed == ()
    sense = {edge: edge[0] < 6 for edge in edges}
    mixed = make_specimen((points, faces), sense=sense)
    spoiled = set(verify_job(write_job(mixed, tmp_path / "mixed")).failed)
    assert spoiled == {"pattern"}
