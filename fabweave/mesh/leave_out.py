"""Leave faces out of a mesh: what is around its topmost or bottommost point, or those named."""

import math
import os
import re
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import agree, shown
from fabweave.core.units import parse_length
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_areas,
    face_centres,
    face_of_corner,
    next_corner,
    previous_corner,
    used_vertices,
    without_loose,
)
from fabweave.mesh.topology import keep_faces, label_links

#: Where an opening may be.
Side: TypeAlias = Literal["top", "bottom"]
_SIDES: tuple[Side, ...] = ("top", "bottom")
#: What a text may look like that is no name of a file.
_FACES = re.compile(r"[\s,0-9]+", re.ASCII)
_FACE = re.compile(r"[0-9]{1,9}", re.ASCII)
_LEAST_MM, _MOST_MM = 0.01, 1e6
_TAKEN = (
    "write top:80mm or bottom:80mm for an opening of that diameter, the numbers of faces such as "
    "12,13, counted from 0, or the name of a file that lists them"
)


@frozen_value
class LeaveOut:
    """What is to be left out of a mesh.

    Parameters
    ----------
    diameters_mm : tuple of (str, float)
        ``top`` or ``bottom``, each at most once, and the diameter of the opening there.
    faces : tuple of int
        Numbers of faces, rising.
    """

    diameters_mm: tuple[tuple[Side, float], ...]
    faces: tuple[int, ...]

    def __str__(self) -> str:
        """Return the text that says so."""
        return ",".join(
            [*(f"{side}:{mm:.10g}mm" for side, mm in self.diameters_mm), *map(str, self.faces)]
        )


def parse_leave_out(text: str | None) -> LeaveOut:
    """Read openings and numbers of faces, with commas between them; none if nothing is said.

    Raises
    ------
    InputError
        If it reads otherwise, or names a side twice.

    Examples
    --------
    >>> parse_leave_out("top:8cm, 13, 12").diameters_mm, str(parse_leave_out("top:8cm, 13, 12"))
    ((('top', 80.0),), 'top:80mm,12,13')
    """
    diameters: dict[Side, float] = {}
    faces = set()
    for part in [] if text is None else text.split(","):
        name, colon, length = part.strip().partition(":")
        side = next((side for side in _SIDES if side == name.strip().lower()), None)
        if side is not None and colon:
            if side in diameters:
                raise InputError(f"an opening at the {side} is named twice; name it once")
            diameters[side] = _diameter(length)
        elif _FACE.fullmatch(part.strip()):
            faces.add(int(part))
        else:
            raise InputError(f"{shown(part.strip())} says nothing to leave out: {_TAKEN}")
    return LeaveOut(tuple(diameters.items()), tuple(sorted(faces)))


def tidy_leave_out(text: str) -> str:
    """Return what is to be left out in its usual form.

    Examples
    --------
    >>> tidy_leave_out("13, 12,bottom: 1in")
    'bottom:25.4mm,12,13'
    """
    return str(parse_leave_out(text))


def read_leave_out(text: str) -> str:
    """Return what a text says is to be left out, in its usual form, or the faces a file lists.

    The numbers take the file's place, so that job.toml says all and needs no file. A file has
    numbers of faces with commas or spaces between them; ``#`` begins a comment.

    Raises
    ------
    InputError
        If it is neither, or the file cannot be read or lists no faces.

    Examples
    --------
    >>> read_leave_out("7,7,3"), read_leave_out("12,13,top:80mm")
    ('3,7', 'top:80mm,12,13')
    """
    words = {word.partition(":")[0].strip().lower() for word in text.split(",")}
    if words & set(_SIDES) or _FACES.fullmatch(text):
        return tidy_leave_out(text)
    path = Path(text)
    if not os.path.exists(path):
        raise InputError(f"there is no file {shown(text)}, nor is it an opening: {_TAKEN}")
    return _listed(read_text(path, "the list of faces"), path.name)


