"""Lists of stock: what they say, what is refused and where, and that they come back the same."""

import math
import tomllib

import ezdxf
import pytest
import shapely
import tomli_w
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.stock.sheet_size import SheetSize, stock_for, stock_table
from fabweave.stock.stock_file import read_outline, read_stock, stock_of

LIST = """
[[sheet]]
size = "60x40cm"
quantity = 3
price = 4.5
grain = "270deg"
material = "card"
defects = [
  {x = 100, y = 50, diameter = 20},
  {x = "1in", y = 0, width = 10, height = 5},
  {polygon = [[300, 300], [310, 300], [300, 320]]},
]

[[offcut]]
name = "from the lamp"
outline = [[10, 20], [210, 20], [110, 120]]
defects = [{x = 100, y = 60, diameter = 4}]
"""


def written(tmp_path, text):
    path = tmp_path / "stock.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_roll_of_a_list_has_a_price_and_comes_back(tmp_path):
    text = '[[sheet]]\nname = "band"\nroll = "0.5in:100ft"\nprice = 8.0\nquantity = 2\n'
    (roll,) = read_stock(written(tmp_path, text))
    assert (roll.height_mm, roll.width_mm, roll.roll_mm) == (12.7, 30480.0, 30480.0)
    assert (roll.price, roll.quantity, roll.offcut) == (8.0, 2, False)
    assert stock_of(tomllib.loads(tomli_w.dumps(stock_table([roll]))), "again") == (roll,)


@pytest.mark.parametrize(
    "entry",
    [
        {"roll": "12mm"},
        {"roll": "12mm:50m:2"},
        {"roll": 12},
        {"roll": "12mm:50m", "size": "600x400mm"},
        {"roll": "12mm:50m", "defects": []},
        {"roll": "12mm:50m", "outline": [[0, 0], [9, 0], [0, 9]]},
    ],
)
def test_what_is_no_roll_of_a_list_is_refused(entry):
    with pytest.raises(InputError):
        stock_of({"sheet": [entry]}, "stock.toml")


def test_a_list_says_what_it_says(tmp_path):
    sheets = offcut, sheet = read_stock(written(tmp_path, LIST))
    assert stock_of(tomllib.loads(tomli_w.dumps(stock_table(sheets))), "again") == sheets
    assert (sheet.width_mm, sheet.height_mm, sheet.quantity) == (600.0, 400.0, 3)
    assert (sheet.name, sheet.price, sheet.grain_deg) == ("sheet 1", 4.5, 90.0)
    assert (sheet.material, sheet.offcut, sheet.outline) == ("card", False, ())
    disc, box, triangle = (shapely.Polygon(ring) for ring in sheet.defects)
    # The polygon goes around the circle, not much beyond it.
    circle = shapely.Point(100, 50).buffer(10, quad_segs=64)
    assert disc.buffer(1e-3).covers(circle)
    assert disc.area < 1.02 * math.pi * 100
    assert box.equals(shapely.box(25.4, 0, 35.4, 5))
    assert triangle.area == pytest.approx(100)
    # An outline moves to the corner of its rectangle, and its defects with it.
    assert (offcut.width_mm, offcut.height_mm, offcut.quantity) == (200.0, 100.0, 1)
    assert offcut.outline == ((0.0, 0.0), (200.0, 0.0), (100.0, 100.0))
    assert shapely.Polygon(offcut.defects[0]).centroid.distance(shapely.Point(90, 40)) < 1e-3
    assert offcut.area_mm2 == pytest.approx(10_000)
    assert (offcut.name, offcut.offcut, offcut.plain) == ("from the lamp", True, False)


def test_stock_of_other_materials_is_left_out_and_none_at_all_is_refused():
    card, any_of = SheetSize(9, 9, material="card"), SheetSize(8, 8, name="x")
    assert stock_for([card, any_of], "card") == (card, any_of)
    assert stock_for([card, any_of], "shim") == (any_of,)
    assert stock_for([], "shim") == ()
    with pytest.raises(InputError, match="--material card"):
        stock_for([card], "shim")


