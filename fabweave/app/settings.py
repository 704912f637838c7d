"""Hold the settings of a job, make them of options, and keep them in job.toml."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from fabweave import __version__
from fabweave.app.options.table import OPTIONS, default, option_named, option_of_field
from fabweave.app.options.user_files import user_entries
from fabweave.core.entries import read_toml
from fabweave.core.errors import InputError
from fabweave.core.messages import closest_first

if TYPE_CHECKING:  # what options are is imported when they are used
    from collections.abc import Iterator, Mapping

    from fabweave.app.options.option import Option
    from fabweave.cut.micro_joints import MicroJoints
    from fabweave.cut.preflight.targets import Target
    from fabweave.cut.presets import Preset
    from fabweave.mesh.resize import Up
    from fabweave.picture.strand_colours import Strategy
    from fabweave.ribbon.width import WidthRule
    from fabweave.stock.material import Material
    from fabweave.stock.per_bunch import ByBunch
    from fabweave.stock.sheet_size import SheetSize

#: What --along takes but the name of a file.
ALONG_WORDS = ("x", "y", "z", "curvature")
#: Options that were, what they were where nobody asked for them, and what to write in their place.
_GONE: dict[str, tuple[str | None, str]] = {
    "scale": (None, "write the size that the object gets, such as size = '400mm'"),
    "handle": (None, "join the faces in a modelling program, and weave that mesh"),
    "irregular": ("any", "leave it out, and choose among numbers of quads"),
}
#: Panels at crossings are so long, as a share of their room, if that is left to fabweave.
_PANEL_SHARE = 0.7


@dataclass(frozen=True)
class Settings:
    """Everything that decides what a job makes; lengths in millimetres.

    What each field means, which values it takes and its default stand in the table of options
    (:mod:`fabweave.app.options.table`, and :func:`fabweave.app.options.page.options_page` for
    people). None means that fabweave chooses. Settings are checked when they are made: whoever has
    them has a job that can be meant.

    Raises
    ------
    InputError
        If a field is not what its option takes; the message names each that is wrong, and what it
        must be.

    Examples
    --------
    >>> Settings("shape:cube", boundary="open")
    Traceback (most recent call last):
        ...
    fabweave.core.errors.InputError: boundary: 'open' is not one of end, turn
    """

    mesh: str
    title: str | None = default("title")
    up: Up | None = default("up")
    weld: bool | None = default("weld")
    bodies: str = default("bodies")
    size_mm: float | None = default("size_mm")
    remesh: str | None = default("remesh")
    along: str | None = default("along")
    refine: str | None = default("refine")
    symmetrise: bool = default("symmetrise")
    fair: int = default("fair")
    leave_out: str | None = default("leave_out")
    rim: str = default("rim")
    pattern: str = default("pattern")
    twists: str | None = default("twists")
    twill_method: str = default("twill_method")
    twill_weights: str = default("twill_weights")
    twill_symmetry: int = default("twill_symmetry")
    boundary: str = default("boundary")
    course: str = default("course")
    material: str = default("material")
    materials: tuple[Material, ...] = default("materials")
    thickness_mm: float | ByBunch[float] | None = default("thickness_mm")
    width: WidthRule | None = default("width")
    open: float | None = default("open")
    smooth: int = default("smooth")
    crossing: float | None = default("crossing")
    clearance_mm: float = default("clearance_mm")
    max_length_mm: float | None = default("max_length_mm")
    prefer: str = default("prefer")
    kinds: str = default("kinds")
    spares: str | None = default("spares")
    hole_mm: float | None = default("hole_mm")
    holes: str | None = default("holes")
    fasten: str | None = default("fasten")
    hang: str | None = default("hang")
    hardware: str | None = default("hardware")
    joint: str = default("joint")
    lap_mm: float | None = default("lap_mm")
    slots: bool = default("slots")
    sheets: tuple[SheetSize, ...] = default("sheets")
    margin_mm: float = default("margin_mm")
    gap_mm: float | ByBunch[float] | None = default("gap_mm")
    rotations: str = default("rotations")
    effort: str = default("effort")
    seed: int = default("seed")
    layout: str | None = default("layout")
    colours: Strategy = default("colours")
    profile: str = default("profile")
    preset: Preset = default("preset")
    dxf: str = default("dxf")
    svg_units: str = default("svg_units")
    hairline_mm: float | None = default("hairline_mm")
    target: str = default("target")
    targets: tuple[Target, ...] = default("targets")
    strict: bool = default("strict")
    force: bool = default("force")
    labels: str = default("labels")
    label_side: str = default("label_side")
    paper: str = default("paper")
    kerf_mm: float = default("kerf_mm")
    micro_joints: MicroJoints | None = default("micro_joints")
    cut_order: str = default("cut_order")
    template: str = default("template")
    qr: str = default("qr")
    calibrate: float = default("calibrate")

    def __post_init__(self) -> None:
        """Refuse what no job can be made of."""
        wrong = list(self._hold_fields()) or list(_at_odds(self))
        if wrong:
            raise InputError("\n".join(wrong))

    def _hold_fields(self) -> Iterator[str]:
        """Hold each field as its option does, and say what is wrong with those that are not it."""
        for field in fields(self):
            option, value = option_of_field(field.name), getattr(self, field.name)
            usual = option.default_value
            # What is left as it was needs no parser to be imported; a mesh must be named.
            if type(value) is type(usual) and value == usual and field.name != "mesh":
                continue
            try:
                object.__setattr__(self, field.name, option.kind.hold(value))
            except InputError as error:
                yield f"{field.name}: {error}"

    def as_nested(self, sheets: tuple[SheetSize, ...]) -> tuple[SheetSize, ...]:
        """Return sheets as pieces are nested on them.

        Where the inside is engraved, whole sheets are drawn mirrored; so their outlines are
        mirrored before, and lie on the bed as they are.
        """
        if self.label_side != "inside":
            return sheets
        return tuple(sheet.mirrored() for sheet in sheets)

    @property
    def width_rule(self) -> WidthRule:
        """How wide ribbons are: by their width, or by how open the weave stays.

        Where that is left to fabweave, they have one width. On a built-in shape they take a share
        of their room, as its faces are alike, or get larger and smaller by degrees.
        """
        from fabweave.ribbon.width import EVEN, PROPORTIONAL  # noqa: PLC0415 - not for help

        if self.open is not None:
            return replace(PROPORTIONAL, relative=1.0 - self.open)
        if self.width is not None:
            return self.width
        regular = self.mesh.startswith("shape:") and self.remesh is None
        return PROPORTIONAL if regular else EVEN

    @property
    def panel_share(self) -> float:
        """Length of the panel at each crossing, as a share of its room."""
        if self.crossing is not None:
            return self.crossing
        return max(_PANEL_SHARE, self.width_rule.relative)

    @property
    def narrowable(self) -> bool:
        """Whether ribbons may be narrower than they are, as their width is left to fabweave."""
        return self.open is None and self.width_rule.auto

    def narrower(self, factor: float) -> Settings:
        """Return the settings with ribbons that are narrower by a factor everywhere, as typed."""
        width = option_of_field("width").kind.parse(str(self.width_rule.times(factor)))
        return replace(self, width=width, open=None)

    def with_width(self, rule: WidthRule) -> Settings:
        """Return the settings with another width, and panels at crossings as long as they were."""
        return replace(self, width=rule, open=None, crossing=self.panel_share)

    @property
    def remeshed(self) -> bool:
        """Whether the mesh is made anew before it is woven."""
        return self.remesh not in (None, "none")

    @property
    def line_mm(self) -> float:
        """The width of lines in the SVG."""
        return self.preset.hairline_mm if self.hairline_mm is None else self.hairline_mm


def _at_odds(settings: Settings) -> Iterator[str]:
    """Say which fields, each good in itself, do not go together."""
    # These rooms are needed only here, and not for help.
    from fabweave.cut.preflight.targets import target_named  # noqa: PLC0415
    from fabweave.flat.joint.kinds import parse_joint  # noqa: PLC0415
    from fabweave.mesh.openings.request import parse_leave_out  # noqa: PLC0415
    from fabweave.mesh.remesh.request import parse_remesh  # noqa: PLC0415
    from fabweave.stock.supplies import parse_materials, sort_of_material  # noqa: PLC0415

    if settings.rim != "none" and not parse_leave_out(settings.leave_out).diameters_mm:
        yield "rim: a ring needs a round opening; say --leave-out top:80mm, too"
    quads = parse_remesh(settings.remesh).kind == "quads" if settings.remesh else False
    if settings.along and not quads:
        yield "along: only new quads can be laid so; say --remesh quads:300, too"
    if settings.twists is not None and settings.pattern != option_of_field("pattern").default_value:
        yield "a pattern and twists were both given; give one of them"
    if settings.twill_symmetry > 1 and settings.twill_method == "voting":
        yield "twill_symmetry: votes keep no symmetry; leave out --twill-method voting"
    if settings.open is not None and settings.width is not None:
        yield "an opening and a width were both given; give one of them"
    try:
        for _, name in parse_materials(settings.material):
            sort_of_material(name, settings.materials)
    except InputError as error:
        yield f"material: {error}"
    try:
        target_named(settings.target, settings.targets)
    except InputError as error:
        yield f"target: {error}"
    try:
        parse_joint(settings.joint, lap_mm=settings.lap_mm)
    except InputError as error:
        yield f"lap_mm: {error}"


def settings_from_options(mesh: str, **options: Any) -> Settings:
    """Return the settings that options spelled as on the command line come to.

    Materials and targets of the user's own are known, from the configuration folder too.

    Parameters
    ----------
    mesh : str
        A file, or a shape such as ``"shape:torus?m=24&n=12"``.
    **options
        As on the command line, with underscores for hyphens: texts with units, plain numbers
        (lengths in millimetres), or what settings hold. None is as if nothing were said.
        ``machine`` names a machine profile, whose options count where they are not said.

    Raises
    ------
    InputError
        If there is no such option, or it does not take the value; the message says what it takes.

    Examples
    --------
    >>> settings = settings_from_options("shape:cube", size="40cm", kerf=0.15, sheet=["60x40cm:3"])
    >>> settings.size_mm, settings.kerf_mm, settings.sheets[0].quantity
    (400.0, 0.15, 3)
    """
    return _settings({"mesh": mesh, **options}, kept={}, where="")


def _of_machine(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that the named machine profile sets; none where none is named."""
    from fabweave.app.options.machines import machine_profile  # noqa: PLC0415 - it reads the table

    named = given.get("machine")
    return {} if named is None else machine_profile(str(named))


