"""Check what is said of materials of the user's own against their entries in job.toml."""

from typing import Any

import numpy as np

from fabweave.verify.measure.supplies import Supply
from fabweave.verify.read.job_files import Job
from fabweave.verify.statement import Tally

#: Radii are stated to a ten-thousandth.
_ROUNDED_MM = 1e-4


def check_own_materials(job: Job, tally: Tally) -> None:
    """Check that entries are of materials in use, and density, price, speed and bend are theirs."""
    entries = job.options.get("materials", {})
    if not entries:
        return
    used = {_plain(supply.material) for supply in job.supplies.values()}
    strange = sorted(set(entries) - used)
    tally.at("job.toml").equal("entries of materials that are not used", strange, [])
    waste = job.waste or {}
    estimate = (waste.get("estimate") or {}).get("materials", [])
    for where, records, keys in (
        ("materials", waste.get("materials", []), ("density_kg_m3",)),
        ("estimate", estimate, ("speed_mm_s", "price_per_m2", "currency")),
    ):
        for record in records:
            entry = entries.get(_plain(record["material"]), {})
            for key in keys if entry else ():
                place = tally.at("waste.json", where, record["material"]).against("job.toml")
                place.equal(key, record[key] or None, entry.get(key) or None)
    _check_bends(job, entries, tally)


def _check_bends(job: Job, entries: dict[str, Any], tally: Tally) -> None:
    """Check the tightest bend that ribbons.json states of each thread."""
    if job.map is None or job.ribbons is None:
        return
    threads = {thread.label: job.supplies.get(thread.id, Supply()) for thread in job.map.threads}
    for record in job.ribbons["threads"]:
        supply = threads.get(record.get("thread"), Supply())
        entry = entries.get(_plain(supply.material))
        if entry is None or supply.thickness_mm is None:
            continue
        stated = record.get("limits", job.ribbons["limits"]).get("bend_mm")
        wanted = _tightest_mm(entry, supply.thickness_mm)
        place = tally.at("ribbons.json", f"thread {record.get('thread')}").against("job.toml")
        place.number("bend_mm", stated, wanted, within=_ROUNDED_MM)


def _tightest_mm(entry: dict[str, Any], thickness_mm: float) -> float:
    """Return the tightest radius by an entry's rule; beyond a table its end's ratio is kept.

    Examples
    --------
    >>> table = {"bend_table_mm": [[1.0, 50.0], [2.0, 120.0]]}
    >>> [_tightest_mm(table, thickness) for thickness in (0.5, 1.5, 4.0)]
    [25.0, 85.0, 240.0]
    """
    if "min_bend_radius_t" in entry:
        return float(entry["min_bend_radius_t"] * thickness_mm)
    thick, radius = np.array(entry["bend_table_mm"], dtype=np.float64).T
    inside = float(np.clip(thickness_mm, thick[0], thick[-1]))
    return float(np.interp(inside, thick, radius)) * thickness_mm / inside


def _plain(material: str | None) -> str:
    """Return the name of a material without the sort after its colon."""
    return (material or "").partition(":")[0]
