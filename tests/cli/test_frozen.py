"""A frozen program is no Python: it starts itself where it needs a child."""

import sys
from dataclasses import replace

import numpy as np

from fabweave.mesh.remesh import child
from fabweave.mesh.remesh.engines import QSLIM, Run, run_engine
from fabweave.mesh.shapes.solids import icosahedron
from fabweave.mesh.subdivide import loop

FROZEN = "import sys; sys.frozen = True; from fabweave.cli.main import main; main()"


def test_a_frozen_program_remeshes_in_a_child_of_its_own():
    surface, run = loop(icosahedron()), Run(40, 0, rim=False)
    frozen = replace(QSLIM, command=(sys.executable, "-c", FROZEN, child.FLAG))
    made, usual = (run_engine(engine, surface, run) for engine in (frozen, QSLIM))
    assert np.array_equal(made.vertices, usual.vertices)
    assert np.array_equal(made.indices, usual.indices)
    assert made.n_faces < surface.n_faces
