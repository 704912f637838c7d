"""Plan where threads are cut, so that every piece fits the stock, at the least predicted cost."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.automorphisms import EXACT
from fabweave.nest.container import Container, clear_rectangle, container_of
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import shape_of
from fabweave.nest.place.greedy import order_of_use
from fabweave.piece.brief import Brief
from fabweave.piece.development import Runs
from fabweave.piece.joint.holes import WANTED_SHARE, HoleRule
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.joint.planning import lap_beyond, laps_meeting
from fabweave.piece.settings import PieceSettings
from fabweave.piece.split.candidates import Bed, Candidates, list_candidates
from fabweave.piece.split.length_curve import (
    LENGTHS,
    Choice,
    SplitPlan,
    compare,
    compared_threads,
    foretell,
)
from fabweave.piece.split.preferences import (
    CUT_MM_S,
    KIND_PRICES,
    LIKE_PRICES,
    StockSheet,
    Workshop,
)
from fabweave.piece.split.repeats import Repeats, find_repeats, repeating, window_kinds
from fabweave.piece.split.row_filling import Rests
from fabweave.piece.split.splitting import choose_runs
from fabweave.piece.stock_fit import PIECE_ROWS, rough_nesting, sheet_price, strip_rests
from fabweave.ribbon.measures import ribbon_widths, thread_lengths
from fabweave.ribbon.project import Ribbons
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave
from fabweave.weave.symmetry import NEARLY, find_weave_symmetry
from fabweave.weave.weave_mesh import WovenMesh

#: The shortest of the lengths that are compared, in crossings.
_FEW_CROSSINGS = 6
#: A piece may be longer than its sheet if it bends: half a circle over a side is so many sides
#: long. What bends further is rare, and left to ``--max-length``.
_BENT = math.pi / 2
#: Strips from a roll are no longer if nobody says: two arms measure them, and draw them through
#: the weave; an estimate.
_REACH_MM = 2000.0
#: A strip that is this share shorter than a row fits in it, whatever is rounded.
_ROOM = 1e-3


def plan_pieces(
    ribbons: Ribbons,
    weave: Weave,
    labels: tuple[str, ...],
    brief: Brief,
    barred: Runs | None = None,
    *,
    bunches: IntArray | None = None,
    repeats: Repeats | None = None,
    earlier: SplitPlan | None = None,
) -> SplitPlan:
    """Split ribbons so that every piece fits the stock, at the least predicted cost.

    Without a greatest length in the settings, threads are cut to several for a trial, and the
    preferred one is taken; threads that cannot be cut so short get longer pieces.

    Parameters
    ----------
    ribbons, weave, labels
        The ribbons, who is on top, and the names of the threads.
    brief : Brief
        With several materials, every piece fits the stock of each.
    barred : Runs, optional
        Stretches that no piece may carry all of.
    bunches : (T,) int array, optional
        The bunch of each thread; needed where there are several supplies.
    repeats : Repeats, optional
        Which stretches repeat others and are to be cut alike.
    earlier : SplitPlan, optional
        A plan whose length is kept, when pieces have to be cut elsewhere; with its choices, of
        which that of the length is told anew.

    Raises
    ------
    CannotMakeError
        If a thread cannot be cut as asked.
    """
    settings, supplies, rule = brief.pieces, brief.supplies, parse_joint(brief.pieces.joint)
    # Long laps go on beyond the panels with which the pieces end that are measured here.
    beyond = lap_beyond(ribbons, weave, rule)
    bed, side = _bed(supplies, supplies.margin_mm + beyond)
    asked = settings.max_length_mm
    every = np.arange(weave.threads.n_threads)
    if supplies.rolls:
        longest = min(max(_REACH_MM, asked or 0.0), side)
    else:
        longest = max(_BENT * side, asked or 0.0)
    if repeats is not None and barred is not None:
        barred = repeats.spread(barred)
    # A hand weaver closes a ring with the strip that it began with; two fill rows better.
    whole = brief.ribbons.straight and (supplies.rolls or settings.prefer != "waste")
    candidates = list_candidates(ribbons, weave, bed, longest, every, barred=barred, whole=whole)
    room = room_for_joints(ribbons, weave, brief.rules)
    if bunches is None:
        bunches = np.zeros(weave.threads.n_threads, dtype=np.int64)
    rests = None
    if brief.ribbons.straight:
        bed = replace(bed, straight=True)
        # Of one width, strips have room nowhere if not everywhere.
        room = room if room is None or room.any() else None
        worth = PIECE_ROWS.get(settings.prefer)
        if worth is not None and _lie_in_rows(brief):
            wide, gap = float(ribbon_widths(ribbons).max()), supplies.gap_mm + 2 * beyond
            rests = strip_rests(supplies.of(bunches), _row_mm(bed, wide), gap, wide, worth)
    workshop = _workshop(supplies, bunches)
    likes = None
    if repeats is None and settings.kinds in LIKE_PRICES and (earlier is None or earlier.likes):
        found = window_kinds(candidates.course, candidates.sites, candidates.windows, weave.over)
        likes = found if earlier is not None or repeating(found) else None
    prices = KIND_PRICES if likes is None else LIKE_PRICES
    around = laps_meeting(weave, rule.kind.crossings)

    def cut(length: float, threads: IntArray | None = None, rests: Rests | None = rests) -> Runs:
        limit = np.inf if asked is None else max(asked, length) - 2 * beyond
        return choose_runs(
            candidates,
            weave,
            bed,
            labels,
            length - 2 * beyond,
            limit,
            room,
            threads,
            repeats=repeats,
            kind_price=prices[settings.kinds] or 0.0,
            likes=likes,
            around=around,
            rests=rests,
        )

    def told(length: float, runs: Runs) -> Choice:
        return foretell(ribbons, weave.threads, runs, length, workshop, bed)

    if earlier is not None:
        runs = cut(earlier.length_mm)
        chosen = told(earlier.length_mm, runs)
        choices = tuple(
            chosen if choice.length_mm == chosen.length_mm else choice for choice in earlier.choices
        )
        return replace(earlier, runs=runs, chosen=chosen, choices=choices)
    # What was asked for is cut first: what it is refused for, is said of it.
    as_asked = None if asked is None else cut(asked)
    some, scale = compared_threads(candidates.sites)
    lengths = _lengths(candidates, side, beyond)
    cuts = [cut(length, some, None) for length in lengths]

    def compared(number: int, bed: Bed = bed, *, full: bool = False) -> Choice:
        length, runs = lengths[number], cuts[number]
        return foretell(ribbons, weave.threads, runs, length, workshop, bed, scale, full=full)

    # What cannot be the best is not laid on sheets.
    bounded = all(len(kinds) == 1 for kinds in workshop.stock)
    best, choices = compare(
        len(cuts), settings.prefer, compared, partial(compared, bed=replace(bed, packed=None)),
        partial(compared, full=True) if bounded else None,
    )  # fmt: skip
    if asked is not None and as_asked is not None:
        return SplitPlan(as_asked, asked, choices, told(asked, as_asked), None, likes is not None)
    runs = cut(best.length_mm)
    chosen = best if best.exact and rests is None else told(best.length_mm, runs)
    return SplitPlan(runs, best.length_mm, choices, chosen, settings.prefer, likes is not None)


def object_repeats(woven: WovenMesh, settings: PieceSettings, supplies: Supplies) -> Repeats | None:
    """Return which stretches of threads repeat others and are to be cut alike; None if none are."""
    if KIND_PRICES[settings.kinds] is None:
        return None
    mesh, halfedges = woven.mesh, woven.halfedges
    for tolerance in (EXACT, NEARLY):
        symmetry = find_weave_symmetry(
            mesh, halfedges, woven.weave, tolerance=tolerance, reflections=False
        )
        if symmetry.group.order > 1:
            break
    repeats = find_repeats(symmetry, supplies.of(woven.bunches))
    return repeats if repeats.repeat else None


def _bed(supplies: Supplies, margin_mm: float) -> tuple[Bed, float]:
    """Return what pieces must fit on, and the longest side that is free on any stock."""
    rotations = parse_rotations(supplies.rotations)
    # Pieces are planned for rectangles; nesting may find more room beside a defect.
    clear = [
        [
            Container(clear_rectangle(area, supply.gap_mm), None, area.rotations)
            for area in (
                container_of(sheet, margin_mm, supply.gap_mm, rotations)
                for sheet in supplies.as_nested(supply.sheets)
            )
        ]
        for supply in supplies.each
    ]

    def fits(outline: FloatArray) -> bool:
        # A piece lies along its least rectangle.
        shape = shape_of(outline)[0]
        return all(any(fits_rectangle(shape, area) for area in areas) for areas in clear)

    sides = [max(max(area.size_mm) for area in areas) for areas in clear]
    if not min(sides) > 0.0:
        raise CannotMakeError(
            "between margin and defects, the sheets have no free rectangle for any piece; use a "
            "smaller margin or another sheet"
        )
    # Where angles are few, or sheets of several materials differ, each piece must be asked for.
    easy = rotations.step_deg is None and not supplies.several
    largest = [max((area.size_mm for area in areas), key=math.prod) for areas in clear]
    bed = Bed(
        fits,
        tuple(area.size_mm for area in clear[0]) if easy else (),
        supplies.gap_mm,
        min(largest, key=math.prod),
        rough_nesting(supplies),
    )
    return bed, min(sides)


def _lie_in_rows(brief: Brief) -> bool:
    """Return whether straight strips are laid in rows, of which something may be left over."""
    square = parse_joint(brief.pieces.joint).kind.shape is None
    sheets = brief.supplies.sheets
    return square and not any(sheet.is_roll or sheet.outline or sheet.defects for sheet in sheets)


def _row_mm(bed: Bed, wide_mm: float) -> float:
    """Return the length of the longest row in which strips may lie."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    sides = bed.free_mm or ()
    fitting = [side for side in sides if bed.fits(corners * ((1.0 - _ROOM) * side, wide_mm))]
    return max(fitting, default=bed.side_mm)


