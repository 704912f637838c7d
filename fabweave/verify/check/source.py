"""Check the woven mesh against the settings, and that what the map names is there."""

from collections import Counter
from collections.abc import Container, Iterator, Sequence
from typing import Any

import numpy as np
import scipy

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.walks import joined
from fabweave.verify.read.job_files import AIMED, Job, length_of, required
from fabweave.verify.read.mesh import LoadedMesh, SourceMesh
from fabweave.verify.report import Place, Tally, stated_number


def check_references(job: Job, tally: Tally) -> None:
    """Check ids and references of the crossing map, the mesh and the model."""
    plan = job.map
    if plan is None:
        return
    for what, ids in (
        ("sheet numbers", [sheet.number for sheet in plan.sheets]),
        ("sheet names", [sheet.name for sheet in plan.sheets]),
        ("thread ids", [thread.id for thread in plan.threads]),
        ("thread labels", [thread.label for thread in plan.threads]),
        ("crossing ids", [crossing.id for crossing in plan.crossings]),
        ("piece ids", [piece.id for piece in plan.to_cut]),
        ("joint ids", [joint.id for joint in plan.joints]),
        ("step numbers", [step.step for step in plan.steps]),
    ):
        repeated = [key for key, count in Counter(ids).items() if count > 1]
        tally.at(what).expect(not repeated, f"{repeated[:3]} are used more than once")
    known: dict[str, Container[object]] = {
        "thread": plan.thread, "crossing": plan.crossing, "piece": plan.piece,
        "joint": {None, *plan.joint}, "sheet": plan.sheet,
        "vertex": range(len(job.mesh.vertices) if job.mesh is not None else 0),
    }  # fmt: skip
    for where, what, names in _references(plan):
        if what != "vertex" or job.mesh is not None:
            lost = [name for name in names if name not in known[what]]
            tally.at(where).expect(not lost, f"there is no {what} {lost[:3]}")
    for thread in plan.threads:
        place = tally.at(f"thread {thread.label}")
        place.equal("the number of over flags", len(thread.over), len(thread.crossings))
        if job.model is not None and thread.crossings:
            strip = job.model.get(thread.label)
            place.at("model.glb").equal(
                "its number of panels, and whether it is closed,",
                strip and (len(strip.entry), strip.closed),
                (len(thread.crossings), thread.closed),
            )
    for crossing in plan.crossings:
        for strand in (crossing.over, crossing.under):
            piece = plan.piece.get(strand.piece)
            tally.at(f"crossing {crossing.id}").expect(
                piece is not None and 0 <= strand.station < len(piece.stations),
                f"piece {strand.piece} has no station {strand.station}",
            )


def _references(plan: CrossingMap) -> Iterator[tuple[str, str, Sequence[object]]]:
    """Yield where the map names things, what they are, and their names."""
    for thread in plan.threads:
        yield f"thread {thread.label}", "crossing", thread.crossings
        yield f"thread {thread.label}", "piece", thread.pieces
    for crossing in plan.crossings:
        strands = crossing.over, crossing.under
        yield f"crossing {crossing.id}", "vertex", crossing.edge
        yield f"crossing {crossing.id}", "thread", [strand.thread for strand in strands]
    for piece in plan.pieces:
        where = f"piece {piece.id}"
        yield where, "thread", [piece.thread]
        yield where, "joint", [*piece.joints, *(station.joint for station in piece.stations)]
        yield where, "crossing", [station.crossing for station in piece.stations]
        yield where, "piece", [station.partner for station in piece.stations]
    for piece in plan.to_cut:
        yield f"piece {piece.id}", "sheet", [piece.sheet]
    for joint in plan.joints:
        yield f"joint {joint.id}", "crossing", [joint.crossing]
        yield f"joint {joint.id}", "piece", joint.pieces
    for step in plan.steps:
        where = f"step {step.step}"
        yield where, "piece", step.pieces
        yield where, "crossing", (*step.crossings, *step.over, *step.under, *step.fasten)
        clips = (*step.clips, *step.unclips)
        yield where, "crossing", (*step.outside, *(key for key, *_ in clips))
        yield where, "piece", [name for _, *names in clips for name in names]
        yield where, "joint", step.joints


#: Sizes come of a multiplication or a few; corners may have been welded to others near by.
_SIZE, _WELDED = 1e-9, 1e-5
#: Lengths in job.toml are rounded to a thousandth.
_ROUNDED_MM = 1e-3


