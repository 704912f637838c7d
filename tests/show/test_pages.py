"""The page that opens a job leads to all its files, and the report shows what the accounts say."""

import json
import re
from html import unescape

import pytest
from jobs import OCTAHEDRON, contents_of

import fabweave as fw

pytestmark = pytest.mark.usefixtures("quick_jobs")

#: What is not linked: the page itself.
LEFT_OUT = {"index.html"}


def links_of(folder):
    return re.findall(r'href="([^"]+)"', (folder / "index.html").read_text("utf-8"))


def test_every_file_of_a_job_is_linked_and_every_link_leads_to_one(finished):
    folder = finished(*OCTAHEDRON)
    assert set(links_of(folder)) == {*contents_of(folder)} - LEFT_OUT


@pytest.mark.slow
def test_so_are_kerfed_sheets_files_for_a_service_and_a_mesh_from_memory(finished, tmp_path):
    folder = finished(*OCTAHEDRON, "--kerf", "0.2mm", "--profile", "service")
    assert any(name.startswith("cut/") for name in links_of(folder))
    assert any(name.startswith("service/card_0.4mm/") for name in links_of(folder))
    assert set(links_of(folder)) == {*contents_of(folder)} - LEFT_OUT
    corners = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    mesh = fw.mesh(corners, faces, size=100, name="my mesh")
    pieces = fw.weave(mesh).ribbons(material="card").pieces()
    pieces.nest(effort="quick").write(tmp_path / "job")
    assert "my mesh.obj" in links_of(tmp_path / "job")
    assert set(links_of(tmp_path / "job")) == {*contents_of(tmp_path / "job")} - LEFT_OUT


@pytest.mark.slow
@pytest.mark.parametrize("page", ["index.html", "waste.html"])
def test_a_name_is_no_markup(finished, page):
    """Everything that is shown is escaped: titles, notes, reasons, names of materials."""
    folder = finished(*OCTAHEDRON, "--title", "<i>a & b</i>")
    text = (folder / page).read_text("utf-8")
    assert "<i>" not in text
    assert "<h1>&lt;i&gt;a &amp; b&lt;/i&gt;" in text


def test_it_loads_nothing_and_runs_nothing(finished):
    page = (finished(*OCTAHEDRON) / "index.html").read_text("utf-8")
    assert not re.search(r"<script[^>]*src|<link|<iframe|@import|url\(|://", page)


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


def test_every_figure_of_the_accounts_stands_in_the_report(finished):
    folder = finished(*OCTAHEDRON)
    cells = re.findall(r"<td>([^<]*)</td>", (folder / "waste.html").read_text("utf-8"))
    waste = json.loads((folder / "waste.json").read_text("utf-8"))
    told = waste["comparison"]
    shares = told["gross"], told["net"], told["best"]
    assert {f"{share:.1%}" for share in shares} <= {*cells}
    for account in (*waste["sheets"], waste["totals"]):
        row = [f"{account[key] / 100:.1f}" for key in ("piece_area_mm2", "waste_mm2")]
        assert {*row} <= {*cells}
    for action in waste["estimate"]["assembly"]["actions"]:
        assert {action["words"], f"{action['each_s']:g} s"} <= {*cells}
