"""What all our glTF files have in common: metres, linear light, dull paint."""

from typing import Any

import numpy as np
import trimesh

from fabweave.core.colour_space import Colours, light_of

#: glTF counts in metres.
METRES = 0.001


def linear(colour: Colours) -> list[float]:
    """Return the light of a colour in sRGB, as glTF takes it."""
    return np.round(light_of(colour), 4).tolist()


def paint_of(colours: Colours) -> trimesh.visual.TextureVisuals:
    """Return the paint of a body whose vertices have these colours in sRGB, (V, 3).

    A body of one colour has a material of that colour; else the material is white, and vertices
    have colours, in linear light as glTF wants it.
    """
    if not np.any(colours != colours[:1]):
        return painted(linear(colours[0]))
    visual = painted([1.0, 1.0, 1.0])
    light = np.round(255.0 * light_of(colours)).astype(np.uint8)
    whole = np.full((len(light), 1), 255, dtype=np.uint8)
    visual.vertex_attributes["color"] = np.concatenate((light, whole), axis=1)
    return visual


def painted(light: list[float]) -> trimesh.visual.TextureVisuals:
    """Return a dull, opaque material that is seen from both sides."""
    return trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            baseColorFactor=[*light, 1.0],
            metallicFactor=0.0,
            roughnessFactor=0.8,
            doubleSided=True,
        )
    )


def glb_bytes(scene: trimesh.Scene, **options: Any) -> bytes:
    """Return a scene as binary glTF."""
    exported = scene.export(file_type="glb", tree_postprocessor=_state_up, **options)
    if not isinstance(exported, bytes):
        raise TypeError("the glTF exporter returned no bytes")
    return exported


def _state_up(tree: dict[str, Any]) -> None:
    """State in a tree of glTF that z points up: its standard says y, and woven objects have z."""
    tree["asset"]["extras"] = {"up": "z"}
