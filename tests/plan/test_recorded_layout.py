import json
from dataclasses import replace

import pytest
from crossing_maps import piece_record, sheet_record, small_map
from sheet_fit import bar

from fabweave.core.errors import InputError
from fabweave.nest.nesting import nest
from fabweave.plan.crossing_map import ThreadRecord
from fabweave.plan.nest_pieces import read_layout
from fabweave.stock.sheet_size import SheetSize

STOCK = [SheetSize(120, 90)]
RULES = {"margin_mm": 5.0, "gap_mm": 2.0}
IDS = ["A1", "A2", "B1"]


def pieces():
    return [bar(w, 9.0) for w in (80.0, 70.0, 60.0)]


def record():
    layout = nest(pieces(), STOCK, effort="quick", **RULES)
    crossing_map = small_map(
        sheets=[sheet_record(1 + at, 120.0, 90.0) for at in range(len(layout.sheets))],
        pieces=[
            piece_record(name, outline, sheet=p.sheet + 1, turn=p.rotation_deg, at=(p.x_mm, p.y_mm))
            for name, p, outline in zip(IDS, layout.placements, pieces(), strict=True)
        ],
    )
    crossing_map = replace(
        crossing_map,
        threads=[
            ThreadRecord(
                id=0, label="A", closed=True, bunch=0, crossings=(), over=(), pieces=tuple(IDS)
            )
        ],
        layout=replace(crossing_map.layout, notes=("nesting was cut short",)),
    )
    return layout, crossing_map.to_json()


def read(tmp_path, content, stock=STOCK, **rules):
    path = tmp_path / "mine.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_layout(path, pieces(), IDS, stock, **(RULES | rules))


def test_layout_comes_back_to_the_last_bit(tmp_path):
    layout, content = record()
    found = read(tmp_path, content)
    assert found.placements == layout.placements
    assert found.sheets == layout.sheets
    assert found.recorded
    assert found.notes == ("nesting was cut short",)


def put(value, *path):
    """Return what puts a value at a path of a document."""

    def spoil(content):
        *way, last = path
        for step in way:
            content = content[step]
        content[last] = value

    return spoil


def one_missing(content):
    del content["pieces"][2]
    del content["threads"][0]["pieces"][2]


@pytest.mark.parametrize(
    ("spoil", "place"),
    [
        (lambda content: content["pieces"][1].update(placement=content["pieces"][0]["placement"]),
         "A2"),
        (put(80.01, "pieces", 1, "outline", 0, 0), "A2"),
        (one_missing, "B1"),
        (lambda content: content["pieces"].append(content["pieces"][0] | {"id": "Z9"}), "Z9"),
        (put(7, "pieces", 0, "sheet"), "sheet 7"),
        (put(500.0, "sheets", 0, "width_mm"), "500x90mm"),
        (put(None, "pieces", 0, "placement"), "pieces[0].placement"),
        (put("left", "pieces", 0, "placement", "x_mm"), "pieces[0].placement.x_mm"),
        (put(float("nan"), "pieces", 0, "placement", "x_mm"), "malformed"),
    ],
)  # fmt: skip
def test_spoiled_layout_is_refused(tmp_path, spoil, place):
    _, content = record()
    spoil(content)
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert place in str(caught.value)


def test_no_file_rules_and_stock_that_do_not_hold_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"cannot read .*none\.json"):
        read_layout(tmp_path / "none.json", pieces(), IDS, STOCK, **RULES)
    _, content = record()
    with pytest.raises(InputError, match="the margin is 6"):
        read(tmp_path, content, margin_mm=6.0)
    with pytest.raises(InputError, match="in stock"):
        read(tmp_path, content, stock=[SheetSize(200, 100)])
