"""Choose the mesh on which a job is woven: the model's own, or a coarser one of its surface."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fabweave.core.errors import CannotMakeError, TooFineError
from fabweave.core.messages import agree
from fabweave.design.beside import denser, density, near_rounds, why_few
from fabweave.design.search import Search
from fabweave.design.tried import MOST_CROSSINGS, Tried
from fabweave.design.variety import (
    FEWEST,
    KAGOME_SHARE,
    KAGOME_WIDTH,
    WIDTH_SHARE,
    is_free,
    two_digits,
    variety,
)
from fabweave.design.wishes import score
from fabweave.job.cures import stands_as_made
from fabweave.job.stations import Stations
from fabweave.mesh.check import check_mesh, faces_text
from fabweave.mesh.leave_out import parse_leave_out
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.remesh.grid import lacks_grid
from fabweave.mesh.triangulate import surface_area
from fabweave.options.settings import Settings
from fabweave.plan.grade import EASY_MM
from fabweave.plan.verdict import NotMakeableError
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.weave.twill.rows import ring_rows

#: A model with so many handles, as this Euler number says, has cracks and tunnels of a scan.
_EULER = -4
#: Strips of the meshes that are tried first are about so wide, millimetres, and those of a finer
#: one; a coarser one has so many times fewer faces than the first.
_FIRST_MM, _FINER_MM, _COARSER = 12.0, 8.5, 2
#: The first meshes have no more quads than an evening's work, a finer one than some evenings'. A
#: slender model has as many as the last, if strips are easy to handle.
_EVENING, _MOST, _SLENDER = 350, 500, 240
#: So many triangles for a quad make ribbons of the same width.
_TRIANGLES = 0.6
#: A score at which no other mesh need be tried: of its own, as somebody may have drawn it to
#: be woven, or of another, but for a finer and a quicker one beside it; in the first rounds; and in
#: those after them.
_OWN, _FINE, _GOOD = 7.0, 8.0, 5.0
#: What is sure to be so many points behind the best is no choice. A kind of mesh of which none
#: comes nearer is tried no more; of the best kind, meshes of so many times its faces are.
_BEHIND, _HOPELESS, _BESIDE = 1.0, 3.0, (1.25, 0.8)
#: So many of the meshes are planned closely, the best first, until one can be built.
_CLOSELY = 4
#: Of what cannot be built, so many designs are tried at first, and so many that can are told.
_MESHES, _TOLD = 4, 3
#: Strips of a mesh are about such a share of the root of the area of each crossing; its own is not
#: tried where that is less than so many millimetres.
_WIDE, _LEAST_MM = 0.54, 4.0
#: Rims longer than this share of the size are rims; shorter ones are cracks, which a wrap closes.
_RIM = 0.3
#: Another design is finer if it has so many times the crossings, and quicker in such a share of
#: the hours.
_MORE, _LESS = 1.25, 0.75
#: Said of what is on a base.
_BASED = ". Free, it falls or goes far: a board, base.dxf, ties its feet; --base off leaves it out"


class Choice(NamedTuple):
    """A job, on the mesh that was chosen for it.

    ``why`` is empty where all is as it was asked; ``beside`` are a finer and a quicker design, by
    these names, where there are such.
    """

    job: Stations
    why: str = ""
    beside: Mapping[str, Tried] = MappingProxyType({})

    @property
    def text(self) -> str:
        """All of that, in lines."""
        others = (f"  {name}: {one.brief}" for name, one in self.beside.items())
        return "\n".join(filter(None, (self.why, *others)))


def choose_mesh(
    job: Stations, search: Search, *, most_planned: float = np.inf, advise: bool = True
) -> Choice:
    """Return a job on the best mesh for it: as it is asked for, or another of its surface.

    Where the mesh is left to fabweave (see :func:`is_free`), its own and grids, quads, tubes,
    rings and triangles compete by the grade that the maker reads, and by hours (see
    :func:`fabweave.design.wishes.rank`). An evening's work with strips of some 12 mm is tried
    first; what is finer or coarser only where that is not good.

    Parameters
    ----------
    job : Stations
    search : Search
        For designs of that job.
    most_planned : float
        Of more crossings, no pieces are planned to see whether what is asked for can be built.
    advise : bool
        Whether designs are tried where it cannot be built, so that the message names some.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If it cannot be built as asked; the message tells what was tried instead, and can be built.
    """
    search.share(job)
    if not is_free(job.asked):
        return _as_asked(job, search, most_planned, advise=advise)
    unfit = _unfit(job)
    search.run(mesh_rounds(search, job.loaded, own=not unfit), behind=_BEHIND)
    # Nothing that breaks conditions takes the place of an exact twill.
    ranked = sorted(search.ranked, key=lambda one: not _is_exact(one))
    fallen: list[Choice] = []
    for one in islice(ranked, _CLOSELY):
        if one.soft and fallen:
            break
        own = one.design == job.asked
        taken = job if own else job.instead(one.design).know(loaded=one.loaded)
        try:
            _ = taken.buildable
        except (NotMakeableError, TooFineError):
            continue
        # What is foretold of what goes far is near the truth at best.
        falls = one.unsure and not stands_as_made(taken)
        found = one.fallen if falls else one
        if falls and (held := _on_base(taken)) is not None:
            taken, falls, found = held, False, replace(one, design=held.asked)
        why = ""
        if found.design != job.asked:
            on_own = _unbased(found.design, job.asked) == job.asked
            why = (
                f"chosen: {found.brief}{_BASED}"
                if on_own
                else told(job.loaded, found, unfit or _fares(search))
            )
        choice = Choice(taken, why, beside_it(search, one))
        if not falls:
            return choice
        fallen.append(choice)
    if fallen:
        return fallen[0]
    if unfit:
        ways = f". {why_few(search)}" if advise else ""
        raise CannotMakeError(f"{_own(job.loaded)} {unfit}, and no other can be built{ways}")
    return _as_asked(job, search, advise=advise)


def _unbased(design: Settings, asked: Settings) -> Settings:
    """Return a design without a base that was not asked for."""
    return design.but(base=asked.pieces.base)


def _on_base(job: Stations) -> Stations | None:
    """Return a job of an open object that falls on a base, if it stands there."""
    if not job.asked.pieces.may_be_based:
        return None
    held = job.instead(job.asked.but(base="on"))
    return held if stands_as_made(held) else None


def _as_asked(
    job: Stations, search: Search, most_planned: float = np.inf, *, advise: bool
) -> Choice:
    """Return a job as it is asked for, if it can be built; else say what can."""
    if job.n_crossings > most_planned:
        return Choice(job)
    try:
        _ = job.buildable
    except (NotMakeableError, TooFineError) as error:
        # Where other meshes were tried, the nearest of them is tried larger, thinner and softer.
        ways = ""
        if advise:
            search.better(f"as asked it cannot be built: {error.reason}; looking for what can")
            ways = f"{why_few(search)}\n" if search.tried else what_can_be_built(search)
        if isinstance(error, NotMakeableError):
            raise NotMakeableError(error.verdict, ways) from None
        raise CannotMakeError(f"{error}\n{ways.rstrip()}") from None
    return Choice(job)


def _unfit(job: Stations) -> str:
    """Say why a model's own mesh need not be tried; empty if it may be good."""
    crossings = job.n_crossings
    wide = _WIDE * float(np.sqrt(surface_area(job.loaded.mesh) / max(crossings, 1)))
    if wide < _LEAST_MM:
        return f"would need strips of some {max(wide, 0.1):.1f} mm"
    if crossings > MOST_CROSSINGS:
        return f"would have {crossings} crossings"
    if job.asked.ribbons.straight:
        return ""  # it takes longer to say
    # How strands go over and under changes no width; a twill would be searched for long.
    twill = job.asked.weave.pattern == "twill"
    plain = job.instead(job.asked.but(pattern="plain")) if twill else job
    try:
        stops = plain.foreseen
    except CannotMakeError as error:
        return f"cannot be woven ({error.reason})"
    return needs(stops[0]) if stops else ""


