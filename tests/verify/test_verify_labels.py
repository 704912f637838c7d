"""Spoil labels: the check objects to every untruth, and to whatever cannot be read."""

import json
import math

import pytest
import shapely
from sealing import verify_job
from verify_specimen import SHEET, lettered, make_specimen, octahedron, torus
from verify_writers import write_job, write_sheets


def labels(specimen, kind, *, begins=""):
    """Return the labels of a kind with their pieces."""
    return [
        (piece, one)
        for piece in specimen.plan["pieces"]
        for one in piece["labels"]
        if one["kind"] == kind and one["text"].startswith(begins)
    ]


def letter_again(specimen):
    """Engrave what the map says."""
    for piece in specimen.plan["pieces"]:
        own = specimen.engraving[piece["id"]]
        own[:] = [shape for shape in own if shape[0] != "ENGRAVE_LABEL"]
        for one in piece["labels"]:
            own.extend(("ENGRAVE_LABEL", run, False) for run in lettered(one))


def findings(specimen, folder, settings=""):
    write_job(specimen, folder)
    if settings:
        text = (folder / "job.toml").read_text()
        (folder / "job.toml").write_text(f"{text}\n[job]\n{settings}\n")
    report = verify_job(folder)
    assert set(report.failed) <= {"labels"}, report.failed
    return next(check for check in report.checks if check.name == "labels").findings


# --- what the map says, engraved as it says -----------------------------------------------------


def name_another_piece(specimen):
    labels(specimen, "id")[0][1]["text"] = "B1→"
    return "none of what it should tell"


def name_another_partner(specimen):
    _, one = labels(specimen, "partner", begins="●")[0]
    one["text"] = "●" + ("C1" if one["text"] != "●C1" else "B1")
    return "none of what it should tell"


def turn_a_sign(specimen):
    _, one = labels(specimen, "partner", begins="●")[0]
    one["text"] = "○" + one["text"][1:]
    return "none of what it should tell"


def number_another_joint(specimen):
    piece, one = labels(specimen, "joint")[0]
    one["text"] = "#5" if piece["joints"] != [5, 5] else "#4"
    return "none of what it should tell"


def name_another_mate(specimen):
    _, one = next(pair for pair in labels(specimen, "joint") if ">" in pair[1]["text"])
    one["text"] = one["text"][:-2] + "D4"
    return "none of what it should tell"


def drop_in_silence(specimen):
    specimen.plan["pieces"][0]["dropped"].pop()
    return "lettered or dropped, is 0, but should be 1"


def drop_what_is_lettered(specimen):
    piece, _ = labels(specimen, "id")[0]
    piece["dropped"].append({"kind": "id", "text": piece["id"], "station": None})
    return "lettered or dropped, is 2, but should be 1"


def letter_twice(specimen):
    piece, one = labels(specimen, "joint")[0]
    panel = next(k for k, s in enumerate(piece["stations"]) if k % 3 == 2)
    again = dict(one, x=piece["stations"][panel]["x"], y=piece["stations"][panel]["y"] + 4)
    piece["labels"].append(again)
    return "lettered or dropped, is 2, but should be 1"


def leave_out_a_label(specimen):
    piece, one = labels(specimen, "partner")[0]
    piece["labels"].remove(one)
    return "lettered or dropped, is 0, but should be 1"


def exchange_stations(specimen):
    piece, one = labels(specimen, "partner", begins="●")[0]
    other = next(p for p in piece["labels"] if p["kind"] == "partner" and p is not one)
    for key in ("x", "y", "rotation_deg"):
        one[key], other[key] = other[key], one[key]
    return "stands nearer to station"


def letter_too_low(specimen):
    _, one = labels(specimen, "id")[0]
    one["height_mm"], one["box_mm"][1] = 1.0, one["box_mm"][1] * 0.5
    return "1.0000 mm high"


def take_off_a_sign(specimen):
    piece, one = labels(specimen, "partner", begins="●")[0]
    one["text"], one["box_mm"][0] = one["text"][1:], one["box_mm"][0] - 1.5
    piece["dropped"].append({"kind": "sign", "text": "●", "station": one["station"]})
    return "none of what it should tell"


def move_onto_hole(specimen):
    piece, one = labels(specimen, "partner")[0]
    station = piece["stations"][one["station"]]
    one["x"], one["y"] = station["x"], station["y"]
    return "mm from an edge, a hole or a mark"


