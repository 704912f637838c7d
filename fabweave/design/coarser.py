"""Find the coarser mesh on which a model can be built that is too fine as it comes."""

from collections.abc import Callable, Iterator

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.errors import FabweaveError, InputError
from fabweave.core.messages import agree
from fabweave.core.parallel.executors import finished
from fabweave.design.beside import density
from fabweave.design.search import STOPPED, Trials
from fabweave.design.variety import FEWEST, WIDTH_SHARE, name_of, two_digits
from fabweave.job.ask import complete_settings, lay_asked, load_asked, settle_grain
from fabweave.mesh.check import check_mesh, faces_text
from fabweave.mesh.leave_out import LeaveOut, leave_out, parse_leave_out
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.mesh.triangulate import surface_area
from fabweave.options.command import changed_options
from fabweave.options.settings import Settings
from fabweave.plan.grade import EASY_MM
from fabweave.plan.verdict import Verdict, excess, judge, refused
from fabweave.ribbon.lay import WovenObject, check_object, keep_clear
from fabweave.ribbon.rules.broken_rule import FAR, BrokenRule
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons
from fabweave.ribbon.settings import RibbonSettings
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.supplies import Supplies
from fabweave.weave.bunches import count_bodies

#: Ribbons of the finest mesh that is tried are about so wide, millimetres; each coarser one has so
#: many times fewer faces.
_FINEST_MM, _STEP = 8.5, 2
#: The finest mesh has no more faces than that: it is some evenings' work. A slender model has as
#: many as these, if ribbons are easy to handle.
_MOST, _SLENDER = 600, 240
#: So many triangles for a quad make ribbons of the same width.
_TRIANGLES = 0.6
#: What counts as much: so many reasons for care, to be off the model by such a share of the size in
#: the mean, strands that turn by so much at a crossing, and such a share of narrow ribbons, and
#: of faces that are left out.
_REASONS, _LOSS, _TURN_DEG, _NARROW, _GONE = 2, 0.003, 8.0, 0.1, 0.02
#: A sum of these with which no coarser mesh need be tried.
_FINE = 5.0
#: A model with so many handles, as this Euler number says, has cracks and tunnels of a scan.
_EULER = -4
#: Faces are left out so often, and no more than this share of them, or so many.
_OPENINGS, _FEW_FACES, _LEAST_OPENING = 2, 0.06, 8
#: What is farther off in the mean is hardly the model, however well it is built; a feature that is
#: farther away than the second share of the size is a limb that is lost.
_POOR, _LIMB = 0.01, 0.05
#: Rules that depend neither on joints nor on how much narrower ribbons get: where ribbons as wide
#: as asked break them, no plan of pieces helps.
_FORESEEN = {"width", "bend"}


@frozen_value
class Attempt:
    """A mesh that was tried for a model.

    Parameters
    ----------
    settings : Settings
        As asked, but for the options that make the mesh.
    loaded : LoadedMesh or None
        The mesh; None where it could not be made.
    verdict : Verdict
        Whether it can be built, as far as ribbons tell before pieces are planned.
    narrow : float
        The share of ribbons that are narrower than hands like.
    parts : int
        How many parts no thread joins.
    """

    settings: Settings
    loaded: LoadedMesh | None
    verdict: Verdict
    narrow: float = 0.0
    parts: int = 1

    @property
    def built(self) -> bool:
        """Whether it can be built, maybe with care."""
        return self.loaded is not None and not self.verdict.stops

    @property
    def loss(self) -> float:
        """How far it is from the model in the mean, as a share of the size."""
        like = self.loaded.likeness if self.loaded is not None else None
        return 0.0 if like is None else like.loss

    @property
    def limbs(self) -> int:
        """How many features of the model are far away: limbs, horns, ears."""
        like = self.loaded.likeness if self.loaded is not None else None
        return 0 if like is None else sum(x.lost_mm > _LIMB * like.size_mm for x in like.lost)

    @property
    def like(self) -> bool:
        """Whether it is like the model."""
        return self.loss <= _POOR and not self.limbs

    @property
    def text(self) -> str:
        """What it comes to, and what holds it back."""
        if self.loaded is None:
            return self.verdict.headline
        return f"about {self.loaded.mesh.n_corners // 2} crossings; {self.verdict.headline}"

    @property
    def rank(self) -> tuple[bool, float, int]:
        """What is better sorts first: what is makeable and like, else what wants less care.

        Care is counted in reasons, and what is lost of the model, strands that turn and narrow
        ribbons count, too.
        """
        good = self.verdict.level == "makeable" and self.like
        turn, faces = 0.0, 0
        if self.loaded is not None:
            turn, faces = self.loaded.turn_deg, self.loaded.mesh.n_faces
        gone = len(parse_leave_out(self.settings.mesh.leave_out).faces) / max(faces, 1)
        care = len(self.verdict.reasons) / _REASONS + self.limbs + self.loss / _LOSS + gone / _GONE
        return not good, care + turn / _TURN_DEG + self.narrow / _NARROW, faces


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


