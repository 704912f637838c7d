"""Print who imports whom: how many modules of each room (rows) import from each room (columns).

Where data flows one way, everything stands on the diagonal and to the left of it.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from house import import_table, read_modules  # noqa: E402 - found beside the tests

if __name__ == "__main__":
    print(import_table(read_modules(ROOT / "fabweave")))
