"""Threads that rotations carry onto one another are cut alike, into as few kinds as can be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid
from slow import slow_but

from fabweave.core.errors import CannotMakeError
from fabweave.job.ask import brief_of
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar, tube
from fabweave.options.settings import settings_from_options
from fabweave.piece.congruence import compare_pieces
from fabweave.piece.development import Runs
from fabweave.piece.joined_object import split_object
from fabweave.piece.pieces import joined_pieces
from fabweave.piece.split.candidates import Bed, list_candidates
from fabweave.piece.split.repeats import Repeats, find_repeats
from fabweave.piece.split.split_plan import object_repeats
from fabweave.piece.split.splitting import choose_runs
from fabweave.weave.pattern import plain_weave
from fabweave.weave.symmetry import WeaveSymmetry, find_weave_symmetry
from fabweave.weave.threads import trace_threads


def found(mesh: PolyMesh) -> tuple[WeaveSymmetry, Repeats]:
    halfedges = build_halfedges(mesh)
    symmetry = find_weave_symmetry(mesh, halfedges, plain_weave(trace_threads(halfedges)))
    return symmetry, find_repeats(symmetry)


def images_of(symmetry: WeaveSymmetry, thread: int, first: int, last: int) -> set[tuple[int, ...]]:
    """Return the images of a run as sets of passes: where rotations take each of its passes."""
    walks = symmetry.weave.threads
    count = int(walks.lengths[thread])
    passes = walks.offsets[thread] + np.arange(first, last + 1) % count
    usable = symmetry.group.proper & ~symmetry.group.reverses
    return {tuple(sorted(row)) for row in symmetry.pass_images(passes)[usable].tolist()}


def runs_of(*rows: tuple[int, int, int]) -> Runs:
    return Runs(*(np.array(column) for column in zip(*rows, strict=True)))


@pytest.mark.parametrize(
    "mesh",
    [
        parse_shape("shape:octahedron"),
        parse_shape("shape:torus?m=6&n=4"),
        parse_shape("shape:dodecahedron"),
        tube(5, 3, 1.0, 2.0),
        hypar(4, 4, 1.0, 0.5),
    ],
    ids=["octahedron", "torus", "dodecahedron", "tube", "hypar"],
)
@given(data=st.data())
def test_two_runs_are_of_one_class_where_a_rotation_takes_one_to_the_other(mesh, data):
    symmetry, repeats = found(mesh)
    walks = symmetry.weave.threads
    rows = []
    for _ in range(2):
        thread = data.draw(st.sampled_from(np.flatnonzero(walks.lengths).tolist()))
        count = int(walks.lengths[thread])
        first = data.draw(st.integers(0, count - 1))
        most = count - 2 if walks.closed[thread] else count - 1 - first
        rows.append((thread, first, first + data.draw(st.integers(0, max(min(most, 5), 0)))))
    one, other = repeats.classes(runs_of(*rows)).tolist()
    there = images_of(symmetry, *rows[0])
    target = next(iter(images_of(symmetry, *rows[1]) & there), None)
    assert (one == other) == (target is not None)


def test_rotations_that_change_the_supply_do_not_count():
    symmetry, repeats = found(parse_shape("shape:octahedron"))
    assert repeats.repeat
    supply = np.array([0, 0, 0, 1])
    apart = find_repeats(symmetry, supply)
    assert apart.leader.tolist() == [0, 0, 0, 3]
    with_all = find_repeats(symmetry, np.zeros(4, dtype=np.int64))
    assert with_all.leader.tolist() == repeats.leader.tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "kinds"),
    slow_but(
        [
            ("shape:torus?m=8&n=4", "auto"),
            ("shape:octahedron", "fewest"),
            ("shape:hypar?m=5&n=5", "auto"),
            ("shape:tube?m=7&n=5", "fewest"),
            ("shape:hemisphere", "auto"),
            ("shape:bipyramid?n=5", "fewest"),
        ],
        1, 2,
    ),
)  # fmt: skip
def test_threads_that_repeat_one_another_are_cut_alike_from_end_to_end(shape, kinds):
    woven, settings, supplies = laid(
        settings_from_options(shape, size="300mm", kinds=kinds, max_length="300mm")
    )
    plan = split_object(woven, brief_of(settings, supplies)).plan
    repeats = object_repeats(woven, settings.pieces, supplies)
    assert repeats is not None
    walks, runs = woven.weave.threads, plan.runs
    classes: dict[int, list] = {}
    for thread in np.flatnonzero(walks.lengths).tolist():
        own = runs.thread == thread
        first, last = runs.first[own], runs.last[own]
        assert np.array_equal(first[1:], last[:-1])
        if walks.closed[thread]:
            assert last[-1] == first[0] + walks.lengths[thread]
        else:
            assert (first[0], last[-1]) == (0, walks.lengths[thread] - 1)
        kind = sorted(map(tuple, repeats.classes(Runs(runs.thread[own], first, last)).tolist()))
        assert classes.setdefault(int(repeats.leader[thread]), kind) == kind


@pytest.mark.parametrize("most_mm", [300.0, 700.0])
def test_what_fits_in_one_repeat_of_a_ring_only_is_cut_in_none(most_mm):
    """Where a piece lies decides whether it fits, as rounding may: the search comes to an end."""
    woven, settings, supplies = laid(settings_from_options("shape:octahedron", size="300mm"))
    repeats = object_repeats(woven, settings.pieces, supplies)
    assert repeats is not None
    assert repeats.period.tolist() == [2] * 4
    asked = []

    def fits(outline):
        asked.append(float(outline[:, 0].mean()))
        assert len(asked) < 1000
        return asked[-1] < most_mm

    def cut():
        candidates = list_candidates(woven.ribbons, woven.weave, Bed(fits), 300.0, np.arange(4))
        return choose_runs(
            candidates, woven.weave, Bed(fits), woven.labels, 300.0, 300.0, None,
            repeats=repeats, kind_price=4.0,
        )  # fmt: skip

    if most_mm > 500.0:
        assert len(cut().thread) == 12
        assert max(asked) < most_mm
    else:
        with pytest.raises(CannotMakeError):
            cut()
        assert max(asked) > most_mm


def pieces_of(mesh: str, **options: str) -> tuple[int, int, int]:
    """Return how many pieces and kinds a job has, and how many classes of runs."""
    asked = settings_from_options(mesh, size="400mm", sheet="600x400mm", **options)
    woven, settings, supplies = laid(asked)
    joined = split_object(woven, brief_of(settings, supplies))
    pieces = joined_pieces(joined, brief_of(settings, supplies)).pieces
    repeats = object_repeats(woven, settings.pieces, supplies)
    classes = len(pieces)
    if repeats is not None:
        classes = len(np.unique(repeats.classes(joined.plan.runs), axis=0))
    return len(pieces), int(compare_pieces(pieces).number.max()), classes


@pytest.mark.parametrize(
    ("mesh", "options", "most"),
    [
        ("shape:torus?m=16&n=8", {"holes": "alike"}, 4),
        pytest.param(
            "shape:torus?m=24&n=12",
            {"pattern": "twill", "holes": "alike"},
            8,
            marks=pytest.mark.slow,
        ),
        pytest.param("shape:sphere", {"holes": "alike"}, 8, marks=pytest.mark.slow),
        pytest.param(
            "shape:octahedron",
            {"refine": "catmull-clark:2", "holes": "alike"},
            4,
            marks=pytest.mark.slow,
        ),
        *(
            pytest.param(
                "shape:icosahedron", {"refine": "catmull-clark:2", **fewer}, most,
                marks=pytest.mark.slow,
            )
            for fewer, most in (({"kinds": "fewest"}, 2), ({"holes": "alike"}, 4))
        ),
    ],
)  # fmt: skip
def test_symmetric_objects_are_cut_from_a_handful_of_shapes(mesh, options, most):
    pieces, kinds, classes = pieces_of(mesh, **options)
    assert kinds == classes <= most
    many = pieces_of(mesh, **{**options, "kinds": "any"})
    assert many[1] > 2 * kinds
    assert pieces <= 1.05 * many[0] or options.get("kinds") == "fewest"
