"""Read from the settings what each thread is cut from."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fabweave.verify.crossing_map import CrossingMap

_NAMES = ("warp", "weft")


@dataclass(frozen=True)
class Supply:
    """What a thread is cut from, as the settings say; None where they say nothing."""

    material: str | None = None
    thickness_mm: float | None = None
    gap_mm: float | None = None


def thread_supplies(options: Mapping[str, Any], plan: CrossingMap) -> dict[int, Supply]:
    """Return the supply of each thread, by its id."""
    settings = {key: by_bunch(options.get(key)) for key in ("material", "thickness", "gap")}
    supplies = {}
    for thread in plan.threads:
        material, thickness, gap = (
            values.get(thread.bunch, values.get(None)) for values in settings.values()
        )
        supplies[thread.id] = Supply(material, length_of(thickness), length_of(gap))
    return supplies


def by_bunch(text: object) -> dict[int | None, str]:
    """Return a setting's value for each bunch that it names; one value for all under None.

    Examples
    --------
    >>> by_bunch("warp=card,weft=birch-veneer"), by_bunch("2mm")
    ({0: 'card', 1: 'birch-veneer'}, {None: '2mm'})
    """
    if not isinstance(text, str):
        return {}
    if "=" not in text:
        return {None: text}
    values: dict[int | None, str] = {}
    for part in text.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        number = _NAMES.index(name) if name in _NAMES else int(name) if name.isdecimal() else -1
        values[number] = value
    return values


def length_of(text: str | None) -> float | None:
    """Return a length as fabweave writes it."""
    try:
        return None if text is None else float(text.removesuffix("mm"))
    except ValueError:
        return None
