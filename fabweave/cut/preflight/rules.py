"""Check a job's pieces against the rules of those who cut them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.cut.preflight.targets import Target
from fabweave.cut.preflight.violations import Flaw, Rule
from fabweave.flat.outline import SHORTEST_SIDE_MM
from fabweave.stock.material import Material, hole_edge_mm

Shapes: TypeAlias = npt.NDArray[Any]

# Values this near to a limit are taken to keep it: files hold a millionth of a millimetre.
_SLACK_MM = 1e-4
# Halvings by which the width of a neck is found: a thousandth of the limit, or this if it is less.
_HALVINGS, _WIDTH_MM = 10, 0.01


class _Cuts(NamedTuple):
    """The pieces of a plan on their sheets, and their holes."""

    names: list[str]
    sheet: IntArray
    polygons: Shapes
    hole_piece: IntArray
    hole_at: FloatArray
    hole_mm: FloatArray


def preflight(
    plan: Mapping[str, Any],
    ribbons: Mapping[str, Any],
    materials: Sequence[Material],
    target: Target,
) -> tuple[Flaw, ...]:
    """Check every piece of a plan against the rules of its material and a target.

    Parameters
    ----------
    plan : mapping
        What ``crossing_map.json`` holds.
    ribbons : mapping
        What ``ribbons.json`` holds; its findings about widths and bends count as rules, too.
    materials : sequence of Material
        That of each thread.
    target : Target

    Returns
    -------
    tuple of Flaw
        For each rule and piece that breaks it the worst place; by rules, then by pieces.
    """
    cuts = _read_cuts(plan)
    own = [materials[piece["thread"]] for piece in plan["pieces"]]
    return (
        *_holes(cuts, own, target),
        *_webs(cuts, own, target),
        *_gaps(cuts, target),
        *_sizes(cuts, plan, target),
        *_segments(cuts),
        *_ribbons(ribbons),
    )


def _read_cuts(plan: Mapping[str, Any]) -> _Cuts:
    """Lay the pieces of a plan on their sheets."""
    pieces = plan["pieces"]
    names = [piece["id"] for piece in pieces]
    outlines, owner, at, size = [], [], [], []
    joints = {joint["id"]: joint for joint in plan["joints"]}
    mirrors = {
        sheet["sheet"]: sheet["width_mm"] for sheet in plan["sheets"] if sheet.get("mirrored")
    }
    for index, piece in enumerate(pieces):
        place = {**piece["placement"], "mirror_mm": mirrors.get(piece["sheet"])}
        outlines.append(_placed(np.array(piece["outline"]), place))
        drilled = _holes_of(piece, joints)
        owner += [index] * len(drilled)
        size += [hole for _, hole in drilled]
        if drilled:
            at.append(_placed(np.array([point for point, _ in drilled]), place))
    return _Cuts(
        names,
        np.array([piece["sheet"] for piece in pieces], dtype=np.int64),
        np.array([shapely.Polygon(outline) for outline in outlines], dtype=object),
        np.array(owner, dtype=np.int64),
        np.concatenate(at) if at else np.zeros((0, 2)),
        np.array(size, dtype=np.float64),
    )


def _holes_of(
    piece: Mapping[str, Any], joints: Mapping[int, Any]
) -> list[tuple[tuple[float, float], float]]:
    """Return the holes of a piece, as centres and diameters.

    Where a piece does not list its cut-outs, those of a joint are as wide as the one at its
    station, which may be one of them.
    """
    if "cutouts" in piece:
        holes = [cutout for cutout in piece["cutouts"] if cutout["kind"] == "hole"]
        return [((hole["x"], hole["y"]), hole["diameter_mm"]) for hole in holes]
    stations = piece["stations"]
    found = {
        (station["x"], station["y"]): station["hole_mm"]
        for station in stations
        if station["hole_mm"] is not None
    }
    for joint, side, end in zip(piece["joints"], (1, 0), (0, -1), strict=True):
        if joint is None:
            continue
        for pair in joints[joint]["holes"]:
            found.setdefault(tuple(pair[side]), stations[end]["hole_mm"])
    return list(found.items())


def _placed(points: FloatArray, place: Mapping[str, Any]) -> FloatArray:
    """Return points of a piece where they are drawn on its sheet, which may be mirrored."""
    angle = np.deg2rad(place["rotation_deg"])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    placed = np.asarray(points @ turn.T + [place["x_mm"], place["y_mm"]])
    if place["mirror_mm"] is not None:
        placed[:, 0] = place["mirror_mm"] - placed[:, 0]
    return placed


def _worst(
    cuts: _Cuts,
    rule: Rule,
    piece: IntArray,
    at: FloatArray,
    values: FloatArray,
    limits: FloatArray,
    remedy: str,
) -> Iterator[Flaw]:
    """Yield for each piece the place that falls shortest of its limit, and how many do."""
    short = np.flatnonzero(values < limits - _SLACK_MM)
    order = short[np.lexsort((short, values[short] / limits[short], piece[short]))]
    first = np.flatnonzero(np.diff(piece[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    for index, count in zip(order[first].tolist(), counts.tolist(), strict=True):
        place = (round(float(at[index, 0]), 3), round(float(at[index, 1]), 3))
        own = int(piece[index])
        yield Flaw(
            rule, cuts.names[own], int(cuts.sheet[own]), place, float(values[index]),
            float(limits[index]), count, remedy,
        )  # fmt: skip


def _holes(cuts: _Cuts, materials: Sequence[Material], target: Target) -> Iterator[Flaw]:
    """Check diameters, and how far holes are from edges."""
    piece, at, hole = cuts.hole_piece, cuts.hole_at, cuts.hole_mm
    own = [materials[index] for index in piece.tolist()]
    wanted = np.array([max(target.hole_t * one.thickness_mm, target.hole_mm) for one in own])
    # One hole serves the whole job.
    least = max((target.hole_t * one.thickness_mm for one in materials), default=0.0)
    remedy = f"--hole {_up(max(least, target.hole_mm))}mm"
    yield from _worst(cuts, "hole", piece, at, hole, wanted, remedy)
    # Fasteners want some of the piece around them, and the beam some material at all.
    wanted = np.array(
        [
            max(hole_edge_mm(one, d), max(target.edge_t * one.thickness_mm, target.edge_mm) + d / 2)
            for one, d in zip(own, hole.tolist(), strict=True)
        ]
    )
    rings = shapely.get_exterior_ring(cuts.polygons)
    edge = np.asarray(shapely.distance(shapely.points(at), rings[piece]))
    remedy = "a smaller --hole, a larger --size or wider ribbons (--width)"
    yield from _worst(cuts, "hole-edge", piece, at, edge, wanted, remedy)


def _webs(cuts: _Cuts, materials: Sequence[Material], target: Target) -> Iterator[Flaw]:
    """Check what is left between holes of a piece, and where a piece has a thin neck."""
    least = np.array([max(target.web_t * one.thickness_mm, target.web_mm) for one in materials])
    remedy = "a larger --size or wider ribbons (--width)"
    parts = [_between_holes(cuts, least), _necks(cuts, least)]
    piece, at, value = (np.concatenate(column) for column in zip(*parts, strict=True))
    yield from _worst(cuts, "web", piece, at, value, least[piece], remedy)


def _between_holes(cuts: _Cuts, least: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return pairs of holes of one piece that are near each other: piece, place, web."""
    reach = float(least.max(initial=0.0)) + float(cuts.hole_mm.max(initial=0.0))
    points = shapely.points(cuts.hole_at)
    one, other = shapely.STRtree(points).query(points, predicate="dwithin", distance=reach)
    keep = (one < other) & (cuts.hole_piece[one] == cuts.hole_piece[other])
    one, other = one[keep], other[keep]
    apart = np.hypot(*(cuts.hole_at[one] - cuts.hole_at[other]).T)
    web = apart - (cuts.hole_mm[one] + cuts.hole_mm[other]) / 2
    return cuts.hole_piece[one], (cuts.hole_at[one] + cuts.hole_at[other]) / 2, web


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


