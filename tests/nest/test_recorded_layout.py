import json

import numpy as np
import pytest

from fabweave.core.errors import InputError
from fabweave.nest.nesting import nest
from fabweave.nest.recorded_layout import read_layout
from fabweave.stock.sheet_size import SheetSize

STOCK = [SheetSize(120, 90)]
RULES = {"margin_mm": 5.0, "gap_mm": 2.0}
IDS = ["A1", "A2", "B1"]


def pieces():
    return [np.array([[0.0, 0.0], [w, 0.0], [w, 9.0], [0.0, 9.0]]) for w in (80.0, 70.0, 60.0)]


def record():
    layout = nest(pieces(), STOCK, effort="quick", **RULES)
    return layout, {
        "layout": {"notes": ["nesting was cut short"]},
        "sheets": [{"width_mm": 120.0, "height_mm": 90.0} for _ in layout.sheets],
        "pieces": [
            {
                "id": name,
                "sheet": p.sheet + 1,
                "placement": {"rotation_deg": p.rotation_deg, "x_mm": p.x_mm, "y_mm": p.y_mm},
                "outline": outline.tolist(),
            }
            for name, p, outline in zip(IDS, layout.placements, pieces(), strict=True)
        ],
    }


def read(tmp_path, content, stock=STOCK, **rules):
    path = tmp_path / "crossing_map.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_layout(path, pieces(), IDS, stock, **(RULES | rules))


def test_layout_comes_back_to_the_last_bit(tmp_path):
    layout, content = record()
    found = read(tmp_path, content)
    assert found.placements == layout.placements
    assert found.sheets == layout.sheets
    assert found.recorded
    assert found.notes == ("nesting was cut short",)


def moved(content):
    content["pieces"][1]["placement"] = content["pieces"][0]["placement"]


def other_outline(content):
    content["pieces"][1]["outline"][0][0] += 0.01


def one_missing(content):
    del content["pieces"][2]


def one_more(content):
    content["pieces"].append(content["pieces"][0] | {"id": "Z9"})


def no_such_sheet(content):
    content["pieces"][0]["sheet"] = 7


def other_sheet(content):
    content["sheets"][0]["width_mm"] = 500.0


def no_placement(content):
    del content["pieces"][0]["placement"]


def not_a_number(content):
    content["pieces"][0]["placement"]["x_mm"] = float("nan")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (moved, "overlap"),
        (other_outline, "of other pieces: 1 differs (A2)"),
        (one_missing, "of other pieces: 1 differs (B1)"),
        (one_more, "of other pieces: 1 differs (Z9)"),
        (no_such_sheet, "is on sheet 7; there are 1"),
        (other_sheet, "500x90mm is not (or no more) in stock"),
        (no_placement, "is no crossing map with a layout"),
        (not_a_number, "not finite"),
    ],
)
def test_spoiled_layout_is_refused(tmp_path, spoil, words):
    _, content = record()
    spoil(content)
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert words in str(caught.value)


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"pieces": 3, "sheets": [], "layout": {}}'])
def test_what_is_no_map_is_refused(tmp_path, content):
    with pytest.raises(InputError, match="is no crossing map with a layout"):
        read(tmp_path, content)


def test_no_file_rules_and_stock_that_do_not_hold_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read the layout"):
        read_layout(tmp_path / "none.json", pieces(), IDS, STOCK, **RULES)
    _, content = record()
    with pytest.raises(InputError, match="the margin is 6"):
        read(tmp_path, content, margin_mm=6.0)
    with pytest.raises(InputError, match="in stock"):
        read(tmp_path, content, stock=[SheetSize(200, 100)])
