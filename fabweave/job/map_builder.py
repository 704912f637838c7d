"""Build the crossing map of a job from what was made."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.arc_path import Path
from fabweave.core.arrays import FloatArray, IntArray
from fabweave.job.planned import PlannedJob
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.offcut import Offcut
from fabweave.piece.congruence import DECIMALS, spare_pieces
from fabweave.piece.piece import Owners, Piece, find_owners
from fabweave.piece.pieces import PieceSet, grips_mm
from fabweave.plan.allotment import Allotment
from fabweave.plan.crossing_map import (
    AssemblyRecord,
    Corner,
    CrossingMap,
    CrossingRecord,
    CutoutRecord,
    CutRecord,
    DroppedRecord,
    JointRecord,
    LabelRecord,
    LayoutRecord,
    PieceRecord,
    PlacementRecord,
    RestRecord,
    RotationRecord,
    SheetRecord,
    SpareRecord,
    StationRecord,
    StepRecord,
    StrandRecord,
    ThreadRecord,
    weave_record,
)
from fabweave.plan.order import Order
from fabweave.plan.steps import last_tenth
from fabweave.ribbon.lay import WovenObject
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.labels.texts import Label
from fabweave.weave.pattern import Weave

#: Bulges are shares, and are told more finely.
_BULGE_DECIMALS = 9


def build_crossing_map(
    planned: PlannedJob,
    marks: Sequence[Marks],
    layout: Layout,
    drawings: Sequence[SheetDrawing],
    order: Order,
    steps: tuple[StepRecord, ...],
    allotment: Allotment,
    *,
    offcuts: Sequence[Offcut],
    cut: CutRecord,
) -> CrossingMap:
    """Build the crossing map of a job; every reference in it is to an id in the same map.

    Parameters
    ----------
    planned : PlannedJob
    marks : sequence of Marks
        Those of each piece, then of each spare.
    layout : Layout
        One placement for each piece and spare, in the same order.
    drawings : sequence of SheetDrawing
        The sheets, in the order of the layout.
    order : Order
        Of assembly.
    steps : tuple of StepRecord
        In that order.
    allotment : Allotment
    offcuts : sequence of Offcut
        What is kept of sheets, as it is drawn.
    cut : CutRecord
        What the files for the cutter are like.

    Raises
    ------
    ValueError
        If placements are not in the order of the pieces.
    """
    woven, piece_set, weave = planned.woven, planned.piece_set, planned.weave
    owners = find_owners(piece_set.pieces, weave.threads.n_crossings)
    if [placement.piece for placement in layout.placements] != list(range(len(marks))):
        raise ValueError("placements must be in the order of the pieces")
    return CrossingMap(
        schema="fabweave.crossing-map/1",
        units="mm",
        weave=weave_record(woven.result),
        layout=layout_record(layout),
        cut=cut,
        sheets=sheet_records(layout, drawings, allotment, offcuts, mirrored=planned.mirrored),
        threads=_threads(weave, woven.bunches, woven.labels, piece_set),
        crossings=_crossings(woven, piece_set, owners),
        pieces=_pieces(piece_set, marks, layout, owners),
        spares=_spares(piece_set.pieces, planned.spared, marks, layout),
        joints=_joints(piece_set),
        assembly=AssemblyRecord(
            effort=round(order.total, 2),
            by_thread=round(order.by_thread, 2),
            by_number=round(order.by_number, 2),
            last_tenth=round(last_tenth(steps), 3),
        ),
        steps=tuple(steps),
    )


def layout_record(layout: Layout) -> LayoutRecord:
    """Return how pieces lie on the sheets of a layout."""
    return LayoutRecord(
        margin_mm=layout.margin_mm,
        gap_mm=layout.gap_mm,
        rotations=RotationRecord(
            step_deg=layout.rotations.step_deg,
            tolerance_deg=layout.rotations.tolerance_deg,
            from_grain_deg=layout.rotations.from_grain_deg or None,
        ),
        notes=layout.notes,
        recorded=layout.recorded,
    )


def sheet_records(
    layout: Layout,
    drawings: Sequence[SheetDrawing],
    allotment: Allotment,
    offcuts: Sequence[Offcut],
    *,
    mirrored: bool,
) -> tuple[SheetRecord, ...]:
    """Return the sheets as they lie on the bed."""
    rests = {
        offcut.sheet: RestRecord(name=offcut.name, outline=_points(offcut.outline))
        for offcut in offcuts
    }
    records = []
    for index, (sheet, drawing) in enumerate(zip(layout.sheets, drawings, strict=True)):
        drawn = sheet.mirrored() if mirrored else sheet
        material = allotment.of_sheet(index).material
        records.append(
            SheetRecord(
                sheet=index + 1,
                name=drawing.name,
                width_mm=sheet.width_mm,
                height_mm=sheet.height_mm,
                mirrored=mirrored,
                stock=drawn.name,
                offcut=drawn.offcut,
                price=drawn.price,
                grain_deg=drawn.grain_deg,
                outline=drawn.ring,
                defects=drawn.defects,
                rest=rests.get(index),
                roll_mm=sheet.roll_mm,
                material=material.name,
                thickness_mm=material.thickness_mm,
            )
        )
    return tuple(records)


def _threads(
    weave: Weave, bunches: IntArray, labels: Sequence[str], piece_set: PieceSet
) -> tuple[ThreadRecord, ...]:
    """Return the threads with their crossings and pieces in walking order."""
    pieces: list[list[str]] = [[] for _ in labels]
    for piece in piece_set.pieces:
        pieces[piece.thread].append(piece.id)
    threads = weave.threads
    records = []
    for number, label in enumerate(labels):
        passes = slice(threads.offsets[number], threads.offsets[number + 1])
        records.append(
            ThreadRecord(
                id=number,
                label=label,
                closed=bool(threads.closed[number]),
                bunch=int(bunches[number]),
                crossings=tuple(threads.crossing[passes].tolist()),
                over=tuple(weave.over[passes].tolist()),
                pieces=tuple(pieces[number]),
            )
        )
    return tuple(records)


def _crossings(
    woven: WovenObject, piece_set: PieceSet, owners: Owners
) -> tuple[CrossingRecord, ...]:
    """Return the crossings with their edge, position and both strands."""
    first = woven.weave.threads.crossing_halfedge
    edges = np.column_stack((woven.halfedges.tail[first], woven.halfedges.head[first])).tolist()
    positions = _points(woven.ribbons.centre)

    def strand(crossing: int, side: int) -> StrandRecord:
        piece = piece_set.pieces[int(owners.piece[crossing, side])]
        return StrandRecord(
            thread=piece.thread, piece=piece.id, station=int(owners.station[crossing, side])
        )

    return tuple(
        CrossingRecord(
            id=crossing,
            edge=tuple(edge),
            position=position,
            over=strand(crossing, 1),
            under=strand(crossing, 0),
            fastened=bool(piece_set.fastened[crossing]),
            hang=True if piece_set.hanging is not None and piece_set.hanging[crossing] else None,
        )
        for crossing, (edge, position) in enumerate(zip(edges, positions, strict=True))
    )


def _pieces(
    piece_set: PieceSet,
    marks: Sequence[Marks],
    layout: Layout,
    owners: Owners,
) -> tuple[PieceRecord, ...]:
    """Return the pieces with their outline, stations, labels and placement."""
    pieces, records = piece_set.pieces, []
    kinds, fitted = piece_set.kinds, np.round(piece_set.fitted_mm, DECIMALS)
    for index, piece in enumerate(pieces):
        records.append(
            PieceRecord(
                id=piece.id,
                kind=int(kinds.number[index]),
                turned=True if kinds.turned[index] else None,
                fitted_mm=float(fitted[index]) or None,
                thread=piece.thread,
                sheet=layout.placements[index].sheet + 1,
                placement=_placement(layout.placements[index]),
                joints=(piece.start_joint, piece.end_joint),
                path=_corners(piece.path),
                outline=_points(piece.outline),
                stations=_stations(piece, [pieces[other].id for other in owners.partners(piece)]),
                cutouts=_cutouts(piece),
                ticks=marks[index].ticked or None,
                labels=tuple(map(_label, marks[index].labels)),
                dropped=_dropped(marks[index]),
            )
        )
    return tuple(records)


def _spares(
    pieces: Sequence[Piece], spared: IntArray, marks: Sequence[Marks], layout: Layout
) -> tuple[SpareRecord, ...] | None:
    """Return the spares, which stand after the pieces; None if there are none."""
    names = [spare.id for spare in spare_pieces(pieces, spared)]
    records = tuple(
        SpareRecord(
            id=name,
            of=pieces[origin].id,
            sheet=placement.sheet + 1,
            placement=_placement(placement),
            labels=tuple(map(_label, engraved.labels)),
            dropped=_dropped(engraved),
        )
        for name, origin, engraved, placement in zip(
            names,
            spared.tolist(),
            marks[len(pieces) :],
            layout.placements[len(pieces) :],
            strict=True,
        )
    )
    return records or None


def _placement(placement: Placement) -> PlacementRecord:
    return PlacementRecord(
        rotation_deg=placement.rotation_deg, x_mm=placement.x_mm, y_mm=placement.y_mm
    )


def _dropped(marks: Marks) -> tuple[DroppedRecord, ...]:
    """Return what found no room on a piece."""
    return tuple(
        DroppedRecord(kind=kind, text=text, station=station)
        for kind, text, station in marks.dropped
    )


def _stations(piece: Piece, partners: Sequence[str]) -> tuple[StationRecord, ...]:
    """Return the stations of a piece."""
    points, holes = _points(piece.points), piece.hole_mm.tolist()
    over = piece.over.tolist()
    return tuple(
        StationRecord(
            crossing=crossing,
            over=over[k],
            partner=partners[k],
            x=points[k][0],
            y=points[k][1],
            hole_mm=None if np.isnan(holes[k]) else holes[k],
            joint=_joint_at(piece, k),
        )
        for k, crossing in enumerate(piece.crossings.tolist())
    )


def _joint_at(piece: Piece, station: int) -> int | None:
    """Return the joint that a station carries: at the piece's end, or at its beginning."""
    if station == len(piece.crossings) - 1 and piece.end_joint is not None:
        return piece.end_joint
    return piece.start_joint if station == 0 else None