def _gaps(cuts: _Cuts, target: Target) -> Iterator[Flaw]:
    """Check how near pieces of one sheet come to one another."""
    # Sheets lie side by side, too far apart to meet.
    wide = float(shapely.bounds(cuts.polygons)[:, 2].max(initial=0.0)) + 10 * target.gap_mm
    shift = np.repeat(cuts.sheet * wide, shapely.get_num_coordinates(cuts.polygons))
    points = shapely.get_coordinates(cuts.polygons) + np.stack((shift, 0 * shift), axis=1)
    moved = shapely.set_coordinates(cuts.polygons.copy(), points)
    one, other = shapely.STRtree(moved).query(moved, predicate="dwithin", distance=target.gap_mm)
    keep = one < other
    one, other = one[keep], other[keep]
    line = shapely.shortest_line(moved[one], moved[other])
    at = shapely.get_coordinates(line).reshape(-1, 2, 2).mean(axis=1)
    at[:, 0] -= cuts.sheet[one] * wide
    limits = np.full(len(one), target.gap_mm)
    remedy = f"--gap {_up(target.gap_mm)}mm"
    yield from _worst(cuts, "gap", one, at, np.asarray(shapely.length(line)), limits, remedy)


def _sizes(cuts: _Cuts, plan: Mapping[str, Any], target: Target) -> Iterator[Flaw]:
    """Check pieces and sheets against the largest that a target takes, either way round."""
    if target.piece_mm is not None:
        boxes = shapely.get_coordinates(shapely.oriented_envelope(cuts.polygons)).reshape(-1, 5, 2)
        sides = np.sort(np.hypot(*np.moveaxis(np.diff(boxes, axis=1)[:, :2], 2, 0)), axis=1)
        most = np.sort(target.piece_mm)
        for index in np.flatnonzero(np.any(sides > most + _SLACK_MM, axis=1)).tolist():
            worst = int(np.argmax(sides[index] - most))
            centre = boxes[index, :4].mean(axis=0).round(3).tolist()
            yield Flaw(
                "piece", cuts.names[index], int(cuts.sheet[index]), (centre[0], centre[1]),
                float(sides[index, worst]), float(most[worst]), 1,
                f"--max-length {np.floor(most[worst]):g}mm",
            )  # fmt: skip
    if target.sheet_mm is not None:
        most = np.sort(target.sheet_mm)
        for sheet in plan["sheets"]:
            sides = np.sort([sheet["width_mm"], sheet["height_mm"]])
            worst = int(np.argmax(sides - most))
            if sides[worst] > most[worst] + _SLACK_MM:
                remedy = f"--sheet {target.sheet_mm[0]:g}x{target.sheet_mm[1]:g}mm"
                value, limit = float(sides[worst]), float(most[worst])
                yield Flaw("sheet", None, int(sheet["sheet"]), None, value, limit, 1, remedy)


def _segments(cuts: _Cuts) -> Iterator[Flaw]:
    """Check that no side of an outline is too short."""
    points, piece = shapely.get_coordinates(cuts.polygons, return_index=True)
    same = piece[1:] == piece[:-1]
    sides = np.hypot(*np.diff(points, axis=0).T)[same]
    at = ((points[1:] + points[:-1]) / 2)[same]
    limits = np.full(len(sides), SHORTEST_SIDE_MM)
    remedy = "reporting this with the mesh and the command"
    yield from _worst(cuts, "segment", piece[1:][same], at, sides, limits, remedy)


def _ribbons(ribbons: Mapping[str, Any]) -> Iterator[Flaw]:
    """Take over what was found about widths and bends in space."""
    for found in ribbons["findings"]:
        if found["rule"] in ("width", "bend"):
            remedy = found["remedy"] or "a thinner material"
            value, limit = float(found["value"]), float(found["limit"])
            yield Flaw(found["rule"], None, None, None, value, limit, int(found["count"]), remedy)


def _up(length_mm: float) -> str:
    """Write a length rounded up to a tenth."""
    return f"{np.ceil(length_mm * 10 - 1e-6) / 10:g}"