NINE = '[[sheet]]\nsize = "9x9mm"\n'
#: What may be wrong in a list, and what the message has to name.
SPOILT = [
    ("[[sheet]\n", "line 1"),
    ("", "stock"),
    ("sheets = 3", "sets sheets,"),
    ("sheet = 3", "sheet"),
    ("\n\n[[sheet]]\n", ", [[sheet]] 1: "),
    ("[[sheet]]\nsize = 3", "size is 3"),
    ('[[sheet]]\nsize = "600"', "'600'"),
    ('[[sheet]]\nsize = "9x9mm:2"', "quantity = 2"),
    *(
        (NINE + wrong, wrong.partition(" ")[0])
        for wrong in (
            "qantity = 2", "quantity = 0", "price = nan", 'grain = "up"', 'name = ""',
            "defects = [3]",
        )
    ),
    *(
        (f"{NINE}defects = [{{{wrong}}}]", "defect 1")
        for wrong in (
            "x = 1", "x = 1, y = 1, diameter = 0", "x = 50, y = 1, diameter = 2",
            "polygon = [[0,0],[4,4],[4,0],[0,4]]",
        )
    ),
    *(
        (f"[[offcut]]\noutline = {wrong}", "outline")
        for wrong in (
            "[[0, 0], [1, 0]]", "[[0, 0], [9, 9], [9, 0], [0, 9]]", "[[0, 0], [inf, 0], [0, 9]]",
            '"none.dxf"', '"stock.toml"',
        )
    ),
    ('[[offcut]]\nsize = "9x9mm"\noutline = "a.dxf"', "outline"),
    (f'{NINE}name="a"\n[[offcut]]\nsize="9x9mm"\nname="a"', "name"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "place"), SPOILT)
def test_what_is_wrong_is_refused_with_its_place(tmp_path, text, place):
    with pytest.raises(InputError, match=r"^[^\n]*stock\.toml[^\n]*$") as stop:
        read_stock(written(tmp_path, text))
    assert place in str(stop.value)


number = st.one_of(
    st.integers(-5, 900), st.floats(-10, 900), st.sampled_from([math.nan, math.inf, 1e300, 10**400])
)
value = st.one_of(
    number,
    st.booleans(),
    st.sampled_from(["600x400mm", "24x18in", "12mm", "90deg", "card", "", "x", "9x9mm:2"]),
    st.lists(st.lists(number, min_size=1, max_size=3), max_size=5),
    st.lists(
        st.dictionaries(
            st.sampled_from(["x", "y", "diameter", "width", "height", "polygon"]), number
        ),
        max_size=2,
    ),
)
keys = st.sampled_from(
    ["name", "size", "outline", "quantity", "price", "grain", "material", "defects", "colour"]
)
entry = st.dictionaries(keys, value, max_size=5)


def drawn(tmp_path, draw, *, version="R2010", units=4):
    document = ezdxf.new(version, units=units)
    draw(document.modelspace())
    path = tmp_path / "offcut.dxf"
    document.saveas(path)
    return path


@pytest.mark.parametrize("version", ["R2010", "R12"])
def test_outlines_with_arcs_holes_and_units_are_read(tmp_path, version):
    def draw(space):
        corners = [(0, 0, 0), (40, 0, 1), (40, 20, 0), (0, 20, 0)]
        if version == "R12":
            space.add_polyline2d(corners, format="xyb", close=True)
        else:
            space.add_lwpolyline(corners, format="xyb", close=True)
        space.add_circle((10, 10), 3)
        space.add_line((0, 0), (40, 20))
        space.add_text("to keep")

    outline, holes = read_outline(drawn(tmp_path, draw, version=version, units=5))
    # R12 says nothing of units.
    scale = 10.0 if version == "R2010" else 1.0
    area = scale**2 * (40 * 20 + math.pi * 50)
    assert shapely.Polygon(outline).area == pytest.approx(area, rel=1e-3)
    (hole,) = holes
    disc = shapely.Point(10 * scale, 10 * scale).buffer(3 * scale, quad_segs=99)
    assert shapely.Polygon(hole).buffer(1e-6).covers(disc)
    assert shapely.Polygon(hole).area == pytest.approx(disc.area, rel=1e-2)


def polyline(*points, close=True):
    return lambda space: space.add_lwpolyline(points, close=close)


@pytest.mark.parametrize(
    ("draw", "units"),
    [
        (lambda space: space.add_line((0, 0), (9, 9)), 4),
        (polyline((0, 0), (9, 0), (9, 9), close=False), 4),
        (polyline((0, 0), (9, 9), (9, 0), (0, 5)), 4),
        (lambda space: [space.add_circle((x, 0), 3) for x in (0, 9)], 4),
        (lambda space: space.add_circle((0, 0), 3), 18),
    ],
)
def test_drawings_that_are_no_outline_are_refused(tmp_path, draw, units):
    with pytest.raises(InputError, match=r"offcut\.dxf"):
        read_outline(drawn(tmp_path, draw, units=units))
