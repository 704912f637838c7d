"""The picture of losses is coloured where something was lost, and says what the colours mean."""

import numpy as np

from fabweave.core.colour_space import light_of, oklab_of
from fabweave.mesh.likeness import LossMap, loss_map
from fabweave.mesh.shapes import grids
from fabweave.picture.camera import View
from fabweave.picture.object_picture import (
    loss_colours,
    loss_tiles,
)

BALL = grids.sphere(12, 50.0)


def spiked():
    """Return a ball with a spike to the right."""
    points = BALL.vertices.copy()
    points[np.argmax(points[:, 0])] *= 1.8
    return BALL.with_vertices(points)


def coloured(picture):
    """Return where a picture is red or yellow rather than grey or white."""
    pixels = np.asarray(picture).astype(int)
    return pixels[..., 0] - pixels[..., 2] > 70


def test_more_is_darker_and_all_beyond_the_end_is_alike():
    lost = np.linspace(0.0, 30.0, 200)
    row = LossMap(np.eye(3), np.tile([0, 1, 2], (200, 1)), lost, 400.0)
    colours = loss_colours(row)
    lightness = oklab_of(light_of(colours))[:, 0]
    assert np.all(np.diff(lightness[lost <= 20.0]) <= 2e-3)
    assert lightness[0] - lightness[-1] > 0.5
    assert len(np.unique(colours[lost >= 20.0], axis=0)) == 1


def test_what_is_kept_is_grey_and_a_lost_spike_is_coloured():
    front = View(-90.0, 0.0)
    same = loss_tiles(loss_map(BALL, BALL), front, (120, 90))
    assert not coloured(same).any()
    both = coloured(loss_tiles(loss_map(spiked(), BALL), front, (120, 90)))
    tile, behind = both[:, :120], both[:, 120:]
    assert tile.any()
    assert behind.any()
    # The spike points to the right, where the picture of the ball ends.
    assert np.nonzero(tile)[1].min() > 60
    assert np.nonzero(behind)[1].max() < 60
