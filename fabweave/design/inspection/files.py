"""Draw what was found out about a mesh."""

import io
from collections.abc import Sequence

from PIL import Image

from fabweave.core.messages import agree
from fabweave.design.inspection.facts import Inspection
from fabweave.design.tried import PICTURE_PX, Tried
from fabweave.job.ask import complete_settings
from fabweave.job.figures import words
from fabweave.options.settings import Settings
from fabweave.picture.contact_sheet import contact_sheet, stacked
from fabweave.picture.object_picture import irregular_marks, mesh_picture, weave_picture
from fabweave.plan.colours import woven_colours
from fabweave.plan.verdict import VERDICTS
from fabweave.weave.pattern import exact_text
from fabweave.weave.strand_colours import strand_colours

#: What designs from coarse to fine are called.
DENSITIES = ("coarse", "medium", "fine")

#: Pixels of a design across: three are as wide as mesh and weave.
_DESIGN_PX = 660


def inspection_picture(inspection: Inspection, settings: Settings | None = None) -> Image.Image:
    """Return the mesh with its irregular vertices marked, beside the woven object.

    Colours are those of the settings, or the usual ones. Below are the designs that were tried,
    from coarse to fine, each with what it comes to.
    """
    asked = _asked_picture(inspection, settings)
    if not inspection.designs:
        return asked
    return stacked(asked, _designs_picture(inspection.designs))


def _designs_picture(designs: Sequence[Tried]) -> Image.Image:
    """Return designs side by side."""
    names = DENSITIES if len(designs) == len(DENSITIES) else [""] * len(designs)
    size_px = _DESIGN_PX, round(_DESIGN_PX * PICTURE_PX[1] / PICTURE_PX[0])
    blank = Image.new("RGB", size_px, (255, 255, 255))
    tiles, captions = [], []
    for name, one in zip(names, designs, strict=True):
        tiles.append(blank if one.picture is None else _as_wide(one.picture, _DESIGN_PX))
        told = "" if one.figures is None else f"{words(one.figures)}\n"
        head = ": ".join(part for part in (name, one.name) if part)
        captions.append(f"{head}\n{told}can it be built? {VERDICTS[one.verdict.level]}")
    return contact_sheet(tiles, captions, columns=len(designs))


def _as_wide(picture: bytes, wide: int) -> Image.Image:
    """Return a PNG file's picture at another width."""
    with Image.open(io.BytesIO(picture)) as image:
        return image.convert("RGB").resize((wide, round(wide * image.height / image.width)))


def _asked_picture(inspection: Inspection, settings: Settings | None) -> Image.Image:
    """Return the mesh and its weave as they were asked for."""
    woven = inspection.woven
    mesh, threads = woven.mesh, woven.weave.threads
    marks, broken = irregular_marks(mesh), woven.weave.broken.total
    if settings is None:
        colours = strand_colours(woven.weave, woven.bunches, "safe")
    else:
        colours = woven_colours(woven, settings.pieces.colours, complete_settings(settings)[1])
    tiles = [
        mesh_picture(mesh, marks=marks),
        weave_picture(woven.ribbons, colours),
    ]
    captions = [
        f"{woven.title}\n{agree(mesh.n_faces, '{n} [face|faces]')}, "
        + (
            agree(len(marks.points), "{n} irregular [vertex|vertices] marked")
            if marks.points.size
            else "no irregular vertices"
        ),
        f"{woven.weave.pattern}\n{agree(threads.n_threads, '{n} thread[|s]')}, "
        f"{agree(threads.n_crossings, '{n} crossing[|s]')}, "
        + (
            exact_text(woven.weave.broken_at_turns)
            if woven.weave.exact
            else agree(broken, "{n} broken condition[|s]")
        ),
    ]
    return contact_sheet(tiles, captions, columns=2)
