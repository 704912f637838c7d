"""The page on material says what the figures say, and nothing on it can hide that."""

import pytest
from jobs import OCTAHEDRON

from fabweave.verify import verify_job
from fabweave.verify.drawing import ReadError
from fabweave.verify.read.waste_page import read_waste_page


@pytest.fixture(scope="module")
def page(finished):
    return (finished(*OCTAHEDRON) / "waste.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("first", "other"),
    [
        ("</body>", "<script>1</script></body>"),
        ("</body>", "<iframe src='a.html'></iframe></body>"),
        ("</body>", "<form action='a'></form></body>"),
        ("</body>", "<object data='a.svg'></object></body>"),
        ("</body>", "<base href='http://a.b'></body>"),
        ("<body>", "<body onload='a()'>"),
        ("<head>", "<head><meta http-equiv='refresh' content='0;url=http://a.b'>"),
        ("<head>", "<head><link rel='stylesheet' href='a.css'>"),
        ("<style>", "<style>td{display:none} "),
        ("<style>", "<style>td::after{content:'9'} "),
        ("<style>", "<style>td{color:#fff} "),
        ("<style>", "<style>@import 'a.css'; "),
        ("<style>", "<style>body{background:url(http://a.b)} "),
        ("<table>", "<table style='display:none'>"),
        ("<table>", "<table hidden>"),
        ('<img src="', '<img src="http://a.b/'),
        ('<img src="', '<img src="../'),
        ("<h1>", "<h1><a href='javascript:a()'>b</a>"),
        ("<tr>", "<tr fill='#fff'>"),
        ("<td>", "</td><td>"),
    ],
)
def test_what_may_hide_or_lead_away_is_refused(page, first, other, tmp_path):
    path = tmp_path / "waste.html"
    path.write_text(page, encoding="utf-8")
    assert [text for tag, text in read_waste_page(path) if tag == "figcaption"] == ["sheet_01"]
    assert first in page
    path.write_text(page.replace(first, other, 1), encoding="utf-8")
    with pytest.raises(ReadError):
        read_waste_page(path)


def test_another_name_than_that_of_the_job_is_found_on_every_page(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    for name in ("waste.html", "index.html", "assembly.html"):
        path = folder / name
        path.write_text(path.read_text("utf-8").replace("Octahedron", "Vase"), encoding="utf-8")
    assert set(verify_job(folder).failed) >= {"page", "manual"}


@pytest.mark.parametrize(
    ("first", "other"),
    [("<td>sheet_01<", "<td>sheet_02<"), ("<td>8<", "<td>9<"), (" %<", "9 %<")],
)
def test_a_figure_that_is_not_that_of_the_report_is_found(page, first, other, finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    assert first in page
    (folder / "waste.html").write_text(page.replace(first, other, 1), encoding="utf-8")
    assert verify_job(folder).failed == ("page",)
