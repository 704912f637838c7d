"""Weave twills over a and under b, and satins, where warp and weft exist and the labels close."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.fabric.labelling import (
    Crossings,
    Labelling,
    label_body,
    part_bodies,
    sort_crossings,
)
from fabweave.weave.fabric.repeat import Fabric
from fabweave.weave.fabric.warp_and_weft import Strands, part_strands
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave
from fabweave.weave.thread_labels import thread_labels
from fabweave.weave.threads import Threads
from fabweave.weave.twill.obstruction import Obstruction

HANDS = ("S", "Z")


@frozen_value
class FabricWeave:
    """A fabric on a mesh, exact everywhere, or what keeps the mesh from it.

    Parameters
    ----------
    fabric : Fabric
        What was asked for.
    weave : Weave or None
        The weave.
    obstruction : Obstruction or None
        Why there is none, in words.
    warp : (T,) bool array or None
        Which threads are the warp; None for plain weave, which needs none.
    label : (X,) int array or None
        The label of each crossing modulo the repeat.
    hand : str
        "S" or "Z" as the twill line rises seen from outside, the warp upright; "mixed"; or ""
        where there is no hand.
    """

    fabric: Fabric
    weave: Weave | None = None
    obstruction: Obstruction | None = None
    warp: BoolArray | None = None
    label: IntArray | None = None
    hand: str = ""


def weave_fabric(
    halfedges: Halfedges,
    threads: Threads,
    fabric: Fabric,
    *,
    hand: str | None = None,
    labels: Sequence[str] | None = None,
) -> FabricWeave:
    """Weave a fabric exactly, or say what obstructs it.

    Crossings get labels modulo the repeat that step by one along every weft thread and by the
    shift along every warp thread. Neighbouring threads run the same way; what directions that
    leaves free, and which bunch is the warp, are tried out in all combinations. For each, the
    equations at all crossings either have a solution or not, so the answer is a decision.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    fabric : Fabric
        The fabric; 1/1 is plain weave, which exists on every mesh.
    hand : {"S", "Z"}, optional
        The hand of the twill line, the same everywhere; otherwise the fabric's, or, if it has
        none, any will do, in each body one hand throughout if possible. A cloth turned by a quarter
        has the other hand, as its weft has become its warp: a closed weave often allows both by
        the choice of the warp.
    labels : sequence of str, optional
        Names of the threads, for the words.

    Returns
    -------
    FabricWeave
        With a weave or an obstruction.

    Raises
    ------
    InputError
        If the hand is neither "S" nor "Z", or the fabric has none.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(torus(8, 4, 35.0, 15.0))
    >>> result = weave_fabric(halfedges, trace_threads(halfedges), Fabric(3, 1))
    >>> result.weave.pattern, int(result.weave.over.sum())
    ('3/1', 64)
    >>> halfedges = build_halfedges(torus(7, 5, 35.0, 15.0))
    >>> weave_fabric(halfedges, trace_threads(halfedges), Fabric(3, 1)).obstruction.text
    'going once round thread A the pattern is 2 steps off: 70 crossings are not a multiple of 4; \
this is so for 2 of 2 threads'

    References
    ----------
    B. Grünbaum, G. C. Shephard, "Satins and twills: an introduction to the geometry of fabrics",
    Mathematics Magazine 53(3), 1980.
    """
    if hand is not None and (hand not in HANDS or not fabric.handed):
        raise InputError(
            f"the hand must be S or Z, not {hand!r}"
            if fabric.handed
            else f"the fabric {fabric} is its own mirror image, so it has no hand"
        )
    hand = hand or fabric.hand or None
    if fabric.repeat == 2:
        return FabricWeave(fabric, plain_weave(threads))
    names = thread_labels(threads.n_threads) if labels is None else labels
    candidates = _candidates(halfedges, threads, fabric, names)
    if isinstance(candidates, Obstruction):
        return FabricWeave(fabric, obstruction=candidates)
    return _weave_bodies(threads, candidates, fabric, hand, names)


def _candidates(
    halfedges: Halfedges, threads: Threads, fabric: Fabric, names: Sequence[str]
) -> list[tuple[Strands, Crossings]] | Obstruction:
    """Return the ways to choose a warp and what runs where, in the order in which to try them."""
    if fabric.handed:
        strands = part_strands(halfedges, threads, names)
        if isinstance(strands, Obstruction):
            return strands
        crossings = sort_crossings(threads, strands.warp)
        return [(strands, crossings), (strands, crossings.swapped())]
    # Half the repeat one way is half the repeat the other way: the warp may run as it likes.
    candidates: list[tuple[Strands, Crossings]] = []
    reason: Obstruction | None = None
    for swap in (False, True):
        strands = part_strands(halfedges, threads, names, warp_runs=swap, weft_runs=not swap)
        if isinstance(strands, Obstruction):
            reason = reason or strands
            continue
        crossings = sort_crossings(threads, strands.warp)
        candidates.append((strands, crossings.swapped() if swap else crossings))
    return reason if reason is not None and not candidates else candidates


def _weave_bodies(
    threads: Threads,
    candidates: list[tuple[Strands, Crossings]],
    fabric: Fabric,
    hand: str | None,
    names: Sequence[str],
) -> FabricWeave:
    """Label the bodies of the weave one by one, and put over and under where the labels say."""
    warp = np.array(candidates[0][0].warp)
    label = np.zeros(threads.n_crossings, dtype=np.int64)
    hands = set()
    for body in part_bodies(candidates[0][1]):
        reason: Obstruction | None = None
        for strands, crossings in candidates:
            body_crossings = crossings.some(body)
            labelling = label_body(threads, strands, body_crossings, fabric, hand, names)
            if isinstance(labelling, Labelling):
                label[body] = labelling.label
                hands.add(labelling.hand)
                warp[body_crossings.warp], warp[body_crossings.weft] = True, False
                break
            reason = reason or labelling
        else:
            return FabricWeave(fabric, obstruction=reason)
    hands.discard("")
    on_top = (label < fabric.over)[threads.crossing] == warp[threads.thread_of_pass]
    twist = np.zeros(threads.n_crossings, dtype=bool)
    twist[threads.crossing[threads.forward]] = on_top[threads.forward]
    return FabricWeave(
        fabric,
        Weave(threads, str(fabric), twist, over_of_passes(threads, twist)),
        warp=warp,
        label=label,
        hand="mixed" if len(hands) > 1 else "".join(hands),
    )
