"""Hold the settings of a job, and keep them in job.toml."""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from fabweave import __version__
from fabweave.core.errors import InputError
from fabweave.cut.labels.texts import LABELS, SIDES
from fabweave.cut.micro_joints import MicroJoints
from fabweave.cut.presets import Preset, check_hairline, preset_named, preset_names
from fabweave.mesh.resize import Up
from fabweave.picture.thread_colours import STRATEGIES, Strategy
from fabweave.ribbon.width import WidthRule
from fabweave.stock.per_bunch import ByBunch, by_bunch, format_by_bunch
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.sheet_text import format_stock, stock_table

EFFORTS = ("quick", "normal", "best")
UPS = ("z", "y", "x")
BOUNDARIES = ("end", "turn")
DXF_VERSIONS = ("R2010", "R2000", "R12")
PAPERS = ("a4", "letter")
PROFILES = ("maker", "service")
SVG_UNITS = ("mm", "px96")
CUT_ORDERS = ("short", "cool")
#: Papers of the sheets at full size: one page as large as the sheet, or tiles.
TEMPLATES = ("sheet", "a4", "a3", "letter", "none")
#: TOML holds whole numbers up to this.
MOST_SEED = 2**63 - 1
#: The file of a finished job in which its layout is recorded.
LAYOUT_FILE = "crossing_map.json"
#: Settings that are one of a few words.
CHOICES = {
    "up": UPS,
    "boundary": BOUNDARIES,
    "effort": EFFORTS,
    "colours": STRATEGIES,
    "profile": PROFILES,
    "dxf": DXF_VERSIONS,
    "svg_units": SVG_UNITS,
    "labels": LABELS,
    "label_side": SIDES,
    "paper": PAPERS,
    "cut_order": CUT_ORDERS,
    "template": TEMPLATES,
}


@dataclass(frozen=True)
class Settings:
    """Everything that decides what a job makes; lengths in millimetres.

    ``up`` is the axis of the mesh that points up: the mesh is turned so that it becomes z.
    ``remesh`` and ``refine`` are as on the command line, such as ``"quads:3000"`` and
    ``"catmull-clark:2"``; ``fair`` counts steps of fairing; ``boundary`` says what threads do at
    the boundary of an open mesh: end or turn back. ``width`` is the ribbons' width and
    ``crossing`` the relative crossing length of the projection method; ``smooth`` counts the
    cross-lines between two crossings. ``None`` means that fabweave chooses: the material's
    thickness, gap and sheet, the greatest length of pieces, and the largest hole that the
    ribbons have room for (``hole_mm=0``: no holes). ``joint`` is as on the command line, such as
    ``"rivet:2"``; ``lap_mm=None`` is as long as it needs to be; ``slots`` asks for slots in place
    of every second hole. ``profile`` says whether those who cut get sheets alone, or a file for
    each distinct piece besides; ``preset`` holds the colours of the layers, and ``hairline_mm`` the
    width of lines in the SVG, ``None`` for the preset's. ``target`` names whose rules the pieces
    are checked against, and ``strict`` refuses a job that breaks one. ``labels`` says how much is
    engraved, and ``label_side`` on which face. The manual is printed on ``paper``. ``kerf_mm`` and
    ``micro_joints`` ask for sheets to cut beside the nominal ones; ``cut_order`` is that of little
    travel or of little heat, and ``template`` the paper of sheets at full size. ``sheets`` are the
    stock, those of a list with their names; ``rotations`` says at which angles pieces stand on
    them, such as ``"grain:5deg"``.
    ``layout`` names the crossing map of a finished job whose layout is taken.
    ``material``, ``thickness_mm`` and ``gap_mm`` are of all threads or of each bunch: the first as
    on the command line, such as ``"warp=card,weft=birch-veneer"``, the others as pairs of a name
    and a length.
    """

    mesh: str
    up: Up = "z"
    size_mm: float | None = None
    scale: float | None = None
    remesh: str | None = None
    refine: str | None = None
    fair: int = 0
    pattern: str = "plain"
    boundary: str = "end"
    material: str = "card"
    thickness_mm: float | ByBunch[float] | None = None
    width: WidthRule = WidthRule(auto=True)  # noqa: RUF009 - a frozen value
    smooth: int = 3
    crossing: float = 0.7
    clearance_mm: float = 0.1
    max_length_mm: float | None = None
    hole_mm: float | None = None
    joint: str = "rivet"
    lap_mm: float | None = None
    slots: bool = False
    sheets: tuple[SheetSize, ...] = ()
    margin_mm: float = 10.0
    gap_mm: float | ByBunch[float] | None = None
    rotations: str = "free"
    effort: str = "normal"
    seed: int = 0
    layout: str | None = None
    colours: Strategy = "safe"
    profile: str = "maker"
    preset: Preset = field(default_factory=preset_named)
    dxf: str = "R2010"
    svg_units: str = "mm"
    hairline_mm: float | None = None
    target: str = "default"
    strict: bool = False
    labels: str = "full"
    label_side: str = "outside"
    paper: str = "a4"
    kerf_mm: float = 0.0
    micro_joints: MicroJoints | None = None
    cut_order: str = "short"
    template: str = "sheet"

    def as_nested(self, sheets: tuple[SheetSize, ...]) -> tuple[SheetSize, ...]:
        """Return sheets as pieces are nested on them.

        Where the inside is engraved, whole sheets are drawn mirrored; so their outlines are
        mirrored before, and lie on the bed as they are.
        """
        if self.label_side != "inside":
            return sheets
        return tuple(sheet.mirrored() for sheet in sheets)

    def __post_init__(self) -> None:
        """Refuse a seed that no job.toml could hold."""
        if not 0 <= self.seed <= MOST_SEED:
            raise InputError(f"the seed is {self.seed}, and must be from 0 to {MOST_SEED}")
        if self.hairline_mm is not None:
            check_hairline(self.hairline_mm)

    @property
    def line_mm(self) -> float:
        """The width of lines in the SVG."""
        return self.preset.hairline_mm if self.hairline_mm is None else self.hairline_mm


