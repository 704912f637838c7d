"""Run one remesher on one mesh, in a process of its own.

Started as a script with the name of the remesher, a file to read and a file to write. It imports
nothing of fabweave: whatever the foreign code does (print, exit, hang, crash), it does to this
process only.
"""

import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np

#: Says to a frozen program, which is no Python, that it is this script.
FLAG = "--remesh-child"


def remesh_with(engine: str, task: dict[str, Any]) -> tuple[Any, Any]:
    """Return vertices and faces that a remesher makes of some triangles.

    Parameters
    ----------
    engine : str
        ``quadriflow``, ``instant-meshes``, ``qslim``, ``skeleton`` or ``extrusion``.
    task : dict
        ``vertices`` (V, 3), ``triangles`` (T, 3), ``count`` (what to ask for), ``seed`` and
        ``rim`` (whether to follow the boundary). Extrusion takes a graph, with edges (E, 2) for
        triangles, and ``radii`` (V,).

    Returns
    -------
    vertices : (V, 3) array
    faces : (F, n) array
        Of a skeleton, its edges, (E, 2).
    """
    count, seed, rim = int(task["count"]), int(task["seed"]), bool(task["rim"])
    if engine == "quadriflow":
        from pyQuadriFlow.pyQuadriFlow import pyquadriflow  # noqa: PLC0415 -- optional

        made = pyquadriflow(
            count,
            seed,
            task["vertices"].tolist(),
            task["triangles"].tolist(),
            False,  # sharp edges: not robust, and they are mostly followed without
            rim,
            False,  # adaptive scale
            False,  # aggressive satisfaction
            False,  # minimum-cost flow
        )
        return np.array(made["vertices"]), np.array(made["faces"])
    if engine in ("skeleton", "extrusion"):
        return by_graph(engine, task)
    if engine == "qslim":
        import igl  # noqa: PLC0415 -- only this remesher needs it

        vertices, faces, _, _ = igl.qslim(
            np.asfortranarray(task["vertices"], dtype=np.float64),
            np.asfortranarray(task["triangles"], dtype=np.int32),
            count,
            True,  # a collapse that would make the surface run through itself is left out
        )
        return vertices, faces
    import pynanoinstantmeshes  # noqa: PLC0415 -- optional

    vertices, faces = pynanoinstantmeshes.remesh(
        np.ascontiguousarray(task["vertices"], dtype=np.float32),
        np.ascontiguousarray(task["triangles"], dtype=np.uint32),
        -1,
        face_count=count,
        align_to_boundaries=rim,
        smooth_iter=2,
        deterministic=True,
    )
    return vertices, faces


def by_graph(engine: str, task: dict[str, Any]) -> tuple[Any, Any]:
    """Return the skeleton of a surface, or tubes of quads around the edges of a graph."""
    from pygel3d import graph, hmesh  # noqa: PLC0415 -- optional

    if engine == "skeleton":
        surface = hmesh.Manifold.from_triangles(task["vertices"], task["triangles"])
        # All vertices, not a sample of them, which would be another one each time.
        bones = graph.LS_skeleton(graph.from_mesh(surface), sampling=False)
        bones.cleanup()
        edges = {tuple(sorted((a, b))) for a in bones.nodes() for b in bones.neighbors(a)}
        return np.array(bones.positions()), np.array(sorted(edges))
    bones = graph.Graph()
    for place in task["vertices"]:
        bones.add_node(place)
    for one, two in task["triangles"]:
        bones.connect_nodes(one, two)
    tubes = hmesh.graph_to_feq(bones, task["radii"])
    tubes.cleanup()
    faces = [list(tubes.circulate_face(face)) for face in tubes.faces()]
    return np.array(tubes.positions()), np.array(faces)


def end_with_parent() -> None:
    """End this process when the other end of standard input closes: nobody is waiting any more."""
    while os.read(0, 1024):
        pass
    os._exit(1)


def remesh_file(engine: str, source: str, target: str) -> int:
    """Read a task, remesh, and write the result or what went wrong."""
    with np.load(Path(source), allow_pickle=False) as stored:
        task = dict(stored)
    try:
        vertices, faces = remesh_with(engine, task)
    except Exception as error:  # whatever it is, the parent is told
        np.savez(target, error=np.array(f"{type(error).__name__}: {error}"[:500]))
        return 1
    np.savez(target, vertices=np.asarray(vertices), faces=np.asarray(faces))
    return 0


def main(engine: str, source: str, target: str) -> int:
    """Remesh as long as somebody waits for it."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    return remesh_file(engine, source, target)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
