"""The manual says on paper what the crossing map says: every piece, sheet, step and station."""

import io
import re
from functools import cache

import numpy as np
import pypdf
import pytest
import shapely
from drawn_jobs import drawn_job

from fabweave.estimate.assembly_time import step_seconds
from fabweave.job.papers import job_facts, manual_pdf, start_pictures
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.piece.development import piece_stretches
from fabweave.plan.bill_of_materials import bill_of_materials
from fabweave.show.manual import book as manual_book
from fabweave.show.manual.sheets import place_across


def facts_of(job):
    portrait = start_pictures(job).portrait()
    return job_facts(job, bill_of_materials(job.piece_set), job.costs, portrait)


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


@pytest.mark.slow
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


def test_east_asia_is_measured_as_it_is_written_and_breaks_anywhere():
    title = "竹编兔子" * 9
    assert manual_book.text_width(title, 10.0) == pytest.approx(360.0)
    lines = manual_book.wrapped(title, 10.0, 100.0)
    assert "".join(lines) == title
    assert [len(line) for line in lines] == [10, 10, 10, 6]


def test_a_school_has_a_sheet_for_the_teacher_with_figures_of_the_job():
    made = drawn_job(profile="school")
    pages = [page for page in pages_of(profile="school") if "For the teacher" in page]
    assert len(pages) == 1
    threads, crossings = len(made.plan.threads), len(made.plan.crossings)
    assert f"({threads}, of which" in pages[0]
    assert f"({2 * crossings} and {crossings}:" in pages[0]
    first = made.job.costs.assembly.hours[1]
    assert f"{60.0 * first:.0f} minutes: {len(made.plan.steps)} steps" in pages[0]
    assert not any("For the teacher" in page for page in pages_of())
