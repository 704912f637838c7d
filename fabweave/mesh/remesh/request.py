"""Read what ``--remesh`` asks for."""

from dataclasses import dataclass

from fabweave.core.errors import InputError

#: Bounds of what may be asked for, in faces: no closed surface of quads has fewer than six, and a
#: tetrahedron, with three edges at each vertex, gives ribbons no room.
LEAST = {"quads": 6, "triangles": 8, "coarse": 1, "tubes": 24, "grid": 4, "rings": 24}
#: Kinds that must say how many.
_COUNTED = ("triangles", "tubes", "grid", "rings")
MOST = 100_000
#: Keeps the mesh as it is.
NONE = "none"
_HELP = (
    "write quads or quads:3000 for about 3000 quads, triangles:300 for 300 triangles, tubes:300 "
    "for 300 quads along limbs and around them, grid:300 for rows and columns on a disc or a tube, "
    "rings:300 for rings that have an exact twill, coarse or coarse:200 to "
    "undo a refinement, or none to keep the mesh"
)


@dataclass(frozen=True)
class Remesh:
    """What ``--remesh`` asks for.

    Parameters
    ----------
    kind : str
        ``quads``, ``triangles``, ``tubes``, ``grid``, ``rings`` or ``coarse``; ``none`` keeps the
        mesh.
    count : int or None
        About how many faces; None leaves it to fabweave.
    """

    kind: str = "quads"
    count: int | None = None


def parse_remesh(text: str) -> Remesh:
    """Read what ``--remesh`` asks for, such as ``quads``, ``triangles:300`` or ``coarse:200``.

    Raises
    ------
    InputError
        If it reads otherwise.

    Examples
    --------
    >>> parse_remesh("quads:3000"), parse_remesh("quads")
    (Remesh(kind='quads', count=3000), Remesh(kind='quads', count=None))
    >>> parse_remesh("triangles:300").kind, parse_remesh("none").kind
    ('triangles', 'none')
    """
    kind, colon, number = text.strip().partition(":")
    if text.strip() == NONE:
        return Remesh(NONE)
    if kind not in LEAST:
        raise InputError(f"--remesh {text[:40]!r} is not known; {_HELP}")
    if not colon and kind in _COUNTED:
        raise InputError(
            f"--remesh {text[:40]!r} must say about how many, such as {kind}:300; quads needs no "
            "number"
        )
    if not colon:
        return Remesh(kind)
    if not (number.isascii() and number.isdigit()):
        raise InputError(
            f"--remesh {text[:40]!r}: after the colon there must be a whole number of faces, such "
            "as quads:3000"
        )
    return Remesh(kind, checked_count(kind, int(number[:12])))


def checked_count(kind: str, count: int) -> int:
    """Return a number of faces that can be made.

    Raises
    ------
    InputError
        If it is too small or too large.
    """
    if not LEAST[kind] <= count <= MOST:
        faces = {"coarse": "faces", "triangles": "triangles"}.get(kind, "quads")
        raise InputError(
            f"remeshing makes from {LEAST[kind]} to {MOST} {faces}, but {count} were asked for; to "
            "get more, refine the result"
        )
    return count