def _cutouts(piece: Piece) -> tuple[CutoutRecord, ...]:
    """Return everything that is cut out of a piece, in the order in which it is drawn."""
    holes = (
        CutoutRecord(station=int(station), kind="hole", x=x, y=y, diameter_mm=diameter)
        for station, x, y, diameter in _points(piece.holes)
    )
    slots = (
        CutoutRecord(station=slot.station, kind="slot", path=_corners(slot.path))
        for slot in piece.slots
    )
    return (*holes, *slots)


def _label(label: Label) -> LabelRecord:
    """Return where a label stands on its piece, and what it says."""
    ((x, y),) = _points(label.centre[None])
    length, height = label.box_mm
    return LabelRecord(
        kind=label.kinds[0],
        text=label.text,
        station=label.station,
        height_mm=label.height_mm,
        x=x,
        y=y,
        rotation_deg=round(label.rotation_deg, DECIMALS),
        box_mm=(round(length, DECIMALS), round(height, DECIMALS)),
        hidden=label.hidden or None,
    )


def _joints(piece_set: PieceSet) -> tuple[JointRecord, ...]:
    """Return the joints; a fastener grips both laps and the strand above or below them."""
    pieces, grip = piece_set.pieces, grips_mm(piece_set)
    return tuple(
        JointRecord(
            id=joint.id,
            pieces=(pieces[joint.pieces[0]].id, pieces[joint.pieces[1]].id),
            crossing=joint.crossing,
            kind=joint.kind.name,
            holes=tuple(_points(pair) for pair in joint.holes),
            hole_mm=None if np.isnan(joint.hole_mm) else joint.hole_mm,
            lap_mm=round(joint.lap_mm, DECIMALS),
            ahead_mm=round(joint.ahead_mm, DECIMALS) if joint.kind.crossings > 1 else None,
            grip_mm=float(grip[joint.crossing]) if len(joint.holes) else None,
        )
        for joint in piece_set.joints
    )


def _corners(path: Path) -> tuple[Corner, ...]:
    """Return the corners of what is cut, each with the bulge of the side that leaves it."""
    bulges = (np.round(path.bulges, _BULGE_DECIMALS) + 0.0).tolist()
    return tuple((*point, bulge) for point, bulge in zip(_points(path.points), bulges, strict=True))


def _points(values: FloatArray) -> Any:
    """Return the rows of an array, (N, D), as tuples of rounded floats, without negative zeros."""
    return tuple(map(tuple, (np.round(values, DECIMALS) + 0.0).tolist()))
