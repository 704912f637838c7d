"""Hold the material library and the rules that depend on a material."""

import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, TypeAlias

from PIL import ImageColor

from fabweave.core.entries import (
    Accept,
    Key,
    check_document,
    entry_keys,
    entry_table,
    in_range,
    line_key,
    list_of,
    number_key,
    pair_key,
    read_entry,
    shipped_tables,
)
from fabweave.core.errors import InputError
from fabweave.core.messages import one_named
from fabweave.stock.machine import CO2, FIBRE, Machine, OneOrSpan, Span, as_span, machines, span_key


def _bend_table(told: Any) -> tuple[tuple[float, float], ...] | None:
    """Return a table of thicknesses and radii, if it is one."""
    length = in_range(0.001, 1e6)
    rows = list_of(told, lambda row: list_of(row, length, count=2))
    rising = rows and all(one[0] < other[0] for one, other in itertools.pairwise(rows))
    return rows if rising else None


def _table_key(example: str) -> Key:
    """Return the key of such a table."""
    expected = f"a list of [thickness, radius] in order of thickness, such as {example}"
    return Key(expected, _bend_table)


def _text_where(fits: Callable[[str], object]) -> Accept:
    """Return a function that accepts texts that fit."""
    return lambda value: value if isinstance(value, str) and fits(value) else None


#: Thicknesses and radii, in order of thickness.
_Table: TypeAlias = tuple[tuple[float, float], ...]
#: Of a material whose colour is not known: that of plain board.
_BOARD = "#c8a878"