def _fares(search: Search) -> str:
    """Say what the model's own mesh came to."""
    own = next(one for one in search.tried if _unbased(one.design, search.asked) == search.asked)
    if own.figures is None or not own.makeable:
        return f"cannot be built ({own.verdict.reasons[0].text})"
    return f"would come to {own.figures.pieces} pieces of grade {own.figures.grade or 0.0:.1f}"


def mesh_rounds(
    search: Search, model: LoadedMesh, *, own: bool = False
) -> Iterator[list[Settings]]:
    """Yield meshes for a model, round after round, until one is good.

    Its own comes first; for a twill, rings, and no more if these can be made; then a grid, quads
    and rings, and tubes if these are not good, whose strips are some 12 mm wide; then finer and
    coarser ones of the better kind; at last triangles. A closed model of which none could be made
    at all, or whose bodies run through one another, or that has many handles, is wrapped. What is
    open is not, as it would become a bag; unless such bodies close one another, as those of a
    teapot do: then both are tried, and the grade tells.

    Parameters
    ----------
    search : Search
    model : LoadedMesh
        As it comes.
    own : bool
        Whether its own mesh is tried.
    """
    asked = search.asked
    if own:
        yield [asked]
        # What needs a base was hardly drawn to be woven.
        alone = all(one.design.pieces == asked.pieces for one in search.tried)
        if _is_good(search, _OWN if alone else _FINE):
            return
    area = surface_area(model.mesh)
    first, finer, slender = (
        area / (mm / WIDTH_SHARE) ** 2 for mm in (_FIRST_MM, _FINER_MM, EASY_MM)
    )
    first, finer = min(first, _EVENING), max(min(finer, _MOST), min(slender, _SLENDER))
    ways = _kinds(asked, model)
    straight = asked.ribbons.straight
    base = asked.but(width=KAGOME_WIDTH) if straight and asked.ribbons.width is None else asked
    report, is_open = check_mesh(model.mesh), _is_open(model)
    joined = report.n_components > 1 and model.clashes > 0
    many = joined or report.euler < _EULER
    closed = asked.mesh.bodies == "all" and not is_open
    bodies = "wrap" if closed and many else asked.mesh.bodies

    def mesh(kind: str, number: float) -> Settings:
        share = 1.0 if kind != "triangles" else KAGOME_SHARE if straight else _TRIANGLES
        return base.but(remesh=f"{kind}:{two_digits(share * max(number, FEWEST))}", bodies=bodies)

    if asked.weave.pattern == "twill" and not is_open:
        for number in (first, first / _COARSER):
            yield [mesh("rings", number)]
            if any(_is_exact(one) for one in search.ranked):
                return
    if bodies == "all" and is_open and joined:
        bodies = "wrap"
        yield [mesh(way, first) for way in ways]
        bodies = "all"
    # What a grid fits well is no better in quads, which take longer to look for; what is good in
    # quads or rings is no better in tubes.
    late = {"grid": 0, "tubes": 2}
    for turn in range(3):
        some = [way for way in ways if late.get(way, 1) == turn]
        if turn < 2 or not _is_good(search, _GOOD):
            yield [mesh(way, first) for way in some]
        if _is_good(search, _FINE):
            return
    if closed and not many and (model.clashes or not any(_made(search, way) for way in ways)):
        # A wrap closes cracks and cavities, which is no small change: only where it helps.
        bodies = "wrap"
        yield [mesh(way, first) for way in _likely(search, ways)]
        if _is_good(search, _FINE):
            return
    best = next(iter(search.ranked), None)
    if best is not None:
        bodies = best.design.mesh.bodies
    able = [way for way in ways if _made(search, way)]
    # What has no grid at all has no finer one either; another remesher may do.
    able = able or [way for way in ways if way != "grid"] or ways
    # Limbs and horns are lost where strips are as wide as they are.
    finest = float(np.sqrt(finer * min(slender, _MOST)))
    yield from _other_densities(search, mesh, able, (first, finer, finest))


