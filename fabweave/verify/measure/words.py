"""Say counts, times, prices and verdicts in the words in which people read them."""

from typing import Any

#: What each verdict answers to whoever asks whether it can be built.
ANSWERS = {"makeable": "Yes.", "with care": "Yes, with care.", "not makeable": "No."}
#: Papers by their names: width and height.
PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
#: Up to so many times this, minutes are said; then hours.
_HOUR_S, _MINUTES_UP_TO_H = 3600.0, 3.0
#: Numbers below this have decimals.
_LARGE = 10.0
#: So many reasons of a verdict are said on paper.
_REASONS = 3


def counted(number: object, one: str, many: str | None = None) -> str:
    """Return a number with the word for one, or for any other number.

    Examples
    --------
    >>> counted(1, "sheet"), counted(2, "sheet"), counted(0, "is", "are")
    ('1 sheet', '2 sheets', '0 are')
    """
    return f"{number} {one if number == 1 else many or f'{one}s'}"


def time_words(span_s: list[float] | None) -> str:
    """Return a range of seconds in minutes or hours.

    Examples
    --------
    >>> time_words([25.0, 96.0]), time_words([32400.0, 100800.0]), time_words([0.0, 0.0])
    ('0.4 to 1.6 min', '9 to 28 h', 'none')
    """
    if span_s is None:
        return "unknown"
    if span_s[1] == 0.0:
        return "none"
    unit, size = ("h", _HOUR_S) if span_s[1] > _MINUTES_UP_TO_H * _HOUR_S else ("min", 60.0)
    digits = 1 if span_s[1] / size < _LARGE else 0
    return f"{span_s[0] / size:.{digits}f} to {span_s[1] / size:.{digits}f} {unit}"


def price_words(price: dict[str, Any] | None) -> str:
    """Return a price, which may be a range, with its currency.

    Examples
    --------
    >>> price_words({"low": 1.4, "high": 3.5, "currency": "EUR"}), price_words(None)
    ('1.40 to 3.50 EUR', 'unknown')
    """
    if price is None:
        return "unknown"
    digits = 2 if price["high"] < _LARGE else 0
    ends = [f"{price[end]:.{digits}f}" for end in ("low", "high")]
    return f"{' to '.join(dict.fromkeys(ends))} {price['currency']}".rstrip()


def range_words(value: float | list[float]) -> str:
    """Return a value, or a least and a greatest one.

    Examples
    --------
    >>> range_words([2.0, 5.5]), range_words([3.0, 3.0]), range_words(0.5)
    ('2 to 5.5', '3', '0.5')
    """
    ends = value if isinstance(value, list) else [value]
    return " to ".join(dict.fromkeys(f"{end:g}" for end in ends))


def difficulty_words(estimate: dict[str, Any]) -> str:
    """Return how difficult the assembly is."""
    figures = estimate["difficulty"]
    return (
        f"{figures['word']} ({figures['score']:.1f} of 10): {figures['unders']:.1f} strands to "
        f"slide a piece under, ribbons of {figures['width_mm']:.0f} mm"
    )


def machine_words(estimate: dict[str, Any]) -> str:
    """Return what the machine takes."""
    cut, engrave, moves, in_all = (
        time_words(estimate[f"{what}_s"]) for what in ("cut", "engrave", "travel", "machine")
    )
    return f"cutting {cut}, engraving {engrave}, moves {moves}; {in_all} in all"


def money_words(estimate: dict[str, Any]) -> str:
    """Return what all of it costs."""
    rent = estimate["machine_price"]
    machine = "" if rent is None else f", machine {price_words(rent)}"
    return (
        f"{counted(len(estimate['sheets']), 'sheet')} {price_words(estimate['sheet_price'])}, "
        f"hardware {price_words(estimate['hardware_price'])}{machine}; "
        f"{price_words(estimate['price'])} in all"
    )


def costs_words(estimate: dict[str, Any]) -> str:
    """Return the line on costs that job.toml has."""
    hours = time_words([3600.0 * end for end in estimate["assembly"]["hours"]])
    return (
        f"costs: {machine_words(estimate)}; assembly {hours}, {estimate['difficulty']['word']}; "
        f"{money_words(estimate)}"
    )


def verdict_words(verdict: dict[str, Any]) -> str:
    """Return a verdict with the first of its reasons."""
    reasons = verdict["reasons"]
    told = [
        reason["text"] + (f" ({reason['advice']})" if reason["advice"] else "")
        for reason in reasons[:_REASONS]
    ]
    if len(reasons) > _REASONS:
        told.append(f"and {len(reasons) - _REASONS} more")
    return f"{ANSWERS[verdict['level']]} {'; '.join(told)}".strip()
