"""Mark pieces: guides at glued joints, and labels where there is room."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.piece.congruence import Kinds, motion_onto, moved_by
from fabweave.piece.piece import Piece, find_owners
from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.labels.placement import CLEAR_MM, Spot, covered_rooms, covers_of, find_spots
from fabweave.sheet.labels.texts import Label, Missing, Wish, kind_wishes, spare_wishes, wishes


@frozen_value
class Marks:
    """What is engraved on a piece, in its own coordinates, and what found no room."""

    labels: tuple[Label, ...]
    ticks: tuple[FloatArray, ...]
    dropped: tuple[Missing, ...]

    @property
    def seen(self) -> tuple[Label, ...]:
        """The labels that are not hidden."""
        return tuple(label for label in self.labels if not label.hidden)


def mark_pieces(
    pieces: Sequence[Piece],
    n_crossings: int,
    labels: str = "full",
    side: str = "outside",
    kinds: Kinds | None = None,
) -> tuple[Marks, ...]:
    """Engrave every piece.

    Labels read along the thread; one that finds no clear place is made smaller, then shortened,
    and dropped at last, the least important first. Glued joints have their guides. Where labels
    are to be hidden, all stands where strands cover it, but for ids that find no room there, and
    guides are left out that are not covered.

    Parameters
    ----------
    pieces : sequence of Piece
    n_crossings : int
        Of the whole job.
    labels : str
        One of :data:`fabweave.sheet.labels.texts.LABELS`.
    side : str
        The face that is engraved and read, ``"outside"`` or ``"inside"``: on the inside letters
        are mirrored in the piece's coordinates, in which the outside is seen. Nothing that is
        engraved there need be covered to be hidden.
    kinds : Kinds, optional
        Which pieces are the same; needed where only that is told.

    Returns
    -------
    tuple of Marks
        One for each piece.
    """
    if not pieces or labels == "none":
        return (Marks((), (), ()),) * len(pieces)
    if labels == "kinds":
        if kinds is None:
            raise ValueError("labels that tell kinds want to know them")
        return _mark_kinds(pieces, kinds, mirrored=side == "inside")
    if labels == "hidden" and side == "inside":
        labels = "brief"
    owners = find_owners(pieces, n_crossings)
    begins = {piece.start_joint: piece.id for piece in pieces}
    ends = {piece.end_joint: piece.id for piece in pieces}
    wanted = [
        list(
            wishes(
                piece,
                [pieces[other].id for other in owners.partners(piece)],
                (ends.get(piece.start_joint), begins.get(piece.end_joint)),
                labels,
            )
        )
        for piece in pieces
    ]
    ticked = _inside(pieces, hidden=labels == "hidden")
    spots = find_spots(pieces, ticked, wanted)
    return tuple(
        _marks(piece_wishes, piece_spots, ticks, mirrored=side == "inside")
        for piece_wishes, piece_spots, ticks in zip(wanted, spots, ticked, strict=True)
    )


def mark_spares(
    spares: Sequence[Piece], originals: Sequence[Marks], labels: str, side: str = "outside"
) -> tuple[Marks, ...]:
    """Engrave spares: their ids alone, or where kinds are told, what their originals bear.

    Parameters
    ----------
    spares : sequence of Piece
    originals : sequence of Marks
        For each spare, those of the piece that it is a copy of.
    labels, side : str
        As for :func:`mark_pieces`.
    """
    if not spares or labels in ("kinds", "none"):
        return tuple(originals)
    mirrored = side == "inside"
    wanted = [
        list(spare_wishes(spare.id, hidden=labels == "hidden" and not mirrored)) for spare in spares
    ]
    ticks = [marks.ticks for marks in originals]
    return tuple(
        _marks(*each, mirrored=mirrored)
        for each in zip(wanted, find_spots(spares, ticks, wanted), ticks, strict=True)
    )


def _mark_kinds(pieces: Sequence[Piece], kinds: Kinds, *, mirrored: bool) -> tuple[Marks, ...]:
    """Engrave the first piece of each kind, and all others at the same places."""
    first = kinds.first
    leaders = [pieces[at] for at in first.tolist()]
    ticked = _inside(pieces, hidden=not mirrored)
    leading = [ticked[at] for at in first.tolist()]
    wanted = [list(kind_wishes(kind + 1, hidden=not mirrored)) for kind in range(len(first))]
    spots = find_spots(leaders, leading, wanted)
    marked = [
        _marks(wishes_of_kind, spots_of_kind, (), mirrored=mirrored)
        for wishes_of_kind, spots_of_kind in zip(wanted, spots, strict=True)
    ]
    result = []
    for at, (piece, kind) in enumerate(zip(pieces, (kinds.number - 1).tolist(), strict=True)):
        turn, shift = motion_onto(piece, leaders[kind], backwards=bool(kinds.turned[at]))
        labels = marked[kind].labels
        if at != first[kind]:
            labels = tuple(_carried(label, turn.conjugate(), shift) for label in labels)
        result.append(Marks(labels, ticked[at], marked[kind].dropped))
    return tuple(result)


def _carried(label: Label, turn: complex, shift: complex) -> Label:
    """Return a label on a piece that a turn, undone here, and a shift take onto the label's."""

    def back(points: FloatArray) -> FloatArray:
        return moved_by(points - (shift.real, shift.imag), turn, 0.0)

    return replace(
        label,
        centre=back(label.centre),
        rotation_deg=label.rotation_deg + float(np.degrees(np.angle(turn))),
        strokes=tuple(back(stroke) for stroke in label.strokes),
    )