def _listed(content: str, name: str) -> str:
    """Return the faces that a file lists, with commas between them."""
    faces = set()
    for number, line in enumerate(content.splitlines(), start=1):
        for word in line.partition("#")[0].replace(",", " ").split():
            if not _FACE.fullmatch(word):
                raise InputError(
                    f"line {number} of {name} has {shown(word)}, which is no number of a face; "
                    "write whole numbers, counted from 0"
                )
            faces.add(int(word))
    if not faces:
        raise InputError(f"{name} lists no faces; write their numbers, counted from 0")
    return ",".join(map(str, sorted(faces)))


def _diameter(text: str) -> float:
    """Return the diameter of an opening, in millimetres."""
    diameter = parse_length(text.strip())
    if not _LEAST_MM <= diameter <= _MOST_MM:
        raise InputError(
            f"an opening of {diameter:g} mm is none; its diameter is {_LEAST_MM:g} to "
            f"{_MOST_MM:.0f} mm, such as top:80mm"
        )
    return diameter


#: A vertex goes the whole way, or so many steps of it less.
_STEPS = 8
#: A corner is sound if its sides turn by so much at least (the sine of 10°), a face if its normal
#: turns by 60° at most and it keeps a quarter of its area.
_LEAST_TURN, _LEAST_COSINE, _LEAST_SHARE = 0.1736, 0.5, 0.25
#: How far outside a triangle in plan a point may be, as a share of it.
_WITHIN = 1e-6


def rim_on_circle(
    surface: PolyMesh, kept: PolyMesh, rim: IntArray, centre: FloatArray, radius: float
) -> FloatArray:
    """Move vertices of a rim onto a circle in plan, along a surface.

    Each goes straight to the circle or away from its middle as seen from above, and up or down with
    the surface; where the surface does not reach the circle, it stays. Where a face would get
    unsound, its vertices go less far, in eighths of the way.

    Parameters
    ----------
    surface : PolyMesh
        The faces along which the rim may go.
    kept : PolyMesh
        The faces that stay, with the same vertices.
    rim : (R,) int array
        The vertices that may move.
    centre : (2,) float array
        The middle of the circle in plan.
    radius : float

    Returns
    -------
    (V, 3) float array
        All vertices, those of the rim where they went.

    Examples
    --------
    >>> flat = PolyMesh.from_faces([[1.0, 0, 0], [3, -1, 0], [3, 1, 0]], [[0, 1, 2]])
    >>> rim_on_circle(flat, flat, np.array([0]), np.zeros(2), 1.5)[0].tolist()
    [1.5, 0.0, 0.0]
    """
    start = kept.vertices
    goal = start.copy()
    goal[rim] = _on_surface(surface, start[rim], centre, radius)
    share = np.zeros(len(start))
    share[rim] = _STEPS
    while True:
        moved = start + (share / _STEPS)[:, None] * (goal - start)
        back = _unsound(kept, start, moved) & (share > 0)
        if not back.any():
            return moved
        share[back] -= 1.0


def _on_surface(
    surface: PolyMesh, points: FloatArray, centre: FloatArray, radius: float
) -> FloatArray:
    """Return where points go in plan and with the surface; they stay where it does not reach."""
    centres, face = face_centres(surface), face_of_corner(surface)
    here = surface.vertices[surface.indices]
    triangles = np.stack([centres[face], here, here[next_corner(surface)]], axis=1)
    goals = points.copy()
    for number, point in enumerate(points):
        way = point[:2] - centre
        far = float(np.linalg.norm(way))
        if far > 0.0:
            goal = centre + way * (radius / far)
            heights = _heights(triangles, goal)
            if len(heights):
                nearest = heights[np.argmin(np.abs(heights - point[2]))]
                goals[number] = [*goal, nearest]
    return goals


