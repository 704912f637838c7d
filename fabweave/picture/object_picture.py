"""Make pictures of meshes, of what a model lost on the way to one, and of woven objects."""

import io
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.colour_space import Colours, bytes_of, light_of
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.likeness import Likeness, LossMap
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import SHAPES, Shape
from fabweave.picture.bodies import Body, joined_bodies
from fabweave.picture.camera import MARGIN, View, choose_view
from fabweave.picture.contact_sheet import contact_sheet, side_by_side, stacked, titled
from fabweave.picture.render import (
    Dots,
    middle_edge_px,
    object_frame,
    render_scene,
    smooth_normals,
)
from fabweave.picture.surfaces import (
    face_normals,
    polygon_triangles,
    ribbon_triangles,
    rung_colours,
)
from fabweave.picture.zbuffer import nearest_triangles
from fabweave.ribbon.project import Ribbons

#: Colours of distances, from none on in equal steps, and dark at the end: each is darker than the
#: one before, so that the order shows without colours, too.
_RAMP: Colours = np.array(
    [(215, 221, 228), (240, 208, 84), (234, 150, 0), (197, 72, 0), (99, 24, 0)], dtype=np.uint8
)
_RAMP.setflags(write=False)
#: The last colour begins at this share of the size: equal colours are equal shares, whatever is
#: shown beside.
_MOST = 0.05
_INK = (38, 43, 51)
#: Room for a line of the legend, and for a letter at the most, in heights of its letters.
_LEADING, _LETTER = 1.6, 0.6


def loss_colours(loss: LossMap) -> Colours:
    """Return the colour of each triangle, (T, 3): from grey, where nothing is lost, to dark red.

    Examples
    --------
    >>> points, row = np.eye(3), np.array([[0, 1, 2]])
    >>> [loss_colours(LossMap(points, row, np.array([lost]), 400.0))[0].tolist()
    ...  for lost in (0.0, 20.0, 90.0)]
    [[215, 221, 228], [99, 24, 0], [99, 24, 0]]
    """
    return _ramp(loss.lost_mm / (_MOST * loss.size_mm))


def _ramp(share: FloatArray) -> Colours:
    """Return colours of numbers from 0 to 1."""
    light, at = light_of(_RAMP), np.linspace(0.0, 1.0, len(_RAMP))
    return bytes_of(np.stack([np.interp(share, at, part) for part in light.T], axis=-1))


def loss_tiles(loss: LossMap, front: View, size_px: tuple[int, int]) -> Image.Image:
    """Make a picture of a model from the front and from behind, coloured by what is lost.

    Parameters
    ----------
    loss : LossMap
    front : View
    size_px : (int, int)
        Width and height of each half.
    """
    colours = loss_colours(loss)
    views = ((front, "from the front"), (opposite_view(front), "from behind"))
    scene = partial(render_scene, loss.points, loss.triangles, colours, size_px=size_px)
    return side_by_side(*(titled(scene(view=view), text) for view, text in views))


