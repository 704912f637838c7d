"""Make the picture of a finished job: the woven object from two sides."""

from dataclasses import replace

from PIL import Image

from fabweave.core.colour_space import Colours
from fabweave.picture.camera import View, choose_view
from fabweave.picture.contact_sheet import side_by_side
from fabweave.picture.object_picture import png_bytes, weave_picture
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons

#: The view from the front is the larger one; both stand on one floor, so to speak.
FRONT_PX, BACK_PX = (840, 720), (600, 720)
#: The other view is from behind, past the side, and from higher up.
_TURN_DEG, _HIGH_DEG = 155.0, 52.0


def opposite_view(view: View) -> View:
    """Return a view that shows what another one hides: from behind and from higher up.

    Examples
    --------
    >>> opposite_view(View(-60.0, 30.0))
    View(azimuth_deg=95.0, elevation_deg=52.0, width_mm=None)
    """
    azimuth = view.azimuth_deg + _TURN_DEG
    return replace(view, azimuth_deg=(azimuth + 180.0) % 360.0 - 180.0, elevation_deg=_HIGH_DEG)


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
    front = choose_view(vertices, triangles)
    return side_by_side(
        *(
            weave_picture(ribbons, colours, size_px=size_px, view=view, samples=samples)
            for view, size_px in ((front, FRONT_PX), (opposite_view(front), BACK_PX))
        )
    )


def portrait_png(ribbons: Ribbons, colours: Colours) -> bytes:
    """Return the picture of ``object_portrait`` as a PNG file."""
    return png_bytes(object_portrait(ribbons, colours))
