"""Say which designs of a model are worth trying: from coarse to fine, in quads and triangles."""

from collections.abc import Iterator

import numpy as np

from fabweave.mesh.fair.fairing import STEPS
from fabweave.mesh.leave_out import parse_leave_out
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.mesh.triangulate import surface_area
from fabweave.options.command import changed_options
from fabweave.options.settings import Settings
from fabweave.options.table import option_named

#: How wide ribbons of a kagome basket are: they take more of their room than in other weaves, as
#: its large openings stay anyway. Then so many triangles for each quad give ribbons as wide.
KAGOME_WIDTH = option_named("width").kind.parse("even,0.8")
KAGOME_SHARE = 0.48
#: Ribbons of a mesh of quads are about so wide, as a share of the sides of its faces.
WIDTH_SHARE = 0.38
#: Widths of ribbons that are comfortable to weave, millimetres: the coarsest and the finest mesh.
_COARSE_MM, _FINE_MM = 25.0, 7.5
#: A mesh of fewer faces keeps no shape; one of more is no evening's work.
FEWEST, MOST = 40, 1500
#: Meshes with more faces are not woven as they come.
_MOST_AS_THEY_COME = 1500
#: A built-in shape, or a mesh of so few faces, is refined rather than made anew.
_LOW_POLY = 60
#: By what factor ribbons of a narrower weave are narrower, which shows more of what is behind it.
NARROW = 0.7


def fairable(asked: Settings, design: Settings) -> bool:
    """Tell whether fairing is another design: what was remeshed is faired already."""
    return asked.mesh.fair is None and not design.mesh.faired


def is_free(asked: Settings) -> bool:
    """Tell whether the mesh is left to fabweave: a model, of which nothing counts its faces.

    Examples
    --------
    >>> is_free(Settings.of("cow.obj")), is_free(Settings.of("cow.obj", remesh="none"))
    (True, False)
    """
    stated = (asked.mesh.remesh, asked.mesh.refine, asked.weave.twists, asked.search.layout)
    if is_shape(asked.mesh.source) or any(one is not None for one in stated):
        return False
    return not (
        asked.pieces.force or asked.mesh.symmetrise or parse_leave_out(asked.mesh.leave_out).faces
    )


def name_of(settings: Settings, asked: Settings) -> str:
    """Return what sets a design apart from what was asked for.

    Examples
    --------
    >>> name_of(Settings.of("a.obj", remesh="quads:90"), Settings.of("a.obj"))
    '--remesh quads:90'
    >>> name_of(Settings.of("a.obj"), Settings.of("a.obj"))
    'as asked'
    """
    return changed_options(settings, asked) or "as asked"


def densities(mesh: PolyMesh, count: int) -> list[int]:
    """Return numbers of quads to try, from coarse to fine, by the widths that ribbons would have.

    Parameters
    ----------
    mesh : PolyMesh
        In millimetres, at the size at which it is woven.
    count : int
        How many.

    Returns
    -------
    list of int
        Ascending, evenly spaced as a geometric row, two digits each; fewer on small objects.

    Examples
    --------
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> densities(parse_shape("shape:sphere?n=8&radius=150"), 4)
    [65, 140, 320, 720]
    """
    area = surface_area(mesh)
    ends = [area / (width / WIDTH_SHARE) ** 2 for width in (_COARSE_MM, _FINE_MM)]
    low, high = np.clip(ends, FEWEST, MOST).tolist()
    found = {two_digits(number) for number in np.geomspace(low, high, count).tolist()}
    return sorted(found)


def two_digits(number: float) -> int:
    """Return a number, rounded to two digits.

    Examples
    --------
    >>> two_digits(237.4), two_digits(99.6), two_digits(1512)
    (240, 100, 1500)
    """
    step = 10 ** max(0, int(np.floor(np.log10(number))) - 1)
    return int(round(number / step) * step)


def variety(asked: Settings, mesh: PolyMesh, count: int) -> list[Settings]:
    """Return the designs to try, those first that tell most.

    What is asked for is kept: a mesh that is to be remeshed or refined in a stated way is not
    remeshed otherwise, and a stated width stays.

    Parameters
    ----------
    asked : Settings
    mesh : PolyMesh
        As it is loaded, before anything is done to it, at its size in millimetres.
    count : int
        How many at most.
    """
    found: dict[str, Settings] = {}
    for settings in _all(asked, mesh, count):
        found.setdefault(name_of(settings, asked), settings)
        if len(found) == count:
            break
    return list(found.values())


def _all(asked: Settings, mesh: PolyMesh, count: int) -> Iterator[Settings]:
    """Yield designs in the order in which they are worth trying; some may come twice."""
    meshes = list(_meshes(asked, mesh, count))
    yield from meshes
    if asked.weave.pattern == "plain":
        yield from (
            settings.but(pattern="twill")
            for settings in meshes
            if "triangles" not in (settings.mesh.remesh or "")
        )
        # It subdivides its mesh first, so that coarse ones will do.
        yield from (
            settings.but(pattern="triaxial")
            for settings in meshes
            if "triangles" in (settings.mesh.remesh or "")
        )
    if asked.narrowable:
        yield from (settings.narrower(NARROW) for settings in meshes)
    yield from (settings.but(fair=STEPS) for settings in meshes if fairable(asked, settings))
    if asked.pieces.max_length_mm is None and asked.pieces.prefer == option_named("prefer").default:
        for prefer in ("work", "waste"):
            yield from (settings.but(prefer=prefer) for settings in meshes)


def _meshes(asked: Settings, mesh: PolyMesh, count: int) -> Iterator[Settings]:
    """Yield designs that differ in their meshes alone."""
    fixed = asked.mesh.remesh is not None or asked.mesh.refine is not None
    as_it_comes = mesh.n_faces <= _MOST_AS_THEY_COME
    if fixed:
        yield asked
        return
    if mesh.n_faces <= _LOW_POLY or asked.mesh.source.startswith("shape:"):
        yield asked
        for steps in (1, 2):
            if mesh.n_corners * 2 * 4 ** (steps - 1) <= MOST:
                yield asked.but(refine=f"catmull-clark:{steps}")
        return
    each = max(3, count // 3)
    quads = densities(mesh, each)
    if not lacking("quads"):
        yield from (asked.but(remesh=f"quads:{number}") for number in quads)
    if as_it_comes:
        yield asked
    # Where ribbons run straight over triangles, fewer of these make them as wide as on quads; else
    # there are as many crossings: a triangle has one and a half, a quad two.
    straight = asked.weave.course != "projection"
    share = KAGOME_SHARE if straight else 4 / 3
    if straight and asked.ribbons.width is None:
        asked = asked.but(width=KAGOME_WIDTH)
    triangles = dict.fromkeys(two_digits(max(FEWEST, share * number)) for number in quads)
    yield from (asked.but(remesh=f"triangles:{number}") for number in triangles)
