"""Write down what crosses what: the crossing map, for machines and for people."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fabweave.assembly.order.planning import Order
from fabweave.assembly.steps import build_steps, last_tenth
from fabweave.core.arc_path import Path
from fabweave.core.arrays import FloatArray, IntArray
from fabweave.cut.labels.marks import Marks
from fabweave.cut.labels.texts import Label
from fabweave.flat.congruence import piece_kinds
from fabweave.flat.layers import grips_mm
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet
from fabweave.flat.strand_owners import Owners, find_owners
from fabweave.mesh.halfedge import Halfedges
from fabweave.nest.allotment import Allotment
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut
from fabweave.ribbon.project import Ribbons
from fabweave.stock.sheet_size import SheetSize
from fabweave.weave.pattern import Weave
from fabweave.weave.weave_pattern import WeaveResult

SCHEMA = "fabweave.crossing-map/1"

#: Lengths in the map are rounded to a millionth of a millimetre, angles to as many degrees.
_DECIMALS = 6
_BULGE_DECIMALS = 9


def crossing_map(
    halfedges: Halfedges,
    chosen: WeaveResult,
    bunches: IntArray,
    labels: Sequence[str],
    ribbons: Ribbons,
    made: PieceSet,
    marks: Sequence[Marks],
    layout: Layout,
    sheet_names: Sequence[str],
    order: Order,
    allotment: Allotment,
    *,
    offcuts: Sequence[Offcut] = (),
    mirrored: bool = False,
    cut: Mapping[str, Any],
) -> dict[str, Any]:
    """Build the whole plan of a job: threads, crossings, pieces, joints, sheets and steps.

    ``offcuts`` are what is kept of sheets, as they are drawn; ``mirrored`` says whether sheets are
    drawn mirrored, so that their insides are engraved, and ``cut`` what the files for the cutter
    are like.

    Returns
    -------
    dict
        What ``crossing_map.json`` holds; every reference is to an id in the same map.
    """
    weave = chosen.weave
    owners = find_owners(made.pieces, weave.threads.n_crossings)
    steps = build_steps(made, order)
    grip = grips_mm(made)
    rests = {
        offcut.sheet + 1: {"name": offcut.name, "outline": _rounded(offcut.outline)}
        for offcut in offcuts
    }
    return {
        "schema": SCHEMA,
        "units": "mm",
        "weave": chosen.record(),
        "layout": {
            "margin_mm": layout.margin_mm,
            "gap_mm": layout.gap_mm,
            "rotations": {
                "step_deg": layout.rotations.step_deg,
                "tolerance_deg": layout.rotations.tolerance_deg,
            },
            "notes": list(layout.notes),
        },
        "cut": dict(cut),
        "sheets": [
            {
                "sheet": number,
                "name": name,
                "width_mm": sheet.width_mm,
                "height_mm": sheet.height_mm,
                "mirrored": mirrored,
                **_stock(sheet.mirrored() if mirrored else sheet),
                "rest": rests.get(number),
                "material": allotment.of_sheet(number - 1).material.name,
                "thickness_mm": allotment.of_sheet(number - 1).material.thickness_mm,
            }
            for number, (name, sheet) in enumerate(
                zip(sheet_names, layout.sheets, strict=True), start=1
            )
        ],
        "threads": _threads(weave, bunches, labels, made),
        "crossings": _crossings(halfedges, weave, ribbons, made, owners),
        "pieces": _pieces(made, marks, layout, owners, allotment.of_pieces(made.pieces)),
        "joints": [
            {
                "id": joint.id,
                "pieces": [made.pieces[index].id for index in joint.pieces],
                "crossing": joint.crossing,
                "kind": joint.kind,
                "holes": _rounded(joint.holes),
                "hole_mm": None if np.isnan(joint.hole_mm) else joint.hole_mm,
                "lap_mm": round(joint.lap_mm, _DECIMALS),
                # Both laps and the strand above.
                "grip_mm": float(grip[joint.crossing]) if len(joint.holes) else None,
            }
            for joint in made.joints
        ],
        "assembly": order.record() | {"last_tenth": round(last_tenth(steps), 3)},
        "steps": steps,
    }


def _stock(sheet: SheetSize) -> dict[str, Any]:
    """Return what a sheet is like, as it lies on the bed."""
    return {
        "stock": sheet.name,
        "offcut": sheet.offcut,
        "price": sheet.price,
        "grain_deg": sheet.grain_deg,
        "outline": [list(point) for point in sheet.ring],
        "defects": [[list(point) for point in ring] for ring in sheet.defects],
    }


def crossing_table(plan: dict[str, Any]) -> str:
    """Return the crossings as CSV, one row each, for people and spreadsheets."""
    stations = {piece["id"]: piece["stations"] for piece in plan["pieces"]}
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(
        ("crossing", "over_piece", "over_station", "under_piece", "under_station", "joint",
         "hole_mm", "x", "y", "z")
    )  # fmt: skip
    for crossing in plan["crossings"]:
        over, under = crossing["over"], crossing["under"]
        station = stations[under["piece"]][under["station"]]
        joint = station["joint"]
        if joint is None:
            joint = stations[over["piece"]][over["station"]]["joint"]
        rows.writerow(
            (
                crossing["id"],
                over["piece"],
                over["station"],
                under["piece"],
                under["station"],
                "" if joint is None else joint,
                "" if station["hole_mm"] is None else station["hole_mm"],
                *crossing["position"],
            )
        )
    return text.getvalue()


def _rounded(values: FloatArray) -> Any:
    """Return nested lists of floats, rounded, without negative zeros."""
    return (np.round(values, _DECIMALS) + 0.0).tolist()


def joint_at(piece: Piece, station: int) -> int | None:
    """Return the joint that a station carries: at the piece's end, or at its beginning."""
    if station == len(piece.crossings) - 1 and piece.end_joint is not None:
        return piece.end_joint
    return piece.start_joint if station == 0 else None


