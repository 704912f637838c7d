"""Say what options take that may come from a file, and that job.toml keeps all of."""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fabweave.core.entries import check_document, entry_table, in_range, read_toml
from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import shown
from fabweave.options.kinds import Kind, later, load, place

_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
_MEASURED = re.compile(r"(?P<folder>.+):\s*(?P<number>\d+(?:\.\d+)?)\s*(?P<unit>s|min|h)")
_LEAST_FACTOR, _MOST_FACTOR = 0.02, 50.0
_is_factor = in_range(_LEAST_FACTOR, _MOST_FACTOR)
_FACTOR_WORDS = f"a number from {_LEAST_FACTOR:g} to {_MOST_FACTOR:g}"


def parse_calibration(text: str) -> float:
    """Return the factor of a machine that a text means.

    It is a number, or a finished job's folder and what its machine took. The estimate for that job
    is the middle of its range (of the ratio of its ends), before any factor that it was made with
    itself.

    Parameters
    ----------
    text : str
        Such as ``1.3``, or ``torus:42min``: the whole time of the machine for all sheets of the job
        in the folder ``torus``, in s, min or h.

    Raises
    ------
    InputError
        If it is neither, or the folder has no estimate; the message says what is expected.

    Examples
    --------
    >>> parse_calibration("1.3")
    1.3
    """
    try:
        factor = float(text)
    except ValueError:
        match = _MEASURED.fullmatch(text.strip())
        if match is None:
            raise InputError(
                f"{shown(text)} is neither a number such as 1.3 nor a finished job's folder and "
                "what its machine took, such as torus:42min"
            ) from None
        measured = float(match["number"]) * _SECONDS[match["unit"]]
        factor = round(measured / _estimated_s(Path(match["folder"])), 4)
    if _is_factor(factor) is None:
        raise InputError(f"{shown(text)} is a factor of {factor:g}, not {_FACTOR_WORDS}")
    return factor


def _estimated_s(folder: Path) -> float:
    """Return what was estimated for the machine in a finished job, in seconds."""
    path = folder / "waste.json"
    text = read_text(path, "the estimate of a finished job")
    try:
        estimate = json.loads(text)["estimate"]
        low, high = (float(end) for end in estimate["machine_s"])
        middle = math.sqrt(low * high) / float(estimate["calibration"])
    except (ValueError, KeyError, TypeError, ZeroDivisionError, RecursionError) as error:
        raise InputError(
            f"{path} has no estimate of the machine's time; make that job again, with a material "
            "whose cutting speed is known"
        ) from error
    if not (math.isfinite(middle) and middle > 0.0):
        raise InputError(f"{path} estimates {middle:g} s, from which nothing can be calibrated")
    return middle


#: The file of a finished job in which its layout is recorded; job.toml lies beside it.
LAYOUT_FILE = "crossing_map.json"


def calibration() -> Kind:
    """Return the kind of factors, or of a finished job's folder and what its machine took."""

    def write(value: float) -> float | None:
        return None if value == 1.0 else value

    expected = f"{_FACTOR_WORDS}, or a folder and a time such as 'torus:42min'"
    return Kind("FACTOR|DIR:TIME", expected, _is_factor, parse_calibration, write)


def layout() -> Kind:
    """Return the kind of files with a recorded layout; a finished job has its own beside it."""

    def write(value: str | None) -> str | None:
        return None if value is None else LAYOUT_FILE

    return place("FILE", "the name of a crossing_map.json", write)


def leave_out() -> Kind:
    """Return the kind of openings and faces that are left out; a file's faces take its place."""
    module = "fabweave.mesh.leave_out."

    def accept(value: Any) -> Any:
        return load(module + "tidy_leave_out")(value) if isinstance(value, str) else None

    read = later(module + "read_leave_out")
    expected = "openings such as 'top:80mm', numbers of faces such as '12,13', or a file of these"
    return Kind("top:D|bottom:D|FILE|N,N,…", expected, accept, read, textual=True)


def preset() -> Kind:
    """Return the kind of a preset's name, a file that ends in .toml, or a table of job.toml."""
    module = "fabweave.sheet.presets."

    def accept(value: Any) -> Any:
        return value if isinstance(value, load(module + "Preset")) else None

    def of_table(table: Mapping[str, Any]) -> Any:
        return load(module + "read_preset")(table, "the preset in job.toml")

    names, read = later(module + "preset_names"), later(module + "find_preset")

    def write(value: Any) -> Any:
        # All of it, if it is the user's own, so that the job can be made again.
        known = value.name in names() and load(module + "preset_named")(value.name) == value
        return value.name if known else value.table

    expected = "a Preset, one of {choices}, or a file that ends in .toml"
    return Kind("NAME|FILE.toml", expected, accept, read, write, words=names, of_table=of_table)


