"""Lay text, lines and pictures on the pages of a PDF: all that the manual needs of reportlab."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from itertools import groupby
from unicodedata import normalize

import numpy as np
from reportlab.pdfbase.cidfonts import UnicodeCIDFont
from reportlab.pdfbase.pdfdoc import PDFArray, PDFDictionary, PDFName, PDFStream, PDFZCompress
from reportlab.pdfbase.pdfmetrics import registerFont, stringWidth
from reportlab.pdfgen.canvas import Canvas

from fabweave.core.arrays import FloatArray
from fabweave.sheet.write.full_size import FullSizeCanvas
from fabweave.show.manual.painting import Painted

#: Width and height of the papers, in points.
PAPERS = {"a4": (595.28, 841.89), "letter": (612.0, 792.0)}
#: Free border, and height of the heading, in points.
MARGIN, _HEADING = 36.0, 26.0
_PLAIN, _BOLD = "Helvetica", "Helvetica-Bold"
#: Fonts, and what of Unicode each has. Those of East Asia are not in the PDF: readers bring them.
_FONTS = {_PLAIN: "cp1252", "STSong-Light": "gbk", "HYSMyeongJo-Medium": "cp949"}
#: Text that is read at arm's length, and the distance of its lines as a multiple of its size.
TEXT, SMALL = 10.0, 9.5
LEADING = 1.25
#: Signs are polygons, told apart by their corners.
SIGN_CORNERS, COMPLETE_CORNERS, RING_CORNERS = 24, 20, 28
#: What each page shows of how many pages there are.
_COUNT = "count"
#: Names that stand across what they name.
PLATE = 9.5


class Book:
    """A PDF in the making; x counts from the left and y from the foot of the page, in points.

    Parameters
    ----------
    paper : {"a4", "letter"} or (float, float)
        Or width and height in points.
    title : str
        It stands at the head of each page, with the number of the page.
    full_size : bool
        Whether pages are to be printed as large as they are, such as what is laid on.

    Examples
    --------
    >>> book = Book("a4", "Torus")
    >>> book.page("Steps")
    >>> book.finish()[:5]
    b'%PDF-'
    """

    def __init__(
        self, paper: str | tuple[float, float], title: str, *, full_size: bool = False
    ) -> None:
        self.width, self.height = PAPERS[paper] if isinstance(paper, str) else paper
        self.left, self.right = MARGIN, self.width - MARGIN
        self.foot, self.top = MARGIN, self.height - MARGIN - _HEADING
        #: Where the next text or drawing on the page may begin.
        self.y = self.top
        self.n_pages = 0
        self._head, self._count_left = (
            self.height - MARGIN - 10.0,
            self.right - text_width("000", SMALL),
        )
        self._n_images = self._n_entries = 0
        self._title = title
        self._file = io.BytesIO()
        # Invariant: neither a date nor a random id is written. Pages are packed by what the
        # document does to all its streams: by itself a canvas writes packed pages in letters.
        self._canvas = (FullSizeCanvas if full_size else Canvas)(
            self._file, pagesize=(self.width, self.height), pageCompression=0, invariant=1
        )
        self._canvas._doc.defaultStreamFilters = [PDFZCompress]
        self._canvas.setTitle(self._title)
        self._canvas.setCreator("fabweave")
        self._section = ""

    def page(self, section: str) -> None:
        """Begin a page; the first page of each section is found in the reader's contents."""
        if self.n_pages:
            self._canvas.showPage()
        self.n_pages += 1
        self.y = self.top
        head = self._head
        self.text(self.left, head, section, size=13.0, bold=True)
        self.text(
            self._count_left, head, f"{self._title}, page {self.n_pages} / ", size=SMALL, align=1.0
        )
        self._canvas.doForm(_COUNT)
        self.line([(self.left, head - 6.0), (self.right, head - 6.0)], width=0.8)
        if section != self._section:
            self._section = section
            self.entry(section)

    def entry(self, name: str, level: int = 0) -> None:
        """Name the page in the reader's contents: a section, or what stands in it (level 1)."""
        self._n_entries += 1
        key = f"entry{self._n_entries}"
        self._canvas.bookmarkPage(key)
        self._canvas.addOutlineEntry(name, key, level, closed=level == 0)

    def room(self, height: float, section: str) -> None:
        """Begin a new page unless so much is left of this one."""
        if self.y - height < self.foot:
            self.page(section)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float = TEXT,
        bold: bool = False,
        align: float = 0.0,
        grey: float = 0.0,
        angle_deg: float = 0.0,
        middle: bool = False,
    ) -> None:
        """Write one line; ``align`` is the share of it that stands left of x.

        y is the foot of the letters, or their middle; a line is turned about its place.
        """
        canvas, runs = self._canvas, _runs(text, bold=bold)
        shift = -align * text_width(text, size, bold=bold) if align else 0.0
        canvas.setFont(runs[0][0], size)
        canvas._code.append(f"{grey:g} g")
        drop = -0.36 * size if middle else 0.0
        if angle_deg:
            canvas.saveState()
            canvas.translate(x, y)
            canvas.rotate(angle_deg)
            self._write(shift, drop, runs, size)
            canvas.restoreState()
        else:
            self._write(x + shift, y + drop, runs, size)

    def _write(self, x: float, y: float, runs: Sequence[tuple[str, str]], size: float) -> None:
        """Write a line whose first font is set."""
        for at, (font, run) in enumerate(runs):
            if at:
                self._canvas.setFont(font, size)
            if run.isascii():
                text = self._canvas._escape(run)
                self._canvas._code.append(f"BT 1 0 0 1 {x:.3f} {y:.3f} Tm ({text}) Tj T* ET")
            else:
                self._canvas.drawString(x, y, run)
            if at + 1 < len(runs):
                x += stringWidth(run, font, size)

    def block(
        self, x: float, y: float, text: str, width: float, *, size: float = TEXT, bold: bool = False
    ) -> float:
        """Write wrapped text whose first line stands below y; return where it ends."""
        for line in wrapped(text, size, width, bold=bold):
            y -= LEADING * size
            self.text(x, y + 0.25 * size, line, size=size, bold=bold)
        return y

    def line(
        self, points: Sequence[tuple[float, float]] | FloatArray, *, width: float = 0.5,
        grey: float = 0.0, closed: bool = False, fill: float | None = None,
        dash: tuple[float, ...] = (),
    ) -> None:  # fmt: skip
        """Draw a run of straight lines, maybe dashed; a closed one may be filled with a grey."""
        ways = points.tolist() if isinstance(points, np.ndarray) else points
        # A canvas and its paths write one number at a time, which took most of a manual's time.
        steps = [f"{grey:g} G {width:g} w"]
        if fill is not None:
            steps.append(f"{fill:g} g")
        if dash:
            steps.append(f"[{' '.join(f'{part:g}' for part in dash)}] 0 d")
        steps += [f"{x:.3f} {y:.3f} {'l' if at else 'm'}" for at, (x, y) in enumerate(ways)]
        if closed:
            steps.append("h")
        steps.append(
            {(0, 0): "n", (0, 1): "f*", (1, 0): "S", (1, 1): "B*"}[width > 0.0, fill is not None]
        )
        if dash:
            steps.append("[] 0 d")
        self._canvas._code.append(" ".join(steps))

    def circle(self, x: float, y: float, radius: float) -> None:
        """Draw a small hole."""
        self._canvas.setStrokeGray(0.0)
        self._canvas.setLineWidth(0.5)
        self._canvas.circle(x, y, radius)

    def sign(self, x: float, y: float, *, over: bool) -> None:
        """Draw the disc of a strand that goes over, or the ring of one that runs under."""
        radius = 2.1 if over else 2.7
        self.line(
            _round(x, y, radius, SIGN_CORNERS), width=0.9, closed=True, fill=0.0 if over else 1.0
        )

    def ring(self, x: float, y: float) -> None:
        """Draw a ring around a place in a picture, seen on dark and on light."""
        for width, grey in ((2.4, 1.0), (1.1, 0.0)):
            self.line(_round(x, y, 5.0, RING_CORNERS), width=width, grey=grey, closed=True)

    def complete(self, x: float, y: float) -> None:
        """Draw a circle with a cross: all layers are there."""
        self.line(_round(x, y, 4.2, COMPLETE_CORNERS), width=1.0, closed=True, fill=1.0)
        self.line([(x - 2.6, y), (x + 2.6, y)], width=0.9)
        self.line([(x, y - 2.6), (x, y + 2.6)], width=0.9)

    def clip(self, x: float, y: float) -> None:
        """Draw a clip, with its mouth at a place."""
        jaw = [(x, y), (x - 4.6, y + 7.0), (x + 4.6, y + 7.0)]
        self.line(jaw, width=0.9, closed=True, fill=0.0)
        for way in (-1.0, 1.0):
            self.line(_round(x + 2.6 * way, y + 9.6, 2.1, COMPLETE_CORNERS), width=1.0, closed=True)

    def area(self, x: float, y: float, width: float, height: float, colour: Sequence[int]) -> None:
        """Draw a rectangle in a colour."""
        red, green, blue = (int(part) / 255 for part in colour)
        self._canvas.setFillColorRGB(red, green, blue)
        self._canvas.setStrokeGray(0.0)
        self._canvas.setLineWidth(0.5)
        self._canvas.rect(x, y, width, height, stroke=1, fill=1)

    def tick_box(self, x: float, y: float, side: float = 10.0) -> None:
        """Draw a box to tick."""
        self.box(x, y, side, side, width=0.9)

    def box(
        self,
        x: float,
        y: float,
        wide: float,
        high: float,
        *,
        width: float,
        grey: float = 0.0,
        fill: float | None = None,
    ) -> None:
        """Draw a rectangle whose lower left corner is given."""
        corners = [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)]
        self.line(corners, width=width, grey=grey, closed=True, fill=fill)

    def tag(self, x: float, y: float, text: str, *, dark: bool) -> None:
        """Write a text of 9 points in a box whose middle is given."""
        wide, high = tag_size(text)
        left, low = x - wide / 2, y - high / 2
        self.box(left, low, wide, high, width=0.7, fill=0.0 if dark else 1.0)
        grey = 1.0 if dark else 0.0
        self.text(x, y, text, size=SMALL, bold=True, align=0.5, grey=grey, middle=True)

    def plate(self, x: float, y: float, text: str, *, angle_deg: float) -> None:
        """Write a text of 8 points on a white ground whose middle is given."""
        size = PLATE
        half = np.array([text_width(text, size, bold=True) / 2 + 1.0, 0.42 * size])
        turn = np.radians(angle_deg)
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ axes + (x, y)
        self.line(corners, width=0.0, closed=True, fill=1.0)
        self.text(x, y, text, size=size, bold=True, align=0.5, angle_deg=angle_deg, middle=True)

    @contextmanager
    def clipped(self, x: float, y: float, width: float, height: float) -> Iterator[None]:
        """Draw only what is inside a rectangle."""
        self._canvas.saveState()
        path = self._canvas.beginPath()
        path.rect(x, y, width, height)
        self._canvas.clipPath(path, stroke=0)
        yield
        self._canvas.restoreState()

    def image(self, picture: Painted, x: float, y: float, width: float, height: float) -> None:
        """Draw a picture with its lower left corner at a place."""
        canvas = self._canvas
        self._n_images += 1
        name = f"picture{self._n_images}"
        document, pixels = canvas._doc, _pixels(picture)
        document.Reference(pixels, document.getXObjectName(name))
        document.addForm(name, pixels)
        canvas.saveState()
        canvas.translate(x, y)
        canvas.scale(width, height)
        canvas.doForm(name)
        canvas.restoreState()

    def finish(self) -> bytes:
        """Return the PDF; how many pages there are is known now, and stands on each."""
        self._canvas.showPage()
        self._canvas.beginForm(_COUNT)
        self.text(self._count_left, self._head, str(self.n_pages), size=SMALL)
        self._canvas.endForm()
        self._canvas.save()
        return self._file.getvalue()


