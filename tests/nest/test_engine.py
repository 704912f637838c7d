import sys

import numpy as np
import pytest

from fabweave.nest.engine.engine import engine_is_there, packed
from fabweave.nest.item_shape import shape_of
from fabweave.nest.separate.clearance_proof import missing_mm
from fabweave.nest.separate.item_field import body_of

USABLE = (90.0, 45.0)


def bars(count, length=40.0, width=8.0):
    outline = np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])
    return [body_of(shape_of(outline)[0], 2.0)] * count


@pytest.mark.skipif(not engine_is_there(), reason="spyrrow is not installed")
def test_engine_packs_bars_that_have_room():
    bodies = bars(6)
    poses = packed(bodies, USABLE, 2.0, seconds=2, seed=1)
    assert poses is not None
    # Its outlines are a little larger than ours, and its strip may be a little too long.
    assert missing_mm(bodies, poses, (USABLE[0] + 2.5, USABLE[1] + 0.5), 2.0) < 0.1


@pytest.mark.skipif(not engine_is_there(), reason="spyrrow is not installed")
def test_engine_has_no_answer_where_there_is_none():
    assert packed(bars(20), USABLE, 2.0, seconds=1, seed=1) is None


@pytest.mark.parametrize(
    "code",
    [
        "import os; os.abort()",
        "import time; time.sleep(600)",
        "raise SystemExit(3)",
        "pass",
        "import sys; open(sys.argv[1], 'w').write('no json')",
        "import sys; open(sys.argv[1], 'w').write('[1, 2]')",
        'import sys; open(sys.argv[1], "w").write(\'{"width_mm": 5, "poses": [[0, 0, 0]]}\')',
        'import sys; open(sys.argv[1], "w").write(\'{"width_mm": 5, "poses": [[NaN, 0, 0]]}\')',
        'import sys; open(sys.argv[1], "w").write(\'{"width_mm": 5, "poses": "none"}\')',
    ],
)
def test_whatever_the_child_does_costs_nothing(code):
    command = (sys.executable, "-c", code)
    grace_s = 1.0 if "sleep" in code else 300.0
    found = packed(bars(2), USABLE, 2.0, seconds=0, grace_s=grace_s, seed=1, command=command)
    assert found is None


def test_no_such_command_costs_nothing(tmp_path):
    command = (str(tmp_path / "absent"),)
    assert packed(bars(2), USABLE, 2.0, seconds=0, seed=1, command=command) is None


def test_pieces_that_would_make_it_panic_are_not_given_to_it(tmp_path):
    told = tmp_path / "told"
    command = (sys.executable, "-c", f"open({str(told)!r}, 'w')")
    assert packed(bars(1, 60.0, 50.0), USABLE, 2.0, seconds=0, seed=1, command=command) is None
    assert not told.exists()
    packed(bars(1), USABLE, 2.0, seconds=0, grace_s=300.0, seed=1, command=command)
    assert told.exists()
