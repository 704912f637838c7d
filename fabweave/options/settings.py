"""Hold the settings of a job, make them of options, and keep them in job.toml."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from fabweave import __version__
from fabweave.core.entries import read_toml
from fabweave.core.errors import InputError
from fabweave.core.messages import closest_first
from fabweave.options.file_kinds import is_roll
from fabweave.options.kinds import load, number
from fabweave.options.option import GROUPS, STOCK
from fabweave.options.table import CAME, OPTIONS, option_named, option_of_field, still_known
from fabweave.options.user_files import user_entries

if TYPE_CHECKING:  # what options are is imported when they are used
    from collections.abc import Iterator, Mapping

    from fabweave.core.search import Search
    from fabweave.mesh.settings import MeshSettings
    from fabweave.options.option import Option
    from fabweave.piece.settings import PieceSettings
    from fabweave.ribbon.settings import RibbonSettings
    from fabweave.ribbon.width import WidthRule
    from fabweave.sheet.settings import MachineSettings
    from fabweave.stock.settings import StockSettings
    from fabweave.weave.settings import WeaveSettings


@dataclass(frozen=True)
class Settings:
    """Everything that decides what a job makes, by the rooms that it concerns; in millimetres.

    What each field means, which values it takes and its default stand in the table of options
    (:mod:`fabweave.options.table`, and ``fabweave guide options`` for people). None
    means that fabweave chooses. :meth:`of` and :meth:`but` check them: whoever has settings has a
    job that can be meant.
    """

    mesh: MeshSettings
    weave: WeaveSettings
    ribbons: RibbonSettings
    pieces: PieceSettings
    stock: StockSettings
    search: Search
    machine: MachineSettings

    @classmethod
    def of(cls, source: str, **values: Any) -> Settings:
        """Return the settings of a job on a mesh, with defaults for what is not said.

        Parameters
        ----------
        source : str
            A file, or a shape such as ``shape:torus?m=24&n=12``.
        **values
            By the names of their fields, whatever group holds them.

        Raises
        ------
        InputError
            If a field is not what its option takes; the message names each that is wrong, and what
            it must be.

        Examples
        --------
        >>> Settings.of("shape:cube", size_mm=300.0).mesh.size_mm
        300.0
        >>> Settings.of("shape:cube", boundary="open")
        Traceback (most recent call last):
            ...
        fabweave.core.errors.InputError: boundary: 'open' is not one of auto, end, turn
        """
        defaults = {option.field: option_of_field(option.field).default_value for option in OPTIONS}
        return cls._held({**defaults, "source": source, **values})

    def but(self, **values: Any) -> Settings:
        """Return the settings with other values of some fields, whatever group holds them.

        Raises
        ------
        InputError
            As for :meth:`of`.
        """
        return self._held({**self.values, **values})

    @property
    def values(self) -> dict[str, Any]:
        """All fields of all groups, by their names."""
        return {name: value for one in vars(self).values() for name, value in vars(one).items()}

    @classmethod
    def _held(cls, values: Mapping[str, Any]) -> Settings:
        """Hold each value as its option does, and say what is wrong with those that are not it."""
        groups: dict[str, dict[str, Any]] = {option.group: {} for option in OPTIONS}
        wrong = []
        for name, value in values.items():
            option = option_of_field(name)
            usual = option.default_value
            try:
                # What is left as it was needs no parser to be imported; a mesh must be named.
                same = type(value) is type(usual) and value == usual and option.name != "mesh"
                groups[option.group][name] = value if same else option.kind.hold(value)
            except InputError as error:
                wrong.append(f"{option.name if name == 'source' else name}: {error}")
        if wrong:
            raise InputError("\n".join(wrong))
        settings = cls(
            **{group.lower(): load(kind)(**groups[group.lower()]) for group, kind in GROUPS.items()}
        )
        wrong = list(_at_odds(settings))
        if wrong:
            raise InputError("\n".join(wrong))
        return settings

    @property
    def width_rule(self) -> WidthRule:
        """How wide ribbons are.

        Strips from a roll are as wide as that. Where it is left to fabweave, they have one width.
        On a built-in shape they take a share of their room, as its faces are alike, or get larger
        and smaller by degrees.
        """
        from fabweave.ribbon.width import EVEN, PROPORTIONAL, WidthRule  # noqa: PLC0415 - not for help

        if self.ribbons.width is not None:
            return self.ribbons.width
        if self.stock.rolls:
            width_mm = self.stock.rolls[0].height_mm
            return WidthRule(least_mm=width_mm, most_mm=width_mm)
        regular = self.mesh.source.startswith("shape:") and self.mesh.remesh is None
        return PROPORTIONAL if regular else EVEN

    @property
    def narrowable(self) -> bool:
        """Whether ribbons may be narrower than they are, as their width is left to fabweave."""
        return self.width_rule.auto

    @property
    def common_cuts(self) -> bool:
        """Whether strips share cuts.

        Straight ones do that are parted by a kerf at most, and lie a kerf apart then; those with
        square ends do if nobody says otherwise.
        """
        square = self.square_ends
        near = all(self._near(gap) if gap is not None else square for gap in self._gaps_mm)
        return self.ribbons.straight and near and self.machine.micro_joints is None

    @property
    def square_ends(self) -> bool:
        """Whether straight strips are rectangles, whatever joins them."""
        joint = self.pieces.joint.partition(",")[0].partition(":")[0]
        return joint in ("rivet", "glue", "tuck", "none")

    @property
    def _gaps_mm(self) -> set[float | None]:
        """The gaps that are asked for; None where that is left open."""
        from fabweave.stock.per_bunch import by_bunch  # noqa: PLC0415 - not for help

        return {gap for _, gap in by_bunch(self.stock.gap_mm)}

    def _near(self, gap_mm: float) -> bool:
        """Whether a gap leaves no more than one cut between two strips."""
        return gap_mm <= self.machine.kerf_mm

    @property
    def cut_twice(self) -> bool:
        """Whether straight strips lie edge on edge, and cannot share cuts."""
        near = any(gap is not None and self._near(gap) for gap in self._gaps_mm)
        return self.ribbons.straight and near and not self.common_cuts

    def narrower(self, factor: float) -> Settings:
        """Return the settings with ribbons that are narrower by a factor everywhere, as typed."""
        factor = number().argument("factor", factor)
        width = option_of_field("width").kind.parse(str(self.width_rule.times(factor)))
        return self.but(width=width)


def _at_odds(settings: Settings) -> Iterator[str]:
    """Say which fields, each good in itself, do not go together."""
    # These rooms are needed only here, and not for help.
    from fabweave.sheet.targets import target_named  # noqa: PLC0415
    from fabweave.stock.supplies import parse_materials, sort_of_material  # noqa: PLC0415

    weave = settings.weave
    if weave.twists is not None and weave.pattern != option_of_field("pattern").default_value:
        yield "a pattern and twists exclude each other; give one of them"
    try:
        for _, name in parse_materials(settings.stock.material):
            sort_of_material(name, settings.stock.library)
    except InputError as error:
        yield f"material: {error}"
    try:
        if settings.pieces.former not in (None, "auto"):
            sort_of_material(str(settings.pieces.former), settings.stock.library)
    except InputError as error:
        yield f"former: {error}"
    try:
        target_named(settings.machine.target, settings.machine.rules)
    except InputError as error:
        yield f"target: {error}"
    if settings.pieces.base == "on" and settings.pieces.hang is not None:
        yield "base: an object stands on a board or hangs; leave out --base or --hang"
    if settings.cut_twice and not settings.stock.rolls:
        yield (
            "gap: strips edge on edge share cuts, which leaves no place for bridges; leave out "
            "--micro-joints, or part the strips with --gap 2mm"
            if settings.machine.micro_joints is not None
            else "gap: strips of all bunches share cuts, or of none; name one --gap for all"
        )
    if settings.stock.rolls:
        yield from _roll_at_odds(settings)


#: Widths in inches are rounded.
_SAME_MM = 1e-3


def _roll_at_odds(settings: Settings) -> Iterator[str]:
    """Say what does not go together with strips from a roll, which scissors cut."""
    stock, width = settings.stock, settings.ribbons.width
    widths = sorted({roll.height_mm for roll in stock.rolls})
    told = " and ".join(f"{each:g} mm" for each in widths)
    if len(stock.rolls) < len(stock.sheets):
        yield "stock: a job is cut from rolls or from sheets; leave the ones or the others out"
    if len(widths) > 1:
        yield f"stock: all strips have one width, but there are rolls of {told}; name one of them"
    if not settings.ribbons.straight:
        yield "stock: strips from a roll are straight; add --strips straight, or name a sheet"
    bounds = [] if width is None else [width.least_mm, width.most_mm]
    if any(abs(bound - widths[0]) > _SAME_MM for bound in bounds):
        yield f"width: the roll is {told} wide, and so are its strips; leave out --width"
    if settings.machine.kerf_mm or settings.machine.micro_joints is not None:
        yield "kerf: scissors cut rolls, and burn nothing; leave out --kerf and --micro-joints"
    if not settings.square_ends:
        yield "joint: strips from a roll end square; use --joint rivet, glue, tuck or none"
    if settings.mesh.rim != "none":
        yield "rim: a ring is cut from a sheet, and there are only rolls; leave out --rim"
    if stock.rotations.startswith("across"):
        yield "rotations: strips from a roll run along it; leave out --rotations"


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
    >>> settings.mesh.size_mm, settings.machine.kerf_mm, settings.stock.sheets[0].quantity
    (400.0, 0.15, 3)
    """
    return _settings({"mesh": mesh, **options}, kept={}, where="")


