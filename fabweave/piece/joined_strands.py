"""Lay the ribbons of a job as they are cut: with room for laps where its pieces are joined."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import CannotMakeError, TooFineError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.symmetry import EXACT
from fabweave.nest.container import Container, clear_rectangle, container_of
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import shape_of
from fabweave.nest.place.greedy import order_of_use
from fabweave.piece.brief import Brief
from fabweave.piece.development import Runs, unfold_runs
from fabweave.piece.joint.ends import CutStrips, cut_strips, overlapping_ends
from fabweave.piece.joint.holes import WANTED_SHARE, HoleRule
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.joint.planning import JointPlan, lap_beyond, laps_meeting, plan_joints
from fabweave.piece.on_stock import (
    PIECE_ROWS,
    outlines_with_place,
    rough_nesting,
    sheet_price,
    strip_rests,
)
from fabweave.piece.outline import resting_frame, simple, strip_outlines
from fabweave.piece.settings import PieceSettings
from fabweave.piece.split.candidates import Bed, Candidates, list_candidates
from fabweave.piece.split.length_curve import (
    LENGTHS,
    Choice,
    SplitPlan,
    compared_threads,
    foretell,
    preferred,
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
from fabweave.piece.split.splitting import choose_runs, find_self_crossing, joined_runs, some_runs
from fabweave.ribbon.lay import (
    WovenObject,
    check_object,
    keep_clear,
    lay_ribbons,
    require_stiffness,
    require_wide,
    resized,
)
from fabweave.ribbon.measures import ribbon_widths, thread_lengths
from fabweave.ribbon.project import Ribbons, require_no_loop
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.ribbon_limits import by_thread, thread_limits
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

    def told(length: float, runs: Runs, scale: float = 1.0) -> Choice:
        return foretell(ribbons, weave.threads, runs, length, workshop, bed, scale)

    if earlier is not None:
        runs = cut(earlier.length_mm)
        chosen = told(earlier.length_mm, runs)
        choices = tuple(
            chosen if choice.length_mm == chosen.length_mm else choice for choice in earlier.choices
        )
        return replace(earlier, runs=runs, chosen=chosen, choices=choices)
    # What was asked for is cut first: what it is refused for, is said of it.
    as_asked = None if asked is None else cut(asked)
    some = compared_threads(candidates.sites)
    count = np.diff(candidates.sites.offsets)
    scale = float(count.sum() / max(count[some].sum(), 1))
    lengths = _lengths(candidates, side, beyond)
    choices = tuple(told(length, cut(length, some, None), scale) for length in lengths)
    if asked is not None and as_asked is not None:
        return SplitPlan(as_asked, asked, choices, told(asked, as_asked), None, likes is not None)
    best = preferred(choices, settings.prefer)
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


#: So much narrower is the next width tried where a ribbon crosses itself.
_STEP = 0.9


@frozen_value
class JoinedObject:
    """A woven object with its ribbons as they are cut, where they are joined, and their strips.

    No strip crosses itself, and each has a place on an empty sheet.
    """

    woven: WovenObject
    plan: SplitPlan
    joints: JointPlan
    cut: CutStrips
    repeats: Repeats | None


def split_object(
    woven: WovenObject,
    brief: Brief,
    progress: Progress = no_progress,
) -> JoinedObject:
    """Plan where threads are cut into pieces and how these are joined; lay the ribbons for that.

    Pieces are planned on ribbons as wide as asked. Those that cross themselves when they are cut
    as planned, or no longer fit on a sheet, are cut elsewhere; where that does not help against a
    crossing, their ribbons get narrower.

    Parameters
    ----------
    woven : WovenObject
        With ribbons as wide as asked.
    brief : Brief
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    supplies = brief.supplies
    require_wide(woven)
    require_no_loop(woven.weave.threads, woven.halfedges)
    require_stiffness(woven, brief.ribbons, supplies)
    progress("pieces", 0, 1)
    ribbons, weave, labels = woven.ribbons, woven.weave, woven.labels
    repeats = object_repeats(woven, brief.pieces, supplies)
    plan = plan_pieces(ribbons, weave, labels, brief, bunches=woven.bunches, repeats=repeats)
    even = repeats is not None or plan.likes
    barred, most, apart = None, None, None
    lapped = np.zeros(0, dtype=np.int64)
    while True:
        laid, joints = _with_joints(woven, plan.runs, brief, even, most, lapped)
        cut = cut_strips(laid.ribbons, weave, plan.runs, joints)
        crossing = find_self_crossing(laid.ribbons, weave, plan.runs, cut.outlines)
        if not crossing:
            crowded = overlapping_ends(cut, joints)
            if len(crowded):
                lapped = np.union1d(lapped, crowded)
                continue
            # Where angles are few, it matters how a piece lies.
            resting = [
                resting_frame(outline, *ends).apply(outline)
                for outline, ends in zip(cut.outlines, cut.ends, strict=True)
            ]
            placed = outlines_with_place(
                resting, plan.runs.thread, supplies, woven.bunches, brief.effort
            )
            if placed.all():
                # With laps elsewhere they bend otherwise, maybe just too much now.
                require_stiffness(laid, brief.ribbons, supplies)
                return JoinedObject(replace(laid, apart=apart), plan, joints, cut, repeats)
            whole = some_runs(plan.runs, ~placed)
        elif len(crossing.kinks.thread):
            # Loops are looked for afterwards: with a kink, a thread seems to have more of them.
            most = _narrower(laid, crossing.kinks, brief)
            if apart is None and laid.narrowed is not None:
                apart = laid.narrowed.factor
            continue
        else:
            whole = crossing.loops
        # No piece carried what is barred already, so that there is an end.
        barred = whole if barred is None else joined_runs(barred, whole)
        try:
            plan = plan_pieces(
                ribbons,
                weave,
                labels,
                brief,
                barred,
                bunches=woven.bunches,
                repeats=repeats,
                earlier=plan,
            )
        except CannotMakeError as error:
            if crossing:
                raise
            raise CannotMakeError(_too_large(woven, whole, cut.outlines, placed)) from error