def move_to_edge(specimen):
    piece, one = labels(specimen, "partner")[0]
    station = piece["stations"][one["station"]]
    edge = shapely.LinearRing(piece["outline"])
    step = [0.01 * (one[key] - station[key]) for key in ("x", "y")]
    while shapely.MultiLineString(lettered(one)).distance(edge) > 0.15:
        one["x"], one["y"] = one["x"] + step[0], one["y"] + step[1]
    return "mm from an edge, a hole or a mark"


def move_onto_label(specimen):
    piece, one = labels(specimen, "id")[0]
    at = next(k for k, s in enumerate(piece["stations"]) if s["joint"] is None)
    other = next(p for p in piece["labels"] if p["kind"] == "partner" and p["station"] == at)
    one["x"], one["y"] = other["x"], other["y"] + 0.3
    return "less than 0.2 mm apart"


TOLD = [
    name_another_piece, name_another_partner, turn_a_sign, number_another_joint, name_another_mate,
    drop_in_silence, drop_what_is_lettered, letter_twice, leave_out_a_label, exchange_stations,
    letter_too_low, take_off_a_sign, move_onto_hole, move_to_edge, move_onto_label,
]  # fmt: skip


@pytest.mark.parametrize("spoil", TOLD)
def test_a_label_that_misleads_is_found(specimen, tmp_path, spoil):
    spoiled = specimen("octahedron")
    words = spoil(spoiled)
    letter_again(spoiled)
    found = findings(spoiled, tmp_path)
    assert any(words in finding for finding in found), found


# --- what is engraved is not what the map says ----------------------------------------------------


def strokes(specimen, piece):
    return [k for k, s in enumerate(specimen.engraving[piece["id"]]) if s[0] == "ENGRAVE_LABEL"]


def replace_strokes(specimen, one, piece, runs):
    """Engrave other strokes in place of a label's."""
    own = specimen.engraving[piece["id"]]
    old = lettered(one)
    own[:] = [shape for shape in own if shape[1] not in old]
    own.extend(("ENGRAVE_LABEL", run, False) for run in runs)


def engrave_another_id(specimen):
    piece, one = labels(specimen, "id")[0]
    replace_strokes(specimen, one, piece, lettered(dict(one, text="B1→")))
    return "looks unlike another"


def engrave_another_sign(specimen):
    piece, one = labels(specimen, "partner", begins="○")[0]
    replace_strokes(specimen, one, piece, lettered(dict(one, text="●" + one["text"][1:])))
    return "looks unlike another"


def engrave_mirrored(specimen):
    piece, one = labels(specimen, "id")[0]
    flat = lettered(dict(one, x=0.0, y=0.0, rotation_deg=0.0))
    turned = dict(one, rotation_deg=one["rotation_deg"] + 180.0)
    assert len(flat) == len(lettered(turned))
    replace_strokes(specimen, one, piece, lettered(turned))
    return "looks unlike another"


def engrave_lower(specimen):
    piece, one = labels(specimen, "id")[0]
    box = [one["box_mm"][0], one["box_mm"][1] * 0.9]
    replace_strokes(specimen, one, piece, lettered(dict(one, height_mm=1.8, box_mm=box)))
    return "does not fill its box"


def engrave_beside(specimen):
    piece, one = labels(specimen, "id")[0]
    replace_strokes(specimen, one, piece, lettered(dict(one, x=one["x"] + 0.5)))
    return "is in no label"


def engrave_nothing(specimen):
    piece, one = labels(specimen, "id")[0]
    replace_strokes(specimen, one, piece, [])
    return "is not engraved"


def engrave_what_is_not_told(specimen):
    piece, one = labels(specimen, "id")[0]
    extra = lettered(dict(one, y=one["y"] + 3.0))
    specimen.engraving[piece["id"]].extend(("ENGRAVE_LABEL", run, False) for run in extra)
    return "is in no label"


def forget_a_letter(specimen):
    piece, one = labels(specimen, "joint")[0]
    runs = lettered(one)
    replace_strokes(specimen, one, piece, [runs[0], *runs[2:]])
    return "letters that stand apart"


def look_alike(specimen):
    # Every B is engraved as A: nobody can tell A1 from B1.
    for piece in specimen.plan["pieces"]:
        own = specimen.engraving[piece["id"]]
        own[:] = [shape for shape in own if shape[0] != "ENGRAVE_LABEL"]
        for one in piece["labels"]:
            seen = dict(one, text=one["text"].replace("B", "A"))
            own.extend(("ENGRAVE_LABEL", run, False) for run in lettered(seen))
    return "'A' and 'B' look alike"


ENGRAVED = [
    engrave_another_id, engrave_another_sign, engrave_mirrored, engrave_lower, engrave_beside,
    engrave_nothing, engrave_what_is_not_told, forget_a_letter, look_alike,
]  # fmt: skip


