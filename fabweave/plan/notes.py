"""Say in words what a maker should know about a job before cutting it."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh
from fabweave.piece.joint.fastening import TIGHT_COVER
from fabweave.piece.joint.holes import WANTED_SHARE, HoleRule
from fabweave.piece.joint.kinds import KINDS as JOINT_KINDS
from fabweave.piece.pieces import PieceSet
from fabweave.plan.bom import bill_of_materials, bom_notes
from fabweave.ribbon.measures import size_for
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.labels.texts import KINDS, WANTED_HEIGHT_MM
from fabweave.weave.pattern import Weave

#: What labels tell, in the order of ``KINDS``.
_KIND_NAMES = (
    "piece ids",
    "arrows",
    "joint numbers",
    "names of mates at joints",
    "partners at crossings",
    "signs for over and under",
)


def all_notes(
    mesh: PolyMesh,
    weave: Weave,
    ribbons: Ribbons,
    piece_set: PieceSet,
    marks: Sequence[Marks],
    rules: Sequence[HoleRule],
    *,
    seen_mm: float | None = None,
    hardware: str | None = None,
) -> list[str]:
    """Return every note, the weave first, then ribbons, holes and letters.

    ``seen_mm`` is how much of the engraving is seen on the woven object, if it was to be hidden;
    ``hardware`` the sort of fastener that was asked for.
    """
    size = float(np.ptp(mesh.vertices, axis=0).max())
    notes = _weave_notes(weave)
    notes.append(_width_note(measure_bends(ribbons).width_mm))
    notes += _hole_notes(piece_set, rules, size)
    notes += joint_notes(piece_set, size, fastened=bool(rules))
    notes += bom_notes(bill_of_materials(piece_set, hardware))
    notes += _label_notes(marks)
    if seen_mm is not None:
        notes.append(_seen_note(marks, seen_mm))
    return notes


def _seen_note(marks: Sequence[Marks], seen_mm: float) -> str:
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


def fastening_notes(chosen: str, asked: str | None, piece_set: PieceSet) -> list[str]:
    """Say which crossings take a fastener, if not all that have room, and why.

    Parameters
    ----------
    chosen : str
        What ``--fasten`` says or would say.
    asked : str or None
        What it was asked to be; None if that was left to fabweave.
    piece_set : PieceSet
    """
    if chosen == "all" or (asked is None and piece_set.fastened.all()):
        return []
    note = f"fasteners ({chosen}): at {int(np.count_nonzero(piece_set.fastened))} of "
    note += agree(len(piece_set.fastened), "{n} [crossing|crossings]")
    if chosen == "loose":
        note += (
            f". Where ribbons cover {TIGHT_COVER:.0%} of the way between crossings or more, the "
            "weave holds itself, and only joints and ends are fastened. The less they cover, the "
            "more crossings are. --fasten joints and --fasten all decide otherwise"
        )
    return [note]


def hanging_notes(piece_set: PieceSet, weave: Weave, labels: Sequence[str]) -> list[str]:
    """Name the crossings that carry something, and what goes through them.

    Parameters
    ----------
    piece_set : PieceSet
    weave : Weave
    labels : sequence of str
        Names of the threads.
    """
    if piece_set.hanging is None or not piece_set.hanging.any():
        return []
    threads = weave.threads
    named, lacking = [], []
    for crossing in np.flatnonzero(piece_set.hanging).tolist():
        passes = np.flatnonzero(threads.crossing == crossing)
        upper, lower = threads.thread_of_pass[passes[np.argsort(~weave.over[passes])]].tolist()
        named.append(f"{crossing} ({labels[upper]} over {labels[lower]})")
        if not piece_set.fastened[crossing]:
            lacking.append(str(crossing))
    holes = sorted(set(piece_set.size_mm[piece_set.hanging & piece_set.fastened].tolist()))
    note = agree(len(named), "hang: crossing[|s] ") + ", ".join(named)
    note += agree(
        len(named), " [takes|take] what it hangs from or stands on, through [a hole|holes]"
    )
    note += f" of {' or '.join(f'{hole:g}' for hole in holes or [0.0])} mm"
    if lacking:
        note += f"; there is no room for one at {', '.join(lacking)}: choose others, or a smaller "
        note += "--fastener"
    return [note]


def _weave_notes(weave: Weave) -> list[str]:
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
            len(threads.turn_pass), "; threads turn back at {n} boundary [edge|edges]"
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
    return notes


def _width_note(width: FloatArray) -> str:
    """Say how wide ribbons are: once, if they are as wide everywhere."""
    least, most = f"{width.min():.1f}", f"{width.max():.1f}"
    if least == most:
        return f"ribbons: {least} mm wide everywhere"
    return f"ribbons: {least} to {most} mm wide, with a median of {np.median(width):.1f} mm"


def _hole_notes(piece_set: PieceSet, rules: Sequence[HoleRule], size: float) -> list[str]:
    """Say which hole was chosen, where there is none, and at what size there would be."""
    if not rules:
        return ["holes: none, as requested"]
    room = piece_set.room_mm[np.isfinite(piece_set.room_mm)]
    if not len(room):
        return ["holes: none, because every crossing has a joint without fasteners"]
    tenth = float(np.quantile(room, 1 - WANTED_SHARE, method="lower"))
    least = float(room.min())
    if not piece_set.rules:
        rule = rules[-1]
        return [
            f"holes: no crossing has room for a hole of {rule.hole_mm:g} mm, which needs "
            f"{rule.edge_mm:.1f} mm to every edge. "
            f"With --size {size_for(tenth, rule.edge_mm, size)}mm, nine in ten crossings would "
            f"have room; with {size_for(least, rule.edge_mm, size)}mm, all of them"
        ]
    rule, sizes = piece_set.rules[-1], piece_set.size_mm[np.isfinite(piece_set.room_mm)]
    narrow = int(np.count_nonzero(np.isnan(sizes)))
    all_of_them = agree(len(room), "{n} [crossing|crossings]")
    all_of_them += " that are to have one" * (len(room) < len(piece_set.room_mm))
    counts = [(rule.hole_mm, np.count_nonzero(sizes == rule.hole_mm)) for rule in piece_set.rules]
    note = "holes: " + ", ".join(f"{hole:g} mm at {count}" for hole, count in counts)
    note += f" of {all_of_them}"
    if narrow == 0:
        return [note]
    note += (
        f"; {agree(narrow, '{n} [is|are]')} too narrow (the narrowest has {least:.2f} mm from "
        f"centre to edge and needs {rule.edge_mm:.2f} mm) and get{'s' * (narrow == 1)} none; "
        "joints there are glued. "
        f"With --size {size_for(least, rule.edge_mm, size)}mm, all would have room"
    )
    if narrow > (1 - WANTED_SHARE) * len(room):
        note += f"; with {size_for(tenth, rule.edge_mm, size)}mm, nine in ten"
    return [note]


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


def _label_notes(marks: Sequence[Marks]) -> list[str]:
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
    return [f"letters: {'; '.join(notes)} (crossing_map.json lists them)"] if notes else []