@dataclass(frozen=True)
class Material:
    """A sheet material with the defaults that a job takes from it.

    Parameters
    ----------
    name, title : str
        What it is called on the command line, and by people: ``{g_m2}`` stands for the weight of
        its thickness, grams a square metre.
    thickness_mm, density_kg_m3, kerf_mm : float
        Measured thickness, density, and the width that the beam removes.
    gap_mm : float
        Least distance between pieces on a sheet.
    sheet_mm : (float, float)
        Width and height of the sheet that is taken unless another is asked for.
    min_bend_radius_t : float or None
        Tightest bend in multiples of the thickness, where that is the rule.
    bend_table_mm : tuple of (float, float)
        Else thickness and tightest bend in millimetres, in order of thickness.
    formed_table_mm : tuple of (float, float)
        Thickness and tightest bend once it is softened, where known.
    across_table_mm, formed_across_table_mm : tuple of (float, float)
        The same for strips that lie across the grain of the face, so that the line about which
        they bend runs along it; none if the material has no grain that counts.
    formed : str
        How it is softened, such as ``soaked in hot water and dried on a form``.
    metal : bool
        Whether the rules for metal hold.
    machine : str or None
        The kind of machine that cuts it, of :func:`fabweave.stock.machine.machines`; None for a
        CO2 laser, and for a fibre laser if it is metal.
    speed_mm_s : (float, float) or None
        Slowest and fastest cutting speed, where known.
    engrave_mm_s, acceleration_mm_s2, rapid_mm_s, pierce_s : float, (float, float) or None
        What is known better than of its kind of machine: see
        :class:`fabweave.stock.machine.Machine`.
    price_per_m2, machine_per_h : float, (float, float) or None
        Price of a square metre, and of an hour of the machine, in `currency`, where known.
    speed_source, price_source : str
        Where speeds and price are from.
    assumed : tuple of str
        The values that are engineering defaults and have no published source.
    notes : str
        What a person should know before cutting it.
    colour : str or None
        How it looks in pictures, as ``#rrggbb``, where known.
    young_mpa : (float, float) or None
        Young's modulus along the grain and across it, N/mm², where known.
    poisson : float or None
        Poisson's ratio, where known.
    young_source : str
        Where these are from.
    turning_nmm : (float, float) or None
        How a crossing resists turning, N mm per radian: of strips that only lie on one another, and
        with one fastener; where it was measured.
    laid_across : bool
        Whether pieces lie across its grain, so that the tables for that hold.
    """

    name: str
    title: Annotated[str, line_key(200)]
    thickness_mm: Annotated[float, number_key(0.001, 100)]
    density_kg_m3: Annotated[float, number_key(1, 30_000)]
    kerf_mm: Annotated[float, number_key(0, 10)]
    gap_mm: Annotated[float, number_key(0, 1000)]
    sheet_mm: Annotated[Span, pair_key("[600.0, 400.0]", 1, 20_000)]
    metal: Annotated[bool, Key("true or false", lambda v: v if isinstance(v, bool) else None)]
    min_bend_radius_t: Annotated[float | None, number_key(0.01, 100_000)] = None
    bend_table_mm: Annotated[_Table, _table_key("[[0.9, 51.0], [1.8, 132.0]]")] = ()
    formed_table_mm: Annotated[_Table, _table_key("[[0.9, 13.0], [1.8, 38.0]]")] = ()
    across_table_mm: Annotated[_Table, _table_key("[[0.9, 28.0], [1.8, 81.0]]")] = ()
    formed_across_table_mm: Annotated[_Table, _table_key("[[0.9, 2.5], [1.8, 10.0]]")] = ()
    formed: Annotated[str, line_key(100)] = ""
    machine: Annotated[
        str | None,
        Key(f"one of {', '.join(machines())}", _text_where(lambda name: name in machines())),
    ] = None
    speed_mm_s: Annotated[Span | None, pair_key("[12.0, 18.0]", 0.001, 100_000)] = None
    engrave_mm_s: Annotated[OneOrSpan | None, span_key(0.001, 100_000)] = None
    acceleration_mm_s2: Annotated[OneOrSpan | None, span_key(1, 1_000_000)] = None
    rapid_mm_s: Annotated[OneOrSpan | None, span_key(0.001, 100_000)] = None
    pierce_s: Annotated[OneOrSpan | None, span_key(0, 100)] = None
    speed_source: Annotated[str, line_key(300)] = ""
    price_per_m2: Annotated[OneOrSpan | None, span_key(0, 1_000_000)] = None
    machine_per_h: Annotated[OneOrSpan | None, span_key(0, 1_000_000)] = None
    currency: Annotated[str, line_key(8)] = ""
    price_source: Annotated[str, line_key(300)] = ""
    assumed: Annotated[
        tuple[str, ...],
        Key(
            "a list of keys of this entry",
            lambda value: list_of(value, _text_where(lambda name: name in entry_keys(Material))),
        ),
    ] = ()
    young_mpa: Annotated[Span | None, pair_key("[4500.0, 2200.0]", 0.01, 1e6)] = None
    poisson: Annotated[float | None, number_key(0.0, 0.49)] = None
    young_source: Annotated[str, line_key(300)] = ""
    turning_nmm: Annotated[Span | None, pair_key("[1.0, 25.0]", 1e-3, 1e6)] = None
    notes: Annotated[str, line_key(500)] = ""
    colour: Annotated[
        str | None,
        Key(
            'a colour of red, green and blue such as "#c8a878"',
            _text_where(lambda text: re.fullmatch("#[0-9A-Fa-f]{6}", text)),
        ),
    ] = None
    laid_across: bool = False

    @property
    def full_title(self) -> str:
        """Its name for people; of what is sold by weight, with that of the thickness that is used.

        Examples
        --------
        >>> replace(material_named("card"), thickness_mm=0.2).full_title
        'Card, 150 g/m²'
        """
        # Millimetres times kilograms a cubic metre are grams a square metre.
        return self.title.replace("{g_m2}", f"{self.thickness_mm * self.density_kg_m3:.0f}")

    @property
    def description(self) -> str:
        """Its name for people, with the thickness that is used.

        Examples
        --------
        >>> material_named("birch-veneer").description
        'Birch veneer ply, 0.8 mm'
        """
        return f"{self.full_title}, {self.thickness_mm:g} mm"

    @property
    def rgb(self) -> tuple[int, int, int]:
        """Its colour in pictures: that which its sort is called by, as ``card:red``, or its own.

        Examples
        --------
        >>> replace(material_named("card"), name="card:red").rgb
        (255, 0, 0)
        """
        sort = self.name.partition(":")[2].lower().replace(" ", "")
        # Pillow puts what it has read in place of the text there: only its own function reads both.
        told = sort if sort in ImageColor.colormap else self.colour or _BOARD
        red, green, blue = ImageColor.getrgb(told)[:3]
        return red, green, blue

    @property
    def caption(self) -> str:
        """Its name and thickness, in few letters."""
        return f"{self.name} {self.thickness_mm:g} mm"

    def __post_init__(self) -> None:
        """Refuse values that no material has."""
        _values(entry_table(self), f"material {self.name!r}")