def _threads(
    weave: Weave, bunches: IntArray, labels: Sequence[str], made: PieceSet
) -> list[dict[str, Any]]:
    """Return the threads with their crossings and pieces in walking order."""
    owned: list[list[str]] = [[] for _ in labels]
    for piece in made.pieces:
        owned[piece.thread].append(piece.id)
    threads = weave.threads
    result = []
    for number, label in enumerate(labels):
        own = slice(threads.offsets[number], threads.offsets[number + 1])
        result.append(
            {
                "id": number,
                "label": label,
                "closed": bool(threads.closed[number]),
                "bunch": int(bunches[number]),
                "crossings": threads.crossing[own].tolist(),
                "over": weave.over[own].tolist(),
                "pieces": owned[number],
            }
        )
    return result


def _crossings(
    halfedges: Halfedges, weave: Weave, ribbons: Ribbons, made: PieceSet, owners: Owners
) -> list[dict[str, Any]]:
    """Return the crossings with their edge, position and both strands."""
    first = weave.threads.crossing_halfedge
    ends = np.column_stack((halfedges.tail[first], halfedges.head[first])).tolist()
    positions = _rounded(ribbons.centre)

    def strand(crossing: int, side: int) -> dict[str, Any]:
        index = int(owners.piece[crossing, side])
        piece = made.pieces[index]
        return {
            "thread": piece.thread,
            "piece": piece.id,
            "station": int(owners.station[crossing, side]),
        }

    return [
        {
            "id": crossing,
            "edge": ends[crossing],
            "position": positions[crossing],
            "over": strand(crossing, 1),
            "under": strand(crossing, 0),
        }
        for crossing in range(len(ends))
    ]


def _pieces(
    made: PieceSet,
    marks: Sequence[Marks],
    layout: Layout,
    owners: Owners,
    stuff: Sequence[int],
) -> list[dict[str, Any]]:
    """Return the pieces with their outline, stations, labels and placement."""
    result = []
    kinds = piece_kinds(made.pieces, stuff).tolist()
    for index, (piece, placement) in enumerate(zip(made.pieces, layout.placements, strict=True)):
        if placement.piece != index:
            raise ValueError("placements must be in the order of the pieces")
        partners = [made.pieces[other].id for other in owners.partners(piece)]
        points, holes = _rounded(piece.points), piece.hole_mm.tolist()
        result.append(
            {
                "id": piece.id,
                "kind": kinds[index],
                "thread": piece.thread,
                "sheet": placement.sheet + 1,
                "placement": {
                    "rotation_deg": placement.rotation_deg,
                    "x_mm": placement.x_mm,
                    "y_mm": placement.y_mm,
                },
                "joints": [piece.start_joint, piece.end_joint],
                "path": _path(piece.path),
                "outline": _rounded(piece.outline),
                "stations": [
                    {
                        "crossing": int(crossing),
                        "over": bool(piece.over[k]),
                        "partner": partners[k],
                        "x": points[k][0],
                        "y": points[k][1],
                        "hole_mm": None if np.isnan(holes[k]) else holes[k],
                        "joint": joint_at(piece, k),
                    }
                    for k, crossing in enumerate(piece.crossings)
                ],
                "cutouts": _cutouts(piece),
                "labels": [_label(label) for label in marks[index].labels],
                "dropped": [
                    {"kind": kind, "text": text, "station": station}
                    for kind, text, station in marks[index].dropped
                ],
            }
        )
    return result


def _path(path: Path) -> list[list[float]]:
    """Return the corners of what is cut, each with the bulge of the side that leaves it."""
    bulges = (np.round(path.bulges, _BULGE_DECIMALS) + 0.0).tolist()
    return [[*point, bulge] for point, bulge in zip(_rounded(path.points), bulges, strict=True)]


def _cutouts(piece: Piece) -> list[dict[str, Any]]:
    """Return everything that is cut out of a piece, in the order in which it is drawn."""
    holes = [
        {"station": int(station), "kind": "hole", "x": x, "y": y, "diameter_mm": diameter}
        for station, x, y, diameter in _rounded(piece.holes)
    ]
    slots = [
        {"station": slot.station, "kind": "slot", "path": _path(slot.path)} for slot in piece.slots
    ]
    return [*holes, *slots]


def _label(label: Label) -> dict[str, Any]:
    """Return where a label stands on its piece, and what it says."""
    x, y = _rounded(label.centre)
    wide, high = (round(size, _DECIMALS) for size in label.box_mm)
    return {
        "kind": label.kinds[0],
        "text": label.text,
        "station": label.station,
        "height_mm": label.height_mm,
        "x": x,
        "y": y,
        "rotation_deg": round(label.rotation_deg, _DECIMALS),
        "box_mm": [wide, high],
    }