def _lengths(candidates: Candidates, side_mm: float, beyond_mm: float) -> list[float]:
    """Return the lengths to compare, ascending, from some crossings to the longest that fits.

    They have two digits, so that people can ask for one of them.
    """
    ribbons, length = candidates.ribbons, candidates.windows.length_mm
    pitch = float(thread_lengths(ribbons).sum()) / max(len(ribbons.entry), 1)
    longest = float(length[candidates.fresh()].max(initial=0.0)) or side_mm
    least = min(_FEW_CROSSINGS * pitch, longest)
    return sorted(
        {
            _two_digits(length + 2 * beyond_mm)
            for length in np.geomspace(least, longest, LENGTHS).tolist()
        }
    )


def _two_digits(length_mm: float) -> float:
    """Return a length, rounded up to two digits.

    Examples
    --------
    >>> _two_digits(583.2), _two_digits(7.01), _two_digits(120.0)
    (590.0, 7.1, 120.0)
    """
    digits = 1 - math.floor(math.log10(length_mm))
    step = 10.0**-digits
    return round(math.ceil(length_mm / step - 1e-9) * step, max(digits, 0))


def _workshop(supplies: Supplies, bunches: IntArray) -> Workshop:
    """Return what pieces are cut from, and what that costs as far as it is known."""
    return Workshop(
        tuple(
            tuple(
                StockSheet(
                    sheet.area_mm2,
                    sheet_price(sheet, supply.material),
                    sheet.quantity,
                )
                for sheet in (supply.sheets[number] for number in order_of_use(supply.sheets))
            )
            for supply in supplies.each
        ),
        np.array([np.mean(material.speed_mm_s or CUT_MM_S) for material in supplies.materials]),
        supplies.of(bunches),
    )


def room_for_joints(ribbons: Ribbons, weave: Weave, rules: Sequence[HoleRule]) -> BoolArray | None:
    """Return at which crossings both ribbons are wide enough for a joint's hole, (X,).

    That hole is the largest for which nine crossings of ten are; None if no holes are wanted.
    """
    if not rules:
        return None
    width = ribbon_widths(ribbons)
    half = (width[ribbons.entry] + width[ribbons.entry + 1]) / 4
    room = np.full(weave.threads.n_crossings, np.inf)
    np.minimum.at(room, weave.threads.crossing, half)
    wide = [room >= rule.edge_mm for rule in rules]
    return next((roomy for roomy in wide if roomy.mean() >= WANTED_SHARE), wide[-1])
