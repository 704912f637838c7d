"""Time the exact decision of the 2/2 twill, and say how good inexact twills are; run by hand.

    python tests/benchmarks/bench_twill.py [--effort quick normal best] [--largest EDGES]

First a quad torus of a million edges, where a twill exists and every edge must be looked at: the
decision is compared with tracing the threads, which everything begins with.

Then meshes without an exact twill: conditions that the paper's voting breaks, that our search
breaks, and that every weave must break. "plain" is what a plain implementation of the voting
broke, and "annealed" what plain annealing of a few minutes reached; "ratio" is ours to the latter,
"/voting" ours to our voting. Real meshes lie beside the repository and are left out where they are
not.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ParamSpec, TypeAlias, TypeVar

import numpy as np

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.weave.bunches import part_bunches
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.anneal import couple, optimise_twill
from fabweave.weave.twill.bound import WIDER_WORK, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.voting import best_vote

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "meshes"
#: A slab of squares with two holes, as a plan.
TWO_HOLES = ("#####", "# # #", "#####")

#: What a plain implementation of the paper's voting breaks, and what plain annealing does.
Known: TypeAlias = tuple[int, int] | None
Given = ParamSpec("Given")
Result = TypeVar("Result")


def timed(
    action: Callable[Given, Result], *given: Given.args, **named: Given.kwargs
) -> tuple[Result, float]:
    """Return what a function returns, and the seconds that it took."""
    start = time.perf_counter()
    result = action(*given, **named)
    return result, time.perf_counter() - start


def block(plan: tuple[str, ...]) -> PolyMesh:
    """Return the surface of a slab one cell thick, with a cell for each mark of the plan."""
    cells = {
        (x, y, 0) for y, row in enumerate(plan) for x, mark in enumerate(row) if mark != " "
    }  # fmt: skip
    sides = []
    for x, y, z in sorted(cells):
        for axis in range(3):
            u, v = np.roll(np.eye(3, dtype=int), -axis - 1, axis=0)[:2]
            for step in (0, 1):
                beside = [x, y, z]
                beside[axis] += 2 * step - 1
                if tuple(beside) in cells:
                    continue
                corner = np.array((x, y, z))
                corner[axis] += step
                # Seen from outside: counter-clockwise where the side faces up its axis.
                square = [corner, corner + u, corner + u + v, corner + v]
                sides.append(square if step else square[::-1])
    vertices, index = np.unique(np.array(sides).reshape(-1, 3), axis=0, return_inverse=True)
    return PolyMesh.from_faces(vertices.astype(float), index.reshape(-1, 4).tolist())


def refined(mesh: PolyMesh, steps: int) -> PolyMesh:
    """Return a mesh after steps of Catmull and Clark's scheme."""
    return refine_mesh(mesh, parse_refinements(f"catmull-clark:{steps}"))


def cases() -> Iterator[tuple[str, PolyMesh, Known]]:
    """Give names, meshes without an exact twill, and what is known of them."""
    for steps, known in ((1, (26, 16)), (2, (70, 32)), (3, (170, 64))):
        yield f"cube, Catmull-Clark {steps}", refined(parse_shape("shape:cube"), steps), known
    yield "icosahedron, Catmull-Clark 1", refined(parse_shape("shape:icosahedron"), 1), (62, 40)
    yield "block with 2 holes, C.-C. 2", refined(block(TWO_HOLES), 2), (392, 182)
    for name, known in (("spot_quadrangulated", (1176, 832)), ("bob_quad", (426, 280))):
        path = FOLDER / "quad" / f"{name}.obj"
        if path.is_file():
            yield name, prepare_mesh(read_mesh(path).mesh)[0], known
    yield "sphere?n=91", parse_shape("shape:sphere?n=91"), None


def decide() -> None:
    """Print how long it takes to decide a torus of a million edges."""
    mesh = parse_shape("shape:torus?m=1000&n=500")
    halfedges = build_halfedges(mesh)
    threads, tracing = timed(trace_threads, halfedges)
    conditions, listing = timed(twill_conditions, halfedges, threads)
    decision, solving = timed(decide_twill, conditions)
    deciding = listing + solving
    found = "a twill" if decision.twillable else "NO TWILL"
    print(
        f"{halfedges.n_edges} edges decided in {deciding:.2f} s: {found}, {decision.free_bits} "
        f"free bits; tracing the threads takes {tracing:.2f} s, ratio {deciding / tracing:.1f}\n"
    )


def main() -> None:
    """Print the decision, and one row for each mesh and effort."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", nargs="+", default=["normal"])
    parser.add_argument("--largest", type=int, default=1_000_000, help="leave out larger meshes")
    options = parser.parse_args()
    decide()
    print(f"{'mesh':29} {'edges':>7} {'conditions':>10} {'plain':>6} {'voting':>6} "
          f"{'annealed':>8} {'ours':>6} {'bound':>6} {'ratio':>6} {'/voting':>7} {'vote s':>7} "
          f"{'bound s':>7} {'search s':>8}  effort")  # fmt: skip
    for name, mesh, known in cases():
        halfedges = build_halfedges(mesh)
        if halfedges.n_edges > options.largest:
            continue
        threads = trace_threads(halfedges)
        conditions = twill_conditions(halfedges, threads)
        if decide_twill(conditions).twillable:
            raise SystemExit(f"{name} has an exact twill, and should have none")
        bunches = part_bunches(threads)
        vote, voting = timed(best_vote, conditions, threads, bunches)
        couplings = couple(conditions)
        seeds = irregular_seeds(halfedges, threads)
        for effort in options.effort:
            bound, bounding = timed(prove_bound, couplings, seeds, wider_work=WIDER_WORK[effort])
            twist, searching = timed(
                optimise_twill, couplings, vote.twist, effort=effort, least=bound.least
            )
            ours = count_broken(conditions, twist).total
            if not bound.least <= ours <= vote.broken.total:
                raise SystemExit(f"{name}: {ours} broken is out of bounds")
            plain, annealed = known or ("-", "-")
            ratio = f"{ours / known[1]:.3f}" if known else "-"
            print(
                f"{name:29} {halfedges.n_edges:>7} {conditions.count:>10} {plain:>6} "
                f"{vote.broken.total:>6} {annealed:>8} {ours:>6} {bound.least:>6} {ratio:>6} "
                f"{ours / vote.broken.total:>7.2f} {voting:>7.2f} {bounding:>7.2f} "
                f"{searching:>8.2f}  {effort}",
                flush=True,
            )


if __name__ == "__main__":
    main()
