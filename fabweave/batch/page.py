"""Make the page of a batch: its jobs, the sheets that they share, and one shopping list."""

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from fabweave.estimate.money import Price
from fabweave.plan.bill_of_materials import (
    SHOPPING,
    BillOfMaterials,
    FastenerRow,
    GlueRow,
    TapeRow,
    shopping_rows,
)
from fabweave.sheet.kerf import CUT_FOLDER
from fabweave.show.pages import render


class _Row(NamedTuple):
    """A job on the page."""

    name: str
    verdict: str
    score: float
    pieces: int
    sheets: int
    hours: tuple[float, float]
    price: Price | None
    waste: Mapping[str, Any]


def batch_page(
    directory: Path, names: Sequence[str], failed: Mapping[str, str], shared: Sequence[Path]
) -> str:
    """Return the page of a batch, from what stands in the folders of its jobs.

    Parameters
    ----------
    directory : Path
        Of the batch.
    names : sequence of str
        The jobs that are there.
    failed : mapping
        Why others are not.
    shared : sequence of Path
        The folders of sheets that jobs share.
    """
    rows = [_row(directory / name) for name in names]
    queues = [
        (folder.name, json.loads((folder / "queue.json").read_bytes()), _to_cut(folder))
        for folder in shared
    ]
    prices = [row.price for row in rows]
    low, high = (sum(row.hours[end] for row in rows) for end in (0, 1))
    return render(
        "batch.html",
        title=f"{len(names)} jobs",
        rows=rows,
        failed=failed,
        queues=queues,
        hours=(low, high),
        prices=_priced([one for one in prices if one is not None]),
        sheets=_sheets(rows, [queue for _, queue, _ in queues]),
        shopping=SHOPPING,
        buy=shopping_rows(_bill([row.waste for row in rows])),
    )


def _row(folder: Path) -> _Row:
    """Return what a job came to."""
    waste = json.loads((folder / "waste.json").read_bytes())
    verdict = json.loads((folder / "verdict.json").read_bytes())
    estimate = waste["estimate"]
    return _Row(
        name=folder.name,
        verdict=verdict["level"],
        score=verdict["grade"]["score"],
        pieces=waste["totals"]["pieces"],
        sheets=waste["totals"]["sheets"],
        hours=tuple(estimate["assembly"]["hours"]),
        price=None if (price := estimate["price"]) is None else msgspec.convert(price, Price),
        waste=waste,
    )


def _to_cut(folder: Path) -> list[str]:
    """Return the sheets for the cutter, without suffix: those with the kerf, if there are any."""
    drawn = sorted((folder / CUT_FOLDER).glob("*.dxf")) or sorted((folder / "sheets").glob("*.dxf"))
    return [path.relative_to(folder).with_suffix("").as_posix() for path in drawn]


def _priced(prices: Sequence[Price]) -> list[Price]:
    """Return what prices come to, of each currency."""
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for price in prices:
        sums[price.currency][0] += price.low
        sums[price.currency][1] += price.high
    return [
        Price(low=low, high=high, currency=currency)
        for currency, (low, high) in sorted(sums.items())
    ]


def _sheets(
    rows: Iterable[_Row], queues: Iterable[Mapping[str, Any]]
) -> list[tuple[str, float, int]]:
    """Return what sheets to buy: material, thickness, and how many; shared ones count once."""
    counts: dict[tuple[str, float], int] = defaultdict(int)
    sharing: dict[tuple[str, float], set[str]] = defaultdict(set)
    for queue in queues:
        key = queue["material"], queue["thickness_mm"]
        counts[key] += queue["together"]["sheets"]
        sharing[key] |= {job["name"] for job in queue["jobs"]}
    for row in rows:
        for account in row.waste["materials"]:
            key = account["material"], account["thickness_mm"]
            counts[key] += 0 if row.name in sharing[key] else account["sheets"]
    return [(*key, count) for key, count in sorted(counts.items())]


def _bill(wastes: Sequence[Mapping[str, Any]]) -> BillOfMaterials:
    """Return what is bought for all jobs: what is the same is counted together."""
    rows: dict[tuple[Any, ...], FastenerRow] = {}
    for told in (row for waste in wastes for row in waste["fasteners"]):
        row = msgspec.convert(told, FastenerRow)
        key = row.diameter_mm, row.layers, row.grip_mm, row.fits
        if key in rows:
            was = rows[key]
            sums: dict[str, Any] = {
                name: (getattr(was, name) or 0) + (getattr(row, name) or 0)
                for name in ("needed", "spare", "buy", "outside")
            }
            row = replace(was, **sums)
        rows[key] = row
    return BillOfMaterials(
        fasteners=tuple(rows[key] for key in sorted(rows, key=str)),
        glue=GlueRow(
            joints=sum(waste["glue"]["joints"] for waste in wastes),
            area_mm2=sum(waste["glue"]["area_mm2"] for waste in wastes),
            crossings=sum(waste["glue"].get("crossings", 0) for waste in wastes) or None,
        ),
        tape=TapeRow(
            joints=sum(waste["tape"]["joints"] for waste in wastes),
            length_mm=sum(waste["tape"]["length_mm"] for waste in wastes),
        ),
        hardware=None,
        # One builds after another with the same clips.
        clips=max((waste.get("clips") or 0 for waste in wastes), default=0),
    )
