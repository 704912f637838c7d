"""Hold our machine time against the one that MeerK40t tells for the same sheets; run by hand.

    python tests/benchmarks/bench_machine_time.py [JOB ...]

For each sheet of a finished job (of a small torus, without one) MeerK40t 0.9 plans the SVG at our
fastest and at our slowest speeds, and tells how long it burns; printed are its seconds over ours,
fastest and slowest. MeerK40t takes every line at nine tenths of its speed and knows neither
acceleration nor rests, so it tells less where strokes are short. It travels at one speed of its
own, which says nothing about ours.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import fabweave as fw

#: Runs MeerK40t without its windows on a script, and prints what its plan comes to: for each speed
#: the seconds that it burns.
_ASK = """
import json, os, sys
import meerk40t.core.planner as planner
from meerk40t.core.cutcode.cutcode import CutCode
from meerk40t.internal_plugins import plugin
from meerk40t.kernel import Kernel
from meerk40t.main import parser

plans = []
begin = planner.CutPlan.__init__
def begun(self, *args, **more):
    plans.append(self)
    begin(self, *args, **more)
planner.CutPlan.__init__ = begun
kernel = Kernel("MeerK40t", "0", "MeerK40t", ansi=False, ignore_settings=True)
kernel.args = parser.parse_args(["-z", "-P", "9"])
kernel.add_plugin(plugin)
kernel(partial=True)
for line in open(sys.argv[1], encoding="utf-8"):
    kernel.console(line.strip() + "\\n")
burns = {}
for plan in plans:
    for code in plan.plan:
        if isinstance(code, CutCode) and len(code):
            last = 0.0
            for cut, one in zip(code.flat(), code.provide_statistics(), strict=True):
                speed = str(cut.settings["speed"])
                burns[speed] = burns.get(speed, 0.0) + one["total_time_cut"] - last
                last = one["total_time_cut"]
print("ANSWER", json.dumps(burns), flush=True)
os._exit(0)
"""
#: Nothing is put in another order: how long a file takes as it stands.
_SCRIPT = """\
service device start -i grbl 0
set -p planner opt_effect_combine False
set -p elements classify_black_as_raster False
set -p elements classify_autogenerate False
set -p elements classify_new False
operation* delete
engrave -c #000000 -s {engrave}
cut -c #0000ff -s {cut}
cut -c #ff0000 -s {cut}
load {file}
element* classify
planA copy preprocess validate blob
"""


def told_by_meerk40t(file: Path, engrave: float, cut: float) -> tuple[float, float]:
    """Return the seconds that MeerK40t engraves and cuts."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "script.txt"
        script.write_text(_SCRIPT.format(file=file, engrave=engrave, cut=cut), encoding="utf-8")
        run = subprocess.run(
            [sys.executable, "-c", _ASK, script],
            env={"HOME": folder, "PATH": ""},
            capture_output=True,
            text=True,
            check=True,
        )
    answer = next(line for line in run.stdout.splitlines() if line.startswith("ANSWER"))
    burns = json.loads(answer.removeprefix("ANSWER"))
    by_speed = {float(speed): seconds for speed, seconds in burns.items()}
    return by_speed.get(engrave, 0.0), by_speed.get(cut, 0.0)


def compare(job: Path) -> None:
    """Print a row for each sheet of a job."""
    estimate = json.loads((job / "waste.json").read_text(encoding="utf-8"))["estimate"]
    rates = estimate["materials"][0]
    for number, sheet in enumerate(estimate["sheets"], start=1):
        file = job / "sheets" / f"sheet_{number:02}.svg"
        words = [f"{job.name}, sheet {number}:"]
        for fast in (1, 0):
            # A little more, as two operations of one speed could not be told apart.
            engrave, cut = rates["engrave_mm_s"][fast] + 0.001, rates["speed_mm_s"][fast]
            theirs = told_by_meerk40t(file, engrave, cut)
            ours = [sheet[key][1 - fast] for key in ("engrave_s", "cut_s")]
            words += [
                f"{name} {told:.0f} / {own:.0f} s = {told / own:.2f},"
                for name, told, own in zip(("engrave", "cut"), theirs, ours, strict=True)
                if own
            ]
            both = sum(theirs) / sum(ours)
            words.append(f"both {both:.2f} ({'fastest' if fast else 'slowest'});")
        print(*words, flush=True)


def main() -> None:
    """Compare jobs that are named, or a small torus."""
    if sys.argv[1:]:
        for name in sys.argv[1:]:
            compare(Path(name))
        return
    with tempfile.TemporaryDirectory() as folder:
        torus = Path(folder) / "torus"
        fw.make("shape:torus?m=8&n=4", torus, size="300mm", effort="quick")
        compare(torus)


if __name__ == "__main__":
    main()
