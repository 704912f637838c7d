"""Say in words what a maker should know about a job before cutting it."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.former.plates import Laid
from fabweave.former.sheets import former_notes
from fabweave.job.planned import PlannedJob
from fabweave.job.ribbon_report import ribbon_notes
from fabweave.nest.layout import Layout
from fabweave.piece.grain import grain_notes
from fabweave.piece.joint.holes import WANTED_SHARE, HoleRule
from fabweave.piece.joint.kinds import KINDS as JOINT_KINDS
from fabweave.piece.pieces import PieceSet
from fabweave.piece.split.length_curve import splitting_reason
from fabweave.plan.bill_of_materials import BillOfMaterials, buy_lines
from fabweave.plan.crossing_map import StepRecord
from fabweave.plan.order import Order
from fabweave.plan.steps import order_note
from fabweave.ribbon.lay import width_notes
from fabweave.ribbon.measures import size_for
from fabweave.ribbon.rules.bends import measure_bends
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.kerf import kerf_notes
from fabweave.sheet.labels.lettering import lettered
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.labels.texts import KINDS, WANTED_HEIGHT_MM
from fabweave.sheet.rim_sheets import rim_notes
from fabweave.sheet.sheet_notes import left_out_notes
from fabweave.show.paper_limits import paper_notes
from fabweave.stock.rotations import parse_rotations
from fabweave.weave.pattern import Weave

#: What is moved by less than this is as it was.
_TOLD_MM = 1e-3
#: What labels tell, in the order of ``KINDS``.
_KIND_NAMES = (
    "piece ids",
    "arrows",
    "steps",
    "joint numbers",
    "names of mates at joints",
    "partners at crossings",
    "signs for over and under",
)


def job_notes(
    planned: PlannedJob,
    layout: Layout,
    marks: Sequence[Marks],
    order: Order,
    steps: Sequence[StepRecord],
    bill: BillOfMaterials,
    drawings: Sequence[SheetDrawing],
    kerfed: Sequence[SheetDrawing],
    seen_mm: float | None = None,
    beside: Sequence[SheetDrawing] = (),
    laid: Laid | None = None,
) -> tuple[Note, ...]:
    """Return the notes on mesh, weave, ribbons, pieces, order, layout and drawings of a job."""
    settings, woven, pieces = planned.settings, planned.woven, planned.piece_set
    plan, rolls = planned.split_plan, planned.supplies.rolls
    reason = splitting_reason(plan.chosen.record(), plan.prefer, len(plan.choices))
    return (
        *woven.notes,
        *fastening_notes(planned.fasten, settings.pieces.fasten, pieces),
        *_weave_notes(woven.weave),
        Note("ribbons", _width_text(measure_bends(woven.ribbons).width_mm), detail=True),
        Note("holes", _hole_text(pieces, planned.rules, woven.size_mm), detail=True),
        *(
            Note("joints", text, detail=True)
            for text in joint_notes(pieces, woven.size_mm, fastened=bool(planned.rules))
        ),
        *(Note("buy", f"buy: {text}", detail=True) for _, text in buy_lines(bill)),
        *([] if rolls else _label_notes(marks)),
        *([] if rolls else _title_notes(woven.title)),
        *([] if seen_mm is None else [Note("engraving", _seen_text(marks, seen_mm), detail=True)]),
        *rim_notes(pieces.rings, planned.supplies.materials[0]),
        *former_notes(laid),
        *hanging_notes(pieces, woven.weave, woven.labels, holed=bool(planned.rules)),
        Note("pieces", f"pieces: {reason}", detail=True),
        *_fit_notes(pieces),
        *_spare_notes(planned),
        *width_notes(woven, settings.ribbons, planned.supplies),
        *ribbon_notes(planned.check, planned.supplies.materials),
        # Strips from a roll lie along its grain, whatever bends ask for.
        *(
            []
            if rolls
            else grain_notes(
                woven.ribbons,
                planned.check.limits,
                planned.supplies.materials,
                parse_rotations(settings.stock.rotations),
            )
        ),
        order_note(order, steps, bill.clips),
        *Note.each("layout", layout.notes),
        *left_out_notes((*drawings, *beside)),
        *kerf_notes(
            kerfed,
            settings.machine.kerf_mm,
            settings.machine.micro_joints,
            service=settings.machine.profile == "service",
            common=settings.common_cuts and not rolls,
        ),
        *paper_notes(woven.weave.threads.n_crossings, len(steps)),
    )


def _seen_text(marks: Sequence[Marks], seen_mm: float) -> str:
    """Say how much of the engraving is seen on the woven object, and why."""
    shown = sum(bool(piece_marks.seen) for piece_marks in marks)
    if not shown:
        return "engraving: none of it is seen when it is woven"
    return (
        f"engraving: {seen_mm:.1f} mm of it are seen when it is woven: "
        + agree(shown, "{n} [id has|ids have] no room under a strand. ")
        + "A larger --size or wider ribbons (--width) would make room; --label-side inside "
        "engraves the other face"
    )


def fastening_notes(chosen: str, asked: str | None, piece_set: PieceSet) -> list[Note]:
    """Say which crossings take a fastener, if not all that have room, and why.

    Parameters
    ----------
    chosen : str
        What ``--fasten`` says or would say.
    asked : str or None
        What it was asked to be; None if that was left to fabweave.
    piece_set : PieceSet
    """
    if piece_set.glued:
        text = "glue every crossing as soon as its second strand lies, and clip it till that sets"
        return [Note("fasteners", text)]
    if chosen == "all" or (asked is None and piece_set.fastened.all()):
        return []
    note = f"fasteners ({chosen}): at {int(np.count_nonzero(piece_set.fastened))} of "
    note += agree(len(piece_set.fastened), "{n} [crossing|crossings]")
    few = (
        "Joints and ends take one, and as few others as keep the form. --fasten joints and "
        "--fasten all decide otherwise"
    )
    return [Note("fasteners", note, few if chosen.startswith("form") else "")]


#: Why a crossing that carries something has no hole, and what to do.
_NO_HOLES = "the job has none: leave out --fasten none and --fastener none"
_JOINED = "the joint there has no fastener: choose other crossings, or --joint rivet"
_NARROW = "there is no room: choose other crossings, or a smaller --fastener"


def hanging_notes(
    piece_set: PieceSet, weave: Weave, labels: Sequence[str], *, holed: bool
) -> list[Note]:
    """Name the crossings that carry something, and what goes through them, or why nothing can.

    Parameters
    ----------
    piece_set : PieceSet
    weave : Weave
    labels : sequence of str
        Names of the threads.
    holed : bool
        Whether there are to be holes at all.
    """
    if piece_set.hanging is None or not piece_set.hanging.any():
        return []
    threads = weave.threads
    named: list[str] = []
    lacking: dict[str, list[int]] = {}
    for crossing in np.flatnonzero(piece_set.hanging).tolist():
        passes = np.flatnonzero(threads.crossing == crossing)
        upper, lower = threads.thread_of_pass[passes[np.argsort(~weave.over[passes])]].tolist()
        named.append(f"{crossing} ({labels[upper]} over {labels[lower]})")
        if not piece_set.fastened[crossing]:
            joined = bool(np.isinf(piece_set.room_mm[crossing]))
            why = (_JOINED if joined else _NARROW) if holed else _NO_HOLES
            lacking.setdefault(why, []).append(crossing)
    holes = sorted(set(piece_set.size_mm[piece_set.hanging & piece_set.fastened].tolist()))
    rule = "base" if piece_set.tied else "hang"
    what = "the wire of the base" if piece_set.tied else "what it hangs from or stands on"
    # Those of a base are named on its board.
    which = f"{len(named)} " if piece_set.tied else ""
    note = agree(len(named), f"{rule}: {which}crossing[|s]")
    note += "" if piece_set.tied else f" {', '.join(named)}"
    note += agree(len(named), f" [takes|take] {what}")
    if holes:
        note += agree(len(named), ", through [a hole|holes]")
        note += f" of {' or '.join(f'{hole:g}' for hole in holes)} mm"
    for why, there in lacking.items():
        note += f"; there is no hole at {few_of(there)}, as {why}"
    return [Note(rule, note)]


def _weave_notes(weave: Weave) -> list[Note]:
    """Count threads and crossings; say which threads there is nothing to weave with."""
    threads = weave.threads
    count = int(np.count_nonzero(threads.woven))
    rings = int(np.count_nonzero(threads.closed & threads.woven))
    notes = [
        f"weave: {weave.pattern}, {agree(count, '{n} [thread|threads]')} "
        f"({rings} closed, {count - rings} open), {agree(threads.n_crossings, '{n} crossing[|s]')}"
    ]
    if len(threads.turn_pass):
        notes[0] += agree(
            len(threads.turn_pass),
            "; threads turn back at {n} boundary [edge|edges] (--boundary end leaves their ends)",
        )
    for closed, what in (
        (False, "cut[s|] a corner between two boundary edges"),
        (True, "run[s|] round a face that shares no edge"),
    ):
        empty = int(np.count_nonzero(~threads.woven & (threads.closed == closed)))
        if empty:
            notes.append(
                agree(empty, f"{{n}} thread[|s] {what}, cross[es|] nothing, and [is|are] left out")
            )
    return Note.each("weave", notes)


def _width_text(width: FloatArray) -> str:
    """Say how wide ribbons are: once, if they are as wide everywhere."""
    least, most = f"{width.min():.1f}", f"{width.max():.1f}"
    if least == most:
        return f"ribbons: {least} mm wide everywhere"
    return f"ribbons: {least} to {most} mm wide, with a median of {np.median(width):.1f} mm"


def _hole_text(piece_set: PieceSet, rules: Sequence[HoleRule], size: float) -> str:
    """Say which hole was chosen, where there is none, and at what size there would be."""
    if not rules:
        return "holes: none, as requested"
    room = piece_set.room_mm[np.isfinite(piece_set.room_mm)]
    if not len(room):
        return "holes: none, because every crossing has a joint without fasteners"
    tenth = float(np.quantile(room, 1 - WANTED_SHARE, method="lower"))
    least = float(room.min())
    if not piece_set.rules:
        rule = rules[-1]
        return (
            f"holes: no crossing has room for a hole of {rule.hole_mm:g} mm, which needs "
            f"{rule.edge_mm:.1f} mm to every edge. "
            f"With --size {size_for(tenth, rule.edge_mm, size)}mm, nine in ten crossings would "
            f"have room; with {size_for(least, rule.edge_mm, size)}mm, all of them"
        )
    rule, sizes = piece_set.rules[-1], piece_set.size_mm[np.isfinite(piece_set.room_mm)]
    narrow = int(np.count_nonzero(np.isnan(sizes)))
    all_of_them = agree(len(room), "{n} [crossing|crossings]")
    all_of_them += " that are to have one" * (len(room) < len(piece_set.room_mm))
    counts = [(rule.hole_mm, np.count_nonzero(sizes == rule.hole_mm)) for rule in piece_set.rules]
    note = "holes: " + ", ".join(f"{hole:g} mm at {count}" for hole, count in counts)
    note += f" of {all_of_them}"
    if narrow == 0:
        return note
    note += (
        f"; {agree(narrow, '{n} [is|are]')} too narrow (the narrowest has {least:.2f} mm from "
        f"centre to edge and needs {rule.edge_mm:.2f} mm) and get{'s' * (narrow == 1)} none; "
        "joints there are glued. "
        f"With --size {size_for(least, rule.edge_mm, size)}mm, all would have room"
    )
    if narrow > (1 - WANTED_SHARE) * len(room):
        note += f"; with {size_for(tenth, rule.edge_mm, size)}mm, nine in ten"
    return note


def joint_notes(piece_set: PieceSet, size_mm: float, *, fastened: bool = True) -> list[str]:
    """Return what a maker should know of the joints: their kinds, and what would mend the rest.

    Parameters
    ----------
    piece_set : PieceSet
    size_mm : float
        Largest dimension of the object.
    fastened : bool
        Whether there are to be holes at all.
    """
    if not piece_set.joints:
        return []
    kinds = Counter((joint.kind.name, len(joint.holes)) for joint in piece_set.joints)
    parts = []
    for (name, holes), count in sorted(kinds.items(), key=lambda item: (-item[1], item[0])):
        fasteners = agree(holes, " with {n} fastener[|s]") + agree(count, "[| each]")
        parts.append(agree(count, "{n} " + JOINT_KINDS[name].note) + (fasteners if holes else ""))
    note = "joints: " + "; ".join(parts)
    plan, rule = piece_set.plan, piece_set.plan.rule
    lost = [j.id for j in piece_set.joints if j.kind != rule.kind or len(j.holes) != rule.holes]
    # What was to have no fastener lacks no room for it.
    idle = not fastened or bool(
        np.all(np.isinf([piece_set.room_mm[j.crossing] for j in piece_set.joints]))
    )
    if not lost or (idle and rule.kind.most_fasteners):
        return [note]
    some = ", ".join(f"#{number}" for number in lost[:6]) + (" …" if len(lost) > 6 else "")
    if rule.kind.crossings > 1:
        lack = agree(len(lost), "{n} [has|have] not enough crossings without another joint")
        return [f"{note}. {lack} ({some}): longer pieces (--max-length) have fewer joints"]
    note += f". {agree(len(lost), '{n} [is|are]')} too narrow or too slanted for {rule} ({some})"
    other = plan.where(lambda kind: kind != rule.kind)
    if rule.lap_mm is not None and np.any(other & (plan.room_mm >= plan.needed_mm)):
        note += f": laps of {rule.lap_mm:g} mm leave too little; without lap= there is more room"
    elif np.any((plan.room_mm > 0) & (plan.room_mm < plan.needed_mm)) and plan.room_mm.min() > 0:
        worst = int(np.argmin(plan.room_mm / plan.needed_mm))
        least, needed = float(plan.room_mm[worst]), float(plan.needed_mm[worst])
        note += (
            f": the narrowest has {least:.1f} mm from its middle to an edge and needs "
            f"{needed:.1f} mm; with --size {size_for(least, needed, size_mm)}mm, all would be wide "
            "enough"
        )
    elif other.any():
        note += ": the thread crosses them askew, or bends sharply beside them"
    return [note]


def _title_notes(title: str) -> list[Note]:
    """Say what sheets do not show of a title."""
    missing = "".join(dict.fromkeys(sign for sign in title if sign.strip() and not lettered(sign)))
    if not missing:
        return []
    told = f"title: sheets are lettered without {missing}; manual and pages show the whole title"
    return [Note("title", told)]


def _label_notes(marks: Sequence[Marks]) -> list[Note]:
    """Count the letters that are small or found no room."""
    names = dict(zip(KINDS, _KIND_NAMES, strict=True))
    dropped = Counter(missing.kind for piece_marks in marks for missing in piece_marks.dropped)
    placed = Counter(
        kind for piece_marks in marks for label in piece_marks.labels for kind in label.kinds
    )
    small = Counter(
        kind
        for piece_marks in marks
        for label in piece_marks.labels
        for kind in label.kinds
        if label.height_mm < WANTED_HEIGHT_MM
    )
    notes = []
    for kind, name in names.items():
        total = dropped[kind] + placed[kind]
        troubles = [
            agree(count, f"{{n}} {trouble}")
            for count, trouble in (
                (small[kind], f"[is|are] smaller than {WANTED_HEIGHT_MM:g} mm"),
                (dropped[kind], "had no room"),
            )
            if count
        ]
        if troubles:
            notes.append(f"of {total} {name}, {' and '.join(troubles)}")
    told = f"letters: {'; '.join(notes)} (crossing_map.json lists them)"
    return [Note("letters", told, detail=True)] if notes else []


def _fit_notes(pieces: PieceSet) -> list[Note]:
    """Say how far pieces were moved to be equal to others, if it was more than rounding."""
    fitted = pieces.fitted_mm[pieces.fitted_mm > _TOLD_MM]
    if not len(fitted):
        return []
    note = agree(
        len(fitted), "kinds: {n} [piece was|pieces were] made equal to others, from which "
    )
    note += agree(len(fitted), "[it differs|they differ]") + f" by up to {fitted.max():.3f} mm: "
    note += "less than the play of fasteners in their holes"
    return [Note("kinds", note, detail=True)]


def _spare_notes(planned: PlannedJob) -> list[Note]:
    """Say how many spares there are, and how they are told from the pieces."""
    spares, kinds = len(planned.spared), planned.piece_set.kinds.count
    if not spares:
        return []
    some = planned.to_cut[-spares].id
    note = agree(spares, "spares: {n} [piece is|pieces are] cut besides, ")
    note += (
        f"for {agree(kinds, '{n} kind[|s]')} ({planned.settings.pieces.spares}); {some} is a spare "
    )
    note += "of " + some[: some.rindex("S")] + ", and of all pieces of its kind"
    many = 2 * spares > len(planned.kinds) and planned.settings.pieces.kinds != "fewest"
    fewer = "Few pieces repeat: --kinds fewest may ask for fewer spares" if many else ""
    return [Note("spares", note, fewer)]
