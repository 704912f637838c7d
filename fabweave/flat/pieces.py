"""Build pieces from runs: outlines, stations, fastener holes and joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.arrays import BoolArray, FloatArray, IntArray, offsets_of
from fabweave.flat.outline import inscribed_polygon, resting_frame, strip_paths
from fabweave.flat.path import Path
from fabweave.flat.piece import Joint, Piece
from fabweave.flat.runs import Runs, first_and_last_rung, unfold_runs
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave

#: A hole size is taken for a job if at least this share of the crossings has room for it.
WANTED_SHARE = 0.9


@dataclass(frozen=True)
class HoleRule:
    """A hole diameter and how far its centre must keep from every edge, in millimetres."""

    hole_mm: float
    edge_mm: float


@dataclass(frozen=True, eq=False)
class Pieces:
    """All pieces and joints of a job.

    Parameters
    ----------
    pieces : tuple of Piece
        In order of threads and along each thread.
    joints : tuple of Joint
    rule : HoleRule or None
        The hole that was chosen, None if no crossing has room for any.
    room_mm : (X,) float array
        For each crossing the largest distance from a hole's centre to an edge that every layer
        there has room for.
    """

    pieces: tuple[Piece, ...]
    joints: tuple[Joint, ...]
    rule: HoleRule | None
    room_mm: FloatArray


@dataclass(frozen=True, eq=False)
class _Stations:
    """Stations of all pieces one after another."""

    offsets: IntArray
    piece: IntArray
    passes: IntArray
    crossing: IntArray


def build_pieces(
    ribbons: Ribbons,
    weave: Weave,
    runs: Runs,
    labels: Sequence[str],
    rules: Sequence[HoleRule],
) -> Pieces:
    """Build every piece with its stations, holes and joints.

    One hole diameter serves the whole job: the largest of ``rules`` for which nine crossings of
    ten have room in all their layers; failing that, the smallest that fits anywhere.

    Parameters
    ----------
    ribbons, weave, runs
        The ribbons, who is on top, and which passes each piece carries.
    labels : sequence of str
        Names of the threads; pieces are numbered along each thread: ``A1``, ``A2``, ...
    rules : sequence of HoleRule
        Holes to choose from, the preferred first; empty for no holes.

    Returns
    -------
    Pieces
    """
    strips = unfold_runs(ribbons, runs)
    paths = strip_paths(strips)
    outlines = [inscribed_polygon(path) for path in paths]
    stations = _list_stations(weave, runs)
    first, _ = first_and_last_rung(ribbons, runs)
    position = runs.first[stations.piece] + _within(stations.offsets)
    entry = local_entry(ribbons, runs.thread[stations.piece], position)
    rung = strips.offsets[:-1][stations.piece] + entry - first[stations.piece]
    middle = (strips.right + strips.left) / 2
    point = (middle[rung] + middle[rung + 1]) / 2
    abreast = np.stack((strips.right, strips.left), axis=1)
    abreast = (abreast[rung] + abreast[rung + 1]) / 2
    way = middle[rung + 1] - middle[rung]
    way /= np.hypot(way[:, 0], way[:, 1])[:, None]

    room = _room(outlines, stations, point, weave.threads.n_crossings)
    rule = _choose_rule(room, rules)
    drilled = room >= rule.edge_mm if rule else np.zeros(len(room), dtype=bool)
    hole = np.where(drilled[stations.crossing], rule.hole_mm if rule else np.nan, np.nan)

    over = weave.over[stations.passes]
    before, after = _joint_numbers(runs, weave)
    numbers = _number_in_thread(runs)
    pieces = []
    for index, (path, outline) in enumerate(zip(paths, outlines, strict=True)):
        own = slice(stations.offsets[index], stations.offsets[index + 1])
        ends = middle[strips.offsets[index]], middle[strips.offsets[index + 1] - 1]
        frame = resting_frame(outline, *ends)
        turned = frame.apply(way[own]) - frame.shift
        pieces.append(
            Piece(
                id=f"{labels[runs.thread[index]]}{numbers[index]}",
                thread=int(runs.thread[index]),
                path=Path(frame.apply(path.points), path.bulges),
                outline=frame.apply(outline),
                crossings=stations.crossing[own],
                points=frame.apply(point[own]),
                directions=turned,
                rails=frame.apply(abreast[own].reshape(-1, 2)).reshape(-1, 2, 2),
                over=over[own],
                hole_mm=hole[own],
                start_joint=int(before[index]) if before[index] > 0 else None,
                end_joint=int(after[index]) if after[index] > 0 else None,
            )
        )
    return Pieces(tuple(pieces), _join(pieces), rule, room)


def _within(offsets: IntArray) -> IntArray:
    """Return each item's place in its own group."""
    return np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets))


