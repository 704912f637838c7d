"""MeerK40t cuts the sheets with kerf and micro-joints as wide of the pieces as we say."""

import json

import numpy as np
import pytest
import shapely
from jobs import OCTAHEDRON
from strangers import INNER, OUTER, ask_meerk40t

KERF, BRIDGES, BRIDGE = 0.2, 2, 2.0


@pytest.fixture(scope="module")
def job(finished):
    ready = ("--kerf", f"{KERF}mm", "--micro-joints", f"{BRIDGES}:{BRIDGE}mm")
    return finished(*OCTAHEDRON, "--template", "none", *ready)


@pytest.mark.parametrize("suffix", [pytest.param("dxf", marks=pytest.mark.slow), "svg"])
def test_the_beam_keeps_half_the_kerf_off_and_stops_at_bridges(job, suffix, tmp_path):
    found = ask_meerk40t(job / "cut" / f"sheet_01_kerf0.2mm_micro2x2mm.{suffix}", tmp_path)
    pieces = json.loads((job / "crossing_map.json").read_text(encoding="utf-8"))["pieces"]
    holes = [s["hole_mm"] for piece in pieces for s in piece["stations"] if s["hole_mm"]]
    n_runs = BRIDGES * len(pieces)
    assert found.assigned[1:] == (len(holes), n_runs)
    length = {p: sum(b.length for b in found.burns if b.power == p) for p in (INNER, OUTER)}
    assert length[INNER] == pytest.approx(np.pi * (sum(holes) - KERF * len(holes)), rel=3e-3)
    around = sum(
        shapely.Polygon(piece["outline"]).buffer(KERF / 2, join_style="mitre").length
        for piece in pieces
    )
    assert length[OUTER] == pytest.approx(around - n_runs * (BRIDGE + KERF), rel=1e-3)
    # The nominal sheet would differ by far more than that.
    nominal = sum(shapely.Polygon(piece["outline"]).length for piece in pieces)
    assert abs(length[OUTER] - nominal) > 5e-3 * nominal