def _round(x: float, y: float, radius: float, corners: int) -> FloatArray:
    """Return a polygon that is all but a circle."""
    turn = 2.0 * np.pi * np.arange(corners) / corners
    return np.column_stack((x + radius * np.cos(turn), y + radius * np.sin(turn)))


def printable(text: str) -> str:
    """Return a text in the characters of a PDF's own fonts, or of those that readers have.

    Letters without their accents stand for others, or else question marks.

    Examples
    --------
    >>> printable("Löwe, Łódź, 兔, 토끼, 🐇")
    'Löwe, Łódz, 兔, 토끼, ?'
    """
    return "".join(
        sign if _font(sign) else next(filter(_font, normalize("NFKD", sign)), "?") for sign in text
    )


@cache
def _font(sign: str) -> str:
    """Return which font has a character: Helvetica, one for East Asia, or none."""
    for font, encoding in _FONTS.items():
        try:
            sign.encode(encoding)
        except UnicodeEncodeError:
            continue
        if font != _PLAIN:
            registerFont(UnicodeCIDFont(font))
        return font
    return ""


def _runs(text: str, *, bold: bool) -> list[tuple[str, str]]:
    """Return the parts of a text, each with its font."""
    usual = _BOLD if bold else _PLAIN
    if text.isascii():
        return [(usual, text)]
    runs = groupby(printable(text), _font)
    return [(usual if font == _PLAIN else font, "".join(signs)) for font, signs in runs]


