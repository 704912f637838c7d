"""Make pictures like figures 1, 2 and 4 to 17 of "Cyclic twill-woven objects" (2011).

The meshes are fabweave's own shapes and models, of the kinds that the paper shows;
``paper_theory.py`` draws figures 5 to 9. Run it with:
python examples/make_figures.py figures
or, for some of them: python examples/make_figures.py figures 4 14
With ``--page`` they are small, and a page with counts stands beside them:
python examples/make_figures.py examples/figures --page
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import paper_theory
from PIL import Image

from fabweave.core.messages import agree
from fabweave.job.ask import complete_settings
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.options.settings import Settings
from fabweave.picture.camera import View
from fabweave.picture.contact_sheet import contact_sheet
from fabweave.picture.object_picture import mesh_picture, weave_picture
from fabweave.picture.twist_picture import ViewOf, weave_on_mesh
from fabweave.ribbon.lay import keep_clear, lay_object
from fabweave.ribbon.width import parse_width
from fabweave.stock.supplies import Supplies
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.strand_colours import strand_colours
from fabweave.weave.twill.conditions import twill_conditions
from fabweave.weave.twill.voting import best_vote
from fabweave.weave.weave_mesh import WovenMesh, weave_mesh

TILE = (560, 460)
ABOVE = View(-90.0, 90.0)
#: From above, as in the paper: a view at eye height hides holes.
SEEN = View(-60.0, 34.0)
MESHES = Path(__file__).parent / "meshes"


class Woven(NamedTuple):
    """A shape, woven, and the settings that it was woven with."""

    mesh: WovenMesh
    settings: Settings
    supplies: Supplies


#: All that was woven for a figure, for its counts.
WOVEN: list[Woven] = []


class Tile(NamedTuple):
    """A picture and what is written below it."""

    picture: Image.Image
    caption: str


def woven(
    shape: str,
    refine: str | None = None,
    pattern: str = "twill",
    *,
    vote: bool = False,
    given: PolyMesh | None = None,
    **options: Any,
) -> Woven:
    """Weave a shape as asked, or as the paper's voting decides."""
    settings, supplies = complete_settings(
        Settings.of(
            shape,
            size_mm=400.0,
            refine=refine,
            pattern=pattern,
            # The paper's ribbons cover the surface.
            course="projection" if pattern == "triaxial" else "auto",
            effort="quick",
            **options,
        )
    )
    found = weave_mesh(Stations(settings, given).loaded, settings.weave, settings.search, supplies)
    if vote:
        threads = found.weave.threads
        conditions = twill_conditions(found.halfedges, threads)
        won = best_vote(conditions, threads, part_bunches(threads))
        weave = Weave(threads, "voting", won.twist, over_of_passes(threads, won.twist), won.broken)
        found = replace(found, result=replace(found.result, weave=weave))
    WOVEN.append(Woven(found, settings, supplies))
    return WOVEN[-1]


def ribbons(one: Woven, view: View | None = SEEN, *, floor: bool = True) -> Image.Image:
    """Return a picture of the woven object."""
    rest = one.settings.ribbons, one.supplies
    clear = keep_clear(lay_object(one.mesh, *rest), *rest)
    twill = one.mesh.result.twill
    rows = None if twill is None else twill.rows
    colours = strand_colours(clear.weave, clear.bunches, "safe", rows=rows)
    return weave_picture(clear.ribbons, colours, size_px=TILE, view=view, floor=floor, samples=3)


def on_mesh(what: ViewOf, one: Woven, view: View = SEEN) -> Image.Image:
    """Return a picture of the weave on its mesh."""
    mesh = one.mesh
    return weave_on_mesh(
        what, mesh.mesh, mesh.halfedges, mesh.weave, size_px=TILE, view=view, caption=False
    )


def broken(one: Woven) -> str:
    """Say how many conditions are broken."""
    total = one.mesh.weave.broken.total
    return "exact" if total == 0 else f"{total} conditions broken"


