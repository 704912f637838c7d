"""Read and write which way every edge of a mesh is twisted: a weave of one's own."""

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import count_broken, twill_conditions

#: The first line of a list of twists.
HEAD = "v0,v1,half_twists"
#: A list is no longer than so many bytes for each edge.
_A_LINE = 64


def twists_text(halfedges: Halfedges, weave: Weave) -> str:
    """Return the twist of each crossing's edge as a list, in the order of crossings.

    A line names an edge by its vertices, counted from 0 as in ``woven_mesh.obj``, and how many half
    turns it is twisted by: 1 counter-clockwise, which takes the strand from lower left to upper
    right over the other one, and -1 clockwise.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(tetrahedron())
    >>> twists_text(halfedges, plain_weave(trace_threads(halfedges))).split()[:3]
    ['v0,v1,half_twists', '0,1,1', '1,2,1']
    """
    first = weave.threads.crossing_halfedge
    turns = np.where(weave.twist, 1, -1)
    rows = np.column_stack([halfedges.tail[first], halfedges.head[first], turns]).tolist()
    return "\n".join([HEAD, *(f"{a},{b},{turn}" for a, b, turn in rows)]) + "\n"


def read_twists(content: bytes, halfedges: Halfedges, threads: Threads) -> BoolArray:
    """Read which way the edge of each crossing is twisted, (X,): true is counter-clockwise.

    Edges that the list does not name are twisted counter-clockwise, as in plain weave.

    Parameters
    ----------
    content : bytes
        As :func:`twists_text` writes it; the order and the first line do not matter.
    halfedges, threads
        The mesh that is woven, and its threads.

    Raises
    ------
    InputError
        If a line is no edge, names none of the mesh, or one for the second time.
    CannotMakeError
        If an edge is not twisted by one half turn either way.
    """
    first = threads.crossing_halfedge
    ends = np.sort(np.column_stack([halfedges.tail[first], halfedges.head[first]]), axis=1)
    number = {(a, b): at for at, (a, b) in enumerate(ends.tolist())}
    if len(content) > _A_LINE * (len(number) + 1):
        raise InputError(
            f"a list of twists of {len(content)} bytes is too long for the "
            f"{agree(len(number), '{n} edge[|s]')} of the mesh; name each once"
        )
    found: dict[int, int] = {}
    for line, text in enumerate(content.decode("utf-8", errors="replace").splitlines(), start=1):
        if not text.strip() or (line == 1 and text.replace(" ", "") == HEAD):
            continue
        try:
            a, b, turns = (int(word) for word in text.split(","))
        except ValueError:
            raise InputError(
                f"line {line} of the list of twists is {text[:40]!r}, but should name two vertices "
                "and a number of half turns, such as 0,1,-1"
            ) from None
        at = number.get((min(a, b), max(a, b)))
        if at is None or at in found:
            why = "which is no crossing of the mesh" if at is None else "which it has named before"
            raise InputError(
                f"line {line} of the list of twists names the edge {a}-{b}, {why}; vertices are "
                "counted from 0 as in woven_mesh.obj, after all that is done to the mesh"
            )
        found[at] = turns
    other = [at for at, turns in found.items() if abs(turns) != 1]
    if other:
        a, b = ends[other[0]].tolist()
        raise CannotMakeError(
            agree(len(other), "{n} edge[ is|s are]")
            + f" not twisted by one half turn (edge {a}-{b}: {found[other[0]]}). Strands that turn "
            "around one another more than once, or not at all, have no crossing that could be cut "
            "and laid flat; write 1 or -1"
        )
    twist = np.ones(threads.n_crossings, dtype=bool)
    twist[list(found)] = np.array(list(found.values()), dtype=np.int64) > 0
    return twist


def twisted_weave(halfedges: Halfedges, threads: Threads, twist: BoolArray) -> Weave:
    """Weave a mesh as its edges are twisted; the conditions of a 2/2 twill that it breaks count."""
    broken = count_broken(twill_conditions(halfedges, threads), twist)
    return Weave(threads, "twists", twist, over_of_passes(threads, twist), broken)
