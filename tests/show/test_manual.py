"""The manual says on paper what the crossing map says: every piece, sheet, step and station."""

import io
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pypdf
import pytest
import shapely
from drawn_jobs import drawn_job

from fabweave.estimate.assembly_time import step_seconds
from fabweave.job.papers import job_facts, manual_pdf
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.piece.development import piece_stretches
from fabweave.plan.bill_of_materials import bill_of_materials
from fabweave.show.manual import book as manual_book
from fabweave.show.manual.cover import write_cover
from fabweave.show.manual.painting import packed
from fabweave.show.manual.sheets import place_across
from fabweave.show.manual.step_pictures import step_pictures


def facts_of(job):
    return job_facts(job, bill_of_materials(job.piece_set), job.costs)


@cache
def manual_of(paper="a4", **changed):
    made = drawn_job(**changed)
    seconds, facts = step_seconds(made.plan, made.job.costs.assembly), facts_of(made.job)
    return manual_pdf(made.plan, facts, made.job.drawings, made.pictures, seconds, paper=paper)


@cache
def pages_of(paper="a4", **changed):
    """Return what a stranger reads on each page, with single spaces."""
    reader = pypdf.PdfReader(io.BytesIO(manual_of(paper, **changed)))
    return [" ".join(page.extract_text().split()) for page in reader.pages]


def section(name, **changed):
    return " ".join(page for page in pages_of(**changed) if page.startswith(name))


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
    made = drawn_job()
    again = step_pictures(made.scene, made.plan)
    seconds = step_seconds(made.plan, made.job.costs.assembly)
    data = manual_pdf(made.plan, facts_of(made.job), made.job.drawings, again, seconds)
    assert data == manual_of()


def test_every_piece_is_in_every_section_that_lists_pieces():
    crossing_map = drawn_job().plan
    ids = {piece.id for piece in crossing_map.pieces}
    for name in ("Threads and their pieces", "Parts list", "Sheets", "Steps"):
        words = set(re.findall(r"[A-Z]+\d+", section(name)))
        assert ids <= words, name
        assert words <= ids, name


def test_cover_has_the_figures():
    crossing_map = drawn_job().plan
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


@pytest.mark.parametrize("sort", ["thread", "blind-rivet-2.4", "mini-brad"])
def test_the_cover_names_the_tools_of_what_the_steps_set(sort):
    made = drawn_job()
    facts = facts_of(made.job)
    (row, *_) = facts.bill.fasteners
    bill = replace(facts.bill, fasteners=(replace(row, fits=(sort,), outside=None),))
    book = manual_book.Book("a4", "Torus")
    write_cover(book, made.plan, replace(facts, bill=bill))
    page = pypdf.PdfReader(io.BytesIO(book.finish())).pages[0]
    text = " ".join(page.extract_text().split())
    tools = {"thread": "a needle and scissors", "blind-rivet-2.4": "riveting pliers"}
    assert "a pencil to tick the boxes" in text
    for one, tool in tools.items():
        assert (f"{tool}; a pencil" in text) == (sort == one)
    assert ("knot its ends" in text) == (sort == "thread")


def test_the_map_tells_the_step_of_each_piece():
    crossing_map = drawn_job().plan
    told = re.findall(r"\b([A-Z]+\d+) (\d+)[, ]", section("Threads and their pieces"))
    step_of = {key: step.step for step in crossing_map.steps for key in step.pieces}
    assert {key: int(number) for key, number in told if key in step_of}.items() >= step_of.items()


# --- pictures -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_pieces_cover_the_ribbons():
    """Every stretch of ribbon is of one piece; where two lap, of both."""
    job = drawn_job(max_length_mm=250.0).job
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
    assert set(head.split()) == explained == set("1234")


def test_pieces_that_are_alike_are_drawn_once():
    crossing_map = drawn_job().plan
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


def test_pictures_are_kept_as_they_are():
    dice = np.random.default_rng(3)
    pixels = dice.integers(0, 256, (5, 7, 3), dtype=np.uint8)
    book = manual_book.Book("a4", "Pictures")
    book.page("One")
    book.image(packed(pixels), 50.0, 50.0, 70.0, 50.0)
    page = pypdf.PdfReader(io.BytesIO(book.finish())).pages[0]
    (found,) = (np.asarray(image.image.convert("RGB")) for image in page.images)
    assert np.array_equal(found, pixels)
    assert np.array_equal(np.asarray(packed(pixels).image), pixels)


def test_titles_of_east_asia_are_written_and_characters_that_no_font_has_are_not():
    book = manual_book.Book("a4", "Knödel 編み兔子 토끼 \N{RABBIT} (a\\b)")
    book.page("One")
    reader = pypdf.PdfReader(io.BytesIO(book.finish()))
    text = reader.pages[0].extract_text().replace("\n", "")
    assert "Knödel 編み兔子 토끼 ? (a\\b)" in text
    assert "編み兔子 토끼" in reader.metadata.title


def test_east_asia_is_measured_as_it_is_written_and_breaks_anywhere():
    title = "竹编兔子" * 9
    assert manual_book.text_width(title, 10.0) == pytest.approx(360.0)
    lines = manual_book.wrapped(title, 10.0, 100.0)
    assert "".join(lines) == title
    assert [len(line) for line in lines] == [10, 10, 10, 6]


def test_text_before_the_steps_is_read_at_arms_length_and_each_page_tells_how_many_there_are():
    reader = pypdf.PdfReader(io.BytesIO(manual_of()))
    least = {}
    for number, page in enumerate(reader.pages, start=1):
        text = " ".join(page.extract_text().split())
        assert f"page {number} / {len(reader.pages)}" in text
        content = page.get_contents().get_data().decode("latin-1")
        sizes = [float(size) for size in re.findall(r"/F\d+ ([\d.]+) Tf", content)]
        for name in ("Overview", "How to read", "Threads and", "Parts", "Sheets"):
            if text.startswith(name):
                least[name] = min([least.get(name, 99.0), *sizes])
    assert len(least) == 5
    assert min(least[name] for name in ("Overview", "How to read", "Parts")) >= 9.5
    # Names on pieces, and of pieces on bands, are somewhat smaller where there is no room.
    assert min(least.values()) >= 8.0


@pytest.mark.parametrize(("words", "pages"), [(10, 1), (150, 1), (600, 2)])
def test_a_long_verdict_makes_the_picture_small_and_runs_on(words, pages):
    facts = replace(facts_of(drawn_job().job), buildable="Yes, with care. " * (words // 3))
    book = manual_book.Book("a4", "Torus")
    write_cover(book, drawn_job().plan, facts)
    reader = pypdf.PdfReader(io.BytesIO(book.finish()))
    assert len(reader.pages) == pages
    heights = []
    for page in reader.pages:
        assert page.extract_text().startswith("Overview")
        page.extract_text(visitor_text=lambda text, _, at, *__: heights.append((at[5], text)))
    assert "".join(text for _, text in heights).count("Yes,") == words // 3
    assert min(at for at, text in heights if text.strip()) >= manual_book.MARGIN