def hexagons(rows: int = 5) -> PolyMesh:
    """Return a patch of the tiling of the plane by regular hexagons."""
    side = np.sqrt(3.0)
    centres = [
        (side * (x + y / 2), 1.5 * y)
        for y in range(-rows // 2 + 1, rows // 2 + 1)
        for x in range(-rows, rows + 1)
        if abs(x + y / 2) <= rows / 2
    ]
    turns = np.radians(90 + 60 * np.arange(6))
    corners = [(x + np.cos(turn), y + np.sin(turn)) for x, y in centres for turn in turns]
    points, number = np.unique(np.round(corners, 6), axis=0, return_inverse=True)
    points = 30.0 * np.column_stack((points, np.zeros(len(points))))
    return PolyMesh.from_faces(points, number.reshape(-1, 6).tolist())


def figure_1() -> Iterator[Tile]:
    """Show twill-woven objects, by Catmull-Clark steps of one mesh."""
    shape = "shape:slit?genus=3&m=16&n=4&slit=4"
    for steps in range(3):
        one = woven(shape, f"catmull-clark:{steps}" if steps else None)
        if not steps:
            picture = mesh_picture(one.mesh.mesh, size_px=TILE, view=SEEN)
            yield Tile(picture, "the mesh, of genus 3")
        yield Tile(ribbons(one), f"its 2/2 twill after {agree(steps, '{n} step[|s]')}")


def figure_2() -> Iterator[Tile]:
    """Show the biaxial twills that repeat after four threads."""
    for fabric in ("2/2/1", "2/2/-1", "3/1/1", "1/3/-1"):
        over, under, shift = fabric.split("/")
        cloth = paper_theory.squares(16, 13)
        one = woven("squares.obj", None, fabric, given=cloth, width=parse_width("0.8"))
        caption = f"{fabric}\nover {over}, under {under}, shifted by {shift}"
        yield Tile(ribbons(one, ABOVE, floor=False), caption)


def figure_4() -> Iterator[Tile]:
    """Show the tiling by regular hexagons, and a 2/2 twill on it."""
    tiling = hexagons()
    yield Tile(mesh_picture(tiling, size_px=TILE, view=ABOVE), "the tiling by regular hexagons")
    one = woven("hexagons.obj", given=tiling)
    picture = ribbons(one, ABOVE, floor=False)
    yield Tile(picture, f"its 2/2 twill, in three directions: {broken(one)}")


def exact_ones(*shapes: str) -> Iterator[Tile]:
    """Show shapes with their twists, and woven."""
    for shape in shapes:
        one = woven(shape)
        name = shape.removeprefix("shape:")
        yield Tile(on_mesh("twists", one), f"{name}\n{broken(one)}")
        yield Tile(ribbons(one), "its 2/2 twill")


def figure_10() -> Iterator[Tile]:
    """Show meshes with edges in two colours."""
    return exact_ones("shape:torus?m=16&n=8", "shape:torus?m=15&n=8")


def figure_11() -> Iterator[Tile]:
    """Show what has no exact twill in quads, by the paper's voting and our search, and in rings."""
    models = {
        str(MESHES / "koala.obj"): ("quads:350", "rings:350", None),
        str(MESHES / "nefertiti.obj"): ("quads:350", "rings:350", View(-20.0, 10.0)),
        "shape:cube?n=6": (None, "rings:216", SEEN),
    }
    for model, (quads, rings, view) in models.items():
        name = Path(model.removeprefix("shape:")).stem.partition("?")[0]
        for method in ("voting", "search", "rings"):
            one = woven(
                model, vote=method == "voting", remesh=rings if method == "rings" else quads
            )
            yield Tile(ribbons(one, view), f"{name}, by {method}: {broken(one)}")


def figure_12() -> Iterator[Tile]:
    """Show how meshes are subdivided at the middles of their edges."""
    for shape in ("shape:cube", "shape:dodecahedron"):
        name = shape.removeprefix("shape:")
        one = woven(shape, None, "triaxial")
        yield Tile(mesh_picture(parse_shape(shape), size_px=TILE, view=SEEN), name)
        yield Tile(on_mesh("twists", one), f"edges halved: {broken(one)}")


def figure_13() -> Iterator[Tile]:
    """Show triaxial twill on surfaces of genus 0."""
    for solid, steps in (("icosahedron", 1), ("octahedron", 2)):
        one = woven(f"shape:{solid}", f"loop:{steps}", "triaxial")
        yield Tile(ribbons(one), f"{solid}, rounded: {broken(one)}")


def figure_14() -> Iterator[Tile]:
    """Show the regular mesh (8, 4, 3)."""
    return exact_ones("shape:regular?face=8&valence=4&genus=3")


def figure_15() -> Iterator[Tile]:
    """Show the regular mesh (16, 4, 4)."""
    return exact_ones("shape:regular?face=16&valence=4&genus=4")


def figure_16() -> Iterator[Tile]:
    """Show two objects made of bipyramids with handles."""
    return exact_ones("shape:bipyramid?n=2", "shape:bipyramid?n=3")


def figure_17() -> Iterator[Tile]:
    """Show one weave by its edges, with thin ribbons and with thick ones."""
    shares = {"thin": "0.3", "thick": "0.85"}
    both = {
        said: woven("shape:slit?genus=2", width=parse_width(share))
        for said, share in shares.items()
    }
    edges = both["thin"]
    yield Tile(on_mesh("twists", edges), f"edges in two colours: {broken(edges)}")
    for said, one in both.items():
        yield Tile(ribbons(one), f"{said} ribbons, {shares[said]} of their room")


FIGURES = {
    1: figure_1, 2: figure_2, 4: figure_4, 10: figure_10, 11: figure_11, 12: figure_12,
    13: figure_13, 14: figure_14, 15: figure_15, 16: figure_16, 17: figure_17,
}  # fmt: skip

#: What each figure of the paper is about, for the page.
ABOUT = {
    1: "twill-woven objects by Catmull-Clark steps of one mesh",
    2: "the biaxial twills that repeat after four threads",
    4: "the tiling by regular hexagons, and a 2/2 twill on it",
    5: "the conditions of a 2/2 twill on the fabric: along a strand, and around a gap",
    6: "an edge as a strip, whose sides are the two strands",
    7: "the boundary of strips: rings without twists, links with some",
    8: "cycles, and their parts between two visits of a crossing, are even",
    9: "the three conditions of a 2/2 twill on the mesh",
    10: "meshes whose edges have the two colours of an exact twill",
    11: "approximate biaxial twills in quads, by voting and by search, and exact ones in rings",
    12: "mid-edge subdivision, which makes a triaxial twill exact",
    13: "triaxial twills on surfaces of genus 0",
    14: "the regular mesh (8, 4, 3), with eight sides to a face, four at a vertex, and genus 3",
    15: "the regular mesh (16, 4, 4)",
    16: "two objects from bipyramids with handles",
    17: "edges in two colours, thin ribbons, and thick ribbons",
}
#: How wide pictures of the page are, and how many colours they have: those of a few pixels, such
#: as the lines of diagrams, need more.
PAGE_PX, PALETTE, OF_DIAGRAM = 840, 96, 256


#: Figures whose pictures stand three in a row.
IN_THREES = {7, 9, 11, 17}


def counts_of(one: Woven) -> paper_theory.Row:
    """Count a weave as the page tells it."""
    weave = one.mesh.weave
    return {
        "mesh": ", ".join(
            [
                Path(one.settings.mesh.source.removeprefix("shape:")).name,
                *map(str, filter(None, (one.settings.mesh.remesh, one.settings.mesh.refine))),
            ]
        ),
        "weave": weave.pattern,
        # What is left of the corners of a patch crosses nothing.
        "threads": int(np.count_nonzero(weave.threads.lengths)),
        "crossings": weave.threads.n_crossings,
        "bunches": len(np.unique(one.mesh.bunches)),
        "broken conditions": weave.broken.total,
    }


def page_of(counts: Mapping[int, Sequence[paper_theory.Row]]) -> str:
    """Return the page: each figure, what it is about, and a table of counts."""
    lines = [
        "# The paper beside us",
        "",
        'The figures of E. Akleman, J. Chen, Y. Chen, Q. Xing and J. L. Gross, "Cyclic twill-woven',
        'objects", Computers & Graphics 35 (2011), as fabweave makes them. The meshes are our own,',
        "of the kinds that the paper shows, under its numbers. Left out are the photographs of",
        "figure 3, and an object of genus 30 of figure 11. A bunch is a direction,",
        "such as warp or weft. A weave without broken conditions is exact. `make figures` makes",
        "this page.",
    ]
    for number, rows in counts.items():
        lines += ["", f"## Figure {number}: {ABOUT[number]}", ""]
        lines += [f"![Figure {number}](figure_{number:02}.png)", ""]
        lines += [f"| {' | '.join(rows[0])} |", "|---" * len(rows[0]) + "|"]
        lines += [f"| {' | '.join(map(str, row.values()))} |" for row in rows]
    return "\n".join(lines) + "\n"


as_page = "--page" in sys.argv
folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
made: dict[int, list[paper_theory.Row]] = {}
for number in [int(text) for text in sys.argv[2:] if text != "--page"] or ABOUT:
    diagram = number in paper_theory.FIGURES
    if diagram:
        drawn, made[number] = paper_theory.FIGURES[number]()
    else:
        WOVEN.clear()
        drawn, made[number] = list(FIGURES[number]()), []
        for row in map(counts_of, WOVEN):
            made[number] += [row] * (row not in made[number])
    tiles, captions = zip(*drawn, strict=True)
    sheet = contact_sheet(tiles, captions, columns=3 if number in IN_THREES else 2)
    if as_page:
        sheet = sheet.resize(
            (PAGE_PX, round(sheet.height * PAGE_PX / sheet.width)), Image.Resampling.LANCZOS
        ).quantize(OF_DIAGRAM if diagram else PALETTE, kmeans=2 * diagram, dither=Image.Dither.NONE)
    sheet.save(folder / f"figure_{number:02}.png", optimize=True)
    print(f"figure_{number:02}.png")
if as_page:
    (folder / "README.md").write_text(page_of(made), encoding="utf-8", newline="")