def _heights(triangles: FloatArray, place: FloatArray) -> FloatArray:
    """Return the heights of triangles (T, 3, 3) at a place in plan, of those that are there."""
    a, b, c = (triangles[:, k, :2] for k in range(3))
    one, two, to = b - a, c - a, place - a
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        v = (to[:, 0] * two[:, 1] - to[:, 1] * two[:, 0]) / area
        w = (one[:, 0] * to[:, 1] - one[:, 1] * to[:, 0]) / area
    there = (v >= -_WITHIN) & (w >= -_WITHIN) & (v + w <= 1.0 + _WITHIN)
    z = triangles[there, :, 2]
    u, v, w = 1.0 - v[there] - w[there], v[there], w[there]
    return np.asarray(u * z[:, 0] + v * z[:, 1] + w * z[:, 2])


def _unsound(mesh: PolyMesh, start: FloatArray, moved: FloatArray) -> np.ndarray:
    """Return the vertices that make a face unsound, (V,)."""
    before, now = (face_areas(mesh.with_vertices(points)) for points in (start, moved))
    long_before, long_now = np.linalg.norm(before, axis=1), np.linalg.norm(now, axis=1)
    along = np.einsum("fd,fd->f", before, now)
    bad_face = (along < _LEAST_COSINE * long_before * long_now) | (
        long_now < _LEAST_SHARE * long_before
    )
    face, ahead, back = face_of_corner(mesh), next_corner(mesh), previous_corner(mesh)
    turn = _turns(mesh, moved, now[face], ahead, back)
    # A corner that was so before is no work of the rim.
    bad = (turn < _LEAST_TURN) & (turn < _turns(mesh, start, before[face], ahead, back))
    changed = (moved != start).any(axis=1)
    found = flags(len(start), mesh.indices[bad_face[face]])
    # If the corner itself stays where it was, its neighbours have come too near.
    own = changed[mesh.indices]
    found[mesh.indices[bad & own]] = True
    found[mesh.indices[ahead[bad & ~own]]] = True
    found[mesh.indices[back[bad & ~own]]] = True
    return found & changed


def _turns(
    mesh: PolyMesh, points: FloatArray, normals: FloatArray, ahead: IntArray, back: IntArray
) -> FloatArray:
    """Return the sine by which the boundary of a face turns at each corner, (H,)."""
    here = points[mesh.indices]
    arrive, leave = here - here[back], here[ahead] - here
    sine = np.einsum("hd,hd->h", np.cross(arrive, leave), normals)
    size = np.linalg.norm(arrive, axis=1) * np.linalg.norm(leave, axis=1)
    whole = size * np.linalg.norm(normals, axis=1)
    return np.asarray(sine / np.where(whole > 0.0, whole, 1.0))


#: Points as high as this share of the mesh's height below the topmost one are topmost, too; and a
#: centre so far beyond the radius, as a share of it, is within.
_LEVEL = 1e-6
#: Vertices nearer to the circle than this are on it, in millimetres.
ON_CIRCLE_MM = 1e-6


