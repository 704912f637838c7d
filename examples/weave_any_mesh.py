"""Make a triangle mesh fit for twill: inspect it, pair its triangles to quads, refine it, weave it.

Run it with: python examples/weave_any_mesh.py DIR
"""

import sys
from pathlib import Path

import numpy as np

import fabweave as fw

directory = Path(sys.argv[1])
directory.mkdir(parents=True, exist_ok=True)

# What a modelling program exports: a ring of 5 × 3 quads, each cut in two triangles.
ring = fw.shape("torus", m=5, n=3)
a, b, c, d = np.array(ring.faces).T
triangles = np.concatenate((np.column_stack((a, b, c)), np.column_stack((a, c, d))))
lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in ring.vertices]
lines += [f"f {i} {j} {k}" for i, j, k in triangles + 1]
(directory / "ring.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")

options = {"size": "300mm", "effort": "quick"}
refined = {"remesh": "quads", "refine": "catmull-clark:1"}
for change in ({"remesh": "none"}, {"remesh": "quads"}, refined):
    facts = fw.inspect(directory / "ring.obj", **options, **change).facts
    faces = ", ".join(
        f"{n} faces of {size} sides" for size, n in facts["mesh"]["face_sizes"].items()
    )
    twill = "exact twill" if facts["twill"]["exact"] else f"no twill: {facts['twill']['because']}"
    print(f"{faces}; {facts['threads']['count']} threads; {twill}")

mesh = fw.read(directory / "ring.obj", **refined, **options)
job = fw.make(mesh, directory / "job", pattern="twill")
print(f"exact: {job.weave.exact}; {len(job.pieces)} pieces, proved: {job.proof.ok}")
