"""Check that ribbons can be made at all."""

import math
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, flags, unit
from fabweave.core.errors import InputError, TooFineError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.leave_out import leave_out, parse_leave_out
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.triangulate import surface_area
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.weave.pattern import Weave, strand_passes


def open_share(ribbons: Ribbons, weave: Weave, mesh: PolyMesh) -> float:
    """Return which share of a surface no ribbon covers.

    That is what is left of its area when all facets are taken away, and what lies on one another
    at crossings is given back: there, strands of the widths a and b that cross at an angle share
    a parallelogram of area a b / sin.

    Parameters
    ----------
    ribbons : Ribbons
    weave : Weave
    mesh : PolyMesh
        The mesh that is woven.

    Returns
    -------
    float
        At least 0: ribbons climb over one another and may have more area than the surface.

    Examples
    --------
    A torus of fine quads in ribbons of half the room: a quarter is covered twice, a quarter not.

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = parse_shape("shape:torus?m=120&n=60")
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.0, width=0.5)
    >>> round(open_share(ribbons, weave, mesh), 2)
    0.25
    """
    following = following_rung(ribbons.offsets, ribbons.closed)
    here = np.flatnonzero(following >= 0)
    ahead = following[here]
    right, left = ribbons.right, ribbons.left
    strips = _areas(right[here], right[ahead], left[ahead]) + _areas(
        right[here], left[ahead], left[here]
    )
    along, width = _along_panels(ribbons), panel_widths(ribbons).mean(axis=1)
    lower, upper = strand_passes(weave).T
    sine = np.linalg.norm(np.cross(along[upper], along[lower]), axis=1)
    shared = width[upper] * width[lower] / np.maximum(sine, 1e-9)
    covered = float(strips.sum()) - float(shared.sum())
    return max(0.0, 1.0 - covered / surface_area(mesh))


