"""Choose from where each step is seen: what is new shows, and the object is turned seldom."""

import math

import numpy as np

from fabweave.assembly.manual.scene import Scene
from fabweave.core.arrays import FloatArray, IntArray
from fabweave.picture.camera import Frame, View
from fabweave.picture.zbuffer import all_fragments

#: From where steps may be seen: around at three heights, and from straight above and below; the
#: first is the usual place.
VIEWS = (
    *(View(-60.0 + 45.0 * turn, rise) for rise in (35.0, -35.0, 0.0) for turn in range(8)),
    View(-60.0, 85.0),
    View(-60.0, -85.0),
)
#: Pixels of the pictures by which views are compared.
_TRIAL_PX = (180, 140)
#: Prices of a turn, where a view in which nothing new is seen costs 1: the least counts with which
#: the object is turned in no more than this share of the steps.
_TURNS, MOST_TURNS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3, 2.0, 4.0, 9.0), 1 / 8
#: A view that shows less than this share of what the best one shows costs up to so much more.
_LITTLE, _POOR = 0.35, 2.0
#: What a view costs in which a new piece cannot be seen at all, besides.
_BLIND = 5.0
_SIDES = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")


def views_of_steps(scene: Scene) -> IntArray:
    """Return the number of the view of each step: the object is turned in an eighth of them."""
    seen = seen_from_views(scene)
    chosen = np.zeros(0, dtype=np.int64)
    for turn in _TURNS:
        chosen = choose_views(seen[:, :, 0], seen[:, :, 1], turn)
        if np.count_nonzero(np.diff(chosen)) <= MOST_TURNS * len(chosen):
            break
    return chosen


def seen_from_views(scene: Scene) -> FloatArray:
    """Return what each view shows of each step's new pieces: of the least seen, and of all.

    Returns
    -------
    (V, S, 2) float array
        In pixels of small pictures, when the step is done.
    """
    return np.array([_seen(scene, view) for view in VIEWS])


def choose_views(least: FloatArray, total: FloatArray, turn: float) -> IntArray:
    """Choose a view for each step so that new pieces are seen and few steps turn the object.

    Parameters
    ----------
    least : (V, S) float array
        For each view and step, how much is seen of the new piece that is seen least.
    total : (V, S) float array
        How much is seen of all new pieces.
    turn : float
        The price of a turn.

    Returns
    -------
    (S,) int array
        The sequence of views with the least sum of what is not seen, as the square of its share
        of the most that any view shows, more where little is seen, and of the prices of all
        turns.

    Examples
    --------
    >>> seen = np.array([[9.0, 8.0, 0.0, 9.0], [5.0, 9.0, 9.0, 8.0]])
    >>> choose_views(seen, seen, 0.1).tolist(), choose_views(seen, seen, 0.5).tolist()
    ([0, 1, 1, 1], [1, 1, 1, 1])
    """
    worth = least + 0.1 * total
    share = worth / np.maximum(worth.max(axis=0), 1e-9)
    lost = (1.0 - share) ** 2 + _POOR * np.maximum(1.0 - share / _LITTLE, 0.0)
    lost = lost + _BLIND * ((least <= 0.0) & (least.max(axis=0) > 0.0))
    n_views, n_steps = lost.shape
    best = np.zeros((n_steps, n_views), dtype=np.int64)
    cost = lost[:, 0]
    for step in range(1, n_steps):
        other = int(np.argmin(cost))
        turns = cost[other] + turn < cost
        best[step] = np.where(turns, other, np.arange(n_views))
        cost = np.where(turns, cost[other] + turn, cost) + lost[:, step]
    chosen = np.empty(n_steps, dtype=np.int64)
    chosen[-1] = int(np.argmin(cost))
    for step in range(n_steps - 1, 0, -1):
        chosen[step - 1] = best[step, chosen[step]]
    return chosen


def _seen(scene: Scene, view: View) -> FloatArray:
    """Return what a view shows of each step's new pieces, (S, 2): of the least seen, of all."""
    triangle = _first_seen(scene, scene.frame(view, _TRIAL_PX))
    area = np.bincount(scene.piece[triangle], minlength=len(scene.step_of_piece)).astype(float)
    least = np.full(scene.n_steps, np.inf)
    np.minimum.at(least, scene.step_of_piece, area)
    return np.column_stack((least, np.bincount(scene.step_of_piece, area, scene.n_steps)))


def _first_seen(scene: Scene, frame: Frame) -> IntArray:
    """Return the triangle of everything that is seen when it is placed, once for each pixel.

    Of the layers at a pixel those count that are nearer than all that came before them.
    """
    triangle, pixel, near = all_fragments(
        frame.pixels(scene.points), scene.triangles, width=frame.width_px, height=frame.height_px
    )
    if not len(near):
        return triangle
    share = (near - near.min()) / max(float(np.ptp(near)), 1e-9)
    # Pixel, step and nearness in one number: a quarter of the time of sorting by each in turn.
    place = pixel * (int(scene.step.max()) + 1) + scene.step[triangle]
    bits = 62 - int(place.max()).bit_length()
    order = np.argsort(
        (place << bits) + ((1.0 - share) * 2.0**bits).astype(np.int64), kind="stable"
    )
    triangle, pixel, share = triangle[order], pixel[order], share[order]
    # Each pixel has a range of its own, so one running maximum serves them all.
    level = np.maximum.accumulate(share + 2.0 * pixel)
    wins = np.flatnonzero(share + 2.0 * pixel > np.concatenate(([-1.0], level[:-1])))
    return np.asarray(triangle[wins])


def side_words(view: View) -> str:
    """Say from where something is seen.

    Examples
    --------
    >>> side_words(View(-60.0, 35.0)), side_words(View(180.0, 0.0)), side_words(View(0.0, -85.0))
    ('the front right and above', 'the left', 'straight below')
    """
    high = "above" if view.elevation_deg > 0 else "below"
    if abs(view.elevation_deg) > 60.0:
        return f"straight {high}"
    side = _SIDES[math.floor((view.azimuth_deg + 90.0) / 45.0 + 0.5) % 8]
    return f"the {side}" + (f" and {high}" if view.elevation_deg else "")