def sheets() -> Kind:
    """Return the kind of sheets of which there is nothing to know but size, number and bunch."""

    def write(value: Any) -> list[str]:
        stock = load("fabweave.stock.sheet_size.format_stock")
        return [stock(sheet) for sheet in value if sheet.plain and not sheet.is_roll]

    expected = "a sheet such as '600x400mm:3', or a list of them"
    read = later("fabweave.stock.sheet_size.parse_stock")
    return Kind("WxH[:N]", expected, _accept_sheets, read, write, repeatable=True)


def bed() -> Kind:
    """Return the kind of one sheet's size, which holds for any number of sheets."""

    def accept(value: Any) -> Any:
        found = _accept_sheets(value)
        fits = found is not None and len(found) == 1 and found[0].plain
        return found[0] if fits and not found[0].bunch and found[0].quantity is None else None

    def write(value: Any) -> str | None:
        return None if value is None else str(load("fabweave.stock.sheet_size.format_stock")(value))

    return Kind("WxH", "a size such as '600x400mm'", accept, sheets().read, write)


def stock_list() -> Kind:
    """Return the kind of rolls, and of files that list stock or the tables that job.toml keeps."""

    def read(text: str) -> Any:
        if is_roll(text):
            return (load("fabweave.stock.sheet_size.parse_roll")(text),)
        return load("fabweave.stock.stock_file.read_stock")(Path(text))

    def of_table(table: Mapping[str, Any]) -> Any:
        return load("fabweave.stock.stock_file.stock_of")(table, "the stock in job.toml")

    def write(value: Any) -> Any:
        module = "fabweave.stock.sheet_size."
        table = load(module + "stock_table")([sheet for sheet in value if not sheet.plain])
        rolls = [sheet for sheet in value if sheet.plain and sheet.is_roll]
        texts = [load(module + "format_stock")(roll) for roll in rolls]
        return [*texts, *([table] if table else [])] if texts else table

    expected = "a list of stock, such as stock.toml, or a roll such as roll:12mm:50m"
    return Kind(
        "FILE|roll:W:L[:N]", expected, _accept_sheets, read, write, repeatable=True,
        of_table=of_table,
    )  # fmt: skip


def is_roll(text: object) -> bool:
    """Return whether a value of ``--stock`` is a roll, and not a file."""
    return isinstance(text, str) and text.strip().lower().startswith("roll:")


def _accept_sheets(value: Any) -> Any:
    """Return sheets, if they are some that can be cut from."""
    kind = load("fabweave.stock.sheet_size.SheetSize")
    found = (value,) if isinstance(value, kind) else value
    if not isinstance(found, list | tuple) or not all(isinstance(one, kind) for one in found):
        return None
    try:
        if found:
            load("fabweave.stock.sheet_size.check_stock")(found, 0.0)
        for sheet in found:
            if sheet.bunch:
                load("fabweave.stock.per_bunch.bunch_number")(sheet.bunch)
    except TypeError:  # a text in place of a number
        return None
    names = [sheet.name for sheet in found if sheet.name]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InputError(f"{shown(min(twice))} is the name of two entries of the stock; rename one")
    return tuple(found)


def library(what: str, module: str) -> Kind:
    """Return the kind of files with entries of the user's own, or of what job.toml keeps of them.

    Parameters
    ----------
    what : str
        What an entry is: ``material`` or ``target``.
    module : str
        Where ``materials_of`` or ``targets_of`` stands.
    """

    def accept(value: Any) -> Any:
        kind = load(f"{module}.{what.title()}")
        found = (value,) if isinstance(value, kind) else value
        if not isinstance(found, list | tuple) or not all(isinstance(one, kind) for one in found):
            return None
        # Of two entries of one name, the later counts.
        named = {one.name: one for one in found}
        check_document(named, f"the {what}s")
        return tuple(named.values())

    def read(text: str) -> Any:
        return load(f"{module}.{what}s_of")(read_toml(Path(text), f"{what}s"), text)

    def of_table(table: Mapping[str, Any]) -> Any:
        return load(f"{module}.{what}s_of")(table, f"the {what}s in job.toml")

    def write(value: Any) -> Any:
        return {one.name: entry_table(one) for one in value} or None

    expected = f"a file of {what}s such as {what}s.toml"
    return Kind("FILE", expected, accept, read, write, repeatable=True, of_table=of_table)
