"""Make pictures of the bodies of a model."""

from collections.abc import Sequence

import numpy as np
from PIL import Image

from fabweave.core.errors import InputError
from fabweave.model.bodies import Body
from fabweave.picture.camera import View
from fabweave.picture.render import render_scene
from fabweave.picture.shading import smooth_normals


def bodies_picture(
    bodies: Sequence[Body],
    view: View | None = None,
    *,
    size_px: tuple[int, int] = (1000, 800),
    samples: int = 2,
) -> Image.Image:
    """Make a picture of bodies, in their colours, on a floor.

    Parameters
    ----------
    bodies : sequence of Body
        Those with normals look round; others are smoothed by area.
    view : View or None
        From where; None chooses.
    size_px : (int, int)
        Width and height.
    samples : int
        Samples of a pixel along each side.

    Returns
    -------
    Image
        RGB.

    Raises
    ------
    InputError
        If there are no bodies.
    """
    if not bodies:
        raise InputError("there is no body to show: nothing crosses anything on this mesh")
    vertices = np.concatenate([body.vertices for body in bodies])
    base = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    cut = [body.all_triangles for body in bodies]
    triangles = np.concatenate(
        [part + first for part, first in zip(cut, base[:-1].tolist(), strict=True)]
    )
    colours = np.concatenate([body.triangle_colours for body in bodies])
    normals = [
        smooth_normals(body.vertices, part) if body.normals is None else body.normals[part]
        for body, part in zip(bodies, cut, strict=True)
    ]
    return render_scene(
        vertices,
        triangles,
        colours,
        size_px=size_px,
        view=view,
        normals=np.concatenate(normals),
        floor=True,
        samples=samples,
    )