def _other_densities(
    search: Search,
    mesh: Callable[[str, float], Settings],
    able: list[str],
    numbers: tuple[float, float, float],
) -> Iterator[list[Settings]]:
    """Yield finer and coarser meshes than the first: of the better kind, then of others, too."""
    first, finer, finest = numbers
    coarser, between = first / _COARSER, float(np.sqrt(first * finer))
    best = next(iter(search.ranked), None)
    kind = (density(best.design)[0] if best is not None else "") or able[0]
    if best is not None and _is_good(search, _OWN):
        # No more than a finer and a quicker one are wanted beside it, if they are not there.
        there = beside_it(search, best)
        wanted = {"finer": finer, "quicker": coarser}
        if not _grows(search, kind, finer):
            del wanted["finer"]
        yield [mesh(kind, number) for name, number in wanted.items() if name not in there]
    else:
        ways = [] if _is_good(search, _GOOD) else _likely(search, able)
        others = [mesh(way, coarser if best is None else between) for way in ways]
        # Where limbs are cut short, what is coarser cuts more of them.
        quicker = [] if best is not None and best.short else [mesh(kind, coarser)]
        yield [mesh(kind, between), *others, *quicker]
        best = next(iter(search.ranked), None)
        kind = (density(best.design)[0] if best is not None else "") or kind
        if _grows(search, kind, finer):
            yield [mesh(kind, finer)]
    if _is_good(search, _GOOD):
        return
    best, likely = next(iter(search.ranked), None), _likely(search, able)
    if best is None:
        near = [mesh("triangles", coarser), mesh(kind, coarser / _COARSER)]
    else:
        # By a little luck, another mesh of about as many faces is a better one.
        free = _unbased(best.design, search.asked)
        whole = free.but(leave_out=search.asked.mesh.leave_out)
        near = list(denser(search.asked, whole, _BESIDE))
    yield [
        *near,
        *(mesh(way, between) for way in likely),
        *(mesh(way, finer) for way in likely if _grows(search, way, finer)),
        *(mesh(way, finest) for way in likely if way == "quads" and _grows(search, way, finest)),
        mesh("triangles", first),
    ]


