"""Make the picture of a finished job: the woven object from two sides."""

from dataclasses import replace

from PIL import Image

from fabweave.core.colour_space import Colours
from fabweave.core.errors import InputError
from fabweave.picture.camera import View, choose_view
from fabweave.picture.contact_sheet import side_by_side
from fabweave.picture.object_picture import png_bytes, weave_picture
from fabweave.picture.render import object_frame
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons

#: Both views are equally large, and of one scale.
SIDE_PX = (720, 720)


def opposite_view(view: View) -> View:
    """Return the view that shows what another one hides: from behind, as high.

    Examples
    --------
    >>> opposite_view(View(-60.0, 30.0))
    View(azimuth_deg=120.0, elevation_deg=30.0, width_mm=None)
    """
    return replace(view, azimuth_deg=view.azimuth_deg % 360.0 - 180.0)


def object_portrait(ribbons: Ribbons, colours: Colours, *, samples: int = 2) -> Image.Image:
    """Make a picture of a woven object from the front, and beside it from behind.

    Parameters
    ----------
    ribbons : Ribbons
        The ribbons in space.
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of all passes, or of the threads.
    samples : int
        Samples of a pixel along each side.

    Returns
    -------
    Image
        RGB; the same for the same input.

    Raises
    ------
    InputError
        If there is no ribbon, or the colours are not as many as passes or threads.
    """
    vertices, triangles, _ = ribbon_triangles(ribbons)
    if len(triangles) == 0:
        raise InputError("there is no ribbon to show: nothing crosses anything on this mesh")
    front = choose_view(vertices, triangles)
    views = (front, opposite_view(front))
    scale = min(
        object_frame(vertices, triangles, view, SIDE_PX, floor=True).pixels_per_mm for view in views
    )
    width_mm = SIDE_PX[0] / scale
    return side_by_side(
        *(
            weave_picture(
                ribbons,
                colours,
                size_px=SIDE_PX,
                view=replace(view, width_mm=width_mm),
                samples=samples,
            )
            for view in views
        )
    )


def portrait_png(ribbons: Ribbons, colours: Colours) -> bytes:
    """Return the picture of ``object_portrait`` as a PNG file."""
    return png_bytes(object_portrait(ribbons, colours))
