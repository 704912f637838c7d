"""Mark pieces: ticks at the crossings, crosses at joints, and labels where there is room."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.cut.labels.lettering import place_text
from fabweave.cut.labels.placement import CLEAR_MM, Spot, find_spots
from fabweave.cut.labels.texts import Label, Missing, Wish, wishes
from fabweave.flat.piece import Piece
from fabweave.flat.strand_owners import find_owners

#: Two strokes of the tick of a strand that goes under stand this far apart.
_DOUBLE_TICK_MM = 0.8
_SHORTEST_TICK_MM = 0.3
#: A tick is this share of the ribbon's width long, within these bounds where there is room.
_TICK_SHARE, _TICK_MM = 0.15, (0.6, 2.0)


@frozen_value
class Marks:
    """What is engraved on a piece, in its own coordinates, and what found no room."""

    labels: tuple[Label, ...]
    ticks: tuple[FloatArray, ...]
    dropped: tuple[Missing, ...]


def mark_pieces(
    pieces: Sequence[Piece], n_crossings: int, labels: str = "full", side: str = "outside"
) -> tuple[Marks, ...]:
    """Engrave every piece.

    At each crossing a short tick stands inside each edge: single where the piece lies over,
    double where it goes under. Glued joints have their guides. Labels read along the thread; one
    that finds no clear place is made smaller, then shortened, and dropped at last, the least
    important first (see ``labels``).

    Parameters
    ----------
    pieces : sequence of Piece
    n_crossings : int
        Of the whole job.
    labels : str
        ``"full"``: all of this. ``"numbers"``: ids of pieces, and guides. ``"none"``: nothing.
    side : str
        The face that is engraved and read, ``"outside"`` or ``"inside"``: on the inside letters
        are mirrored in the piece's coordinates, in which the outside is seen.

    Returns
    -------
    tuple of Marks
        One for each piece.
    """
    if not pieces or labels == "none":
        return (Marks((), (), ()),) * len(pieces)
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
    ticked = _inside(
        pieces,
        [[*(_ticks(piece) if labels == "full" else ()), *piece.guides] for piece in pieces],
    )
    spots = find_spots(pieces, ticked, wanted)
    return tuple(
        _marks(piece_wishes, piece_spots, ticks, mirrored=side == "inside")
        for piece_wishes, piece_spots, ticks in zip(wanted, spots, ticked, strict=True)
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
            )
        )
        covered.update(Missing(kind, wish.words[kind], wish.station) for kind in kinds)
    every = [
        Missing(kind, words, wish.station) for wish in wanted for kind, words in wish.words.items()
    ]
    missing = [item for item in dict.fromkeys(every) if item not in covered]
    return Marks(tuple(lettered), ticks, tuple(missing))


def _ticks(piece: Piece) -> Iterator[FloatArray]:
    """Yield the ticks at every station: beside the right edge and beside the left one."""
    for direction, rails, over in zip(piece.directions, piece.rails, piece.over, strict=True):
        across = rails[1] - rails[0]
        width = float(np.hypot(*across))
        if width < 4 * CLEAR_MM:
            continue
        inward = across / width
        least, most = _TICK_MM
        length = min(max(_TICK_SHARE * width, least), most, width / 2 - 2 * CLEAR_MM)
        if length < _SHORTEST_TICK_MM:
            continue
        for shift in (0.0,) if over else (-_DOUBLE_TICK_MM / 2, _DOUBLE_TICK_MM / 2):
            for edge, way in ((rails[0], inward), (rails[1], -inward)):
                start = edge + shift * direction + CLEAR_MM * way
                yield np.array([start, start + length * way])


def _inside(
    pieces: Sequence[Piece], strokes: Sequence[Sequence[FloatArray]]
) -> list[tuple[FloatArray, ...]]:
    """Keep the strokes inside their piece; at a slanting or tapering panel some may not be."""
    counts = [len(piece_strokes) for piece_strokes in strokes]
    lines = np.array([stroke for piece_strokes in strokes for stroke in piece_strokes]).reshape(
        -1, 2, 2
    )
    outlines = np.array([shapely.Polygon(piece.outline) for piece in pieces], dtype=object)
    room = shapely.buffer(outlines, -CLEAR_MM / 2, join_style="mitre")
    shapely.prepare(room)
    held = shapely.contains_properly(np.repeat(room, counts), shapely.linestrings(lines))
    kept = np.split(held, np.cumsum(counts)[:-1])
    return [
        tuple(stroke for stroke, good in zip(piece_strokes, flags.tolist(), strict=True) if good)
        for piece_strokes, flags in zip(strokes, kept, strict=True)
    ]