def settings_from_job(path: Path, **options: Any) -> Settings:
    """Return the settings of a finished job, but for the options that are given.

    Parameters
    ----------
    path : Path
        Its job.toml. A mesh, twists or a layout that it names may lie beside it.
    **options
        As :func:`settings_from_options` takes them, the mesh too.

    Raises
    ------
    InputError
        If the file cannot be read or is no job's, or an option does not take its value.
    """
    kept = read_job_options(path)
    for name, (usual, instead) in _GONE.items():
        if kept.pop(name, usual) != usual:
            raise InputError(f"{path} sets {name}, which is no option any more: {instead}")
    unknown = sorted(set(kept) - {option.name for option in OPTIONS})
    if unknown:
        known = ", ".join(sorted(option.name for option in OPTIONS))
        raise InputError(
            f"{path} sets {len(unknown)} unknown options: {', '.join(unknown)}; known are {known}"
        )
    if isinstance(kept.get("layout"), str):
        kept["layout"] = str(path.parent / kept["layout"])
    settings = _settings(options, kept, where=f"{path}, ")
    if not settings.mesh.startswith("shape:"):
        settings = replace(settings, mesh=_found(settings.mesh, path.parent))
    if settings.twists is not None:
        settings = replace(settings, twists=_found(settings.twists, path.parent))
    if settings.along not in (None, *ALONG_WORDS):
        settings = replace(settings, along=_found(str(settings.along), path.parent))
    return settings


