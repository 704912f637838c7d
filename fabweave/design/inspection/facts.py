"""Inspect a mesh: what it is, what can be woven on it, and what would help."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
)
from fabweave.core.errors import CannotMakeError, FabweaveError
from fabweave.core.finding import Note
from fabweave.core.parallel.executors import Executors, here
from fabweave.core.records import to_json
from fabweave.design.beside import apart, why_few
from fabweave.design.choice import choose_mesh, shelf
from fabweave.design.search import Search, tell_nobody
from fabweave.design.search import Told as ToldDesign
from fabweave.design.tried import Tried
from fabweave.estimate.costs import Costs
from fabweave.estimate.texts import cost_rows
from fabweave.job.figures import figures_of
from fabweave.job.planned import PlannedJob
from fabweave.job.ribbon_report import ribbon_notes, ribbon_report
from fabweave.job.stations import Stations
from fabweave.mesh.automorphisms import EXACT, Symmetry, orbits
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.mirror import find_mirror
from fabweave.mesh.one_rings import find_irregular, interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.coarse import cages, paired_quads
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.settings import MeshSettings
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.options.command import long_command
from fabweave.options.settings import Settings
from fabweave.piece.grain import grain_notes
from fabweave.piece.split.length_curve import splitting_reason
from fabweave.plan.verdict import NARROW_MM, judge, refused
from fabweave.ribbon.lay import WovenObject, check_object, require_stiffness, width_notes
from fabweave.ribbon.measures import NEAR_SIZE, thread_lengths
from fabweave.ribbon.rules.remedy import SIZED, Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import format_stock
from fabweave.weave.bunches import count_bodies, find_bunches, thread_graph
from fabweave.weave.fabrics import parse_fabric, weave_fabric
from fabweave.weave.symmetry import find_weave_symmetry, nearest_symmetry
from fabweave.weave.threads import Threads, thread_labels, trace_threads
from fabweave.weave.twill.anneal import couple
from fabweave.weave.twill.bound import WIDER_WORK, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import broken_at_turns, twill_conditions
from fabweave.weave.twill.decide import decide_twill, explain
from fabweave.weave.twill.voting import best_vote
from fabweave.weave.weave_mesh import turns_back

#: Refinements that may turn a mesh into one with an exact twill.
_REFINEMENTS = ("simplest:1", "simplest:2", "catmull-clark:1", "doo-sabin:1", "loop:1")
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
    facts: dict[str, Any] = {"conditions": conditions.count}
    if twill is not None:
        # The weave was to be a twill, so all this is known already.
        reason, voted, bound = twill.obstruction, twill.voted, twill.bound
        facts |= _exactness(threads, None if reason else twill.weave.twist)
    else:
        decision = decide_twill(conditions)
        reason, voted, bound = None, None, None
        facts |= _exactness(threads, decision.twist)
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
    facts["because"] = reason.text
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


def _exactness(threads: Threads, twist: BoolArray | None) -> dict[str, Any]:
    """Tell whether twists make an exact 2/2 twill, and where it breaks all the same: at turns."""
    turns = 0 if twist is None else broken_at_turns(threads, twist)
    return {"exact": twist is not None} | ({"broken_at_turns": turns} if turns else {})


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
                refine_mesh(mesh, parse_refinements(text)) if text else _paired(mesh, settings.mesh)
            )
            halfedges = build_halfedges(changed)
        except FabweaveError:
            continue  # a scheme that cannot hold this mesh is no advice
        threads = trace_threads(halfedges, turn=turns_back(settings.weave, changed, halfedges))
        if decide_twill(twill_conditions(halfedges, threads)).twillable:
            options.append(
                {"option": option, "crossings": threads.n_crossings, "threads": threads.n_threads}
            )
    return options


def _paired(mesh: PolyMesh, asked: MeshSettings) -> PolyMesh:
    """Pair triangles that are split quads, as ``--remesh quads`` would as the first thing.

    Raises
    ------
    CannotMakeError
        If it would do something else.
    """
    first = not asked.remeshed and not asked.refine
    pairing = pair_triangles(mesh) if first and (mesh.face_sizes == 3).any() else None
    paired = merge_pairs(mesh, pairing) if pairing is not None and pairing.split else mesh
    if paired is mesh or (paired.face_sizes != 4).any():
        raise CannotMakeError("the mesh is not made of split quads")
    return paired


def advice(
    asked: Settings, woven: WovenObject, check: RibbonCheck, level: str
) -> list[dict[str, Any]]:
    """Return what would help, or what makes it, each with its command.

    A size is told only where it is at most ``NEAR_SIZE`` times the present one, and strips are wide
    enough for hands there. Where rules would want more, the mesh is too fine for its size.

    Parameters
    ----------
    asked : Settings
        As they were asked for.
    woven : WovenObject
    check : RibbonCheck
        Of its ribbons.
    level : str
        The verdict's.

    Returns
    -------
    list of dict
        ``text``, which says what it does, and ``command``; the command is None where the text names
        an option without a value.
    """
    ways: list[dict[str, Any]] = []

    def add(text: str, command: str | None = None, **changes: Any) -> None:
        ways.append({"text": text, "command": command or long_command(asked.but(**changes))})

    if level == "makeable":
        add("this makes it")
        return ways
    findings = check.findings
    sizes = [finding.size_mm for finding in findings if finding.rule in SIZED]
    known = [size for size in (check.smallest_mm, *sizes) if size is not None]
    most = max(known, default=0)
    larger = most > woven.size_mm
    # At a size at which rules hold, strips may still be threads that no hand weaves.
    widths = check.measured["width"].value
    wide_mm = float(np.median(widths)) * max(most / woven.size_mm, 1.0) if len(widths) else np.inf
    too_fine = most > NEAR_SIZE * woven.size_mm or (larger and wide_mm < NARROW_MM)
    if larger and not too_fine:
        rules = [finding.rule for finding in findings if finding.size_mm is not None]
        what = "every rule of size" if check.smallest_mm is not None else " and ".join(rules)
        add(f"at this size {what} would hold", size_mm=float(most))
    finer = {finding.refine: finding.rule for finding in findings if finding.refine is not None}
    for refinement, rule in finer.items():
        add(f"a finer mesh mends {rule}, as tried", refine=refinement)
    if too_fine or None in sizes:  # or no size helps, or none was looked for
        fine = f"; this one is too fine for {woven.size_mm:.0f} mm" if too_fine else ""
        text = f"a mesh with fewer, larger faces may do{fine}"
        ways.append({"text": text, "command": None})
    for finding in findings:
        if finding.width_factor is not None:
            narrower = round(100 * (1 - finding.width_factor))
            text = f"ribbons {narrower} % narrower mend {finding.rule}"
            add(text, long_command(asked.narrower(finding.width_factor)))
    if not ways and level == "with care":
        add("this makes it, with care")
    return ways


def symmetry_facts(woven: WovenObject, n_pieces: int | None) -> dict[str, Any]:
    """Return the symmetry of a mesh and of its weave.

    Parameters
    ----------
    woven : WovenObject
        The mesh and its weave.
    n_pieces : int or None
        How many pieces it is cut from, if that is known.
    """
    mesh = nearest_symmetry(woven.mesh, woven.halfedges)
    tolerance = mesh.tolerance
    weave = find_weave_symmetry(woven.mesh, woven.halfedges, woven.weave, tolerance=tolerance)
    kinds = None
    if n_pieces is not None:
        # Each orbit of threads has kinds of its own, and each kind a place for each rotation; a
        # piece is not the mirror image of itself.
        every = np.arange(woven.weave.threads.n_threads)
        turned = orbits(weave.thread_images(every)[weave.group.proper], len(every))
        kinds = max(int(turned.max(initial=-1)) + 1, -(-n_pieces // weave.group.n_rotations))
    return {
        "tolerance_percent": round(100 * tolerance, 6),
        "exact": tolerance == EXACT,
        "mesh": _counts(mesh),
        "weave": _counts(weave.group),
        "axes": _axes(weave.group),
        "orbits": {
            "threads": int(weave.thread_orbits.max(initial=-1)) + 1,
            "crossings": int(weave.crossing_orbits.max(initial=-1)) + 1,
        },
        "kinds_possible": kinds,
    }


def _counts(group: Symmetry) -> dict[str, int]:
    return {"rotations": group.n_rotations, "reflections": group.n_reflections}


def _axes(group: Symmetry) -> list[dict[str, Any]]:
    """Return how many axes there are about which the weave may be turned so many times."""
    turns = np.flatnonzero(group.proper & (group.angle_deg != 0.0))
    _, line = np.unique(np.round(group.axis[turns], 6), axis=0, return_inverse=True)
    folds, numbers = np.unique(np.bincount(line.ravel()) + 1, return_counts=True)
    pairs = zip(folds.tolist(), numbers.tolist(), strict=True)
    return [{"fold": fold, "count": number} for fold, number in reversed(list(pairs))]


#: Fabrics that are tried.
_FABRICS = ("2/1", "3/1", "2/2", "3/3", "satin:5/2", "satin:8/3")


def mesh_facts(mesh: PolyMesh, halfedges: Halfedges, *, brief: bool) -> dict[str, Any]:
    """Return sizes, topology and regularity; in brief, without what takes long to find."""
    report = check_mesh(mesh)
    facts = {
        "vertices": report.n_vertices,
        "edges": report.n_edges,
        "faces": report.n_faces,
        "face_sizes": {str(size): number for size, number in report.face_sizes},
        "components": report.n_components,
        "boundary_loops": report.n_boundary_loops,
        "genus": report.genus,
        "size_mm": [round(float(side), 3) for side in np.ptp(mesh.vertices, axis=0)],
    }
    if brief:
        return facts
    first = halfedges.edge_halfedge
    ends = mesh.vertices[halfedges.tail[first]], mesh.vertices[halfedges.head[first]]
    _, valences = interior_valences(halfedges)
    irregular = find_irregular(mesh)
    mirror = find_mirror(mesh)
    return facts | {
        "valences": {str(k): int(n) for k, n in sorted(Counter(valences.tolist()).items())},
        "edge_mm": spread(np.linalg.norm(ends[1] - ends[0], axis=1)),
        "mirror": {
            "symmetric": mirror.symmetric,
            "normal": [round(float(x), 4) for x in mirror.normal],
            "off_percent": round(mirror.rms_percent, 3),
        },
        "cages": [cage.n_faces for cage in cages(paired_quads(mesh))],
        "irregular_vertices": len(irregular),
    }


def thread_facts(threads: Threads, labels: Sequence[str], length_mm: FloatArray) -> dict[str, Any]:
    """Return how many threads are woven and how long they are; the longest by name."""
    longest = np.argsort(-threads.lengths, kind="stable")[:8]
    return {
        "count": int(np.count_nonzero(threads.woven)),
        "closed": int(np.count_nonzero(threads.closed & threads.woven)),
        "crossings": threads.n_crossings,
        "crossing_themselves": int(np.count_nonzero(thread_graph(threads).diagonal())),
        "passes": spread(threads.lengths[threads.woven]),
        "length_mm": spread(length_mm[threads.woven]),
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


def fabric_facts(
    halfedges: Halfedges, threads: Threads, labels: Sequence[str], progress: Progress
) -> dict[str, Any]:
    """Try the usual fabrics."""
    exact, reasons = [], {}
    for number, text in enumerate(_FABRICS):
        progress("fabrics", number, len(_FABRICS))
        result = weave_fabric(halfedges, threads, parse_fabric(text), labels=labels)
        if result.weave is not None:
            exact.append(text)
        elif result.obstruction is not None:
            reasons[text] = result.obstruction.text
    return {"exact": exact, "because": reasons}


def spread(values: FloatArray | IntArray) -> dict[str, float]:
    """Return the least, the middle and the greatest of some values."""
    if not len(values):
        return {"least": 0.0, "median": 0.0, "greatest": 0.0}
    return {
        "least": round(float(values.min()), 3),
        "median": round(float(np.median(values)), 3),
        "greatest": round(float(values.max()), 3),
    }


#: So many designs are shown where it cannot be built, and nobody says how many.
_DESIGNS = 3
#: The answer alone says what pieces come to up to so many crossings: planning them takes a second.
_MOST_ANSWERED = 1000
#: Unless it is thorough: up to so many crossings every remedy is looked for, and tried on what
#: would be made, which is most of the work ...
_MOST_SEARCHED = 100
#: ... times and costs are told ...
_MOST_PRICED = 2000
#: ... and pieces are planned and ribbons kept clear.
_MOST_PLANNED = 20_000

#: Told what is found as soon as it is: at first ``mesh``, and ``verdict`` where that is seen at
#: once, then all but the designs.
Told: TypeAlias = Callable[[dict[str, Any]], None]


@frozen_value
class Inspection:
    """What is known about a mesh.

    Parameters
    ----------
    woven : WovenObject
        The mesh, woven as asked.
    facts : dict
        Everything found, as JSON takes it: ``mesh``, ``symmetry``, ``threads``, ``bunches``,
        ``twill``, ``fabrics``, ``ribbons``, ``pieces``, ``costs``, ``form_mm``, ``grade``,
        ``checks``, ``verdict``, ``advice`` (what would help, with the command that does it),
        ``designs`` (that were tried), ``designs_why`` (why few of them can be built),
        ``left_out`` (what only a thorough inspection tells) and ``notes``; ``chosen``, which says
        on which mesh ``make`` would weave the model if that is not its own, ``likeness`` where the
        mesh was remeshed, ``openings`` where faces were left out.
    designs : tuple of Tried
        The designs that were tried, from coarse to fine, with their pictures.
    """

    woven: WovenObject
    facts: dict[str, Any]
    designs: tuple[Tried, ...] = ()


def inspect_mesh(
    job: Stations,
    *,
    answer: bool = False,
    thorough: bool = False,
    n_designs: int = 0,
    looks: bool = False,
    executors: Executors = here,
    told: Told = tell_nobody,
    told_design: ToldDesign = tell_nobody,
    better: Callable[[str], None] = tell_nobody,
) -> Inspection:
    """Find out what a maker needs to know before deciding how to weave a mesh.

    It is told of the mesh on which ``make`` would weave the model: see :func:`choose_mesh`.

    Parameters
    ----------
    job : Stations
        The mesh, its size, and how it would be woven.
    answer : bool
        Whether to stop at the answer: what the mesh is, whether it can be built, what would help,
        and what it comes to if there are few crossings. That takes some seconds at most.
    thorough : bool
        Whether to plan the pieces and look for every remedy however many crossings there are,
        which may take an hour. How much is done otherwise depends on the number of crossings
        alone, so the same mesh is always told the same.
    n_designs : int
        How many designs from coarse to fine to show; where it cannot be built, they are tried even
        if none are asked for.
    looks : bool
        Whether pictures of these are wanted.
    executors : callable
        Opens the executor that tries them; changes no result.
    told : callable
        Called twice before designs are tried: with what the mesh is, within seconds, and with
        everything but the designs.
    told_design : callable
        Called with each design as it is tried.
    better : callable
        Called with a line for each mesh that is better than those before, while one is chosen.

    Raises
    ------
    InputError, CannotMakeError
        If the mesh cannot be woven at all.
    """
    asked, own = job.asked, job
    search = Search(
        asked, job.given, progress=job.progress, executors=executors, better=better, looks=looks
    )
    count = job.n_crossings
    most = _MOST_ANSWERED if answer else count if thorough else _MOST_PLANNED
    facts: dict[str, Any] = {
        "mesh": mesh_facts(job.loaded.mesh, job.loaded.halfedges, brief=answer),
        "notes": list(job.loaded.notes),
    }
    told(facts)
    own.depth = _depth(count, answer=answer, thorough=thorough)
    fails, chosen = False, ""
    try:
        choice = choose_mesh(own, search, most_planned=most, advise=False)
        job, chosen = choice.job, choice.text
    except CannotMakeError:
        fails = True
    found = _inspected(job, most, chosen, answer=answer, thorough=thorough)
    told(found.facts)
    if not (n_designs or fails):
        return found
    search.told, search.better = told_design, tell_nobody
    search = shelf(search, n_designs or _DESIGNS)
    designs = _shown(search, n_designs or _DESIGNS)
    rows = {"designs": [one.record() for one in designs], "designs_why": why_few(search)}
    return replace(found, facts=found.facts | rows, designs=designs)


def _inspected(
    job: Stations, most: int, chosen: str, *, answer: bool, thorough: bool
) -> Inspection:
    """Return all that is told of a job but the designs."""
    count, depth = job.n_crossings, job.depth
    left_out: list[str] = []
    pieces, planned = _pieces(job, most)
    if planned is None:
        settings, supplies = job.settled
        # What would be narrowed where it is too near is looked at as it would be.
        woven = job.ribbons if depth == Depth.ALONG else job.clear_ribbons
        check = check_object(woven, settings.ribbons, supplies, depth=min(depth, Depth.NEAR))
        verdict = judge(
            check.findings,
            narrowest_mm=float(check.measured["width"].value.min(initial=np.inf)),
            bodies=count_bodies(woven.weave.threads),
            left_out=woven.source.left_out,
        )
        if "because" in pieces:
            verdict = refused(pieces["because"], verdict)
        if "left_out" in pieces:
            left_out.append("the pieces")
            if depth == Depth.ALONG:
                left_out.append("how near ribbons come to one another")
    else:
        woven, verdict = planned.woven, replace(planned.verdict, forced=False)
        check = job.check_at(depth) if depth == Depth.SEARCHED else planned.check
    figures = None
    if planned is not None and (depth == Depth.SEARCHED or count <= _MOST_PRICED):
        job.progress("costs", 0, 1)
        figures = figures_of(job)
        pieces |= {"kinds": figures.kinds}
    elif planned is not None:
        left_out.append("times and costs")
    notes: list[Note] = []
    if depth == Depth.SEARCHED:
        job.progress("widths", 0, 1)
        notes = width_notes(woven, job.settled[0].ribbons, job.settled[1])
    else:
        if check.findings:
            left_out.append("the size at which all rules hold, and other remedies")
        left_out.append("how wide ribbons of constant width could be")
    materials, settings = job.settled[1].materials, job.settled[0]
    turns = parse_rotations(settings.stock.rotations)
    facts = {
        "mesh": mesh_facts(woven.wished, woven.halfedges, brief=answer),
        "chosen": chosen,
        "verdict": to_json(verdict),
        "notes": list(woven.notes),
        **(
            _weave_answer(woven)
            if answer
            else _weave_facts(
                woven, job.completed[0], pieces["count"], left_out, job.progress, thorough=thorough
            )
        ),
        "ribbons": spread(check.measured["width"].value),
        "pieces": pieces,
        "costs": None if figures is None else _costs(job.costs),
        "form_mm": None if figures is None else figures.form_mm,
        "collapses": figures is not None and bool(figures.collapses),
        "grade": None if figures is None else figures.grade,
        "checks": {
            **to_json(ribbon_report(check, woven.ribbons, woven.labels)),
            "notes": [
                *notes,
                *ribbon_notes(check, materials),
                *grain_notes(woven.ribbons, check.limits, materials, turns),
            ],
        },
        "advice": advice(job.asked, woven, check, verdict.level),
        "designs": [],
        "designs_why": "",
        "left_out": left_out,
        **_changes(woven),
    }
    return Inspection(woven, facts)


def _weave_facts(
    woven: WovenObject,
    settings: Settings,
    n_pieces: int | None,
    left_out: list[str],
    progress: Progress,
    *,
    thorough: bool,
) -> dict[str, Any]:
    """Return all that is to be told of the weave; add what is left out to a list."""
    halfedges, threads = woven.halfedges, woven.weave.threads
    # Where it is left open, threads end at rims for fabrics of warp and weft.
    ending = trace_threads(halfedges) if settings.weave.boundary == "auto" else threads
    bunches = find_bunches(ending)
    return {
        "symmetry": symmetry_facts(woven, n_pieces),
        "threads": thread_facts(threads, woven.labels, thread_lengths(woven.ribbons)),
        "bunches": {
            "count": bunches.n_bunches,
            "fewest": bunches.fewest,
            "warp_and_weft": bunches.warp_and_weft,
        },
        "twill": twill_facts(woven, settings, left_out, progress, thorough=thorough),
        "fabrics": fabric_facts(halfedges, ending, thread_labels(ending.n_threads), progress),
    }


def _weave_answer(woven: WovenObject) -> dict[str, Any]:
    """Return what an answer tells of the weave: its threads, and whether a twill is exact."""
    threads = woven.weave.threads
    decision = decide_twill(twill_conditions(woven.halfedges, threads))
    return {
        "threads": thread_facts(threads, woven.labels, thread_lengths(woven.ribbons)),
        "twill": _exactness(threads, decision.twist),
    }


def _costs(costs: Costs) -> dict[str, Any]:
    """Return what pieces would cost, in words too."""
    return {"told": dict(cost_rows(costs)), **to_json(costs)}


def _changes(woven: WovenObject) -> dict[str, Any]:
    """Return what was done to the mesh, where something was."""
    facts: dict[str, Any] = {}
    if woven.source.likeness is not None:
        facts["likeness"] = woven.source.likeness.record()
    if woven.source.openings:
        facts["openings"] = [opening.record() for opening in woven.source.openings]
    return facts


def _shown(search: Search, count: int) -> tuple[Tried, ...]:
    """Return the designs to show, from coarse to fine: those that can be built go first."""
    tried = apart(search.tried)
    built = sorted((one for one in tried if one.makeable), key=_crossings_of)
    if len(built) > count:
        built = [built[round(at)] for at in np.linspace(0, len(built) - 1, count).tolist()]
    others = [one for one in tried if not one.makeable]
    return tuple(sorted([*built, *others][:count], key=_crossings_of))


def _crossings_of(tried: Tried) -> float:
    """Return how many crossings a design has; infinite if that is not known."""
    return np.inf if tried.figures is None else tried.figures.crossings


def _depth(n_crossings: int, *, answer: bool, thorough: bool) -> Depth:
    """Return how far ribbons are checked."""
    if not answer and (thorough or n_crossings <= _MOST_SEARCHED):
        return Depth.SEARCHED
    return Depth.NEAR if n_crossings <= _MOST_PLANNED else Depth.ALONG


def _pieces(job: Stations, most: int) -> tuple[dict[str, Any], PlannedJob | None]:
    """Return what pieces come to, and these, if they can be cut at all and are not too many."""
    sheets = [format_stock(sheet) for sheet in job.settled[0].stock.sheets]
    try:
        if job.n_crossings > most:
            settings, supplies = job.settled
            require_stiffness(job.ribbons, settings.ribbons, supplies)
            why = f"there are more than {most} crossings"
            return {"count": None, "left_out": why, "sheets": sheets}, None
        planned = job.planned
    except FabweaveError as error:
        return {"count": None, "because": str(error), "sheets": sheets}, None
    plan = planned.split_plan
    pieces = {
        "count": len(plan.runs.thread),
        "sheets": sheets,
        "max_length_mm": round(plan.length_mm, 1),
        "prefer": plan.prefer,
        "chosen": to_json(plan.chosen.record()),
        "reason": splitting_reason(plan.chosen.record(), plan.prefer, len(plan.choices)),
        "choices": [to_json(choice.record()) for choice in plan.choices],
    }
    return pieces, planned
