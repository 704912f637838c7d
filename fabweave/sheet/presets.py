"""Look up which colour each layer has for a machine's software.

No colour convention is universal, so it is a table (``presets.toml``), not a constant.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fabweave.core.entries import read_toml, shipped_tables
from fabweave.core.errors import InputError
from fabweave.core.messages import closest_first, shown
from fabweave.sheet.drawing import Layer

#: The preset that is used where none is asked for.
DEFAULT_PRESET = "lightburn"
#: How wide lines are in the SVG: drivers take thin lines for cuts and thick ones for pictures.
HAIRLINE_MM = 0.025
#: Lines that are wider are no lines to any machine, and files cannot say finer ones, millimetres.
WIDEST_MM, FINEST_MM = 1.0, 0.001

_CUT = (Layer.CUT_INNER, Layer.CUT_OUTER)
_KEYS = ("name", "description", "hairline_mm", "layers")


@dataclass(frozen=True)
class LayerColour:
    """The colour of a layer: exact (``"#FF0000"``) and as an AutoCAD colour index, 1 to 255."""

    colour: str
    aci: int

    def __post_init__(self) -> None:
        """Refuse a colour that a laser program would have to guess."""
        if re.fullmatch(r"#[0-9A-F]{6}", self.colour) is None:
            raise InputError(f"the colour {shown(self.colour)} is not of the form '#RRGGBB'")
        if not 1 <= self.aci <= 255:
            raise InputError(f"the colour index {shown(self.aci)} is not from 1 to 255")

    @property
    def rgb(self) -> tuple[int, int, int]:
        """Return red, green and blue, each from 0 to 255.

        Examples
        --------
        >>> LayerColour("#0000FF", 5).rgb
        (0, 0, 255)
        """
        red, green, blue = bytes.fromhex(self.colour[1:])
        return red, green, blue


@dataclass(frozen=True)
class Preset:
    """A named table of one colour for every layer, and how wide lines are.

    Layers that are cut have a colour that no other layer has, so that no engraving and no note is
    ever cut; the notes have one of their own, too.
    """

    name: str
    description: str
    colours: Mapping[Layer, LayerColour] = field(hash=False)
    hairline_mm: float = HAIRLINE_MM

    def __post_init__(self) -> None:
        """Refuse a table that leaves out a layer or mixes them up, then freeze it."""
        missing = [layer.value for layer in Layer if layer not in self.colours]
        if missing:
            raise InputError(
                f"the preset {self.name!r} has no colour for {len(missing)} layer(s): "
                f"{', '.join(missing)}; give each layer a colour"
            )
        check_hairline(self.hairline_mm)
        ordered = {layer: self.colours[layer] for layer in Layer}
        for layer in (*_CUT, Layer.NOTES):
            for other in Layer:
                both = (ordered[layer], ordered[other])
                mixed = other is not layer and not (layer in _CUT and other in _CUT)
                if mixed and (both[0].colour == both[1].colour or both[0].aci == both[1].aci):
                    raise InputError(
                        f"the preset {self.name!r} gives {layer.value} and {other.value} the same "
                        f"colour ({both[0].colour}, index {both[0].aci}; {both[1].colour}, index "
                        f"{both[1].aci}), so no machine could tell them apart; choose others"
                    )
        object.__setattr__(self, "colours", MappingProxyType(ordered))

    def __reduce__(self) -> tuple[Any, ...]:
        """Go to other processes by what it was made of: a frozen table cannot go itself."""
        return Preset, (self.name, self.description, dict(self.colours), self.hairline_mm)

    @property
    def table(self) -> dict[str, Any]:
        """The preset as a table that ``read_preset`` reads."""
        return {
            "name": self.name,
            "description": self.description,
            "hairline_mm": self.hairline_mm,
            "layers": {
                layer.value: {"colour": entry.colour, "aci": entry.aci}
                for layer, entry in self.colours.items()
            },
        }


def check_hairline(width_mm: float) -> None:
    """Raise InputError unless lines may be so wide."""
    if not (math.isfinite(width_mm) and FINEST_MM <= width_mm <= WIDEST_MM):
        raise InputError(
            f"lines cannot be {width_mm:g} mm wide: machines cut lines of {FINEST_MM:g} to "
            f"{WIDEST_MM:g} mm, such as 0.025mm"
        )


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets that come with fabweave, in order of the alphabet.

    Examples
    --------
    >>> preset_names()
    ('boxes', 'epilog', 'glowforge', 'lightburn', 'snijlab', 'trotec', 'xtool')
    """
    return tuple(sorted(_tables()))


