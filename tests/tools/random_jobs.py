"""Make many random jobs and count what came of them.

    random_jobs.py FIRST LAST PROCESSES [small] [offcuts]

With ``offcuts`` each has a scheme of colours, and many are cut from what earlier jobs left.
Prints every fault with its seed, and in the end the outcomes with the words of refusals.
"""

import multiprocessing
import re
import sys
import tempfile
import traceback
from collections import Counter
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from jobs import quick_jobs
from random_jobs import SHAPES, earlier_stock, outcome_of


def tried(seed, *, small, stocks):
    try:
        with quick_jobs():
            return (seed, *outcome_of(seed, small=small, stocks=stocks))
    except Exception:
        return seed, "fault", traceback.format_exc()


def main():
    first, last, processes = map(int, sys.argv[1:4])
    outcomes, words = Counter(), Counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        multiprocessing.get_context("spawn").Pool(processes) as pool,
    ):
        stocks = None
        if "offcuts" in sys.argv[4:]:
            with quick_jobs():
                stocks = earlier_stock(Path(folder))
        job = partial(tried, small="small" in sys.argv[4:], stocks=stocks)
        for number, (seed, outcome, said) in enumerate(
            pool.imap_unordered(job, range(first, last)), start=1
        ):
            outcomes[outcome, SHAPES[seed % len(SHAPES)].__name__] += 1
            if outcome in ("fault", "unproved"):
                print(f"seed {seed}: {outcome}\n{said}", flush=True)
            elif outcome != "proved":
                words[outcome, re.sub(r"[\d.]+", "#", said)[:70]] += 1
            if number % 100 == 0:
                print(number, dict(Counter(x for (x, _), n in outcomes.items() for _ in range(n))),
                      flush=True)  # fmt: skip
    for (outcome, shape), count in sorted(outcomes.items()):
        print(f"{count:6} {outcome}, {shape}")
    for (outcome, said), count in words.most_common(60):
        print(f"{count:6} {outcome}: {said}")


if __name__ == "__main__":
    main()
