"""Strangers' readers find on paper and on screen all that the map of a random job has."""

import json
import re

import pypdf
import pytest
from random_jobs import random_job
from viewer_tab import Page, Tab

import fabweave as fw

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]
#: Small jobs that can be made: a closed mesh, one with a boundary, and one of several threads.
SEEDS = (5, 14, 17)


@pytest.fixture(scope="module", params=SEEDS)
def job(request, tmp_path_factory):
    vertices, faces, options = random_job(request.param, small=True)
    folder = tmp_path_factory.mktemp("random") / "job"
    made = fw.make(fw.mesh(vertices, faces), folder, **options)
    assert not made.missing
    return folder


@pytest.fixture(scope="module")
def plan(job):
    return json.loads((job / "crossing_map.json").read_text("utf-8"))


def test_the_manual_tells_every_piece_step_joint_and_partner(job, plan):
    pages = [page.extract_text() for page in pypdf.PdfReader(job / "assembly.pdf").pages]
    text = " ".join(" ".join(pages).split())
    ids = {piece["id"] for piece in plan["pieces"]}
    joints = {joint["id"] for joint in plan["joints"]}
    assert ids <= set(re.findall(r"\b[A-Z]+\d+\b", text))
    assert joints == set(map(int, re.findall(r"#(\d+)", text)))
    heads = list(map(int, re.findall(r"\bStep (\d+) ", text)))
    assert heads == [step["step"] for step in plan["steps"]]
    for step, own in zip(plan["steps"], re.split(r"\bStep \d+ ", text)[1:], strict=True):
        assert step["text"] in own
    # Below the band of each thread stands who is met, in order, a joint's crossing once.
    bands = re.split(r"\bThread ([A-Z]+)\b", text)
    for label, own in zip(bands[1::2], bands[2::2], strict=True):
        pieces = [piece for piece in plan["pieces"] if piece["id"].rstrip("0123456789") == label]
        partners = {one["partner"] for piece in pieces for one in piece["stations"]}
        assert partners <= set(re.findall(r"\b[A-Z]+\d+\b", own))


@pytest.mark.apt
def test_the_viewer_shows_every_piece_step_joint_and_partner(browser, job, plan):
    tab = Tab(browser, Page(job / "assembly.html"))
    page, mates = tab.page, {joint["id"]: joint["pieces"] for joint in plan["joints"]}
    for piece in plan["pieces"]:
        tab.search(piece["id"])
        assert tab.chosen() == piece["id"]
        rows = [row.split("\t") for row in page.locator("#panel-piece tbody tr").all_inner_texts()]
        for row, station in zip(rows, piece["stations"], strict=True):
            assert row[2].strip() == ("over" if station["over"] else "under")
            assert row[3] == station["partner"]
        ends = {cell for row in rows for cell in re.findall(r"#(\d+)", row[4])}
        assert ends == {str(key) for key in piece["joints"] if key is not None}
        assert all(piece["id"] in mates[int(key)] for key in ends)
    for step in plan["steps"]:
        number = step["step"]
        page.evaluate(f"location.hash = '#step={number}'")
        tab.wait(f"document.body.dataset.step === '{number}'")
        assert step["text"] in page.locator("#step-text").inner_text()
    tab.close()
