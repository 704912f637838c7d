"""Name the built-in shapes and read their descriptions, such as ``shape:torus?m=24&n=12``."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from string import Formatter

from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.shapes.woven import cage, handled_bipyramid, regular, slit_sum
from fabweave.mesh.upright import resize_mesh

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
        return self.build(**self.completed(values or {}))

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
        arguments = self.completed(values)
        told = self.title or self.name.capitalize()
        name, _, numbers = told.partition(", ")
        counts = {key for _, key, _, _ in Formatter().parse(numbers) if key}
        plain = all(arguments[key] == 1 for key in counts)
        return (name if plain else told).format(**arguments)

    def completed(self, values: Mapping[str, str]) -> dict[str, float]:
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


__all__ = ["PREFIX", "SHAPES", "Parameter", "Shape", "count", "is_shape", "length", "parse_shape"]


def _sized(solid: Callable[[], PolyMesh], *, size: float) -> PolyMesh:
    return resize_mesh(solid(), size_mm=size)[0]


def _ring_and_tube(m: int, n: int, ring: float, tube: float) -> PolyMesh:
    if tube >= ring:
        raise InputError(
            f"the shape torus: the tube's radius ({tube:g} mm) must be less than the ring's "
            f"({ring:g} mm), or the surface runs through itself"
        )
    return grids.torus(m, n, ring, tube)


def _bipyramid(n: int, edge: int, handle: int, height: float, size: float) -> PolyMesh:
    if not 0.2 * size <= height <= size:
        raise InputError(
            f"the shape bipyramid: its height ({height:g} mm) must be between a fifth of the size "
            f"and the size ({size:g} mm)"
        )
    return handled_bipyramid(n, edge, handle, height / size, size)


_SIZE = length("size", "largest dimension", 100.0)

#: All built-in shapes, in the order in which they are listed; lengths are millimetres.
SHAPES: tuple[Shape, ...] = (
    Shape("tetrahedron", "4 triangles", (_SIZE,), partial(_sized, solids.tetrahedron)),
    Shape(
        "cube",
        "a cube of 6 n² squares",
        (count("n", "squares along each side", 1, most=800), _SIZE),
        grids.cube,
        "Cube, 6 times {n} by {n}",
    ),
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
        "Torus, {m} by {n}",
    ),
    Shape(
        "sphere",
        "a sphere of 6 n² quads, spread evenly",
        (
            count("n", "quads along each side of the cube it comes from", 8, most=800),
            length("radius", "radius", 50.0),
        ),
        grids.sphere,
        "Sphere, 6 times {n} by {n}",
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
        "Tube, {m} by {n}",
    ),
    Shape(
        "hemisphere",
        "the upper half of a sphere, open below, of 12 n² quads",
        (
            count("n", "rows of quads above the rim", 4, most=500),
            length("radius", "radius", 50.0),
        ),
        grids.hemisphere,
        "Hemisphere, {n} rows",
    ),
    Shape(
        "hypar",
        "an open saddle of m × n quads over a square",
        (
            count("m", "quads along one side", 10),
            count("n", "quads along the other side", 10),
            length("side", "side of the square", 100.0),
            length("height", "how far the high corners are above the low ones", 40.0),
        ),
        grids.hypar,
        "Saddle, {m} by {n}",
    ),
    Shape(
        "slit",
        "two rings of m × n quads that flow together at slits; of any genus, with an exact twill",
        (
            count("genus", "genus: one more than the number of slits; 1 for a torus", 3, most=200),
            count("m", "quads along each ring, or 0 to suit the genus", 0, least=0),
            count("n", "quads around each ring, or 0 to suit m", 0, least=0, most=200),
            count("slit", "edges of each slit, or 0 to suit m", 0, least=0),
            _SIZE,
        ),
        slit_sum,
        "Surface of genus {genus}",
    ),
    Shape(
        "bipyramid",
        "a 2n-gonal bipyramid with a handle from each upper face to the face below",
        (
            count("n", "half the number of sides", 2, least=2, most=8),
            count("edge", "quads along each edge of the bipyramid", 10, least=4, most=200),
            count("handle", "quads along each handle", 8, least=4, most=160),
            length("height", "distance between the tips", 60.0),
            _SIZE,
        ),
        _bipyramid,
        "Bipyramid with handles",
    ),
    Shape(
        "cage",
        "tubes between the middles of a solid's edges, four at each; of genus 7, 13 or 31",
        (
            count("faces", "faces of the solid: 4, 6 or 12", 6, least=4, most=12),
            count("m", "quads along each tube, or 0 to make them about square", 0, least=0),
            count("n", "quads around each tube, an even number", 8, least=4, most=200),
            _SIZE,
        ),
        cage,
    ),
    Shape(
        "regular",
        "a regular mesh: all faces with 4k sides and 4 or 4k edges at all vertices, or the reverse",
        (
            count("face", "sides of each face", 8, least=4, most=16),
            count("valence", "edges at each vertex", 4, least=4, most=16),
            count("genus", "genus: 1 more than a multiple of k - 1, or of 2k - 2", 3, most=100),
            count("refine", "how fine: 2 to this power quads around each ring", 3, least=2, most=6),
            _SIZE,
        ),
        regular,
        "Regular surface of genus {genus}, {face} by {valence}",
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


def parse_shape(text: str) -> PolyMesh:
    """Build the shape that a text describes.

    Parameters
    ----------
    text : str
        ``shape:`` and a name, then ``?`` and parameters joined by ``&``.

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
    shape, values = described(text)
    return shape.make(values)