def _of_machine(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that the named machine profile sets; none where none is named."""
    from fabweave.options.machines import machine_profile  # noqa: PLC0415 - it reads the table

    named = given.get("machine")
    return {} if named is None else machine_profile(str(named))


def _of_stock(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that the named lists of stock set beside their sheets."""
    stock = given.get("stock")
    table: dict[str, Any] = {}
    known = [option.name for option in OPTIONS if option.section == STOCK]
    for named in stock if isinstance(stock, list | tuple) else [stock]:
        if not isinstance(named, str | os.PathLike) or is_roll(named):
            continue
        for name, value in read_toml(Path(named), "the stock").items():
            if isinstance(value, list | dict):
                continue
            if name not in known:
                raise InputError(
                    f"stock: {named} sets {name!r}, which is no option of the stock; these are: "
                    f"{', '.join(closest_first(name, known))}"
                )
            table[name] = value
    return table


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
    unknown = sorted(set(kept) - {option.name for option in OPTIONS})
    if unknown:
        known = ", ".join(sorted(option.name for option in OPTIONS))
        raise InputError(
            f"{path} sets {len(unknown)} unknown options: {', '.join(unknown)}; known are {known}"
        )
    if isinstance(kept.get("layout"), str):
        kept["layout"] = str(path.parent / kept["layout"])
    settings = _settings(options, kept, where=f"{path}, ")
    mesh, twists = settings.mesh, settings.weave.twists
    if not mesh.source.startswith("shape:"):
        settings = settings.but(source=_found(mesh.source, path.parent))
    if twists is not None:
        settings = settings.but(twists=_found(twists, path.parent))
    return settings


def _found(name: str, folder: Path) -> str:
    """Return where a file is: where it is said to be, or else in a folder, if it is there."""
    beside = folder / name
    return str(beside) if not os.path.exists(name) and os.path.exists(beside) else name


def _settings(given: Mapping[str, Any], kept: Mapping[str, Any], where: str) -> Settings:
    """Make settings of options that are given, and of those that a profile and a job.toml keep."""
    kept = {**kept, **_of_machine(given), **_of_stock(given)}
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
    if "source" not in values:
        raise InputError("there is no mesh: name a file, or a shape such as shape:torus?m=24&n=12")
    return Settings.of(**(values | _user_library(values, given, kept, where)))


def _parsed(option: Option, told: Mapping[str, Any], where: str) -> Any:
    """Return what is told of an option, as settings hold it."""
    return option.kind.argument(f"{where}{option.name}", told[option.name])


def _user_library(
    values: Mapping[str, Any], given: Mapping[str, Any], kept: Mapping[str, Any], where: str
) -> dict[str, Any]:
    """Return those of the user's own materials and targets that the settings name.

    What a finished job names is as its job.toml has it, whatever is in the configuration folder.
    """
    from fabweave.sheet.targets import targets_in_use  # noqa: PLC0415 - not for help
    from fabweave.stock.supplies import materials_in_use, parse_materials  # noqa: PLC0415

    known: dict[str, tuple[Any, ...]] = {}
    for name, naming in (("library", "material"), ("rules", "target")):
        option = option_named(name)
        from_job = naming in kept and given.get(naming) is None
        known[name] = () if from_job else user_entries(name)
        for told, source in ((kept, where), (given, "")):
            if told.get(name) is not None:
                known[name] += _parsed(option, told, source)
    material = values.get("material", option_named("material").default)
    target = values.get("target", option_named("target").default)
    return {
        "library": materials_in_use(
            (*parse_materials(material), ("", values.get("former") or "")), known["library"]
        ),
        "rules": targets_in_use(target, known["rules"]),
    }


def settings_table(settings: Settings) -> dict[str, Any]:
    """Return the settings under the names and in the form of the command line's options."""
    told = {
        option.name: option.kind.write(getattr(getattr(settings, option.group), option.field))
        for option in OPTIONS
    }
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
    """Return the options that a job.toml sets, or meant before there were more.

    Raises
    ------
    InputError
        If the file cannot be read, is no TOML, or has no table ``[job]``.
    """
    told = read_toml(path, "the settings")
    job = told.get("job")
    if not isinstance(job, dict):
        raise InputError(
            f"{path} has no table [job] with settings; use the job.toml of a finished job"
        )
    return {**(CAME if "outcome" in told else {}), **still_known(job)}
