"""Check what is said of bends, turns and twists against the model."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fabweave.verify.checks.model.clearance import finding_about
from fabweave.verify.checks.model.ribbons import FIGURE_MM, measure_strip
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.bending import Bending, measure_bending
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, as_number, stated_number

#: Figures and the model are rounded: a share of each, beside what its angles are unsure by.
_SHARE = 2e-3
#: A ribbon of this radius is flat, as far as rounded coordinates can tell: so are larger ones.
_RADII, _FLAT_MM = ("bend_mm", "modelled_bend_mm"), 1e5
#: Anything narrower is fragile; limits are rounded to less than this, or this share of them.
_FRAGILE_MM, _LIMIT = 1.0, 1e-4
#: By rule: the limit it is held to; whether figures must be at least that, or at most.
_LIMITS = {"width": ("width_mm", True), "bend": ("bend_mm", True), "twist": ("twist_deg", False)}


@dataclass(frozen=True, eq=False)
class _Held:
    """The figures of one rule along one thread, what is wanted, and how unsure figures are."""

    value: Floats
    limit: Floats
    slack: Floats


def check_bends(job: Job, tally: Tally) -> None:
    """Check every thread's bends, folds, turns and twists, and the findings about them.

    Of each thread the figures that ribbons.json states are those of the model. Where a rule does
    not hold, a finding states the worst figure, what is wanted there, and in how many places it
    does not; where there is no finding, it holds.
    """
    model, ribbons = required(job.model), required(job.ribbons)
    rows: dict[str, list[_Held]] = {rule: [] for rule in (*_LIMITS, "crease")}
    place = tally.at("ribbons.json")
    for record in ribbons["threads"]:
        label = str(record.get("thread"))
        strip = model.get(label)
        if strip is None or not len(strip.entry):
            continue  # another check says so
        row = place.at(f"thread {label}")
        _, widths = measure_strip(strip)
        bending = measure_bending(strip, widths)
        _check_figures(record, bending, row)
        limits = record.get("limits", ribbons.get("limits"))
        wanted = {key: stated_number(limits, key) for key in ("width_mm", "bend_mm", "twist_deg")}
        if not row.expect(
            all(value > 0 for value in wanted.values()),
            "its least width and bend, and its greatest twist, are not all stated",
        ):
            return
        _check_limits(limits, wanted, row)
        for rule, held in _held(bending, widths, wanted).items():
            rows[rule].append(held)
    for rule, each in rows.items():
        if each:
            _check_rule(rule, each, ribbons, place)


def _check_limits(limits: Any, wanted: dict[str, float], place: Place) -> None:
    """Check that the least width and the greatest twist follow from thickness and bend.

    A ribbon is no narrower than the material is thick, nor than a millimetre. Twisted by q over its
    width it stretches its edges by q^2 / 12, and bending stretches the surface by t / 2r.
    """
    thickness = stated_number(limits, "thickness_mm")
    least = max(thickness, _FRAGILE_MM)
    place.number("width_mm of its limits", wanted["width_mm"], least, within=_LIMIT)
    twist = float(np.degrees(np.sqrt(6.0 * thickness / wanted["bend_mm"])))
    place.number("twist_deg of its limits", wanted["twist_deg"], twist, within=_LIMIT * twist)


def _check_figures(record: dict[str, Any], bending: Bending, place: Place) -> None:
    """Check the figures that are stated of one thread."""
    doubt = np.degrees(bending.doubt_rad)
    held = _held(bending, np.zeros(0), {})
    for name, value, slack in (
        ("bend_mm", *_least(bending.span_radius_mm, held["bend"].slack)),
        ("modelled_bend_mm", *_least(bending.radius_mm, _radius_slack(bending))),
        ("fold_deg", bending.fold_deg, doubt),
        ("crease_deg", float(np.fmax.reduce(bending.turn_deg, initial=0.0)), doubt),
        ("twist_deg", float(np.fmax.reduce(bending.span_twist_deg, initial=0.0)), 8 * doubt),
    ):
        stated = record.get(name)
        text = f"{name} is {stated}, and in the model {value:.3f}"
        # Where the coordinates cannot tell a turn from none, it may be any flatter.
        flat = min(value, _FLAT_MM) if slack >= value else _FLAT_MM
        if name in _RADII and value >= flat and (stated is None or as_number(stated) >= flat):
            place.expect(name in record, text)
            continue
        if stated is None and name in record:
            place.expect(not np.isfinite(value) or value == 0.0, text)
            continue
        off = abs(as_number(stated) - value)
        place.at_most("bend_figure", off, FIGURE_MM + _SHARE * value + slack, f"{text}: {{}} off")


def _radius_slack(bending: Bending) -> Floats:
    """Return how unsure the radius at each rung is: the less it turns there, the more."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(bending.radius_mm * bending.doubt_rad / np.radians(bending.turn_deg))