@frozen_value
class Opening:
    """What was left out in one place.

    Parameters
    ----------
    side : str
        ``top``, ``bottom``, or ``faces`` for those that were named.
    faces : int
        How many faces were left out.
    diameter_mm : float or None
        Of the circle, and likewise ``x_mm`` and ``y_mm``, its middle in plan; None for named faces.
    x_mm, y_mm : float or None
    rim : int
        How many vertices the new boundary has.
    moved_mm, off_mm : float
        How far vertices of the rim were moved at most, and how far off the circle one stays.
    off : int
        How many stay off it.
    """

    side: str
    faces: int
    diameter_mm: float | None = None
    x_mm: float | None = None
    y_mm: float | None = None
    rim: int = 0
    moved_mm: float = 0.0
    off_mm: float = 0.0
    off: int = 0

    def record(self) -> dict[str, str | int | float]:
        """Return it for job.toml, lengths to a thousandth."""
        told: dict[str, str | int | float] = {"side": self.side, "faces": self.faces}
        if self.diameter_mm is not None:
            told |= {"diameter_mm": self.diameter_mm, "rim": self.rim, "off": self.off}
            for name in ("x_mm", "y_mm", "moved_mm", "off_mm"):
                told[name] = round(getattr(self, name), 3) + 0.0
        return told

    @property
    def note(self) -> str:
        """What a person should know about it."""
        left = agree(self.faces, "{n} [face was|faces were] left out")
        if self.diameter_mm is None:
            return f"{left} (--leave-out)"
        text = (
            f"opening at the {self.side}: {left} within {self.diameter_mm:g} mm across, around "
            f"({self.x_mm:.1f}, {self.y_mm:.1f}) in plan; its rim of {self.rim} vertices "
        )
        text += f"was moved by {self.moved_mm:.1f} mm at most onto that circle"
        if self.off:
            text += agree(self.off, ", but for {n} that [stays|stay]")
            text += f" up to {self.off_mm:.1f} mm off it, so that faces stay sound"
        return text


def leave_out(mesh: PolyMesh, what: LeaveOut) -> tuple[PolyMesh, tuple[Opening, ...]]:
    """Leave faces out of a mesh, and lay the rims of openings onto their circles.

    An opening at the top takes the faces that hang together with those at the topmost point, and
    whose centres are within its circle in plan. Each disc of faces that goes lowers the Euler
    characteristic by one.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold in millimetres, z up.
    what : LeaveOut

    Returns
    -------
    mesh : PolyMesh
        The faces that stay, in their order, and their vertices.
    openings : tuple of Opening
        What was left out, in the order in which it was asked for.

    Raises
    ------
    InputError
        If there is no such face, nothing or everything would be left out, an opening would have
        several rims, or what stays falls apart or is no manifold.

    Examples
    --------
    >>> from fabweave.mesh.leave_out import parse_leave_out
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> opened, (hole,) = leave_out(sphere(4, 100.0), parse_leave_out("top:100mm"))
    >>> hole.faces, hole.rim, check_mesh(opened).euler
    (4, 8, 1)
    """
    named = _named(mesh, what.faces)
    gone = named.copy()
    found: list[Opening] = []
    if what.faces:
        found.append(Opening("faces", len(what.faces)))
    edges = group_edges(mesh)
    places: list[tuple[BoolArray, FloatArray]] = []
    for side, diameter in what.diameters_mm:
        patch, centre = _patch(mesh, edges, side, diameter / 2.0)
        if (patch & gone).any():
            raise InputError(
                f"the opening at the {side} takes faces that are left out already; make it "
                "smaller, or name them once"
            )
        places.append((patch, centre))
        gone |= patch
    _require_some_left(gone)
    kept = keep_faces(mesh, ~gone)
    _require_whole(mesh, kept)
    points = mesh.vertices
    for (side, diameter), (patch, centre) in zip(what.diameters_mm, places, strict=True):
        rim, free = _rim(edges, patch, gone, side)
        near = patch | flags(mesh.n_faces, face_of_corner(mesh)[np.isin(mesh.indices, rim)])
        kept = kept.with_vertices(points)
        points = rim_on_circle(keep_faces(mesh, near), kept, free, centre, diameter / 2.0)
        moved = np.linalg.norm(points[free] - mesh.vertices[free], axis=1)
        off = np.abs(np.linalg.norm(points[rim, :2] - centre, axis=1) - diameter / 2.0)
        found.append(
            Opening(
                side,
                int(np.count_nonzero(patch)),
                diameter,
                x_mm=float(centre[0]),
                y_mm=float(centre[1]),
                rim=len(rim),
                moved_mm=float(moved.max(initial=0.0)),
                off_mm=float(off.max(initial=0.0)),
                off=int(np.count_nonzero(off > ON_CIRCLE_MM)),
            )
        )
    return without_loose(kept.with_vertices(points)), tuple(found)


