"""Choose the mesh on which a job is woven: the model's own, or a coarser one of its surface."""

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from fabweave.core.errors import CannotMakeError, TooFineError
from fabweave.core.messages import agree
from fabweave.design.beside import SOFT, density, near_rounds, why_few
from fabweave.design.search import Search
from fabweave.design.variety import FEWEST, WIDTH_SHARE, is_free, two_digits, variety
from fabweave.design.wishes import score
from fabweave.job.stations import Stations
from fabweave.mesh.check import check_mesh, faces_text
from fabweave.mesh.leave_out import parse_leave_out
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.triangulate import surface_area
from fabweave.options.command import changed_options
from fabweave.options.settings import Settings
from fabweave.plan.grade import EASY_MM
from fabweave.plan.verdict import NotMakeableError, judge
from fabweave.ribbon.rules.broken_rule import BrokenRule

#: Ribbons of the finest mesh that is tried are about so wide, millimetres; each coarser one has so
#: many times fewer faces.
_FINEST_MM, _STEP = 8.5, 2
#: The finest mesh has no more faces than that: it is some evenings' work. A slender model has as
#: many as these, if ribbons are easy to handle.
_MOST, _SLENDER = 600, 240
#: So many triangles for a quad make ribbons of the same width.
_TRIANGLES = 0.6
#: A score at which no coarser mesh need be tried, in the first round and in those after it.
_FINE, _GOOD = 7.5, 5.0
#: A model with so many handles, as this Euler number says, has cracks and tunnels of a scan.
_EULER = -4
#: So many of the coarser meshes are planned closely, the best first, until one can be built.
_CLOSELY = 4
#: Of what cannot be built, so many designs are tried at first, and so many that can are told.
_MESHES, _TOLD = 4, 3


class Choice(NamedTuple):
    """A job, on the mesh that was chosen for it, and why; empty where all is as it was asked."""

    job: Stations
    why: str = ""


def choose_mesh(
    job: Stations, search: Search, *, most_planned: float = np.inf, advise: bool = True
) -> Choice:
    """Return a job on the mesh on which it can be built: as it is asked for, or on a coarser one.

    A coarser mesh is taken where the mesh is left to fabweave (see :func:`is_free`): the best of
    those that are tried.

    Parameters
    ----------
    job : Stations
    search : Search
        For designs of that job.
    most_planned : float
        Of more crossings, no pieces are planned to see whether it can be built.
    advise : bool
        Whether designs are tried where it cannot be built, so that the message names some.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If it cannot be built as asked; the message tells what was tried instead, and can be built.
    """
    asked = job.asked
    refused: CannotMakeError
    free = is_free(asked)
    stops = _foreseen(job) if free else []
    if stops:
        refused = NotMakeableError(judge(stops, narrowest_mm=np.inf))
        why = needs(stops[0])
    elif job.n_crossings > most_planned:
        return Choice(job)
    else:
        try:
            _ = job.buildable
        except (NotMakeableError, TooFineError) as error:
            refused, why = error, f"cannot be built ({error.reason})"
        else:
            return Choice(job)
    if not (free and has_coarser(job.loaded)):
        ways = what_can_be_built(search) if advise else ""
    else:
        search.run(mesh_rounds(search, job.loaded))
        for one in islice(search.ranked, _CLOSELY):
            taken = job.instead(one.design).know(loaded=one.loaded)
            try:
                _ = taken.buildable
            except (NotMakeableError, TooFineError):
                continue
            return Choice(taken, told(asked, job.loaded, one.design, why))
        ways = _none_of_them(asked)
    if isinstance(refused, NotMakeableError):
        raise NotMakeableError(refused.verdict, ways)
    raise CannotMakeError(f"{refused}\n{ways.rstrip()}") from None


def _foreseen(job: Stations) -> list[BrokenRule]:
    """Find why a mesh obviously cannot be built, within a second or so for 20,000 triangles."""
    asked = job.asked
    if asked.ribbons.straight:
        return []  # it takes longer to say
    # How strands go over and under changes no width; a twill would be searched for long.
    plain = job.instead(asked.but(pattern="plain")) if asked.weave.pattern == "twill" else job
    found = plain.foreseen
    job.know(loaded=plain.loaded)
    return found


def has_coarser(model: LoadedMesh) -> bool:
    """Tell whether there are coarser meshes: a model of very few faces was drawn face by face."""
    return model.mesh.n_faces >= _STEP * FEWEST


