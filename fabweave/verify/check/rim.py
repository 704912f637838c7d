"""Check rings along rims: unfolded, they have all lengths that the surface has beside its rims."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from fabweave.verify.check.drawings import compare_formats
from fabweave.verify.check.sheets import check_gaps, check_room
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing, Floats
from fabweave.verify.read.job_files import RIM, RIM_RECORD, Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Place, Tally

#: Holes lie where they must to this, and lengths are those of the surface to this.
_SAME_MM, _LENGTH_MM = 0.02, 5e-3
#: A hole keeps two diameters off the edge, less what arcs in place of chords take.
_EDGE, _CHORD_MM = 2.0, 0.05
#: Facets that are turned over have an area of less than this, square millimetres.
_FLAT_MM2 = -1e-3
#: The border may be an arc from vertex to vertex where the rim turns by no more than this, degrees.
_CORNER_DEG = 50.0
#: Rims in the uppermost or lowermost quarter of the object are at the top or the bottom.
_SIDE = 0.25
_TINY = 1e-3
#: Radii are rounded to a tenth, and larger ones than ten metres are flat; per millimetre.
_BENT_MM, _FLATTEST = 0.06, 1e-4


@dataclass(frozen=True, eq=False)
class _Rim:
    """A loop of the boundary: its vertices, each with a crossing beside it, to the right.

    That is as seen from outside, with the rim above. A vertex is there once for each crossing of
    its outermost inner edges; without any it goes with the crossing to its right.
    """

    rungs: list[tuple[int, int]]

    @property
    def vertices(self) -> set[int]:
        return {vertex for vertex, _ in self.rungs}

    @property
    def crossings(self) -> set[int]:
        return {crossing for _, crossing in self.rungs}


def _rims(mesh: LoadedMesh, plan: CrossingMap) -> Iterator[_Rim]:
    """Walk along each boundary with the faces to the right: against its sides."""
    named = {tuple(sorted(one.edge)): one.id for one in plan.crossings}
    left = set(np.flatnonzero(mesh.twin < 0).tolist())
    while left:
        side, rows = min(left), list[tuple[int, int | None]]()
        while side in left:
            left.remove(side)
            vertex = int(mesh.corner[side])
            met = list[int]()
            side = int(mesh.prev[side])
            while mesh.twin[side] >= 0:
                ends = sorted((vertex, int(mesh.corner[side])))
                met.append(named[ends[0], ends[1]])
                side = int(mesh.prev[mesh.twin[side]])
            outer = [met[0], met[-1]] if met else []
            rows += [(vertex, key) for key in dict.fromkeys(outer)] or [(vertex, None)]
        ahead, rungs = next((key for _, key in rows if key is not None), None), []
        for vertex, key in reversed(rows):
            ahead = ahead if key is None else key
            if ahead is not None:
                rungs.append((vertex, ahead))
        yield _Rim(rungs[::-1])


def rim_crossings(mesh: LoadedMesh, plan: CrossingMap) -> set[int]:
    """Return the crossings beside rims."""
    return set[int]().union(*(rim.crossings for rim in _rims(mesh, plan)))


def check_rim(job: Job, tally: Tally) -> None:
    """Check every ring against the rim along which it lies, and against its drawings."""
    plan, mesh = required(job.map), required(job.mesh)
    asked = job.options.get("rim", "none")
    if job.rim is None or asked == "none":
        tally.at(RIM).expect(
            job.rim is None and asked == "none",
            "nobody asked for it"
            if job.rim is not None
            else "rings are asked for, and there is no such folder",
        )
        return
    place = tally.at(RIM_RECORD)
    rims = list(_rims(mesh, plan))
    rings = {
        min(int(rung["vertex"]) for piece in ring["pieces"] for rung in piece["rungs"]): ring
        for ring in job.rings
    }
    place.equal("how many rings there are", len(job.rings), len(rims))
    place.same("lowest vertices of rims with a ring", rings, {min(rim.vertices) for rim in rims})
    for rim in rims:
        if min(rim.vertices) in rings:
            ring = rings[min(rim.vertices)]
            _check_ring(job, ring, rim, place.at(f"ring of {ring['pieces'][0]['id']}"))
    for name, drawing in job.rim.dxf.items():
        place = tally.at(RIM, name)
        size = np.max([[sheet.width_mm, sheet.height_mm] for sheet in plan.sheets], axis=0)
        spacing = plan.layout.margin_mm, plan.layout.gap_mm
        check_side_sheet(drawing, job.rim.svg.get(name), size, spacing, place)


def _check_ring(job: Job, ring: dict[str, Any], rim: _Rim, place: Place) -> None:
    """Check one ring: its figures, that it goes all round, and what it is unfolded from."""
    plan, mesh = required(job.map), required(job.mesh)
    thick = [supply.thickness_mm or 0.0 for supply in job.supplies.values()]
    place.expect(
        any(abs(ring["thickness_mm"] - one) < _TINY for one in thick), "it is of no material here"
    )
    heights = mesh.vertices[:, 2]
    share = (heights[[vertex for vertex, _ in rim.rungs]].mean() - heights.min()) / max(
        float(np.ptp(heights)), _SAME_MM
    )
    radius = _tightest(mesh, rim)
    place.number("radius_mm", ring["radius_mm"] or 0.0, radius, within=_BENT_MM + _TINY * radius)
    where = "bottom" if share < _SIDE else "top" if share > 1.0 - _SIDE else "side"
    place.equal("its side", ring["side"], where)
    courses = [[one for one in ring["pieces"] if bool(one["inside"]) is it] for it in (False, True)]
    place.equal("pieces outside come first", ring["pieces"], [*courses[0], *courses[1]])
    double = job.options.get("rim") == "double"
    place.equal("whether it has pieces inside", bool(courses[1]), double)
    held = {one.id for one in plan.crossings if one.fastened} & rim.crossings
    for course, wanted in zip(courses[: 1 + double], (rim.rungs, rim.rungs[::-1]), strict=False):
        if not _check_course(course, wanted, held, place):
            continue
        for piece in course:
            _check_piece(job, ring, piece, place.at(f"piece {piece['id']}"))


def _tightest(mesh: LoadedMesh, rim: _Rim) -> float:
    """Return the least radius to which a surface bends along a rim; 0 where it stays flat."""
    loop = list(dict.fromkeys(vertex for vertex, _ in rim.rungs))
    out = np.array([_out(mesh, vertex) for vertex in loop])
    points = mesh.vertices[loop]
    bends = [0.0]
    for one, two in zip(range(len(loop)), [*range(1, len(loop)), 0], strict=True):
        way = points[two] - points[one]
        bends.append(abs(float((out[two] - out[one]) @ way)) / float(way @ way))
    return 1.0 / max(bends) if max(bends) > _FLATTEST else 0.0


def _out(mesh: LoadedMesh, vertex: int) -> Floats:
    """Return the mean normal of the faces at a vertex."""
    total = np.zeros(3)
    for face in mesh.face[mesh.corner == vertex].tolist():
        sides = np.flatnonzero(mesh.face == face)
        arms = mesh.vertices[mesh.corner[sides]] - mesh.centres[face]
        ahead = mesh.vertices[mesh.corner[mesh.next[sides]]] - mesh.centres[face]
        area = np.cross(arms, ahead).sum(axis=0)
        total += area / np.linalg.norm(area)
    return np.asarray(total / np.linalg.norm(total))


def _check_course(
    course: Sequence[dict[str, Any]], wanted: list[tuple[int, int]], held: set[int], place: Place
) -> bool:
    """Check that pieces follow one another once around, each from the last hole of the one before.

    Returns
    -------
    bool
        Whether they do.
    """
    runs = [
        [(int(rung["vertex"]), int(rung["crossing"])) for rung in one["rungs"]] for one in course
    ]
    around = [rung for run in runs for rung in run[:-1]]
    turned = around and around[0] in wanted and wanted.index(around[0])
    first = int(turned or 0)
    round_about = all(
        run[-1] == after[0] for run, after in zip(runs, [*runs[1:], *runs[:1]], strict=True)
    )
    if not place.expect(
        len(runs) > 1 and round_about and around == [*wanted[first:], *wanted[:first]],
        "its pieces do not follow one another along the rim, each from the last hole of the one "
        "before",
    ):
        return False
    for one, run in zip(course, runs, strict=True):
        due = [key for key in dict.fromkeys(crossing for _, crossing in run) if key in held]
        ends = {run[0][1], run[-1][1]}
        holes = [int(hole["crossing"]) for hole in one["holes"]]
        within = place.at(f"piece {one['id']}")
        within.equal("crossings of its holes", holes, due)
        within.expect(ends <= held, "it ends where no fastener holds it")
    return True


def _raised(job: Job, piece: dict[str, Any], by: float) -> tuple[Floats, Floats]:
    """Return both ends of a piece's rungs in space, on the face of the strands."""
    plan, mesh = required(job.map), required(job.mesh)
    by = -by if piece["inside"] else by
    inner = {
        tuple(sorted((int(mesh.corner[one]), int(mesh.corner[mesh.next[one]])))): one
        for one in mesh.inner.tolist()
    }
    rim, foot = [], []
    for rung in piece["rungs"]:
        vertex, crossing = int(rung["vertex"]), plan.crossing[int(rung["crossing"])]
        rim.append(mesh.vertices[vertex] + by * _out(mesh, vertex))
        side = inner[tuple(sorted(crossing.edge))]
        start, end = mesh.vertices[mesh.corner[[side, mesh.next[side]]]]
        between = mesh.centres[mesh.face[side]] - mesh.centres[mesh.face[mesh.twin[side]]]
        out = np.cross(end - start, between)
        foot.append(np.array(crossing.position) + by * out / np.linalg.norm(out))
    return np.array(rim), np.array(foot)


