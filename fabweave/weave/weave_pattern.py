"""Weave a mesh in the pattern that is asked for."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.subdivide import mid_edge_twist
from fabweave.weave.fabrics import parse_fabric, weave_fabric
from fabweave.weave.pattern import Weave, at_turns_text, exact_text, plain_weave
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import twill_conditions
from fabweave.weave.twill.weaving import USUAL, Twill, TwillSearch, twisted, weave_twill

#: The first line of a list of twists.
HEAD = "v0,v1,half_twists"


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


def twisted_weave(
    halfedges: Halfedges, threads: Threads, twist: BoolArray, pattern: str = "twists"
) -> Weave:
    """Weave a mesh as its edges are twisted; the conditions of a 2/2 twill that it breaks count."""
    return twisted(threads, twill_conditions(halfedges, threads), twist, pattern)


_TRIANGLE = 3
_SIDES = {4: "four", 5: "five", 6: "six", 7: "seven", 8: "eight", 9: "nine", 10: "ten"}


def kagome_note(halfedges: Halfedges) -> Note | None:
    """Say which openings plain weave has on a mesh that makes it a kagome basket; else None.

    Plain weave has an opening at each vertex and in each face, with as many sides as strands go by.
    It is the basket where all faces are triangles, or where three edges meet at all vertices: then
    every crossing lies between two openings of three sides and two others. Where these have six,
    the basket is flat; with fewer it bulges, with more it is a saddle.

    Parameters
    ----------
    halfedges : Halfedges

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> for shape in ("icosahedron", "cube"):
    ...     print(kagome_note(build_halfedges(parse_shape(f"shape:{shape}"))))
    kagome: plain weave on triangles; 20 small openings, and 12 large ones (12 of five sides)
    kagome: plain weave on triangles; 8 small openings, and 6 large ones (6 of four sides)
    """
    faces = np.bincount(halfedges.face)
    _, vertices = interior_valences(halfedges)
    for small, large in ((faces, vertices), (vertices, faces)):
        if len(small) and (small == _TRIANGLE).all():
            kinds = ", ".join(
                f"{count} of {_SIDES.get(sides, sides)} sides"
                for sides, count in sorted(Counter(large.tolist()).items(), reverse=True)
            )
            several = agree(len(large), f", and {{n}} large one[|s] ({kinds})") if kinds else ""
            text = agree(len(small), "{n} small opening[|s]")
            return Note("kagome", f"kagome: plain weave on triangles; {text}{several}")
    return None


#: Patterns that are no fabrics such as 3/1 or satin:5/2. Only kagome wants a mesh of its own.
NAMED_PATTERNS = ("plain", "kagome", "twill", "triaxial")
#: What weavers call some of them.
_ALSO_CALLED = {"tabby": "plain", "serge": "twill", "denim": "3/1"}


@frozen_value
class WeaveResult:
    """A weave in the pattern that was asked for.

    Parameters
    ----------
    weave : Weave
        The weave.
    notes : tuple of Note
        What a maker should know about it.
    twill : Twill or None
        What is known about it as a 2/2 twill, if that is what it is.
    warp : (T,) bool array or None
        Which threads are the warp of a fabric.
    label : (X,) int array or None
        The label of each crossing of a fabric, modulo its repeat.
    """

    weave: Weave
    notes: tuple[Note, ...] = ()
    twill: Twill | None = None
    warp: BoolArray | None = None
    label: IntArray | None = None


def parse_pattern(text: str) -> str:
    """Return the canonical name of a pattern.

    Raises
    ------
    InputError
        If there is no such pattern.

    Examples
    --------
    >>> parse_pattern("twill"), parse_pattern("3/1/1"), parse_pattern("2/2/3")
    ('twill', '3/1/1', '2/2/-1')
    >>> parse_pattern("tabby")
    'plain'
    """
    text = _ALSO_CALLED.get(text, text)
    if text in NAMED_PATTERNS:
        return text
    if text[:1].isalpha() and not text.startswith("sat"):
        raise InputError(
            f"there is no pattern {text[:40]!r}; choose {', '.join(NAMED_PATTERNS)}, a twill "
            "such as 3/1 or 2/2/1 (over, under, shift), or a satin such as satin:5/2"
        )
    return str(parse_fabric(text))


def weave_pattern(
    pattern: str,
    halfedges: Halfedges,
    threads: Threads,
    bunches: IntArray,
    labels: Sequence[str],
    *,
    n_old_vertices: int = 0,
    how: TwillSearch = USUAL,
    progress: Progress = no_progress,
) -> WeaveResult:
    """Weave a mesh in a pattern.

    Parameters
    ----------
    pattern : str
        ``plain``, ``kagome``, ``twill``, ``triaxial`` or a fabric, as `parse_pattern` returns it.
    halfedges, threads
        The mesh and its threads; for triaxial twill, of a mesh that `mid_edge` made.
    bunches : (T,) int array
        The bunch of each thread.
    labels : sequence of str
        Names of the threads.
    n_old_vertices : int
        For triaxial twill: how many vertices the mesh had before `mid_edge`.
    how : TwillSearch
        How a twill is looked for.
    progress : callable
        Told what is being done.

    Returns
    -------
    Chosen

    Raises
    ------
    CannotMakeError
        If a fabric does not close up on the mesh, or the mesh is none for kagome; the message says
        what obstructs it.
    """
    if pattern in ("plain", "kagome"):
        basket = kagome_note(halfedges)
        if pattern == "kagome" and basket is None:
            raise CannotMakeError(
                "kagome is woven on triangles, or where three edges meet at every vertex, and this "
                "mesh is neither; --remesh triangles:400 makes one that is"
            )
        return WeaveResult(plain_weave(threads), () if basket is None else (basket,))
    if pattern == "twill":
        twill = weave_twill(halfedges, threads, bunches, labels, how, progress=progress)
        return WeaveResult(twill.weave, tuple(twill_notes(twill)), twill)
    if pattern == "triaxial":
        # The exact twill of a mid-edge subdivision (section 7 of the paper).
        twist = mid_edge_twist(halfedges, n_old_vertices)
        twist = twist[halfedges.edge[threads.crossing_halfedge]]
        weave = twisted_weave(halfedges, threads, twist, pattern)
        exact = Note("triaxial", f"triaxial: {exact_text(weave.broken_at_turns)}")
        return WeaveResult(weave, (exact,) if weave.exact else ())
    fabric = parse_fabric(pattern)
    result = weave_fabric(halfedges, threads, fabric, labels=labels)
    if result.weave is None:
        reason = result.obstruction.text if result.obstruction else "it does not close up"
        raise CannotMakeError(
            f"the mesh cannot be woven in {fabric}: {reason}. A torus such as "
            f"shape:torus?m={6 * fabric.repeat}&n={2 * fabric.repeat} can; so can many tubes and "
            "saddles. On any mesh, --pattern twill comes as close to a 2/2 twill as it can, and "
            "--pattern triaxial is exact"
        )
    hand = f"twill line {result.hand}" if result.hand else ""
    # What crosses nothing is neither warp nor weft.
    in_warp = 0 if result.warp is None else int(np.count_nonzero(result.warp & threads.woven))
    warp = agree(in_warp, "{n} [thread is|threads are] the warp") if in_warp else ""
    told = f"{fabric}: exact; " + "; ".join(part for part in (warp, hand) if part)
    notes = (Note("fabric", told),) if warp else ()
    return WeaveResult(result.weave, notes, warp=result.warp, label=result.label)


def twill_notes(twill: Twill) -> list[Note]:
    """Say how good a twill is, and why it is not exact."""
    if twill.obstruction is None or twill.voted is None or twill.bound is None:
        return [Note("twill", f"twill: {exact_text(twill.weave.broken_at_turns)}")]
    broken, turns = twill.weave.broken, twill.weave.broken_at_turns
    if twill.bound.least == broken.total:
        best = "which is proved to be the least"
    else:
        best = f"and no weave of this mesh breaks fewer than {twill.bound.least}"
    told = (
        f"twill: {broken.total} of {twill.n_conditions} conditions "
        f"{agree(broken.total, '[is|are]')} broken ({broken.edge} edge, "
        f"{broken.face} face, {broken.vertex} vertex), {best}; the paper's voting breaks "
        f"{twill.voted.total}" + (f"; besides, {at_turns_text(turns)}" if turns else ""),
        f"no exact twill exists: {twill.obstruction.text}; --pattern triaxial is exact on every "
        "mesh",
    )
    return Note.each("twill", told)
