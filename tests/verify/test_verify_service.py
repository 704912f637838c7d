"""Files for a service are proved: what is spoilt in them is found."""

import csv
import io
import json
import re
import shutil

import ezdxf
import pytest
from sealing import found_by
from spoiling import swap

from fabweave.verify.check.service import check_service
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


@pytest.fixture(scope="module")
def made(finished):
    """Return a job whose pieces are of several kinds, with holes and slots, for a service."""
    words = "--size 150mm --sheet 500x350mm --effort quick --joint rivet,slots --profile service"
    words += " --boundary end --as-drawn off"
    return finished("shape:tube?m=4&n=4", *words.split())


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "job")


def found(folder) -> str:
    return found_by(check_service, load_job(folder, Tally("files")))


def table_of(folder):
    text = (folder / "service" / "parts.csv").read_text()
    return list(csv.DictReader(io.StringIO(text)))


def write_table(folder, rows) -> None:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    (folder / "service" / "parts.csv").write_text(text.getvalue())


def file_of(folder, suffix, nth=0):
    return sorted((folder / "service").rglob(f"*.{suffix}"))[nth]


def plan_of(folder):
    return json.loads((folder / "crossing_map.json").read_text())


def test_quantities_are_those_of_the_kinds(made) -> None:
    assert found(made) == ""
    plan, rows = plan_of(made), table_of(made)
    assert sum(int(row["quantity"]) for row in rows) == len(plan["pieces"])
    kinds = {piece["id"]: piece["kind"] for piece in plan["pieces"]}
    told = {name: int(row["kind"]) for row in rows for name in row["pieces"].split()}
    assert told == kinds
    assert len(rows) == len(set(kinds.values())) < len(kinds)
    names = [row["file"] for row in rows]
    assert names == sorted(names)
    assert any(piece["cutouts"] for piece in plan["pieces"])


def test_a_file_holds_cuts_on_one_layer_and_nothing_else(made) -> None:
    for row in table_of(made):
        document = ezdxf.readfile(made / "service" / row["file"])
        # ezdxf adds a layer of its own when it reads.
        assert {layer.dxf.name for layer in document.layers} <= {"0", "Defpoints"}
        assert "Defpoints" not in (made / "service" / row["file"]).read_text()
        assert document.layers.get("0").color == 7
        entities = list(document.modelspace())
        assert len(entities) == int(row["holes"]) + 1
        assert {entity.dxf.layer for entity in entities} == {"0"}
        assert all(entity.dxf.color == 256 for entity in entities)  # by layer
        assert all(entity.xdata is None for entity in entities)
        assert entities[-1].dxftype() == "LWPOLYLINE"
        # Round holes are circles, slots are closed lines.
        assert all(e.dxftype() == "CIRCLE" or e.closed for e in entities)
        assert document.header["$EXTMIN"][:2] == pytest.approx((0.0, 0.0), abs=1e-9)
        size = (float(row["length_mm"]), float(row["width_mm"]))
        assert document.header["$EXTMAX"][:2] == pytest.approx(size, abs=1e-3)
        svg = (made / "service" / row["file"]).with_suffix(".svg").read_text()
        assert len(re.findall("<(path|circle) ", svg)) == len(entities)
        assert set(re.findall('stroke="([^"]*)"', svg)) == {"#FF0000"}
        assert "<title" not in svg
        assert "<g" not in svg


def several(rows):
    """Return a row for more than one piece."""
    return next(row for row in rows if int(row["quantity"]) > 1)


def forget_a_piece(rows) -> None:
    row = several(rows)
    row["pieces"] = row["pieces"].rpartition(" ")[0]