def _check_piece(job: Job, ring: dict[str, Any], piece: dict[str, Any], place: Place) -> None:
    """Check that a piece is unfolded from beside its rim, and that its drawing has it so."""
    above = 1.5 * float(ring["thickness_mm"]) + (job.clearance_mm or 0.0) / 2.0
    rim, foot = _raised(job, piece, above)
    flat_rim, flat_foot = (
        np.array([rung[name] for rung in piece["rungs"]]).reshape(-1, 2) for name in ("rim", "foot")
    )
    off = np.concatenate(
        [
            _lengths(flat_rim - flat_foot) - _lengths(rim - foot),
            _lengths(np.diff(flat_rim, axis=0)) - _lengths(np.diff(rim, axis=0)),
            _lengths(np.diff(flat_foot, axis=0)) - _lengths(np.diff(foot, axis=0)),
        ]
    )
    # A quad is flat, or folded along one diagonal: that one keeps its length, too.
    diagonals = [
        np.abs(_lengths(a[:-1] - b[1:]) - _lengths(c[:-1] - d[1:]))
        for a, b, c, d in ((flat_rim, flat_foot, rim, foot), (flat_foot, flat_rim, foot, rim))
    ]
    place.at_most(
        "ring_mm",
        max(float(np.abs(off).max()), float(np.minimum(*diagonals).max())),
        _LENGTH_MM,
        "a length beside the rim is {} from that of the surface",
    )
    first = diagonals[0] <= diagonals[1]
    corner = np.where(first[:, None], flat_rim[:-1], flat_rim[1:])
    apex = np.where(first[:, None], flat_foot[1:], flat_foot[:-1])
    areas = np.concatenate(
        [
            _areas(flat_foot[:-1], flat_foot[1:], corner),
            _areas(apex, flat_rim[1:], flat_rim[:-1]),
        ]
    )
    place.expect(bool(areas.min() > _FLAT_MM2), "it is turned over, or folds onto itself")
    holes = np.array([(hole["x"], hole["y"], hole["hole_mm"]) for hole in piece["holes"]])
    feet = {int(rung["crossing"]): rung["foot"] for rung in piece["rungs"]}
    wanted = np.array([feet[int(hole["crossing"])] for hole in piece["holes"]])
    place.at_most(
        "ring_mm",
        float(_lengths(holes[:, :2] - wanted).max()),
        _SAME_MM,
        "a hole is {} from where its crossing comes to lie",
    )
    drawing = required(job.rim).dxf.get(str(piece["sheet"]))
    if drawing is None:
        place.fail(f"{piece['sheet']}.dxf could not be read")
        return
    circles = drawing.of(HOLES, str(piece["id"]))
    drawn = np.array([(*one.points.mean(axis=0), 2.0 * (one.radius or 0.0)) for one in circles])
    matched = len(drawn) == len(holes) and bool(
        np.abs(drawn[np.lexsort(drawn.T)] - holes[np.lexsort(holes.T)]).max() < _SAME_MM
    )
    place.expect(matched, "the drawing has other holes than the record")
    lines = drawing.of(OUTLINES, str(piece["id"]))
    if place.expect(len(lines) == 1 and lines[0].closed, "it has not one closed outline"):
        _check_outline(ring, lines[0].traced, flat_rim, holes, place)


