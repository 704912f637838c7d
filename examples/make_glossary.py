"""Draw the pictures of the glossary in CONTRIBUTING.md: a small SVG for each word.

Run it with: python examples/make_glossary.py examples/glossary
"""

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

WIDE, HIGH = 160, 120
BLUE, ORANGE, MARK = "#0072B2", "#E66100", "#C2185B"
PALE_BLUE, PALE_ORANGE, PALE, GREY, INK = "#CFE3F1", "#FBE0CB", "#ECECEC", "#8A8A8A", "#222222"

Point = tuple[float, float]


def number(value: float) -> str:
    """Return a coordinate, as short as it may be."""
    return f"{value:.1f}".removesuffix(".0")


def path(points: Sequence[Point], *, closed: bool = False) -> str:
    """Return the data of a path along points."""
    return "M" + "L".join(f"{number(x)},{number(y)}" for x, y in points) + "Z" * closed


def line(points: Sequence[Point], colour: str = INK, width: float = 1.5, dash: str = "") -> str:
    """Return a line along points."""
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    return (
        f'<path d="{path(points)}" fill="none" stroke="{colour}" stroke-width="{width}"'
        f' stroke-linejoin="round"{dashed}/>'
    )


def area(points: Sequence[Point], fill: str, edge: str = INK, width: float = 0.8) -> str:
    """Return a filled polygon."""
    data = path(points, closed=True)
    return f'<path d="{data}" fill="{fill}" stroke="{edge}" stroke-width="{width}"/>'


def dot(at: Point, radius: float = 2.5, fill: str = INK, edge: str = "none") -> str:
    """Return a round dot."""
    x, y = map(number, at)
    return (
        f'<circle cx="{x}" cy="{y}" r="{radius}" fill="{fill}" stroke="{edge}" stroke-width="2"/>'
    )


def text(at: Point, words: str, size: float = 11, colour: str = INK) -> str:
    """Return words, with their middle at a place."""
    x, y = number(at[0]), number(at[1] + size * 0.35)
    return (
        f'<text x="{x}" y="{y}" font-family="sans-serif" font-size="{size}" fill="{colour}"'
        f' text-anchor="middle">{words}</text>'
    )


def arrow(start: Point, end: Point, colour: str = MARK, width: float = 2.0) -> str:
    """Return an arrow."""
    angle = math.atan2(end[1] - start[1], end[0] - start[0])
    wings = [
        (end[0] - 7 * math.cos(angle + turn), end[1] - 7 * math.sin(angle + turn))
        for turn in (0.45, -0.45)
    ]
    head = [wings[0], end, wings[1]]
    return line([start, end], colour, width) + line(head, colour, width)


def bar(start: Point, end: Point, width: float, fill: str) -> str:
    """Return a straight strand: filled, with its two long sides drawn."""
    (x0, y0), (x1, y1) = start, end
    length = math.hypot(x1 - x0, y1 - y0)
    nx, ny = (y0 - y1) / length * width / 2, (x1 - x0) / length * width / 2
    left, right = [(x0 + nx, y0 + ny), (x1 + nx, y1 + ny)], [(x0 - nx, y0 - ny), (x1 - nx, y1 - ny)]
    filled = area([*left, *right[::-1]], fill, "none")
    return filled + line(left, width=0.8) + line(right, width=0.8)


COLUMNS, ROWS, THICK = (35.0, 65.0, 95.0, 125.0), (30.0, 60.0, 90.0), 18.0


def woven(column: Callable[[int], str], row: Callable[[int], str]) -> str:
    """Return a patch of plain weave, its upright and level strands in these colours."""
    upright = [bar((x, 8), (x, 112), THICK, column(i)) for i, x in enumerate(COLUMNS)]
    level = [bar((12, y), (148, y), THICK, row(j)) for j, y in enumerate(ROWS)]
    over = [
        bar((x, y - 12), (x, y + 12), THICK, column(i))
        for i, x in enumerate(COLUMNS)
        for j, y in enumerate(ROWS)
        if (i + j) % 2 == 0
    ]
    return "".join([*upright, *level, *over])


def only(index: int, colour: str) -> Callable[[int], str]:
    """Return a choice of colours: this one for one strand, a pale one for the others."""
    return lambda number: colour if number == index else PALE


# A mesh of quads that stand on a corner, with the middles of its edges in rows and columns.
MIDDLES = [(x, y) for x in COLUMNS for y in ROWS]
EDGES = [
    ((x - 15, y + (15 if (i + j) % 2 else -15)), (x + 15, y + (-15 if (i + j) % 2 else 15)))
    for i, x in enumerate(COLUMNS)
    for j, y in enumerate(ROWS)
]
MESH = "".join(line(edge, GREY, 1.2) for edge in EDGES)