def laid_at_size(
    woven: WovenObject,
    brief: Brief,
    size_mm: float,
    repeats: Repeats | None,
) -> WovenObject:
    """Plan the pieces of an object at another size, and lay its ribbons for them, as a job does.

    Where no pieces can be planned (none may fit the sheet), there is room for a lap everywhere.

    Parameters
    ----------
    woven : WovenObject
        As it is.
    brief
        As for :func:`split_object`.
    size_mm : float
        The largest dimension that it gets.
    repeats : Repeats or None
        Which stretches repeat others, as at any size.
    """
    other = resized(woven, size_mm)
    thickness = brief.supplies.thickness_mm(other.bunches)
    ribbons = lay_ribbons(other.source, other.weave, brief.ribbons, thickness)
    try:
        plan = plan_pieces(
            ribbons,
            other.weave,
            other.labels,
            brief,
            bunches=other.bunches,
            repeats=repeats,
        )
        laid = replace(other, ribbons=ribbons)
        even = repeats is not None or plan.likes
        return _with_joints(laid, plan.runs, brief, even)[0]
    except CannotMakeError:
        return keep_clear(other, brief.ribbons, brief.supplies)


def check_joined(
    woven: WovenObject,
    brief: Brief,
    repeats: Repeats | None,
    depth: Depth = Depth.SEARCHED,
) -> RibbonCheck:
    """Check the ribbons of an object, and confirm the sizes that are proposed on what is made.

    ``repeats`` are those of :class:`JoinedObject`: which stretches are cut alike at any size.
    """
    return check_object(
        woven,
        brief.ribbons,
        brief.supplies,
        lambda size: laid_at_size(woven, brief, size, repeats),
        depth,
    )


def _with_joints(
    woven: WovenObject,
    runs: Runs,
    brief: Brief,
    even: bool,
    most: FloatArray | None = None,
    lapped: IntArray | None = None,
) -> tuple[WovenObject, JointPlan]:
    """Plan the joints, and lay the ribbons again with room for laps where they are.

    Where pieces are to repeat, ``even``, there is room for a lap everywhere: else a piece would
    differ from its like by the joints of the strands that it crosses.

    If the width is left to fabweave, they are no wider than by factors ``most`` at each pass. At
    the crossings ``lapped``, pieces lap whatever is asked.
    """
    rule = parse_joint(brief.pieces.joint)
    thickness = brief.supplies.thickness_mm(woven.bunches)
    if even:
        woven = keep_clear(woven, brief.ribbons, brief.supplies, None, most)
        return woven, plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped)
    laps = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped).laps
    while True:
        woven = keep_clear(woven, brief.ribbons, brief.supplies, laps, most)
        joints = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped)
        # Panels keep their shape when the strands move apart; but where ribbons were narrowed,
        # there may be room for nothing but a lap.
        more = np.setdiff1d(joints.laps, laps)
        if not len(more):
            return woven, joints
        laps = np.concatenate((laps, more))