def settings_table(settings: Settings) -> dict[str, Any]:
    """Return the settings under the names and in the form of the command line's options."""
    return {key: value for key, value in _options(settings).items() if value is not None}


def _options(settings: Settings) -> dict[str, Any]:
    """Return all options; None where nothing was said."""

    def length(value: float | ByBunch[float] | None) -> str | None:
        if value is None:
            return None
        return format_by_bunch(by_bunch(value), lambda one: f"{one:.10g}mm")

    return {
        "mesh": settings.mesh,
        "up": settings.up,
        "size": length(settings.size_mm),
        "scale": settings.scale,
        "remesh": settings.remesh,
        "refine": settings.refine,
        "fair": settings.fair,
        "pattern": settings.pattern,
        "boundary": settings.boundary,
        "material": settings.material,
        "thickness": length(settings.thickness_mm),
        "width": str(settings.width),
        "smooth": settings.smooth,
        "crossing": settings.crossing,
        "clearance": length(settings.clearance_mm),
        "max_length": length(settings.max_length_mm),
        "hole": "none" if settings.hole_mm == 0 else length(settings.hole_mm),
        "joint": settings.joint,
        "lap": length(settings.lap_mm),
        "slots": settings.slots,
        "sheet": [format_stock(sheet) for sheet in settings.sheets if sheet.plain],
        "stock": stock_table(sheet for sheet in settings.sheets if not sheet.plain),
        "margin": length(settings.margin_mm),
        "gap": length(settings.gap_mm),
        "rotations": settings.rotations,
        "effort": settings.effort,
        "seed": settings.seed,
        # Beside job.toml, and read from there.
        "layout": None if settings.layout is None else LAYOUT_FILE,
        "colours": settings.colours,
        "profile": settings.profile,
        "preset": _preset(settings.preset),
        "dxf": settings.dxf,
        "svg_units": settings.svg_units,
        "hairline": length(settings.hairline_mm),
        "target": settings.target,
        "strict": settings.strict,
        "labels": settings.labels,
        "label_side": settings.label_side,
        "paper": settings.paper,
        "kerf": length(settings.kerf_mm or None),
        "micro_joints": None if settings.micro_joints is None else str(settings.micro_joints),
        "cut_order": settings.cut_order,
        "template": settings.template,
    }


def _preset(preset: Preset) -> str | dict[str, Any]:
    """Return a preset's name, or all of it if it is the user's own, so that the job repeats."""
    known = preset.name in preset_names() and preset_named(preset.name) == preset
    return preset.name if known else preset.table


#: The names of all options that a job.toml may set.
OPTION_NAMES = frozenset(_options(Settings(mesh="")))


def job_toml(settings: Settings, outcome: dict[str, Any]) -> str:
    """Return the text of job.toml: the settings in force, and what they came to."""
    head = (
        f"# Made by fabweave {__version__}. Make it again with:\n"
        "#   fabweave make --config job.toml -o DIR\n"
    )
    return head + tomli_w.dumps(
        {"fabweave": __version__, "job": settings_table(settings), "outcome": outcome}
    )


def read_job_options(path: Path) -> dict[str, Any]:
    """Return the options that a job.toml sets.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or has no table ``[job]``.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"cannot read the settings in {path}: {error}") from error
    job = content.get("job")
    if not isinstance(job, dict):
        raise InputError(f"{path} has no table [job] with settings; a finished job's job.toml has")
    return job