def _values(table: Any, where: str) -> dict[str, Any]:
    """Return the values of an entry.

    Raises
    ------
    InputError
        If it is not a material; the message says where and what is expected.
    """
    values = read_entry(table, where, Material)
    if "min_bend_radius_t" not in values and "bend_table_mm" not in values:
        raise InputError(
            f"{where}: its bend radius is missing; write min_bend_radius_t, in multiples of "
            "the thickness, or bend_table_mm"
        )
    for name in ("price_per_m2", "machine_per_h"):
        if name in values and "currency" not in values:
            raise InputError(
                f"{where}: currency is missing; write the currency of {name}, such as EUR"
            )
    return values


def materials_of(document: Mapping[str, Any], where: str) -> tuple[Material, ...]:
    """Return the materials that a document describes, an entry each.

    Parameters
    ----------
    document : mapping
        As ``materials.toml`` is read, or what job.toml keeps of it.
    where : str
        Where it comes from, for errors.

    Raises
    ------
    InputError
        If an entry is not a material; the message says which, and what is expected.
    """
    check_document(document, where)
    return tuple(
        Material(name, **_values(entry, f"{where}, [{name}]")) for name, entry in document.items()
    )


@cache
def material_library() -> tuple[Material, ...]:
    """Return the materials that fabweave knows, thinnest family first as listed.

    Examples
    --------
    >>> [m.name for m in material_library() if m.metal][:2]
    ['aluminium-5052', 'stainless-304']
    """
    tables = shipped_tables("fabweave.stock", "materials.toml")
    return materials_of(tables, "fabweave's materials.toml")


def material_named(name: str, user_materials: Iterable[Material] = ()) -> Material:
    """Return the material of the library with this name.

    Parameters
    ----------
    name : str
        Upper and lower case are the same.
    user_materials : iterable of Material
        They come to the library, and stand in for those of the same name.

    Returns
    -------
    Material
        Its defaults.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.

    Examples
    --------
    >>> material_named("stainless-304").thickness_mm
    0.5
    """
    known = {material.name: material for material in (*material_library(), *user_materials)}
    return one_named("material", name, known)


def with_thickness(material: Material, thickness_mm: float) -> Material:
    """Return the material with a measured thickness; the gap grows to the thickness if needed.

    Examples
    --------
    >>> with_thickness(material_named("birch-ply-3"), 3.9).gap_mm
    3.9
    """
    if not (math.isfinite(thickness_mm) and thickness_mm > 0.0):
        raise InputError(
            f"the thickness of {material.name!r} is {thickness_mm} mm; it must be positive"
        )
    gap_mm = max(material.gap_mm, thickness_mm, 2.0 * material.kerf_mm)
    return replace(material, thickness_mm=thickness_mm, gap_mm=gap_mm)


def machine_of(material: Material) -> Machine:
    """Return the machine that cuts a material: that of its kind, with what the material overrules.

    Examples
    --------
    >>> machine_of(material_named("card")).name, machine_of(material_named("stainless-304")).name
    ('co2', 'fibre')
    >>> machine_of(replace(material_named("card"), pierce_s=0.2)).pierce_s
    (0.2, 0.2)
    """
    machine = machines()[material.machine or (FIBRE if material.metal else CO2)]
    own: dict[str, Any] = {
        name: as_span(getattr(material, name))
        for name in ("engrave_mm_s", "acceleration_mm_s2", "rapid_mm_s", "pierce_s")
        if getattr(material, name) is not None
    }
    return replace(machine, **own)


def min_hole_mm(material: Material) -> float:
    """Return the smallest hole that a laser cuts well: the thickness, and at least 1 mm.

    Examples
    --------
    >>> min_hole_mm(material_named("card")), min_hole_mm(material_named("birch-ply-3"))
    (1.0, 3.1)
    """
    return max(material.thickness_mm, 1.0)


