"""Hold what those who cut ask of holes, webs, gaps and sizes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from fabweave.core.entries import (
    check_document,
    entry_table,
    line_key,
    number_key,
    pair_key,
    read_entry,
    shipped_tables,
)
from fabweave.core.messages import one_named
from fabweave.stock.machine import Span

_Thicknesses: TypeAlias = Annotated[float, number_key(0, 100)]
_Millimetres: TypeAlias = Annotated[float, number_key(0, 1000)]


@dataclass(frozen=True)
class Target:
    """What a machine or a service asks of the files that it cuts.

    Parameters
    ----------
    name, title : str
        How it is called on the command line, and for people.
    hole_t, hole_mm : float
        Least diameter of a hole: in thicknesses, and in millimetres; the larger counts.
    edge_t, edge_mm : float
        Least material between a hole's rim and the edge of its piece, likewise.
    web_t, web_mm : float
        Least material between any two cuts of a piece, likewise.
    gap_mm : float
        Least distance between pieces.
    piece_mm, sheet_mm : (float, float) or None
        The largest piece and sheet that it takes; None if it does not say.
    """

    name: str
    title: Annotated[str, line_key(200)]
    hole_t: _Thicknesses
    hole_mm: _Millimetres
    edge_t: _Thicknesses
    edge_mm: _Millimetres
    web_t: _Thicknesses
    web_mm: _Millimetres
    gap_mm: _Millimetres
    piece_mm: Annotated[Span | None, pair_key("[900.0, 900.0]", 1, 100_000)] = None
    sheet_mm: Annotated[Span | None, pair_key("[1200.0, 600.0]", 1, 100_000)] = None

    def __post_init__(self) -> None:
        """Refuse values that no target has."""
        read_entry(entry_table(self), f"target {self.name!r}", Target)

    @property
    def rules(self) -> list[str]:
        """What it asks for, a line each; t is the thickness.

        Examples
        --------
        >>> target_named("snijlab").rules[-2:]
        ['between pieces: at least 0.5 mm', 'sheets: up to 1200 × 600 mm']
        """
        lines = [
            f"holes: at least {self.hole_t:g} t and {self.hole_mm:g} mm wide",
            f"from their rims to edges: at least {self.edge_t:g} t and {self.edge_mm:g} mm",
            f"between cuts of a piece: at least {self.web_t:g} t and {self.web_mm:g} mm",
            f"between pieces: at least {self.gap_mm:g} mm",
        ]
        for what, size in (("pieces", self.piece_mm), ("sheets", self.sheet_mm)):
            if size is not None:
                lines.append(f"{what}: up to {size[0]:g} × {size[1]:g} mm")
        return lines


def targets() -> tuple[Target, ...]:
    """Return the targets that fabweave knows, the default first.

    Examples
    --------
    >>> [target.name for target in targets()][:3]
    ['default', 'cutitout', 'cutlasercut']
    """
    return _targets_of(_our_tables(), "fabweave's targets.toml", {})


def targets_of(document: Mapping[str, Any], where: str) -> tuple[Target, ...]:
    """Return the targets that a document describes, an entry each.

    Parameters
    ----------
    document : mapping
        As ``targets.toml`` is read, or what job.toml keeps of it. What an entry does not say is as
        in the document's own entry ``default``, or else as in ours.
    where : str
        Where it comes from, for errors.

    Raises
    ------
    InputError
        If an entry is no target; the message says which, and what is expected.
    """
    return _targets_of(document, where, _our_tables()["default"])


def _targets_of(
    document: Mapping[str, Any], where: str, usual: Mapping[str, Any]
) -> tuple[Target, ...]:
    """Return the targets of a document in which what is not said is as usual."""
    check_document(document, where)
    own = document.get("default", {})
    usual = {**usual, **(own if isinstance(own, Mapping) else {})}
    # A target that is called as another one is would be taken for it.
    usual.pop("title", None)
    found = []
    for name, entry in document.items():
        table = {**usual, **entry} if isinstance(entry, Mapping) else entry
        found.append(Target(name, **read_entry(table, f"{where}, [{name}]", Target)))
    return tuple(found)


def _our_tables() -> dict[str, Any]:
    return shipped_tables("fabweave.sheet", "targets.toml")


def target_named(name: str, user_targets: Iterable[Target] = ()) -> Target:
    """Return the target of this name.

    Parameters
    ----------
    name : str
    user_targets : iterable of Target
        They come to ours, and stand in for those of the same name.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.

    Examples
    --------
    >>> target_named("gosnapcut").hole_t
    1.5
    """
    return one_named("target", name, {one.name: one for one in (*targets(), *user_targets)})


def targets_in_use(name: str, user_targets: Iterable[Target]) -> tuple[Target, ...]:
    """Return the user's own target of this name, unless it is just as ours; none if it is ours.

    Examples
    --------
    >>> targets_in_use("snijlab", [target_named("snijlab"), target_named("fictiv")])
    ()
    """
    wanted = name.strip().lower()
    found = {target.name: target for target in user_targets if target.name == wanted}
    known = targets()
    return tuple(target for target in found.values() if target not in known)
