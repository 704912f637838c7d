"""Check the pieces of a job by the rules of who cuts them."""

import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.finding import Finding
from fabweave.core.messages import agree
from fabweave.core.records import to_json
from fabweave.piece.outline import SHORTEST_SIDE_MM
from fabweave.plan.crossing_map import CrossingMap, PieceRecord, SheetRecord
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.sheet.targets import Target
from fabweave.stock.material import Material, hole_edge_mm
from fabweave.stock.supplies import Supplies

SCHEMA = "fabweave.preflight/1"

#: What each rule forbids, and how the worst case is told.
_MEANING = {
    "hole": "{n} hole[|s] smaller than can be cut",
    "hole-edge": "{n} hole[|s] too close to an edge",
    "web": "{n} place[|s] with too little material between cuts",
    "gap": "{n} piece[|s] too close to another",
    "piece": "{n} piece[|s] larger than the target takes",
    "sheet": "{n} sheet[|s] larger than the target takes",
    "segment": "{n} side[|s] of outlines too short to cut cleanly",
    "width": "{n} stretch[|es] of ribbon too narrow to handle",
    "bend": "{n} bend[|s] tighter than the material takes",
}


def _finding(
    rule: str, value_mm: float, limit_mm: float, cure: str, where: str = "", count: int = 1
) -> Finding:
    """Return what breaks a rule: in how many places, and the worst of them."""
    value, limit = (f"{round(length, 3):g} mm" for length in (value_mm, limit_mm))
    text = f"{agree(count, _MEANING[rule])}; worst {value} instead of {limit}"
    return Finding(rule=rule, level="with care", text=text, cure=cure, where=where)


def preflight_record(
    findings: Sequence[Finding], materials: Sequence[Material], target: Target
) -> dict[str, Any]:
    """Return what ``preflight.json`` holds; a job of several materials lists them all."""
    each = [
        {"material": material.name, "thickness_mm": material.thickness_mm} for material in materials
    ]
    return {
        "schema": SCHEMA,
        "units": "mm",
        **(each[0] if len(each) == 1 else {"materials": each}),
        "target": target.name,
        "findings": list(map(to_json, findings)),
    }


def finding_lines(findings: Sequence[Finding]) -> list[str]:
    """Say of each rule what breaks it worst, on how many more pieces it is broken, and the cure.

    Examples
    --------
    >>> hole = _finding("hole", 0.8, 1.0, "--fastener 1mm", "A1, sheet 1 at (20, 30.5)", 3)
    >>> finding_lines((hole,))[0]
    'hole: 3 holes smaller than can be cut; worst 0.8 mm instead of 1 mm on A1, sheet 1 at \
(20, 30.5). --fastener 1mm would help'
    """
    lines = []
    for rule, alike in groupby(findings, attrgetter("rule")):
        worst, *others = alike
        where = f" on {worst.where}" if worst.where else ""
        more = agree(len(others), "; {n} more piece[|s]") if others else ""
        lines.append(f"{rule}: {worst.text}{where}{more}. {worst.cure} would help")
    return lines


Shapes: TypeAlias = npt.NDArray[Any]

# Values this near to a limit are taken to keep it: files hold a millionth of a millimetre.
_SLACK_MM = 1e-4
# Halvings by which the width of a neck is found: a thousandth of the limit, or this if it is less.
_HALVINGS, _WIDTH_MM = 10, 0.01


class _Cuts(NamedTuple):
    """The N pieces of a job on their sheets, and their H holes.

    Parameters
    ----------
    names : list of str
    sheet : (N,) int array
        The sheet of each piece, from 1.
    polygons : (N,) array of polygons
    hole_piece : (H,) int array
        The piece of each hole.
    hole_at : (H, 2) float array
        Centres on the sheet, in millimetres.
    hole_mm : (H,) float array
        Diameters.
    """

    names: list[str]
    sheet: IntArray
    polygons: Shapes
    hole_piece: IntArray
    hole_at: FloatArray
    hole_mm: FloatArray

    def where(self, piece: int, at: FloatArray) -> str:
        """Name a piece and a place on its sheet."""
        x, y = at.round(3).tolist()
        return f"{self.names[piece]}, sheet {self.sheet[piece]} at ({x:g}, {y:g})"


