"""Read a page of a job as its reader sees it: every text in order, and nothing hidden."""

import hashlib
import re
from collections.abc import Collection
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_text

#: What the page is made of: nothing that runs, loads, moves on or leads away.
_PLAIN = frozenset({
    "html", "head", "body", "meta", "title", "style", "h1", "h2", "p", "table", "thead", "tbody",
    "tfoot", "tr", "th", "td", "div", "span", "pre", "code", "figure", "figcaption", "img", "ul",
    "li", "a", "svg", "polyline", "circle", "line", "text", "details", "summary", "br", "small",
    "strong", "em",
})  # fmt: skip
#: Their texts stand for themselves; those of others belong to what is around them.
_BLOCKS = frozenset({
    "title", "style", "h1", "h2", "h3", "p", "th", "td", "li", "pre", "figcaption", "summary",
    "text",
})  # fmt: skip
#: What is seen beside texts, with the attribute that says what.
_SEEN = {
    "tr": "class", "img": "src", "a": "href", "polyline": "points", "circle": "", "span": "style",
    "div": "class", "svg": "viewbox",
}  # fmt: skip
_DRAWN = frozenset({
    "alt", "aria-label", "charset", "class", "content", "cx", "cy", "fill", "font-size", "height",
    "lang", "name", "points", "r", "role", "stroke", "stroke-dasharray", "text-anchor", "viewbox",
    "width", "x", "x1", "x2", "y", "y1", "y2",
})  # fmt: skip
#: Of these attributes nothing else is needed, and other values could hide what has them.
_VALUES = {
    "fill": ("none", "#0072b2"), "stroke": ("#444", "#999"), "font-size": ("12",), "r": ("4",),
    "stroke-dasharray": ("5 4",), "text-anchor": ("start", "middle", "end"),
    "name": ("viewport",), "content": ("width=device-width",),
}  # fmt: skip
_WIDTH = re.compile(r"width:[\d.]+%")
#: The SHA-256 of the page's style, which decides what of it is seen. A change there changes it.
STYLE = "33f200dcd8106dae443d456671823541ae6648453faeeec89b4ad8e04cf8568b"
#: Files of the job beside the page.
_BESIDE = re.compile(r"(?!//)(?!.*\.\.)(?:[\w.,=+-]+/)*[\w.,=+ -]+")
#: The page of a job of tens of thousands of pieces has not so many texts.
_MOST = 1_000_000


class Seen(NamedTuple):
    """Something that a reader of the page sees: an element, and its text or what it shows."""

    tag: str
    text: str


class _Page(HTMLParser):
    def __init__(self, tags: Collection[str], attributes: Collection[str]) -> None:
        super().__init__(convert_charrefs=True)
        self.seen: list[Seen] = []
        self._tags, self._attributes = tags, attributes
        #: Whether a link is open, and whether there is anything to tap in it so far.
        self._link, self._linked = False, False
        #: The blocks that are open, each with its place among what is seen.
        self._open: list[tuple[str, int]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self._tags:
            raise ReadError(f"it has <{tag}>, which the page does not need")
        known = {name: value or "" for name, value in attrs}
        if len(known) < len(attrs):
            raise ReadError(f"<{tag}> has an attribute twice")
        for name, text in known.items():
            good = name in self._attributes and text in _VALUES.get(name, (text,))
            if name == "style":
                good = tag == "span" and _WIDTH.fullmatch(text) is not None
            elif name in ("href", "src"):
                good = _BESIDE.fullmatch(text) is not None
            if not good:
                raise ReadError(f"<{tag}> has {name}={text[:40]!r}, which the page does not need")
        if tag == "a":
            if self._link:
                raise ReadError("it has a link in a link")
            self._link, self._linked = True, False
        self._linked |= tag == "img"
        if tag in _BLOCKS:
            self._open.append((tag, len(self.seen)))
            self._add(tag, "")
        elif tag in _SEEN:
            key = _SEEN[tag]
            self._add(tag, known.get(key, "") if key else f"{known.get('cx')},{known.get('cy')}")
        elif tag == "br":
            self.handle_data(" ")

    def handle_endtag(self, tag: str) -> None:
        if tag in _BLOCKS and (not self._open or self._open.pop()[0] != tag):
            raise ReadError(f"</{tag}> ends what did not begin")
        if tag == "a":
            if not self._linked:
                raise ReadError("it has a link with nothing to tap")
            self._link = False

    def handle_data(self, data: str) -> None:
        self._linked |= bool(data.strip())
        if self._open:
            at = self._open[-1][1]
            self.seen[at] = Seen(self.seen[at].tag, self.seen[at].text + data)
        elif data.strip():
            self._add("text beside all others", data)

    def _add(self, tag: str, text: str) -> None:
        if len(self.seen) >= _MOST:
            raise ReadError(f"it has more than {_MOST} texts")
        self.seen.append(Seen(tag, text))


def read_waste_page(path: Path) -> tuple[Seen, ...]:
    """Return what is seen on the page on material, in order.

    Raises
    ------
    ReadError
        If there is no table, or anything on the page that runs, loads, hides or leads away.
    """
    seen = read_page(path, STYLE)
    if not any(tag == "tr" for tag, _ in seen):
        raise ReadError("it has no table of sheets")
    return seen


def read_page(
    path: Path,
    style: str,
    tags: Collection[str] = _PLAIN,
    attributes: Collection[str] = _DRAWN,
) -> tuple[Seen, ...]:
    """Return what is seen on a page, in order, spaces between words told as one.

    Parameters
    ----------
    path : Path
    style : str
        The SHA-256 of its style.
    tags, attributes : collection of str
        What it may have.

    Raises
    ------
    ReadError
        If there is anything on the page that runs, loads, hides or leads away.
    """
    page = _Page(tags, attributes)
    page.feed(read_text(path))
    # Closing the parser would look at what is left again and again: a whole page leaves nothing.
    if page.rawdata.strip():
        raise ReadError("it ends within a tag")
    styles = [text for tag, text in page.seen if tag == "style"]
    for text in styles:
        if (digest := hashlib.sha256(text.encode()).hexdigest()) != style:
            raise ReadError(f"its style is unknown ({digest[:16]}…): it may hide something")
    return tuple(map(spaced, (one for one in page.seen if one.tag != "style")))


def spaced(one: Seen) -> Seen:
    """Return what is seen with one space between words, but for titles and what is preformatted."""
    return one if one.tag in ("pre", "title") else Seen(one.tag, " ".join(one.text.split()))


def row(*cells: object, tag: str = "td", kind: str = "") -> tuple[Seen, ...]:
    """Return how a row of a table is seen: ``tag`` is that of its cells, ``kind`` its class."""
    return (Seen("tr", kind), *(Seen(tag, str(cell)) for cell in cells))


def bar(share: str) -> tuple[Seen, Seen]:
    """Return how a bar is seen that is filled to a share."""
    return Seen("div", "bar"), Seen("span", f"width:{share}")