# A ribbon along x: rungs at these places, flat panels between two of them, and a wavy middle line.
RUNGS = (14.0, 34.0, 42.0, 50.0, 58.0, 66.0, 86.0, 94.0, 102.0, 110.0, 118.0, 138.0)
PANELS = ((0, 1), (5, 6), (10, 11))


def rung(at: float) -> tuple[Point, Point]:
    """Return the ends of a rung: on the left rail and on the right one."""
    middle = 60 + 12 * math.sin((at - 14) / 124 * 2 * math.pi)
    return (at + 3, middle - 17), (at - 3, middle + 17)


LEFT, RIGHT = zip(*map(rung, RUNGS), strict=True)
RIBBON = area([*LEFT, *RIGHT[::-1]], PALE_BLUE) + "".join(line(rung(at), GREY, 0.8) for at in RUNGS)


def strip(shift: Point, length: float, fill: str, *, angle: float = 0.0) -> str:
    """Return a piece with three holes, turned about the place where it is."""
    steps = [length * k / 12 for k in range(13)]
    upper = [(x, 6 * math.sin(x / length * 2 * math.pi) - 10) for x in steps]
    lower = [(x, y + 20) for x, y in upper]
    cos, sin = math.cos(angle), math.sin(angle)

    def put(points: Sequence[Point]) -> list[Point]:
        return [(shift[0] + x * cos - y * sin, shift[1] + x * sin + y * cos) for x, y in points]

    holes = put([(x, upper[k][1] + 10) for k, x in enumerate(steps) if k in (1, 6, 11)])
    outline = area(put([*upper, *lower[::-1]]), fill)
    return outline + "".join(dot(hole, 2.5, "white", BLUE) for hole in holes)


def layer(start: Point, end: Point, fill: str) -> str:
    """Return a sheet seen from its edge."""
    return line([start, end], INK, 8) + line([start, end], fill, 6.4)


def half_edge() -> str:
    """Draw a face with its half-edges, and the twin of one of them."""
    corners = [(30.0, 25.0), (90.0, 20.0), (100.0, 90.0), (25.0, 100.0)]
    other = [(90.0, 20.0), (140.0, 30.0), (145.0, 95.0), (100.0, 90.0)]
    centre = (61.0, 59.0)
    inner = [tuple(c + 0.24 * (m - c) for c, m in zip(at, centre, strict=True)) for at in corners]
    # Counter-clockwise, as y points down here.
    ways = [(inner[(k + 1) % 4], inner[k]) for k in range(4)]
    faces = area(corners, PALE) + area(other, "white")
    drawn = [arrow(*way, MARK if k == 1 else GREY) for k, way in enumerate(ways)]
    return (
        faces + "".join(drawn) + arrow((102, 35), (109, 80), ORANGE) + text((124, 58), "twin", 10)
    )


def medial_graph() -> str:
    """Draw a mesh and its medial graph."""
    uprights = "".join(line([(x, 12), (x, 108)], BLUE, 2) for x in COLUMNS)
    levels = "".join(line([(18, y), (142, y)], BLUE, 2) for y in ROWS)
    return MESH + uprights + levels + "".join(dot(at, 3, BLUE) for at in MIDDLES)


def gap() -> str:
    """Draw a weave with the gaps filled: about a vertex, and in the middle of a face."""
    pale = woven(lambda _: PALE, lambda _: PALE)
    marks = []
    for i, x in enumerate(COLUMNS[:-1]):
        for j, y in enumerate(ROWS[:-1]):
            box = [(x + 10, y + 10), (x + 20, y + 10), (x + 20, y + 20), (x + 10, y + 20)]
            marks.append(area(box, BLUE if (i + j) % 2 else ORANGE, "none"))
    return pale + "".join(marks)


def bunch() -> str:
    """Draw threads of three directions, those of one of them marked."""
    parts = []
    for angle in (0.0, 60.0, 120.0):
        cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        for offset in (-32.0, 0.0, 32.0):
            x, y = 80 - sin * offset, 60 + cos * offset
            ends = (x - 48 * cos, y - 48 * sin), (x + 48 * cos, y + 48 * sin)
            parts.append(bar(*ends, 9, MARK if angle == 0 else PALE))
    return "".join(parts[3:] + parts[:3])


def strand() -> str:
    """Draw a crossing from the side: the strand above, cut, on the strand below."""
    below = layer((15, 72), (145, 72), PALE_BLUE)
    above = layer((52, 62), (108, 62), ORANGE)
    return below + above + text((80, 42), "the strand above", 11) + text((80, 95), "and below", 11)


def portal() -> str:
    """Draw the portal between a vertex and the centre of a face, and a strand that crosses it."""
    face = [(30.0, 60.0), (90.0, 15.0), (145.0, 60.0), (90.0, 105.0)]
    centre = (90.0, 60.0)
    way = bar((58, 22), (62, 98), 26, PALE_BLUE)
    crossed = line([face[0], centre], MARK, 3)
    names = text((26, 76), "vertex", 10) + text((112, 66), "centre", 10)
    dots = dot(face[0], 3.5) + dot(centre, 3.5, "white", INK)
    return area(face, "white", GREY, 1.2) + way + crossed + dots + names


