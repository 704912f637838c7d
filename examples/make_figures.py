"""Make pictures like figures 1, 2 and 4 to 17 of "Cyclic twill-woven objects" (2011).

The meshes are fabweave's own shapes of the kinds that the paper shows; ``paper_theory.py`` draws
figures 5 to 9. Run it with:
python examples/make_figures.py figures
or, for some of them: python examples/make_figures.py figures 4 14
With ``--page`` they are small, and a page with counts stands beside them:
python examples/make_figures.py examples/figures --page
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import paper_theory
from PIL import Image

from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.picture.camera import View
from fabweave.picture.contact_sheet import contact_sheet
from fabweave.picture.object_picture import mesh_picture, weave_picture
from fabweave.picture.twist_picture import ViewOf, weave_on_mesh
from fabweave.plan.ask import complete_settings, load_asked
from fabweave.ribbon.lay import keep_clear, lay_object
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
        )
    )
    found = weave_mesh(
        load_asked(settings, given_mesh=given), settings.weave, settings.search, supplies
    )
    if vote:
        threads = found.weave.threads
        conditions = twill_conditions(found.halfedges, threads)
        won = best_vote(conditions, threads, part_bunches(threads))
        weave = Weave(threads, "voting", won.twist, over_of_passes(threads, won.twist), won.broken)
        found = replace(found, result=replace(found.result, weave=weave))
    WOVEN.append(Woven(found, settings, supplies))
    return WOVEN[-1]


def ribbons(one: Woven, view: View = SEEN, *, floor: bool = True) -> Image.Image:
    """Return a picture of the woven object."""
    rest = one.settings.ribbons, one.supplies
    clear = keep_clear(lay_object(one.mesh, *rest), *rest)
    colours = strand_colours(clear.weave, clear.bunches, "safe")
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
    """Show plain weave and twill."""
    for pattern in ("plain", "twill"):
        one = woven("shape:torus?m=28&n=12", None, pattern)
        yield Tile(ribbons(one), f"{pattern} on a torus")
        yield Tile(on_mesh("twists", one), f"{pattern}: its twists")


def figure_4() -> Iterator[Tile]:
    """Show the tiling by regular hexagons, and its triaxial twill."""
    tiling = hexagons()
    yield Tile(mesh_picture(tiling, size_px=TILE, view=ABOVE), "the tiling by regular hexagons")
    one = woven("tiling.obj", given=tiling)
    yield Tile(on_mesh("twists", one, ABOVE), f"its twists: {broken(one)}")
    yield Tile(ribbons(one, ABOVE, floor=False), "its triaxial twill")


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
    """Show genus 2 and more."""
    return exact_ones("shape:slit?genus=2", "shape:slit?genus=3")


def figure_12() -> Iterator[Tile]:
    """Show bipyramids with handles."""
    return exact_ones("shape:bipyramid?n=2", "shape:bipyramid?n=3")


def figure_13() -> Iterator[Tile]:
    """Show regular meshes."""
    return exact_ones(
        "shape:regular?face=16&valence=4&genus=4",
        "shape:regular?face=8&valence=8&genus=7",
        "shape:cage?faces=4",
    )


def by_vote_and_search(*views: ViewOf, shape: str, refine: str) -> Iterator[Tile]:
    """Show what voting decides beside what the search finds."""
    both = {name: woven(shape, refine, vote=name == "voting") for name in ("voting", "search")}
    for what in views:
        for name, one in both.items():
            yield Tile(on_mesh(what, one), f"{what}, {name}: {broken(one)}")
    for name, one in both.items():
        yield Tile(ribbons(one), f"woven, {name}")


def figure_14() -> Iterator[Tile]:
    """Show what voting and search break on a refined cube, which has no exact twill."""
    return by_vote_and_search("twists", "faults", shape="shape:cube", refine="catmull-clark:2")


def figure_15() -> Iterator[Tile]:
    """Show the same on a refined icosahedron."""
    return by_vote_and_search(
        "twists", "faults", shape="shape:icosahedron", refine="catmull-clark:1"
    )


def figure_16() -> Iterator[Tile]:
    """Show the seams of both results on the cube."""
    return by_vote_and_search("seams", shape="shape:cube", refine="catmull-clark:2")


def figure_17() -> Iterator[Tile]:
    """Show triangles and pentagons, exact after edges are halved."""
    for shape in ("shape:dodecahedron", "shape:icosahedron"):
        one = woven(shape, None, "triaxial")
        name = shape.removeprefix("shape:")
        yield Tile(on_mesh("twists", one), f"{name}, edges halved: {broken(one)}")
        yield Tile(ribbons(one), "its triaxial twill")


FIGURES = {
    1: figure_1, 2: figure_2, 4: figure_4, 10: figure_10, 11: figure_11, 12: figure_12,
    13: figure_13, 14: figure_14, 15: figure_15, 16: figure_16, 17: figure_17,
}  # fmt: skip

#: What each figure of the paper is about, for the page.
ABOUT = {
    1: "twill-woven objects by Catmull-Clark steps of one mesh",
    2: "plain weave beside twill",
    4: "the tiling by regular hexagons and its triaxial twill",
    5: "the conditions of a 2/2 twill on the fabric: along a strand, and around a gap",
    6: "an edge as a strip, whose sides are the two strands",
    7: "the boundary of strips: rings without twists, links with some",
    8: "cycles, and their parts between two visits of a crossing, are even",
    9: "the three conditions of a 2/2 twill on the mesh",
    10: "meshes whose edges have the two colours of an exact twill",
    11: "exact twills on surfaces of genus 2 and more",
    12: "bipyramids with handles",
    13: "regular meshes",
    14: "a refined cube, which has no exact twill, decided by voting",
    15: "the same on a refined icosahedron",
    16: "seams, where the diagonal of an inexact twill changes direction",
    17: "triangles and pentagons, exact once edges are halved",
}
#: How wide pictures of the page are, and how many colours they have: those of a few pixels, such
#: as the lines of diagrams, need more.
PAGE_PX, PALETTE, OF_DIAGRAM = 840, 96, 256


#: Figures whose pictures stand three in a row.
IN_THREES = {4, 7, 9}


def counts_of(one: Woven) -> paper_theory.Row:
    """Count a weave as the page tells it."""
    weave = one.mesh.weave
    return {
        "mesh": f"{one.settings.mesh.source.removeprefix('shape:')}"
        + (f", {one.settings.mesh.refine}" if one.settings.mesh.refine else ""),
        "weave": weave.pattern,
        "threads": weave.threads.n_threads,
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
        "of the kinds that the paper shows. A bunch is a direction, such as warp or weft. A weave",
        "without broken conditions is exact. `make figures` makes this page.",
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
