"""A job's folder is replaced only if nothing of anybody else's is lost by that."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from jobs import OCTAHEDRON, run

from fabweave.core.errors import InputError
from fabweave.core.job_folder import (
    CONTENTS_FILE,
    check_destination,
    clear_abandoned,
    finished_folder,
    foreign_files,
    is_complete,
    write_contents,
)


def tree(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def small_job(folder: Path, text: str = "older") -> Path:
    (folder / "sheets").mkdir(parents=True)
    (folder / "job.toml").write_text(text)
    (folder / "sheets" / "sheet_01.dxf").write_text(text)
    write_contents(folder)
    return folder


def put(folder: Path, name: str, text: str = "mine") -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


#: What somebody may do to a folder, and the name that the refusal has to tell.
FOREIGN = {
    "a note": (lambda job: put(job, "notes.txt"), "notes.txt"),
    "a laser project": (lambda job: put(job, "sheets/sheet_01.lbrn2"), "sheets/sheet_01.lbrn2"),
    "a repository": (lambda job: put(job, ".git/HEAD"), ".git"),
    "an empty folder": (lambda job: (job / "photos").mkdir(), "photos"),
    "an edited sheet": (
        lambda job: put(job, "sheets/sheet_01.dxf", "edited"),
        "sheets/sheet_01.dxf (changed since)",
    ),
    "a folder for a file": (
        lambda job: ((job / "job.toml").unlink(), put(job, "job.toml/mine")),
        "job.toml (no longer a file)",
    ),
    "no list": (lambda job: (job / CONTENTS_FILE).unlink(), "job.toml"),
    "a list of nonsense": (lambda job: put(job, CONTENTS_FILE, "[" * 100_000), "job.toml"),
    "a list of numbers": (lambda job: put(job, CONTENTS_FILE, '{"files": {"a": 1}}'), "job.toml"),
}


@pytest.mark.parametrize(("spoil", "name"), FOREIGN.values(), ids=FOREIGN)
def test_a_folder_with_anything_else_is_refused_and_stays(spoil, name, tmp_path):
    job = small_job(tmp_path / "job")
    check_destination(job)
    spoil(job)
    before = tree(tmp_path)
    with pytest.raises(InputError) as refusal:
        check_destination(job)
    assert name in str(refusal.value).partition(": ")[2].partition(";")[0].split(", ")
    with pytest.raises(InputError), finished_folder(job):
        raise AssertionError("not reached")
    assert tree(tmp_path) == before


def test_what_file_managers_leave_is_nobodys(tmp_path):
    job = small_job(tmp_path / "job")
    put(job, ".DS_Store")
    put(job, "sheets/Thumbs.db")
    assert foreign_files(job) == []


def test_what_is_put_there_during_the_run_survives(tmp_path):
    job = small_job(tmp_path / "job")
    with pytest.raises(InputError, match=r"notes\.txt"), finished_folder(job) as fresh:  # noqa: PT012 - meanwhile
        put(fresh, "job.toml", "newer")
        put(job, "notes.txt")
    assert (job / "notes.txt").read_text() == "mine"
    assert (job / "job.toml").read_text() == "older"
    assert list(tmp_path.iterdir()) == [job]


def test_a_link_to_a_folder_is_followed_and_one_to_nowhere_refused(tmp_path):
    job = small_job(tmp_path / "there" / "job")
    link = tmp_path / "link"
    link.symlink_to(job)
    with finished_folder(link) as fresh:
        put(fresh, "job.toml", "newer")
    assert link.is_symlink()
    assert (job / "job.toml").read_text() == "newer"
    # The older job is replaced whole.
    assert set(tree(job)) == {"job.toml", CONTENTS_FILE}
    assert is_complete(job)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "there"]
    link.unlink()
    link.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="nowhere"):
        check_destination(link)


def test_where_one_is_and_the_roots_of_volumes_are_refused(tmp_path, monkeypatch):
    (tmp_path / "a" / "b").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "a" / "b")
    for directory in (Path(), Path(".."), tmp_path / "a"):
        with pytest.raises(InputError, match="is where you are"):
            check_destination(directory)
    with pytest.raises(InputError, match="is the root of a volume"):
        check_destination(Path("/"))


def test_a_mesh_in_the_folder_is_not_lost(tmp_path):
    job = small_job(tmp_path / "job")
    put(job, "vase.obj")
    write_contents(job)
    check_destination(job)
    with pytest.raises(InputError, match=r"the mesh .*vase.obj is in "):
        check_destination(job, mesh=str(job / "vase.obj"))


#: Makes a folder, and kills itself as nothing can prevent when it is to be put in place.
KILLED = """\
import os, signal, sys
from pathlib import Path
import fabweave.core.job_folder as job_folder
where, directory = sys.argv[1], Path(sys.argv[2])
real, calls = Path.rename, 0
def rename(path, target):
    global calls
    calls += 1
    if where == f"before {calls}":
        os.kill(os.getpid(), signal.SIGKILL)
    real(path, target)
    if where == f"after {calls}":
        os.kill(os.getpid(), signal.SIGKILL)
