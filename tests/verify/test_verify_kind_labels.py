"""Any piece of a kind bears the same letters at the same place, whatever place it takes."""

import json

import numpy as np
import pytest

# A whole job stands behind it.
pytestmark = pytest.mark.slow

JOB = "shape:octahedron --size 200mm --refine catmull-clark:1 --labels kinds --effort quick"


def test_pieces_bear_their_kind_at_the_same_place(finished):
    folder = finished(*JOB.split())
    pieces = json.loads((folder / "crossing_map.json").read_text())["pieces"]
    kinds = {piece["kind"] for piece in pieces}
    assert len(kinds) < len(pieces) / 4
    assert any(piece.get("turned") for piece in pieces)
    for piece in pieces:
        assert {one["text"].rstrip("→") for one in piece["labels"]} == {f"K{piece['kind']}"}
        assert all(one["hidden"] for one in piece["labels"])
    # Told apart from how it was made: distances to the stations do not change with any motion.
    for kind in kinds:
        far = []
        for piece in (piece for piece in pieces if piece["kind"] == kind):
            label = piece["labels"][0]
            away = [
                np.hypot(one["x"] - label["x"], one["y"] - label["y"]) for one in piece["stations"]
            ]
            far.append(away[::-1] if piece.get("turned") else away)
        assert np.ptp(far, axis=0).max() < 2e-3
