"""Write how a former is put together, used and taken out, with pictures: before the first step."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.former.plates import Laid
from fabweave.former.way_out import Leaving
from fabweave.picture.camera import View, choose_view
from fabweave.picture.render import object_frame, render_scene
from fabweave.show.manual.book import Book
from fabweave.show.manual.painting import POINTS_PX, Painted, Scene, packed
from fabweave.show.manual.step_pictures import PictureLabel, seen_mark
from fabweave.show.manual.tags import place_tags

SECTION = "Former"
#: The size of a picture in pixels, and in points.
_PX = (1194, 782)
_SIZE = (_PX[0] * POINTS_PX, _PX[1] * POINTS_PX)
_TEXT = 11.0
#: Board, for slices and for spines.
_SLICE, _SPINE = (214, 188, 148), (176, 140, 96)
#: From where a gap is looked into: not from below the table.
_STEEPEST_DEG, _LOWEST_DEG = 75.0, 35.0


@frozen_value
class FormerPages:
    """What the manual says and shows of a former: as many pictures as texts, and its leaving.

    ``marks`` are the names of the plates that the first picture shows.
    """

    texts: tuple[str, ...]
    pictures: tuple[Painted, ...]
    marks: tuple[PictureLabel, ...]
    leaving: Leaving


def former_pages(laid: Laid, scene: Scene, texts: Sequence[str]) -> FormerPages:
    """Make the pictures of a former: alone, with half of the strips, and where it comes out.

    Parameters
    ----------
    laid : Laid
    scene : Scene
        All pieces in space, and the former.
    texts : sequence of str
        Of each picture.
    """
    way, points = laid.way, scene.plate_corners.reshape(-1, 3)
    board = np.array([_SPINE if plate.spine else _SLICE for plate in laid.former.plates])
    triangles = np.arange(len(points)).reshape(-1, 3)
    above = choose_view(scene.points, scene.triangles)
    view = View(above.azimuth_deg, max(above.elevation_deg, 25.0))
    count = len(scene.step_of_piece)
    order = np.argsort(scene.step_of_piece, kind="stable")
    shown = [
        (view, order[:0]),
        (view, order[: count // 2]),
        (
            view if way is None else _into(-way.inward),
            order if way is None else order[: way.before],
        ),
    ]
    pictures = []
    for seen, pieces in shown:
        strips = np.isin(scene.piece, pieces)
        own = scene.palette.tones[scene.palette.own[scene.piece[strips]], 3]
        picture = render_scene(
            np.concatenate((points, scene.points)),
            np.concatenate((triangles, scene.triangles[strips] + len(points))),
            np.concatenate((board[scene.plate], own)).astype(np.uint8),
            size_px=_PX,
            view=seen,
            floor=True,
        )
        pictures.append(packed(np.asarray(picture)))
    frame = object_frame(points, triangles, view, _PX)
    plate, _ = scene.former_seen(frame, -1)
    ids = [one.id for one in laid.former.plates]
    marks = [
        seen_mark(text, np.flatnonzero(plate == number), frame) for number, text in enumerate(ids)
    ]
    return FormerPages(tuple(texts), tuple(pictures), tuple(filter(None, marks)), scene.leaving)


def _into(outward: FloatArray) -> View:
    """Return the view that looks into a gap, from a little above the table at least."""
    rise = float(np.degrees(np.arcsin(np.clip(outward[2], -1.0, 1.0))))
    turn = float(np.degrees(np.arctan2(outward[1], outward[0])))
    return View(turn, float(np.clip(rise, _LOWEST_DEG, _STEEPEST_DEG)))


def write_former(book: Book, pages: FormerPages) -> None:
    """Write the former's own steps, each with its picture."""
    book.page(SECTION)
    wide, high = _SIZE
    for number, (text, picture) in enumerate(zip(pages.texts, pages.pictures, strict=True), 1):
        book.room(high + 60.0, SECTION)
        y = book.y - 20.0
        book.text(book.left, y, f"Step 0.{number}", size=14.0, bold=True)
        y = book.block(book.left, y - 4.0, text, book.right - book.left, size=_TEXT) - 6.0
        book.image(picture, book.left, y - high, wide, high)
        if number == 1:
            corner = np.array([book.left, y - high])
            for tag in place_tags(pages.marks, _SIZE, np.empty((0, 2)), 0.0, np.empty((0, 2))):
                book.line(tag.line + corner, width=0.8)
                x, y = (tag.middle + corner).tolist()
                book.tag(x, y, tag.mark.text, dark=False)
        book.y = y - high - 8.0