def mesh_rounds(search: Search, model: LoadedMesh) -> Iterator[list[Settings]]:
    """Yield coarser meshes for a model, round after round, until one is good.

    First quads and tubes of the finest mesh; of a model that runs through itself, or has several
    bodies or many handles, all wrapped as one. Then coarser ones, wrapped if none could be made at
    all, and triangles.

    Parameters
    ----------
    search : Search
    model : LoadedMesh
        As it comes.
    """
    asked = search.asked
    most = min(_MOST, model.mesh.n_faces / _STEP)
    area = surface_area(model.mesh)
    finest, slender = (area / (mm / WIDTH_SHARE) ** 2 for mm in (_FINEST_MM, EASY_MM))
    finest = min(most, max(finest, min(slender, _SLENDER)))
    wanted = () if asked.weave.pattern in ("kagome", "triaxial") else ("quads", "tubes")
    ways = [way for way in wanted if not lacking(way)] or ["triangles"]
    kind = ways[0]
    bodies = asked.mesh.bodies
    report = check_mesh(model.mesh)
    if bodies == "all" and (model.clashes or report.n_components > 1 or report.euler < _EULER):
        bodies = "wrap"

    def mesh(kind: str, step: float) -> Settings:
        share = _TRIANGLES if kind == "triangles" else 1.0
        number = two_digits(share * max(finest / _STEP**step, FEWEST))
        return asked.but(remesh=f"{kind}:{number}", bodies=bodies)

    rounds = [
        [(way, 0.0) for way in ways],
        [(way, 1.0) for way in ways],
        [(kind, 2.0), *((way, 0.5) for way in ways)],
        [("triangles", 0.0), ("triangles", 1.0), (kind, 3.0)],
    ]
    for at, some in enumerate(rounds):
        yield [mesh(*one) for one in some if _may_make(search, one[0])]
        if bodies == "all" and all(one.loaded is None for one in search.tried):
            # A wrap closes cracks and cavities, which is no small change: only where it helps.
            bodies = "wrap"
            yield [mesh(*one) for one in some]
        best = next(iter(search.ranked), None)
        if best is not None and best.like and score(best) >= (_GOOD if at else _FINE):
            return


def _may_make(search: Search, way: str) -> bool:
    """Tell whether a way may make a mesh: one that failed to make any fails again."""
    known = [one for one in search.tried if density(one.design)[0] == way]
    return not known or any(one.loaded is not None for one in known)


def shelf(search: Search, count: int, *, first: int | None = None) -> Search:
    """Try designs of a model from coarse to fine, and as many beside these where few can be built.

    What is stated of the mesh is left open; what was tried for the same question is among them.

    Parameters
    ----------
    search : Search
    count : int
        How many designs are planned.
    first : int, optional
        How many of these are tried before others may be chosen; all if not given.
    """
    asked = search.asked.but(layout=None, remesh=None, refine=None)
    if asked != search.asked:
        search = Search(
            asked, search.given, progress=search.progress, executors=search.executors,
            told=search.told, looks=search.looks,
        )  # fmt: skip
    planned = variety(asked, search.model().mesh, 3 * count)[:count]
    search.run(near_rounds(search, planned, 2 * count, first=first))
    return search


def what_can_be_built(search: Search) -> str:
    """Return which designs can be built that are near to one that cannot, as lines of a message.

    Where none can be built, the nearest is tried larger, thinner and from card.
    """
    try:
        other = shelf(search, 2 * _MESHES, first=_MESHES)
        why = why_few(other)
    except CannotMakeError:
        return ""
    ways = [one for one in other.tried if one.makeable]
    if not ways:
        return f"{why} fabweave guide mending says what else may help.\n"
    lines = [f"  {way.text}\n" for way in ways[:_TOLD]]
    return "These were tried, and can be built:\n" + "".join(lines)


def told(asked: Settings, model: LoadedMesh, chosen: Settings, why: str) -> str:
    """Say on which mesh a model is woven, and why not on its own.

    Parameters
    ----------
    asked : Settings
    model : LoadedMesh
        As it comes.
    chosen : Settings
        With the mesh that it is woven on.
    why : str
        What its own mesh would need, or that it cannot be built.
    """
    options = changed_options(chosen, asked)
    own = f"the model's own {faces_text(model.mesh)}"
    gone = len(parse_leave_out(chosen.mesh.leave_out).faces)
    left = agree(gone, "; {n} [face is|faces are] left open, where ribbons have no room")
    lacks = [f"; {lack}" for lack in map(lacking, ("quads", "tubes")) if lack]
    return (
        f"woven on a coarser mesh ({options}), as {own} {why}; --remesh none keeps the mesh"
        f"{left if gone else ''}{''.join(lacks)}"
    )


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


def _none_of_them(settings: Settings) -> str:
    """Return what may help where no coarser mesh can be built."""
    softer = "" if settings.stock.material == SOFT else f", or --material {SOFT},"
    return (
        "Coarser meshes of quads, tubes and triangles were tried, and cannot be built either. A "
        f"larger --size{softer} leaves more room.\n"
    )
