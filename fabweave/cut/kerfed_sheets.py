"""Draw the sheets once more as a machine is to follow them: with kerf and micro-joints."""

from collections.abc import Sequence
from dataclasses import replace

from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.kerf import compensated
from fabweave.cut.micro_joints import MicroJoints, bridged

#: The folder of these sheets in a job's folder.
CUT_FOLDER = "cut"


def kerfed_sheets(
    drawings: Sequence[SheetDrawing], kerf_mm: float, micro_joints: MicroJoints | None
) -> tuple[SheetDrawing, ...]:
    """Return the sheets as they are to be cut; none where that is as they are drawn.

    Parameters
    ----------
    drawings : sequence of SheetDrawing
        Nominal.
    kerf_mm : float
        Width of the burnt line, or 0.
    micro_joints : MicroJoints or None

    Returns
    -------
    tuple of SheetDrawing
        Their names say what was done to them, as in ``sheet_01_kerf0.15mm_micro4x0.25mm``.

    Raises
    ------
    CannotMakeError
        If the kerf cannot be taken off (see ``compensated``).
    """
    if not kerf_mm and micro_joints is None:
        return ()
    words = [f"kerf{kerf_mm:g}mm"] if kerf_mm else []
    if micro_joints is not None:
        words.append(f"micro{micro_joints.count}x{micro_joints.width_mm:g}mm")
    result = []
    for drawing in drawings:
        kerfed = compensated(drawing, kerf_mm)
        if micro_joints is not None:
            kerfed = bridged(kerfed, micro_joints, kerf_mm=kerf_mm)
        result.append(replace(kerfed, name="_".join([drawing.name, *words])))
    return tuple(result)


def check_kerf(kerf_mm: float, gap_mm: float) -> None:
    """Raise InputError if cuts of pieces side by side would run into one another."""
    if kerf_mm and gap_mm < 2.0 * kerf_mm:
        raise InputError(
            f"pieces are {gap_mm:g} mm apart, but a kerf of {kerf_mm:g} mm needs twice its width "
            f"between them: use --gap {2.0 * kerf_mm:g}mm or more"
        )


def kerf_notes(
    drawings: Sequence[SheetDrawing],
    kerf_mm: float,
    micro_joints: MicroJoints | None,
    *,
    service: bool = False,
) -> tuple[str, ...]:
    """Return what a job's notes say of these sheets; nothing where there are none.

    ``service`` says that there are files for a service, too.
    """
    done = [f"compensation for a kerf of {kerf_mm:g} mm"] if kerf_mm else []
    if micro_joints is not None:
        done.append(f"micro-joints of {micro_joints.width_mm:g} mm in the outlines")
    if not done:
        return ()
    notes = [
        f"{CUT_FOLDER}/ holds the sheets to cut, with {' and '.join(done)}; the sheets in sheets/ "
        "are nominal"
    ]
    if service and kerf_mm:
        notes.append(
            "warning: cutting services compensate for the kerf themselves, so the files in "
            f"service/ are nominal; do not send a service the files in {CUT_FOLDER}/"
        )
    whole = [
        piece.piece_id
        for drawing in drawings
        for piece in drawing.pieces
        if micro_joints is not None
        and all(getattr(entity, "closed", True) for entity in piece.entities[-1:])
    ]
    if whole:
        notes.append(
            f"{agree(len(whole), '{n} piece[ has|s have]')} no micro-joints, because no side is "
            f"long and straight enough: {few_of(whole)}"
        )
    return tuple(notes)