def preflight(
    crossing_map: CrossingMap,
    findings: Sequence[BrokenRule],
    materials: Sequence[Material],
    target: Target,
    *,
    common: bool = False,
) -> tuple[Finding, ...]:
    """Check every piece of a job against the rules of its material and a target.

    Parameters
    ----------
    crossing_map : CrossingMap
    findings : sequence of BrokenRule
        What was found about the ribbons in space; widths and bends count as rules, too.
    materials : sequence of Material
        That of each thread.
    target : Target
    common : bool
        Whether pieces share cuts, and so need no gap.

    Returns
    -------
    tuple of Finding
        For each rule and piece that breaks it the worst place; by rules, the worst piece first.
    """
    pieces = crossing_map.to_cut
    cuts = _lay_out(crossing_map, pieces)
    of_piece = [materials[piece.thread] for piece in pieces]
    return (
        *_holes(cuts, of_piece, target),
        *_webs(cuts, of_piece, target),
        *(() if common else _gaps(cuts, target)),
        *_sizes(cuts, crossing_map.sheets, target),
        *_segments(cuts),
        *_ribbons(findings),
    )


def _lay_out(crossing_map: CrossingMap, pieces: Sequence[PieceRecord]) -> _Cuts:
    """Lay all that is cut on its sheets."""
    outlines, owner, at, size = [], [], [], []
    for index, piece in enumerate(pieces):
        outlines.append(crossing_map.on_sheet(piece, np.array(piece.outline)))
        holes = [cutout.hole for cutout in piece.cutouts if cutout.hole is not None]
        owner += [index] * len(holes)
        size += [diameter for _, _, diameter in holes]
        if holes:
            centres = np.array(holes)[:, :2]
            at.append(crossing_map.on_sheet(piece, centres))
    return _Cuts(
        [piece.id for piece in pieces],
        np.array([piece.sheet for piece in pieces], dtype=np.int64),
        np.array([shapely.Polygon(outline) for outline in outlines], dtype=object),
        np.array(owner, dtype=np.int64),
        np.concatenate(at) if at else np.zeros((0, 2)),
        np.array(size, dtype=np.float64),
    )


