"""Export ribbons as a coloured 3-D model."""

from collections.abc import Sequence

import numpy as np
import trimesh

from fabweave.core.arrays import IntArray
from fabweave.core.colour_space import Colours
from fabweave.model.gltf import METRES, glb_bytes, paint_of, painted
from fabweave.model.rung_colours import rung_colours
from fabweave.ribbon.facets import facet_vertices
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.finding import Finding

#: The balls at findings: radius relative to the object, and a magenta that no thread has.
_MARKER, _MARKER_COLOUR = 0.012, [0.7, 0.0, 0.35]


def ribbon_faces(ribbons: Ribbons, thread: int) -> IntArray:
    """Return the triangles of one ribbon, two for each quad, in order along the strip.

    Vertex ``2 r`` is the right and ``2 r + 1`` the left end of the thread's rung ``r``.
    """
    start, end = ribbons.offsets[thread : thread + 2].tolist()
    steps = np.arange(start, end if ribbons.closed[thread] else end - 1)
    return facet_vertices(ribbons, steps) - 2 * start


def woven_glb(
    ribbons: Ribbons, labels: Sequence[str], colours: Colours, findings: Sequence[Finding] = ()
) -> bytes:
    """Return the woven object as binary glTF: one node for each thread, named by its label.

    Each mesh's ``extras`` say whether the thread is closed and, for every crossing along it, at
    which rung its panel begins (``entry``) and ends (``exit``). Colours are those of
    passes or of threads, as ``rung_colours`` takes them. A ball in a colour of its own stands at
    the place of every finding; its node is named ``finding-1-bend`` and so on, and its ``extras``
    hold the ``finding``'s number.
    """
    shown = rung_colours(ribbons, colours)
    scene = trimesh.Scene()
    for thread, label in enumerate(labels):
        start, end = ribbons.offsets[thread : thread + 2]
        if start == end:
            continue
        rails = np.stack((ribbons.right[start:end], ribbons.left[start:end]), axis=1)
        passes = slice(ribbons.pass_offsets[thread], ribbons.pass_offsets[thread + 1])
        entry = ribbons.entry[passes] - start
        mesh = trimesh.Trimesh(
            rails.reshape(-1, 3) * METRES,
            ribbon_faces(ribbons, thread),
            process=False,
            metadata={
                "closed": bool(ribbons.closed[thread]),
                "entry": entry.tolist(),
                "exit": (entry + 1).tolist(),
            },
        )
        mesh.visual = paint_of(np.repeat(shown[start:end], 2, axis=0))
        scene.add_geometry(mesh, node_name=label, geom_name=label)
    for number, ball in enumerate(_markers(ribbons, findings), start=1):
        name = f"finding-{number}-{findings[number - 1].rule}"
        scene.add_geometry(ball, node_name=name, geom_name=name)
    return glb_bytes(scene)


def _markers(ribbons: Ribbons, findings: Sequence[Finding]) -> list[trimesh.Trimesh]:
    """Return a ball at the place of each finding."""
    corners = np.concatenate((ribbons.left, ribbons.right))
    size = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.0
    balls = []
    for number, found in enumerate(findings, start=1):
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_MARKER * size * METRES)
        ball.apply_translation(np.array(found.position) * METRES)
        ball.metadata = {"finding": number, "rule": found.rule}
        ball.visual = painted(_MARKER_COLOUR)
        balls.append(ball)
    return balls