def foreseen(asked: Settings, loaded: LoadedMesh) -> list[BrokenRule]:
    """Find why a mesh obviously cannot be built, within a second or so for 20,000 triangles.

    Parameters
    ----------
    asked : Settings
    loaded : LoadedMesh
        The model as it comes.

    Returns
    -------
    list of BrokenRule
        The rules that are broken whatever its pieces are, the width first; none where it takes a
        plan of these to say.
    """
    if asked.ribbons.straight:
        return []  # it takes longer to say
    # How strands go over and under changes no width; a twill would be searched for long.
    plain = asked.but(pattern="plain") if asked.weave.pattern == "twill" else asked
    settings, supplies = complete_settings(plain)
    laid = lay_asked(loaded, settings, supplies)
    settings, supplies = settle_grain(laid, settings, supplies)
    check = check_along(laid, settings.ribbons, supplies)
    found = [one for one in check.findings if one.rule in _FORESEEN and excess([one]) > 1.0]
    return sorted(found, key=lambda one: one.rule != "width")


def check_along(laid: WovenObject, settings: RibbonSettings, supplies: Supplies) -> RibbonCheck:
    """Check each ribbon by itself, without a search for remedies: a moment's work."""
    return check_ribbons(
        laid.ribbons,
        laid.weave,
        laid.labels,
        thread_limits(supplies, laid.bunches, settings.clearance_mm),
        size_mm=laid.size_mm,
        depth=Depth.ALONG,
    )


def try_mesh(asked: Settings, given: PolyMesh | None = None) -> Attempt:
    """Make a mesh and lay ribbons on it: all that takes little time of what a job does.

    Where it cannot be built for a few places alone, the faces there are left out, twice at most.

    Parameters
    ----------
    asked : Settings
    given : PolyMesh, optional
        A mesh from memory.
    """
    attempt, hopeless = _try_once(asked, given)
    for _ in range(_OPENINGS):
        loaded = attempt.loaded
        if not hopeless or loaded is None:
            break
        # Faces are numbered as those of the whole mesh.
        left = parse_leave_out(attempt.settings.mesh.leave_out).faces
        whole = np.setdiff1d(np.arange(loaded.mesh.n_faces + len(left)), left)
        gone = sorted({*left, *whole[hopeless].tolist()})
        if len(gone) > max(_FEW_FACES * len(whole), _LEAST_OPENING):
            break
        opened = asked.but(leave_out=",".join(map(str, gone)))
        further, hopeless = _try_once(opened, given, loaded.remeshed)
        if further.loaded is None or further.parts > attempt.parts:
            # It cannot be opened there, or a limb would fall off.
            break
        attempt = further
    return attempt


def _try_once(
    asked: Settings, given: PolyMesh | None, remeshed: Remeshed | None = None
) -> tuple[Attempt, list[int]]:
    """Return what a mesh comes to, and the faces without which it may be built."""
    loaded = None
    try:
        settings, supplies = complete_settings(asked.but(effort="quick"))
        loaded = load_asked(settings, given_mesh=given, remeshed=remeshed)
        laid = lay_asked(loaded, settings, supplies)
        settings, supplies = settle_grain(laid, settings, supplies)
        laid = keep_clear(laid, settings.ribbons, supplies, np.zeros(0, dtype=np.int64))
        check = check_object(laid, settings.ribbons, supplies, depth=Depth.ALONG)
        if not any(finding.severity == "refuse" for finding in check.findings):
            check = check_object(laid, settings.ribbons, supplies, depth=Depth.NEAR)
    except FabweaveError as error:
        return Attempt(asked, loaded, refused(str(error))), []
    widths, parts = check.measured["width"].value, count_bodies(laid.weave.threads)
    verdict = judge(
        check.findings,
        narrowest_mm=float(widths.min(initial=np.inf)),
        bodies=parts,
        left_out=loaded.left_out,
    )
    attempt = Attempt(asked, loaded, verdict, float(np.mean(widths < EASY_MM)), parts)
    own = parse_leave_out(asked.mesh.leave_out)
    if not verdict.stops or own.diameters_mm or asked.weave.triaxial:
        return attempt, []
    return attempt, _hopeless_faces(laid, check, verdict)


