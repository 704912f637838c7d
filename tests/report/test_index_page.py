"""The page that opens a job leads to all its files, in the order in which they are needed."""

import json
import re
import shutil
import subprocess
from html import unescape

import numpy as np
import pypdf
import pytest
from jobs import OCTAHEDRON

import fabweave as fw

CHROMIUM = shutil.which("chromium")
#: What is not linked: the page itself.
LEFT_OUT = {"index.html"}


def files_of(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def links_of(folder):
    return re.findall(r'href="([^"]+)"', (folder / "index.html").read_text("utf-8"))


def test_every_file_of_a_job_is_linked_and_every_link_leads_to_one(finished):
    folder = finished(*OCTAHEDRON)
    assert set(links_of(folder)) == files_of(folder) - LEFT_OUT


@pytest.mark.slow
def test_so_are_kerfed_sheets_files_for_a_service_and_a_mesh_from_memory(finished, tmp_path):
    folder = finished(*OCTAHEDRON, "--kerf", "0.2mm", "--profile", "service")
    assert any(name.startswith("cut/") for name in links_of(folder))
    assert any(name.startswith("service/card_0.4mm/") for name in links_of(folder))
    assert set(links_of(folder)) == files_of(folder) - LEFT_OUT
    corners = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    mesh = fw.mesh(corners, faces, size=100, name="my mesh")
    pieces = fw.weave(mesh).ribbons(material="card").pieces()
    pieces.nest(effort="quick").write(tmp_path / "job")
    assert "my mesh.obj" in links_of(tmp_path / "job")
    assert set(links_of(tmp_path / "job")) == files_of(tmp_path / "job") - LEFT_OUT


def test_files_come_in_the_order_in_which_they_are_needed(finished):
    links = links_of(finished(*OCTAHEDRON))
    order = ["render.png", "sheets/sheet_01.dxf", "sheets/sheet_01.svg", "assembly.pdf",
             "assembly.html", "stations.csv", "waste.html", "preflight.json", "ribbons.json",
             "verify.json", "job.toml", "woven_mesh.obj", "model.glb"]  # fmt: skip
    assert sorted(order, key=links.index) == order


def test_it_tells_what_was_made(finished):
    page = unescape((finished(*OCTAHEDRON) / "index.html").read_text("utf-8"))
    text = " ".join(re.sub(r"<[^>]+>", " ", page.partition("</style>")[2]).split())
    assert text.startswith("Octahedron Can it be built? Yes.")
    for words in (
        "Weave plain weave, exact", "Size 90 × 90 × 90 mm", "Material Card, 300 g/m², 0.4 mm",
        "4 threads 12 crossings 8 pieces of", "8 joints 1 sheet,",
    ):  # fmt: skip
        assert words in text


def test_it_loads_nothing_and_runs_nothing(finished):
    page = (finished(*OCTAHEDRON) / "index.html").read_text("utf-8")
    assert not re.search(r"<script|<link|<iframe|@import|url\(|://", page)


def test_charts_show_the_figures_to_scale(finished):
    folder = finished(*OCTAHEDRON)
    page = (folder / "index.html").read_text("utf-8")
    waste = json.loads((folder / "waste.json").read_text("utf-8"))
    bars = re.findall(r'<text [^>]*>([^<]+)</text><polyline points="([-\d., ]+)"', page)
    reach = {}
    for text, points in bars:
        x = [float(pair.split(",")[0]) / 300.0 for pair in points.split()]
        reach[unescape(text).partition(":")[0]] = min(x), max(x)
    used = waste["totals"]["utilisation"]
    # What becomes of the sheets adds up to all of them.
    ends = [reach[name] for name in ("pieces", "offcuts worth keeping", "waste, holes too")]
    assert ends[0] == pytest.approx((0.0, used), abs=2e-4)
    assert ends[1][0] == pytest.approx(used, abs=2e-4)
    assert ends[2] == pytest.approx((ends[1][1], 1.0), abs=3e-3)
    assert reach["at the very best"][1] == pytest.approx(waste["comparison"]["best"], abs=2e-4)
    # Times are to one scale, from the least to the most.
    estimate = waste["estimate"]
    hours = [3600.0 * end for end in estimate["assembly"]["hours"]]
    for name, span in (("cutting", estimate["cut_s"]), ("hands", hours)):
        most = max(hours[1], estimate["cut_s"][1], estimate["travel_s"][1])
        wanted = [end / most for end in span]
        assert reach[name][0] == pytest.approx(wanted[0], abs=2e-4)
        assert reach[name][1] == pytest.approx(max(wanted[1], wanted[0] + 1 / 300), abs=3e-4)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_charts_are_printed_in_colour_and_text_is_large_enough(finished, tmp_path):
    page = finished(*OCTAHEDRON) / "index.html"
    subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--no-pdf-header-footer",
         f"--user-data-dir={tmp_path / 'profile'}", f"--print-to-pdf={tmp_path / 'page.pdf'}",
         page.as_uri()],
        check=True, capture_output=True, timeout=120,
    )  # fmt: skip
    reader = pypdf.PdfReader(tmp_path / "page.pdf")
    assert len(reader.pages) <= 2
    sizes, text = set(), ""
    for printed in reader.pages:

        def keep(told, turn, place, _, size, sizes=sizes):
            if told.strip():
                scale = np.array(turn).reshape(3, 2)[:2] @ np.eye(2)
                letters = np.array(place).reshape(3, 2)[:2] @ scale
                sizes.add(round(size * abs(np.linalg.det(letters)) ** 0.5, 1))

        text += printed.extract_text(visitor_text=keep)
    assert "What becomes of the sheets" in text
    assert "waste, holes too" in text
    assert min(sizes) >= 7.9  # points
    # Blue of the bars, which no printer's saving of backgrounds leaves out.
    drawn = b"".join(printed.get_contents().get_data() for printed in reader.pages)
    assert re.search(rb"0 \.44\d* \.69\d* rg", drawn)
