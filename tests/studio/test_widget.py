"""The notebook's widget: its options are traits, and a tap tells the piece."""

import numpy as np
import pytest
from live_studio import unpacked

import fabweave as fw
from fabweave.job.stations import Stations

traitlets = pytest.importorskip("traitlets")
pytest.importorskip("anywidget")

TORUS = "shape:torus?m=8&n=4"


@pytest.fixture
def widget():
    return fw.weave(TORUS, size="200mm").ribbons().widget()


def positions(widget):
    return unpacked(widget.data)["position"]


def test_an_option_that_is_set_is_the_object_that_is_seen(widget):
    first = positions(widget)
    widget.width = "even,5mm"
    woven = Stations.read(TORUS, {"size": "200mm", "width": "even,5mm"}).clear_ribbons
    corners = positions(widget).reshape(-1, 2, 3)
    assert np.abs(corners[:, 0] - woven.ribbons.right).max() < 1e-3
    assert len(first) == len(corners.ravel())
    assert np.abs(first - corners.ravel()).max() > 1.0
    widget.pattern = "twill"
    assert widget.stations.asked.weave.pattern == "twill"
    # What was set before stays.
    assert str(widget.stations.asked.ribbons.width) == "even,5mm"


def test_what_makes_no_sense_is_refused_and_changes_nothing(widget):
    before = widget.data
    for name, value in (("pattern", "knitted"), ("width", "wide"), ("colours", "no such")):
        was = getattr(widget, name)
        with pytest.raises(traitlets.TraitError, match=value):
            setattr(widget, name, value)
        assert getattr(widget, name) == was
    assert widget.data == before


def test_a_tap_tells_the_piece_that_is_there(widget):
    widget.rung = 5
    told, pieces = unpacked(widget.data), widget.stations.planned.piece_set.pieces
    assert pieces[told["owner"][5]].id == widget.piece
    assert widget.chosen == told["owner"][5]
    widget.colours = "direction"
    assert (widget.piece, widget.chosen) == ("", -1)
