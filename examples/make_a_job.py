"""Make a job from Python: a woven octahedron, its cut files, and the proof of them.

Run it with: python examples/make_a_job.py DIR
"""

import sys
from pathlib import Path

from fabweave.app.pipeline import run_job
from fabweave.app.settings import Settings

settings = Settings(mesh="shape:octahedron", size_mm=180.0, material="birch-veneer")
job, proof, _ = run_job(settings, Path(sys.argv[1]))
print(f"{len(job.piece_set.pieces)} pieces on {len(job.layout.sheets)} sheet")
print(f"proved by {len(proof.checks)} checks")
