"""Keep the large bodies of a mesh, and tell debris from them."""

from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh, face_of_corner
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import surface_area

#: A body is taken for debris if its diagonal is less than this share of the largest one's.
DEBRIS = 0.05


class Bodies(NamedTuple):
    """What is asked of bodies: how many are kept, None for all; or that they become one surface.

    They are joined to what they enclose together (``join``), or wrapped (``wrap``).
    """

    most: int | None = None
    one: str | None = None


class KeptBodies(NamedTuple):
    """A mesh of which bodies were kept or joined, notes, and the share of its surface that went.

    The share is rounded to a hundredth, as the notes tell it.
    """

    mesh: PolyMesh
    notes: tuple[str, ...] = ()
    left_out: float = 0.0


def parse_bodies(text: str) -> Bodies:
    """Return what is asked of bodies, from text.

    Raises
    ------
    InputError
        If the text says none of all, largest, join and wrap, and is no whole number from 1 on.

    Examples
    --------
    >>> parse_bodies("all").most, parse_bodies("largest").most, parse_bodies("3").most
    (None, 1, 3)
    >>> parse_bodies("join")
    Bodies(most=None, one='join')
    """
    if text == "all":
        return Bodies()
    if text in ("join", "wrap"):
        return Bodies(one=text)
    if text == "largest":
        return Bodies(1)
    if text.isascii() and text.isdigit() and len(text) < 10 and int(text) > 0:
        return Bodies(int(text))
    raise InputError(f"{text!r} is not all, largest, join, wrap, or a whole number from 1 on")


def keep_bodies(mesh: PolyMesh, most: int | None) -> KeptBodies:
    """Keep only the largest bodies of a mesh; or all, and say which look like debris.

    Bodies are what hangs together by vertices; the size of one is the diagonal of its bounding box.
    Of equal ones, the first in the mesh is kept.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.
    most : int or None
        How many bodies to keep; None for all.

    Returns
    -------
    KeptBodies
        With the same mesh if nothing was left out; notes tell what was left out, or could be.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [9, 0, 0], [0, 9, 0], [20, 0, 0], [20.1, 0, 0], [20, 0.1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> keep_bodies(two, 1).mesh.faces(), len(keep_bodies(two, None).notes)
    ([[0, 1, 2]], 1)
    """
    if not has_bodies(mesh):
        return KeptBodies(mesh)
    body, diagonals = bodies_of(mesh)
    count = len(diagonals)
    order = np.argsort(-diagonals, kind="stable")
    if most is None:
        small = int(np.count_nonzero(diagonals < DEBRIS * diagonals[order[0]]))
        if not small:
            return KeptBodies(mesh)
        large = count - small
        kept = "largest" if large == 1 else str(large)
        debris = (
            agree(small, f"{{n}} of the {count} bodies [is|are] smaller than a twentieth of ")
            + f"the largest, and may be debris; --bodies {kept} keeps only the large "
            + agree(large, "[one|ones]")
        )
        return KeptBodies(mesh, (debris,))
    if count <= most:
        return KeptBodies(mesh)
    stays = np.zeros(count, dtype=bool)
    stays[order[:most]] = True
    faces = stays[body]
    indices = mesh.indices[np.repeat(faces, mesh.face_sizes)]
    # Vertices of no face are the check's affair; those of the bodies that go, go.
    used, gone = np.zeros(mesh.n_vertices, dtype=bool), np.zeros(mesh.n_vertices, dtype=bool)
    used[indices] = True
    gone[mesh.indices] = True
    gone &= ~used
    place = np.cumsum(~gone) - 1
    kept_mesh = PolyMesh(mesh.vertices[~gone], offsets_of(mesh.face_sizes[faces]), place[indices])
    whole = surface_area(mesh)
    left_out = round(1.0 - surface_area(kept_mesh) / whole, 2) if whole > 0.0 else 0.0
    told = (
        agree(count - most, f"{{n}} of {count} bodies [was|were] left out, ")
        + f"with {agree(int(np.count_nonzero(~faces)), '{n} [face|faces]')} and "
        + f"{left_out:.0%} of the surface (--bodies)"
    )
    return KeptBodies(kept_mesh, (told,), left_out)


def has_bodies(mesh: PolyMesh) -> bool:
    """Return whether bodies can be told apart: else the check of the mesh says what is wrong."""
    wrong = (mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)
    return bool(mesh.n_faces and not wrong.any() and mesh.face_sizes.all())


def bodies_of(mesh: PolyMesh) -> tuple[IntArray, FloatArray]:
    """Return the body of each face, (F,), and the diagonal of each body."""
    first = mesh.indices[mesh.offsets[:-1]]
    # Bodies are numbered by faces, so that vertices of no face count for none.
    corner_face = face_of_corner(mesh)
    label = label_links(first[corner_face], mesh.indices, mesh.n_vertices)[1]
    number, body = np.unique(label[first], return_inverse=True)
    low, high = np.full((len(number), 3), np.inf), np.full((len(number), 3), -np.inf)
    points = mesh.vertices[mesh.indices]
    np.minimum.at(low, body[corner_face], points)
    np.maximum.at(high, body[corner_face], points)
    with np.errstate(over="ignore", invalid="ignore"):
        diagonals = np.linalg.norm(high - low, axis=1)
    return body, np.where(np.isfinite(diagonals), diagonals, 0.0)
