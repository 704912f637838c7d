"""Search designs of many meshes, sizes and materials; make and prove the best: design_table.py OUT.

Usage: design_table.py OUT.jsonl TRIES MADE MESH...; goes on where OUT ends, and keeps what it tries
beside it, in OUT.designs. Prints a table. So many designs are tried of each, and half as many again
beside them where few can be built.
"""

import json
import shutil
import sys
import tempfile
import time
from itertools import product
from pathlib import Path

from fabweave.app.design.job import plan_designs
from fabweave.app.design.page import best_of
from fabweave.app.design.rounds import search_designs
from fabweave.app.pipeline import run_job
from fabweave.app.settings import settings_from_options
from fabweave.core.errors import FabweaveError

SIZES, MATERIALS = ("500mm", "300mm"), ("card", "birch-veneer", "aluminium-5052")


def searched(mesh, size, material, tries, made, meshes, folder):
    """Return what a search finds, in plain values; with how many of the best made and proved."""
    begun, begun_cpu = time.monotonic(), time.process_time()
    asked = settings_from_options(mesh, size=size, material=material, effort="quick")
    try:
        planned = plan_designs(asked, tries)
    except FabweaveError as error:
        return {"refused": str(error)}
    search = search_designs(asked, planned, tries + tries // 2, folder, meshes=meshes)
    designs, tried = search.designs, search.candidates
    best = best_of(tried)
    order = sorted(range(len(tried)), key=lambda at: (not tried[at].makeable, not best[at]))
    found = {
        "tried": len(tried),
        "makeable": sum(one.makeable for one in tried),
        "instead": len(search.instead),
        "search_s": round(time.monotonic() - begun, 1),
        "search_cpu_s": round(time.process_time() - begun_cpu, 1),
        "why": search.why,
        "designs": [[one.name, one.verdict.headline, one.excess] for one in tried],
        "helps": [[one.candidate.name, one.candidate.verdict.level] for one in search.instead],
        "made": [],
    }
    for at in [at for at in order if tried[at].makeable][:made]:
        folder, begun = Path(tempfile.mkdtemp()), time.monotonic()
        try:
            job = run_job(designs[at], folder / "job")
            figures = tried[at].figures
            found["made"].append({
                "name": tried[at].name,
                "verdict": job.job.verdict.level,
                "proved": job.proof.ok,
                "pieces": [figures.pieces, len(job.job.piece_set.pieces)],
                "sheets": [figures.sheets, len(job.job.drawings)],
                "hours": [figures.hours, list(job.job.costs.assembly.hours)],
                "narrowest_mm": figures.narrowest_mm,
                "likeness_mm": figures.likeness_mm,
                "seconds": round(time.monotonic() - begun, 1),
            })  # fmt: skip
        except FabweaveError as error:
            found["made"].append({"name": tried[at].name, "error": str(error)})
        finally:
            shutil.rmtree(folder)
    return found


def main():
    out, tries, made, *meshes = sys.argv[1:]
    known = {}
    if Path(out).exists():
        for line in Path(out).read_text().splitlines():
            row = json.loads(line)
            known[tuple(row["cell"])] = row
    remeshed = {}
    for size, mesh, material in product(SIZES, meshes, MATERIALS):
        cell = (mesh, size, material)
        if material == MATERIALS[0]:
            remeshed.clear()
        if cell not in known:
            found = searched(*cell, int(tries), int(made), remeshed, Path(f"{out}.designs"))
            known[cell] = {"cell": cell, **found}
            with Path(out).open("a") as file:
                file.write(json.dumps(known[cell]) + "\n")
        row = known[cell]
        told = [row["refused"]] if "refused" in row else [
            f"{one['name']} ({one.get('pieces', ['', '?'])[1]} pieces)" for one in row["made"]
        ]  # fmt: skip
        print(Path(cell[0]).name, *cell[1:], f"{row.get('makeable')} of {row.get('tried')}",
              f"{row.get('search_s')} s", "; ".join(told), row.get("why", ""),
              sep=" | ", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
