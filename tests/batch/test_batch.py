"""Many jobs: each is as it is by itself, whatever fails beside it; what is there is kept."""

import json
import os
import signal
import subprocess
import sys

import pytest
from alone import alone
from jobs import contents_of, run

import fabweave as fw
from fabweave.batch import run as batches
from fabweave.batch.asked import read_batch
from fabweave.core.errors import InputError

pytestmark = pytest.mark.usefixtures("quick_jobs")

COMMON = {"size": "90mm", "effort": "quick", "sheet": "230x225mm"}
WORDS = [word for name, value in COMMON.items() for word in (f"--{name}", value)]
JOBS = {name: {"mesh": f"shape:{name}", **COMMON} for name in ("octahedron", "tetrahedron")}


def without_pages(folder):
    return {name: text for name, text in contents_of(folder).items() if "/" in name}


@pytest.fixture(scope="module")
def shelf(tmp_path_factory):
    """Give the folder of two jobs that share a sheet, and of one that cannot be made."""
    folder = tmp_path_factory.mktemp("batch") / "shelf"
    asked = {**JOBS, "lost": {"mesh": "no.obj"}}
    done = fw.batch(asked, folder, together=True)
    assert (done.made, done.kept, set(done.failed)) == (tuple(JOBS), (), {"lost"})
    assert done.together == (folder / "together" / "card-0.4-mm",)
    return folder


def test_each_job_is_as_it_is_by_itself(shelf, finished):
    for name in JOBS:
        alone_there = finished(JOBS[name]["mesh"], *WORDS)
        assert contents_of(shelf / name) == contents_of(alone_there)
    page = (shelf / "index.html").read_text()
    assert all(f'href="{name}/index.html"' in page for name in JOBS)
    assert "no.obj" in page


@pytest.mark.slow
def test_what_is_there_is_kept_and_what_is_asked_otherwise_is_made_anew(
    shelf, tmp_path, monkeypatch
):
    made = []
    part = batches.make_part
    monkeypatch.setattr(batches, "make_part", lambda *of: made.append(of[0]) or part(*of))
    folder = tmp_path / "shelf"
    fw.batch(JOBS, folder, together=True)
    assert len(made) == 2
    assert without_pages(folder) == without_pages(shelf)
    before = contents_of(folder)
    done = fw.batch(JOBS, folder, together=True)
    assert (done.made, done.kept, len(made)) == ((), tuple(JOBS), 2)
    assert contents_of(folder) == before
    # One with other options; the pieces of the other are planned once more, for the shared sheets.
    other = {**JOBS, "tetrahedron": {**JOBS["tetrahedron"], "size": "95mm"}}
    assert fw.batch(other, folder, together=True).made == ("tetrahedron",)
    assert contents_of(folder)["octahedron/job.toml"] == before["octahedron/job.toml"]
    assert fw.verify(folder / "together" / "card-0.4-mm").ok
    fw.batch(JOBS, folder, together=True)
    assert contents_of(folder) == before
    # What somebody wrote into a job's folder is not lost.
    (folder / "octahedron" / "mine.txt").write_text("mine")
    assert set(fw.batch(JOBS, folder).failed) == {"octahedron"}
    assert (folder / "octahedron" / "mine.txt").read_text() == "mine"
    assert len(made) == 5


def test_ctrl_c_leaves_whole_jobs_and_another_run_makes_the_rest(shelf, tmp_path):
    def stop(_name, _why):
        raise KeyboardInterrupt

    folder = tmp_path / "shelf"
    with pytest.raises(KeyboardInterrupt):
        fw.batch(JOBS, folder, together=True, told=stop)
    (first,) = [path for path in folder.iterdir() if path.is_dir()]
    assert fw.verify(first).ok
    done = fw.batch(JOBS, folder, together=True)
    assert (*done.kept, *done.made) == tuple(JOBS)
    assert without_pages(folder) == without_pages(shelf)


def test_a_table_and_a_row_ask_for_the_same(tmp_path):
    (tmp_path / "cow.obj").touch()
    (tmp_path / "a.toml").write_text(
        'together = false\n[options]\nmaterial = "card"\n[jobs.cow]\nmesh = "cow.obj"\n'
        'max-length = "200mm"\npieces = 9\nsheet = ["1x1m", "2x1m"]\nforce = true\n'
        '[jobs.cube]\nmesh = "shape:cube"\ngoal = "hours=5"\n'
    )
    (tmp_path / "a.csv").write_text(
        "name,mesh,material,max-length,pieces,sheet,force,goal\n"
        ",cow.obj,card,200mm,9,1x1m;2x1m,yes,\ncube,shape:cube,card,,,,,hours=5\n"
    )
    tables, rows = (read_batch(tmp_path / f"a.{suffix}") for suffix in ("toml", "csv"))
    assert tables == rows
    assert tables.jobs[0].mesh == str(tmp_path / "cow.obj")
    assert tables.jobs[0].options["sheet"] == ["1x1m", "2x1m"]