def _found(name: str, folder: Path) -> str:
    """Return where a file is: where it is said to be, or else in a folder, if it is there."""
    beside = folder / name
    return str(beside) if not os.path.exists(name) and os.path.exists(beside) else name


def _settings(given: Mapping[str, Any], kept: Mapping[str, Any], where: str) -> Settings:
    """Make settings of options that are given, and of those that a profile and a job.toml keep."""
    kept = {**kept, **_of_machine(given)}
    given = {name: value for name, value in given.items() if name != "machine"}
    for name in given:
        if all(name != option.name for option in OPTIONS):
            closest = closest_first(name, [option.name for option in OPTIONS])[0]
            raise InputError(f"there is no option {name!r}; the nearest is {closest!r}")
    values: dict[str, Any] = {}
    for option in OPTIONS:
        if given.get(option.name) is not None:
            value = _parsed(option, given, "")
        elif kept.get(option.name) is not None:
            value = _parsed(option, kept, where)
        else:
            continue
        # Sheets that are plain come after those of a list of stock.
        plain = values.get(option.field, ()) if option.field == "sheets" else ()
        values[option.field] = (*value, *plain) if plain else value
    if "mesh" not in values:
        raise InputError("no mesh: name a file, or a shape such as shape:torus?m=24&n=12")
    return Settings(**(values | _user_library(values, given, kept, where)))


def _parsed(option: Option, told: Mapping[str, Any], where: str) -> Any:
    """Return what is told of an option, as settings hold it."""
    try:
        return option.kind.parse(told[option.name])
    except InputError as error:
        raise InputError(f"{where}{option.name}: {error}") from error


def _user_library(
    values: Mapping[str, Any], given: Mapping[str, Any], kept: Mapping[str, Any], where: str
) -> dict[str, Any]:
    """Return those of the user's own materials and targets that the settings name.

    What a finished job names is as its job.toml has it, whatever is in the configuration folder.
    """
    from fabweave.cut.preflight.targets import targets_in_use  # noqa: PLC0415 - not for help
    from fabweave.stock.supplies import materials_in_use, parse_materials  # noqa: PLC0415

    known: dict[str, tuple[Any, ...]] = {}
    for name, naming in (("materials", "material"), ("targets", "target")):
        option = option_named(name)
        from_job = naming in kept and given.get(naming) is None
        known[name] = () if from_job else user_entries(name)
        for told, source in ((kept, where), (given, "")):
            if told.get(name) is not None:
                known[name] += _parsed(option, told, source)
    material = values.get("material", option_named("material").default)
    target = values.get("target", option_named("target").default)
    return {
        "materials": materials_in_use(parse_materials(material), known["materials"]),
        "targets": targets_in_use(target, known["targets"]),
    }


def settings_table(settings: Settings) -> dict[str, Any]:
    """Return the settings under the names and in the form of the command line's options."""
    told = {option.name: option.kind.write(getattr(settings, option.field)) for option in OPTIONS}
    return {name: value for name, value in told.items() if value is not None}


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
    job = read_toml(path, "the settings").get("job")
    if not isinstance(job, dict):
        raise InputError(f"{path} has no table [job] with settings; a finished job's job.toml has")
    return job
