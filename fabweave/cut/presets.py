"""Look up which colour each layer has for a machine's software.

No colour convention is universal, so it is a table (``presets.toml``), not a constant.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType
from typing import Any

from fabweave.cut.drawing import Layer
from fabweave.errors import InputError

#: The preset that is used where none is asked for.
DEFAULT_PRESET = "lightburn"


@dataclass(frozen=True)
class LayerColour:
    """The colour of a layer: exact (``"#FF0000"``) and as an AutoCAD colour index, 1 to 255."""

    colour: str
    aci: int

    def __post_init__(self) -> None:
        """Refuse a colour that a laser program would have to guess."""
        if re.fullmatch(r"#[0-9A-F]{6}", self.colour) is None:
            raise InputError(f"the colour {self.colour!r} is not of the form '#RRGGBB'")
        if not 1 <= self.aci <= 255:
            raise InputError(f"the colour index {self.aci} is not from 1 to 255")

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
    """A named table of one colour for every layer."""

    name: str
    description: str
    colours: Mapping[Layer, LayerColour]

    def __post_init__(self) -> None:
        """Refuse a table that leaves out a layer, then freeze it."""
        missing = [layer.value for layer in Layer if layer not in self.colours]
        if missing:
            raise InputError(
                f"the preset {self.name!r} has no colour for {len(missing)} layer(s): "
                f"{', '.join(missing)}; give each layer a colour"
            )
        ordered = {layer: self.colours[layer] for layer in Layer}
        object.__setattr__(self, "colours", MappingProxyType(ordered))


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets that come with fabweave, in order of the alphabet.

    Examples
    --------
    >>> "lightburn" in preset_names()
    True
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
            f"there is no colour preset {name!r}; choose one of {', '.join(sorted(tables))}"
        )
    table = tables[name]
    colours = {
        Layer(layer): LayerColour(str(entry["colour"]), int(entry["aci"]))
        for layer, entry in table["layers"].items()
    }
    return Preset(name, str(table["description"]), colours)


def _tables() -> dict[str, Any]:
    text = (resources.files("fabweave.cut") / "presets.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