def _hopeless_faces(laid: WovenObject, check: RibbonCheck, verdict: Verdict) -> list[int]:
    """Return the faces around the places that are far from what the rules want that stop it."""
    threads, half = laid.weave.threads, laid.halfedges
    passes = [np.zeros(0, dtype=np.int64)]
    for rule in {stop.rule for stop in verdict.stops} & check.measured.keys():
        measured = check.measured[rule]
        far = measured.margins < FAR
        passes += [measured.passes[far], measured.others[far]]
    there = np.concatenate(passes)
    edges = threads.crossing_halfedge[np.unique(threads.crossing[there[there >= 0]])]
    ends = np.concatenate([half.tail[edges], half.head[edges]])
    twins = half.twin[edges]
    beside = half.face[np.concatenate([edges, twins[twins >= 0]])]
    # Without the faces beside these edges, or without all at their ends, if that is a surface.
    for faces in (beside, half.face[np.isin(half.tail, ends)]):
        gone = np.unique(faces).tolist()
        try:
            leave_out(laid.mesh, LeaveOut((), tuple(gone)))
        except InputError:
            continue
        return gone
    return []


def has_coarser(model: LoadedMesh) -> bool:
    """Tell whether there are coarser meshes: a model of very few faces was drawn face by face."""
    return model.mesh.n_faces >= _STEP * FEWEST


class _Tries:
    """The meshes that were tried for a model, and what each came to."""

    def __init__(self, trials: Trials) -> None:
        self._trials = trials
        self._tried: dict[str, Attempt] = {}
        self._yielded: list[Attempt] = []
        self._rank: tuple[bool, bool, float, int] = (True, True, np.inf, 0)
        #: Whether Ctrl-C ended it.
        self.stopped = False

    def add(self, some: list[Settings]) -> None:
        """Try those that were not, and tell what is better than all before it."""
        new = {name_of(one, self._trials.asked): one for one in some}
        new = {name: one for name, one in new.items() if name not in self._tried}
        names, total = list(new), len(self._tried) + len(new)
        self._trials.progress("meshes", len(self._tried), total)
        found: dict[int, Attempt] = {}
        try:
            with self._trials.executors() as executor:
                tasks = [(one, self._trials.given) for one in new.values()]
                for at, attempt in finished(executor, try_mesh, tasks):
                    found[at] = attempt
                    rank = not (attempt.built and attempt.like), *attempt.rank
                    if attempt.loaded is not None and rank < self._rank:
                        self._rank = rank
                        self._trials.better(f"best so far: {names[at]}: {attempt.text}")
                    self._trials.progress("meshes", len(self._tried) + len(found), total)
        except KeyboardInterrupt:
            if not any(one.built for one in (*self._tried.values(), *found.values())):
                raise
            self.stopped = True
            self._trials.better(STOPPED)
        self._tried.update({names[at]: found[at] for at in sorted(found)})

    def take(self, least: Callable[[Attempt], bool]) -> list[Attempt]:
        """Return what can be built and was not taken before, the best first."""
        left = [
            one
            for one in self._tried.values()
            if one.built and one not in self._yielded and least(one)
        ]
        self._yielded.extend(left)
        return sorted(left, key=lambda one: one.rank)

    def made(self, way: str) -> bool:
        """Tell whether a way may make a mesh: one that failed to make any fails again."""
        known = [one for one in self._tried.values() if density(one.settings)[0] == way]
        return not known or any(one.loaded is not None for one in known)

    @property
    def none(self) -> bool:
        """Whether none could be made."""
        return all(one.loaded is None for one in self._tried.values())


def coarser_meshes(trials: Trials, model: LoadedMesh) -> Iterator[Attempt]:
    """Try coarser meshes for a model, round after round, and yield those that can be built.

    First quads and tubes of the finest mesh; of a model that runs through itself, or has several
    bodies or many handles, all wrapped as one. Then, as long as more are asked for, coarser ones,
    wrapped if none could be made at all, and triangles. What is like the model comes as soon as its
    round is done, the best first; the rest at last. Each round is chosen from what the one before
    came to, so the result is the same however many work at it. Ctrl-C ends the search with what
    it has, if any of that can be built.

    Parameters
    ----------
    trials : Trials
        What is stated there stays.
    model : LoadedMesh
        As it comes.
    """
    asked = trials.asked
    if not has_coarser(model):
        return
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
    tries = _Tries(trials)
    for at, some in enumerate(rounds):
        tries.add([mesh(*one) for one in some if tries.made(one[0])])
        if tries.stopped:
            break
        if bodies == "all" and tries.none:
            # A wrap closes cracks and cavities, which is no small change: only where it helps.
            bodies = "wrap"
            tries.add([mesh(*one) for one in some])
        yield from tries.take(lambda one: one.like and (at > 0 or one.rank[1] < _FINE))  # noqa: B023
    yield from tries.take(lambda _: True)


def told(asked: Settings, model: LoadedMesh, chosen: Attempt, why: str) -> str:
    """Say on which mesh a model is woven, and why not on its own.

    Parameters
    ----------
    asked : Settings
    model : LoadedMesh
        As it comes.
    chosen : Attempt
        The mesh that it is woven on.
    why : str
        What its own mesh would need, or that it cannot be built.
    """
    options = changed_options(chosen.settings, asked)
    own = f"the model's own {faces_text(model.mesh)}"
    gone = len(parse_leave_out(chosen.settings.mesh.leave_out).faces)
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