def exchange_pieces(rows) -> None:
    rows[0]["pieces"], rows[-1]["pieces"] = rows[-1]["pieces"], rows[0]["pieces"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: several(rows).update(quantity="1"), "quantity is '1', but should be"),
        (forget_a_piece, "pieces lack"),
        (exchange_pieces, "should not be there"),
        (lambda rows: rows.pop(), "is no piece's"),
        (lambda rows: rows.append(rows[0]), "its material and thickness, have"),
        (
            lambda rows: rows[0].update(kind="99"),
            "its material and thickness, lack",
        ),
        (lambda rows: rows[0].update(pieces="Z9"), "have Z9, which should not be there"),
        (lambda rows: rows[0].update(material="ply"), "its name is"),
        (lambda rows: rows[0].update(thickness_mm="0.5"), "its name is"),
        (lambda rows: rows[0].update(file="../job.toml"), "is no piece's"),
        (lambda rows: rows[0].update(file=rows[1]["file"]), "its name is"),
    ],
)
def test_a_spoilt_row_is_found(job, change, words) -> None:
    rows = table_of(job)
    change(rows)
    write_table(job, rows)
    assert words in found(job)


def edit(suffix, old, new):
    def spoil(folder) -> None:
        path = file_of(folder, suffix)
        path.write_text(swap(old, new)(path.read_text()))

    return spoil


def swap_files(suffix):
    def spoil(folder) -> None:
        one, two = file_of(folder, suffix, 0), file_of(folder, suffix, 1)
        first = one.read_text()
        one.write_text(two.read_text())
        two.write_text(first)

    return spoil


def move_a_hole(folder) -> None:
    path = file_of(folder, "svg")
    text = re.sub(
        'cx="([^"]*)"', lambda m: f'cx="{float(m[1]) + 0.05:.4f}"', path.read_text(), count=1
    )
    path.write_text(text)


def mirror(folder) -> None:
    """Lay a piece on its other face."""
    path = file_of(folder, "svg")
    text = path.read_text()
    wide = float(re.findall('width="([0-9.]+)mm"', text)[0])
    text = re.sub("([ML]|[01] )([-0-9.]+),", lambda m: f"{m[1]}{wide - float(m[2]):.4f},", text)
    text = re.sub("0 0 ([01]) ", lambda m: f"0 0 {1 - int(m[1])} ", text)
    path.write_text(re.sub('cx="([^"]*)"', lambda m: f'cx="{wide - float(m[1]):.4f}"', text))


def outline_first(folder) -> None:
    path = file_of(folder, "svg")
    lines = path.read_text().splitlines()
    lines[2:-1] = lines[2:-1][::-1]
    path.write_text("\n".join(lines))


LINE = "  0\nLINE\n  8\n0\n 10\n1\n 20\n1\n 11\n5\n 21\n5\n"
SPOILT = [
    (edit("dxf", "  2\nENTITIES\n", f"  2\nENTITIES\n{LINE}"), "open or named"),
    (edit("dxf", "LWPOLYLINE\n", "LWPOLYLINE\n 62\n1\n"), "has a group 62"),
    (edit("dxf", "  8\n0\n100\nAcDbPolyline", "  8\nCUT\n100\nAcDbPolyline"), "on layer 'CUT'"),
    (edit("dxf", "$INSUNITS\n 70\n4", "$INSUNITS\n 70\n1"), "$INSUNITS is 1"),
    (edit("svg", "<path ", '<g inkscape:groupmode="layer" inkscape:label="X"></g><path '), "'X'"),
    (edit("svg", 'width="', 'width="9'), "says that it is"),
    (edit("svg", "/>", "><title>A1</title></circle>"), "or named"),
    (swap_files("dxf"), "from where it should be"),
    (swap_files("svg"), "from where it should be"),
    (move_a_hole, "from where it should be"),
    (mirror, "from where it should be"),
    (outline_first, "its outline is"),
    (lambda folder: file_of(folder, "svg").unlink(), "could not be read"),
    (lambda folder: file_of(folder, "dxf").write_text(""), "could not be read"),
    (lambda folder: (folder / "service" / "old.dxf").write_text("x"), "old.dxf: it is no piece's"),
    (lambda folder: shutil.rmtree(folder / "service"), "could not be read"),
    (lambda folder: (folder / "service" / "parts.csv").unlink(), "could not be read"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "words"), SPOILT)
def test_a_spoilt_file_is_found(job, spoil, words) -> None:
    spoil(job)
    assert words in found(job)
