"""Name the built-in shapes and read their descriptions, such as ``shape:torus?m=24&n=12``."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial

from fabweave.errors import InputError
from fabweave.mesh import grids, solids
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh

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
            If it is no number, or out of range.

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
            raise InputError(f"{wanted}, and is {text[:40]!r}") from None
        if "_" in text or not self.least <= value <= self.most:
            raise InputError(f"{wanted}, and is {text[:40]!r}")
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
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., PolyMesh]

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
        >>> SHAPES[5].make({"m": "6", "n": "4"}).n_faces
        24
        """
        values = values or {}
        known = [item.name for item in self.parameters]
        unknown = [name for name in values if name not in known]
        if unknown:
            raise InputError(
                f"the shape {self.name} has no parameter {unknown[0][:40]!r}; it has "
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
        return self.build(**arguments)


def _sized(solid: Callable[[], PolyMesh], *, size: float) -> PolyMesh:
    return resize_mesh(solid(), size_mm=size)[0]


def _ring_and_tube(m: int, n: int, ring: float, tube: float) -> PolyMesh:
    if tube >= ring:
        raise InputError(
            f"the shape torus: the tube's radius ({tube:g} mm) must be less than the ring's "
            f"({ring:g} mm), or the surface runs through itself"
        )
    return grids.torus(m, n, ring, tube)


_SIZE = length("size", "largest dimension", 100.0)

#: All built-in shapes, in the order in which they are listed; lengths are millimetres.
SHAPES: tuple[Shape, ...] = (
    Shape("tetrahedron", "4 triangles", (_SIZE,), partial(_sized, solids.tetrahedron)),
    Shape("cube", "6 squares", (_SIZE,), partial(_sized, solids.cube)),
    Shape("octahedron", "8 triangles", (_SIZE,), partial(_sized, solids.octahedron)),
    Shape("icosahedron", "20 triangles", (_SIZE,), partial(_sized, solids.icosahedron)),
    Shape("dodecahedron", "12 pentagons", (_SIZE,), partial(_sized, solids.dodecahedron)),
    Shape(
        "torus",
        "a ring of m × n quads",
        (
            count("m", "quads around the ring", 24, least=3),
            count("n", "quads around the tube", 12, least=3),
            length("ring", "radius of the circle in the middle of the tube", 35.0),
            length("tube", "radius of the tube", 15.0),
        ),
        _ring_and_tube,
    ),
    Shape(
        "sphere",
        "a sphere of 6 n² quads, spread evenly",
        (
            count("n", "quads along each side of the cube it comes from", 8, most=800),
            length("radius", "radius", 50.0),
        ),
        grids.sphere,
    ),
    Shape(
        "tube",
        "an open cylinder of m × n quads",
        (
            count("m", "quads around", 16, least=3),
            count("n", "quads along", 12),
            length("radius", "radius", 25.0),
            length("height", "height", 100.0),
        ),
        grids.tube,
    ),
    Shape(
        "hemisphere",
        "the upper half of a sphere, open below, of 12 n² quads",
        (
            count("n", "rows of quads above the rim", 4, most=500),
            length("radius", "radius", 50.0),
        ),
        grids.hemisphere,
    ),
    Shape(
        "hypar",
        "an open saddle of m × n quads over a square",
        (
            count("m", "quads along one side", 10),
            count("n", "quads along the other side", 10),
            length("side", "side of the square", 100.0),
            length("height", "how far the high corners stand above the low ones", 40.0),
        ),
        grids.hypar,
    ),
)


def is_shape(text: str) -> bool:
    """Return whether a text names a built-in shape rather than a file.

    Examples
    --------
    >>> is_shape("shape:cube"), is_shape("cube.obj")
    (True, False)
    """
    return text.startswith(PREFIX)


def parse_shape(text: str, shapes: Iterable[Shape] = SHAPES) -> PolyMesh:
    """Build the shape that a text describes.

    Parameters
    ----------
    text : str
        ``shape:`` and a name, then ``?`` and parameters joined by ``&``.
    shapes : iterable of Shape
        The shapes to choose from.

    Returns
    -------
    PolyMesh
        The mesh in millimetres, faces turned outward; about 100 mm large by default.

    Raises
    ------
    InputError
        If the name or a parameter is wrong; the message lists the right ones.

    Examples
    --------
    >>> mesh = parse_shape("shape:torus?m=24&n=12")
    >>> mesh.n_vertices, mesh.n_faces
    (288, 288)
    """
    if not is_shape(text):
        raise InputError(f"{text[:60]!r} does not start with {PREFIX!r}")
    name, mark, query = text.removeprefix(PREFIX).partition("?")
    by_name = {shape.name: shape for shape in shapes}
    if name not in by_name:
        raise InputError(f"there is no shape {name[:40]!r}; there are {', '.join(by_name)}")
    values: dict[str, str] = {}
    for pair in query.split("&") if mark else ():
        key, equals, value = pair.partition("=")
        if not equals or key in values:
            what = "is given twice" if key in values else "should read name=value"
            raise InputError(f"the shape {name}: {pair[:40]!r} {what}; try {by_name[name].example}")
        values[key] = value
    return by_name[name].make(values)
