"""Choose the design that comes nearest to what a person wishes for, and say why."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import closest_first, shown
from fabweave.core.units import parse_length
from fabweave.design.tried import Tried
from fabweave.job.figures import Figures
from fabweave.plan.grade import BEST

#: Nobody wishes for more of anything.
MOST_WISHED = 1e9


@dataclass(frozen=True)
class Wishes:
    """What a design should come to; None where nothing is wished.

    Parameters
    ----------
    pieces : int or None
        About so many pieces.
    ribbon_mm : float or None
        Ribbons about so wide, in the middle of them.
    hours : float or None
        No more hours of assembly, at worst.
    sheets : int or None
        No more sheets.
    budget : float or None
        No more money for hardware and whole sheets, at worst.
    likeness_mm : float or None
        The surface is nowhere farther from the model.
    form_mm : float or None
        No crossing goes farther from its place when the object is let go.
    """

    pieces: int | None = None
    ribbon_mm: float | None = None
    hours: float | None = None
    sheets: int | None = None
    budget: float | None = None
    likeness_mm: float | None = None
    form_mm: float | None = None

    def __bool__(self) -> bool:
        """Return whether anything is wished."""
        return any(getattr(self, field.name) is not None for field in fields(self))


#: A lesson: what is wished for it, and the options of the job, where others are not said.
SCHOOL, SCHOOL_WISHES = "school", ("pieces=20", "hours=0.75")
SCHOOL_OPTIONS = {"profile": "school", "fastener": "mini-brad"}


def _parts(text: str) -> list[str]:
    return [part for part in text.replace(" ", "").split(",") if part]


def goal_options(goal: str) -> dict[str, str]:
    """Return the options that a goal asks for, besides its wishes.

    Examples
    --------
    >>> goal_options("school, ribbon=20mm")["profile"], goal_options("hours=5")
    ('school', {})
    """
    return dict(SCHOOL_OPTIONS) if SCHOOL in _parts(goal) else {}


#: Where nothing is wished for.
NO_WISHES = Wishes()


def parse_wishes(text: str, pieces: int | None = None) -> Wishes:
    """Return the wishes that a text states.

    Parameters
    ----------
    text : str
        Such as ``"ribbon=15mm,hours=5"``; lengths have units. ``school`` wishes for a lesson.
    pieces : int, optional
        How many pieces, if that is wished apart from the text.

    Raises
    ------
    InputError
        If it wishes for what is no wish, or for a number that nobody can mean.

    Examples
    --------
    >>> wishes = parse_wishes("ribbon=1.5cm,hours=5", 150)
    >>> wishes.pieces, wishes.ribbon_mm, wishes.hours
    (150, 15.0, 5.0)
    >>> parse_wishes("school,hours=1").hours, parse_wishes("school").pieces
    (1.0, 20)
    """
    fields_of = {field.name.removesuffix("_mm"): field.name for field in fields(Wishes)}
    found: dict[str, Any] = {} if pieces is None else {"pieces": pieces}
    parts = _parts(text)
    said = {*found, *(name.partition("=")[0] for name in parts)}
    if SCHOOL in said:
        parts.remove(SCHOOL)
        parts += [one for one in SCHOOL_WISHES if one.partition("=")[0] not in said]
    for part in parts:
        name, _, value = part.partition("=")
        if name not in fields_of:
            known = ", ".join(f"{one}=..." for one in closest_first(name, list(fields_of)))
            raise InputError(f"there is no goal {shown(name)}: write {known}, with commas between")
        field = fields_of[name]
        try:
            number = parse_length(value, what=name) if field.endswith("_mm") else float(value)
        except ValueError as error:  # an InputError is a ValueError, too
            raise InputError(f"the goal {part}: {error}") from error
        if not 0.0 < number <= MOST_WISHED or (name in ("pieces", "sheets") and number % 1.0):
            raise InputError(f"the goal {part} is no number that anybody can wish for")
        found[field] = int(number) if name in ("pieces", "sheets") else number
    return Wishes(**found)


#: What is wished for: whether it is a limit, and how it is said of a design.
_KINDS = {
    "pieces": (False, "{:.0f} pieces"),
    "ribbon_mm": (False, "ribbons of {:.1f} mm"),
    "hours": (True, "up to {:.1f} hours"),
    "sheets": (True, "{:.0f} sheets"),
    "budget": (True, "a price of up to {:.2f}"),
    "likeness_mm": (True, "{:.1f} mm from the model"),
    "form_mm": (True, "{:.1f} mm out of form when it is let go"),
}
#: What is a limit weighs so much more than what is aimed at.
_LIMIT = 4.0
#: An aim is met within this share, as a logarithm.
_MET = math.log(1.25)
#: So many hours are an evening's work, at worst; a point goes for twice as many, and for such a
#: share of the faces that are left open.
EVENING_H, _OPENED = 6.0, 0.04
#: The rank of what cannot be built.
UNBUILT = (8, math.inf)
#: A design of this grade or more is good: of those, one is taken where no wish can be met.
GOOD = 5.0


def come_to(figures: Figures) -> dict[str, float | None]:
    """Return what a design comes to at worst, by the names of the wishes; None if not known."""
    return {
        "pieces": float(figures.pieces),
        "ribbon_mm": figures.median_mm,
        "hours": None if figures.hours is None else max(figures.hours),
        "sheets": float(figures.sheets),
        "budget": None if figures.price is None else max(figures.price),
        "likeness_mm": figures.likeness_mm or 0.0,
        "form_mm": figures.form_mm,
    }


def misses(figures: Figures, wishes: Wishes) -> dict[str, float]:
    """Return by how much a design misses each wish: the logarithm of its value over the wished one.

    A limit is missed only where it is passed. What is not known of a design counts as twice the
    limit.
    """
    found = {}
    for name, value in come_to(figures).items():
        wished = getattr(wishes, name)
        if wished is None:
            continue
        ratio = math.log(max(2.0 * wished if value is None else value, 1e-9) / max(wished, 1e-9))
        found[name] = max(ratio, 0.0) if _KINDS[name][0] else ratio
    return found


def distance(tried: Tried, wishes: Wishes) -> float:
    """Return how far a design is from what is wished: 0 if it meets all, infinite if unbuildable.

    What is aimed at counts by its ratio, whichever way; a limit counts only where it is passed,
    and four times as much. What is not known of a design counts as twice the limit.
    """
    if tried.figures is None or not tried.makeable:
        return math.inf
    total = sum(
        (_LIMIT if _KINDS[name][0] else 1.0) * abs(ratio)
        for name, ratio in misses(tried.figures, wishes).items()
    )
    # Of two that are equally near, the one that wants less care.
    return total + 0.01 * len(tried.verdict.reasons)


def rank(tried: Tried, wishes: Wishes) -> tuple[int, float]:
    """Return what sorts designs, the best for some wishes first.

    First come those that meet all wishes, good ones before others. Where a wish cannot be met, what
    is nearest is often what is worst: then all that are good come before those that are not. Where
    nothing is wished for, those that are like the model and do not daunt go first, and of these
    those that stand by themselves; then the score counts.
    """
    if not wishes and (tried.makeable or tried.soft):
        return 4 * tried.daunting + 2 * (not tried.like) + tried.soft, -score(tried)
    away = distance(tried, wishes)
    if tried.figures is None or math.isinf(away):
        return UNBUILT
    met = all(
        ratio <= 0.0 if _KINDS[name][0] else abs(ratio) <= _MET
        for name, ratio in misses(tried.figures, wishes).items()
    )
    good = tried.figures.grade is None or tried.figures.grade >= GOOD
    return 2 * (not met) + (not good), away


def score(tried: Tried) -> float:
    """Return how good a design is that can be built, beside others of its model.

    It is the grade that the maker reads; faces that are left open, and more than an evening's work,
    take points from it.
    """
    figures = tried.figures
    if figures is None or figures.points_lost is None:
        return 0.0
    hours = max(figures.hours or (0.0,))
    late = math.log2(max(hours / EVENING_H, 1.0))
    return BEST - figures.points_lost - tried.opened / _OPENED - late


def values_text(figures: Figures, wishes: Wishes) -> str:
    """Say what a design comes to of all that is wished, and what was wished."""
    parts = []
    for name, value in come_to(figures).items():
        wished = getattr(wishes, name)
        if wished is not None:
            limit, text = _KINDS[name]
            shown = "unknown" if value is None else text.format(value)
            if name == "form_mm" and figures.collapses:
                shown = "collapses when it is let go"
            how = "at most" if limit else "about"
            parts.append(f"{shown} ({how} {wished:g} wished)")
    return ", ".join(parts)


def choose(candidates: Sequence[Tried], wishes: Wishes) -> tuple[Tried, str]:
    """Choose the design that is best for what is wished, as `rank` says, and say why.

    Raises
    ------
    CannotMakeError
        If none can be built; the message says why not, of each.
    """
    best = min(candidates, key=lambda tried: rank(tried, wishes), default=None)
    if best is None or best.figures is None or not best.makeable:
        reasons = "\n".join(
            f"  {tried.name}: {tried.verdict.reasons[0].text}"
            for tried in candidates
            if tried.verdict.reasons
        )
        raise CannotMakeError(
            f"none of {len(candidates)} designs can be built:\n{reasons}\n"
            "A larger --size, or a softer --material, leaves more room"
        )
    built = sum(tried.makeable for tried in candidates)
    return best, (
        f"chosen of {len(candidates)} designs, {built} of them buildable: {best.name}, with "
        f"{values_text(best.figures, wishes)}"
    )