def shape_title(text: str) -> str:
    """Return what a person would call the shape that a text describes.

    Raises
    ------
    InputError
        If the name or a parameter is wrong.

    Examples
    --------
    >>> shape_title("shape:torus"), shape_title("shape:sphere?n=4&radius=9")
    ('Torus, 24 by 12', 'Sphere, 6 times 4 by 4')
    """
    shape, values = described(text)
    return shape.called(values)


def described(text: str) -> tuple[Shape, dict[str, str]]:
    """Return the shape that a text names, and the parameters that it gives."""
    if not is_shape(text):
        raise InputError(f"{text[:60]!r} does not start with {PREFIX!r}")
    name, mark, query = text.removeprefix(PREFIX).partition("?")
    by_name = {shape.name: shape for shape in SHAPES}
    if name not in by_name:
        raise InputError(f"there is no shape {name[:40]!r}; choose one of {', '.join(by_name)}")
    values: dict[str, str] = {}
    for pair in query.split("&") if mark else ():
        key, equals, value = pair.partition("=")
        if not equals or key in values:
            what = "is given twice" if key in values else "should read name=value"
            raise InputError(f"the shape {name}: {pair[:40]!r} {what}; try {by_name[name].example}")
        values[key] = value
    return by_name[name], values


#: What parts the words of a file's name.
_BETWEEN = re.compile(r"[\s_.+-]+")


def object_title(mesh: str, title: str | None = None) -> str:
    """Return what to call the object of a job: its title, or a name made of that of its mesh.

    Parameters
    ----------
    mesh : str
        A file, or a built-in shape.
    title : str, optional
        As it was asked for.

    Raises
    ------
    InputError
        If the built-in shape is wrong.

    Examples
    --------
    >>> object_title("models/spot_control_mesh.obj"), object_title("shape:torus?m=24&n=12")
    ('Spot control mesh', 'Torus, 24 by 12')
    >>> object_title("shape:torus", "Fruit bowl")
    'Fruit bowl'
    """
    if title is not None:
        return title
    if is_shape(mesh):
        return shape_title(mesh)
    stem = Path(mesh).stem
    words = _BETWEEN.sub(" ", stem).strip()
    return words[:1].upper() + words[1:] or stem
