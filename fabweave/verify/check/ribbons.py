"""Hold the ribbons of the model to their rules: width, bends, clearance and grain.

Where a rule does not hold, a finding in ribbons.json states the worst figure, what is wanted there,
and in how many places it does not; where there is no finding, it holds everywhere.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, RibbonReport
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.nearness import Near, cut_steps, dot, near_parts
from fabweave.verify.measure.walks import station_run
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally, stated_number

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


def _spans(strip: Strip, middle: Floats, length: Floats, twist: Floats, widths: Floats) -> Floats:
    """Return radius, twist and length, (3, K), of the way from each panel to the next one."""
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
    spans = np.stack([radius, turned * broad / way_mm, way_mm])
    if not strip.closed:
        spans[:, -1] = np.nan
    return spans


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


#: Figures are rounded to a thousandth, and the model to 32 bits: a share of each.
_FIGURE_MM, _SHARE = 0.01, 2e-3
#: Gaps are rounded to a ten-thousandth.
GAP_MM = 0.002
#: Anything narrower is fragile.
_FRAGILE_MM = 1.0
#: A strip bends as it does across the grain if it is at most so far off; angles are rounded.
_ACROSS_DEG, _ANGLE_DEG = 45.0, 0.02


def _check_finding(
    rule: str, ribbons: RibbonReport, fewest: Any, most: Any, place: Place,
    is_worst: Callable[[float, float], Any],
) -> None:  # fmt: skip
    """Check the finding about a rule, or that it holds if there is none.

    ``fewest`` and ``most`` are in how many places of the model it does not, as sure as figures are;
    ``is_worst`` says whether a value and its limit are those of the worst place.
    """
    findings = [finding for finding in ribbons["findings"] if finding.get("rule") == rule]
    place = place.at(rule)
    if not findings:
        place.expect(not fewest, f"in {fewest} places it does not hold, and no finding says so")
        return
    place.equal("the number of findings", len(findings), 1)
    value, limit, count = (stated_number(findings[0], key) for key in ("value", "limit", "count"))
    place.expect(
        fewest <= count <= most,
        f"it is said not to hold in {count:g} places; in the model it does not in {fewest} to "
        f"{most}",
    )
    place.expect(
        is_worst(value, limit),
        f"the worst is said to be {value:g} where {limit:g} is the limit, and the model has no "
        "such place, or has worse ones",
    )


def _limits_of(ribbons: RibbonReport, label: str) -> object:
    """Return the limits of a thread, or else those of all."""
    own = (one.get("limits") for one in ribbons["threads"] if one.get("thread") == label)
    return next(own, None) or ribbons.get("limits")


def rung_widths(strip: Strip) -> Floats:
    """Return the width across a strip at each rung."""
    middle = strip.rungs.mean(axis=1)
    steps = np.diff(middle, axis=0, append=middle[:1])
    if not strip.closed:
        steps[-1] = 0.0
    way = _unit(steps)
    way = _unit(way + np.roll(way, 1, axis=0))
    return _size(np.cross(strip.rungs[:, 1] - strip.rungs[:, 0], way))


def check_bends(job: Job, tally: Tally) -> None:
    """Check every ribbon's width, bends, creases and twists, and the findings about them.

    A ribbon is no narrower than the material is thick, nor than a millimetre. Twisted by q over its
    width it stretches its edges by q^2 / 12, and bending stretches the surface by t / 2r.
    """
    ribbons, place = required(job.ribbons), tally.at("ribbons.json")
    rows: dict[str, list[Floats]] = {rule: [] for rule in ("width", "bend", "twist", "crease")}
    for label, strip in required(job.model).items():
        if not len(strip.entry):
            continue
        limits = _limits_of(ribbons, label)
        thickness, bend = (stated_number(limits, key) for key in ("thickness_mm", "bend_mm"))
        if not place.at(f"thread {label}").expect(
            thickness > 0.0 and bend > 0.0, "its thickness and its least bend are not both stated"
        ):
            return
        widths = rung_widths(strip)
        bending = measure_bending(strip, widths)
        most_twist = np.degrees(np.sqrt(6.0 * thickness / bend))
        doubt, radius = np.degrees(bending.doubt_rad), bending.span_radius_mm
        bend_slack = 2.0 * radius**2 * bending.doubt_rad / bending.span_mm
        crease = np.where(np.isnan(bending.softened_mm), np.nan, bending.turn_deg)
        for rule, value, limit, slack in (
            ("width", widths, max(thickness, _FRAGILE_MM), _FIGURE_MM / 2.0),
            ("bend", radius, bend, bend_slack),
            ("twist", bending.span_twist_deg, most_twist, 8.0 * doubt),
            ("crease", crease, np.degrees(bending.softened_mm / bend), doubt),
        ):
            rows[rule].append(np.array(np.broadcast_arrays(value, limit, slack)))
    for rule, each in rows.items():
        if each:
            figures = np.concatenate(each, axis=1)
            _check_rule(rule, figures[:, np.isfinite(figures[:2]).all(axis=0)], ribbons, place)


def _check_rule(rule: str, figures: Floats, ribbons: RibbonReport, place: Place) -> None:
    """Check the finding about a rule, given values, limits and how unsure values are, (3, N)."""
    value, limit, slack = figures
    slack = slack + _SHARE * value
    place.count(len(value))
    at_least = rule in ("width", "bend")
    short = (limit - value) if at_least else (value - limit)

    def is_worst(stated: float, wanted: float) -> bool:
        """Say whether least is left of what is wanted in such a place."""
        margin = value / limit if at_least else limit / value
        near = margin <= margin.min() * (1.0 + 2.0 * _SHARE) + slack / limit
        near &= np.abs(value - stated) <= _FIGURE_MM + slack
        return bool(np.any(near & (np.abs(limit - wanted) <= _FIGURE_MM + _SHARE * limit)))

    fewest, most = np.count_nonzero(short > slack), np.count_nonzero(short > -slack)
    _check_finding(rule, ribbons, fewest, most, place, is_worst)


def check_clearance(job: Job, tally: Tally) -> None:
    """Check that no two ribbons are nearer than is said.

    Middle surfaces that do not cross there are to be one thickness (half of either's) and the
    clearance apart, one thickness if they part from the same crossing.
    """
    plan, ribbons = required(job.map), required(job.ribbons)
    place = tally.at("ribbons.json").against("job.toml")
    thickness = {
        thread.id: stated_number(_limits_of(ribbons, thread.label), "thickness_mm")
        for thread in plan.threads
        if thread.crossings
    }
    clearance = stated_number(ribbons.get("limits"), "clearance_mm")
    for value, wanted_mm in (
        *((value, job.supplies[key].thickness_mm) for key, value in thickness.items()),
        (clearance, job.clearance_mm),
    ):
        if not value >= 0.0 or wanted_mm not in (None, value):
            place.fail(f"a thickness or the clearance is {value:g} mm, and not {wanted_mm} mm")
            return
    steps = cut_steps(plan, required(job.model))
    tally.count(len(steps.part))
    near = near_parts(steps, max(thickness.values(), default=0.0) + clearance + GAP_MM)
    layers = np.array([thickness[key] for key in near.parts[:, [0, 2]].ravel().tolist()])
    wanted = layers.reshape(-1, 2).sum(axis=1) / 2.0 + np.where(near.parting, 0.0, clearance)
    least, sure = ((gap / wanted).min(initial=np.inf) for gap in (near.gap_mm, near.sure_mm))
    for at in np.flatnonzero(near.sure_mm < wanted - GAP_MM)[:1].tolist():
        place = place.at(
            f"{_names(plan, near, at)} are {near.gap_mm[at]:.3f} mm apart where {wanted[at]:g} mm "
            "are wanted"
        )
    _check_finding(
        "clearance",
        ribbons,
        np.count_nonzero(near.sure_mm < wanted - GAP_MM),
        np.count_nonzero(near.gap_mm < wanted + GAP_MM),
        place,
        lambda value, limit: (
            limit * least - GAP_MM <= value <= limit * sure + GAP_MM
            and np.any(np.abs(wanted - limit) < GAP_MM)
        ),
    )


def _names(plan: CrossingMap, near: Near, at: int) -> str:
    """Name the two ribbons of a pair and the places where they are."""
    places = []
    for thread, part in near.parts[at].reshape(2, 2).tolist():
        label, crossings = plan.thread[thread].label, plan.thread[thread].crossings
        places.append(f"thread {label} after crossing {crossings[max(part, 0) // 2]}")
    return " and ".join(places)


def check_grain(job: Job, tally: Tally) -> None:
    """Check that the better radius is taken only where pieces lie across the grain.

    Bends that are tighter than a strip along the grain takes must lie across it to within 45
    degrees wherever their piece lies as the rotations allow; or a finding says how many do not.
    """
    plan, ribbons = required(job.map), required(job.ribbons)
    place = tally.at("ribbons.json")
    along = {}
    for thread in plan.threads:
        limits = _limits_of(ribbons, thread.label)
        radius = stated_number(limits, "bend_along_mm")
        if isinstance(limits, dict) and "bend_along_mm" in limits:
            along[thread.id] = radius
            place.at(f"thread {thread.label}").expect(
                plan.layout.rotations.from_grain_deg == 90.0
                and stated_number(limits, "bend_mm") < radius,
                "its radius is not below that along the grain, or pieces need not lie across it",
            )
    tight, sure, off = _grain_bends(job, along)
    tally.count(len(off))
    worst = off[tight].max(initial=0.0)
    _check_finding(
        "grain",
        ribbons,
        np.count_nonzero(sure & (off > _ACROSS_DEG + _ANGLE_DEG)),
        np.count_nonzero(tight & (off > _ACROSS_DEG - _ANGLE_DEG)),
        place,
        lambda value, limit: limit == _ACROSS_DEG and abs(value - worst) <= _ANGLE_DEG,
    )


def _grain_bends(job: Job, along: dict[int, float]) -> tuple[Flags, Flags, Floats]:
    """Return of each way from station to station whether it is tight, surely tight, and its angle.

    The angle is that to the line across the grain, at the worst that the rotations allow.
    """
    plan = required(job.map)
    tight, sure, off = [np.zeros(0, bool)], [np.zeros(0, bool)], [np.zeros(0)]
    radii: dict[int, tuple[Floats, Floats]] = {}
    for piece in plan.pieces:
        key, strip = piece.thread, job.strips.get(piece.thread)
        start = station_run(plan.thread[key], piece) if strip is not None else None
        if strip is None or start is None or key not in along:
            continue
        if key not in radii:
            bending = measure_bending(strip, rung_widths(strip))
            radius = bending.span_radius_mm
            slack = 2.0 * radius**2 * bending.doubt_rad / bending.span_mm + _SHARE * radius
            radii[key] = radius, slack
        radius, slack = radii[key]
        ways = (start + np.arange(len(piece.stations) - 1)) % len(radius)
        tight.append(radius[ways] < along[key] + slack[ways])
        sure.append(radius[ways] < along[key] - slack[ways])
        step = np.abs(np.diff(piece.points, axis=0))
        off.append(
            np.degrees(np.arctan2(step[:, 1], step[:, 0])) + plan.layout.rotations.tolerance_deg
        )
    return np.concatenate(tight), np.concatenate(sure), np.concatenate(off)
