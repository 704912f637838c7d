"""The manual says on paper what the crossing map says: every piece, sheet, step and station."""

import io
import re
import zlib
from functools import cache
from itertools import product

import numpy as np
import pypdf
import pytest
import shapely
from PIL import Image

from fabweave.app.job_records import job_facts, job_map
from fabweave.app.options.table import option_named
from fabweave.app.pipeline import make_job
from fabweave.app.settings import Settings
from fabweave.assembly.manual import book as manual_book
from fabweave.assembly.manual.piece_titles import place_across
from fabweave.assembly.manual.pixels import GREY_STEP
from fabweave.assembly.manual.steps import _Pictures, placing, strand_pieces, turn_words
from fabweave.assembly.manual.views import (
    PICTURE_PX,
    VIEWS,
    StepPicture,
    choose_views,
    step_pictures,
)
from fabweave.assembly.manual.writing import manual_pdf
from fabweave.flat.unfold.stretch import piece_stretches
from fabweave.picture.camera import View, frame_object
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.picture.zbuffer import all_fragments, nearest_triangles
from fabweave.report.bom import bill_of_materials


@cache
def job_of(mesh="shape:torus?m=8&n=4", **changed):
    return make_job(Settings(mesh, size_mm=300.0, effort="quick", **changed))


def facts_of(job):
    return job_facts(job, bill_of_materials(job.piece_set))


@cache
def parts_of(**changed):
    job = job_of(**changed)
    crossing_map = job_map(job)
    pieces = job.piece_set.pieces
    return crossing_map, step_pictures(job.woven.ribbons, job.weave, pieces, crossing_map)


@cache
def manual_of(paper="a4", **changed):
    job = job_of(**changed)
    crossing_map, pictures = parts_of(**changed)
    return manual_pdf(crossing_map, facts_of(job), job.drawings, pictures, paper=paper)


@cache
def pages_of(paper="a4", **changed):
    """Return what a stranger reads on each page, with single spaces."""
    reader = pypdf.PdfReader(io.BytesIO(manual_of(paper, **changed)))
    return [" ".join(page.extract_text().split()) for page in reader.pages]


def section(name, **changed):
    return " ".join(page for page in pages_of(**changed) if page.startswith(name))


def test_papers_are_those_of_the_settings():
    assert tuple(manual_book.PAPERS) == option_named("paper").kind.choices


@pytest.mark.parametrize(("paper", "size"), [("a4", (210.0, 297.0)), ("letter", (215.9, 279.4))])
def test_every_page_has_the_size_of_the_paper(paper, size):
    reader = pypdf.PdfReader(io.BytesIO(manual_of(paper)))
    for page in reader.pages:
        box = page.mediabox
        assert np.allclose(np.array([box.width, box.height], dtype=float) / 72 * 25.4, size, atol=1)


@pytest.mark.parametrize("paper", manual_book.PAPERS)
def test_nothing_stands_outside_the_margins(paper):
    reader = pypdf.PdfReader(io.BytesIO(manual_of(paper)))
    wide, high = manual_book.PAPERS[paper]
    for page in reader.pages:
        places = []

        def keep(text, turn, place, _, __, places=places):
            if text.strip():
                places.append(np.array([*place[4:], 1.0]) @ np.array(turn).reshape(3, 2))

        page.extract_text(visitor_text=keep)
        x, y = np.array(places).T
        assert len(x)
        assert x.min() > manual_book.MARGIN - 1.0
        assert x.max() < wide
        assert y.min() > manual_book.MARGIN - 9.0
        assert y.max() < high


def test_same_bytes():
    crossing_map, _ = parts_of()
    job = job_of()
    again = step_pictures(job.woven.ribbons, job.weave, job.piece_set.pieces, crossing_map)
    data = manual_pdf(crossing_map, facts_of(job), job.drawings, again)
    assert data == manual_of()


def test_every_piece_is_in_every_section_that_lists_pieces():
    crossing_map, _ = parts_of()
    ids = {piece.id for piece in crossing_map.pieces}
    for name in ("Threads and their pieces", "Parts list", "Sheets", "Steps", "Crossing tables"):
        words = set(re.findall(r"[A-Z]+\d+", section(name)))
        assert ids <= words, name
        assert words <= ids, name


def test_steps_are_said_and_in_order():
    crossing_map, _ = parts_of()
    text = section("Steps")
    heads = [int(number) for number in re.findall(r"Step (\d+)", text)]
    assert heads == [step.number for step in crossing_map.steps]
    for step in crossing_map.steps:
        assert step.text in text


