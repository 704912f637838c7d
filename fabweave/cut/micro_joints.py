"""Leave small bridges in outlines, so that pieces stay in the sheet until they are broken out."""

import re
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arc_path import points_on_sides, stretch
from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length
from fabweave.cut.drawing import Entity, Layer, PieceDrawing, Polyline, SheetDrawing

#: How wide a micro-joint is unless said otherwise, millimetres.
BRIDGE_MM = 0.25
#: Narrower ones break in the machine, wider ones do not break by hand, millimetres.
_WIDTHS_MM = (0.1, 5.0)
#: Nobody wants more of them in one outline.
_MOST = 50
#: An outline has a micro-joint for each such length at most, millimetres.
_APART_MM = 15.0
#: So much of a side is left on either side of a micro-joint, millimetres.
_REST_MM = 0.2
#: An arc that bulges by more than this over a micro-joint is no place for one, millimetres.
_BULGE_MM = 0.01
_WORDS = re.compile(r"(?P<count>[0-9]{1,9})(?::(?P<width>.+))?")


@dataclass(frozen=True)
class MicroJoints:
    """How many bridges an outline has, and how wide they are in millimetres."""

    count: int
    width_mm: float = BRIDGE_MM

    def __str__(self) -> str:
        """Return the text that ``parse_micro_joints`` reads."""
        return f"{self.count}:{self.width_mm:g}mm"


def parse_micro_joints(text: str) -> MicroJoints:
    """Return the micro-joints that a text such as ``4`` or ``4:0.3mm`` asks for.

    Raises
    ------
    InputError
        If the text asks for none, too many, or for bridges under 0.1 or over 5 mm.

    Examples
    --------
    >>> parse_micro_joints("4")
    MicroJoints(count=4, width_mm=0.25)
    >>> str(parse_micro_joints("2:0.5mm"))
    '2:0.5mm'
    """
    words = _WORDS.fullmatch(text.strip())
    if words is None or not 1 <= int(words["count"]) <= _MOST:
        raise InputError(
            f"micro-joints {text!r} must be NUMBER or NUMBER:WIDTH, with a number from 1 to "
            f"{_MOST}, such as 4 or 4:0.3mm"
        )
    width_text = words["width"]
    width = (
        BRIDGE_MM if width_text is None else parse_length(width_text, what="width of micro-joints")
    )
    least, most = _WIDTHS_MM
    if not least <= width <= most:
        raise InputError(
            f"micro-joints are {width:g} mm wide, but must be {least:g} to {most:g} mm wide"
        )
    return MicroJoints(int(words["count"]), width)


def bridged(drawing: SheetDrawing, wanted: MicroJoints, *, kerf_mm: float = 0.0) -> SheetDrawing:
    """Return a sheet whose outlines are open at micro-joints.

    They stand at equal distances along the outline, or as near to that as there are sides long
    and straight enough to hold one and a little more; a short outline has fewer, and one at
    least where there is such a side.

    Parameters
    ----------
    drawing : SheetDrawing
    wanted : MicroJoints
    kerf_mm : float
        Width of the burnt line: the beam stops so much earlier that the bridge is as wide as
        it was asked for.

    Returns
    -------
    SheetDrawing
        Its outlines are open runs, one after another round the piece.

    Examples
    --------
    >>> square = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]]), True)
    >>> sheet = SheetDrawing("sheet 1", 20.0, 10.0, (PieceDrawing("A1", (square,)),), ())
    >>> one, two = bridged(sheet, MicroJoints(2, 1.0)).pieces[0].entities
    >>> one.points.tolist()
    [[5.0, 0.0], [9.0, 0.0], [9.0, 9.0], [5.0, 9.0]]
    """
    gap = wanted.width_mm + kerf_mm
    return replace(
        drawing,
        pieces=tuple(
            PieceDrawing(
                piece.piece_id,
                tuple(
                    run for entity in piece.entities for run in _opened(entity, wanted.count, gap)
                ),
            )
            for piece in drawing.pieces
        ),
        open_outlines=True,
    )


def _opened(entity: Entity, count: int, gap_mm: float) -> list[Entity]:
    """Return the runs that are left of an outline; anything else as it is."""
    if not isinstance(entity, Polyline) or entity.layer is not Layer.CUT_OUTER:
        return [entity]
    bulges = np.zeros(len(entity.points)) if entity.bulges is None else entity.bulges
    chords = np.hypot(*(np.roll(entity.points, -1, axis=0) - entity.points).T)
    ends = np.cumsum(chords * stretch(bulges))
    starts = np.concatenate(([0.0], ends[:-1]))
    radii = chords * (1.0 + bulges**2) / (4.0 * np.maximum(np.abs(bulges), 1e-12))
    flat = gap_mm**2 / (8.0 * radii) <= _BULGE_MM
    middles = _middles(starts, ends, flat, count, gap_mm)
    if not len(middles):
        return [entity]
    along = np.concatenate((starts, starts + ends[-1], 2.0 * ends[-1:]))
    # A run goes from the end of one gap to the beginning of the next.
    begins = middles + gap_mm / 2.0
    stops = np.roll(middles, -1) - gap_mm / 2.0
    stops[-1] += ends[-1]
    return [
        _run(entity.points, bulges, along, float(begin), float(stop))
        for begin, stop in zip(begins, stops, strict=True)
    ]


def _middles(
    starts: FloatArray, ends: FloatArray, flat: BoolArray, count: int, gap_mm: float
) -> FloatArray:
    """Return where along the outline its gaps have their middles, in ascending order."""
    whole = float(ends[-1])
    count = max(1, min(count, int(whole / _APART_MM)))
    need = gap_mm / 2.0 + _REST_MM
    wide = flat & (ends - starts >= 2.0 * need)
    if not wide.any():
        return np.zeros(0)
    wished = (np.arange(count) + 0.5) * whole / count - whole / (4.0 * count)
    near = np.clip(wished[:, None], (starts[wide] + need)[None], (ends[wide] - need)[None])
    best = np.argmin(np.round(np.abs(near - wished[:, None]), 6), axis=1)
    middles = np.sort(near[np.arange(count), best])
    # Where sides are short two wishes may come to the same place.
    far = np.diff(middles, prepend=middles[-1] - whole) > gap_mm + 4.0 * _REST_MM
    return middles[far] if far.any() else middles[:1]


def _run(
    points: FloatArray, bulges: FloatArray, along: FloatArray, begin: float, stop: float
) -> Polyline:
    """Return the part of an outline between two places along it.

    ``along`` has where each side begins, twice round; ``stop`` may be a round later.
    """
    first = int(np.searchsorted(along, begin, side="right")) - 1
    last = int(np.searchsorted(along, stop, side="left")) - 1
    sides = np.arange(first, last + 1)
    length = np.diff(along)[sides]
    low = np.clip((begin - along[sides]) / length, 0.0, 1.0)
    high = np.clip((stop - along[sides]) / length, 0.0, 1.0)
    corners, sweep = np.roll(points, -1, axis=0), 4.0 * np.arctan(bulges)
    wrapped = sides % len(points)
    entry = points_on_sides(points[wrapped], corners[wrapped], sweep[wrapped], low)
    exit_ = points_on_sides(
        points[wrapped[-1:]], corners[wrapped[-1:]], sweep[wrapped[-1:]], high[-1:]
    )
    cut = np.tan(sweep[wrapped] * (high - low) / 4.0)
    return Polyline(
        Layer.CUT_OUTER,
        np.concatenate((entry, exit_)),
        bulges=np.concatenate((cut, [0.0])) if np.any(cut) else None,
    )
