"""Say whether a mesh can be woven in 2/2 twill, and what would make it so."""

from typing import Any

from fabweave.core.arrays import Progress
from fabweave.core.errors import CannotMakeError, FabweaveError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.subdivide.refine import parse_refinements, refine_mesh
from fabweave.options.settings import Settings
from fabweave.ribbon.lay import WovenObject
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.anneal import couple
from fabweave.weave.twill.bound import WIDER_WORK, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import twill_conditions
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.obstruction import explain
from fabweave.weave.twill.voting import best_vote

#: Refinements that may turn a mesh into one with an exact twill.
_REFINEMENTS = ("simplest:1", "simplest:2", "catmull-clark:1", "doo-sabin:1", "sqrt3:1", "loop:1")
#: Larger meshes are not refined on trial, nor voted on, however thorough the inspection is.
_MOST_REFINED = 60_000
_MOST_VOTED = 30_000
#: Unless it is thorough: up to so many crossings a twill is voted on, and refinements tried; a
#: bound is proved with so much work (see prove_bound).
_MOST_QUICK = 20_000
_QUICK_WORK = 4_000_000_000


def twill_facts(
    woven: WovenObject,
    settings: Settings,
    left_out: list[str],
    progress: Progress,
    *,
    thorough: bool,
) -> dict[str, Any]:
    """Decide the 2/2 twill, here and after changes of the mesh; add what is left out to a list."""
    progress("twill", 0, 1)
    halfedges, threads, twill = woven.halfedges, woven.weave.threads, woven.result.twill
    conditions = twill_conditions(halfedges, threads)
    facts: dict[str, Any] = {"exact": True, "conditions": conditions.count}
    if twill is not None:
        # The weave was to be a twill, so all this is known already.
        reason, voted, bound = twill.obstruction, twill.voted, twill.bound
    else:
        decision = decide_twill(conditions)
        reason, voted, bound = None, None, None
        if not decision.twillable:
            reason = explain(halfedges, threads, conditions, decision, woven.labels)
            if threads.n_crossings <= (_MOST_VOTED if thorough else _MOST_QUICK):
                progress("voting", 0, 1)
                voted = best_vote(conditions, threads, woven.bunches).broken
                seeds = irregular_seeds(halfedges, threads)
                bound = prove_bound(
                    couple(conditions),
                    seeds,
                    most_work=None if thorough else _QUICK_WORK,
                    wider_work=WIDER_WORK["normal"] if thorough else 0.0,
                    progress=progress,
                )
                if bound.cut_short:
                    left_out.append("the best proof of how many conditions every twill breaks")
            elif threads.n_crossings <= _MOST_VOTED:
                left_out.append("how many conditions a twill breaks")
    if reason is None:
        return facts
    facts |= {"exact": False, "because": reason.text}
    if voted is not None and bound is not None:
        facts["voting_breaks"] = voted.total
        # What is not twillable breaks one condition at least.
        facts["at_least_broken"] = max(bound.least, 1)
    if twill is not None:
        facts["broken"] = twill.weave.broken.total
    n_edges = halfedges.n_edges
    facts["exact_after"] = []
    if n_edges <= (_MOST_REFINED if thorough else _MOST_QUICK):
        facts["exact_after"] = _exact_after(woven.mesh, settings, progress)
    elif n_edges <= _MOST_REFINED:
        left_out.append("after which refinements an exact twill exists")
    return facts


def _exact_after(mesh: PolyMesh, settings: Settings, progress: Progress) -> list[dict[str, Any]]:
    """Return the options that would give the mesh an exact twill, and how large it is then."""
    options = []
    for number, text in enumerate(("", *_REFINEMENTS)):
        progress("refinements", number, len(_REFINEMENTS) + 1)
        if text:
            option = (
                f"refine {settings.mesh.refine},{text}"
                if settings.mesh.refine
                else f"refine {text}"
            )
        else:
            option = "remesh quads"
        try:
            changed = (
                refine_mesh(mesh, parse_refinements(text)) if text else _paired(mesh, settings)
            )
            halfedges = build_halfedges(changed)
        except FabweaveError:
            continue  # a scheme that cannot hold this mesh is no advice
        threads = trace_threads(halfedges, turn=settings.weave.boundary == "turn")
        if decide_twill(twill_conditions(halfedges, threads)).twillable:
            options.append(
                {"option": option, "crossings": threads.n_crossings, "threads": threads.n_threads}
            )
    return options


def _paired(mesh: PolyMesh, settings: Settings) -> PolyMesh:
    """Pair triangles that are split quads, as ``--remesh quads`` would as the first thing.

    Raises
    ------
    CannotMakeError
        If it would do something else.
    """
    first = not settings.mesh.remeshed and not settings.mesh.refine
    pairing = pair_triangles(mesh) if first and (mesh.face_sizes == 3).any() else None
    paired = merge_pairs(mesh, pairing) if pairing is not None and pairing.split else mesh
    if paired is mesh or (paired.face_sizes != 4).any():
        raise CannotMakeError("the mesh is not made of split quads")
    return paired