def _named(mesh: PolyMesh, faces: tuple[int, ...]) -> BoolArray:
    """Return which faces are named, (F,)."""
    if faces and faces[-1] >= mesh.n_faces:
        raise InputError(
            f"face {faces[-1]} cannot be left out: the mesh has {mesh.n_faces} faces, counted from "
            "0, as it is woven (remeshed and refined, if that is asked for)"
        )
    return flags(mesh.n_faces, list(faces))


def _patch(
    mesh: PolyMesh, edges: EdgeGroups, side: Side, radius: float
) -> tuple[BoolArray, FloatArray]:
    """Return the faces of an opening, (F,), and its middle in plan, (2,).

    The middle is the topmost point, or that of all that are as high.
    """
    up = 1.0 if side == "top" else -1.0
    height = up * mesh.vertices[:, 2]
    used = used_vertices(mesh)
    low, high = float(height[used].min()), float(height[used].max())
    extreme = used & (height >= high - _LEVEL * (high - low))
    centre = mesh.vertices[extreme, :2].mean(axis=0)
    far = np.linalg.norm(face_centres(mesh)[:, :2] - centre, axis=1)
    within = far <= radius * (1.0 + _LEVEL)
    seeds = flags(mesh.n_faces, face_of_corner(mesh)[extreme[mesh.indices]])
    if not (seeds & within).any():
        least = math.ceil(2.0 * float(far[seeds].min()) + 1e-9)
        raise InputError(
            f"nothing would be left out at the {side}: no face there has its centre within "
            f"{2.0 * radius:g} mm across, around ({centre[0]:.1f}, {centre[1]:.1f}) in plan; "
            f"{side}:{least}mm takes the nearest"
        )
    one, two = edges.pairs
    both = within[edges.face[one]] & within[edges.face[two]]
    _, label = label_links(edges.face[one][both], edges.face[two][both], mesh.n_faces)
    return within & np.isin(label, label[seeds & within]), centre


def _require_some_left(gone: BoolArray) -> None:
    """Raise InputError if nothing, or everything, would be left out."""
    if gone.all():
        raise InputError(
            f"everything would be left out: all {len(gone)} faces; name a smaller opening"
        )
    if not gone.any():
        raise InputError("nothing would be left out; name an opening or faces")


def _require_whole(mesh: PolyMesh, kept: PolyMesh) -> None:
    """Raise InputError if what stays is no manifold, or has more bodies than before."""
    before, after = check_mesh(mesh), check_mesh(kept)
    if not (after.edge_manifold and after.vertex_manifold):
        raise InputError(
            "what stays would touch itself at a mere corner, and no strand can go through there; "
            "make the opening wider or narrower, or name the faces beside it, too"
        )
    if after.n_components > before.n_components:
        raise InputError(
            f"what stays would fall apart into {after.n_components} bodies, instead of "
            f"{before.n_components}; make the opening smaller, or leave out all of a body"
        )


def _rim(
    edges: EdgeGroups, patch: BoolArray, gone: BoolArray, side: str
) -> tuple[IntArray, IntArray]:
    """Return the vertices of a rim, and those of them that are on no other boundary."""
    one, two = edges.pairs
    cut = patch[edges.face[one]] != patch[edges.face[two]]
    cut &= ~(gone[edges.face[one]] & gone[edges.face[two]])
    tail, head = edges.tail[one[cut]], edges.head[one[cut]]
    rim = np.unique(np.concatenate([tail, head]))
    place = np.searchsorted(rim, tail), np.searchsorted(rim, head)
    rims = label_links(*place, len(rim))[0]
    if rims != 1:
        raise InputError(
            f"the opening at the {side} would have {rims} rims; make it narrower or wider, or "
            "name its faces"
        )
    return rim, np.setdiff1d(rim, edges.rim)
