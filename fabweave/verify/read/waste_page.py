"""Read the page on material: the rows of its first table, if nothing on the page can hide them."""

import re
from html.parser import HTMLParser
from pathlib import Path

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_text

#: What the page is made of: nothing that runs, loads, moves on or leads away.
_PLAIN = frozenset({
    "html", "head", "body", "meta", "title", "style", "h1", "h2", "p", "table", "thead", "tbody",
    "tfoot", "tr", "th", "td", "div", "span", "pre", "code", "figure", "figcaption", "img", "ul",
    "li", "a", "svg", "g", "polyline", "polygon", "path", "circle", "line", "rect", "text",
    "details", "summary", "br", "small", "strong", "em",
})  # fmt: skip
_DRAWN = frozenset({
    "alt", "aria-label", "charset", "class", "cx", "cy", "d", "fill", "font-size", "height", "lang",
    "name", "content", "points", "r", "role", "stroke", "stroke-dasharray", "stroke-width",
    "text-anchor", "viewbox", "width", "x", "x1", "x2", "y", "y1", "y2",
})  # fmt: skip
_WIDTH = re.compile(r"(width|background):[\w.%#]+")
_HIDING = re.compile(r"display:\s*none|visibility|opacity|url\(|@import|position", re.IGNORECASE)
#: Files of the job beside the page, and places on it.
_BESIDE = re.compile(r"#[\w-]*|(?!//)(?!.*\.\.)(?:[\w.,=+-]+/)*[\w.,=+ -]+")


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.rows: list[list[str]] = []
        self._tables = 0
        self._in_cell = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in _PLAIN:
            raise ReadError(f"it has <{tag}>, which the page does not need")
        for name, value in attrs:
            text = value or ""
            good = name in _DRAWN and not (tag == "meta" and name == "content" and "url" in text)
            if name == "style":
                good = all(_WIDTH.fullmatch(part) for part in text.split(";") if part)
            elif name in ("href", "src"):
                good = _BESIDE.fullmatch(text) is not None or text.startswith("data:image/png;")
            if not good:
                raise ReadError(f"<{tag}> has {name}={text[:40]!r}, which the page does not need")
        self._tables += tag == "table"
        if self._tables == 1 and tag == "tr":
            self.rows.append([])
        self._in_cell = tag == "td"
        if self._tables == 1 and tag == "td" and self.rows:
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if tag == "table":
            self._tables = max(self._tables, 1) + 1
        self._in_cell = self._in_cell and tag != "td"

    def handle_data(self, data: str) -> None:
        if self._tables == 1 and self._in_cell and self.rows:
            self.rows[-1][-1] += data
        elif self.lasttag == "style" and _HIDING.search(data):
            raise ReadError("its style may hide something, or load it")


def read_waste_page(path: Path) -> tuple[tuple[str, ...], ...]:
    """Return the rows of the table of sheets, cell by cell.

    Raises
    ------
    ReadError
        If there is no table, or anything on the page that runs, loads, hides or leads away.
    """
    page = _Page()
    page.feed(read_text(path))
    rows = tuple(tuple(row) for row in page.rows if row)
    if not rows:
        raise ReadError("it has no table of sheets")
    return rows