def check_source(job: Job, tally: Tally) -> None:
    """Check the size of the woven mesh, and its faces where those that it comes from are known.

    All of it holds of the mesh that the object settles onto, where that is another one. A size is
    its greatest extent, whatever was done to the mesh; where faces were left out afterwards, of
    what was there before. Remeshing and refining make other faces; fairing and symmetry move their
    corners.
    """
    mesh, options = required(job.wished), job.options
    place = tally.at("woven_mesh.obj" if job.aimed is None else AIMED).against("job.toml")
    extent = _extent(mesh.vertices[mesh.corner])
    asked = str(options.get("leave_out") or "")
    if (size := length_of(options.get("size"))) is not None:
        if asked:
            place.at_most("its greatest extent", extent, size * (1.0 + _SIZE), "the size")
        else:
            place.number("its greatest extent", extent, size, within=_SIZE * size)
    halved = options.get("pattern") == "triaxial"
    if asked or job.openings:
        _check_openings(job, asked, tally.at("job.toml", "outcome", "openings"), halved=halved)
    finer = bool(options.get("refine")) or halved
    if options.get("remesh", "none") != "none" or finer or options.get("bodies", "all") != "all":
        return
    if job.source is not None:
        _check_faces(job, job.source, place.against(job.source.name))


def _extent(points: Floats) -> float:
    """Return the largest side of the bounding box of some points."""
    return float(np.ptp(points, axis=0).max())


def _check_openings(job: Job, asked: str, place: Place, *, halved: bool) -> None:
    """Check that what was asked for was left out, and that each opening has its rim.

    Some boundary has as many vertices as a rim, none further off the circle than stated, and with
    as many on it. ``halved`` is whether each edge of a rim got a vertex in its middle afterwards.
    """
    parts = [part.strip().partition(":") for part in asked.split(",") if part]
    diameters = {side: length_of(length) for side, colon, length in parts if colon}
    numbers = len({side for side, colon, _ in parts if not colon})
    wanted = [*(["faces"] if numbers else []), *diameters]
    if not place.equal(
        "what was left out, by side,", [one.get("side") for one in job.openings], wanted
    ):
        return
    mesh = required(job.wished)
    loops = _boundaries(mesh)
    for one in job.openings:
        side = str(one["side"])
        here = place.at(side)
        if side == "faces":
            here.number("faces", one.get("faces"), numbers)
            continue
        here.number("diameter_mm", one.get("diameter_mm"), diameters[side])
        rim, beside, off = (stated_number(one, key) for key in ("rim", "off", "off_mm"))
        found = False
        for loop in loops:
            # What was cut at the middles of edges afterwards is not on the circle.
            away = _off_circle(mesh.vertices[loop], one)
            near, on = (np.count_nonzero(away <= by + _ROUNDED_MM) for by in (off, 0.0))
            found |= bool(near >= rim > 1 and on >= rim - beside and (halved or len(loop) >= rim))
        here.expect(
            found,
            f"no boundary of the mesh has {rim:g} vertices within {off:g} mm of its circle, "
            f"and {rim - beside:g} on it",
        )


def _off_circle(points: Floats, opening: dict[str, Any]) -> Floats:
    """Return how far points are in plan from the circle of an opening."""
    x, y, diameter = (stated_number(opening, key) for key in ("x_mm", "y_mm", "diameter_mm"))
    return np.asarray(np.abs(np.hypot(points[..., 0] - x, points[..., 1] - y) - diameter / 2.0))


def _boundaries(mesh: LoadedMesh) -> list[Ints]:
    """Return the vertices of each boundary loop of a mesh."""
    rim = np.flatnonzero(mesh.twin < 0)
    ahead = dict(zip(mesh.corner[rim].tolist(), mesh.corner[mesh.next[rim]].tolist(), strict=True))
    loops = []
    while ahead:
        loop = [next(iter(ahead))]
        while (following := ahead.pop(loop[-1], None)) is not None:
            loop.append(following)
        loops.append(np.array(loop[:-1]))
    return loops