def _marks(
    wanted: Sequence[Wish],
    spots: Sequence[Spot | None],
    ticks: tuple[FloatArray, ...],
    *,
    mirrored: bool,
) -> Marks:
    """Letter the wishes of a piece that found a spot, and list all that is told nowhere."""
    lettered: list[Label] = []
    covered: set[Missing] = set()
    for wish, spot in zip(wanted, spots, strict=True):
        if spot is None:
            continue
        text, height, kinds = spot.choice
        strokes = place_text(text, height, spot.centre, spot.rotation_deg, mirrored=mirrored)
        lettered.append(
            Label(
                text=text,
                kinds=kinds,
                station=wish.station,
                height_mm=height,
                centre=spot.centre,
                rotation_deg=spot.rotation_deg,
                box_mm=spot.box_mm,
                strokes=tuple(strokes),
                hidden=wish.hidden,
            )
        )
        covered.update(Missing(kind, wish.words[kind], wish.station) for kind in kinds)
    every = [
        Missing(kind, words, wish.station) for wish in wanted for kind, words in wish.words.items()
    ]
    missing = [item for item in dict.fromkeys(every) if item not in covered]
    return Marks(tuple(lettered), ticks, tuple(missing))


def _inside(pieces: Sequence[Piece], *, hidden: bool) -> list[tuple[FloatArray, ...]]:
    """Return the guides inside their piece; at a slanting or tapering panel some may not be.

    Of those that are to be hidden, only what is covered is kept.
    """
    counts = [len(piece.guides) for piece in pieces]
    lines = np.array([guide for piece in pieces for guide in piece.guides]).reshape(-1, 2, 2)
    outlines = np.array([shapely.Polygon(piece.outline) for piece in pieces], dtype=object)
    room = shapely.buffer(outlines, -CLEAR_MM / 2, join_style="mitre")
    if hidden:
        room = shapely.intersection(room, covered_rooms(pieces))
    shapely.prepare(room)
    held = shapely.contains_properly(np.repeat(room, counts), shapely.linestrings(lines))
    kept = np.split(held, np.cumsum(counts)[:-1])
    return [
        tuple(compress(piece.guides, flags.tolist()))
        for piece, flags in zip(pieces, kept, strict=True)
    ]


def seen_mm(pieces: Sequence[Piece], marks: Sequence[Marks]) -> float:
    """Return the length of all strokes that no strand covers.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Marks
        What is engraved on the outer face of each.

    Returns
    -------
    float
        Millimetres; 0.0 if everything is covered.
    """
    # What is hidden is covered by its making; only the rest is to be measured.
    return sum(
        _seen_of_piece(piece, [*(stroke for label in one.seen for stroke in label.strokes)])
        + _seen_of_piece(piece, one.ticks)
        for piece, one in zip(pieces, marks, strict=True)
    )


def _seen_of_piece(piece: Piece, strokes: Sequence[np.ndarray]) -> float:
    """Return how much of some strokes is outside all covers of their piece."""
    if not strokes:
        return 0.0
    lines = shapely.multilinestrings([shapely.linestrings(stroke) for stroke in strokes])
    covers = shapely.union_all(covers_of(piece))
    return float(shapely.length(shapely.difference(lines, covers)))
