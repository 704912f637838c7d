"""Say what each step does, in words that can be found on the pieces."""

from collections.abc import Mapping, Sequence

from fabweave.assembly.manual.views import side_words
from fabweave.assembly.steps import listed
from fabweave.core.messages import agree
from fabweave.flat.crossing_map import CrossingMap, PieceRecord, StepRecord
from fabweave.picture.camera import View

LEGEND = (
    "A picture of the whole object shows where the next pieces go; then each step has a picture "
    "of its own, seen from the same side. New pieces have their full colour and a heavy outline, "
    "and a black name; pieces in place are pale. A name with a disc is that of a piece that the "
    "new one lies over, with a ring that of one that it runs under, as it is engraved beside "
    "crossings; # is a joint. An arrow shows where an end slides beneath others, and a circle with "
    "a cross where all layers are now in place. A card shows the new piece flat, its outer face up "
    "and its start at the left: in order from there, all that crosses it and is in place, with a "
    "disc where the piece goes over it and a ring where it runs under. Grey lines are strands to "
    "come."
)
UNPICTURED = (
    "There are too many steps to show each in a picture here: model.glb shows the woven object, "
    "and assembly.html each step on it, where that could be made."
)
RINGED = (
    " Crossings that the ring around an opening holds get their fasteners with it, at the end: "
    "until then, clips are enough there."
)
BOXES = " Tick the box of a piece when it is in its place."


def strand_pieces(crossing_map: CrossingMap) -> dict[tuple[int, bool], list[str]]:
    """Return the pieces of each strand: crossing, and whether it is the one on top.

    A ring of one piece that laps itself there is named once.
    """
    strands: dict[tuple[int, bool], list[str]] = {}
    for piece in crossing_map.pieces:
        for strand in dict.fromkeys((one.crossing, one.over) for one in piece.stations):
            strands.setdefault(strand, []).append(piece.id)
    return strands


def place_words(piece: PieceRecord, *, by_kind: bool) -> str:
    """Return the id of a piece, and where it is found: on which sheet, or among which kind.

    Parameters
    ----------
    piece : PieceRecord
    by_kind : bool
        Whether pieces bear their kind in place of their id.
    """
    which = f"sheet {piece.sheet}"
    if by_kind:
        which = f"any K{piece.kind}" + (", arrow back" if piece.turned else "")
    return f"{piece.id} ({which})"


def layers_words(
    step: StepRecord,
    pieces: Mapping[str, PieceRecord],
    strands: Mapping[tuple[int, bool], Sequence[str]],
    crossings: Sequence[int],
) -> str:
    """Say where the last layer has come, by the pieces that meet there.

    Parameters
    ----------
    step : StepRecord
    pieces : mapping from id to PieceRecord
    strands : mapping
        From ``strand_pieces``.
    crossings : sequence of int
        Those of the step that are complete now and matter.
    """
    met: dict[str, list[str]] = {}
    for crossing in crossings:
        over, key = next(
            (station.over, key)
            for key in reversed(step.pieces)
            for station in pieces[key].stations
            if station.crossing == crossing
        )
        others = met.setdefault(key, [])
        others += [one for one in strands[crossing, not over] if one not in others]
    said = "; ".join(f"{key} with {listed(others)}" for key, others in met.items())
    return f"All layers are in place: {said}." if said else ""


def hang_words(step: StepRecord, crossing_map: CrossingMap) -> str:
    """Say which crossings that are fastened in a step carry a cord or a foot, and in what hole."""
    pieces = {piece.id: piece for piece in crossing_map.pieces}
    holes = {joint.id: joint.hole_mm for joint in crossing_map.joints}
    said = []
    for crossing in crossing_map.crossings:
        if crossing.hang and crossing.id in step.fasten:
            station = pieces[crossing.over.piece].stations[crossing.over.station]
            hole = station.hole_mm
            if hole is None and station.joint is not None:
                hole = holes[station.joint]
            said.append(
                f"{crossing.over.piece} with {crossing.under.piece}"
                + (f" (hole of {hole:g} mm)" if hole is not None else "")
            )
    return f"A cord or a foot goes here: {listed(said)}." if said else ""


def view_words(view: View, *, turned: bool) -> str:
    """Say from where the next steps are seen, and whether the object is to be turned for it.

    Examples
    --------
    >>> view_words(View(-60.0, 35.0), turned=True)
    'Turn the object to see it from the front right and above.'
    """
    side = side_words(view)
    return f"Turn the object to see it from {side}." if turned else f"Seen from {side}."


def steps_words(first: int, last: int) -> str:
    """Name a run of steps that comes next.

    Examples
    --------
    >>> steps_words(3, 3), steps_words(3, 7)
    ('Next: step 3', 'Next: steps 3 to 7')
    """
    return f"Next: step {first}" if first == last else f"Next: steps {first} to {last}"


def progress_words(there: int, pieces: int) -> str:
    """Say how many pieces are in place after some steps.

    Examples
    --------
    >>> progress_words(12, 96)
    'With these, 12 of 96 pieces are in place.'
    """
    return f"With these, {there} of {agree(pieces, '{n} [piece is|pieces are]')} in place."


def time_words(seconds: float, so_far: float) -> str:
    """Say about how long a step takes, and all steps up to it.

    Examples
    --------
    >>> time_words(20.0, 20.0), time_words(200.0, 4000.0)
    ('1 min, 0 h 01', '3 min, 1 h 07')
    """
    whole = max(round(so_far / 60.0), 1)
    return f"{max(round(seconds / 60.0), 1)} min, {whole // 60} h {whole % 60:02d}"
