"""Tell where plain weave is the kagome basket, and which openings it has."""

from collections import Counter

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.irregular import interior_valences

_TRIANGLE, _HEXAGON = 3, 6
_SIDES = {4: "four", 5: "five", 6: "six", 7: "seven", 8: "eight", 9: "nine", 10: "ten"}


@frozen_value
class Kagome:
    """The openings of a kagome basket: small ones of three sides, and large ones between them.

    Parameters
    ----------
    small : int
        How many have three sides.
    large : dict from int to int
        How many of the others have so many sides, by sides. Where it has six, the basket is flat;
        with fewer it bulges, with more it is a saddle.
    """

    small: int
    large: dict[int, int]

    @property
    def text(self) -> str:
        """The openings in words."""
        several = sum(self.large.values())
        kinds = ", ".join(
            f"{count} of {_SIDES.get(sides, sides)} sides"
            for sides, count in sorted(self.large.items(), key=lambda item: -item[1])
        )
        large = f", and {agree(several, '{n} large one[|s]')} ({kinds})" if several else ""
        return (
            f"kagome: plain weave on triangles; {agree(self.small, '{n} small opening[|s]')}{large}"
        )


def kagome_of(halfedges: Halfedges) -> Kagome | None:
    """Return the openings of plain weave on a mesh that makes it a kagome basket; else None.

    Plain weave has an opening at each vertex and in each face, with as many sides as strands go by.
    It is the basket where all faces are triangles, or where three edges meet at all vertices: then
    every crossing lies between two openings of three sides and two others.

    Parameters
    ----------
    halfedges : Halfedges

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> for shape in ("icosahedron", "dodecahedron", "cube"):
    ...     print(kagome_of(build_halfedges(parse_shape(f"shape:{shape}"))))
    Kagome(small=20, large={5: 12})
    Kagome(small=20, large={5: 12})
    Kagome(small=8, large={4: 6})
    """
    faces = np.bincount(halfedges.face)
    _, vertices = interior_valences(halfedges)
    for small, large in ((faces, vertices), (vertices, faces)):
        if len(small) and (small == _TRIANGLE).all():
            return Kagome(len(small), dict(sorted(Counter(large.tolist()).items())))
    return None
