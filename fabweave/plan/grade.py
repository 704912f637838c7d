"""Grade a job that can be built: how even its strips are, how much they ask of hands."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.messages import agree
from fabweave.core.records import record, to_json
from fabweave.form.settle import BOUND, Form, length_text
from fabweave.mesh.likeness import SHORT, Likeness
from fabweave.piece.piece import Piece
from fabweave.plan.verdict import NARROW_MM, Verdict

#: The schema of ``verdict.json``.
VERDICT = "fabweave.verdict/1"
#: The best grade, and the most that one rule takes from it; those that spoil an object to the eye
#: take more.
BEST, _MOST_LOST, _SPOILS = 10.0, 2.0, 4.0
#: The widest place of a strip may be so many times the narrowest; a point goes for so much more.
_EVEN, _UNEVEN = 1.15, 0.25
#: Strips of so many millimetres are handled with ease; a point goes for such a share that asks for
#: tweezers, and half of one for what is half-way there.
EASY_MM, _NARROW_SHARE = 6.0, 0.1
#: From crossing to crossing, the turn of a strip may change by so many degrees: an arc is as good
#: as a straight line. A point goes for so many more, and a place with so many is named.
_SMOOTH_DEG, _KINK_DEG, _KINKED_DEG = 5.0, 5.0, 30.0
#: The woven mesh may be such a share of the size off its model; a point goes for so much more: at a
#: hundredth it is hardly the model.
_NEAR, _OFF = 0.004, 0.002
#: Under its own weight and load it may sag by such a share of its size; a point goes for as much
#: again: by the same share, what settles keeps its form. To the eye, a hundredth is a dent.
_SAGS = BOUND
#: Such a share of the vertices may be irregular beyond what its surface needs; a point goes for so
#: much more. To the eye, a hundredth is masterly, a tenth is patched, and a half is no weave.
_REGULAR, _IRREGULAR = 0.04, 0.05
#: A limb that is cut short, and by such a share of the size more, is lost, and takes a point.
_LOST = 0.02
#: So many places are named.
_PLACES = 5


@record
class Lost:
    """What a rule takes from a grade, and why."""

    rule: str
    points: float
    text: str


@record
class Place:
    """A bad place: the piece, the crossing, and what is wrong there."""

    piece: str
    crossing: int
    text: str


@record
class Grade:
    """How good a job is, out of 10, by stated rules; what cannot be built has 0.

    Parameters
    ----------
    score : float
        To a tenth.
    lost : tuple of Lost
        What rules took, the most first.
    worst : tuple of Place
        At most five places, each of another piece, the worst first.
    """

    score: float
    lost: tuple[Lost, ...]
    worst: tuple[Place, ...]

    @property
    def text(self) -> str:
        """The grade in words, a line each."""
        why = "; ".join(f"{one.text} (-{one.points:.1f})" for one in self.lost)
        lines = [f"Grade: {self.score:.1f} of 10" + (f": {why}" if why else "")]
        if self.worst:
            places = "; ".join(
                f"{one.piece} at crossing {one.crossing} {one.text}" for one in self.worst
            )
            lines.append(f"  worst places: {places}")
        return "\n".join(lines)


def grade(
    pieces: Sequence[Piece],
    verdict: Verdict,
    like: Likeness | None = None,
    form: Form | None = None,
    foretold: tuple[float, float] | None = None,
    irregular: float = 0.0,
) -> Grade:
    """Grade a job by its pieces, its verdict, how like its model it is and how it keeps its form.

    Parameters
    ----------
    pieces : sequence of Piece
    verdict : Verdict
    like : Likeness, optional
        Where the model was remeshed.
    form : Form, optional
        Where that is known.
    foretold : (float, float), optional
        Else, how far it is to settle, as a share of what keeps its form, and to sag, as a share of
        its size.
    irregular : float
        The share of its mesh that is irregular without need.

    Examples
    --------
    >>> grade([], Verdict(level="makeable", reasons=())).score
    10.0
    """
    widths = [station_widths(piece) for piece in pieces]
    kinks = [station_kinks(piece) for piece in pieces]
    lost = [
        one
        for one in _lost(widths, kinks, verdict, like, form, foretold, irregular)
        if one.points >= 0.05
    ]
    lost.sort(key=lambda one: -one.points)
    left = max(BEST - sum(one.points for one in lost), 0.0)
    score = 0.0 if verdict.stops else round(left, 1)
    return Grade(score=score, lost=tuple(lost), worst=_worst(pieces, widths, kinks))


def verdict_json(verdict: Verdict, grade: Grade, form: Form | None) -> dict[str, Any]:
    """Return what ``verdict.json`` holds: verdict, grade, and form where it is known."""
    said = {"schema": VERDICT, "units": "mm", **to_json(verdict), "grade": to_json(grade)}
    return said if form is None else {**said, "form": form.record()}


def station_widths(piece: Piece) -> FloatArray:
    """Return how wide a piece is at each of its stations, (S,), millimetres."""
    widths: FloatArray = np.linalg.norm(piece.rails[:, 1] - piece.rails[:, 0], axis=1)
    return widths


def station_turns(piece: Piece) -> FloatArray:
    """Return by how many degrees a flat piece turns from station to station, (S - 1,), to the left.

    A straight strip turns by nothing, and an arc by the same everywhere.
    """
    one, other = piece.directions[:-1], piece.directions[1:]
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    turns: FloatArray = np.degrees(np.arctan2(cross, np.einsum("nd,nd->n", one, other)))
    return turns


def station_kinks(piece: Piece) -> FloatArray:
    """Return by how many degrees the turn of a piece changes from station to station, (S - 2,).

    Beside the corners at which it turns back at a rim that is not known (NaN): these are meant.
    """
    kinks: FloatArray = np.abs(np.diff(station_turns(piece)))
    beside = np.concatenate([piece.rim_turns - 1, piece.rim_turns])
    kinks[beside[(beside >= 0) & (beside < len(kinks))]] = np.nan
    return kinks


def _lost(
    widths: Sequence[FloatArray],
    kinks: Sequence[FloatArray],
    verdict: Verdict,
    like: Likeness | None,
    form: Form | None,
    foretold: tuple[float, float] | None,
    irregular: float,
) -> Iterator[Lost]:
    """Yield what each rule takes."""

    def lose(rule: str, points: float, text: str, most: float = _MOST_LOST) -> Lost:
        return Lost(rule=rule, points=round(min(max(points, 0.0), most), 2), text=text)

    if widths:
        ratio = float(np.median([each.max() / each.min() for each in widths]))
        every = np.concatenate(widths)
        narrow, hard = float(np.mean(every < EASY_MM)), (EASY_MM - every) / (EASY_MM - NARROW_MM)
        kink = float(np.nanmean(np.concatenate([np.zeros(1), *kinks])))
        yield lose(
            "even",
            (ratio - _EVEN) / _UNEVEN,
            f"half of the pieces are {ratio:.2f} times as wide in one place as in another, or more",
        )
        yield lose(
            "narrow",
            float(np.clip(hard, 0.0, 1.0).mean()) / _NARROW_SHARE,
            f"{narrow:.0%} of the crossings are of strips narrower than {EASY_MM:g} mm",
            _SPOILS,
        )
        yield lose(
            "smooth",
            (kink - _SMOOTH_DEG) / _KINK_DEG,
            f"strips are wavy: their turn changes by {kink:.1f}° from crossing to crossing",
        )
    yield lose(
        "regular",
        (irregular - _REGULAR) / _IRREGULAR,
        f"the weave is patched: {irregular:.0%} of its mesh is irregular without need",
        _SPOILS,
    )
    if like is not None:
        text = f"it is {like.loss:.2%} of its size off the model"
        yield lose("likeness", (like.loss - _NEAR) / _OFF, text, _SPOILS)
        limbs = sum(min((share - SHORT) / _LOST, 1.0) for share in like.short.values())
        text = agree(len(like.short), "{n} [limb is|limbs are] lost or cut short")
        yield lose("limbs", limbs, text, _SPOILS)
    if form is not None and form.collapse:
        yield lose("sag", _MOST_LOST, form.collapse)
    elif form is not None or foretold is not None:
        gives, sinks = foretold or (0.0, 0.0) if form is None else (form.gives, form.sinks)
        far = "far" if form is None else f"by up to {length_text(form.goes_mm)}"
        yield lose("form", gives - 1, f"it moves {far} when you let go", _SPOILS)
        text = f"it sags by {sinks:.1%} of its size under what weighs on it"
        yield lose("sag", sinks / _SAGS - 1, text, _SPOILS)
    care = len(verdict.reasons)
    yield lose("care", care, agree(care, "{n} [reason asks|reasons ask] for care"))


def _worst(
    pieces: Sequence[Piece], widths: Sequence[FloatArray], kinks: Sequence[FloatArray]
) -> tuple[Place, ...]:
    """Return the narrowest and the most crooked places, one of a piece at most."""
    found: list[tuple[float, str, Place]] = []
    for piece, width, kink in zip(pieces, widths, kinks, strict=True):
        thin = int(width.argmin())
        bad = [(EASY_MM / width[thin], thin, f"is {width[thin]:.1f} mm wide")]
        if np.isfinite(kink).any():
            turn, bent = station_turns(piece), int(np.nanargmax(kink))
            text = _turning(*turn[bent : bent + 2].tolist())
            bad.append((kink[bent] / _KINKED_DEG, bent + 1, text))
        share, at, text = max(bad)
        if share > 1:
            place = Place(piece=piece.id, crossing=int(piece.crossings[at]), text=text)
            found.append((-float(share), piece.id, place))
    return tuple(place for *_, place in sorted(found, key=lambda one: one[:2])[:_PLACES])


def _turning(before: float, after: float) -> str:
    """Say how a strip turns up to a crossing, and after it, degrees."""
    if abs(before) < _SMOOTH_DEG:
        return f"is straight up to there, and then turns by {abs(after):.0f}°"
    if abs(after) < _SMOOTH_DEG:
        return f"turns by {abs(before):.0f}° up to there, and then is straight"
    other = " the other way" if before * after < 0.0 else ""
    return f"turns by {abs(before):.0f}° up to there, and then by {abs(after):.0f}°{other}"