def _kinds(asked: Settings, model: LoadedMesh) -> list[str]:
    """Return the kinds of meshes that are tried, the likeliest first."""
    if asked.ribbons.straight or asked.weave.pattern in ("kagome", "triaxial"):
        return ["triangles"]
    grid = [] if lacks_grid(model.mesh) else ["grid"]
    wanted = ["quads"] if _is_open(model) else ["quads", "tubes", "rings"]
    return [*grid, *(way for way in wanted if not lacking(way))] or ["triangles"]


def _is_open(model: LoadedMesh) -> bool:
    """Tell whether a model has rims, and no cracks alone."""
    mesh, halfedges = model.mesh, model.halfedges
    rim = halfedges.twin < 0
    ends = mesh.vertices[halfedges.head[rim]] - mesh.vertices[halfedges.tail[rim]]
    length = float(np.linalg.norm(ends, axis=1).sum())
    return length > _RIM * float(np.ptp(mesh.vertices, axis=0).max())


def _is_good(search: Search, least: float) -> bool:
    """Tell whether the best that was tried is good enough."""
    best = next(iter(search.ranked), None)
    fit = best is not None and best.like and not best.daunting and not best.soft
    return best is not None and fit and score(best) >= least


def _is_exact(one: Tried) -> bool:
    """Tell whether a design that can be made is an exact twill, in rings."""
    twill = one.design.weave.pattern == "twill" and one.makeable and one.loaded is not None
    return twill and one.loaded is not None and ring_rows(one.loaded.halfedges) is not None


def _likely(search: Search, ways: Sequence[str]) -> list[str]:
    """Return the kinds of meshes of which the best is not far behind the best of all."""
    found = dict.fromkeys(ways, -np.inf)
    for one in search.ranked:
        way = density(one.design)[0]
        if way in found:
            found[way] = max(found[way], score(one))
    least = max(found.values(), default=0.0) - _HOPELESS
    return [way for way in ways if found[way] >= least]


def _grows(search: Search, way: str, number: float) -> bool:
    """Tell whether a finer mesh of a kind may be better than those that were tried.

    It is not where the finest of these is not their best, nor where it would daunt; but it may keep
    limbs that are cut short.
    """
    made = [one for one in search.ranked if density(one.design)[0] == way and one.figures]
    if not made or made[0].short:
        return True
    best, counts = made[0], [density(one.design)[1] for one in made]
    crossings = 0 if best.figures is None else best.figures.crossings
    return counts[0] == max(counts) and crossings * number <= MOST_CROSSINGS * counts[0]