def hole_edge_mm(material: Material, hole_mm: float) -> float:
    """Return the least distance from the centre of a hole to the edge of its piece.

    Two diameters in metal (FAA AC 43.13-1B, single row of rivets); elsewhere two diameters and
    at least three thicknesses.

    Examples
    --------
    >>> hole_edge_mm(material_named("aluminium-5052"), 3.2)
    6.4
    >>> round(hole_edge_mm(material_named("birch-ply-3"), 4.0), 9)
    9.3
    """
    if not (math.isfinite(hole_mm) and hole_mm > 0.0):
        raise InputError(f"the hole is {hole_mm} mm across; its diameter must be positive")
    return 2.0 * hole_mm if material.metal else max(2.0 * hole_mm, 3.0 * material.thickness_mm)


def sheet_mass_kg(material: Material, area_mm2: float) -> float:
    """Return the mass of an area of the material, in kilograms.

    Examples
    --------
    >>> round(sheet_mass_kg(material_named("aluminium-5052"), 1e6), 6)
    1.34
    """
    return area_mm2 * material.thickness_mm * material.density_kg_m3 * 1e-9


def laid_across(material: Material) -> Material:
    """Return a material whose pieces lie across its grain; the same if it has none that counts."""
    return replace(material, laid_across=bool(material.across_table_mm))


def min_bend_radius_mm(material: Material) -> float:
    """Return the tightest radius to which the material bends without damage, in millimetres.

    It is that of strips along the grain, which bend worse, unless they lie across it.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> min_bend_radius_mm(material_named("spring-shim-0.2"))
    20.0
    >>> min_bend_radius_mm(with_thickness(material_named("birch-veneer"), 1.78))
    132.0
    >>> min_bend_radius_mm(laid_across(with_thickness(material_named("birch-veneer"), 1.78)))
    81.0
    """
    if material.laid_across:
        return radius_of_table(material.across_table_mm, material.thickness_mm)
    if material.min_bend_radius_t is not None:
        return material.min_bend_radius_t * material.thickness_mm
    return radius_of_table(material.bend_table_mm, material.thickness_mm)


def along_radius_mm(material: Material) -> float:
    """Return the tightest radius of a strip that lies along the grain; 0 if it has none.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> veneer = with_thickness(material_named("birch-veneer"), 1.78)
    >>> along_radius_mm(laid_across(veneer)), along_radius_mm(material_named("card"))
    (132.0, 0.0)
    """
    if not material.across_table_mm:
        return 0.0
    return min_bend_radius_mm(replace(material, laid_across=False))


def radius_of_table(table: tuple[tuple[float, float], ...], thickness: float) -> float:
    """Return the radius that a table has for a thickness, in millimetres.

    It is read piecewise linearly; outside it the ratio of radius to thickness is kept.

    Examples
    --------
    >>> radius_of_table(((1.0, 50.0), (2.0, 120.0)), 1.5), radius_of_table(((1.0, 50.0),), 0.5)
    (85.0, 25.0)
    """
    if thickness <= table[0][0]:
        return table[0][1] * thickness / table[0][0]
    for (t0, r0), (t1, r1) in itertools.pairwise(table):
        if thickness <= t1:
            return r0 + (r1 - r0) * (thickness - t0) / (t1 - t0)
    return table[-1][1] * thickness / table[-1][0]


def formed_radius_mm(material: Material) -> float | None:
    """Return the tightest radius of a material that was softened; None where it is not known.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> formed_radius_mm(with_thickness(material_named("birch-veneer"), 1.78))
    38.0
    >>> formed_radius_mm(material_named("card")) is None
    True
    """
    table = material.formed_table_mm
    if material.laid_across and material.formed_across_table_mm:
        table = material.formed_across_table_mm
    if not table:
        return None
    return radius_of_table(table, material.thickness_mm)


def forming_advice(material: Material, wanted_mm: float) -> str | None:
    """Say how a material can be made to bend to a radius, if softening is enough.

    Parameters
    ----------
    material : Material
    wanted_mm : float
        The radius that is wanted, in millimetres; dry and cold it is too tight.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> forming_advice(material_named("birch-veneer"), 30.0)
    'soaked in hot water and dried on a form, Birch veneer ply, 0.8 mm bends to a radius of 12 mm'
    >>> forming_advice(material_named("birch-veneer"), 5.0) is None
    True
    """
    radius = formed_radius_mm(material)
    if radius is None or radius > wanted_mm:
        return None
    how = material.formed or "softened"
    return f"{how}, {material.description} bends to a radius of {radius:.0f} mm"