def _least(values: Floats, slack: Floats) -> tuple[float, float]:
    """Return the least of some figures and how unsure it is; infinite if there is none."""
    given = np.flatnonzero(np.isfinite(values))
    if not len(given):
        return np.inf, 0.0
    at = given[np.argmin(values[given])]
    return float(values[at]), float(slack[at])


def _held(bending: Bending, widths: Floats, wanted: dict[str, float]) -> dict[str, _Held]:
    """Return the figures of each rule that there are, with what is wanted."""
    doubt, spans = np.degrees(bending.doubt_rad), bending.span_mm
    radius = bending.span_radius_mm
    with np.errstate(invalid="ignore"):
        softened = np.degrees(bending.softened_mm / wanted.get("bend_mm", 1.0))
        bend_slack = 2 * radius * radius * bending.doubt_rad / spans
    figures = {
        "width": (widths, wanted.get("width_mm", 1.0), FIGURE_MM / 2),
        "bend": (radius, wanted.get("bend_mm", 1.0), bend_slack),
        "twist": (bending.span_twist_deg, wanted.get("twist_deg", 1.0), 8 * doubt),
        "crease": (
            np.where(np.isnan(bending.softened_mm), np.nan, bending.turn_deg), softened, doubt,
        ),
    }  # fmt: skip
    return {
        rule: _Held(*(np.array(np.broadcast_to(part, value.shape)) for part in (value, *rest)))
        for rule, (value, *rest) in figures.items()
    }


def _check_rule(rule: str, each: list[_Held], ribbons: dict[str, Any], place: Place) -> None:
    """Check the finding about a rule, or that it holds if there is none."""
    value, limit, slack = (
        np.concatenate([getattr(held, name) for held in each])
        for name in ("value", "limit", "slack")
    )
    given = np.isfinite(value) & np.isfinite(limit)
    value, limit, slack = value[given], limit[given], slack[given]
    slack = slack + _SHARE * value
    place.count(len(value))
    at_least = _LIMITS[rule][1] if rule in _LIMITS else False
    short = (limit - value) if at_least else (value - limit)
    finding = finding_about(rule, ribbons, place)
    place = place.at(rule)
    fewest, most = np.count_nonzero(short > slack), np.count_nonzero(short > -slack)
    if finding is None:
        place.expect(
            not fewest,
            f"in {fewest} places of the model there is less than is wanted, or more than the "
            "material takes, and no finding says so",
        )
        return
    stated, wanted, count = (stated_number(finding, key) for key in ("value", "limit", "count"))
    place.expect(
        fewest <= count <= most,
        f"it is said not to hold in {count:g} places; in the model it does not in {fewest} to "
        f"{most}",
    )
    # The worst place is that at which least is left of what is wanted.
    with np.errstate(divide="ignore"):
        margin = value / limit if at_least else limit / value
    near = margin <= margin.min() * (1 + 2 * _SHARE) + (slack / limit) if len(margin) else margin
    fits = (np.abs(value - stated) <= FIGURE_MM + slack) & (
        np.abs(limit - wanted) <= FIGURE_MM + _SHARE * limit
    )
    place.expect(
        bool(np.any(fits & near)),
        f"the worst is said to be {stated:g} where {wanted:g} is the limit, and the model has no "
        "such place, or has worse ones",
    )
