"""Tell what a mesh is, and its threads, bunches and fabrics."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, Progress
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.irregular import find_irregular, interior_valences
from fabweave.mesh.mirror import find_mirror
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.coarse import paired_quads
from fabweave.mesh.remesh.unrefine import cages
from fabweave.weave.bunches import find_bunches, thread_graph
from fabweave.weave.fabric.fabrics import weave_fabric
from fabweave.weave.fabric.repeat import parse_fabric
from fabweave.weave.threads import Threads

#: Fabrics that are tried.
_FABRICS = ("2/1", "3/1", "2/2", "3/3", "satin:5/2", "satin:8/3")


def mesh_facts(mesh: PolyMesh, halfedges: Halfedges) -> dict[str, Any]:
    """Return sizes, topology and regularity."""
    report = check_mesh(mesh)
    first = halfedges.edge_halfedge
    ends = mesh.vertices[halfedges.tail[first]], mesh.vertices[halfedges.head[first]]
    _, valences = interior_valences(halfedges)
    irregular = find_irregular(mesh)
    mirror = find_mirror(mesh)
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
        "edge_mm": spread(np.linalg.norm(ends[1] - ends[0], axis=1)),
        "mirror": {
            "symmetric": mirror.symmetric,
            "normal": [round(float(x), 4) for x in mirror.normal],
            "off_percent": round(mirror.rms_percent, 3),
        },
        "cages": [cage.n_faces for cage in cages(paired_quads(mesh))],
        "irregular_vertices": len(irregular),
        "breaking_twill": int(np.count_nonzero(irregular.breaks_twill)),
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


def bunch_facts(threads: Threads) -> dict[str, Any]:
    """Return how many bunches there are."""
    bunches = find_bunches(threads)
    return {
        "count": bunches.n_bunches,
        "fewest": bunches.fewest,
        "warp_and_weft": bunches.warp_and_weft,
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
