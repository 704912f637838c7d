"""Unfold each piece's part of the model and lay it on the piece."""

from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.geometry import Motion, Steps, fit_most, lay_steps, panel_bounds, unfold
from fabweave.verify.read_glb import Strip
from fabweave.verify.threads import station_run


@dataclass(frozen=True, eq=False)
class Developed:
    """A piece's part of the model, unfolded and laid on the piece.

    Parameters
    ----------
    rungs : (N, 2, 2) float array
        Right and left ends of its rungs in the piece's coordinates.
    panels : (S, 4, 2) float array
        Corners of the crossing panel of each station: entry right, left, exit right, left.
    slack_mm : float
        What the model's rounding to 32 bits may have added to any deviation.
    """

    rungs: Floats
    panels: Floats
    slack_mm: float

    @property
    def stations(self) -> Floats:
        """The middle of each panel, (S, 2)."""
        return np.asarray(self.panels.mean(axis=1))

    @property
    def outline(self) -> Floats:
        """The rails as one ring: along the right one and back along the left one."""
        return np.concatenate([self.rungs[:, 0], self.rungs[::-1, 1]])


def develop_pieces(plan: CrossingMap, model: dict[str, Strip]) -> dict[str, Developed]:
    """Unfold each piece's part of the model and lay it on the piece without reflection.

    A piece whose stations are no run of its thread is left out.
    """
    laid: dict[str, Steps] = {}
    result = {}
    for piece in plan.pieces:
        thread = plan.thread.get(piece.thread)
        strip = model.get(thread.label) if thread is not None else None
        if thread is None or strip is None or strip.closed != thread.closed:
            continue
        if len(strip.entry) != len(thread.crossings):
            continue
        start = station_run(thread, piece)
        if start is None:
            continue
        if thread.label not in laid:
            laid[thread.label] = lay_steps(strip)
        result[piece.id] = _develop(piece, strip, laid[thread.label], start)
    return result


def _develop(piece: Piece, strip: Strip, steps: Steps, start: int) -> Developed:
    """Unfold one piece and lay it on itself by its stations."""
    begin, end = panel_bounds(strip, start, len(piece.stations))
    first = int(begin[0])
    last = int(end[-1])
    # The ends of an open thread reach beyond their last crossing.
    if not strip.closed and start == 0:
        first = 0
    if not strip.closed and start + len(piece.stations) == len(strip.entry):
        last = len(strip.rungs) - 1
    rungs = unfold(strip, steps, first, last)
    panels = np.concatenate([rungs[begin - first], rungs[end - first]], axis=1)
    stations = np.array([(station.x, station.y) for station in piece.stations])
    flat = panels.mean(axis=1)
    motion = fit_most(flat, stations)
    if len(stations) < 2:
        motion = _turn_by_outline(rungs, flat[0], piece)
    width = float(np.min(np.hypot(*(rungs[:, 1] - rungs[:, 0]).T)))
    length = float(np.sum(np.hypot(*np.diff(rungs.mean(axis=1), axis=0).T)))
    # Each rung's direction is uncertain by about grain / width; the errors walk at random.
    slack = strip.grain_mm * (1.0 + np.sqrt(len(rungs)) * length / max(2.0 * width, 1e-9))
    return Developed(
        rungs=motion.apply(rungs.reshape(-1, 2)).reshape(rungs.shape),
        panels=motion.apply(panels.reshape(-1, 2)).reshape(panels.shape),
        slack_mm=float(slack),
    )


def _turn_by_outline(rungs: Floats, middle: Floats, piece: Piece) -> Motion:
    """Lay a piece with one station: among turns that bring a corner onto a vertex, the best."""
    station = complex(piece.stations[0].x, piece.stations[0].y)
    ring = np.concatenate([rungs[:, 0], rungs[::-1, 1]])
    arms = (ring[:, 0] + 1j * ring[:, 1]) - complex(*middle)
    goals = (piece.outline[:, 0] + 1j * piece.outline[:, 1]) - station
    corners = arms[np.argsort(-np.abs(arms), kind="stable")[:4]]
    turns = (goals[:, None] / corners[None, :]).ravel()
    turns = turns[np.abs(turns) > 0.0]
    turns = turns / np.abs(turns)
    border = shapely.LinearRing(piece.outline)
    moved = turns[:, None] * arms[None, :] + station
    misses = shapely.distance(shapely.points(moved.real, moved.imag), border).max(axis=1)
    turn = complex(turns[int(np.argmin(misses))])
    return Motion(turn, station - turn * complex(*middle))
