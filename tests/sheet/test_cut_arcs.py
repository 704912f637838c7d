"""Arcs in the files: strangers read the same lengths, areas and sides of the chord."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import shapely
from ezdxf import path as ezpath

from fabweave.estimate.waste import length_mm
from fabweave.piece.outline import fit_paths
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.write.dxf import DXF_VERSIONS, dxf_bytes, extents
from fabweave.sheet.write.svg import SVG_UNITS, svg_text

SVG = "{http://www.w3.org/2000/svg}"


def band(shift, waves):
    """A fine polygon around a wavy band."""
    x = np.linspace(0.0, 120.0, 200)
    y = 9.0 * np.sin(waves * x / 20.0)
    low, high = np.stack([x, y], axis=1), np.stack([x, y + 11.0], axis=1)
    return np.concatenate([low, high[::-1]]) + shift


RINGS = [band((12.0, 20.0), 1.0), band((15.0, 60.0), 1.7), band((60.0, 95.0), 0.4)]
PATHS = fit_paths(RINGS, 0.02)


@pytest.fixture(scope="module")
def bent():
    """A sheet with three pieces of arcs, one with an arc for a mark."""
    pieces = [
        PieceDrawing(f"A{k}", (Polyline(Layer.CUT_OUTER, path.points, True, path.bulges),))
        for k, path in enumerate(PATHS, start=1)
    ]
    mark = Polyline(
        Layer.ENGRAVE_MARK, np.array([[20.0, 26.0], [24.0, 26.0]]), False, np.array([0.5, 0.0])
    )
    pieces[0] = PieceDrawing("A1", (mark, *pieces[0].entities))
    return SheetDrawing("sheet_01", 220.0, 140.0, tuple(pieces), ())


def for_service(sheet):
    """Return what is cut of a sheet, and nothing else."""
    pieces = [replace(piece, entities=piece.entities[-1:]) for piece in sheet.pieces]
    return replace(sheet, pieces=tuple(pieces))


def svg_root(text):
    return ET.fromstring(text)  # noqa: S314 - we wrote it


def outlines(sheet):
    return [piece.entities[-1] for piece in sheet.pieces]


def test_the_sheet_has_arcs_of_both_kinds(bent):
    bulges = np.concatenate([line.bulges for line in outlines(bent)])
    assert np.count_nonzero(bulges > 0.01) >= 8
    assert np.count_nonzero(bulges < -0.01) >= 8


def flattened_by_ezdxf(entity):
    return np.array([(p.x, p.y) for p in ezpath.make_path(entity).flattening(1e-4)])


@pytest.mark.parametrize("version", DXF_VERSIONS)
def test_ezdxf_measures_our_arcs(bent, version, tmp_path):
    (tmp_path / "a.dxf").write_bytes(dxf_bytes(bent, version=version))
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert not document.audit().errors
    read = list(document.modelspace())
    kind = "POLYLINE" if version == "R12" else "LWPOLYLINE"
    assert [entity.dxftype() for entity in read] == [kind] * 4
    cut = [entity for entity in read if entity.dxf.layer == "CUT_OUTER"]
    for entity, path, ring in zip(cut, PATHS, RINGS, strict=True):
        assert entity.is_closed
        dense = flattened_by_ezdxf(entity)
        line = shapely.LineString(dense)
        assert line.length == pytest.approx(path.length, rel=1e-5)
        assert shapely.Polygon(dense).area == pytest.approx(path.area, rel=1e-5)
        assert shapely.hausdorff_distance(line, shapely.LinearRing(ring), 0.2) < 0.021
    whole = sum(shapely.LineString(flattened_by_ezdxf(entity)).length for entity in read)
    entities = [entity for piece in bent.pieces for entity in piece.entities]
    assert length_mm(entities) == pytest.approx(whole, rel=1e-5)


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("units", SVG_UNITS)
def test_svgpathtools_measures_our_arcs(bent, units, plain, tmp_path):
    svgpathtools = pytest.importorskip("svgpathtools")
    bent = for_service(bent) if plain else bent
    (tmp_path / "a.svg").write_bytes(svg_text(bent, units=units, plain=plain).encode())
    scale = 1.0 if units == "mm" else 25.4 / 96.0
    elements = {
        element.get("id"): element.get("d")
        for element in svg_root((tmp_path / "a.svg").read_text()).iter(f"{SVG}path")
    }
    assert len(elements) == (3 if plain else 4)
    for k, (path, ring) in enumerate(zip(PATHS, RINGS, strict=True), start=1):
        read = svgpathtools.parse_path(elements[f"A{k}.outline"])
        assert read.isclosed()
        assert read.iscontinuous()
        assert len(read) == len(path.points)
        arcs = [isinstance(side, svgpathtools.Arc) for side in read]
        assert arcs == (path.bulges != 0.0).tolist()
        length = sum(
            abs(side.delta) * np.pi / 180.0 * side.radius.real if arc else side.length()
            for side, arc in zip(read, arcs, strict=True)
        )
        assert length * scale == pytest.approx(path.length, rel=1e-5)
        dense = np.array([side.point(t) for side in read for t in np.linspace(0.0, 1.0, 40)])
        points = np.stack([dense.real * scale, bent.height_mm - dense.imag * scale], axis=1)
        assert shapely.Polygon(points).area == pytest.approx(path.area, rel=1e-4)
        distance = shapely.distance(shapely.points(points), shapely.LinearRing(ring))
        assert distance.max() < 0.021


@pytest.mark.parametrize("plain", [False, True])
def test_gdal_measures_our_arcs(bent, plain, tmp_path):
    pyogrio = pytest.importorskip("pyogrio")
    bent = for_service(bent) if plain else bent
    (tmp_path / "a.dxf").write_bytes(dxf_bytes(bent, plain=plain))
    # GDAL takes chords of four degrees where it is told nothing.
    pyogrio.set_gdal_config_options({"OGR_ARC_STEPSIZE": 0.5})
    _, _, shapes, values = pyogrio.raw.read(tmp_path / "a.dxf", columns=["Layer"])
    pyogrio.set_gdal_config_options({"OGR_ARC_STEPSIZE": None})
    read = [
        shapely.from_wkb(shape)
        for shape, layer in zip(shapes, values[0], strict=True)
        if layer == ("0" if plain else "CUT_OUTER")
    ]
    assert len(read) == 3
    assert len(shapes) == (3 if plain else 4)
    for line, path in zip(read, PATHS, strict=True):
        ring = shapely.get_coordinates(line)[:, :2]
        assert np.array_equal(ring[0], ring[-1])
        assert shapely.Polygon(ring).area == pytest.approx(path.area, rel=1e-4)
        assert shapely.length(line) == pytest.approx(path.length, rel=1e-4)


def test_the_extents_hold_arcs_that_leave_the_sheet():
    arc = Polyline(Layer.NOTES, np.array([[0.0, 0.0], [10.0, 0.0]]), False, np.array([0.8, 0.0]))
    low, _ = extents(SheetDrawing("s", 20.0, 20.0, (), (arc,)))
    assert low.tolist() == pytest.approx([0.0, -4.0], abs=0.011)