def test_cover_has_the_figures():
    crossing_map, _ = parts_of()
    text = section("Overview")
    assert f"{len(crossing_map.pieces)} pieces on {len(crossing_map.sheets)} sheet" in text
    assert f"{len(crossing_map.joints)} joints" in text
    needed = [int(number) for number in re.findall(r"(\d+) needed", text)]
    # Each hole of an upper strand, and nothing else, has a fastener.
    holes = sum(
        cut.kind == "hole" and piece.stations[cut.station].over
        for piece in crossing_map.pieces
        for cut in piece.cutouts
    )
    assert sum(needed) == holes > 0


def test_stations_are_those_of_the_plan():
    crossing_map, _ = parts_of()
    text = section("Crossing tables")
    for piece in crossing_map.pieces:
        table = re.search(rf"Piece {piece.id} (.*?)(?= Piece [A-Z]+\d|$)", text)[1]
        for number, station in enumerate(piece.stations):
            lies = "over" if station.over else "under"
            row = rf"\b{number} {station.crossing} [\d.]+ {lies} {station.partner} "
            row += "- " if station.joint is None else rf"#{station.joint} "
            assert re.search(row, table), (piece.id, number)


@pytest.mark.slow
def test_inside_lettering_is_told():
    assert "This is the inside of the object" in section("How to read", label_side="inside")
    assert "This is the outside of the object" in section("How to read")


def test_only_pieces_in_place_are_named():
    crossing_map, _ = parts_of()
    parts = {piece.id: piece for piece in crossing_map.pieces}
    joints = {joint.id: joint for joint in crossing_map.joints}
    strands, there = strand_pieces(crossing_map), set()
    said = 0
    for step in crossing_map.steps:
        there.update(step.pieces)
        for key in step.pieces:
            line = placing(parts[key], step, joints, strands, there)
            assert set(re.findall(r"[A-Z]+\d+", line)) <= there
            said += len(re.findall(r" at \d+", line))
    assert said >= len(crossing_map.crossings)


def test_joined_with_says_both_ways():
    crossing_map, _ = parts_of()
    joints = {joint.id: joint for joint in crossing_map.joints}
    for step in crossing_map.steps:
        for key in step.joints:
            one, other = joints[key].pieces
            assert {one, other} & set(step.pieces)


# --- pictures -----------------------------------------------------------------------------------


