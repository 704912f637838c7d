"""Measure in the model how ribbons bend, turn and twist."""

from dataclasses import dataclass

import numpy as np

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.nearness import dot
from fabweave.verify.read.glb import Strip

#: Two panels that look away from each other by more have no plane between them.
_TOWARDS = 0.2
#: A span goes on from panel to panel if it sets out and arrives within so much of its chord.
_ONWARD = 0.5
#: So many times the coordinates' rounding over the shortest length is what an angle is unsure by.
_DOUBT = 6.0
#: Turns within this of half a turn have no sign.
_HALF_TURN = 1e-4


@dataclass(frozen=True, eq=False)
class Bending:
    """How one strip bends: at each rung, and from each panel to the next; NaN where it does not.

    Parameters
    ----------
    turn_deg : (R,) float array
        The angle between the mean planes of the steps before and after each rung.
    span_radius_mm : (K,) float array
        To which a ribbon must bend that leads from panel to panel as softly as may be.
    span_twist_deg : (K,) float array
        Turn about the middle line over a length that equals the width.
    span_mm : (K,) float array
        From the middle of one panel to that of the next.
    softened_mm : (R,) float array
        The length of the span over which the turn at each rung may be spread.
    doubt_rad : float
        What the rounding of the model may have done to any angle.
    """

    turn_deg: Floats
    span_radius_mm: Floats
    span_twist_deg: Floats
    span_mm: Floats
    softened_mm: Floats
    doubt_rad: float


def measure_bending(strip: Strip, widths: Floats) -> Bending:
    """Measure one strip.

    Parameters
    ----------
    strip : Strip
        With one panel at least.
    widths : (R,) float array
        Across the strip, at each rung.
    """
    rungs, count = strip.rungs, len(strip.rungs)
    here = np.arange(count if strip.closed else count - 1)
    after = (here + 1) % count
    middle = rungs.mean(axis=1)
    step = middle[after] - middle[here]
    length = np.linalg.norm(step, axis=1)
    # The two diagonals of a step span its mean plane.
    plane = np.cross(rungs[after, 1] - rungs[here, 0], rungs[here, 1] - rungs[after, 0])

    inner = here if strip.closed else here[1:]
    before = (inner - 1) % count
    axis = _unit(rungs[inner, 1] - rungs[inner, 0])
    turn = np.full(count, np.nan)
    turn[inner] = np.abs(np.degrees(_about(plane[before], plane[inner], axis)))

    spans = _spans(strip, middle, length, _twists(rungs, after, here, step), widths)
    shortest = min(float(length.min()), float(_size(rungs[:, 1] - rungs[:, 0]).min()))
    return Bending(
        turn_deg=turn,
        span_radius_mm=spans[0],
        span_twist_deg=spans[1],
        span_mm=spans[2],
        softened_mm=spans[2][_span_of_rungs(strip)],
        doubt_rad=_DOUBT * strip.grain_mm / max(shortest, 1e-9),
    )


def _spans(
    strip: Strip, middle: Floats, length: Floats, twist: Floats, widths: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return for each station the radius, twist and length of the way to the next one's panel."""
    rungs, count = strip.rungs, len(strip.rungs)
    panel = np.column_stack((strip.entry, strip.exit))
    normal = _unit(
        np.cross(
            rungs[panel[:, 1], 1] - rungs[panel[:, 0], 0],
            rungs[panel[:, 0], 1] - rungs[panel[:, 1], 0],
        )
    )
    ahead = np.roll(np.arange(len(panel)), -1)
    way = middle[panel[:, 1]] - middle[panel[:, 0]]
    chord = middle[panel[ahead]].mean(axis=1) - middle[panel].mean(axis=1)
    along = _unit(chord)
    up = normal + normal[ahead]
    up -= dot(up, along)[:, None] * along
    upright = _size(up) > _TOWARDS
    up = _unit(up)
    # How steeply either panel stands to the chord, and which way.
    first, second = (
        np.arctan2(-dot(one, along), np.maximum(dot(one, up), 1e-9))
        for one in (normal, normal[ahead])
    )
    need = np.abs(first + second) + np.sqrt(2.0) * np.hypot(first, second)
    need = np.where(upright, need, np.radians(_between(normal, normal[ahead])))

    # Sums over the steps from one panel's exit to the next one's entry, once around at most.
    start, gap = strip.exit, (strip.entry[ahead] - strip.exit) % count
    lengths, twists = (
        np.concatenate([[0.0], np.cumsum(np.concatenate([part, part]))]) for part in (length, twist)
    )
    panels = lengths[strip.entry + (strip.exit - strip.entry) % count] - lengths[strip.entry]
    way_mm = lengths[start + gap] - lengths[start] + (panels + panels[ahead]) / 2.0
    turned = np.abs(np.degrees(twists[start + gap] - twists[start]))
    broad = (widths[strip.entry] + widths[strip.entry[ahead]]) / 2.0

    onward = np.ones(len(panel), dtype=bool)
    for one in (way, way[ahead]):
        level = _unit(one)
        level = level - dot(level, up)[:, None] * up
        onward &= dot(level, along) > _ONWARD * _size(level)
    with np.errstate(divide="ignore"):
        radius = np.where(onward | ~upright, way_mm / need, np.nan)
    missing = np.zeros(len(panel), dtype=bool)
    missing[-1] = not strip.closed
    return (
        np.where(missing, np.nan, radius),
        np.where(missing, np.nan, turned * broad / way_mm),
        np.where(missing, np.nan, way_mm),
    )


def _span_of_rungs(strip: Strip) -> Ints:
    """Return the station from whose panel on a rung lies; one where a panel begins lies before."""
    by_entry = np.argsort(strip.entry)
    place = np.searchsorted(strip.entry[by_entry], np.arange(len(strip.rungs)), side="left") - 1
    return by_entry[np.where(place < 0, len(by_entry) - 1 if strip.closed else 0, place)]


def _twists(rungs: Floats, after: Ints, here: Ints, step: Floats) -> Floats:
    """Return by how much the rungs of each step turn about its middle line."""
    arms = rungs[:, 1] - rungs[:, 0]
    angle = _about(arms[here], arms[after], _unit(step))
    # Rounding decides on the sign of a half turn: none is counted as turning clockwise.
    return np.where(angle < _HALF_TURN - np.pi, np.pi, angle)


def _about(first: Floats, second: Floats, axis: Floats) -> Floats:
    """Return the angles by which vectors turn about unit axes."""
    a, b = (one - dot(one, axis)[:, None] * axis for one in (first, second))
    return np.arctan2(dot(np.cross(a, b), axis), dot(a, b))


def _between(first: Floats, second: Floats) -> Floats:
    """Return the angles between vectors, in degrees."""
    return np.degrees(np.arctan2(_size(np.cross(first, second)), dot(first, second)))


def _size(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(_size(vectors), 1e-300)[:, None]
