"""Time the way from triangles to quads, and count irregular vertices and threads; run by hand.

The torus was cut by alternating diagonals and must come back whole. The real meshes lie beside
the repository and are left out where they are not; remeshers that are not installed say so.
"""

import time
from pathlib import Path

import numpy as np

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate
from fabweave.weave.threads import trace_threads

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "meshes"
CASES = (
    ("tri/double-torus.obj", None),
    ("tri/double-torus.obj", 1500),
    ("tri/polyhedraexplorer_genus49.stl", None),
    ("open/hemisphere.obj", 500),
    ("ngon/hexaSphere.off", 1000),
)


def pair_torus() -> None:
    """Print how long 400k triangles take to pair."""
    mesh = triangulate(parse_shape("shape:torus?m=632&n=316"))
    triangles = mesh.indices.reshape(-1, 3)
    order = np.random.default_rng(0).permutation(len(triangles))
    mesh = PolyMesh.from_faces(mesh.vertices, triangles[order])
    start = time.perf_counter()
    pairing = pair_triangles(mesh)
    quads = merge_pairs(mesh, pairing)
    print(f"{mesh.n_faces} triangles to {quads.n_faces} quads: {time.perf_counter() - start:.2f} s")


def main() -> None:
    """Print one row for each mesh."""
    pair_torus()
    print(f"{'mesh':36} {'aim':>5} {'quads':>6} {'irregular':>9} {'threads':>7} {'longest':>7} "
          f"{'s':>6}  method")  # fmt: skip
    for name, aim in CASES:
        if not (FOLDER / name).is_file():
            continue
        mesh = resize_mesh(read_mesh(FOLDER / name).mesh, size_mm=300.0)[0]
        start = time.perf_counter()
        try:
            made = remesh_quads(mesh, aim)
        except CannotMakeError as error:
            print(f"{name:36} {aim or '-':>5} {error}")
            continue
        spent = time.perf_counter() - start
        threads = trace_threads(build_halfedges(made.mesh))
        print(
            f"{name:36} {aim or '-':>5} {made.mesh.n_faces:>6} {len(made.irregular):>9} "
            f"{threads.n_threads:>7} {threads.lengths.max():>7} {spent:>6.1f}  {made.method}"
        )


if __name__ == "__main__":
    main()