def _made(search: Search, way: str) -> bool:
    """Tell whether a way made any mesh."""
    return any(one.loaded is not None for one in search.tried if density(one.design)[0] == way)


def beside_it(search: Search, chosen: Tried) -> Mapping[str, Tried]:
    """Return the next best that were tried: one that is finer, and one that is quicker.

    Neither is hopelessly behind. Where limbs are cut short, even one that daunts is told: it may
    keep them.
    """
    mine, found = chosen.figures, dict[str, Tried]()
    if mine is None:
        return found
    for one in search.ranked:
        other = one.figures
        if other is None or not one.like or one.soft or (one.daunting and not chosen.short):
            continue
        if score(one) < score(chosen) - _HOPELESS and not chosen.short:
            continue
        if other.crossings > _MORE * mine.crossings:
            found.setdefault("finer", one)
        elif max(other.hours or (0.0,)) < _LESS * max(mine.hours or (0.0,)):
            found.setdefault("quicker", one)
    return found


def shelf(
    search: Search, count: int, *, first: int | None = None, enough: float = np.inf
) -> Search:
    """Try designs of a model from coarse to fine, and as many beside these where few can be built.

    What is stated of the mesh is left open; what was tried for the same question is among them.

    Parameters
    ----------
    search : Search
    count : int
        How many designs are planned.
    first : int, optional
        How many of these are tried before others may be chosen; all if not given.
    enough : float
        Once so many can be built, nothing more is tried.
    """
    asked = search.asked.but(layout=None, remesh=None, refine=None)
    if asked != search.asked:
        search = Search(
            asked, search.given, progress=search.progress, executors=search.executors,
            told=search.told, looks=search.looks,
        )  # fmt: skip
    planned = variety(asked, search.model().mesh, 3 * count)[:count]
    search.run(near_rounds(search, planned, 2 * count, first=first, enough=enough))
    return search


def what_can_be_built(search: Search) -> str:
    """Return which designs can be built that are near to one that cannot, as lines of a message.

    Where none can be built, the nearest is tried larger, thinner and from card.
    """
    try:
        other = shelf(search, 2 * _MESHES, first=_MESHES, enough=_TOLD)
        why = why_few(other)
    except CannotMakeError:
        return ""
    ways = [one for one in other.tried if one.makeable]
    if not ways:
        return f"{why} fabweave guide mending says what else may help.\n"
    lines = [f"  {way.text}\n" for way in ways[:_TOLD]]
    return "These were tried, and can be built:\n" + "".join(lines)


def told(model: LoadedMesh, chosen: Tried, why: str) -> str:
    """Say on which mesh a model is woven, what that comes to, and why not on its own.

    Parameters
    ----------
    model : LoadedMesh
        As it comes.
    chosen : Tried
        On the mesh that it is woven on.
    why : str
        What its own mesh would need, or come to.
    """
    gone = len(parse_leave_out(chosen.design.mesh.leave_out).faces)
    left = agree(gone, "; {n} [face is|faces are] left open, where ribbons have no room")
    based = _BASED if chosen.design.pieces.base == "on" else ""
    alone = ". It does not stand by itself: leave it on a former (--former auto)"
    lacks = [f"; {lack}" for lack in map(lacking, ("quads", "tubes")) if lack]
    return (
        f"chosen: {chosen.brief}. {_own(model)} {why}; --remesh none keeps the mesh"
        f"{alone if chosen.soft else based}{left if gone else ''}{''.join(lacks)}"
    )


def _own(model: LoadedMesh) -> str:
    """Name the mesh of a model."""
    return f"The model's own {faces_text(model.mesh)}"


def needs(finding: BrokenRule) -> str:
    """Say what a mesh would need that breaks a rule.

    Examples
    --------
    >>> needs(BrokenRule("width", "warn", 0.21, 1.0, "mm", "A", 3, 17, None, (0, 0, 0), 50, 120))
    'would need strips of 0.2 mm'
    """
    length = f"{finding.value:.0f}" if finding.value >= 1.0 else f"{finding.value:.1g}"
    bent = "bent to a radius " if finding.rule == "bend" else ""
    return f"would need strips {bent}of {length} mm"