def _check_faces(job: Job, source: SourceMesh, place: Place) -> None:
    """Check that the faces are those of the mesh that was given: centred, turned upright, scaled.

    Those that were left out are not there; faces at rims were drawn to their circles; what lay on
    another face, or hung on nothing, may have gone.
    """
    mesh, options, openings = required(job.wished), job.options, job.openings
    faces = [face for face in source.faces if len(face) > 2]
    turn = _upright(str(options.get("up", "z")))
    if turn is None:
        place.fail(f"the way up {options['up']!r} is no direction")
        return
    whole = np.concatenate(source.faces)
    middle = 0.5 * (whole.min(axis=0) + whole.max(axis=0))
    given = (np.concatenate(faces) - middle) @ turn.T
    points = mesh.vertices[mesh.corner]
    scale, extent, taken = 1.0, _extent(points), job.taken
    if taken:
        scale = stated_number(taken, "scale")
    elif (size := length_of(options.get("size"))) is not None and _extent(given) > 0.0:
        # What was left out was there when it was brought to size.
        scale = (size if openings else extent) / _extent(given)
    near = _WELDED * extent
    weld = str(options.get("weld", ""))
    near = max(near, length_of(weld) or 0.0) if weld not in ("", "all", "none") else near
    there = _faces(points, np.bincount(mesh.face), near)
    due = _faces(scale * given, np.array([len(face) for face in faces]), near)
    if taken:
        _check_taken(taken, there, due, near, place)
        return
    alike, spare, holed = _excused(due, near)
    gone = sum(int(stated_number(one, "faces")) for one in openings)
    most = len(due) - gone
    if not (spare or holed):
        if not place.equal("the number of its faces", len(there), most):
            return
    elif not place.expect(
        bool(holed) or most - len(spare) <= len(there) <= most,
        f"it has {len(there)} faces, but {source.name} has {most}, of which {len(spare)} may go",
    ):
        return
    if options.get("fair") or options.get("symmetrise"):
        return  # these move corners along the surface
    tree = scipy.spatial.KDTree([face.mean(axis=0) for face in due])
    nearest = np.asarray(tree.query([face.mean(axis=0) for face in there])[1])
    numbers = str(options.get("leave_out") or "").split(",")
    lost = set() if spare else {int(number) for number in numbers if number.isdigit()}
    rims = [one for one in openings if "diameter_mm" in one]
    # A face around a hole was parted: its parts have corners of it.
    parts = scipy.spatial.KDTree(np.concatenate([due[one] for one in holed])) if holed else None
    off = [
        at
        for at, (face, other) in enumerate(zip(there, nearest.tolist(), strict=True))
        if (other in lost or not _same(face, due[other], 4.0 * near))
        and not any((_off_circle(face, one) <= _ROUNDED_MM).any() for one in rims)
        and not (parts is not None and bool(np.all(parts.query(face)[0] <= 4.0 * near)))
    ]
    place.count(len(there))
    if off:
        place.fail(
            f"{len(off)} faces are not as in {source.name}, first face {off[0]}; if that file was "
            "changed after the job was made, make the job again"
        )
    missing = sorted(set(alike.tolist()) - set(alike[nearest].tolist()) - spare - holed)
    if not off and len(missing) > gone:
        place.fail(f"{len(missing)} faces of {source.name} are not there, first face {missing[0]}")


def _check_taken(
    taken: dict[str, Any], there: list[Floats], due: list[Floats], near: float, place: Place
) -> None:
    """Check that the faces are some of those that were given, or lie on them as is stated.

    Where rims were cut, faces may be parts of given ones, whose corners lie on these; as many as
    were added may have corners of them.
    """
    tree = scipy.spatial.KDTree([face.mean(axis=0) for face in due])
    nearest = np.asarray(tree.query([face.mean(axis=0) for face in there])[1])
    strange, used = list[Floats](), set[int]()
    for face, other in zip(there, nearest.tolist(), strict=True):
        if other in used or not _same(face, due[other], 4.0 * near):
            strange.append(face)
        else:
            used.add(other)
    place.count(len(there))
    corners = scipy.spatial.KDTree(np.concatenate(due))
    added = [face for face in strange if bool(np.all(corners.query(face)[0] <= 4.0 * near))]
    most = int(stated_number(taken, "added"))
    if not taken.get("cut"):
        place.expect(
            len(strange) == len(added) <= most,
            f"{len(strange)} faces are not as they were given, but {most} were added",
        )
        return
    triangles = np.concatenate([_fan(face) for face in due])
    off = [_off_triangles(point, triangles) for face in strange for point in face]
    place.expect(
        max(off, default=0.0) <= 4.0 * near,
        f"faces have corners up to {max(off, default=0.0):.3g} mm off those that were given",
    )


def _fan(face: Floats) -> Floats:
    """Cut a face into triangles around its middle, (N, 3, 3)."""
    middle = np.broadcast_to(face.mean(axis=0), face.shape)
    return np.stack([middle, face, np.roll(face, -1, axis=0)], axis=1)


