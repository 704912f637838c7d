"""Say what the page on material should show of times and money."""

from collections.abc import Iterator, Sequence
from typing import Any

from fabweave.verify.measure.words import difficulty_words, price_words, time_words
from fabweave.verify.read.waste_page import Seen, row


def costs_shown(estimate: dict[str, Any], names: dict[int, str]) -> Iterator[Seen]:
    """Yield what is seen of the estimate.

    Parameters
    ----------
    estimate : dict
        That of waste.json.
    names : dict from int to str
        What each sheet is called.
    """
    cut, engrave, moves, all_s = (
        time_words(estimate[f"{what}_s"]) for what in ("cut", "engrave", "travel", "machine")
    )
    sheets, hardware, machine, price = (
        price_words(estimate[key])
        for key in ("sheet_price", "hardware_price", "machine_price", "price")
    )
    hours = time_words([3600.0 * end for end in estimate["assembly"]["hours"]])
    yield Seen("h2", "Costs")
    yield from row("", "Time", "Money", tag="th")
    for cells in (
        ("Cutting", cut, ""),
        ("Engraving", engrave, ""),
        ("Moves with the beam off", moves, ""),
        ("The machine in all", all_s, machine),
        ("Assembly", hours, ""),
        ("Sheets", "", sheets),
        ("Hardware", "", hardware),
        ("All", "", price),
    ):
        yield from row(*cells)
    yield Seen("p", f"Difficulty: {difficulty_words(estimate)}.")
    yield Seen("h2", "Time of the machine")
    yield from row("Sheet", "Cutting", "Engraving", "Moves", "Material", tag="th")
    for one in estimate["sheets"]:
        times = (time_words(one[key]) for key in ("cut_s", "engrave_s", "travel_s"))
        yield from row(names[one["sheet"]], *times, price_words(one["price"]))
    yield from row("all", cut, engrave, moves, sheets)
    yield Seen("h2", "Time of hands")
    yield from row("Practised hands take", "Times", "Each", "All", tag="th")
    for action in estimate["assembly"]["actions"]:
        count, each = action["count"], action["each_s"]
        yield from row(action["words"], count, f"{each:g} s", f"{count * each / 60:.0f} min")
    yield Seen("h2", "What this rests on")
    yield from (Seen("li", text) for text in estimate["assumptions"])


def rings_shown(sheets: Sequence[dict[str, Any]]) -> Iterator[Seen]:
    """Yield what is seen of what rings take; nothing without rings.

    Parameters
    ----------
    sheets : sequence of dict
        The sheets of rings in waste.json.
    """
    if not sheets:
        return
    yield Seen("h2", "Rings")
    yield Seen(
        "p",
        "The rings around openings are cut from sheets of their own, in rim/. They come on top of "
        "all sheets, times and prices above; their fasteners are among those to buy.",
    )
    yield from row(
        "Sheet", "Size, mm", "Pieces", "Pieces, cm²", "Cutting", "Engraving", "Moves", "Price",
        tag="th",
    )  # fmt: skip
    for one in sheets:
        yield from row(
            one["sheet"],
            f"{one['width_mm']:g} × {one['height_mm']:g}, {one['material']} "
            f"{one['thickness_mm']:g}",
            one["pieces"],
            f"{one['piece_area_mm2'] / 100:.1f}",
            *(time_words(one[key]) for key in ("cut_s", "engrave_s", "travel_s")),
            price_words(one["price"]),
        )