def _check_outline(
    ring: dict[str, Any], outline: Floats, rim: Floats, holes: Floats, place: Place
) -> None:
    """Check that an outline runs along the rim on one side, and is as wide as it is said to be."""
    border, shape = shapely.LinearRing(outline), shapely.Polygon(outline)
    if not place.expect(shape.is_valid, "its outline crosses itself"):
        return
    inside = shapely.contains(shape, shapely.points(holes[:, :2]))
    near = np.where(inside, shapely.distance(shapely.points(holes[:, :2]), border), 0.0)
    near /= holes[:, 2]
    place.at_least("edge", float(near.min()), _EDGE - _CHORD_MM, "a hole is {} diameters off")
    over, width = float(ring["over_mm"]), float(ring["width_mm"])
    # Those at the ends may lie beyond the lap.
    inner = rim[1:-1]
    if len(inner):
        away = shapely.distance(shapely.points(inner), border)
        # In a corner that turns in, the border is farther off than along its sides.
        place.at_least(
            "rim_mm", float(away.min()), over - _SAME_MM, "the border is {} from the rim"
        )
        place.at_most(
            "rim_mm", float(away.max()), 1.5 * over + _SAME_MM, "the border is {} from the rim"
        )
    keep = np.append(True, _lengths(np.diff(rim, axis=0)) > _SAME_MM)
    line = rim[keep]
    ways = np.diff(line, axis=0)
    long = _lengths(ways)
    ways /= long[:, None]
    middles = (line[1:] + line[:-1]) / 2.0
    down = np.column_stack((ways[:, 1], -ways[:, 0]))
    shares = np.abs(np.degrees(np.angle(ways[1:] @ [1, 1j] / (ways[:-1] @ [1, 1j]))))
    bend = float(shares[shares <= _CORNER_DEG].max(initial=0.0))
    bulge = float(long.max()) / 2.0 * np.tan(np.radians(bend) / 4.0)
    depths = [
        shapely.intersection(shape, shapely.LineString([at, at + 2.0 * width * way])).length
        for at, way in zip(middles, down, strict=True)
        if shapely.contains_xy(shape, *(at + (bulge + _SAME_MM) * way))
    ]
    if place.expect(bool(depths), "it is beside no side of the rim"):
        deep = width - over
        place.number("width_mm", min(depths) + over, width, within=float(bulge) + _CHORD_MM)
        least = float(np.min(holes[:, 2])) * _EDGE
        place.at_least("width_mm", deep, least, "it is {} wide")


