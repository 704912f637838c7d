"""Unfold each piece's part of the model and lay it on the piece."""

from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.ends import Reach, cut_rungs, reaches
from fabweave.verify.measure.geometry import (
    Motion,
    Steps,
    fit_most,
    lay_steps,
    panel_bounds,
    unfold,
)
from fabweave.verify.measure.threads import station_run
from fabweave.verify.read.glb import Strip

#: A direction is unsure by so many times the coordinates' rounding over its length.
_DOUBT = 4.0


@dataclass(frozen=True, eq=False)
class Development:
    """A piece's part of the model, unfolded and laid on the piece.

    Parameters
    ----------
    rungs : (N, 2, 2) float array
        Right and left ends of its rungs in the piece's coordinates.
    panels : (S, 4, 2) float array
        Corners of the crossing panel of each station: entry right, left, exit right, left.
    space : (S, 4, 3) float array
        The same corners in the model.
    window : (N, 2, 2) float array
        The rungs from the panel before the piece to the panel after it, as far as there are any.
    slack_mm : float
        What the model's rounding to 32 bits may have added to any deviation.
    """

    rungs: Floats
    panels: Floats
    space: Floats
    window: Floats
    slack_mm: float

    @property
    def stations(self) -> Floats:
        """The middle of each panel, (S, 2)."""
        return np.asarray(self.panels.mean(axis=1))

    @property
    def outline(self) -> Floats:
        """The rails as one ring: along the right one and back along the left one."""
        return np.concatenate([self.rungs[:, 0], self.rungs[::-1, 1]])


def develop_thread(strip: Strip) -> Floats:
    """Return the rungs of a whole ribbon unfolded, (R, 2, 2); a ring ends with its first again."""
    count = len(strip.rungs)
    return unfold(strip, lay_steps(strip), 0, count if strip.closed else count - 1)


def total_turn_deg(strip: Strip) -> tuple[float, float]:
    """Return by how much the middle line of an unfolded ribbon turns, to both sides together.

    The other number is what the model's rounding may have done to that.
    """
    rungs = develop_thread(strip)
    middle = rungs.mean(axis=1) @ np.array([1.0, 1.0j])
    heading = np.diff(middle)
    turns = heading[1:] * heading[:-1].conj()
    if strip.closed and len(heading):
        # Where the ends of a ring come together, its first rung and its last are one.
        across = (rungs[[0, -1], 1] - rungs[[0, -1], 0]) @ np.array([1.0, 1.0j])
        seam = (heading[0] / across[0]) * (heading[-1] / across[1]).conj()
        turns = np.append(turns, seam)
    doubt = strip.grain_mm * float(np.sum(1.0 / np.abs(heading)))
    return float(np.degrees(np.abs(np.angle(turns)).sum())), float(np.degrees(_DOUBT * doubt))


def develop_pieces(plan: CrossingMap, model: dict[str, Strip]) -> dict[str, Development]:
    """Unfold each piece's part of the model and lay it on the piece without reflection.

    A piece whose stations are no run of its thread is left out.
    """
    steps_of: dict[str, Steps] = {}
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
        if thread.label not in steps_of:
            steps_of[thread.label] = lay_steps(strip)
        result[piece.id] = _develop(
            piece, strip, steps_of[thread.label], start, reaches(plan, piece)
        )
    return result


def _develop(
    piece: Piece, strip: Strip, steps: Steps, start: int, ends: tuple[Reach, Reach]
) -> Development:
    """Unfold one piece and lay it on itself by its stations."""
    begin, end = panel_bounds(strip, start, len(piece.stations))
    first = int(begin[0])
    last = int(end[-1])
    # The ends of an open thread reach beyond their last crossing.
    if not strip.closed and start == 0:
        first = 0
    if not strip.closed and start + len(piece.stations) == len(strip.entry):
        last = len(strip.rungs) - 1
    # Laps may go on to the panels before and after.
    size, count = len(strip.entry), len(strip.rungs)
    final = start + len(piece.stations) - 1
    before, after = first, last
    if strip.closed or start > 0:
        before -= int((strip.entry[start] - strip.exit[(start - 1) % size]) % count)
    if strip.closed or final < size - 1:
        after += int((strip.entry[(final + 1) % size] - strip.exit[final % size]) % count)
    window = unfold(strip, steps, before, after)
    panels = np.concatenate([window[begin - before], window[end - before]], axis=1)
    rungs = window[first - before : last - before + 1]
    if any(end.mm is not None for end in ends):
        rungs = _cut(window, (first - before, last - before), (begin - before, end - before), ends)
    place = np.stack([begin, end], axis=1) % count
    space = strip.rungs[place].reshape(-1, 4, 3)
    stations = np.array([(station.x, station.y) for station in piece.stations])
    flat = panels.mean(axis=1)
    motion = fit_most(flat, stations)
    if len(stations) < 2:
        motion = _turn_by_outline(rungs, flat[0], piece)
    width = float(np.min(np.hypot(*(rungs[:, 1] - rungs[:, 0]).T)))
    length = float(np.sum(np.hypot(*np.diff(rungs.mean(axis=1), axis=0).T)))
    # Each rung's direction is uncertain by about grain / width; the errors walk at random.
    slack = strip.grain_mm * (1.0 + np.sqrt(len(rungs)) * length / max(2.0 * width, 1e-9))
    return Development(
        rungs=motion.apply(rungs.reshape(-1, 2)).reshape(rungs.shape),
        panels=motion.apply(panels.reshape(-1, 2)).reshape(panels.shape),
        space=space,
        window=motion.apply(window.reshape(-1, 2)).reshape(window.shape),
        slack_mm=float(slack),
    )


def _cut(
    window: Floats, whole: tuple[int, int], panels: tuple[Ints, Ints], ends: tuple[Reach, Reach]
) -> Floats:
    """Cut a window off at both ends: where the reaches say, or else at whole rungs."""
    middle = window.mean(axis=1)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))])
    first, last = int(panels[0][0]), int(panels[0][-1])
    centres = (run[first] + run[first + 1]) / 2.0, (run[last] + run[last + 1]) / 2.0
    lengths = centres[0] - run[whole[0]], run[whole[1]] - centres[1]
    stated = tuple(
        end if end.mm is not None else Reach(float(length))
        for end, length in zip(ends, lengths, strict=True)
    )
    return cut_rungs(window, first, last, (stated[0], stated[1]))


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
