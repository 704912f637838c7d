"""Words agree with their number, in the sentences that a user meets."""

import re

import pytest
from hypothesis import given
from jobs import make_job
from strategies import broken_meshes

from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.options.settings import Settings

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
    ("mesh", "options"),
    [
        ("shape:hypar?m=2&n=1", {}),
        ("shape:hypar?m=2&n=2", {"pattern": "3/1"}),
        ("shape:tube?m=4&n=2", {"pattern": "triaxial"}),
        ("shape:torus?m=5&n=3", {"pattern": "2/1"}),
        ("shape:octahedron", {"pattern": "twill"}),
        # Of a tetrahedron without two faces, two threads cross on the edge that is left.
        ("shape:tetrahedron", {"leave_out": "0,1"}),
    ],
)
def test_notes_of_small_jobs_agree_with_their_numbers(mesh, options) -> None:
    job = make_job(Settings.of(mesh, size_mm=300.0, effort="quick", force=True, **options))
    notes = "\n".join(job.notes)
    assert not WRONG.search(notes), notes


@given(broken_meshes())
def test_problems_of_any_mesh_agree_with_their_numbers(mesh) -> None:
    for finding in check_mesh(mesh).findings:
        assert not WRONG.search(finding.text), finding.text


def test_what_crosses_nothing_is_no_warp() -> None:
    # Of 12 threads on a square of 3 x 3 quads, four cut a corner: 4 + 4 are warp and weft.
    job = make_job(Settings.of("shape:hypar?m=3&n=3", size_mm=300.0, pattern="3/1", effort="quick"))
    threads = job.weave.threads
    crossing = int((threads.lengths > 0).sum())
    said = next(int(note.split("exact; ")[1].split()[0]) for note in job.notes if "warp" in note)
    assert 2 * said == crossing < threads.n_threads