def _lengths(ways: Floats) -> Floats:
    return np.asarray(np.linalg.norm(ways, axis=1))


def _areas(one: Floats, two: Floats, three: Floats) -> Floats:
    """Return the areas of triangles, positive if they turn left."""
    (a, b), (c, d) = (two - one).T, (three - one).T
    return np.asarray((a * d - b * c) / 2.0)


def check_side_sheet(
    drawing: Drawing,
    other: Drawing | None,
    size: Floats,
    spacing: tuple[float, float],
    place: Place,
) -> None:
    """Check that parts on a sheet keep its margin, and the gap apart; and that its SVG is alike."""
    for problem in drawing.problems:
        place.fail(problem)
    shapes = [one for one in drawing.shapes if one.layer == OUTLINES]
    polygons = np.array([shapely.Polygon(one.traced) for one in shapes])
    names = [str(one.piece) for one in shapes]
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * size
    margin_mm, gap_mm = spacing
    check_room(names, polygons, outline, margin_mm - _SAME_MM, place)
    check_gaps(names, polygons, gap_mm - _SAME_MM, place)
    if place.expect(other is not None, "there is no SVG beside the DXF"):
        for problem in (other or drawing).problems:
            place.at("svg").fail(problem)
        compare_formats(other or drawing, drawing, place.at("svg"))
