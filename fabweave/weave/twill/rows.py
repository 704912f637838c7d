"""Read the rows of a mesh of rings, and the exact 2/2 twill that they give."""

from collections import deque

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, flags
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.topology import solve_parity

#: Of each row modulo 4, whether its edges are twisted counter-clockwise.
TWISTS: BoolArray = np.array([False, True, True, False])
TWISTS.setflags(write=False)
#: Sides of a quad, counter-clockwise from its upper one.
_UPPER, _LOWER, _RISING = 0, 2, 3
_SIDES = 4


def ring_rows(halfedges: Halfedges) -> IntArray | None:
    """Return the row of each edge of a mesh of rings, modulo 4, (E,); None if it is none.

    All faces are quads around which rows run as r - 1, r, r + 1, r, where r is odd, but for fans of
    triangles at maxima (r - 1, r, r) and polygons at minima (all r, which is even): an odd number
    of edges meets at their corners. Around a handle rows come back to themselves modulo 4.

    Parameters
    ----------
    halfedges : Halfedges

    Notes
    -----
    *Definition.* A mesh is of rings if its edges have rows as above.

    *Statement.* The twists s(r mod 4) = 0, 1, 1, 0 then break no condition of a 2/2 twill: each
    mesh of rings has an exact one.

    *Proof.* A thread that crosses two edges in a row of one quad goes from row r to r + 1 or to
    r - 1, and on through the next quad in the same sense, as it goes straight ahead. So rows along
    it are r, r + 1, r + 2, and s(r) differs from s(r + 2). At a tip it reads r - 1, r, r, r - 1
    with r odd, at the polygon of a minimum r + 1, r, r, r + 1 with r even. The first and last of
    any three are then one odd and one even row, r - 1 and r for odd r, or r and r + 1 for even r;
    between these s changes, as it does from even rows to odd ones and only then. That is the edge
    condition. Around a quad rows are a, b, c, b with b odd, a below and c above it, so s(a) differs
    from s(b), which is s(c): of four in a row, the outer two agree where the middle two differ.
    Around a vertex they are a, b, a, c, again and again, with a even, b above and c below it: s(a)
    differs from s(b) and is s(c), and the same holds; also where a polygon takes the place of some
    c. Around a polygon, and around a tip, all are alike.

    References
    ----------
    Conditions: Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics
    35 (2011), definition 5.1. The statement is fabweave's own.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.grids import sphere, torus
    >>> ring_rows(build_halfedges(sphere(4, 1.0))) is None
    True
    >>> np.bincount(ring_rows(build_halfedges(torus(6, 4, 2.0, 1.0)))).tolist()
    [12, 12, 12, 12]
    """
    upward = _sides(halfedges)
    for turn in (0, 1) if upward is not None and upward[1] else (0,):
        if upward is None:
            break
        side = (upward[0] + turn) % _SIDES
        rising = side % 2 == 1
        linked = solve_parity(int(halfedges.tail.max()) + 1, halfedges.tail, halfedges.head, rising)
        if linked.odd_ring:
            continue
        level = linked.opposite
        lower = np.where(side == _RISING, halfedges.tail, halfedges.head)
        row = 2 * level[lower].astype(np.int64) + rising
        return np.asarray(row[halfedges.edge_halfedge])
    return None


def _sides(halfedges: Halfedges) -> tuple[IntArray, bool] | None:
    """Return which side of its quad each half-edge is, (H,), and whether that may be turned.

    None where they do not fit together.
    """
    begun = _begun(halfedges)
    if begun is None:
        return None
    side, either = begun
    fixed = side >= 0
    queue = deque(np.flatnonzero(fixed).tolist())
    free = not queue
    twin, after = halfedges.twin.tolist(), halfedges.next.tolist()
    found, seeded = side.tolist(), 0
    while True:
        while queue:
            here = queue.popleft()
            if not fixed[here] and not either[here]:
                ahead = after[here]
                if found[ahead] < 0:
                    found[ahead] = (found[here] + 1) % _SIDES
                    queue.append(ahead)
                elif found[ahead] != (found[here] + 1) % _SIDES:
                    return None
            over = twin[here]
            if over >= 0:
                if found[over] < 0:
                    found[over] = (found[here] + 2) % _SIDES
                    queue.append(over)
                elif found[over] != (found[here] + 2) % _SIDES:
                    return None
        # Another body begins anywhere.
        while seeded < len(found) and (found[seeded] >= 0 or either[seeded]):
            seeded += 1
        if seeded == len(found):
            break
        found[seeded] = _UPPER
        queue.append(seeded)
    side = np.array(found, dtype=np.int64)
    ahead = side[halfedges.next]
    alone = either & (side == _UPPER) & (ahead == _UPPER)
    turning = either & (side >= 0) & (ahead == (side + 1) % _SIDES)
    of_face = (
        np.bincount(halfedges.face, weights=alone),
        np.bincount(halfedges.face, weights=turning),
    )
    whole = np.maximum(*of_face)[halfedges.face] == _SIDES
    return (side, free) if np.all(whole | ~either) and side.min() >= 0 else None


def _begun(halfedges: Halfedges) -> tuple[IntArray, BoolArray] | None:
    """Return the sides of fans and polygons, else -1, and which half-edges may be a polygon's.

    None where triangles are no fans.
    """
    sizes = np.bincount(halfedges.face)
    count = int(halfedges.tail.max()) + 1
    inner, valence = interior_valences(halfedges)
    odd = flags(count, inner[valence % 2 == 1])
    around = np.bincount(halfedges.tail, minlength=count)
    triangles = np.bincount(halfedges.tail, weights=sizes[halfedges.face] == 3, minlength=count)
    tip = flags(count, inner) & (triangles == around)
    n_odd = np.bincount(halfedges.face, weights=odd[halfedges.tail])
    n_tips = np.bincount(halfedges.face, weights=tip[halfedges.tail])
    polygon = ((n_odd == sizes) & (sizes == 3) & (n_tips == 0)) | (sizes > _SIDES)
    # Of quads whose corners are all odd the neighbours say whether they are polygons at a minimum.
    either = ((sizes == _SIDES) & (n_odd == _SIDES))[halfedges.face]
    fan = (sizes == 3) & ~polygon
    if np.any(n_tips[fan] != 1):
        return None
    side = np.full(halfedges.n_halfedges, -1, dtype=np.int64)
    side[polygon[halfedges.face]] = _UPPER
    in_fan = fan[halfedges.face]
    to_tip, from_tip = in_fan & tip[halfedges.head], in_fan & tip[halfedges.tail]
    side[in_fan] = _LOWER
    side[to_tip], side[from_tip] = _RISING, 1
    return side, either
