"""Say in words how the joints of a job are made, and where not as they should be."""

from collections import Counter

import numpy as np

from fabweave.core.messages import agree
from fabweave.flat.joint.kinds import KINDS
from fabweave.flat.pieces import PieceSet
from fabweave.ribbon.measures import size_for


def joint_notes(piece_set: PieceSet, size_mm: float) -> list[str]:
    """Return what a maker should know of the joints: their kinds, and what would mend the rest.

    Parameters
    ----------
    piece_set : PieceSet
    size_mm : float
        Largest dimension of the object.
    """
    if not piece_set.joints:
        return []
    kinds = Counter((joint.kind.name, len(joint.holes)) for joint in piece_set.joints)
    parts = []
    for (name, holes), count in sorted(kinds.items(), key=lambda item: (-item[1], item[0])):
        fasteners = agree(holes, " with {n} fastener[|s]") + agree(count, "[| each]")
        parts.append(agree(count, "{n} " + KINDS[name].note) + (fasteners if holes else ""))
    note = "joints: " + "; ".join(parts)
    plan, rule = piece_set.plan, piece_set.plan.rule
    lost = [j.id for j in piece_set.joints if j.kind != rule.kind or len(j.holes) != rule.holes]
    if not lost:
        return [note]
    some = ", ".join(f"#{number}" for number in lost[:6]) + (" …" if len(lost) > 6 else "")
    note += f". {agree(len(lost), '{n} [is|are]')} too narrow or too slanted for {rule} ({some})"
    if np.any(plan.needed_mm > 0):
        worst = int(np.argmin(plan.room_mm / plan.needed_mm))
        least, needed = float(plan.room_mm[worst]), float(plan.needed_mm[worst])
        note += (
            f": the narrowest has {least:.1f} mm from its middle to an edge and needs "
            f"{needed:.1f} mm; with --size {size_for(least, needed, size_mm)}mm, all would be wide "
            "enough"
        )
    return [note]