def _worst(
    cuts: _Cuts,
    rule: str,
    piece: IntArray,
    at: FloatArray,
    values: FloatArray,
    limits: FloatArray,
    remedy: str,
) -> Iterator[Finding]:
    """Yield for each piece the place that falls shortest of its limit, the worst piece first."""
    share = values / limits
    short = np.flatnonzero(values < limits - _SLACK_MM)
    order = short[np.lexsort((short, share[short], piece[short]))]
    first = np.flatnonzero(np.diff(piece[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    for which in np.argsort(share[order[first]], kind="stable").tolist():
        index, count = int(order[first[which]]), int(counts[which])
        where = cuts.where(int(piece[index]), at[index])
        yield _finding(rule, float(values[index]), float(limits[index]), remedy, where, count)


def _holes(cuts: _Cuts, materials: Sequence[Material], target: Target) -> Iterator[Finding]:
    """Check diameters, and how far holes are from edges."""
    piece, at, hole = cuts.hole_piece, cuts.hole_at, cuts.hole_mm
    of_hole = [materials[index] for index in piece.tolist()]
    thickness = np.array([material.thickness_mm for material in of_hole])
    wanted = np.maximum(target.hole_t * thickness, target.hole_mm)
    # One hole serves the whole job.
    least = max((target.hole_t * material.thickness_mm for material in materials), default=0.0)
    remedy = f"--fastener {_up(max(least, target.hole_mm))}mm"
    yield from _worst(cuts, "hole", piece, at, hole, wanted, remedy)
    # Fasteners want some of the piece around them, and the beam some material at all.
    of_fastener = [hole_edge_mm(*pair) for pair in zip(of_hole, hole.tolist(), strict=True)]
    of_beam = np.maximum(target.edge_t * thickness, target.edge_mm) + hole / 2
    wanted = np.maximum(np.array(of_fastener), of_beam)
    rings = shapely.get_exterior_ring(cuts.polygons)
    edge = np.asarray(shapely.distance(shapely.points(at), rings[piece]))
    remedy = "a smaller --fastener, a larger --size or wider ribbons (--width)"
    yield from _worst(cuts, "hole-edge", piece, at, edge, wanted, remedy)


def _webs(cuts: _Cuts, materials: Sequence[Material], target: Target) -> Iterator[Finding]:
    """Check what is left between holes of a piece, and where a piece has a thin neck."""
    least = np.array(
        [max(target.web_t * material.thickness_mm, target.web_mm) for material in materials]
    )
    remedy = "a larger --size or wider ribbons (--width)"
    parts = [_between_holes(cuts, least), _necks(cuts, least)]
    piece, at, value = (np.concatenate(column) for column in zip(*parts, strict=True))
    yield from _worst(cuts, "web", piece, at, value, least[piece], remedy)


def _between_holes(cuts: _Cuts, least: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return pairs of holes of one piece that are near each other: piece, place, web."""
    reach = float(least.max(initial=0.0)) + float(cuts.hole_mm.max(initial=0.0))
    points = shapely.points(cuts.hole_at)
    first, second = shapely.STRtree(points).query(points, predicate="dwithin", distance=reach)
    keep = (first < second) & (cuts.hole_piece[first] == cuts.hole_piece[second])
    first, second = first[keep], second[keep]
    apart = np.hypot(*(cuts.hole_at[first] - cuts.hole_at[second]).T)
    web = apart - (cuts.hole_mm[first] + cuts.hole_mm[second]) / 2
    return cuts.hole_piece[first], (cuts.hole_at[first] + cuts.hole_at[second]) / 2, web


def _necks(cuts: _Cuts, least: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return where pieces are thinner than the least web: piece, place, width.

    A piece that is eaten away by half of the web from all its edges stays in one if it has no
    neck; how much it takes until it does not is found by halving.
    """
    piece = np.flatnonzero(_in_one(cuts.polygons, least / 2) == 0)
    low, high = np.zeros(len(piece)), least[piece] / 2
    widest = float(least.max(initial=_WIDTH_MM))
    for _ in range(max(_HALVINGS, math.ceil(math.log2(widest / _WIDTH_MM)))):
        middle = (low + high) / 2
        whole = _in_one(cuts.polygons[piece], middle) == 1
        low, high = np.where(whole, middle, low), np.where(whole, high, middle)
    eaten, left = (_eaten(cuts.polygons[piece], by) for by in (high, low))
    # What the last step ate away is the neck, and slivers along all edges, which come back.
    gone = shapely.difference(left, _eaten(eaten, -1.01 * (high - low)))
    places = [_neck_place(*shapes) for shapes in zip(gone, eaten, strict=True)]
    return piece, np.array(places).reshape(-1, 2), 2 * high


def _in_one(polygons: Shapes, by_mm: FloatArray | float) -> npt.NDArray[np.bool_]:
    """Return whether polygons that are eaten away from their edges stay in one."""
    eaten = _eaten(polygons, by_mm)
    return np.asarray((shapely.get_num_geometries(eaten) == 1) & ~shapely.is_empty(eaten))


def _eaten(polygons: Shapes, by_mm: FloatArray | float) -> Shapes:
    """Return polygons without what lies near their edges; grown, if the distance is negative."""
    # Rounded: with mitred corners GEOS now and then loses one of the parts. Sides of the arcs are
    # off them by no more than the widths are.
    most = float(np.abs(by_mm).max(initial=0.0))
    sides = max(4, math.ceil(np.pi / 4 * math.sqrt(most / 2 / _WIDTH_MM)))
    return np.asarray(shapely.buffer(polygons, -np.asarray(by_mm), quad_segs=sides))


def _neck_place(gone: Any, eaten: Any) -> tuple[float, float]:
    """Return a point of the neck: of what is gone, it is next to both of the parts that are left.

    If nothing is left, the piece is as thin as that all over, and it is where it was widest.
    """
    candidates, parts = shapely.get_parts(gone), shapely.get_parts(eaten)
    if len(parts) > 1:
        # A neck that is too short to be among them lies between the parts.
        candidates = np.append(candidates, shapely.shortest_line(parts[0], parts[1]))
        away = np.maximum(*(shapely.distance(candidates, part) for part in parts[:2]))
        neck = candidates[int(np.argmin(np.round(away, 6)))]
    else:
        neck = candidates[int(np.argmax(shapely.area(candidates)))]
    x, y = shapely.get_coordinates(shapely.point_on_surface(neck))[0].tolist()
    return x, y


def _gaps(cuts: _Cuts, target: Target) -> Iterator[Finding]:
    """Check how near pieces of one sheet come to one another."""
    # Sheets lie side by side, too far apart to meet.
    wide = float(shapely.bounds(cuts.polygons)[:, 2].max(initial=0.0)) + 10 * target.gap_mm
    shift = np.repeat(cuts.sheet * wide, shapely.get_num_coordinates(cuts.polygons))
    points = shapely.get_coordinates(cuts.polygons) + np.stack((shift, 0 * shift), axis=1)
    moved = shapely.set_coordinates(cuts.polygons.copy(), points)
    first, second = shapely.STRtree(moved).query(moved, predicate="dwithin", distance=target.gap_mm)
    keep = first < second
    first, second = first[keep], second[keep]
    line = shapely.shortest_line(moved[first], moved[second])
    at = shapely.get_coordinates(line).reshape(-1, 2, 2).mean(axis=1)
    at[:, 0] -= cuts.sheet[first] * wide
    limits = np.full(len(first), target.gap_mm)
    remedy = f"--gap {_up(target.gap_mm)}mm"
    yield from _worst(cuts, "gap", first, at, np.asarray(shapely.length(line)), limits, remedy)


def _sizes(cuts: _Cuts, sheets: Sequence[SheetRecord], target: Target) -> Iterator[Finding]:
    """Check pieces and sheets against the largest that a target takes, either way round."""
    if target.piece_mm is not None:
        boxes = shapely.get_coordinates(shapely.oriented_envelope(cuts.polygons)).reshape(-1, 5, 2)
        sides = np.sort(np.hypot(*np.moveaxis(np.diff(boxes, axis=1)[:, :2], 2, 0)), axis=1)
        most = np.sort(target.piece_mm)
        over = (sides - most).max(axis=1)
        worst_first = np.argsort(-over, kind="stable")
        for index in worst_first[over[worst_first] > _SLACK_MM].tolist():
            worst = int(np.argmax(sides[index] - most))
            where = cuts.where(index, boxes[index, :4].mean(axis=0))
            cure = f"--max-length {np.floor(most[worst]):g}mm"
            yield _finding("piece", sides[index, worst], most[worst], cure, where)
    if target.sheet_mm is not None:
        most = np.sort(target.sheet_mm)
        for sheet in sheets:
            sides = np.sort([sheet.width_mm, sheet.height_mm])
            worst = int(np.argmax(sides - most))
            if sides[worst] > most[worst] + _SLACK_MM:
                cure = f"--sheet {target.sheet_mm[0]:g}x{target.sheet_mm[1]:g}mm"
                yield _finding("sheet", sides[worst], most[worst], cure, f"sheet {sheet.sheet}")


def _segments(cuts: _Cuts) -> Iterator[Finding]:
    """Check that no side of an outline is too short."""
    points, piece = shapely.get_coordinates(cuts.polygons, return_index=True)
    same = piece[1:] == piece[:-1]
    sides = np.hypot(*np.diff(points, axis=0).T)[same]
    at = ((points[1:] + points[:-1]) / 2)[same]
    limits = np.full(len(sides), SHORTEST_SIDE_MM)
    remedy = "reporting this with the mesh and the command"
    yield from _worst(cuts, "segment", piece[1:][same], at, sides, limits, remedy)


def _ribbons(findings: Sequence[BrokenRule]) -> Iterator[Finding]:
    """Take over what was found about widths and bends in space."""
    for found in findings:
        if found.rule in ("width", "bend"):
            cure = found.remedy or "a thinner material"
            yield _finding(found.rule, found.value, found.limit, cure, count=found.count)


def _up(length_mm: float) -> str:
    """Write a length rounded up to a tenth."""
    return f"{np.ceil(length_mm * 10 - 1e-6) / 10:g}"


@frozen_value
class Preflight:
    """The rules that pieces break, and whose rules they are."""

    supplies: Supplies
    target: Target
    findings: tuple[Finding, ...]

    @property
    def all_clear(self) -> str:
        """The message if no rule is broken."""
        return f"no rule is broken: {self.target.title}, {self.supplies.titles}"

    @property
    def record(self) -> dict[str, Any]:
        """The findings as ``preflight.json`` holds them."""
        return preflight_record(self.findings, self.supplies.materials, self.target)