@pytest.mark.parametrize(
    "text",
    [
        "", "[jobs.a]\n", "jobs = 3\n", "[jobs]\na = 3\n", "[job.a]\nmesh='m'\n", "[[jobs]]\n",
        "together = 1\n[jobs.a]\nmesh='m'\n", "[jobs.'../a']\nmesh='m'\n",
        "[jobs.'a/b']\nmesh='m'\n",
        "[jobs.a]\nmesh='m'\n[jobs.A]\nmesh='m'\n", "[jobs.together]\nmesh='m'\n",
        "[jobs.'a.']\nmesh='m'\n", "[jobs.nul]\nmesh='m'\n", "not toml",
        "csv:name,mesh\na,m\na,m\n", "csv:mesh\nm,more\n",
        "csv:mesh,pieces\nm,few\n", "csv:mesh\n",
    ],
)  # fmt: skip
def test_what_is_no_batch_is_refused(text, tmp_path):
    path = tmp_path / ("a.csv" if text.startswith("csv:") else "a.toml")
    path.write_text(text.removeprefix("csv:"))
    with pytest.raises(InputError):
        fw.batch(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("wrong", [{"pieces": 0}, {"pieces": "9"}, {"goal": "luck=1"}, {"no": 1}])
def test_what_is_wrong_with_one_job_is_told_of_it(wrong, tmp_path):
    told = {}
    done = fw.batch({"a": {"mesh": "shape:cube", **wrong}}, tmp_path / "out", told=told.__setitem__)
    assert (done.made, set(done.failed), told) == ((), {"a"}, done.failed)


def test_a_defect_in_one_job_does_not_stop_the_rest(tmp_path, monkeypatch):
    make = batches.make_or_advise

    def broken(job, *of, **options):
        return make(job, *of, **options) if "octa" in job.asked.mesh.source else {}["odd"]

    monkeypatch.setattr(batches, "make_or_advise", broken)
    done = fw.batch(JOBS, tmp_path / "out")
    assert (done.made, set(done.failed)) == (("octahedron",), {"tetrahedron"})
    assert "KeyError: 'odd'" in done.failed["tetrahedron"]


def test_the_command_tells_what_it_made_and_what_not(shelf, tmp_path, capsys):
    path = tmp_path / "jobs.csv"
    cells = ",".join(COMMON.values())
    path.write_text(
        f"mesh,{','.join(COMMON)}\nshape:octahedron,{cells}\nshape:tetrahedron,{cells}\nno.obj,,,\n"
    )
    assert run("batch", path, "-o", shelf, "--together", "--json") == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["kept"], list(told["failed"])) == (list(JOBS), ["no"])
    saved = told["together"]["card-0.4-mm"]
    assert saved["together"]["sheets"] < saved["one_by_one"]["sheets"]
    assert run("batch", tmp_path / "none.toml", "-o", shelf) == 2


@pytest.mark.slow
@pytest.mark.usefixtures("shipped")
def test_processes_and_one_alone_write_the_same(tmp_path):
    path = tmp_path / "jobs.toml"
    lines = "".join(f'[jobs.{name}]\nmesh = "shape:{name}"\n' for name in JOBS)
    common = "".join(f'{name} = "{value}"\n' for name, value in COMMON.items())
    path.write_text(f"together = true\n[options]\n{common}{lines}")
    fw.batch(path, tmp_path / "two", workers=2)
    assert alone("batch", path, "-o", tmp_path / "alone").returncode == 0
    assert contents_of(tmp_path / "alone") == contents_of(tmp_path / "two")


@pytest.mark.slow
@pytest.mark.usefixtures("shipped")
@pytest.mark.filterwarnings("ignore")
def test_dask_makes_the_same_though_one_of_its_workers_dies(tmp_path):
    distributed = pytest.importorskip("distributed", reason="dask.distributed is absent")
    jobs = {f"{name}{at}": JOBS[name] for name in JOBS for at in range(2)}
    fw.batch(jobs, tmp_path / "here", workers=2)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        killed = []

        def kill(_name, _why):
            if not killed:
                killed.append(next(iter(client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

        done = fw.batch(jobs, tmp_path / "there", executors=client.get_executor(), told=kill)
    assert killed
    assert set(done.made) == set(jobs)
    assert contents_of(tmp_path / "there") == contents_of(tmp_path / "here")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_the_command_ends_at_ctrl_c_with_whole_jobs(tmp_path):
    path = tmp_path / "jobs.toml"
    jobs = "".join(f'[jobs.j{at}]\nmesh = "shape:octahedron"\nsize = "90mm"\n' for at in range(20))
    path.write_text(f'[options]\neffort = "quick"\n{jobs}')
    script = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from fabweave.cli.main import main; main(sys.argv[1:])"
    )
    command = [sys.executable, "-u", "-c", script, "batch", str(path), "-o", str(tmp_path / "out")]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert "made" in running.stdout.readline()
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=300)
    assert running.returncode == 130
    made = [one for one in (tmp_path / "out").iterdir() if one.is_dir()]
    assert 0 < len(made) < 20
    assert all(fw.verify(one).ok for one in made)