def station() -> str:
    """Draw a piece with its stations counted."""
    parts = [strip((18, 60), 124, PALE_BLUE)]
    for k, x in enumerate((28.3, 80.0, 131.7)):
        parts.append(line([(x, 34), (x, 86)], GREY, 1, "3 3"))
        parts.append(text((x, 24), str(k), 13, MARK))
    return "".join(parts)


def run() -> str:
    """Draw a thread with its passes, and which of them two pieces carry."""
    thread = bar((8, 52), (152, 52), 16, PALE_BLUE)
    passes = "".join(dot((x, 52), 3) for x in range(20, 150, 20))
    brackets = [
        line([(a, y - 6), (a, y), (b, y), (b, y - 6)], colour, 2)
        for a, b, y, colour in ((16, 84, 78, MARK), (76, 144, 92, BLUE))
    ]
    return thread + passes + "".join(brackets)


def lap() -> str:
    """Draw two pieces that lie on one another at their ends."""
    ends = area([(12, 45), (96, 45), (96, 75), (12, 75)], PALE_BLUE)
    over = area([(64, 45), (148, 45), (148, 75), (64, 75)], PALE_ORANGE)
    both = area([(64, 45), (96, 45), (96, 75), (64, 75)], MARK)
    return ends + over + both + line([(64, 90), (96, 90)], MARK, 2) + text((80, 101), "lap", 11)


def joint() -> str:
    """Draw a joint from the side: two laps and the strand above, with a fastener."""
    layers = [
        layer((12, 78), (100, 78), PALE_BLUE),
        layer((60, 68), (148, 68), PALE_BLUE),
        layer((54, 58), (106, 58), ORANGE),
    ]
    fastener = line([(80, 50), (80, 87)], MARK, 5) + line([(70, 50), (90, 50)], MARK, 4)
    return "".join(layers) + fastener + line([(72, 87), (88, 87)], MARK, 4)


def supply() -> str:
    """Draw what two bunches are cut from: a sheet of material for each."""
    parts = []
    for y, colour, pale, name in (
        (34, ORANGE, PALE_ORANGE, "card"),
        (86, BLUE, PALE_BLUE, "veneer"),
    ):
        parts.append(area([(12, y - 20), (70, y - 20), (70, y + 20), (12, y + 20)], pale))
        parts.append(text((41, y), name, 12))
        parts.append(arrow((76, y), (98, y), INK, 1.5))
        parts += [bar((104, y + dy), (150, y + dy), 9, colour) for dy in (-14, 0, 14)]
    return "".join(parts)


def kind() -> str:
    """Draw pieces that are the same, turned, and one that is not."""
    same = strip((14, 30), 80, PALE_BLUE) + strip((146, 62), 80, PALE_BLUE, angle=math.pi)
    return same + strip((30, 98), 50, PALE_ORANGE) + text((118, 30), "2 ×", 14)


def pass_() -> str:
    """Draw a visit of a thread to a crossing."""
    crossed = bar((80, 8), (80, 112), 30, PALE)
    return crossed + bar((12, 60), (148, 60), 30, PALE_BLUE) + arrow((30, 60), (132, 60))


def piece() -> str:
    """Draw a piece with its id, and the way of its thread."""
    return strip((18, 60), 124, PALE_BLUE) + text((55, 66), "A3→", 13)


PICTURES = {
    "half-edge": half_edge,
    "medial-graph": medial_graph,
    "thread": lambda: woven(lambda _: PALE, only(1, MARK)),
    "crossing": lambda: woven(only(1, BLUE), only(1, ORANGE)) + dot((65, 60), 17, "none", MARK),
    "pass": pass_,
    "strand": strand,
    "gap": gap,
    "warp-and-weft": lambda: woven(lambda _: ORANGE, lambda _: BLUE),
    "bunch": bunch,
    "portal": portal,
    "rung": lambda: RIBBON + line(rung(RUNGS[3]), MARK, 3),
    "panel": lambda: (
        RIBBON + "".join(area([LEFT[a], LEFT[b], RIGHT[b], RIGHT[a]], MARK) for a, b in PANELS)
    ),
    "rail": lambda: RIBBON + line(LEFT, MARK, 3) + line(RIGHT, MARK, 3),
    "station": station,
    "run": run,
    "piece": piece,
    "lap": lap,
    "joint": joint,
    "kind": kind,
    "supply": supply,
}

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
for name, draw in PICTURES.items():
    size = f'width="{WIDE}" height="{HIGH}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE} {HIGH}" {size}>'
    ground = f'<rect {size} rx="6" fill="white"/>'
    content = f"{head}{ground}{draw()}</svg>\n"
    (folder / f"{name}.svg").write_text(content, encoding="utf-8", newline="")