def _narrower(woven: WovenObject, kinks: Runs, brief: Brief) -> FloatArray:
    """Return factors on the width at each pass with which some stretches do not cross themselves.

    Raises
    ------
    TooFineError
        If ribbons must not be narrower, or would be too narrow to be handled.
    """
    narrowed, threads = woven.narrowed, woven.weave.threads
    if narrowed is None:
        raise _kinked(woven, kinks, "a smaller --width, or none")
    # The panels stay wide enough to be handled. What lies in a sharp bend between them gets wider
    # with narrower panels, not narrower.
    entry, factor = woven.ribbons.entry, narrowed.factor.copy()
    widths = ribbon_widths(woven.ribbons)
    width = np.minimum(widths[entry], widths[entry + 1])
    limits = thread_limits(brief.supplies, woven.bunches, brief.ribbons.clearance_mm)
    floor = factor * by_thread(limits.width_mm, threads.thread_of_pass) / np.maximum(width, 1e-9)
    thickness = brief.supplies.thickness_mm(woven.bunches)
    while len(kinks.thread):
        ends = np.stack((kinks.first, kinks.last)) % threads.lengths[kinks.thread]
        passes = threads.offsets[kinks.thread] + ends
        stuck = np.asarray(np.all(factor[passes] <= floor[passes], axis=0))
        if stuck.any():
            raise _kinked(woven, some_runs(kinks, stuck), "a larger --size")
        passes = np.unique(passes)
        factor[passes] = np.maximum(_STEP * factor[passes], np.minimum(floor, factor)[passes])
        ribbons = lay_ribbons(
            woven.source, woven.weave, brief.ribbons, thickness, woven.laps, factor
        )
        kinks = some_runs(kinks, ~simple(strip_outlines(unfold_runs(ribbons, kinks))))
    return factor


def _too_large(
    woven: WovenObject, runs: Runs, outlines: Sequence[FloatArray], placed: BoolArray
) -> str:
    """Say which pieces fit on no sheet as they are cut, though they did as they were planned."""
    shapes = [shape_of(outlines[piece])[0] for piece in np.flatnonzero(~placed).tolist()]
    pieces = [
        f"{woven.labels[thread]} from its crossing {first} to its crossing "
        f"{last % woven.weave.threads.lengths[thread]} ({shape.length_mm:.1f} × "
        f"{shape.width_mm:.1f} mm)"
        for (thread, first, last), shape in zip(runs.rows, shapes, strict=True)
    ]
    return (
        agree(len(pieces), "{n} piece[ fits|s fit] on no sheet with [its|their] laps, and ")
        + agree(len(pieces), "[its thread|their threads] can be cut nowhere else: ")
        + f"{few_of(pieces, 4)}; a larger --sheet, a smaller --margin, a smaller --size or a "
        "shorter lap (--joint rivet,lap=20mm) would help"
    )


def _kinked(woven: WovenObject, kinks: Runs, remedy: str) -> TooFineError:
    """Say which stretches of threads would cross themselves however they are cut."""
    threads = woven.weave.threads
    places = []
    for thread, first, last in kinks.rows:
        ends = np.array([first, last]) % threads.lengths[thread]
        centre = woven.ribbons.centre[threads.crossing[threads.offsets[thread] + ends]].mean(axis=0)
        place = ", ".join(f"{value:.0f}" for value in centre)
        places.append(
            f"{woven.labels[thread]} between its crossings {ends[0]} and {ends[1]}, near ({place})"
        )
    text = (
        "{n} stretch[|es] of thread bend[s|] so sharply that [it|they] would cross "
        "[itself|themselves] when unfolded: "
    )
    return TooFineError(
        f"{agree(len(kinks.thread), text)}{few_of(places, 4)} mm",
        f"{remedy} would help, or a smoother mesh (--fair, --refine or --remesh)",
    )
