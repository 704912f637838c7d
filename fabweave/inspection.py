"""Tell what a mesh is and what can be woven on it, before anything is decided."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from fabweave.arrays import FloatArray, IntArray, Progress, no_progress
from fabweave.errors import FabweaveError
from fabweave.job import WovenObject, complete_settings, plan_runs, weave_object
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.irregular import find_irregular, interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.refine import format_refinements, parse_refinements, refine_mesh
from fabweave.report.contact import contact_sheet
from fabweave.report.pictures import irregular_marks, mesh_picture, weave_picture
from fabweave.report.view import Up
from fabweave.ribbon.check import ribbon_widths, thread_lengths
from fabweave.settings import JobSettings
from fabweave.weave.anneal import couple
from fabweave.weave.bound import irregular_seeds, prove_bound
from fabweave.weave.bunches import find_bunches, thread_graph
from fabweave.weave.colours import Strategy, thread_colours
from fabweave.weave.conditions import twill_conditions
from fabweave.weave.decide import decide_twill
from fabweave.weave.fabrics import weave_fabric
from fabweave.weave.link import pd_text, planar_diagram
from fabweave.weave.obstruction import explain
from fabweave.weave.repeat import parse_fabric
from fabweave.weave.rotation import trace_twisted
from fabweave.weave.threads import Threads, trace_threads
from fabweave.weave.voting import best_vote

#: Refinements that may turn a mesh into one with an exact twill.
_REFINEMENTS = ("simplest:1", "simplest:2", "catmull-clark:1", "doo-sabin:1", "sqrt3:1", "loop:1")
#: Fabrics that are tried.
_FABRICS = ("2/1", "3/1", "2/2", "3/3", "satin:5/2", "satin:8/3")
#: Larger meshes are not refined on trial, nor voted on.
_MOST_REFINED = 60_000
_MOST_VOTED = 30_000


@dataclass(frozen=True, eq=False)
class Inspection:
    """What is known about a mesh.

    Parameters
    ----------
    object : WovenObject
        The mesh, woven as asked.
    facts : dict
        Everything found, as JSON takes it: ``mesh``, ``threads``, ``bunches``, ``twill``,
        ``fabrics``, ``ribbons``, ``pieces`` and ``notes``.
    """

    object: WovenObject
    facts: dict[str, Any]


def inspect_mesh(settings: JobSettings, progress: Progress = no_progress) -> Inspection:
    """Find out what a maker needs to know before deciding how to weave a mesh.

    Parameters
    ----------
    settings : JobSettings
        The mesh, its size, and how it would be woven.
    progress : callable
        Told what is being done.

    Returns
    -------
    Inspection

    Raises
    ------
    InputError, CannotMakeError
        If the mesh cannot be woven at all.
    """
    settings, material = complete_settings(settings)
    thing = weave_object(settings, material, progress)
    mesh, halfedges = thing.woven.mesh, thing.woven.halfedges
    threads = thing.weave.threads
    progress("twill", 0, 1)
    facts = {
        "mesh": _mesh_facts(mesh, halfedges),
        "threads": _thread_facts(threads, thing.labels, thread_lengths(thing.ribbons)),
        "bunches": _bunch_facts(threads),
        "twill": _twill_facts(thing, settings, progress),
        "fabrics": _fabric_facts(halfedges, threads, thing.labels),
        "ribbons": _spread(ribbon_widths(thing.ribbons)),
        "pieces": _piece_facts(thing, settings, progress),
        "notes": [*thing.woven.notes, *thing.chosen.notes],
    }
    return Inspection(thing, facts)


def _mesh_facts(mesh: PolyMesh, halfedges: Halfedges) -> dict[str, Any]:
    """Return sizes, topology and regularity."""
    report = check_mesh(mesh)
    first = halfedges.edge_halfedge
    ends = mesh.vertices[halfedges.tail[first]], mesh.vertices[halfedges.head[first]]
    _, valences = interior_valences(halfedges)
    irregular = find_irregular(mesh)
    return {
        "vertices": report.n_vertices,
        "edges": report.n_edges,
        "faces": report.n_faces,
        "face_sizes": {str(size): number for size, number in report.face_sizes},
        "valences": {str(k): int(n) for k, n in sorted(Counter(valences.tolist()).items())},
        "components": report.n_components,
        "boundary_loops": report.n_boundary_loops,
        "genus": report.genus,
        "size_mm": [round(float(side), 3) for side in np.ptp(mesh.vertices, axis=0)],
        "edge_mm": _spread(np.linalg.norm(ends[1] - ends[0], axis=1)),
        "irregular_vertices": len(irregular),
        "breaking_twill": int(np.count_nonzero(irregular.breaks_twill)),
    }


def _thread_facts(threads: Threads, labels: Sequence[str], length_mm: FloatArray) -> dict[str, Any]:
    """Return how many threads there are and how long; the longest by name."""
    longest = np.argsort(-threads.lengths, kind="stable")[:8]
    return {
        "count": threads.n_threads,
        "closed": int(np.count_nonzero(threads.closed)),
        "crossings": threads.n_crossings,
        "crossing_themselves": int(np.count_nonzero(thread_graph(threads).diagonal())),
        "passes": _spread(threads.lengths),
        "length_mm": _spread(length_mm),
        "total_mm": round(float(length_mm.sum()), 1),
        "longest": [
            {
                "label": labels[number],
                "passes": int(threads.lengths[number]),
                "length_mm": round(float(length_mm[number]), 1),
            }
            for number in longest.tolist()
        ],
    }


def _bunch_facts(threads: Threads) -> dict[str, Any]:
    """Return how many bunches there are."""
    bunches = find_bunches(threads)
    return {
        "count": bunches.n_bunches,
        "fewest": bunches.fewest,
        "warp_and_weft": bunches.warp_and_weft,
    }


def _twill_facts(thing: WovenObject, settings: JobSettings, progress: Progress) -> dict[str, Any]:
    """Decide the 2/2 twill, here and after refinements."""
    halfedges, threads = thing.woven.halfedges, thing.weave.threads
    conditions = twill_conditions(halfedges, threads)
    decision = decide_twill(conditions)
    facts: dict[str, Any] = {"exact": decision.twillable, "conditions": conditions.count}
    reason = explain(halfedges, threads, conditions, decision, thing.labels)
    if reason is not None:
        facts["because"] = reason.text
        if threads.n_crossings <= _MOST_VOTED:
            progress("voting", 0, 1)
            couplings = couple(conditions)
            bound = prove_bound(couplings, irregular_seeds(halfedges, threads), progress=progress)
            facts["voting_breaks"] = best_vote(conditions, threads, thing.bunches).broken.total
            facts["at_least_broken"] = max(bound.least, 1)
    facts["exact_after"] = _exact_after(thing.woven.mesh, settings.boundary == "turn", progress)
    return facts


def _exact_after(mesh: PolyMesh, turn: bool, progress: Progress) -> list[dict[str, Any]]:
    """Return the refinements after which an exact twill exists, and how many crossings then."""
    found = []
    if build_halfedges(mesh).n_edges <= _MOST_REFINED:
        for number, text in enumerate(_REFINEMENTS):
            progress("refinements", number, len(_REFINEMENTS))
            refinements = parse_refinements(text)
            try:
                halfedges = build_halfedges(refine_mesh(mesh, refinements))
            except FabweaveError:
                continue  # a scheme that cannot hold this mesh is no advice
            threads = trace_threads(halfedges, turn=turn)
            if decide_twill(twill_conditions(halfedges, threads)).twillable:
                found.append(
                    {
                        "refine": format_refinements(refinements),
                        "crossings": threads.n_crossings,
                        "threads": threads.n_threads,
                    }
                )
    return found


def _fabric_facts(halfedges: Halfedges, threads: Threads, labels: Sequence[str]) -> dict[str, Any]:
    """Try the usual fabrics."""
    exact, reasons = [], {}
    for text in _FABRICS:
        result = weave_fabric(halfedges, threads, parse_fabric(text), labels=labels)
        if result.weave is not None:
            exact.append(text)
        elif result.obstruction is not None:
            reasons[text] = result.obstruction.text
    return {"exact": exact, "because": reasons}


def _piece_facts(thing: WovenObject, settings: JobSettings, progress: Progress) -> dict[str, Any]:
    """Split the ribbons and count the pieces, if they can be cut at all."""
    progress("pieces", 0, 1)
    try:
        runs = plan_runs(thing, settings)
    except FabweaveError as error:
        return {"count": None, "because": str(error)}
    return {"count": len(runs.thread), "sheet": [f"{s.width_mm:g}x{s.height_mm:g}mm"
                                                 for s in settings.sheets]}  # fmt: skip


def _spread(values: FloatArray | IntArray) -> dict[str, float]:
    """Return the least, the middle and the greatest of some values."""
    if not len(values):
        return {"least": 0.0, "median": 0.0, "greatest": 0.0}
    return {
        "least": round(float(values.min()), 3),
        "median": round(float(np.median(values)), 3),
        "greatest": round(float(values.max()), 3),
    }


def inspection_text(found: Inspection) -> list[tuple[str, str]]:
    """Return what was found as topics and sentences."""
    mesh, threads, twill = (found.facts[key] for key in ("mesh", "threads", "twill"))
    bunches, ribbons, pieces = (found.facts[key] for key in ("bunches", "ribbons", "pieces"))
    sizes = ", ".join(f"{n} of {size} sides" for size, n in mesh["face_sizes"].items())
    valences = ", ".join(f"{n} of valence {k}" for k, n in mesh["valences"].items())
    rows = [_topic(note) for note in found.facts["notes"]]
    rows += [
        ("faces", sizes),
        ("vertices", valences or "none inside the surface"),
        ("edges", f"{_range(mesh['edge_mm'], 1)} mm long"),
        (
            "threads",
            f"{threads['count']} ({threads['closed']} closed), {threads['crossings']} crossings; "
            f"{_range(threads['passes'], 0)} crossings each, {_range(threads['length_mm'], 0)} mm; "
            f"{threads['total_mm'] / 1000:.1f} m in all; "
            f"{threads['crossing_themselves']} cross themselves",
        ),
        (
            "bunches",
            "2: warp and weft"
            if bunches["warp_and_weft"]
            else f"{bunches['count']}{'' if bunches['fewest'] else ' or fewer'}",
        ),
    ]
    if twill["exact"]:
        rows.append(("twill", "exact (--pattern twill)"))
    else:
        rows.append(("twill", f"no exact 2/2 twill: {twill['because']}"))
        if "voting_breaks" in twill:
            rows.append(
                (
                    "",
                    f"of {twill['conditions']} conditions the paper's voting breaks "
                    f"{twill['voting_breaks']}; every weave breaks {twill['at_least_broken']} or "
                    "more; --pattern twill searches between the two",
                )
            )
        after = [f"{one['refine']} ({one['crossings']} crossings)" for one in twill["exact_after"]]
        rows.append(("", "exact with --pattern triaxial" + "".join(
            f", or after --refine {text}" for text in after)))  # fmt: skip
        if int(mesh["face_sizes"].get("3", 0)) * 2 > mesh["faces"]:
            rows.append(("", "triangles become quads for a biaxial twill with --remesh quads"))
    rows += _fabric_rows(found.facts["fabrics"])
    rows.append(("ribbons", f"{_range(ribbons, 1)} mm wide"))
    if pieces["count"] is None:
        rows.append(("pieces", pieces["because"]))
    else:
        rows.append(("pieces", f"about {pieces['count']}, for sheets of {pieces['sheet'][0]}"))
    return rows


def _topic(note: str) -> tuple[str, str]:
    """Split a note at its topic, if it names one."""
    topic, colon, text = note.partition(": ")
    return (topic, text) if colon and topic.isalpha() else ("note", note)


def _fabric_rows(fabrics: dict[str, Any]) -> list[tuple[str, str]]:
    """Say which fabrics close up, and why others do not; one reason once."""
    rows = [("fabrics", f"exact: {', '.join(fabrics['exact']) or 'none'}")]
    reasons: dict[str, list[str]] = {}
    for text, reason in fabrics["because"].items():
        reasons.setdefault(reason, []).append(text)
    return rows + [("", f"not {', '.join(texts)}: {reason}") for reason, texts in reasons.items()]


def _range(spread: dict[str, float], digits: int) -> str:
    least, most = f"{spread['least']:.{digits}f}", f"{spread['greatest']:.{digits}f}"
    return least if least == most else f"{least} to {most} (median {spread['median']:.{digits}f})"


def inspection_picture(found: Inspection, colours: Strategy, up: Up) -> Image.Image:
    """Return the mesh with its irregular vertices marked, beside the woven object."""
    thing = found.object
    mesh, threads = thing.woven.mesh, thing.weave.threads
    marks = irregular_marks(mesh)
    tiles = [
        mesh_picture(mesh, up=up, marks=marks),
        weave_picture(thing.ribbons, thread_colours(thing.bunches, colours), up=up),
    ]
    captions = [
        f"{thing.woven.title}\n{mesh.n_faces} faces, {len(marks.points)} irregular vertices marked",
        f"{thing.weave.pattern}\n{threads.n_threads} threads, {threads.n_crossings} crossings, "
        + ("exact" if thing.weave.exact else f"{thing.weave.broken.total} broken conditions"),
    ]
    return contact_sheet(tiles, captions, columns=2)


def inspection_link(found: Inspection) -> str:
    """Return the link of the weave as a planar diagram code.

    Raises
    ------
    CannotMakeError
        If the mesh is open or has handles.
    """
    halfedges, weave = found.object.woven.halfedges, found.object.weave
    senses = np.where(weave.twist, 1, -1)
    half_twists = np.zeros(halfedges.n_edges, dtype=np.int64)
    half_twists[halfedges.edge[weave.threads.crossing_halfedge]] = senses
    return pd_text(planar_diagram(halfedges, trace_twisted(halfedges, half_twists)))
