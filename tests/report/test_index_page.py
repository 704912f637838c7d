"""The page that opens a job leads to all its files, in the order in which they are needed."""

import re
from html import unescape

import pytest
from jobs import OCTAHEDRON

import fabweave as fw

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