def test_pieces_cover_the_ribbons():
    """Every stretch of ribbon is of one piece; where two lap, of both."""
    job = job_of(max_length_mm=250.0)
    ribbons, pieces = job.woven.ribbons, job.piece_set.pieces
    rung, piece = piece_stretches(ribbons, job.weave, pieces).quads()
    vertices, triangles, thread = ribbon_triangles(ribbons)
    first = set((triangles[::2, 0] // 2).tolist())
    assert set(rung.tolist()) == first
    threads = np.array([one.thread for one in pieces])
    own = dict(zip((triangles[::2, 0] // 2).tolist(), thread[::2].tolist(), strict=True))
    assert [own[at] for at in rung.tolist()] == threads[piece].tolist()
    for joint in job.piece_set.joints:
        one, other = (set(rung[piece == index].tolist()) for index in joint.pieces)
        shared = one & other
        assert shared
        middle = vertices[2 * np.array(sorted(shared))].mean(axis=0)
        centre = ribbons.centre[joint.crossing]
        wide = np.linalg.norm(ribbons.left - ribbons.right, axis=1).max()
        assert np.linalg.norm(middle - centre) < 1.5 * wide


def test_the_last_picture_shows_what_the_object_shows():
    """A step's picture is the nearest surface of what is there, as a plain z-buffer finds it."""
    _, pictures = parts_of()
    job = job_of()
    ribbons = job.woven.ribbons
    vertices, triangles, _ = ribbon_triangles(ribbons)
    size = pictures[-1].image.size
    frame = frame_object(vertices, pictures[-1].view, size)
    seen, _ = nearest_triangles(frame.pixels(vertices), triangles, width=size[0], height=size[1])
    shade = np.asarray(pictures[-1].image)
    there = seen >= 0
    near = shade < 90
    # White is seen on the object only in the thin line around the new pieces, and what is beside
    # it is white but for one pixel along its border.
    for _ in range(3):
        near = grown(near)
    assert not np.any(there & (shade >= 250) & ~near)
    assert not np.any(~grown(there) & (shade < 250) & ~near)
    assert np.count_nonzero(near) < 0.4 * near.size


def grown(area):
    """Return an area and the pixels around it."""
    for axis in (0, 1):
        area = area | np.roll(area, 1, axis) | np.roll(area, -1, axis)
    return area


def test_new_pieces_are_seen_and_dark():
    crossing_map, pictures = parts_of()
    assert len(pictures) == len(crossing_map.steps)
    for step, picture in zip(crossing_map.steps, pictures, strict=True):
        assert set(picture.pieces) == set(step.pieces)
        shade = np.asarray(picture.image)
        wide, high = picture.image.size
        for x, y in picture.pieces.values():
            around = shade[round(y * high) - 3 :, round(x * wide) - 3 :][:7, :7]
            assert around.min() < 90
        assert np.count_nonzero(shade < 90) > 400


def test_turns_are_told_when_the_view_changes():
    _, pictures = parts_of()
    views = [picture.view for picture in pictures]
    turned = [False, *(one != other for one, other in zip(views[1:], views[:-1], strict=True))]
    assert [picture.turned for picture in pictures] == turned
    assert sum(turned) < len(turned) / 2


def test_turn_words_name_each_view_differently():
    assert len({turn_words(view) for view in VIEWS}) == len(VIEWS)
    assert turn_words(View(0.0, 20.0)) == "Turn the object to see it from the right and above."
    assert turn_words(View(-90.0, -20.0)) == "Turn the object to see it from the front and below."


def brute_force(lost, turn):
    """Return the least cost of any sequence of views."""
    views, steps = lost.shape
    return min(
        sum(lost[view, at] for at, view in enumerate(way))
        + turn * sum(one != other for one, other in zip(way[1:], way[:-1], strict=True))
        for way in product(range(views), repeat=steps)
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_sequence_of_views_is_the_best_there_is(seed):
    seen = np.random.default_rng(seed).integers(1, 9, (3, 6)).astype(float)
    way = choose_views(seen, seen)
    lost = 1.0 - seen / seen.max(axis=0)
    cost = sum(lost[view, at] for at, view in enumerate(way)) + 0.4 * np.sum(np.diff(way) != 0)
    assert cost == pytest.approx(brute_force(lost, 0.4))


def test_a_view_that_hides_a_piece_is_left():
    least = np.array([[9.0, 0.0], [1.0, 1.0]])
    total = np.array([[9.0, 900.0], [1.0, 1.0]])
    assert choose_views(least, total).tolist() == [0, 1]


def test_fragments_hold_the_nearest():
    dice = np.random.default_rng(3)
    points, triangles = dice.uniform(0, 20, (30, 3)), dice.integers(0, 30, (40, 3))
    triangle, pixel, near = all_fragments(points, triangles, width=20, height=16)
    seen, nearness = nearest_triangles(points, triangles, width=20, height=16)
    best = np.full(320, -np.inf)
    np.maximum.at(best, pixel, near)
    assert np.allclose(best.reshape(16, 20), nearness)
    assert np.all(np.diff(triangle) >= 0)
    assert set(np.unique(seen[seen >= 0]).tolist()) <= set(triangle.tolist())


def test_a_picture_of_which_only_changes_are_kept_is_the_whole_picture():
    dice = np.random.default_rng(4)
    values = {view: np.full(PICTURE_PX[::-1], 255, dtype=np.uint8) for view in VIEWS[:2]}
    pictures = []
    for number in range(24):
        view = VIEWS[number // 3 % 2]
        x, y = dice.integers(0, 700), dice.integers(0, 540)
        values[view][y : y + 20, x : x + 20] = dice.integers(0, 256)
        pictures.append(StepPicture(zlib.compress(values[view].tobytes()), view, False, {}, {}))
    images, shown, stored = {}, [], 0

    class Paper:
        def image(self, picture, x, y, width, height):
            nonlocal stored
            name = picture
            if not isinstance(picture, str):
                name = f"picture{len(images)}"
                images[name] = np.asarray(picture)
                stored += picture.size[0] * picture.size[1]
            values = images[name]
            assert (width, height) == pytest.approx((values.shape[1] / 2, values.shape[0] / 2))
            left, low = round(2 * (x - 10.0)), round(2 * (y - 20.0))
            rows = slice(PICTURE_PX[1] - low - values.shape[0], PICTURE_PX[1] - low)
            shown[-1][rows, left : left + values.shape[1]] = values
            return name

    drawn = _Pictures(Paper())
    for picture in pictures:
        shown.append(np.zeros(PICTURE_PX[::-1], dtype=np.uint8))
        drawn.draw(picture, 10.0, 20.0, (PICTURE_PX[0] / 2, PICTURE_PX[1] / 2))
        assert np.array_equal(shown[-1], np.asarray(picture.image))
    assert stored < 0.6 * len(pictures) * PICTURE_PX[0] * PICTURE_PX[1]


def bent_strip(low, high):
    """Return a strip 1.5 points wide between two heights."""
    x = np.linspace(0.0, 120.0, 13)
    lower = np.column_stack((x, np.linspace(low, high, 13) + 2.0 * np.sin(x / 20.0)))
    return np.concatenate((lower, np.add(lower[::-1], (0.0, 1.5))))


def test_names_of_narrow_pieces_stand_on_them_and_clear_of_one_another():
    strips = {f"A{n}": bent_strip(3.0 * n, 3.0 * n + 5.0) for n in range(8)}
    places = place_across(strips)
    boxes = []
    for key, (x, y, angle) in places.items():
        assert shapely.Polygon(strips[key]).distance(shapely.Point(x, y)) < 0.3
        assert -90.0 < angle <= 90.0
        half = manual_book.text_width(key, manual_book.PLATE, bold=True) / 2
        box = shapely.affinity.rotate(shapely.box(x - half, y - 2.8, x + half, y + 2.8), angle)
        assert not any(box.intersects(other) for other in boxes)
        boxes.append(box)
    assert list(places) == list(strips)


def test_a_name_stands_along_its_piece():
    strip = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 60.0], [0.0, 60.0]])
    x, y, angle = place_across({"A1": strip})["A1"]
    assert (x, y) == pytest.approx((0.5, 30.0), abs=0.6)
    assert abs(angle) == pytest.approx(90.0, abs=2.0)


def test_each_sign_that_is_explained_is_pointed_out():
    text = section("How to read")
    explained = set(re.findall(r"(\d) (?:Id|Joint|Crossing|Cross|Hole)", text))
    head = re.split(r"page 2 / \d+", text)[1].split("Piece ")[0]
    assert set(head.split()) == explained == set("1235")


def test_pieces_that_are_alike_are_drawn_once():
    crossing_map, _ = parts_of()
    text = section("Parts list")
    kinds = [piece.kind for piece in crossing_map.pieces]
    assert len(set(kinds)) < len(kinds)
    for kind in set(kinds):
        count = kinds.count(kind)
        assert len(re.findall(rf"\bKind {kind}\b", text)) == (count > 1)
        if count > 1:
            assert len(re.findall(rf"\bKind {kind}\s+x {count}: ", text)) == 1
    for piece in crossing_map.pieces:
        assert len(re.findall(rf"\b{piece.id}\b", text)) == 1


# --- pages --------------------------------------------------------------------------------------


def test_pictures_are_grey_and_few_bytes():
    assert len(manual_of()) < 2_000_000
    for picture in parts_of()[1]:
        assert picture.image.mode == "L"
        assert not np.any(np.asarray(picture.image) % GREY_STEP)


@pytest.mark.parametrize("step", [1, GREY_STEP])
def test_pictures_are_kept_as_they_are(step):
    shades = np.arange(0, 256, step, dtype=np.uint8)
    grey = Image.fromarray(np.random.default_rng(2).choice(shades, (5, 7)))
    colours = Image.fromarray(np.random.default_rng(3).integers(0, 256, (4, 3, 3), dtype=np.uint8))
    book = manual_book.Book("a4", "Pictures", 1)
    book.page("One")
    name = book.image(grey, 50.0, 50.0, 70.0, 50.0)
    assert book.image(name, 50.0, 150.0, 70.0, 50.0) == name
    book.image(colours, 50.0, 250.0, 30.0, 40.0)
    page = pypdf.PdfReader(io.BytesIO(book.finish())).pages[0]
    found = {image.image.mode: image.image for image in page.images}
    assert len(page.images) == 2
    assert np.array_equal(np.asarray(found["RGB"]), np.asarray(colours))
    assert np.array_equal(np.asarray(found["L"]), np.asarray(grey))


def test_characters_that_no_font_has_become_question_marks():
    book = manual_book.Book("a4", "Knödel 編み (a\\b)")
    book.page("One")
    text = pypdf.PdfReader(io.BytesIO(book.finish())).pages[0].extract_text()
    assert "Knödel ?? (a\\b)" in text