@lru_cache(100_000)
def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a text in points."""
    return float(sum(stringWidth(run, font, size) for font, run in _runs(text, bold=bold)))


def tag_size(text: str) -> tuple[float, float]:
    """Return width and height of a tag."""
    return text_width(text, SMALL, bold=True) + 5.0, SMALL + 3.0


def wrapped(text: str, size: float, width: float, *, bold: bool = False) -> list[str]:
    """Break a text at its spaces into lines that fit a width; a longer word has its own line.

    Examples
    --------
    >>> wrapped("lay A1 over B2", 10.0, 40.0)
    ['lay A1', 'over B2']
    >>> wrapped("兔" * 5, 10.0, 30.0)
    ['兔兔兔', '兔兔']
    """
    # What is written in East Asia may break anywhere.
    lines = []
    for paragraph in printable(text).split("\n"):
        line = ""
        for gap, word in re.findall(r"(\s*)([\u2e80-\uffff]|[^\s\u2e80-\uffff]+)", paragraph):
            longer = f"{line}{' ' if gap and line else ''}{word}"
            if line and text_width(longer, size, bold=bold) > width:
                lines.append(line)
                longer = word
            line = longer
        lines.append(line)
    return lines


def _pixels(picture: Painted) -> PDFStream:
    """Return a picture as an object of a PDF.

    reportlab's own pictures are written in letters, which takes a quarter more room and most of
    the time of a manual with a picture for each step.
    """
    colours: object = PDFName("DeviceRGB")
    if picture.colours:
        last = len(picture.colours) // 3 - 1
        colours = PDFArray([PDFName("Indexed"), colours, last, f"<{picture.colours.hex()}>"])
    record = {
        "Type": PDFName("XObject"),
        "Subtype": PDFName("Image"),
        "Width": picture.width_px,
        "Height": picture.height_px,
        "BitsPerComponent": 8,
        "ColorSpace": colours,
        "Filter": PDFName("FlateDecode"),
    }
    return PDFStream(PDFDictionary(record), picture.packed)
