"""Words agree with their number, in the sentences that a user meets."""

import re

import pytest

from fabweave.app.inspection.facts import inspect_mesh
from fabweave.app.pipeline import make_job
from fabweave.app.settings import Settings
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.stock.sheet_size import SheetSize

#: One of something in the plural, or a sentence with a hole in it.
WRONG = re.compile(
    r"(?<![\d.,])1 ((boundary|closed|irregular|open) )?"
    r"(faces|vertices|edges|loops|threads|sheets|pieces|joints|crossings|bodies|pairs|are|have)\b"
    r"|[\[\]|{}]|\(\)|\b0 found"
)


@pytest.mark.parametrize(
    ("count", "said"),
    [(0, "0 men are"), (1, "1 man is"), (2, "2 men are"), (-1, "-1 men are"), (11, "11 men are")],
)
def test_only_one_is_singular(count, said) -> None:
    assert agree(count, "{n} [man is|men are]") == said


def test_an_ending_may_be_empty_and_text_without_choices_stays() -> None:
    assert agree(1, "{n} piece[|s] touch[es|] (a | b)") == "1 piece touches (a | b)"
    assert agree(3, "{n} piece[|s] touch[es|] (a | b)") == "3 pieces touch (a | b)"


@pytest.mark.parametrize(
    ("obj", "said"),
    [
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", "1 face has no neighbour"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 3 2 1\n", "1 face has exactly the same"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 9 9 9\nf 1 2 3\n", "1 vertex belongs to no face"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 1\nf 1 2 3\nf 1 3 4\nf 1 3 5\n",
         "1 edge has more than two faces"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 nan\nf 1 2 3\n", "1 vertex used by faces has"),
    ],
)  # fmt: skip
def test_one_problem_is_said_in_the_singular(obj, said, tmp_path) -> None:
    (tmp_path / "a.obj").write_text(obj)
    problems = [str(problem) for problem in check_mesh(read_mesh(tmp_path / "a.obj").mesh).problems]
    assert any(said in problem for problem in problems)
    assert not any(WRONG.search(problem) for problem in problems)


def test_one_turned_face_is_said_in_the_singular(tmp_path) -> None:
    (tmp_path / "a.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\nf 1 4 3\n"
    )
    _, _, notes = prepare_mesh(read_mesh(tmp_path / "a.obj").mesh)
    assert "1 vertex belongs to no face and was left out" in notes[0]
    assert "1 face was inside out and was turned over" in notes[1]


@pytest.mark.parametrize(
    ("mesh", "pattern"),
    [
        ("shape:hypar?m=2&n=1", "plain"),
        ("shape:hypar?m=2&n=2", "3/1"),
        ("shape:tube?m=4&n=2", "triaxial"),
        ("shape:torus?m=5&n=3", "2/1"),
        ("shape:octahedron", "twill"),
    ],
)
def test_notes_of_small_jobs_agree_with_their_numbers(mesh, pattern) -> None:
    job = make_job(
        Settings(
            mesh,
            size_mm=300.0,
            pattern=pattern,
            effort="quick",
            sheets=(SheetSize(600, 400),),
            force=True,
        )
    )
    notes = "\n".join(job.notes)
    assert not WRONG.search(notes), notes


def test_what_crosses_nothing_is_no_warp() -> None:
    # Of 12 threads on a square of 3 x 3 quads, four cut a corner: 4 + 4 are warp and weft.
    job = make_job(Settings("shape:hypar?m=3&n=3", size_mm=300.0, pattern="3/1", effort="quick"))
    threads = job.weave.threads
    crossing = int((threads.lengths > 0).sum())
    said = next(int(note.split("exact; ")[1].split()[0]) for note in job.notes if "warp" in note)
    assert 2 * said == crossing < threads.n_threads


def test_what_crosses_nothing_is_counted_by_itself() -> None:
    # Of a tetrahedron without two faces, two triangles are left: two threads cross on their edge.
    settings = Settings("shape:tetrahedron", size_mm=200.0, leave_out="0,1", effort="quick")
    notes = make_job(settings).notes
    assert not WRONG.search("\n".join(notes))
    weave = next(at for at, note in enumerate(notes) if note.startswith("weave:"))
    assert [re.findall(r"\d+", note) for note in notes[weave - 1 : weave + 2]] == [
        ["2"],  # openings of three sides, and no others
        ["2", "0", "2", "1"],  # threads, rings, threads with ends, crossings
        ["2"],  # threads that cross nothing
    ]
    facts = inspect_mesh(settings).facts["threads"]
    assert (facts["count"], facts["closed"], facts["passes"]["least"]) == (2, 0, 1)


@pytest.mark.parametrize(
    ("mesh", "pattern", "said"),
    [
        ("shape:cube", "3/1", "in all, 8 vertices have an odd valence"),
        ("shape:octahedron", "3/1", "in all, 8 faces have an odd number of sides"),
        (
            "shape:icosahedron",
            "3/1",
            "12 vertices have an odd valence and 20 faces have an odd num",
        ),
    ],
)
def test_obstructions_count_only_what_there_is(mesh, pattern, said) -> None:
    with pytest.raises(CannotMakeError) as error:
        make_job(Settings(mesh, size_mm=300.0, pattern=pattern))
    assert said in str(error.value)
    assert " 0 vertices" not in str(error.value)
    assert " 0 faces" not in str(error.value)
