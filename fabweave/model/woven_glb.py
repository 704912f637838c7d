"""Export ribbons as a coloured 3-D model."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import trimesh

from fabweave.core.arrays import IntArray
from fabweave.core.colour_space import Colours, light_of
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.finding import Finding

#: glTF counts in metres.
_METRES = 0.001
#: The balls at findings: radius relative to the object, and a magenta that no thread has.
_MARKER, _MARKER_COLOUR = 0.012, (0.7, 0.0, 0.35)


def ribbon_faces(ribbons: Ribbons, thread: int) -> IntArray:
    """Return the triangles of one ribbon, two for each quad, in order along the strip.

    Vertex ``2 r`` is the right and ``2 r + 1`` the left end of the thread's rung ``r``.
    """
    own = slice(ribbons.offsets[thread], ribbons.offsets[thread + 1])
    count = own.stop - own.start
    steps = np.arange(count if ribbons.closed[thread] else count - 1)
    after = (steps + 1) % count
    a, b, c, d = 2 * steps, 2 * after, 2 * after + 1, 2 * steps + 1
    first = ribbons.from_right[own][steps]
    near = np.where(first[:, None], np.column_stack((a, c, d)), np.column_stack((a, b, d)))
    far = np.where(first[:, None], np.column_stack((a, b, c)), np.column_stack((b, c, d)))
    return np.stack((near, far), axis=1).reshape(-1, 3)


def woven_glb(
    ribbons: Ribbons, labels: Sequence[str], colours: Colours, findings: Sequence[Finding] = ()
) -> bytes:
    """Return the woven object as binary glTF: one node for each thread, named by its label.

    Each mesh's ``extras`` say whether the thread is closed and, for every crossing along it, at
    which rung its panel begins (``entry``) and ends (``exit``). Each thread has its colour,
    (T, 3) bytes of sRGB. A ball in a colour of its own stands at the place of every finding; its
    node is named ``finding-1-bend`` and so on, and its ``extras`` hold the ``finding``'s number.
    """
    scene = trimesh.Scene()
    # glTF takes linear light, and colours are named in sRGB.
    light = np.round(light_of(colours), 4)
    for thread, label in enumerate(labels):
        start, end = ribbons.offsets[thread : thread + 2]
        if start == end:
            continue
        rails = np.stack((ribbons.right[start:end], ribbons.left[start:end]), axis=1)
        passes = slice(ribbons.pass_offsets[thread], ribbons.pass_offsets[thread + 1])
        entry = ribbons.entry[passes] - start
        mesh = trimesh.Trimesh(
            rails.reshape(-1, 3) * _METRES,
            ribbon_faces(ribbons, thread),
            process=False,
            metadata={
                "closed": bool(ribbons.closed[thread]),
                "entry": entry.tolist(),
                "exit": (entry + 1).tolist(),
            },
        )
        colour = [*light[thread].tolist(), 1.0]
        mesh.visual = _paint(colour)
        scene.add_geometry(mesh, node_name=label, geom_name=label)
    for number, ball in enumerate(_markers(ribbons, findings), start=1):
        name = f"finding-{number}-{findings[number - 1].rule}"
        scene.add_geometry(ball, node_name=name, geom_name=name)
    exported = scene.export(file_type="glb", tree_postprocessor=state_up)
    if not isinstance(exported, bytes):
        raise TypeError("the glTF exporter returned no bytes")
    return exported


def state_up(tree: dict[str, Any]) -> None:
    """State in a tree of glTF that z points up: its standard says y, and woven objects have z."""
    tree["asset"]["extras"] = {"up": "z"}


def _paint(colour: list[float]) -> trimesh.visual.TextureVisuals:
    """Return a dull material of a linear colour with opacity, seen from both sides."""
    return trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            baseColorFactor=colour, metallicFactor=0.0, roughnessFactor=0.8, doubleSided=True
        )
    )


def _markers(ribbons: Ribbons, findings: Sequence[Finding]) -> list[trimesh.Trimesh]:
    """Return a ball at the place of each finding."""
    corners = np.concatenate((ribbons.left, ribbons.right))
    size = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.0
    balls = []
    for number, found in enumerate(findings, start=1):
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_MARKER * size * _METRES)
        ball.apply_translation(np.array(found.position) * _METRES)
        ball.metadata = {"finding": number, "rule": found.rule}
        ball.visual = _paint([*_MARKER_COLOUR, 1.0])
        balls.append(ball)
    return balls