def loss_legend(loss: LossMap, wide: int, text: str = "") -> Image.Image:
    """Draw what the colours mean: a bar with lengths in millimetres, and some text below.

    Parameters
    ----------
    loss : LossMap
    wide : int
        Pixels.
    text : str
        Such as the names of what is lost; broken to lines that fit.
    """
    points = max(wide // 64, 10)
    font = ImageFont.load_default(size=points)
    step = round(_LEADING * points)
    lines = textwrap.wrap(text, int(wide / (_LETTER * points)))
    bar = min(wide // 2, 20 * points)
    left, top = (wide - bar) // 2, points // 2
    picture = Image.new("RGB", (wide, top + step * (3 + len(lines))), (255, 255, 255))
    shares = (np.arange(bar) + 0.5) / bar
    strip = np.broadcast_to(_ramp(shares), (points, bar, 3))
    picture.paste(Image.fromarray(np.ascontiguousarray(strip)), (left, top + step))
    draw = ImageDraw.Draw(picture)
    title = "how far the model is from the remeshed surface, mm"
    draw.text((wide / 2, top + step / 2), title, fill=_INK, font=font, anchor="mm")
    most = _MOST * loss.size_mm
    y = top + 2.5 * step - 0.2 * points
    for share in (0.0, 0.5, 1.0):
        length = f"{share * most:.3g}" + " or more" * (share == 1.0)
        draw.text((left + share * bar, y), length, fill=_INK, font=font, anchor="mm")
    for number, line in enumerate(lines):
        y = top + (3.5 + number) * step
        draw.text((wide / 2, y), line, fill=_INK, font=font, anchor="mm")
    return picture


def loss_picture(loss: LossMap, text: str = "") -> Image.Image:
    """Make the picture of what a remeshed model lost: from the front, from behind, and a legend.

    Parameters
    ----------
    loss : LossMap
    text : str
        What is said below, such as the names of lost features.

    Returns
    -------
    Image
        RGB; the same for the same input.
    """
    tiles = loss_tiles(loss, choose_view(loss.points, loss.triangles), SIDE_PX)
    return stacked(tiles, loss_legend(loss, tiles.width, text))


def likeness_png(loss: LossMap, like: Likeness) -> bytes:
    """Return the picture of ``loss_picture`` as a PNG file."""
    return png_bytes(loss_picture(loss, like.lost_text))


_STONE = (205, 214, 224)
#: The picture of a shape on the sheet of all.
_TILE_PX = (380, 300)
#: Vertices with fewer and with more edges than regular ones, and with a multiple of four.
_FEWER, _MORE, _FOURFOLD = (0, 114, 178), (213, 94, 0), (0, 158, 115)


def mesh_picture(
    mesh: PolyMesh,
    *,
    size_px: tuple[int, int] = (1000, 800),
    view: View | None = None,
    marks: Dots | None = None,
    samples: int = 2,
) -> Image.Image:
    """Make a picture of a polygon mesh with its edges.

    Parameters
    ----------
    mesh : PolyMesh
        Faces of any size.
    size_px : (int, int)
        Width and height.
    view : View or None
        From where; None chooses.
    marks : Dots or None
        Marked points, such as ``irregular_marks``.
    samples : int
        Samples of a pixel along each side.

    Returns
    -------
    Image
        RGB.

    Raises
    ------
    InputError
        If the mesh has no face, or the picture would be empty or too large.
    """
    vertices, triangles, sides, face = polygon_triangles(mesh)
    if view is None:
        view = choose_view(vertices, triangles)
    normals = np.repeat(face_normals(mesh)[face][:, None, :], 3, axis=1)
    return render_scene(
        vertices,
        triangles,
        _STONE,
        size_px=size_px,
        view=view,
        normals=normals,
        edges=sides,
        line_px=float(
            np.clip(0.09 * middle_edge_px(vertices, triangles, sides, view, size_px), 0.3, 1.3)
        ),
        marks=marks,
        samples=samples,
    )


def irregular_marks(mesh: PolyMesh, *, radius_px: float = 5.0) -> Dots:
    """Return marks on the inner vertices whose number of edges is not the regular one.

    Regular are 6 edges where most faces are triangles, else 4. Vertices with fewer are blue,
    with more vermilion; where 4 is regular, vertices with 8, 12 … are green, as a twill can go
    around them.

    Returns
    -------
    Dots
        None at all on a regular mesh.

    Examples
    --------
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> len(irregular_marks(parse_shape("shape:sphere?n=3")).points)
    8
    """
    triangles = 2 * np.count_nonzero(mesh.face_sizes == 3) > mesh.n_faces
    regular = 6 if triangles else 4
    vertices, valences = interior_valences(build_halfedges(mesh))
    irregular = valences != regular
    odd, valence = vertices[irregular], valences[irregular]
    colours = np.where((valence < regular)[:, None], _FEWER, _MORE)
    if not triangles:
        colours = np.where((valence % 4 == 0)[:, None], _FOURFOLD, colours)
    return Dots(mesh.vertices[odd], colours.astype(np.uint8), radius_px)


def weave_picture(
    ribbons: Ribbons,
    colours: Colours,
    *,
    size_px: tuple[int, int] = (1000, 800),
    view: View | None = None,
    floor: bool = True,
    samples: int = 2,
) -> Image.Image:
    """Make a picture of a woven object, its strands in their colours.

    Parameters
    ----------
    ribbons : Ribbons
        The ribbons in space.
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of all passes, see ``strand_colours``, or of the threads.
    size_px : (int, int)
        Width and height.
    view : View or None
        From where; None chooses.
    floor : bool
        Whether the object stands on a floor, seen by the shadow on it.
    samples : int
        Samples of a pixel along each side.

    Returns
    -------
    Image
        RGB.

    Raises
    ------
    InputError
        If there is no ribbon, the colours are not as many as passes or threads, or the picture
        would be empty or too large.
    """
    painted = rung_colours(ribbons, colours)
    vertices, triangles, _ = ribbon_triangles(ribbons)
    if len(triangles) == 0:
        raise InputError("there is no ribbon to show: nothing crosses anything on this mesh")
    if view is None:
        view = choose_view(vertices, triangles)
    # Even numbers are on the right rail, odd ones on the left: sides between alikes lie on rails.
    rails = triangles % 2 == np.roll(triangles, -1, axis=1) % 2
    frame = object_frame(vertices, triangles, view, size_px)
    width = np.linalg.norm(ribbons.left - ribbons.right, axis=1)
    width_px = float(np.median(width)) * frame.pixels_per_mm
    return render_scene(
        vertices,
        triangles,
        np.repeat(painted[triangles[::2, 0] // 2], 2, axis=0),
        size_px=size_px,
        view=view,
        normals=smooth_normals(vertices, triangles),
        edges=rails,
        line_px=float(np.clip(0.06 * width_px, 0.3, 1.3)),
        reach_px=float(np.clip(0.5 * width_px, 2.0, 0.02 * min(size_px))),
        floor=floor,
        samples=samples,
    )


def png_bytes(picture: Image.Image) -> bytes:
    """Return a picture as the content of a PNG file."""
    content = io.BytesIO()
    picture.save(content, format="PNG")
    return content.getvalue()


def render_shapes(shapes: Sequence[Shape] = SHAPES) -> Image.Image:
    """Make a contact sheet of built-in shapes with their names, sizes and descriptions.

    Each is made with its default parameters.
    """
    tiles, captions = [], []
    for shape in shapes:
        mesh = shape.make()
        marks = irregular_marks(mesh, radius_px=3.0)
        # Where every other vertex is irregular, marks say nothing.
        few = 4 * len(marks.points) <= mesh.n_vertices
        tiles.append(mesh_picture(mesh, size_px=_TILE_PX, marks=marks if few else None))
        captions.append(f"{shape.name}: {shape.text}\n{shape.example}")
    return contact_sheet(tiles, captions, columns=4)


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
    colours = np.concatenate([body.triangle_colours for body in bodies])
    normals = [
        smooth_normals(body.vertices, body.all_triangles)
        if body.normals is None
        else body.normals[body.all_triangles]
        for body in bodies
    ]
    return render_scene(
        *joined_bodies(bodies),
        colours,
        size_px=size_px,
        view=view,
        normals=np.concatenate(normals),
        floor=True,
        samples=samples,
    )


#: Pictures by which outlines are compared; outlines that differ by less of their area are the same.
_OUTLINE_PX, _OTHER_SHARE = (90, 90), 0.06
#: From so high what is inside a ring or a vase is seen.
_ABOVE_DEG = 75.0
#: Both views are of one scale, and no larger than this; nor smaller than this share of it.
SIDE_PX, _LEAST_SIDE = (720, 720), 0.5


def opposite_view(view: View) -> View:
    """Return the view that shows what another one hides: from behind, as high.

    Examples
    --------
    >>> opposite_view(View(-60.0, 30.0))
    View(azimuth_deg=120.0, elevation_deg=30.0, width_mm=None)
    """
    return replace(view, azimuth_deg=view.azimuth_deg % 360.0 - 180.0)


def second_view(vertices: FloatArray, triangles: IntArray, first: View) -> tuple[View, str]:
    """Return another view that shows something else, and from where it is.

    From behind, unless there the object has the outline that it has from the first: of a ring or a
    vase that would be the same picture again, and what is inside shows from above.
    """
    behind = opposite_view(first)
    covered = [
        nearest_triangles(
            object_frame(vertices, triangles, view, _OUTLINE_PX).pixels(vertices),
            triangles,
            width=_OUTLINE_PX[0],
            height=_OUTLINE_PX[1],
        )[0]
        >= 0
        for view in (first, behind)
    ]
    if np.mean(covered[0] != covered[1]) > _OTHER_SHARE * np.mean(covered[0]):
        return behind, "from behind"
    return replace(first, elevation_deg=_ABOVE_DEG), "from above"


def object_portrait(ribbons: Ribbons, colours: Colours, state: str = "") -> Image.Image:
    """Make a picture of a woven object from the front and from another side; both say so.

    Parameters
    ----------
    ribbons : Ribbons
    colours : (P, 2, 3) or (T, 3) uint8 array
        The colours of all passes, or of the threads.
    state : str
        Which of its shapes is shown, such as ``let go``; empty if there is only one.
    """
    vertices, triangles, _ = ribbon_triangles(ribbons)
    if len(triangles) == 0:
        raise InputError("there is no ribbon to show: nothing crosses anything on this mesh")
    front = choose_view(vertices, triangles)
    views = ((front, "from the front"), second_view(vertices, triangles, front))
    # In pixels of one scale; each view is as wide as it needs, and both as high as the higher.
    scale = min(object_frame(vertices, triangles, view, SIDE_PX).pixels_per_mm for view, _ in views)
    seen = vertices[np.unique(triangles)]
    extents = [np.ptp(seen @ view.axes()[:2].T, axis=0) for view, _ in views]
    sides = [scale * extent / (1.0 - 2.0 * MARGIN) for extent in extents]
    least = _LEAST_SIDE * np.array(SIDE_PX)
    high = round(max(least[1], *(side[1] for side in sides)))
    tiles = []
    for (view, where), side in zip(views, sides, strict=True):
        wide = round(max(least[0], side[0]))
        picture = weave_picture(
            ribbons, colours, size_px=(wide, high), view=replace(view, width_mm=wide / scale)
        )
        tiles.append(titled(picture, f"{where}, {state}" if state else where))
    return side_by_side(*tiles)


def portrait_png(ribbons: Ribbons, colours: Colours, state: str = "") -> bytes:
    """Return the picture of ``object_portrait`` as a PNG file."""
    return png_bytes(object_portrait(ribbons, colours, state))