@pytest.mark.parametrize("spoil", ENGRAVED)
def test_engraving_that_is_not_as_told_is_found(specimen, tmp_path, spoil):
    spoiled = specimen("octahedron")
    words = spoil(spoiled)
    found = findings(spoiled, tmp_path)
    assert any(words in finding for finding in found), found


# --- settings -----------------------------------------------------------------------------------


def mirrored(specimen, *, letters=True):
    """Draw every sheet from the other side; letters are lettered to be read there."""
    plan = specimen.plan
    for piece in plan["pieces"]:
        own = specimen.engraving[piece["id"]]
        own[:] = [shape for shape in own if shape[0] != "ENGRAVE_LABEL"]
        for one in piece["labels"]:
            runs = lettered(dict(one, x=0.0, y=0.0, rotation_deg=0.0))
            flipped = [[[x, -y] for x, y in run] for run in runs] if letters else runs
            turn = complex(*lettered_turn(one))
            for run in flipped:
                placed = [turn * complex(x, y) + complex(one["x"], one["y"]) for x, y in run]
                own.append(("ENGRAVE_LABEL", [[z.real, z.imag] for z in placed], False))
    for sheet in plan["sheets"]:
        sheet["mirrored"] = True


def lettered_turn(one):
    angle = math.radians(one["rotation_deg"])
    return math.cos(angle), math.sin(angle)


def flip(shapes):
    """Mirror the shapes of a sheet in its width, notes too."""

    def over(points):
        return [[SHEET[0] - x, y] for x, y in points]

    return [
        (
            piece,
            layer,
            kind,
            (SHEET[0] - data[0], *data[1:]) if kind == "circle" else over(data),
            closed,
        )
        for piece, layer, kind, data, closed in shapes
    ]


@pytest.mark.parametrize("letters", [True, False])
def test_mirrored_sheets_are_proved_if_their_letters_are_not(tmp_path, letters):
    specimen = make_specimen(torus(6, 4))
    mirrored(specimen, letters=letters)
    write_job(specimen, tmp_path)
    write_sheets(specimen, tmp_path, edit=lambda _sheet, shapes: flip(shapes))
    settings = (tmp_path / "job.toml").read_text() + '\n[job]\nlabel_side = "inside"\n'
    (tmp_path / "job.toml").write_text(settings)
    # Its flaws stand where the pieces stood before.
    flaws = {"schema": "fabweave.preflight/1", "units": "mm", "target": "default", "flaws": []}
    (tmp_path / "preflight.json").write_text(json.dumps(flaws))
    report = verify_job(tmp_path)
    assert report.failed == (() if letters else ("labels",))
    if not letters:
        found = next(check for check in report.checks if check.name == "labels").findings
        assert any("stands on its head" in finding for finding in found), found


def test_sheets_lie_as_the_settings_say(specimen, tmp_path):
    found = findings(specimen("octahedron"), tmp_path, 'label_side = "inside"')
    assert found == (
        "sheet_01: whether it is mirrored, with labels inside, is False, but should be True",
    )


@pytest.mark.parametrize("wanted", ["numbers", "none"])
def test_less_is_engraved_where_less_is_wanted(specimen, tmp_path, wanted):
    full = specimen("octahedron")
    found = findings(full, tmp_path / "full", f'labels = "{wanted}"')
    assert any("lettered or dropped, is 1, but should be 0" in finding for finding in found)
    for piece in full.plan["pieces"]:
        kept = [one for one in piece["labels"] if one["kind"] == "id" and wanted == "numbers"]
        for one in kept:
            one["text"] = piece["id"]
            one["box_mm"][0] = 1.5 * len(one["text"]) - 0.5
        piece["labels"] = kept
        piece["dropped"] = []
    letter_again(full)
    assert findings(full, tmp_path / wanted, f'labels = "{wanted}"') == ()


def test_the_specimen_has_every_kind_of_label():
    plan = make_specimen(octahedron(), joints=2).plan
    kinds = {one["kind"] for piece in plan["pieces"] for one in piece["labels"]}
    assert kinds == {"id", "joint", "partner"}
    texts = "".join(one["text"] for piece in plan["pieces"] for one in piece["labels"])
    assert set("→●○#>") <= set(texts)


def test_labels_on_a_side_that_pieces_do_not_have(specimen, tmp_path):
    found = findings(specimen("octahedron"), tmp_path, 'label_side = "beside"')
    assert any("which is no side of a piece" in finding for finding in found)