def preset_named(name: str = DEFAULT_PRESET) -> Preset:
    """Return the preset with a name.

    Parameters
    ----------
    name : str
        One of ``preset_names()``.

    Returns
    -------
    Preset
        A colour for every layer.

    Raises
    ------
    InputError
        If there is no such preset.

    Examples
    --------
    >>> preset_named("lightburn").colours[Layer.CUT_OUTER].colour
    '#FF0000'
    """
    tables = _tables()
    if name not in tables:
        raise InputError(
            f"there is no colour preset {name!r}; choose one of "
            f"{', '.join(closest_first(name, sorted(tables)))}, or name a file that ends in .toml"
        )
    return read_preset({"name": name, **tables[name]}, f"preset {name!r}")


def find_preset(text: str) -> Preset:
    """Return the preset with a name, or one of the user's own from a file that ends in .toml.

    Such a file names itself (``name = "mine"``; else it is called as the file) and has a table
    ``[layers]`` with a colour for every layer: ``CUT_OUTER = "#FF0000"``, or with the AutoCAD
    colour index that R12 and R2000 need, ``{ colour = "#FF0000", aci = 1 }``; else the nearest
    index is taken. ``description`` and ``hairline_mm`` may be left out.

    Raises
    ------
    InputError
        If there is no such preset, or the file cannot be read or is no preset.
    """
    if not text.lower().endswith(".toml"):
        return preset_named(text)
    path = Path(text)
    table = read_toml(path, "the preset")
    return read_preset({"name": path.stem, **table}, text)


def read_preset(table: Mapping[str, Any], where: str) -> Preset:
    """Return the preset that a table states.

    Parameters
    ----------
    table : mapping
        As ``Preset.table`` and as ``find_preset`` says.
    where : str
        Where it comes from, for errors.

    Raises
    ------
    InputError
        If it is no preset: the message says where, and what to do.

    Examples
    --------
    >>> mine = dict(zip((layer.value for layer in Layer), 2 * ["#000000"] + ["#0000ff", "#ff0000",
    ...                                                                     "#00ff00"]))
    >>> preset = read_preset({"name": "mine", "layers": mine}, "mine.toml")
    >>> preset.colours[Layer.CUT_OUTER], read_preset(preset.table, "there") == preset
    (LayerColour(colour='#FF0000', aci=1), True)
    """
    unknown = [key for key in table if key not in _KEYS]
    if unknown:
        raise InputError(f"{where}: unknown key {unknown[0]!r}; a preset has {', '.join(_KEYS)}")
    layers = table.get("layers")
    if not isinstance(layers, Mapping):
        raise InputError(f"{where}: there is no table [layers] with a colour for each layer")
    known = {layer.value: layer for layer in Layer}
    strange = [name for name in layers if name not in known]
    if strange:
        raise InputError(
            f"{where}: no layer is called {strange[0]!r}; there are {', '.join(known)}"
        )
    name, description = table.get("name"), table.get("description", "")
    width = table.get("hairline_mm", HAIRLINE_MM)
    if not (isinstance(name, str) and re.fullmatch(r"[ -~]{1,60}", name)):
        raise InputError(f"{where}: its name is {shown(name)}; use 1 to 60 characters of ASCII")
    if not (isinstance(description, str) and (not description or description.isprintable())):
        raise InputError(f"{where}: its description must be one line of text, or left out")
    if not isinstance(width, int | float) or isinstance(width, bool):
        raise InputError(f"{where}: hairline_mm is {shown(width)}; write a number, such as 0.025")
    try:
        colours = {known[key]: _colour(entry) for key, entry in layers.items()}
        return Preset(name, description, colours, float(width))
    except (InputError, OverflowError) as error:
        raise InputError(f"{where}: {error}") from error


def _colour(entry: object) -> LayerColour:
    """Return the colour that an entry of ``[layers]`` states."""
    stated = {"colour": entry} if isinstance(entry, str) else entry
    if not isinstance(stated, Mapping) or not {"colour"} <= set(stated) <= {"colour", "aci"}:
        raise InputError(
            f"{shown(entry)} is not a colour; write '#RRGGBB', or {{ colour = '#RRGGBB', aci = 1 }}"
        )
    colour, aci = stated["colour"], stated.get("aci")
    if not isinstance(colour, str):
        raise InputError(f"the colour {shown(colour)} is not of the form '#RRGGBB'")
    if aci is None:
        return LayerColour(colour.upper(), _nearest_aci(LayerColour(colour.upper(), 1).rgb))
    if not isinstance(aci, int) or isinstance(aci, bool):
        raise InputError(f"the colour index {shown(aci)} is not a number from 1 to 255")
    return LayerColour(colour.upper(), aci)


def _nearest_aci(rgb: tuple[int, int, int]) -> int:
    """Return the AutoCAD colour index nearest to a colour; 7 is black on paper."""
    from ezdxf.colors import aci2rgb  # noqa: PLC0415 - it takes long to import

    if rgb == (0, 0, 0):
        return 7
    apart = partial(map, lambda first, second: (first - second) ** 2, rgb)
    return min(range(1, 256), key=lambda index: (sum(apart(aci2rgb(index))), index))


@cache
def _tables() -> dict[str, Any]:
    return shipped_tables("fabweave.sheet", "presets.toml")
