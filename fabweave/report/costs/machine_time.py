"""Say how long a machine engraves, cuts and travels, on sheets that are drawn and before that."""

from collections.abc import Iterable, Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.records import record
from fabweave.cut.drawing import Entity, Layer, SheetDrawing
from fabweave.cut.labels.marks import Marks
from fabweave.cut.sheets import draw_piece
from fabweave.flat.piece import Piece
from fabweave.nest.layout import Placement
from fabweave.report.costs.motion import ends_of, hop_times, run_times, runs_of
from fabweave.stock.machine import Span
from fabweave.stock.material import Material, machine_of

#: In the order in which programs burn them, each over the whole sheet.
ENGRAVED = (Layer.ENGRAVE_LABEL, Layer.ENGRAVE_MARK)
CUT = (Layer.CUT_INNER, Layer.CUT_OUTER)
#: Before pieces lie on a sheet: the way from one to the next, as a share of a piece's length. All
#: ways together come within a twentieth of what they are in jobs of 8 to 140 pieces, nested.
_APPROACH = 0.5
#: Pieces may be asked for where they are not placed yet.
_UNPLACED = Placement(0, 0, 0.0, 0.0, 0.0)


@record
class MachineTime:
    """Seconds on the surface, through the sheet, and on the way; None where no speed is known.

    Each is a least and a greatest time: of the fastest and the slowest speeds, accelerations and
    rests of a material's machine.
    """

    engrave_s: Span
    cut_s: Span | None
    travel_s: Span

    @property
    def total_s(self) -> Span | None:
        """All of it."""
        if self.cut_s is None:
            return None
        return _sum([self.engrave_s, self.cut_s, self.travel_s])


def add_times(times: Iterable[MachineTime]) -> MachineTime:
    """Return several times as one; of none, no time at all.

    Examples
    --------
    >>> one = MachineTime(engrave_s=(1.0, 2.0), cut_s=(3.0, 4.0), travel_s=(0.0, 1.0))
    >>> add_times([one, one]).total_s
    (8.0, 14.0)
    """
    each = list(times)
    cuts = [time.cut_s for time in each if time.cut_s is not None]
    return MachineTime(
        engrave_s=_sum(time.engrave_s for time in each),
        cut_s=_sum(cuts) if len(cuts) == len(each) else None,
        travel_s=_sum(time.travel_s for time in each),
    )


def scaled_time(time: MachineTime, factor: float) -> MachineTime:
    """Return a time that takes so many times longer, rounded to milliseconds."""
    engrave, cut, travel = (
        None if span is None else (round(factor * span[0], 3), round(factor * span[1], 3))
        for span in (time.engrave_s, time.cut_s, time.travel_s)
    )
    return MachineTime(engrave_s=engrave or (0.0, 0.0), cut_s=cut, travel_s=travel or (0.0, 0.0))


def sheet_time(drawing: SheetDrawing, material: Material) -> MachineTime:
    """Return what a sheet takes, with all ways between its lines.

    Layer by layer, pieces in their order: as a program goes that burns one colour after another.
    The way begins at the origin.

    Parameters
    ----------
    drawing : SheetDrawing
    material : Material
    """
    layers = {layer: list[Entity]() for layer in (*ENGRAVED, *CUT)}
    for piece in drawing.pieces:
        for entity in piece.entities:
            layers[entity.layer].append(entity)
    engraved = [entity for layer in ENGRAVED for entity in layers[layer]]
    cut = [entity for layer in CUT for entity in layers[layer]]
    begins, ends = ends_of([*engraved, *cut])
    here = np.concatenate((np.zeros((1, 2)), ends[:-1]))[: len(begins)]
    return _time(engraved, cut, np.hypot(*(begins - here).T), material)


def piece_time(pieces: Sequence[Piece], marks: Sequence[Marks], material: Material) -> MachineTime:
    """Return what pieces take before they are nested.

    Engraving and cutting are what they are on any sheet. Ways within a piece are those of a walk
    along it; from one to the next they are estimated.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Marks
        What is engraved on each.
    material : Material
        All are of it.
    """
    engraved: list[Entity] = []
    cut: list[Entity] = []
    ways = [np.zeros(0)]
    for piece, piece_marks in zip(pieces, marks, strict=True):
        drawn = draw_piece(piece, piece_marks, _UNPLACED, None, 1.0)
        approach = _APPROACH * float(np.ptp(piece.outline[:, 0]))
        for layer in (*ENGRAVED, *CUT):
            entities = [entity for entity in drawn.entities if entity.layer is layer]
            (engraved if layer in ENGRAVED else cut).extend(entities)
            if entities:
                begins, ends = ends_of(entities)
                ways += [np.hypot(*(begins[1:] - ends[:-1]).T), np.array([approach])]
    return _time(engraved, cut, np.concatenate(ways), material)


def _time(
    engraved: Sequence[Entity], cut: Sequence[Entity], way_mm: FloatArray, material: Material
) -> MachineTime:
    """Return what lines and the ways between them take on the machine of a material."""
    machine, surface, through = machine_of(material), runs_of(engraved), runs_of(cut)
    engrave, cutting, travel = [], [], []
    # First the fastest of everything, then the slowest.
    for fast, slow in ((1, 0), (0, 1)):
        rate, corner = machine.acceleration_mm_s2[fast], machine.deviation_mm
        burn = run_times(surface, machine.engrave_mm_s[fast], rate, corner)
        engrave.append(float(burn.sum()) + len(engraved) * machine.laser_on_s[slow])
        travel.append(float(hop_times(way_mm, machine.rapid_mm_s[fast], rate).sum()))
        if material.speed_mm_s is not None:
            speed = sorted(material.speed_mm_s)[fast]
            burn = run_times(through, speed, rate, corner)
            cutting.append(float(burn.sum()) + len(cut) * machine.pierce_s[slow])
    return MachineTime(
        engrave_s=(engrave[0], engrave[1]),
        cut_s=(cutting[0], cutting[1]) if cutting else None,
        travel_s=(travel[0], travel[1]),
    )


def _sum(spans: Iterable[Span]) -> Span:
    """Return the sums of both ends."""
    low = high = 0.0
    for span in spans:
        low, high = low + span[0], high + span[1]
    return low, high