def _off_triangles(point: Floats, triangles: Floats) -> float:
    """Return how far a point is from the nearest of some triangles, (T, 3, 3)."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    square = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-300)
    height = np.einsum("ij,ij->i", point - a, normal) / np.sqrt(square)
    off = np.full(len(triangles), np.inf)
    inside = np.ones(len(triangles), dtype=bool)
    for one, two in ((a, b), (b, c), (c, a)):
        side, way = two - one, point - one
        length = np.maximum(np.einsum("ij,ij->i", side, side), 1e-300)
        at = np.clip(np.einsum("ij,ij->i", way, side) / length, 0.0, 1.0)
        off = np.minimum(off, np.linalg.norm(way - at[:, None] * side, axis=1))
        inside &= np.einsum("ij,ij->i", np.cross(side, way), normal) >= 0.0
    return float(np.where(inside, np.abs(height), off).min())


def _excused(faces: list[Floats], near: float) -> tuple[Ints, set[int], set[int]]:
    """Return on which face, the first of its kind, each lies, and which faces need not be there.

    The latter are those that lie on an earlier one, or share no side with any other; and apart from
    them those that pass a place twice, as around a hole.
    """
    corners = np.concatenate(faces)
    pairs = scipy.spatial.KDTree(corners).query_pairs(near, output_type="ndarray")
    rings = np.split(joined(pairs, len(corners)), np.cumsum([len(face) for face in faces])[:-1])
    sides = Counter(
        frozenset(side)
        for ring in rings
        for side in zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)
    )
    spare, seen = set[int](), dict[frozenset[int], int]()
    for number, ring in enumerate(rings):
        members = frozenset(ring.tolist())
        ways = zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)
        if seen.setdefault(members, number) < number or all(
            sides[frozenset(way)] == 1 for way in ways
        ):
            spare.add(number)
    alike = np.array([seen[frozenset(ring.tolist())] for ring in rings])
    holed = {number for number, ring in enumerate(rings) if len(set(ring.tolist())) < len(ring)}
    return alike, spare, holed


def _upright(text: str) -> Floats | None:
    """Return the rotation, for columns, that a way up asks for; None if it is no direction.

    A quarter turn or less, or more, about a level axis takes it to z. A way up that leans to x is
    then turned about z, clockwise by as many quarters as it has of x.
    """
    sign = -1.0 if text[:1] == "-" else 1.0
    if (letter := text.removeprefix("-")) in ("x", "y", "z"):
        way = sign * np.eye(3)["xyz".index(letter)]
    else:
        try:
            way = np.array([float(part) for part in text.split(",")])
        except ValueError:
            return None
    length = float(np.linalg.norm(way))
    if way.shape != (3,) or not 0.0 < length < np.inf:
        return None
    by = scipy.spatial.transform.Rotation.from_rotvec
    level = float(np.hypot(way[0], way[1]))
    axis = way[[1, 0]] * (1.0, -1.0) / level if level else np.array([1.0, 0.0])
    tilt = by([*(np.arctan2(level, way[2]) * axis), 0.0])
    turned: Floats = (by([0.0, 0.0, -0.5 * np.pi * way[0] / length]) * tilt).as_matrix()
    return turned


def _faces(points: Floats, sizes: Ints, near: float) -> list[Floats]:
    """Part corners into faces, without corners at the place of the one before, or on a side.

    The first may have been joined, the second put in for a neighbour's sake; faces may have been
    left out that have fewer than three others.
    """
    for straight in (False, True):
        last = np.cumsum(sizes) - 1
        first = last - sizes + 1
        before = np.arange(len(points)) - 1
        before[first[sizes > 0]] = last[sizes > 0]
        after = np.arange(len(points)) + 1
        after[last[sizes > 0]] = first[sizes > 0]
        way, side = points - points[before], points[after] - points[before]
        length = np.linalg.norm(side, axis=1)
        ahead = side / np.where(length > 0.0, length, 1.0)[:, None]
        at = np.einsum("ij,ij->i", way, ahead)
        off = np.abs(way - at[:, None] * ahead).max(axis=1)
        within = (at > 0.0) & (at < length) & (off <= near)
        keep = ~within if straight else np.abs(way).max(axis=1) > near
        sizes = np.bincount(np.repeat(np.arange(len(sizes)), sizes), keep, len(sizes)).astype(int)
        points = points[keep]
    parts = np.split(points, np.cumsum(sizes)[:-1])
    return [face for face in parts if len(face) > 2]


def _same(face: Floats, other: Floats, near: float) -> bool:
    """Say whether two faces have the same corners, from any of them on, and either way round."""
    return len(face) == len(other) and any(
        bool((np.abs(face - np.roll(way, shift, axis=0)) <= near).all())
        for way in (other, other[::-1])
        for shift in range(len(face))
    )
