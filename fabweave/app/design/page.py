"""Show designs side by side: a page with their pictures, figures and scatter plots, and tables."""

import base64
import csv
import html
import io
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.app.design.candidate import Candidate, Figures, Tried
from fabweave.app.design.front import objectives, pareto_front
from fabweave.app.design.rounds import Search
from fabweave.core.messages import agree
from fabweave.core.records import to_json
from fabweave.mesh.io.files import states_up
from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.report.costs.texts import hours_text
from fabweave.report.verdict import QUESTION, VERDICTS

SCHEMA = "fabweave.design/1"

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 74rem;
  padding: 0 1rem; color: #1b1b1b }
h1 { font-size: 1.6rem } h2 { font-size: 1.2rem; margin-top: 2rem }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(16.5rem, 1fr)); gap: 1rem }
.card { border: 1px solid #ccc; border-top: .5rem solid #009e73; padding: .6rem .8rem }
.card.care { border-top-color: #e69f00 } .card.no { border-top-color: #999; color: #666;
  background: #f4f4f4 }
.card.best { outline: 3px solid #0072b2 }
.card img { width: 100% } .card.no img { filter: grayscale(1) contrast(.6) }
.card h3 { font-size: 1rem; margin: .2rem 0 } .card p { margin: .3rem 0; font-size: .9rem }
code { display: block; background: #f4f2ee; padding: .4rem; font-size: .78rem;
  overflow-wrap: anywhere; user-select: all }
table { border-collapse: collapse; width: 100%; font-size: .88rem }
th, td { text-align: right; padding: .25rem .5rem; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left }
tr.no td { color: #888 }
.why { border-left: .4rem solid #d55e00; padding: .2rem .8rem; background: #fff4ec }
.plots { display: flex; flex-wrap: wrap; gap: 1rem }
.word { white-space: nowrap }
@media print { .card { break-inside: avoid } }
"""
#: Columns of the tables: key, heading, digits.
_COLUMNS = (
    ("pieces", "pieces", 0),
    ("kinds", "kinds", 0),
    ("crossings", "crossings", 0),
    ("sheets", "sheets", 0),
    ("use", "used", 2),
    ("narrowest_mm", "narrowest, mm", 1),
    ("median_mm", "ribbons, mm", 1),
    ("longest_mm", "longest piece, mm", 0),
    ("likeness_mm", "off the model, mm", 1),
    ("broken", "broken conditions", 0),
    ("hours", "assembly, h", 1),
    ("cutting_h", "machine, h", 1),
    ("price", "price", 0),
)
#: The figures that are ranges.
_RANGES = ("hours", "cutting_h", "price")
#: What is plotted over what: key and name across, key and name upward.
_PLOTS = (
    ("pieces", "pieces", "likeness_mm", "off the model, mm"),
    ("pieces", "pieces", "narrowest_mm", "narrowest ribbon, mm"),
    ("hours", "assembly, h", "narrowest_mm", "narrowest ribbon, mm"),
    ("sheets", "sheets", "use", "share of the sheets used"),
)
_PLOT_PX, _EDGE_PX = (340, 240), 44
_SHORT_WORD = 24
_COLOURS = {"makeable": "#009e73", "with care": "#e69f00", "not makeable": "#aaaaaa"}


def best_of(candidates: Sequence[Candidate]) -> list[bool]:
    """Return which designs no other is better than in every way."""
    return pareto_front(objectives(candidates)).tolist() if candidates else []


def design_page(title: str, found: Search) -> str:
    """Return a page that opens by itself: a card for each design, plots, and a table.

    Parameters
    ----------
    title : str
        What is woven.
    found : Search

    Returns
    -------
    str
        HTML, with the pictures in it.
    """
    tried, candidates = found.tried, found.candidates
    best = best_of(candidates)
    # The best first, then the others that can be built, from few pieces to many.
    order = sorted(
        range(len(tried)),
        key=lambda at: (
            not best[at],
            not candidates[at].makeable,
            _number(candidates[at], "pieces"),
        ),
    )
    cards = "\n".join(
        _card(tried[at], f"D{number}", best=best[at]) for number, at in enumerate(order, start=1)
    )
    names = {at: f"D{number}" for number, at in enumerate(order, start=1)}
    plots = "".join(_plot(candidates, names, best, *axes) for axes in _PLOTS)
    rows = "\n".join(_row(candidates[at], names[at]) for at in order)
    heads = "".join(f"<th>{html.escape(head)}</th>" for _, head, _ in _COLUMNS)
    why = f'<p class="why">{html.escape(found.why)}</p>\n' if found.why else ""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>{html.escape(title)}: designs</title><style>{_STYLE}</style></head><body>\n"
        f"<h1>{html.escape(title)}: {len(tried)} designs</h1>\n"
        f"<p>{found.makeable or 'None'} of them can be built. {_same(found)}A blue frame marks "
        "those that no other design is better than in work, likeness, narrowest ribbon and sheets "
        "at once. Grey ones cannot be built from this material, and say why. Sheets are foretold."
        f"{html.escape(lying_note(found))}</p>\n"
        f"{why}"
        f'<div class="cards">\n{cards}\n</div>\n{_instead(found.instead)}<h2>Compared</h2>\n'
        f'<div class="plots">{plots}</div>\n<h2>Figures</h2>\n'
        f"<table><thead><tr><th>design</th>{heads}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>\n</body></html>\n"
    )


def lying_note(found: Search) -> str:
    """Say what to do where pictures show the model lying; nothing where its up axis is known."""
    model = found.designs[0]
    if is_shape(model.mesh) or states_up(model.mesh) or model.up is not None:
        return ""
    return " If the pictures show it lying, add --up y or --up x."


def _same(found: Search) -> str:
    """Say how many more were tried that are not shown; nothing if none."""
    if not found.same:
        return ""
    return agree(found.same, "{n} more [was|were] tried and came to the same as one of these. ")


def _instead(tried: Sequence[Tried]) -> str:
    """Return the cards of what can be built in place of what was asked for; nothing if nothing."""
    built = [one for one in tried if one.candidate.makeable]
    if not built:
        return ""
    cards = "\n".join(_card(one, f"H{at}", best=False) for at, one in enumerate(built, start=1))
    return f'<h2>What would help</h2>\n<div class="cards">\n{cards}\n</div>\n'


def _card(tried: Tried, name: str, *, best: bool) -> str:
    """Return the card of a design."""
    candidate, figures = tried.candidate, tried.candidate.figures
    verdict = candidate.verdict
    kind = {"makeable": "", "with care": " care", "not makeable": " no"}[verdict.level]
    picture = ""
    if tried.picture is not None:
        data = base64.b64encode(tried.picture).decode()
        picture = f'<img alt="{html.escape(candidate.name)}" src="data:image/png;base64,{data}">'
    told = f"<p>{html.escape(words(figures))}</p>" if figures is not None else ""
    why = "; ".join(reason.text for reason in verdict.reasons[:2])
    return (
        f'<div class="card{kind}{" best" * best}">{picture}'
        f"<h3>{name}: {_unbroken(candidate.name)}</h3>{told}"
        f"<p><strong>{QUESTION} {VERDICTS[verdict.level]}</strong> {html.escape(why)}</p>"
        f"<code>{_unbroken(candidate.command)}</code></div>"
    )


def _unbroken(text: str) -> str:
    """Return a text of which short words are kept whole: a line may end in no hyphen of theirs."""
    return " ".join(
        f'<span class="word">{html.escape(word)}</span>'
        if len(word) < _SHORT_WORD
        else html.escape(word)
        for word in text.split(" ")
    )


def told_design(candidate: Candidate) -> str:
    """Return what a design came to, in a line."""
    figures = "" if candidate.figures is None else f": {brief(candidate.figures)}"
    return f"{candidate.name}{figures}; {candidate.verdict.level}"


def words(figures: Figures) -> str:
    """Return what a design comes to, in a few words."""
    text = (
        f"{figures.pieces} pieces, ribbons {figures.narrowest_mm:.1f} to {figures.widest_mm:.0f} "
        f"mm wide (mostly {figures.median_mm:.0f}), about "
        f"{agree(figures.sheets, '{n} sheet[|s]')}"
    )
    if figures.hours is not None:
        text += f", {hours_text(figures.hours)} of assembly"
    if figures.likeness_mm is not None:
        text += f", at most {figures.likeness_mm:.0f} mm off the model"
    if figures.lost:
        text += f" ({'; '.join(figures.lost)})"
    return text


def _ends(candidate: Candidate, key: str) -> tuple[float, ...]:
    """Return a figure of a design: one number, the ends of a range, or nothing if not known."""
    value = None if candidate.figures is None else getattr(candidate.figures, key)
    if value is None:
        return ()
    return value if isinstance(value, tuple) else (value,)


def brief(figures: Figures) -> str:
    """Return what a design comes to in the fewest words; its sheets are foretold."""
    hours = figures.hours
    time = "" if hours is None else f", {hours_text(hours)} of assembly"
    return (
        f"{agree(figures.pieces, '{n} piece[|s]')} on about "
        f"{agree(figures.sheets, '{n} sheet[|s]')}"
        f"{time}, ribbons {figures.narrowest_mm:.1f} to {figures.widest_mm:.0f} mm wide"
    )


def _number(candidate: Candidate, key: str) -> float:
    """Return a figure of a design; the middle of a range, and infinite where it is not known."""
    ends = _ends(candidate, key)
    return sum(ends) / len(ends) if ends else np.inf


def _row(candidate: Candidate, name: str) -> str:
    """Return the row of a design in the table."""
    cells = [f"{name}: {candidate.name}"]
    for key, _, digits in _COLUMNS:
        cells.append(" to ".join(f"{end:.{digits}f}" for end in _ends(candidate, key)))
    kind = "" if candidate.makeable else ' class="no"'
    return f"<tr{kind}>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"


def _plot(
    candidates: Sequence[Candidate], names: dict[int, str], best: Sequence[bool],
    across: str, across_name: str, upward: str, upward_name: str,
) -> str:  # fmt: skip
    """Draw the designs that have both figures as dots; nothing where there are fewer than two."""
    x = np.array([_number(candidate, across) for candidate in candidates])
    y = np.array([_number(candidate, upward) for candidate in candidates])
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(known) < 2:
        return ""
    (wide, high), edge = _PLOT_PX, _EDGE_PX
    most_x, most_y = (max(float(values[known].max()), 1e-9) for values in (x, y))
    parts = [
        f'<line x1="{edge}" y1="{high - edge}" x2="{wide - 8}" y2="{high - edge}" stroke="#888"/>',
        f'<line x1="{edge}" y1="8" x2="{edge}" y2="{high - edge}" stroke="#888"/>',
        f'<text x="{(edge + wide) / 2}" y="{high - 8}" font-size="12" text-anchor="middle">'
        f"{html.escape(across_name)}</text>",
        f'<text x="12" y="{(high - edge) / 2}" font-size="12" text-anchor="middle" '
        f'transform="rotate(-90 12 {(high - edge) / 2})">{html.escape(upward_name)}</text>',
        f'<text x="{wide - 8}" y="{high - edge + 16}" font-size="11" text-anchor="end">'
        f"{most_x:.3g}</text>",
        f'<text x="{edge - 4}" y="18" font-size="11" text-anchor="end">{most_y:.3g}</text>',
        f'<text x="{edge - 4}" y="{high - edge}" font-size="11" text-anchor="end">0</text>',
    ]
    for at in known.tolist():
        left = edge + (wide - edge - 20) * x[at] / most_x
        top = high - edge - (high - edge - 20) * y[at] / most_y
        ring = ' stroke="#0072b2" stroke-width="3"' if best[at] else ""
        parts.append(
            f'<circle cx="{left:.1f}" cy="{top:.1f}" r="5" '
            f'fill="{_COLOURS[candidates[at].verdict.level]}"{ring}><title>{names[at]}: '
            f"{html.escape(candidates[at].name)}</title></circle>"
        )
        if best[at]:
            parts.append(
                f'<text x="{left + 8:.1f}" y="{top - 5:.1f}" font-size="11">{names[at]}</text>'
            )
    return (
        f'<svg width="{wide}" height="{high}" viewBox="0 0 {wide} {high}" role="img" '
        f'aria-label="{html.escape(upward_name)} over {html.escape(across_name)}">'
        f"{''.join(parts)}</svg>"
    )


def design_json(title: str, found: Search) -> str:
    """Return what ``design.json`` holds: every design with its figures, and whether it is best.

    Where fewer than two can be built, ``why`` says why; where none can, ``instead`` holds what was
    tried otherwise.
    """
    candidates = found.candidates
    rows: list[dict[str, Any]] = [
        {**to_json(candidate), "best": best}
        for candidate, best in zip(candidates, best_of(candidates), strict=True)
    ]
    document: dict[str, Any] = {"schema": SCHEMA, "units": "mm", "title": title, "designs": rows}
    if found.why:
        document["why"] = found.why
        document["instead"] = [to_json(one.candidate) for one in found.instead]
    return json.dumps(document, indent=1) + "\n"


def design_csv(tried: Sequence[Tried]) -> str:
    """Return the figures as a table: a design a row."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    columns = [
        (key, [f"{key}_low", f"{key}_high"] if key in _RANGES else [key]) for key, _, _ in _COLUMNS
    ]
    heads = [head for _, part in columns for head in part]
    writer.writerow(["key", "name", "verdict", *heads, "command"])
    for one in tried:
        candidate = one.candidate
        cells: list[float | str] = []
        for key, part in columns:
            cells += _ends(candidate, key) or [""] * len(part)
        writer.writerow(
            [candidate.key, candidate.name, candidate.verdict.level, *cells, candidate.command]
        )
    return table.getvalue()
