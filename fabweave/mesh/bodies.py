"""Keep the large bodies of a mesh, and tell debris from them."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh, face_of_corner
from fabweave.mesh.topology import label_links

#: A body is taken for debris if its diagonal is less than this share of the largest one's.
_DEBRIS = 0.05


def parse_bodies(text: str) -> int | None:
    """Return how many bodies are to be kept, from text; None for all.

    Raises
    ------
    InputError
        If the text says neither all, nor largest, nor a whole number from 1 on.

    Examples
    --------
    >>> parse_bodies("all"), parse_bodies("largest"), parse_bodies("3")
    (None, 1, 3)
    """
    if text == "all":
        return None
    if text == "largest":
        return 1
    if text.isascii() and text.isdigit() and len(text) < 10 and int(text) > 0:
        return int(text)
    raise InputError(f"{text!r} is not all, largest, or a whole number from 1 on")


def keep_bodies(mesh: PolyMesh, most: int | None) -> tuple[PolyMesh, tuple[str, ...]]:
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
    mesh : PolyMesh
        The same object if nothing was left out.
    notes : tuple of str
        What was left out, or could be.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [9, 0, 0], [0, 9, 0], [20, 0, 0], [20.1, 0, 0], [20, 0.1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> keep_bodies(two, 1)[0].faces(), len(keep_bodies(two, None)[1])
    ([[0, 1, 2]], 1)
    """
    wrong = (mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)
    if not mesh.n_faces or wrong.any() or not mesh.face_sizes.all():
        return mesh, ()  # the check of the mesh says what is wrong
    body, diagonals = _bodies(mesh)
    count = len(diagonals)
    order = np.argsort(-diagonals, kind="stable")
    if most is None:
        small = int(np.count_nonzero(diagonals < _DEBRIS * diagonals[order[0]]))
        if not small:
            return mesh, ()
        large = count - small
        kept = "largest" if large == 1 else str(large)
        return mesh, (
            agree(small, f"{{n}} of the {count} bodies [is|are] smaller than a twentieth of ")
            + f"the largest, and may be debris; --bodies {kept} keeps only the large "
            + agree(large, "[one|ones]"),
        )
    if count <= most:
        return mesh, ()
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
    return kept_mesh, (
        agree(count - most, f"{{n}} of {count} bodies [was|were] left out, ")
        + f"with {agree(int(np.count_nonzero(~faces)), '{n} [face|faces]')} (--bodies)",
    )


def _bodies(mesh: PolyMesh) -> tuple[IntArray, FloatArray]:
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