Path.rename = rename
with job_folder.finished_folder(directory) as fresh:
    (fresh / "job.toml").write_text("newer")
    if where == "half full":
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(os.name != "posix", reason="sends a POSIX signal")
@pytest.mark.parametrize(
    ("where", "text"),
    [("half full", "older"), ("before 1", "older"), ("after 1", "newer"), ("after 2", "newer")],
)
def test_the_next_run_clears_up_after_one_that_was_killed(where, text, tmp_path):
    job = small_job(tmp_path / "job")
    put(tmp_path, ".job.notours/mine")  # like a temporary folder, but nobody's lock is in it
    ended = subprocess.run([sys.executable, "-c", KILLED, where, job], check=False)
    assert ended.returncode == -signal.SIGKILL
    assert len(list(tmp_path.glob(".job.*"))) == 2
    assert len(clear_abandoned(job)) == 1
    assert (job / "job.toml").read_text() == text
    assert is_complete(job)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".job.notours", "job"]
    assert clear_abandoned(job) == []


def test_a_run_that_lives_is_left_alone(tmp_path):
    job = small_job(tmp_path / "job")
    with finished_folder(job) as fresh:
        put(fresh, "job.toml", "newer")
        script = "import sys; from pathlib import Path; import fabweave.core.job_folder as f; " \
            "print(f.clear_abandoned(Path(sys.argv[1])))"  # fmt: skip
        said = subprocess.run([sys.executable, "-c", script, job], capture_output=True, check=True)
        assert said.stdout.strip() == b"[]"
        assert fresh.is_dir()
    assert (job / "job.toml").read_text() == "newer"


def test_where_the_name_is_taken_again_the_older_job_is_kept_aside(tmp_path):
    job = small_job(tmp_path / "job")
    subprocess.run([sys.executable, "-c", KILLED, "after 1", job], check=False)
    job.mkdir()
    put(job, "diary.txt")
    (said,) = clear_abandoned(job)
    assert "is still in" in said
    (aside,) = tmp_path.glob(".job.*/old")
    assert (aside / "job.toml").read_text() == "older"
    assert (job / "diary.txt").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.usefixtures("quick_jobs")
def test_the_command_line_says_so_and_goes_on(finished, tmp_path, capsys):
    job = finished.copy(tmp_path / "job", *OCTAHEDRON)
    made = tree(job)
    subprocess.run([sys.executable, "-c", KILLED, "half full", job], check=False)
    assert run("make", *OCTAHEDRON, "-q", "-o", job) == 0
    assert "was killed: removed what it left" in capsys.readouterr().err
    assert tree(job) == made
    put(job, "notes.txt")
    assert run("make", *OCTAHEDRON, "-q", "-o", job) == 2
    assert "notes.txt" in capsys.readouterr().err
    assert tree(job) == made | {"notes.txt": b"mine"}
    assert list(tmp_path.iterdir()) == [job]


#: Runs the command line, and ends it as it writes the files of a job: with all processes that help
#: it, as a terminal does, or alone. Where tests run in the background of a shell, children are told
#: to ignore SIGINT.
ENDED = """\
import contextlib, os, signal, sys
sys.path.insert(0, sys.argv[1])
from jobs import quick_jobs
from fabweave.job import run as pipeline
from fabweave.cli.main import main
signal.signal(signal.SIGINT, signal.default_int_handler)
real, number, alone = pipeline.write_plan, int(sys.argv[2]), sys.argv[3] == "alone"
def write(job, folder, *rest, **options):
    made = real(job, folder, *rest, **options)
    (os.kill if alone else os.killpg)(os.getpid(), number)
    return made
pipeline.write_plan = write
with quick_jobs() if alone else contextlib.nullcontext():
    main(["make", *sys.argv[4:]])
"""


def ended(number, how, *words, stdout=None):
    """Run such a command line."""
    support = Path(__file__).parents[1] / "support"
    command = [sys.executable, "-c", ENDED, support, str(number), how, *OCTAHEDRON, *words]
    return subprocess.run(
        command, check=False, stdout=stdout, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip


@pytest.mark.skipif(os.name != "posix", reason="sends a POSIX signal")
@pytest.mark.parametrize(
    ("name", "how"),
    [("SIGTERM", "alone"), pytest.param("SIGINT", "together", marks=pytest.mark.slow)],
)
def test_a_run_that_is_ended_leaves_the_older_job_alone(name, how, tmp_path):
    older, number = tree(small_job(tmp_path / "job")), int(getattr(signal, name))
    run_out = ended(number, how, "-q", "-o", tmp_path / "job")
    assert run_out.returncode == 128 + number
    assert len(run_out.stderr.strip().splitlines()) <= 1, run_out.stderr
    assert "Traceback" not in run_out.stderr
    assert tree(tmp_path / "job") == older
    assert [path.name for path in tmp_path.iterdir()] == ["job"]


@pytest.mark.slow
def test_a_run_whose_reader_has_gone_leaves_its_job(tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    run_out = ended(0, "alone", "-v", "-o", tmp_path / "job", stdout=writing)
    os.close(writing)
    assert "Traceback" not in run_out.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["job"]
    assert is_complete(tmp_path / "job")