def _list_stations(weave: Weave, runs: Runs) -> _Stations:
    """List the passes that each piece carries."""
    threads = weave.threads
    counts = runs.last - runs.first + 1
    offsets = offsets_of(counts)
    piece = np.repeat(np.arange(len(counts)), counts)
    thread = runs.thread[piece]
    position = (runs.first[piece] + _within(offsets)) % threads.lengths[thread]
    passes = threads.offsets[thread] + position
    return _Stations(offsets, piece, passes, threads.crossing[passes])


def _room(
    outlines: list[FloatArray], stations: _Stations, point: FloatArray, n_crossings: int
) -> FloatArray:
    """Return for each crossing the edge distance that all its layers have, (X,).

    Holes three diameters apart want two thirds of the way to the next station, as an edge wants
    two diameters.
    """
    rings = np.array([shapely.LinearRing(outline) for outline in outlines], dtype=object)
    distance = shapely.distance(shapely.points(point), rings[stations.piece])
    step = np.hypot(*np.diff(point, axis=0).T) * (2 / 3)
    same = stations.piece[1:] == stations.piece[:-1]
    distance[1:][same] = np.minimum(distance[1:][same], step[same])
    distance[:-1][same] = np.minimum(distance[:-1][same], step[same])
    room = np.full(n_crossings, np.inf)
    np.minimum.at(room, stations.crossing, distance)
    return room


def _choose_rule(room: FloatArray, rules: Sequence[HoleRule]) -> HoleRule | None:
    """Choose the hole for the job."""
    fitting: BoolArray
    last = None
    for rule in rules:
        fitting = room >= rule.edge_mm
        if np.count_nonzero(fitting) >= WANTED_SHARE * len(room):
            return rule
        if np.any(fitting):
            last = rule
    return last


def _joint_numbers(runs: Runs, weave: Weave) -> tuple[IntArray, IntArray]:
    """Return the joints before and after each piece, numbered from 1 in order of threads."""
    count = len(runs.thread)
    final = weave.threads.lengths[runs.thread] - 1
    joined = weave.threads.closed[runs.thread] | (runs.last < final)
    after = np.where(joined, np.cumsum(joined), 0)
    starts = np.ones(count, dtype=bool)
    starts[1:] = runs.thread[1:] != runs.thread[:-1]
    begin = np.flatnonzero(starts)
    end = np.append(begin[1:], count) - 1 if count else begin
    before = np.zeros(count, dtype=np.int64)
    before[1:] = after[:-1]
    before[begin] = after[end]  # a ring's first piece follows its last; 0 on an open thread
    return before, after


def _number_in_thread(runs: Runs) -> IntArray:
    """Return each piece's number along its thread, from 1."""
    fresh = np.ones(len(runs.thread), dtype=bool)
    fresh[1:] = runs.thread[1:] != runs.thread[:-1]
    starts = np.flatnonzero(fresh)
    return np.arange(len(fresh)) - np.repeat(starts, np.diff(np.append(starts, len(fresh)))) + 1


def _join(pieces: list[Piece]) -> tuple[Joint, ...]:
    """Pair the pieces at their joints and their holes on one another."""
    begins = {piece.start_joint: index for index, piece in enumerate(pieces) if piece.start_joint}
    joints = []
    for index, piece in enumerate(pieces):
        if piece.end_joint is None:
            continue
        mate = begins[piece.end_joint]
        holes = np.zeros((0, 2, 2))
        if not np.isnan(piece.hole_mm[-1]):
            holes = np.array([[piece.points[-1], pieces[mate].points[0]]])
        joints.append(Joint(piece.end_joint, int(piece.crossings[-1]), (index, mate), holes))
    return tuple(joints)
