"""Show costs as a section of a web page: a table, and what it rests on."""

import html
from collections.abc import Sequence

from fabweave.report.costs.costs import Costs
from fabweave.report.costs.money import price_text
from fabweave.report.costs.texts import difficulty_text, hours_text, time_text


def costs_section(costs: Costs, sheet_names: Sequence[str]) -> str:
    """Return costs as a section: each sheet, all together, and what they rest on.

    Parameters
    ----------
    costs : Costs
    sheet_names : sequence of str
    """
    heads = ("Sheet", "Cutting", "Engraving", "Moves", "Material")
    rows = [
        (
            name,
            time_text(sheet.machine.cut_s),
            time_text(sheet.machine.engrave_s),
            time_text(sheet.machine.travel_s),
            price_text(sheet.price),
        )
        for name, sheet in zip(sheet_names, costs.sheets, strict=True)
    ]
    times = costs.machine
    total = (
        "all",
        time_text(times.cut_s),
        time_text(times.engrave_s),
        time_text(times.travel_s),
        price_text(costs.sheet_price),
    )
    figures = [
        ("Cutting", time_text(times.cut_s), ""),
        ("Engraving", time_text(times.engrave_s), ""),
        ("Moves with the beam off", time_text(times.travel_s), ""),
        ("The machine in all", time_text(costs.machine_s), price_text(costs.machine_price)),
        ("Assembly", hours_text(costs.assembly.hours), ""),
        ("Sheets", "", price_text(costs.sheet_price)),
        ("Hardware", "", price_text(costs.hardware_price)),
    ]
    actions = [
        (
            action.words,
            action.count,
            f"{action.each_s:g} s",
            f"{action.count * action.each_s / 60:.0f} min",
        )
        for action in costs.assembly.actions
    ]
    told = "".join(f"<li>{html.escape(text)}</li>" for text in costs.assumptions)
    return (
        "<h2>Costs</h2>\n"
        f"<table><thead>{_row(('', 'Time', 'Money'), 'th')}</thead>\n<tbody>\n"
        + "\n".join(map(_row, figures))
        + f"\n</tbody><tfoot>{_row(('All', '', price_text(costs.price)))}</tfoot></table>\n"
        f"<p>Difficulty: {html.escape(difficulty_text(costs))}.</p>\n"
        "<h2>Time of the machine</h2>\n"
        f"<table><thead>{_row(heads, 'th')}</thead>\n<tbody>\n"
        + "\n".join(map(_row, rows))
        + f"\n</tbody><tfoot>{_row(total)}</tfoot></table>\n"
        "<h2>Time of hands</h2>\n"
        f"<table><thead>{_row(('Practised hands take', 'Times', 'Each', 'All'), 'th')}</thead>\n"
        "<tbody>\n" + "\n".join(map(_row, actions)) + "\n</tbody></table>\n"
        f"<h2>What this rests on</h2>\n<ul>{told}</ul>\n"
    )


def _row(cells: Sequence[object], tag: str = "td") -> str:
    """Return a row of a table."""
    return "<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"
