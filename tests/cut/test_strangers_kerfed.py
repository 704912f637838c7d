"""MeerK40t cuts the sheets with kerf and micro-joints as wide of the pieces as we say."""

import json

import numpy as np
import pytest
import shapely
from strangers import INNER, OUTER, ask_meerk40t

from fabweave.cli.main import main

KERF, BRIDGES, BRIDGE = 0.2, 2, 2.0


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ready") / "job"
    options = ["--size", "90mm", "--effort", "quick", "--sheet", "230x225mm", "--template", "none"]
    ready = ["--kerf", f"{KERF}mm", "--micro-joints", f"{BRIDGES}:{BRIDGE}mm"]
    main(["make", "shape:octahedron", *options, *ready, "-q", "-o", str(folder)])
    return folder


@pytest.mark.parametrize("suffix", ["dxf", "svg"])
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
