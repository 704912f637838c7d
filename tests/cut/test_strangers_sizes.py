"""Strangers read files of 40 and 800 pieces: all formats, for makers and for services."""

from functools import cache

import numpy as np
import pyogrio
import pytest
import svgpathtools
from strangers import ENGRAVED, ask_meerk40t

from fabweave.cut.drawing import Circle, Layer, PieceDrawing, SheetDrawing
from fabweave.cut.write.dxf import DXF_VERSIONS, dxf_bytes
from fabweave.cut.write.svg import SVG_UNITS, svg_text

SIZES = (40, pytest.param(800, marks=pytest.mark.slow))
PROFILES = ("maker", "service")
#: Sizes and units that are read: the largest once, as the reader is slow.
READ = [
    *((40, units) for units in SVG_UNITS),
    pytest.param(800, "px96", marks=pytest.mark.slow),
]
#: Pieces of a row, and from piece to piece.
ROW, STEP = 5, (46.0, 22.0)
PIXELS_PER_MM = 96.0 / 25.4


@pytest.fixture(scope="module")
def sheet(make_piece, sheet_of):
    """Return a function that draws a sheet of so many pieces, or the first one for a service."""

    @cache
    def draw(count, profile):
        pieces = [
            make_piece(
                f"A{k + 1}",
                (8.0 + STEP[0] * (k % ROW), 20.0 + STEP[1] * (k // ROW)),
                length=40.0,
                amplitude=2.0 + k % 3,
                width=10.0 + k % 4,
                stations=10,
                holes=1 + k % 4,
            )
            for k in range(count)
        ]
        if profile == "service":
            cuts = (Layer.CUT_INNER, Layer.CUT_OUTER)
            bare = tuple(e for e in pieces[-1].entities if e.layer in cuts)
            low = bare[-1].points.min(axis=0)
            moved = tuple(
                Circle(e.layer, e.x - low[0], e.y - low[1], e.radius)
                if isinstance(e, Circle)
                else type(e)(e.layer, e.points - low, closed=True)
                for e in bare
            )
            size = np.ptp(bare[-1].points, axis=0).tolist()
            return SheetDrawing("kind", *size, (PieceDrawing("kind", moved),), ())
        return sheet_of(pieces, width=234.0, height=40.0 + STEP[1] * (-(-count // ROW)))

    return draw


@pytest.fixture(scope="module")
def written(sheet, tmp_path_factory):
    """Return a function that writes a sheet in a format, once."""

    @cache
    def write(count, profile, kind):
        drawing, plain = sheet(count, profile), profile == "service"
        path = tmp_path_factory.mktemp("sizes") / f"sheet.{'svg' if kind in SVG_UNITS else 'dxf'}"
        if kind in SVG_UNITS:
            path.write_bytes(svg_text(drawing, units=kind, plain=plain).encode())
        else:
            path.write_bytes(dxf_bytes(drawing, version=kind, plain=plain))
        return path

    return write


def entities(drawing, layer):
    return [e for piece in drawing.pieces for e in piece.entities if e.layer is layer]


def length(entity) -> float:
    """Return the length of an entity by its definition."""
    if isinstance(entity, Circle):
        return 2.0 * np.pi * entity.radius
    run = np.concatenate([entity.points, entity.points[:1]]) if entity.closed else entity.points
    return float(np.hypot(*np.diff(run, axis=0).T).sum())


def lengths(drawing) -> dict[Layer, tuple[int, float]]:
    """Return how many entities each layer has, and how long they are."""
    found = {layer: [length(e) for e in entities(drawing, layer)] for layer in Layer}
    return {layer: (len(values), sum(values)) for layer, values in found.items()}


@pytest.mark.parametrize("version", DXF_VERSIONS)
@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("count", SIZES)
def test_gdal_measures_the_dxf(sheet, written, count, profile, version) -> None:
    meta, _, shapes, columns = pyogrio.raw.read(written(count, profile, version))
    layer = np.array(columns[list(meta["fields"]).index("Layer")], dtype=str)
    lines = [_wkb(data) for data in shapes]
    told = lengths(sheet(count, profile))
    if profile == "service":
        # One layer, with what is cut and nothing else.
        assert set(layer) == {"0"}
        n_holes, holes = told[Layer.CUT_INNER]
        assert len(lines) == n_holes + 1
        assert sum(map(_measure, lines)) == pytest.approx(
            holes + told[Layer.CUT_OUTER][1], rel=1e-3
        )
    else:
        for one in (Layer.CUT_INNER, Layer.CUT_OUTER, Layer.ENGRAVE_LABEL, Layer.ENGRAVE_MARK):
            own = [line for line, name in zip(lines, layer, strict=True) if name == one.value]
            assert len(own) == told[one][0]
            assert sum(map(_measure, own)) == pytest.approx(told[one][1], rel=1e-3)
    cut = [line for line, name in zip(lines, layer, strict=True) if name in ("0", "CUT_OUTER")]
    outer = entities(sheet(count, profile), Layer.CUT_OUTER)
    for corner in (np.min, np.max):
        measured = corner(np.concatenate(cut), axis=0)
        assert measured == pytest.approx(
            corner(np.concatenate([e.points for e in outer]), axis=0), abs=1e-3
        )
    # What is cut is closed.
    assert all(np.allclose(line[0], line[-1], atol=1e-6) for line in cut)


def _wkb(data: bytes) -> np.ndarray:
    """Return the points of a line in well-known binary form, x and y."""
    kind, count = np.frombuffer(data, "<u4", 2, offset=1).tolist()
    wide = 3 if kind >= 1000 or kind & 0x80000000 else 2
    return np.frombuffer(data, "<f8", count * wide, offset=9).reshape(-1, wide)[:, :2]


def _measure(points) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(("count", "units"), READ)
def test_svgpathtools_measures_the_svg(sheet, written, count, profile, units) -> None:
    paths, looks = svgpathtools.svg2paths(str(written(count, profile, units)))
    scale = 1.0 if units == "mm" else PIXELS_PER_MM
    told = lengths(sheet(count, profile))
    outer = [p for p, look in zip(paths, looks, strict=True) if look["id"].endswith(".outline")]
    inner = [p for p, look in zip(paths, looks, strict=True) if ".hole." in look["id"]]
    for found, layer in ((outer, Layer.CUT_OUTER), (inner, Layer.CUT_INNER)):
        assert len(found) == told[layer][0]
        assert sum(p.length() for p in found) / scale == pytest.approx(told[layer][1], rel=1e-3)
    if profile == "service":
        assert len(paths) == len(outer) + len(inner)
        assert {look["stroke"] for look in looks} == {"#FF0000"}
    left, right, top, bottom = (np.array([p.bbox() for p in outer]) / scale).T
    points = np.concatenate([e.points for e in entities(sheet(count, profile), Layer.CUT_OUTER)])
    height = sheet(count, profile).height_mm
    assert (left.min(), right.max()) == pytest.approx((points[:, 0].min(), points[:, 0].max()))
    expected = (height - points[:, 1].max(), height - points[:, 1].min())
    assert (top.min(), bottom.max()) == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["R2010", "px96"])
@pytest.mark.parametrize("profile", PROFILES)
def test_meerk40t_cuts_as_long_as_we_say(sheet, written, profile, kind, tmp_path) -> None:
    found = ask_meerk40t(written(40, profile, kind), tmp_path)
    told = lengths(sheet(40, profile))
    n_cuts = told[Layer.CUT_INNER][0] + told[Layer.CUT_OUTER][0]
    wanted = told[Layer.CUT_INNER][1] + told[Layer.CUT_OUTER][1]
    if profile == "service":
        # Every line that it finds is a cut, under whatever one operation.
        assert sum(found.assigned) == n_cuts == found.added
        assert sum(burn.length for burn in found.burns) == pytest.approx(wanted, rel=1e-3)
        return
    assert found.assigned[1:] == (told[Layer.CUT_INNER][0], told[Layer.CUT_OUTER][0])
    cut = sum(burn.length for burn in found.burns if burn.power != ENGRAVED)
    assert cut == pytest.approx(wanted, rel=1e-3)
