"""Make the pictures of the steps: what is new in large, and where it is on the whole object."""

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np

from fabweave.assembly.manual.marks import Drawn, Mark, Places, Slide, new_mark, on_page
from fabweave.assembly.manual.painting import (
    POINTS_PX,
    PX_MM,
    Painted,
    Palette,
    make_palette,
    paint,
)
from fabweave.assembly.manual.scene import Scene
from fabweave.assembly.manual.views import VIEWS, views_of_steps
from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.flat.crossing_map import CrossingMap
from fabweave.picture.camera import Frame, View

#: Sizes of pictures in points: of the whole object, and of what is new, wide or tall.
WHOLE, WIDE, TALL = (254.0, 134.0), (254.0, 130.0), (150.0, 138.0)
#: What is new keeps so far from the border of its picture, in points: there is room for names.
_ROOM = 15.0
#: An object is drawn so many times smaller than it is, at the least and further on.
_SCALES = (
    *(1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.25, 2.5, 2.75, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0),
    *(7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0),
)
#: The steps of about so many pieces share a picture of the whole object.
_MOST_PIECES = 9
_MM_POINTS = 25.4 / 72.0


@frozen_value
class StepPicture:
    """The picture of a step: what is new in large.

    Parameters
    ----------
    painted : Painted
    size : tuple of float
        Its width and height in points.
    view : View
    ratio : float
        How many times smaller it is drawn than it is.
    marks : tuple of Mark
    crossings : (N, 2) float array
        The crossings and joints of the step, which no name may cover.
    radius : float
        How far each of them reaches.
    ends : tuple of (N, 2, 2) float arrays
        For each new piece both ends of its rungs.
    fasten : (N, 2) float array
        The crossings that are complete now.
    slides : tuple of Slide
    """

    painted: Painted
    size: tuple[float, float]
    view: View
    ratio: float
    marks: tuple[Mark, ...]
    crossings: FloatArray
    radius: float
    ends: tuple[FloatArray, ...]
    fasten: FloatArray
    slides: tuple[Slide, ...]


@frozen_value
class WholePicture:
    """The picture of the whole object after some steps.

    Parameters
    ----------
    painted : Painted
    marks : tuple of Mark
        The new pieces.
    bands : (N, 2) float array
        Places on them.
    view : View
    turned : bool
        Whether it is another view than that of the steps before.
    steps : tuple of StepPicture
        The pictures of those steps.
    """

    painted: Painted
    marks: tuple[Mark, ...]
    bands: FloatArray
    view: View
    turned: bool
    steps: tuple[StepPicture, ...]


def step_pictures(scene: Scene, crossing_map: CrossingMap) -> list[WholePicture]:
    """Make the pictures of all steps.

    What is in place is pale and what is new is dark, each in its own colour, and views are chosen
    so that new pieces are seen and the object is turned seldom: the sequence of least cost, found
    exactly.

    Parameters
    ----------
    scene : Scene
    crossing_map : CrossingMap
        With steps.

    Returns
    -------
    list of WholePicture
        Of all steps together, in order.
    """
    palette, drawn = make_palette(scene.colours), Drawn(scene, crossing_map)
    chosen = views_of_steps(scene).tolist()
    pictures: list[WholePicture] = []
    for number, run in groupby(range(scene.n_steps), key=lambda at: chosen[at]):
        view = VIEWS[number]
        for part, own in enumerate(_parted(list(run), crossing_map)):
            turned = part == 0 and own[0] > 0
            details = tuple(_detail(drawn, palette, view, at) for at in own)
            pictures.append(WholePicture(*_whole(drawn, palette, view, own), view, turned, details))
    return pictures


def _parted(run: Sequence[int], crossing_map: CrossingMap) -> list[list[int]]:
    """Part steps that are seen from one side into those that share a picture of the object.

    They are shared out evenly, by their pieces.
    """
    counts = [len(crossing_map.steps[at].pieces) for at in run]
    share = sum(counts) / max(math.ceil(sum(counts) / _MOST_PIECES), 1)
    parts: dict[int, list[int]] = {}
    before = 0
    for at, count in zip(run, counts, strict=True):
        parts.setdefault(int(before / share), []).append(at)
        before += count
    return list(parts.values())


def _whole(
    drawn: Drawn, palette: Palette, view: View, steps: Sequence[int]
) -> tuple[Painted, tuple[Mark, ...], FloatArray]:
    """Return the picture of the whole object after some steps, what is new, and where it is."""
    frame = drawn.scene.frame(view, _pixels(WHOLE))
    painted, _, piece = paint(
        drawn.scene, palette, frame, steps[-1], steps[0], coming=steps[0] == 0
    )
    new = [number for step in steps for number in drawn.new(step)]
    lines = np.concatenate([drawn.scene.middle_line(number) for number in new])
    marks = tuple(new_mark(drawn, frame, piece, number) for number in new)
    return painted, marks, on_page(frame.pixels(lines), frame)


def _detail(drawn: Drawn, palette: Palette, view: View, at: int) -> StepPicture:
    """Return the picture of a step in large."""
    scene, step = drawn.scene, drawn.steps[at]
    ends = [scene.rung_ends(number) for number in drawn.new(at)]
    ratio, size, frame = _window(np.concatenate(ends).reshape(-1, 3), view)
    painted, near, piece = paint(scene, palette, frame, at, at, coming=False)
    places = Places(drawn, frame, near, at)
    marks = [
        *(new_mark(drawn, frame, piece, number) for number in drawn.new(at)),
        *places.neighbours(step),
        *places.joints(step),
    ]
    spots = [places.middle(key) for key in dict.fromkeys((*step.over, *step.under))]
    spots += [places.middle(drawn.joints[key].crossing) for key in step.joints]
    fasten = [places.middle(key) for key in step.fasten if key not in drawn.idle]
    wide = np.concatenate(ends)
    half = float(np.median(np.linalg.norm(wide[:, 0] - wide[:, 1], axis=1))) / 2.0
    return StepPicture(
        painted,
        size,
        view,
        ratio,
        tuple(marks),
        np.array(spots).reshape(-1, 2),
        half * frame.pixels_per_mm * POINTS_PX,
        tuple(on_page(frame.pixels(one.reshape(-1, 3)), frame).reshape(-1, 2, 2) for one in ends),
        np.array(fasten).reshape(-1, 2),
        tuple(places.slides(step)),
    )


def _window(points: FloatArray, view: View) -> tuple[float, tuple[float, float], Frame]:
    """Return how many times smaller points are drawn, the size of their picture, and its frame.

    Of a wide and of a tall picture that is taken which shows them larger.
    """
    axes = view.axes()
    across = points @ axes[:2].T
    low, high = across.min(axis=0), across.max(axis=0)
    options = []
    for size in (WIDE, TALL):
        room = (np.array(size) - 2.0 * _ROOM) * _MM_POINTS
        needed = float(np.max((high - low) / room))
        ratio = next((one for one in _SCALES if one >= needed), float(np.ceil(needed)))
        options.append((ratio, size))
    ratio, size = min(options, key=lambda option: option[0])
    width, height = _pixels(size)
    scale = PX_MM / ratio
    middle = (low + high) / 2.0 * scale
    left, top = float(width / 2.0 - middle[0]), float(height / 2.0 + middle[1])
    return ratio, size, Frame(width, height, axes, scale, left, top)


def _pixels(size: tuple[float, float]) -> tuple[int, int]:
    """Return the pixels of a picture of a size in points."""
    return round(size[0] / POINTS_PX), round(size[1] / POINTS_PX)
