"""Draw a test coupon, alone or for a finished job."""

import math
import shlex
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import few_of
from fabweave.form.body import YOUNG
from fabweave.form.woven_net import GRAVITY
from fabweave.job.ask import supplies_of
from fabweave.job.ribbon_report import read_ribbon_report
from fabweave.options.settings import settings_from_job
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline, SheetDrawing, draw_flat
from fabweave.sheet.labels.lettering import lettered, place_text, text_box
from fabweave.sheet.labels.texts import (
    ARROW,
    ID_HEIGHTS_MM,
    LOW_ID_HEIGHTS_MM,
    OVER_SIGN,
    TEXT_HEIGHTS_MM,
    UNDER_SIGN,
)
from fabweave.sheet.sheet_notes import sheet_notes
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.preview import png_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.stock.material import (
    Material,
    hole_edge_mm,
    laid_across,
    min_bend_radius_mm,
    min_hole_mm,
    with_thickness,
)
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.supplies import Supplies, sort_of_material

#: Holes of the ladder are so much smaller and larger than the one that is wanted.
LADDER_MM = (-0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
#: Blocks of the comb, and their size: their widths add up to a hundred millimetres.
BLOCKS, BLOCK_MM = 10, (10.0, 16.0)
#: A common fastener, for which a hole is drawn where none is asked for.
_HOLE_MM = 3.3
#: Pieces stand at least this far apart, even where the material needs less.
_LEAST_GAP_MM = 3.0
_MARGIN_MM, _GRIP_MM, _LONGEST_BEND_MM = 10.0, 20.0, 200.0
#: Narrower, the notes of the sheet would have no room.
_LEAST_WIDTH_MM = 180.0
_LETTER_MM = TEXT_HEIGHTS_MM[0]
#: Between letters, edges and holes.
_AIR_MM = 1.5


class Coupon(NamedTuple):
    """What a coupon tests, in millimetres: ``bend_mm`` is the radius of the bend sample."""

    material: Material
    hole_mm: float
    lap_mm: float
    width_mm: float
    bend_mm: float


class _Part(NamedTuple):
    """A rectangle from the origin with holes (x, y, d), texts (text, height, x, y), and ticks."""

    name: str
    size: tuple[float, float]
    holes: Sequence[tuple[float, float, float]] = ()
    texts: Sequence[tuple[str, float, float, float]] = ()
    ticks: Sequence[FloatArray] = ()


def plan_coupon(
    material: Material,
    *,
    hole_mm: float | None = None,
    lap_mm: float | None = None,
    width_mm: float | None = None,
    bend_mm: float | None = None,
) -> Coupon:
    """Fill in what a coupon tests where a job does not say it.

    Parameters
    ----------
    material : Material
    hole_mm : float, optional
        The fastener's hole; 3.3 mm, or the least that can be cut.
    lap_mm, width_mm : float, optional
        The laps of the job and the width of its ribbons; as wide as the hole needs.
    bend_mm : float, optional
        Tightest radius of the job; else the tightest that the material takes.

    Raises
    ------
    InputError
        If the smallest hole of the ladder could not be cut.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> plan_coupon(material_named("card"))[1:]
    (3.3, 13.2, 13.2, 8.0)
    """
    least = min_hole_mm(material)
    hole = max(_HOLE_MM, least) if hole_mm is None else hole_mm
    if hole < least:
        raise InputError(
            f"a hole of {hole:g} mm is too small for a laser in "
            f"{material.description}: use {least:g} mm or more"
        )
    needed = round(2 * hole_edge_mm(material, hole), 6)
    width = max(needed, width_mm or 0.0)
    bend = min_bend_radius_mm(material) if bend_mm is None else bend_mm
    return Coupon(material, hole, max(needed, lap_mm or 0.0), width, bend)


def draw_coupon(coupon: Coupon) -> SheetDrawing:
    """Draw a coupon: hole ladder, kerf comb, lap, letters, bend, a cross to weigh, a mat to weave.

    Returns
    -------
    SheetDrawing
        Pieces ``KERF1`` to ``KERF10``, ``HOLES``, ``LAP-A``, ``LAP-B``, ``TEXT``, ``BEND``,
        ``CROSS-A``, ``CROSS-B``, and ``P1``, ``P2``, ``Q1``, ``Q2`` on a sheet as small as they
        allow.
    """
    parts = [
        *_comb(), _ladder(coupon), *_laps(coupon), _letters(), _bend(coupon), *_crosses(coupon),
        *_mat(coupon),
    ]  # fmt: skip
    gap = max(coupon.material.gap_mm, _LEAST_GAP_MM)
    comb = BLOCKS * (BLOCK_MM[0] + gap) - gap
    wide = max(*(part.size[0] for part in parts), comb, _LEAST_WIDTH_MM)
    placed, x, y, row = [], 0.0, 0.0, 0.0
    for part in parts:
        if x > 0.0 and x + part.size[0] > wide + 1e-9:
            x, y, row = 0.0, y + row + gap, 0.0
        placed.append((part, x, y))
        x, row = x + part.size[0] + gap, max(row, part.size[1])
    width, height = math.ceil(wide + 2 * _MARGIN_MM), math.ceil(y + row + 2 * _MARGIN_MM)
    title = f"COUPON {coupon.material.name} {coupon.material.thickness_mm:g} MM".upper()
    return SheetDrawing(
        name="coupon",
        width_mm=width,
        height_mm=height,
        pieces=tuple(
            _drawn(part, np.array([x + _MARGIN_MM, height - _MARGIN_MM - y - part.size[1]]))
            for part, x, y in placed
        ),
        notes=sheet_notes(
            SheetSize(width, height),
            [
                lettered(title),
                f"KERF = (100 - WIDTH OF ALL {BLOCKS} BLOCKS) / {BLOCKS}, SEE COUPON.TXT",
            ],
        ).drawn,
    )


#: How the text of a coupon begins, by which it is known.
FIRST_WORDS = "Test coupon: "


def coupon_text(coupon: Coupon) -> str:
    """Return the instructions that go with a coupon: what to measure, and what to set."""
    material, hole = coupon.material, coupon.hole_mm
    first, last = hole + LADDER_MM[0], hole + LADDER_MM[-1]
    return f"""{FIRST_WORDS}{material.description}

Cut it with the settings that you will use for the job, from a sheet of the same stock.

HOLES    Holes of {first:.2f} to {last:.2f} mm, as drawn. Find the smallest that your fastener fits
         without force, and make the job with it: --fastener {hole:g}mm (or the size you found).
KERF     Push the {BLOCKS} blocks together in one row and measure its length, M mm. The beam burns
         away (100 - M) / {BLOCKS} mm. The library assumes {material.kerf_mm:g} mm for this
         material. fabweave's sheets are nominal: set the kerf in your laser's software, ask your
         shop to do so, or make the job with --kerf.
         Measure the thickness of a stack of blocks, divide it by their number, and set it:
         --thickness {material.thickness_mm:g}mm (or what you measured).
LAP      Join LAP-A and LAP-B, hole on hole, with your fastener: the lap is {coupon.lap_mm:.1f} mm
         long and {coupon.width_mm:.1f} mm wide. Pull. For a longer lap use
         --joint rivet,lap=20mm, for wider ribbons --width.
TEXT     Letters {", ".join(f"{height:g}" for height in _heights())} mm high. If you cannot read the
         smallest, use a larger --size, which leaves room for larger letters, or --labels numbers,
         which engraves only the ids. A disc (over) and a ring (under) are to be told apart.
BEND     Bend the strip between its ticks around something {2 * coupon.bend_mm:.1f} mm in diameter,
         along and across the grain. It must not crack. The rule for this material is a radius
         of {min_bend_radius_mm(material):.1f} mm{_across(material)}. If it cracks, use a thinner
         sheet or a larger --size.
CROSS    How it keeps its form. Press CROSS-A on a table up to its first tick, so that the rest of
         it, {_FREE_MM:g} mm, stands out over the edge. Measure how far its end hangs down, turn it
         over, measure again: S mm in the mean. Its Young's modulus is {_droop(material):.0f} / S
         N/mm2{_stiff(material)}.
         Then cross both strips, hole on hole: first with a needle, then with your fastener. Hold
         CROSS-B upright and CROSS-A level. Hang paper clips at its last tick until that has gone
         down by 10 mm: M grams. The crossing resists turning with {_TURNING_NMM:.3g} x M N mm.
         Set both for your own material (fabweave guide materials): young_mpa = [along, across],
         turning_nmm = [with the needle, with the fastener].
MAT      To practise before the first step. Lay P1 and, right of it, P2, letters up, arrows away
         from you. From the left, push Q1 under P1 and over P2, and beyond it Q2 over P1 and under
         P2, hole on hole, arrows to the right. Each ring and the name beside it end under the strip
         that they name. Set a fastener in each hole.
"""


#: How far a strip of the cross stands out over an edge, and how wide it is; where its last tick is.
_FREE_MM, _CROSS_MM = 130.0, 15.0
_ARM_MM = _FREE_MM / 2.0
#: What a gram at the last tick stands for, as it goes down by ten millimetres.
_TURNING_NMM = GRAVITY * 1e-3 * _ARM_MM**2 / 10.0


def _droop(material: Material) -> float:
    """Return by what Young's modulus is divided to tell how far a strip hangs, N/mm.

    Its own weight q bends a cantilever by q L^4 / 8 E I, and I is a twelfth of the cubed thickness.
    """
    own = GRAVITY * 1e-9 * material.density_kg_m3
    return 1.5 * own * _FREE_MM**4 / material.thickness_mm**2


def _stiff(material: Material) -> str:
    """Say so where a strip hangs too little to be measured."""
    young = (material.young_mpa or (YOUNG, YOUNG))[1]
    return "" if _droop(material) / young >= 1.0 else " (too stiff to tell: leave what is known)"


def _crosses(coupon: Coupon) -> list[_Part]:
    """Return two strips with a hole in the middle, and ticks: where one is held, and loaded."""
    box = text_box("CROSS-A", _LETTER_MM)
    wide = max(_CROSS_MM, 2 * hole_edge_mm(coupon.material, coupon.hole_mm))
    grip = max(_GRIP_MM, box.width + 2 * _AIR_MM)
    middle = grip + _FREE_MM - _ARM_MM - 5.0
    ticks = _ticks((grip, middle + _ARM_MM), wide, 2.0)
    return [
        _Part(
            name,
            (grip + _FREE_MM, wide),
            [(middle, wide / 2, coupon.hole_mm)],
            [(name, _LETTER_MM, grip / 2, wide / 2)],
            ticks,
        )
        for name in ("CROSS-A", "CROSS-B")
    ]


def _mat(coupon: Coupon) -> list[_Part]:
    """Return two strips and two across, with a hole and ticks at each crossing.

    As on the pieces of a job, the strip that is covered has the name of who crosses it.
    """
    names, under = ("P1", "P2", "Q1", "Q2"), {"P1": "Q2", "P2": "Q1", "Q1": "P1", "Q2": "P2"}
    signs = [f"{UNDER_SIGN}{name}" for name in names]
    letters = max(text_box(text, _LETTER_MM).width for text in (*signs, f"P1{ARROW}"))
    # Beside the hole in the middle there is room for a name under the strip that covers it.
    wide = max(coupon.width_mm, coupon.hole_mm + 2.0 * (letters + 2.0 * _AIR_MM))
    first, second = (letters + 2.0 * _AIR_MM + wide * turn for turn in (0.5, 1.7))
    ticks = _ticks([x + side for x in (first, second) for side in (-wide / 2, wide / 2)], wide, 2.0)
    beside = (coupon.hole_mm + letters) / 2.0 + _AIR_MM
    parts = []
    for name in names:
        at = first if under[name] in ("P1", "Q1") else second
        parts.append(
            _Part(
                name,
                (second + first, wide),
                [(x, wide / 2, coupon.hole_mm) for x in (first, second)],
                [
                    (f"{name}{ARROW}", _LETTER_MM, letters / 2 + _AIR_MM, wide / 2),
                    (f"{UNDER_SIGN}{under[name]}", _LETTER_MM, at + beside, wide / 2),
                ],
                ticks,
            )
        )
    return parts


def _across(material: Material) -> str:
    """Say what strips across the grain take, where that is another radius."""
    if not material.across_table_mm:
        return ""
    return f", and of {min_bend_radius_mm(laid_across(material)):.1f} mm across the grain"


def _heights() -> tuple[float, ...]:
    """Return all heights of letters."""
    return (*ID_HEIGHTS_MM, *LOW_ID_HEIGHTS_MM)


def _ladder(coupon: Coupon) -> _Part:
    """Return the holes, each with its diameter."""
    sizes = [round(coupon.hole_mm + step, 3) for step in LADDER_MM]
    names = [f"{size:.3f}".rstrip("0").rstrip(".") for size in sizes]
    edge = hole_edge_mm(coupon.material, sizes[-1])
    letters = max(text_box(name, _LETTER_MM).width for name in names)
    pitch = max(3 * sizes[-1], letters + 2 * _AIR_MM)
    edge = max(edge, letters / 2 + _AIR_MM)
    # Below the holes, between them and the lower edge, their diameters.
    low = sizes[-1] / 2 + 2 * _AIR_MM + 1.25 * _LETTER_MM
    below = max(edge, low)
    text_y = below - sizes[-1] / 2 - _AIR_MM - 0.625 * _LETTER_MM
    places = [edge + pitch * number for number in range(len(sizes))]
    return _Part(
        "HOLES",
        (2 * edge + pitch * (len(sizes) - 1), below + edge),
        [(x, below, size) for x, size in zip(places, sizes, strict=True)],
        [(name, _LETTER_MM, x, text_y) for x, name in zip(places, names, strict=True)],
    )


def _comb() -> list[_Part]:
    """Return the blocks of the comb, numbered."""
    middle = (BLOCK_MM[0] / 2, BLOCK_MM[1] / 2)
    return [
        _Part(f"KERF{number}", BLOCK_MM, texts=[(str(number), ID_HEIGHTS_MM[0], *middle)])
        for number in range(1, BLOCKS + 1)
    ]


def _laps(coupon: Coupon) -> list[_Part]:
    """Return two strips with the hole in the middle of their lap; a tick where the other ends."""
    parts = []
    for name in ("LAP-A", "LAP-B"):
        box = text_box(name, _LETTER_MM)
        length = coupon.lap_mm + box.width + 2 * _AIR_MM + 2.0
        middle = coupon.width_mm / 2
        ticks = _ticks((coupon.lap_mm,), coupon.width_mm, min(2.0, coupon.width_mm / 4))
        at = coupon.lap_mm + 2.0 + box.width / 2
        parts.append(
            _Part(
                name,
                (length, coupon.width_mm),
                [(coupon.lap_mm / 2, middle, coupon.hole_mm)],
                [(name, _LETTER_MM, at, middle)],
                ticks,
            )
        )
    return parts


def _letters() -> _Part:
    """Return a strip with all that labels use, at every height."""
    rows, y, wide = [], _AIR_MM, 0.0
    for height in reversed(_heights()):
        text = f"A69{ARROW} #10>B8 {OVER_SIGN}C2 {UNDER_SIGN}D5 {height:g}"
        if height < min(TEXT_HEIGHTS_MM):
            text = f"A69{ARROW} {height:g}"  # nothing but ids is so low
        box = text_box(text, height)
        y += (box.top - box.bottom) / 2
        rows.append((text, height, y))
        y += (box.top - box.bottom) / 2 + _AIR_MM
        wide = max(wide, box.width)
    size = (wide + 2 * _AIR_MM, y)
    return _Part("TEXT", size, texts=[(text, height, size[0] / 2, y) for text, height, y in rows])


def _bend(coupon: Coupon) -> _Part:
    """Return a strip that bends between its ticks, half round if it is not too long for that."""
    bent = min(math.pi * coupon.bend_mm, _LONGEST_BEND_MM)
    name = f"BEND R{coupon.bend_mm:.1f}"
    wide = max(coupon.width_mm, 8.0)
    grip = max(_GRIP_MM, text_box(name, _LETTER_MM).width + 2 * _AIR_MM)
    ticks = _ticks((grip, grip + bent), wide, 2.0)
    return _Part(
        "BEND", (2 * grip + bent, wide), texts=[(name, _LETTER_MM, grip / 2, wide / 2)], ticks=ticks
    )


def _ticks(places: Sequence[float], wide: float, long: float) -> list[FloatArray]:
    """Return ticks across a strip at some places, from near either edge inwards."""
    ends = ((0.5, 0.5 + long), (wide - 0.5, wide - 0.5 - long))
    return [np.array([[x, start], [x, end]]) for x in places for start, end in ends]


def _drawn(part: _Part, corner: FloatArray) -> PieceDrawing:
    """Return a part's entities where it stands."""
    (wide, high), (left, low) = part.size, corner.tolist()
    outline = corner + np.array([[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high]])
    strokes = (
        place_text(text, height, (left + x, low + y), 0.0) for text, height, x, y in part.texts
    )
    return draw_flat(
        part.name,
        chain.from_iterable(strokes),
        [tick + corner for tick in part.ticks],
        [(left + x, low + y, diameter) for x, y, diameter in part.holes],
        Polyline(Layer.CUT_OUTER, outline, closed=True),
    )


def coupon_for(
    directory: Path | None,
    material: str | None = None,
    thickness_mm: float | None = None,
    hole_mm: float | None = None,
    user_materials: Sequence[Material] = (),
) -> Coupon:
    """Plan a coupon: for a finished job, with its material, hole, laps, widths and bends.

    Parameters
    ----------
    directory : Path or None
        A finished job's folder.
    material, thickness_mm, hole_mm
        What is asked for wins over what the job says.
    user_materials : sequence of Material
        Beside those of the library, if it is asked for a material.

    Raises
    ------
    InputError
        If there is neither a material nor a job, or a job's file cannot be read.
    """
    figures = _JobFigures() if directory is None else _read_job(directory)
    supplies = figures.supplies
    if material is not None:
        sheet = sort_of_material(material, user_materials)
    elif supplies is None:
        raise InputError(
            "there is no material: use --material NAME, or give the folder of a finished job"
        )
    elif supplies.several:
        # A coupon is cut from one sheet.
        raise InputError(
            f"the job has {len(supplies.each)} materials, but a coupon tests one: choose it with "
            + " or ".join(
                f"--material {m.name} --thickness {m.thickness_mm:g}mm" for m in supplies.materials
            )
        )
    else:
        sheet = supplies.only
    sheet = sheet if thickness_mm is None else with_thickness(sheet, thickness_mm)
    return plan_coupon(
        sheet,
        hole_mm=hole_mm if hole_mm is not None else figures.hole_mm,
        lap_mm=figures.lap_mm,
        width_mm=figures.width_mm,
        bend_mm=figures.bend_mm,
    )


class _JobFigures(NamedTuple):
    """What a finished job says, in millimetres; None where it has nothing of the kind."""

    supplies: Supplies | None = None
    hole_mm: float | None = None
    lap_mm: float | None = None
    width_mm: float | None = None
    bend_mm: float | None = None


def _read_job(directory: Path) -> _JobFigures:
    """Return what a finished job says."""
    supplies = supplies_of(settings_from_job(directory / "job.toml"))
    crossing_map = read_crossing_map(directory / "crossing_map.json")
    threads = read_ribbon_report(directory / "ribbons.json").threads
    holes = [
        station.hole_mm
        for piece in crossing_map.pieces
        for station in piece.stations
        if station.hole_mm is not None
    ]
    laps = [joint.lap_mm for joint in crossing_map.joints if joint.lap_mm > 0.0]
    widths = [thread.narrowest_mm for thread in threads if thread.narrowest_mm is not None]
    bends = [thread.bend_mm for thread in threads if thread.bend_mm is not None]
    return _JobFigures(
        supplies,
        max(holes, default=None),
        median(laps) if laps else None,
        median(widths) if widths else None,
        min(bends, default=None),
    )


#: The files of a coupon.
_FILES = ("coupon.dxf", "coupon.png", "coupon.svg", "coupon.txt")


def check_coupon_folder(directory: Path) -> None:
    """Raise InputError unless a folder is new, empty, or has nothing but an older coupon's files.

    A link to a folder stands for that folder.
    """
    if directory.is_symlink() and not directory.exists():
        raise InputError(f"{directory} is a link to nowhere; name another folder with -o")
    if not directory.exists():
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file; name a folder with -o")
    names = sorted(path.name for path in directory.iterdir())
    foreign = [name for name in names if name not in _FILES]
    if not foreign and names:
        text = directory / "coupon.txt"
        known = text.is_file() and text.read_bytes().startswith(FIRST_WORDS.encode())
        foreign = [] if known else names
    if foreign:
        raise InputError(
            f"a coupon needs a folder of its own, and {directory} has other files "
            f"({few_of(foreign)}); name a new folder, such as -o "
            + shlex.quote(str(directory / "coupon"))
        )


def write_coupon(coupon: Coupon, directory: Path) -> None:
    """Write ``coupon.dxf``, ``.svg``, ``.png`` and ``.txt`` into a folder, made if it is not there.

    Raises
    ------
    InputError
        If a file cannot be written, or the folder has any other file.
    """
    check_coupon_folder(directory)
    drawing = draw_coupon(coupon)
    contents = {
        "coupon.dxf": dxf_bytes(drawing),
        "coupon.svg": svg_text(drawing).encode(),
        "coupon.png": png_bytes(drawing, titles={}),  # its pieces are engraved with what they are
        "coupon.txt": coupon_text(coupon).encode(),
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {directory}: {error.strerror}") from error
    write_files({directory / name: content for name, content in contents.items()})
