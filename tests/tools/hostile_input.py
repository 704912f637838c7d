"""Spoil input files of every kind, seeded, and see that nothing but our own errors comes of it.

Run ``python tests/tools/hostile_input.py 60`` to try for a minute; a second number is the seed to
begin with, and names after it the only kinds to try. ``tests/app/test_hostile_input.py`` tries a
few of each.
"""

import json
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from spoilt_input import Kinds, try_one


def main() -> int:
    """Try for so many seconds, and tell what came of it, by kind."""
    seconds, seed = float(sys.argv[1]), int((sys.argv[2:] or ["0"])[0])
    outcomes: Counter[tuple[str, str]] = Counter()
    faults: dict[str, str] = {}
    with TemporaryDirectory() as made, TemporaryDirectory() as place:
        kinds = Kinds(Path(made))
        kinds.lay_out(Path(place))
        kinds.require_sound(Path(place))
        readers = kinds.readers()
        only = sys.argv[3:] or list(readers)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for name in only:
                started = time.monotonic()
                outcome = try_one(readers[name], Path(place), f"{name} {seed}")
                if time.monotonic() - started > 5.0:
                    print(f"slow: {name} {seed}: {time.monotonic() - started:.0f} s", flush=True)
                short = outcome if "\n" not in outcome else "fault"
                outcomes[name, short] += 1
                if short == "fault":
                    last = outcome.strip().splitlines()
                    where = next(line for line in reversed(last) if line.startswith("  File"))
                    faults.setdefault(f"{name}: {last[-1][:150]} {where}", f"seed {seed}")
            seed += 1
    print(json.dumps({f"{name}, {what}": n for (name, what), n in sorted(outcomes.items())}))
    for fault, where in faults.items():
        print(where, fault)
    print(f"{sum(outcomes.values())} tries, {len(faults)} sorts of faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
