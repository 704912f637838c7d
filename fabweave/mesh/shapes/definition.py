"""Describe a built-in shape: its name, its parameters, and how it is built."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from string import Formatter

from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh

#: What the name of a built-in shape starts with.
PREFIX = "shape:"
_LONGEST_MM = 1e5


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape.

    Parameters
    ----------
    name, text : str
        Its name, and what it means in a few words.
    default, least, most : float
        Default and range, bounds included.
    whole : bool
        Whether it is a count; else it is a length in millimetres.
    """

    name: str
    text: str
    default: float
    least: float
    most: float
    whole: bool = False

    def parse(self, text: str) -> float:
        """Return the value that a text gives.

        Raises
        ------
        InputError
            If it is not a number, or out of range.

        Examples
        --------
        >>> count("m", "quads", 24, least=3).parse("12")
        12
        """
        kind = "a whole number" if self.whole else "a number of millimetres"
        wanted = f"{self.name} must be {kind} from {self.least:g} to {self.most:g}"
        digits = text if self.whole else text.strip().removesuffix("mm")
        try:
            value = int(digits) if self.whole else float(digits)
        except ValueError:
            raise InputError(f"{wanted}, but is {text[:40]!r}") from None
        if "_" in text or not self.least <= value <= self.most:
            raise InputError(f"{wanted}, but is {text[:40]!r}")
        return value


def count(name: str, text: str, default: int, *, least: int = 1, most: int = 2000) -> Parameter:
    """Return a parameter that counts."""
    return Parameter(name, text, default, least, most, whole=True)


def length(name: str, text: str, default: float) -> Parameter:
    """Return a parameter that is a length in millimetres."""
    return Parameter(name, text, default, 0.001, _LONGEST_MM)


@dataclass(frozen=True)
class Shape:
    """A built-in shape.

    Parameters
    ----------
    name, text : str
        Its name, and what it is in one line.
    parameters : tuple of Parameter
        Its parameters in order.
    build : callable
        Takes the parameters by name, counts as int, and returns the mesh in millimetres.
    title : str
        What a person would call it, with parameters in braces; what follows a comma is left out
        where they are 1. Without one it is called by its name.
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., PolyMesh]
    title: str = ""

    @property
    def example(self) -> str:
        """The full description with all defaults."""
        pairs = "&".join(f"{item.name}={item.default:g}" for item in self.parameters)
        return f"{PREFIX}{self.name}" + (f"?{pairs}" if pairs else "")

    def make(self, values: Mapping[str, str] | None = None) -> PolyMesh:
        """Build the shape; parameters that are not given take their defaults.

        Raises
        ------
        InputError
            If a name or a value is wrong.

        Examples
        --------
        >>> from fabweave.mesh.shapes.catalogue import SHAPES
        >>> SHAPES[5].make({"m": "6", "n": "4"}).n_faces
        24
        """
        return self.build(**self._arguments(values or {}))

    def called(self, values: Mapping[str, str]) -> str:
        """Return what a person would call the shape with these parameters.

        Raises
        ------
        InputError
            If a name or a value is wrong.

        Examples
        --------
        >>> from fabweave.mesh.shapes.catalogue import SHAPES
        >>> SHAPES[5].called({"m": "6"}), SHAPES[1].called({}), SHAPES[0].called({})
        ('Torus, 6 by 12', 'Cube', 'Tetrahedron')
        """
        arguments = self._arguments(values)
        told = self.title or self.name.capitalize()
        name, _, numbers = told.partition(", ")
        counts = {key for _, key, _, _ in Formatter().parse(numbers) if key}
        plain = all(arguments[key] == 1 for key in counts)
        return (name if plain else told).format(**arguments)

    def _arguments(self, values: Mapping[str, str]) -> dict[str, float]:
        """Return all parameters; those that are not given take their defaults."""
        known = [item.name for item in self.parameters]
        unknown = [name for name in values if name not in known]
        if unknown:
            raise InputError(
                f"the shape {self.name} has no parameter {unknown[0][:40]!r}; its parameters are "
                + (", ".join(known) or "none")
            )
        arguments: dict[str, float] = {}
        for item in self.parameters:
            given = values.get(item.name)
            default = int(item.default) if item.whole else item.default
            try:
                arguments[item.name] = default if given is None else item.parse(given)
            except InputError as error:
                raise InputError(f"the shape {self.name}: {error}") from None
        return arguments
