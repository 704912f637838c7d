"""The page that opens a job shows its figures and leads to all its files, and nothing else."""

from dataclasses import replace

import pytest
from jobs import OCTAHEDRON

from fabweave.verify import verify_job
from fabweave.verify.checks.reports.index_page import check_index
from fabweave.verify.drawing import ReadError
from fabweave.verify.read.index_page import _ATTRIBUTES, _TAGS, STYLE
from fabweave.verify.read.job_files import load_job
from fabweave.verify.read.waste_page import Seen, read_page
from fabweave.verify.statement import Tally


@pytest.fixture(scope="module")
def folder(finished):
    return finished(*OCTAHEDRON)


@pytest.fixture(scope="module")
def read(folder):
    return load_job(folder, Tally("files"))


def findings(job):
    tally = Tally("index")
    check_index(job, tally)
    return tally.result().findings


@pytest.mark.parametrize(
    ("first", "other"),
    [
        ("</body>", "<script>1</script></body>"),
        ("</body>", "<pre>1</pre></body>"),
        ("<head>", "<head><meta http-equiv='refresh' content='0;url=http://a.b'>"),
        ("width=device-width", "width=99999"),
        ("<style>", "<style>li{display:none} "),
        ("<table>", "<table style='width:1%'>"),
        ("<table>", "<table hidden>"),
        ("<img ", "<img width='0' "),
        ('<img src="', '<img src="http://a.b/'),
        ('<a href="', '<a href="../'),
        ('<a href="', '<a href="javascript:a()'),
        (">DXF<", "><"),
        ("DXF</a> <a", "DXF <a"),
        ("</li>", "</p>"),
        ("<polyline ", "<polyline fill-opacity='0' "),
        ('fill="#0072b2"', 'fill="#ffffff"'),
    ],
)
def test_what_may_hide_or_lead_away_is_refused(folder, first, other, tmp_path):
    text = (folder / "index.html").read_text("utf-8")
    path = tmp_path / "index.html"
    path.write_text(text, encoding="utf-8")
    assert read_page(path, STYLE, _TAGS, _ATTRIBUTES)[0] == Seen("title", "Octahedron")
    assert first in text
    path.write_text(text.replace(first, other, 1), encoding="utf-8")
    with pytest.raises(ReadError):
        read_page(path, STYLE, _TAGS, _ATTRIBUTES)


def test_nothing_on_the_page_can_be_another(read):
    seen = read.index.seen
    assert findings(read) == ()
    for at, (tag, text) in enumerate(seen):
        for other in ([Seen(tag, f"{text}0")], [], [seen[at], Seen(tag, text)]):
            shown = (*seen[:at], *other, *seen[at + 1 :])
            assert findings(replace(read, index=replace(read.index, seen=shown))), (tag, text)


def test_a_link_to_what_is_gone_and_a_file_without_a_link_are_found(read):
    index = read.index
    for name in ("offcuts/other.dxf", "service/parts.csv"):
        beside = replace(index, files=index.files | {name})
        assert findings(replace(read, index=beside)), name
    gone = replace(index, files=index.files - {"offcuts/stock.toml"})
    assert findings(replace(read, index=gone))
    outcome = {"outcome": read.settings["outcome"] | {"likeness_mm": 1.0}}
    assert findings(replace(read, settings=read.settings | outcome))
    assert findings(replace(read, templates={} if read.templates is None else None))


@pytest.mark.parametrize("name", ["stations.csv", "sheets/sheet_01.svg", "assembly.html"])
def test_what_is_linked_cannot_be_removed(finished, name, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    (folder / name).unlink()
    assert "files" in verify_job(folder).failed


def test_a_size_that_the_mesh_has_not_is_found(read):
    seen = tuple(
        Seen(tag, "90 × 90 × 91 mm" if text == "90 × 90 × 90 mm" else text)
        for tag, text in read.index.seen
    )
    assert seen != read.index.seen
    (finding,) = findings(replace(read, index=replace(read.index, seen=seen)))
    assert "the size is said to be '90 × 90 × 91 mm'" in finding


def test_files_that_somebody_put_there_are_not_missed(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    (folder / "notes.txt").write_text("cut on Friday")
    assert "index" not in verify_job(folder).failed


def test_an_older_job_may_be_without_the_page_but_it_may_not_be_lost(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    (folder / "index.html").unlink()
    report = verify_job(folder)
    assert report.failed == ("files",)
    assert report.checks[0].findings == ("index.html is missing",)
    (folder / "contents.json").unlink()
    assert verify_job(folder).ok
