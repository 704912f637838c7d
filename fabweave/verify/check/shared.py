"""Check sheets that jobs share: each piece of each job is there once, and nobody else's."""

import math
from collections import Counter
from collections.abc import Sequence

import shapely

from fabweave.verify.crossing_map import Sheet
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.queue import TABLE, Account
from fabweave.verify.report import Place, Tally

#: Areas are told to a thousandth, and shares to a millionth.
_AREA_MM2, _SHARE = 0.01, 1e-5


def check_shared(job: Job, tally: Tally) -> None:
    """Check whose pieces lie on shared sheets, by the plans of the jobs, and what that saves."""
    shared, plan = required(job.shared), required(job.map)
    queue = shared.queue
    tally.at("jobs").same("numbers", [one.number for one in queue.jobs], shared.jobs)
    alone: list[Sheet] = []
    for one in queue.jobs:
        own = shared.jobs.get(one.number)
        if own is None or own.map is None:
            tally.fail(f"the pieces of {one.name} are not checked: its plan could not be read")
            continue
        material = queue.material, queue.thickness_mm
        alone += [x for x in own.map.sheets if (x.material, x.thickness_mm) == material]
        wanted = [
            piece.id
            for piece in own.map.to_cut
            if (own.supplies[piece.thread].material, own.supplies[piece.thread].thickness_mm)
            == material
        ]
        there = [piece for piece in queue.pieces if piece.job == one.number]
        place = tally.at(one.name)
        place.same("pieces", sorted(piece.piece for piece in there), sorted(wanted))
        place.count(len(wanted))
        for piece in there:
            place.at(piece.piece).equal("what it bears", piece.id, f"{one.number}{piece.piece}")
    repeated = [key for key, n in Counter(piece.id for piece in queue.pieces).items() if n > 1]
    tally.at("pieces").expect(not repeated, f"{repeated[:3]} are there more than once")
    empty = [sheet.name for sheet in queue.sheets if not plan.on_sheet(sheet.number)]
    tally.at("sheets").expect(not empty, f"there is no piece on {empty[:3]}")
    used = sum(shapely.Polygon(piece.outline).area for piece in plan.pieces)
    _check_account(queue.together, queue.sheets, used, tally.at("together"))
    _check_account(queue.one_by_one, alone, used, tally.at("one_by_one"))
    names = {one.number: one.name for one in queue.jobs}
    sheets = {sheet.number: sheet.name for sheet in queue.sheets}
    tally.at(TABLE).same(
        "rows",
        sorted(tuple(row.values()) for row in shared.rows),
        sorted(
            (sheets.get(x.sheet, ""), names.get(x.job, ""), x.piece, x.id) for x in queue.pieces
        ),
    )


def _check_account(
    account: Account, sheets: Sequence[Sheet], used_mm2: float, place: Place
) -> None:
    """Check how much material is said to be taken, and wasted."""
    area = sum(sheet.width_mm * sheet.height_mm for sheet in sheets)
    place.equal("the number of sheets", account.sheets, len(sheets))
    place.number("area_mm2", account.area_mm2, area, within=_AREA_MM2)
    place.number("waste_mm2", account.waste_mm2, area - used_mm2, within=_AREA_MM2)
    share = used_mm2 / area if area else math.nan
    place.number("utilisation", account.utilisation, share, within=_SHARE)
