"""The same bytes come where nothing can be started beside, and from machines of other people."""

import os
import signal
import subprocess
import sys

import alone as apart
import pytest
from alone import alone
from jobs import OCTAHEDRON, contents_of

import fabweave as fw

TWILL = ("shape:torus?m=8&n=4", "--size", "300mm", "--pattern", "twill", "--effort", "quick")
#: What a remesher makes anew, which else runs in a process of its own.
REMESHED = (
    "shape:sphere?n=3", "--size", "200mm", "--remesh", "quads:40", "--effort", "quick",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("words", [OCTAHEDRON, TWILL, REMESHED])
def test_alone_a_job_has_the_same_bytes(words, tmp_path):
    ended = alone("make", *words, "-o", tmp_path / "alone")
    assert (ended.returncode, "Traceback" in ended.stderr) == (0, False), ended.stderr
    fw.make(
        str(words[0]), tmp_path / "job", workers=2,
        **{name[2:]: value for name, value in zip(words[1::2], words[2::2], strict=True)},
    )  # fmt: skip
    assert contents_of(tmp_path / "alone") == contents_of(tmp_path / "job")


def test_alone_means_alone():
    # Else the test above would say nothing.
    tries = "import threading; threading.Thread(target=int).start()", "import os; os.fork()"
    for tried in (*tries, "import subprocess; subprocess.run(['true'])"):
        script = f"import runpy; runpy.run_path({apart.__file__!r})['forbid']()\n{tried}"
        ended = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
        assert ended.returncode == 1


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_dask_tries_the_same_designs_though_one_of_its_workers_dies():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is absent")
    asked = {"tries": 4, "size": "200mm", "effort": "quick"}
    here = fw.design("shape:sphere?n=3", **asked)
    assert len(here) > 1
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids, killed = client.run(os.getpid), []

        def tell(what, done, _total):
            if what == "designs" and done and not killed:
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)

        there = fw.design(
            "shape:sphere?n=3", executors=client.get_executor(), progress=tell, **asked
        )
    assert killed
    assert [one.tried.record() for one in there] == [one.tried.record() for one in here]
    assert [one.tried.picture for one in there] == [one.tried.picture for one in here]