def _areas(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the areas of triangles."""
    area: FloatArray = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    return area


#: Narrower than this, a ribbon is burnt away by the cut beside it.
NARROWEST_MM = 0.2
#: What helps ribbons that are too narrow or bend too tightly; and up to how many times the size
#: that was asked for a larger one is told, too: much larger ones are no help to anybody.
COARSER, NEAR_SIZE = "a coarser mesh (--remesh quads:N makes one)", 1.5


def ribbon_widths(ribbons: Ribbons) -> FloatArray:
    """Return the length of every rung, (R,): what the rule of widths lays.

    Where a rung is slanted the ribbon is less wide than that: ``Bends.width_mm`` is what people are
    told.
    """
    return np.linalg.norm(ribbons.left - ribbons.right, axis=1)


def panel_widths(ribbons: Ribbons) -> FloatArray:
    """Return how wide each panel is where it begins and where it ends, (P, 2).

    It is measured across the panel's middle line: a slanted rung is longer than that.
    """
    rungs = (ribbons.left - ribbons.right)[ribbons.entry[:, None] + [0, 1]]
    return np.linalg.norm(np.cross(_along_panels(ribbons)[:, None], rungs), axis=2)


def _along_panels(ribbons: Ribbons) -> FloatArray:
    """Return which way the middle line of each panel goes, (P, 3)."""
    middle = ribbons.left + ribbons.right
    return unit(middle[ribbons.entry + 1] - middle[ribbons.entry])


def thread_lengths(ribbons: Ribbons) -> FloatArray:
    """Return the length of every thread along the middle of its ribbon, (T,), in millimetres."""
    following = following_rung(ribbons.offsets, ribbons.closed)
    middle = (ribbons.right + ribbons.left) / 2
    goes_on = following >= 0
    step = np.zeros(len(middle))
    step[goes_on] = np.linalg.norm(middle[following[goes_on]] - middle[goes_on], axis=1)
    total = np.concatenate(([0.0], np.cumsum(step)))
    return np.diff(total[ribbons.offsets])


def size_for(room_mm: float, needed_mm: float, size_mm: float) -> int:
    """Return the size, in whole millimetres, at which a room in proportion to it suffices.

    Examples
    --------
    >>> size_for(2.0, 3.0, 100.0)
    150
    """
    return int(np.ceil(size_mm * needed_mm / room_mm - 1e-9)) if room_mm > 0 else 10**9


def require_width(ribbons: Ribbons, labels: Sequence[str], size_mm: float) -> None:
    """Raise TooFineError if a ribbon is somewhere too narrow to be cut.

    Parameters
    ----------
    ribbons : Ribbons
    labels : sequence of str
        Names of the threads.
    size_mm : float
        Largest dimension of the object, to say at which size it would do.
    """
    width = ribbon_widths(ribbons)
    narrow = np.flatnonzero(width < NARROWEST_MM)
    if len(narrow) == 0:
        return
    threads = np.unique(np.searchsorted(ribbons.offsets, narrow, side="right") - 1)
    names = few_of([labels[thread] for thread in threads])
    least = float(width.min())
    size = size_for(least, NARROWEST_MM, size_mm)
    larger = f", or --size {size}mm or more" if size <= NEAR_SIZE * size_mm else ""
    raise TooFineError(
        f"ribbons are narrower than {NARROWEST_MM:g} mm in "
        f"{agree(len(narrow), '{n} place[|s]')} "
        f"({agree(len(threads), 'thread[|s]')} {names}; "
        f"the narrowest is {least:.3g} mm wide) and would burn away",
        f"use {COARSER}{larger}",
    )


#: Vertices of so many edges are tips if their faces are triangles: regular ones have 4 or 6; those
#: of quads are saddles, where there is room.
CROWDED = 8
#: Ribbons at a tip are slivers if narrower than this, in millimetres, and than this share of the
#: median: below the first they want tweezers.
_NARROW_MM, _NARROW_SHARE = 4.0, 0.5
#: What is computed may be so little more than a whole millimetre.
_ROUNDING_MM = 1e-6
#: So many tips and faces at most are named, so that a line holds them.
_MOST_TIPS, _MOST_FACES = 3, 40


def tip_notes(
    mesh: PolyMesh, halfedges: Halfedges, ribbons: Ribbons, *, offer: bool = True
) -> list[Note]:
    """Return a note on tips where ribbons get narrow, with the option that opens the mesh there.

    The narrowest rung no further from a tip than its longest edge counts. An opening takes the
    faces around the tip, of the worst few: by its diameter where the tip is the topmost or
    bottommost point, else by their numbers. What is offered was tried on the mesh.

    Parameters
    ----------
    mesh : PolyMesh
    halfedges : Halfedges
    ribbons : Ribbons
    offer : bool
        Whether faces of the mesh have the numbers that ``--leave-out`` takes.

    Returns
    -------
    list of Note
        None or one.
    """
    tips, narrow = _slivers(mesh, halfedges, ribbons)
    if not len(tips):
        return []
    valence = np.bincount(halfedges.tail)[tips]
    spread = str(valence.max())
    if valence.min() != valence.max():
        spread = f"{valence.min()} to {valence.max()}"
    note = (
        f"tips: ribbons get as narrow as {narrow.min():.1f} mm at "
        + agree(len(tips), "{n} [vertex|vertices]")
        + f" of valence {spread} (vertex {few_of(tips.tolist(), _MOST_TIPS)})"
    )
    option = _option(mesh, halfedges, tips[:_MOST_TIPS]) if offer else None
    if option is not None:
        note += f"; --leave-out {option} opens the mesh there"
    return [Note("tips", note)]


def _slivers(mesh: PolyMesh, halfedges: Halfedges, ribbons: Ribbons) -> tuple[IntArray, FloatArray]:
    """Return the tips at which ribbons are slivers, the worst first, and how narrow they are."""
    inside, valence = interior_valences(halfedges)
    other = np.bincount(halfedges.tail, mesh.face_sizes[halfedges.face] != 3, mesh.n_vertices)
    crowded = inside[(valence >= CROWDED) & (other[inside] == 0)]
    width = ribbon_widths(ribbons)
    middle = (ribbons.right + ribbons.left) / 2.0
    edge = np.linalg.norm(mesh.vertices[halfedges.head] - mesh.vertices[halfedges.tail], axis=1)
    reach = np.zeros(mesh.n_vertices)
    np.maximum.at(reach, halfedges.tail, edge)
    least = np.full(len(crowded), np.inf)
    for number, tip in enumerate(crowded.tolist()):
        near = np.linalg.norm(middle - mesh.vertices[tip], axis=1) <= reach[tip]
        least[number] = width[near].min(initial=np.inf)
    limit = min(_NARROW_MM, _NARROW_SHARE * float(np.median(width))) if len(width) else 0.0
    found = np.argsort(least.round(3), kind="stable")[: np.count_nonzero(least < limit)]
    return crowded[found], least[found]


def _option(mesh: PolyMesh, halfedges: Halfedges, tips: IntArray) -> str | None:
    """Return what to leave out at some tips; None if that is much, or cannot be."""
    height = mesh.vertices[np.unique(mesh.indices), 2]
    parts: list[str] = []
    faces: set[int] = set()
    for tip in tips.tolist():
        up = mesh.vertices[tip, 2]
        side = "top" if up >= height.max() else "bottom" if up <= height.min() else None
        if side is None:
            faces.update(halfedges.face[halfedges.tail == tip].tolist())
        else:
            parts.append(f"{side}:{_diameter_mm(mesh, halfedges, tip)}mm")
    text = ",".join([*parts, *map(str, sorted(faces))])
    if len(faces) > _MOST_FACES:
        return None
    try:
        leave_out(mesh, parse_leave_out(text))
    except InputError:
        return None
    return text


def _diameter_mm(mesh: PolyMesh, halfedges: Halfedges, tip: int) -> int:
    """Return a diameter around a tip that takes the faces there, and leaves their rim in place.

    It is twice as far as the neighbours of the tip are in plan, but the centres of its faces are
    within, and others are not, if that can be.
    """
    place = mesh.vertices[tip, :2]
    own = flags(mesh.n_faces, halfedges.face[halfedges.tail == tip])
    far = np.linalg.norm(face_centres(mesh)[:, :2] - place, axis=1)
    beside = mesh.vertices[halfedges.head[halfedges.tail == tip]]
    rim = 2.0 * float(np.linalg.norm(beside[:, :2] - place, axis=1).mean())
    least = 2.0 * float(far[own].max())
    # Faces beyond the rim, not those of the other side of the mesh.
    touching = np.zeros(mesh.n_faces, dtype=bool)
    corners = np.isin(mesh.indices, mesh.indices[own[halfedges.face]])
    touching[halfedges.face[corners]] = True
    beyond = 2.0 * float(far[touching & ~own].min(initial=np.inf))
    return math.ceil(max(least, min(rim, beyond - 1.0)) - _ROUNDING_MM)
