"""Cut what strips side by side share once: one line for two edges."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.sheet.drawing import (
    MIN_SEGMENT_MM,
    Entity,
    Layer,
    PieceDrawing,
    Polyline,
    SheetDrawing,
    on_grid,
)

#: Edges lie on one line to this.
_SAME_MM = 1e-3


def with_common_cuts(drawing: SheetDrawing) -> SheetDrawing:
    """Return a sheet on which no line is cut twice: each piece leaves out what is cut before it.

    Parameters
    ----------
    drawing : SheetDrawing
        Drawn for the middle of the beam. Sides along x and y share edges at will; others are cut
        as they are.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
    >>> pieces = [PieceDrawing(name, (Polyline(Layer.CUT_OUTER, square + (0.0, y), True),))
    ...     for name, y in (("A", 0.0), ("B", 9.0))]
    >>> _, b = with_common_cuts(SheetDrawing("sheet 1", 20.0, 20.0, tuple(pieces), ())).pieces
    >>> [run.points.tolist() for run in b.entities]
    [[[9.0, 9.0], [9.0, 18.0], [0.0, 18.0], [0.0, 9.0]]]
    """
    done: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
    pieces = []
    for piece in drawing.pieces:
        entities: list[Entity] = []
        for entity in piece.entities:
            if entity.layer is Layer.CUT_OUTER and isinstance(entity, Polyline):
                entities += (
                    Polyline(Layer.CUT_OUTER, run) for run in _runs(_left(entity.points, done))
                )
            else:
                entities.append(entity)
        pieces.append(PieceDrawing(piece.piece_id, tuple(entities), piece.name))
    return replace(drawing, pieces=tuple(pieces), open_outlines=True)


def _left(
    points: FloatArray, done: dict[tuple[int, int], list[tuple[float, float]]]
) -> Iterator[FloatArray]:
    """Yield what no line covers of the sides of a closed run, and cover it."""
    points = on_grid(points)
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        axis = int(np.argmax(np.abs(end - start)))
        if abs(end - start)[1 - axis] > _SAME_MM:
            yield np.stack([start, end])
            continue
        line = round(float(start[1 - axis]) / _SAME_MM)
        # What is off by a rounding may be on the next line.
        near = [part for at in (line - 1, line, line + 1) for part in done[axis, at]]
        low, high = sorted((float(start[axis]), float(end[axis])))
        open_ = [(low, high)]
        for begin, stop in near:
            open_ = [
                part
                for first, last in open_
                for part in ((first, min(last, begin)), (max(first, stop), last))
                if part[1] - part[0] >= MIN_SEGMENT_MM
            ]
        done[axis, line] += open_
        for part in open_ if end[axis] > start[axis] else [one[::-1] for one in open_[::-1]]:
            run = np.stack([start, end])
            run[:, axis] = part
            yield run


def _runs(sides: Iterator[FloatArray]) -> list[FloatArray]:
    """Return sides as runs: what begins where another ended goes on from there."""
    runs: list[FloatArray] = []
    for side in sides:
        if runs and np.abs(runs[-1][-1] - side[0]).max() <= _SAME_MM:
            runs[-1] = np.concatenate([runs[-1], side[1:]])
        else:
            runs.append(side)
    if len(runs) > 1 and np.abs(runs[-1][-1] - runs[0][0]).max() <= _SAME_MM:
        first = runs.pop(0)
        runs[-1] = np.concatenate([runs[-1], first[1:]])
    return runs
