"""Hold which rules of a cutter a job's pieces break, and say it in words and in a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from fabweave.core.messages import agree
from fabweave.cut.preflight.targets import Target
from fabweave.stock.material import Material

SCHEMA = "fabweave.preflight/1"

Rule: TypeAlias = Literal[
    "hole", "hole-edge", "web", "gap", "piece", "sheet", "segment", "width", "bend"
]


@dataclass(frozen=True)
class Flaw:
    """One rule that a piece does not keep: its worst place, and what would help.

    Parameters
    ----------
    rule : str
    piece : str or None
        The piece; None where the whole sheet or the object is concerned.
    sheet : int or None
        Its sheet, from 1.
    place : (float, float) or None
        On that sheet, in millimetres.
    value, limit : float
        What there is, and what is asked for, in millimetres.
    count : int
        In how many places of the piece.
    remedy : str
        What would help.
    """

    rule: Rule
    piece: str | None
    sheet: int | None
    place: tuple[float, float] | None
    value: float
    limit: float
    count: int
    remedy: str


def preflight_record(
    flaws: tuple[Flaw, ...], materials: Sequence[Material], target: Target
) -> dict[str, Any]:
    """Return what ``preflight.json`` holds; a job of several materials lists them all."""
    each = [
        {"material": material.name, "thickness_mm": material.thickness_mm} for material in materials
    ]
    return {
        "schema": SCHEMA,
        "units": "mm",
        **(each[0] if len(each) == 1 else {"materials": each}),
        "target": target.name,
        "flaws": [
            {
                "rule": flaw.rule,
                "piece": flaw.piece,
                "sheet": flaw.sheet,
                "place": None if flaw.place is None else list(flaw.place),
                "value_mm": round(flaw.value, 4),
                "limit_mm": round(flaw.limit, 4),
                "count": flaw.count,
                "remedy": flaw.remedy,
            }
            for flaw in flaws
        ],
    }


_MEANING: dict[Rule, str] = {
    "hole": "hole{s} smaller than can be cut",
    "hole-edge": "hole{s} too close to an edge",
    "web": "place{s} with too little material between cuts",
    "gap": "piece{s} too close to another",
    "piece": "piece{s} larger than the target takes",
    "sheet": "sheet{s} larger than the target takes",
    "segment": "side{s} of outlines too short to cut cleanly",
    "width": "stretch{es} of ribbon too narrow to handle",
    "bend": "bend{s} tighter than the material takes",
}


def flaw_lines(flaws: tuple[Flaw, ...]) -> list[str]:
    """Say for each rule how many places break it, the worst of them, and what would help.

    Examples
    --------
    >>> flaw = Flaw("hole", "A1", 1, (20.0, 30.5), 0.8, 1.0, 3, "--fastener 1mm")
    >>> flaw_lines((flaw,))[0]
    'hole: 3 holes smaller than can be cut on 1 piece; worst 0.80 mm instead of 1.00 mm on A1, \
sheet 1 at (20.0, 30.5). --fastener 1mm would help'
    """
    lines = []
    for rule, meaning in _MEANING.items():
        of_rule = [flaw for flaw in flaws if flaw.rule == rule]
        if not of_rule:
            continue
        # A piece may be too large, all else too small.
        worst = max(of_rule, key=lambda flaw: abs(flaw.limit - flaw.value) / flaw.limit)
        count = sum(flaw.count for flaw in of_rule)
        many = count != 1
        what = meaning.format(s="s" if many else "", es="es" if many else "")
        pieces = {flaw.piece for flaw in of_rule if flaw.piece is not None}
        on = agree(len(pieces), " on {n} piece[|s]") if pieces else ""
        where = "" if worst.piece is None else f" on {worst.piece}"
        if worst.sheet is not None:
            where += f", sheet {worst.sheet}" if where else f" on sheet {worst.sheet}"
        if worst.place is not None:
            where += f" at ({worst.place[0]:.1f}, {worst.place[1]:.1f})"
        lines.append(
            f"{rule}: {count} {what}{on}; worst {worst.value:.2f} mm instead of "
            f"{worst.limit:.2f} mm{where}. {worst.remedy} would help"
        )
    return lines
