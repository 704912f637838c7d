"""Make a job from Python: a woven octahedron, its cut files, and the proof of them.

Run it with: python examples/make_a_job.py DIR
"""

import sys

import fabweave as fw

job = fw.make("shape:octahedron", sys.argv[1], size="180mm", material="birch-veneer")
print(f"{len(job.pieces)} pieces on {len(job.layout.sheets)} sheet")
print(f"proved by {len(job.proof.checks)} checks")
