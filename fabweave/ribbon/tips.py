"""Find the tips at which many threads crowd and ribbons get narrow, and offer to open them."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.irregular import interior_valences
from fabweave.mesh.openings.leave_out import leave_out
from fabweave.mesh.openings.request import parse_leave_out
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import Ribbons

#: Vertices of so many edges are tips: regular ones have 4 or 6, those of slits 8.
CROWDED = 8
#: Ribbons at a tip are slivers if narrower than this, in millimetres, and than this share of the
#: median: below the first they want tweezers.
_NARROW_MM, _NARROW_SHARE = 4.0, 0.5
#: What is computed may be so little more than a whole millimetre.
_ROUNDING_MM = 1e-6
#: So many faces at most are named, so that a line holds them.
_MOST_FACES = 40


def tip_notes(
    mesh: PolyMesh, halfedges: Halfedges, ribbons: Ribbons, *, offer: bool = True
) -> list[str]:
    """Return a note on tips where ribbons get narrow, with the option that opens the mesh there.

    The narrowest rung no further from a tip than its longest edge counts. An opening takes the
    faces around the tip: by its diameter where the tip is the topmost or bottommost point, else by
    their numbers. What is offered was tried on the mesh.

    Parameters
    ----------
    mesh : PolyMesh
    halfedges : Halfedges
    ribbons : Ribbons
    offer : bool
        Whether faces of the mesh have the numbers that ``--leave-out`` takes.

    Returns
    -------
    list of str
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
        + f" of valence {spread} (vertex {few_of(tips.tolist(), 3)})"
    )
    option = _option(mesh, halfedges, tips) if offer else None
    if option is not None:
        note += f"; --leave-out {option} opens the mesh there"
    return [note]


def _slivers(mesh: PolyMesh, halfedges: Halfedges, ribbons: Ribbons) -> tuple[IntArray, FloatArray]:
    """Return the tips at which ribbons are slivers, and how narrow they are at each."""
    inside, valence = interior_valences(halfedges)
    crowded = inside[valence >= CROWDED]
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
    found = np.flatnonzero(least < limit)
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
    own = np.zeros(mesh.n_faces, dtype=bool)
    own[halfedges.face[halfedges.tail == tip]] = True
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
