"""Hold what those who cut ask of holes, webs, gaps and sizes."""

import tomllib
from dataclasses import dataclass
from importlib import resources

from fabweave.core.messages import one_named


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
    title: str
    hole_t: float
    hole_mm: float
    edge_t: float
    edge_mm: float
    web_t: float
    web_mm: float
    gap_mm: float
    piece_mm: tuple[float, float] | None = None
    sheet_mm: tuple[float, float] | None = None


def targets() -> tuple[Target, ...]:
    """Return the targets that fabweave knows, the default first.

    Examples
    --------
    >>> [target.name for target in targets()][:3]
    ['default', 'cutitout', 'cutlasercut']
    """
    text = resources.files("fabweave.cut.preflight").joinpath("targets.toml").read_text("utf-8")
    tables = tomllib.loads(text)
    found = []
    for name, table in tables.items():
        values = {**tables["default"], **table}
        for key in ("piece_mm", "sheet_mm"):
            if key in values:
                values[key] = tuple(values[key])
        found.append(Target(name=name, **values))
    return tuple(found)


def target_named(name: str) -> Target:
    """Return the target of this name.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.

    Examples
    --------
    >>> target_named("gosnapcut").hole_t
    1.5
    """
    return one_named("target", name, {target.name: target for target in targets()})
