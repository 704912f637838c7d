"""Say costs in words, the same wherever they are shown."""

from fabweave.core.messages import agree
from fabweave.estimate.costs import Costs
from fabweave.estimate.money import price_text
from fabweave.stock.machine import Span

_MINUTE_S, _HOUR_S = 60.0, 3600.0


def time_text(span: Span | None) -> str:
    """Return a range of seconds as people say it.

    Examples
    --------
    >>> time_text((25.0, 96.0)), time_text((2100.0, 3600.0)), time_text((32400.0, 100800.0))
    ('0.4 to 1.6 min', '35 to 60 min', '9 to 28 h')
    >>> time_text((4000.0, 9000.0)), time_text((0.0, 0.0)), time_text(None)
    ('67 to 150 min', 'none', 'unknown')
    """
    if span is None:
        return "unknown"
    if span[1] == 0.0:
        return "none"
    low, high, unit = _numbers(*span)
    return f"{low} to {high} {unit}"


def _numbers(low_s: float, high_s: float) -> tuple[str, str, str]:
    """Return both ends of a range of seconds, and the unit that suits the higher one."""
    each_s, unit = (_HOUR_S, "h") if high_s > 3 * _HOUR_S else (_MINUTE_S, "min")
    digits = 1 if high_s < 10.0 * each_s else 0
    return f"{low_s / each_s:.{digits}f}", f"{high_s / each_s:.{digits}f}", unit


def hours_text(span: Span) -> str:
    """Return what the first of a kind takes, and the next: the slow and the quick end of a span.

    Examples
    --------
    >>> hours_text((0.25, 0.8)), hours_text((8.1, 16.2)), hours_text((0.0, 0.0))
    ('48 min the first time, 15 min the next', '16 h the first time, 8 h the next', 'none')
    """
    if span[1] == 0.0:
        return "none"
    after, first, unit = _numbers(_HOUR_S * span[0], _HOUR_S * span[1])
    return f"{first} {unit} the first time, {after} {unit} the next"


def _one(hours: float) -> str:
    """Return a number of hours as people say it."""
    _, one, unit = _numbers(_HOUR_S * hours, _HOUR_S * hours)
    return f"{one} {unit}" if hours else "none"


def machine_text(costs: Costs) -> str:
    """Return what the machine takes; strips off a roll need none."""
    times = costs.machine
    if costs.by_hand:
        return "no machine"
    return (
        f"cutting {time_text(times.cut_s)}, engraving {time_text(times.engrave_s)}, moves "
        f"{time_text(times.travel_s)}; {time_text(costs.machine_s)} {_in_all(costs)}"
    )


def difficulty_text(costs: Costs) -> str:
    """Return how difficult the assembly is, and why."""
    figures = costs.difficulty
    return (
        f"{figures.word} ({figures.score:.1f} of 10): {figures.unders:.1f} strands to slide a "
        f"piece under, ribbons of {figures.width_mm:.0f} mm"
    )


def _money(costs: Costs) -> str:
    """Return what all of it costs."""
    bare = costs.planned or costs.by_hand
    sheets = "material" if bare else agree(len(costs.sheets) + (costs.beside or 0), "{n} sheet[|s]")
    text = f"{sheets} {price_text(costs.sheet_price)}, hardware {price_text(costs.hardware_price)}"
    if costs.machine_price is not None:
        text += f", machine {price_text(costs.machine_price)}"
    return f"{text}; {price_text(costs.price)} {_in_all(costs)}"


def _in_all(costs: Costs) -> str:
    """Say that a sum counts everything, or what it does not."""
    return "in all" + (f" without {' and '.join(costs.without)}" if costs.without else "")


def costs_text(costs: Costs) -> str:
    """Return everything in a line, for a terminal."""
    return (
        f"costs: {machine_text(costs)}; assembly {hours_text(costs.assembly.hours)}, "
        f"{costs.difficulty.word}; {_money(costs)}"
    )


def cost_rows(costs: Costs) -> tuple[tuple[str, str], ...]:
    """Return names and texts, as the manual and ``inspect`` list them."""
    pace = ", ".join(
        f"{one.each_s:.3g} s {one.words} ({one.count})" for one in costs.assembly.actions
    )
    return (
        ("Difficulty", difficulty_text(costs)),
        (
            "Time",
            f"{hours_text(costs.assembly.hours)}; practised hands take "
            f"{_one(costs.assembly.practised_h)}, at {pace}",
        ),
        ("Machine", machine_text(costs)),
        ("Cost", _money(costs)),
    )
