"""Twills that keep rotations: groups that are known, and weaves that have them."""

import numpy as np
import pytest
from weaving_meshes import walked

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import catmull_clark
from fabweave.weave.bunches import part_bunches
from fabweave.weave.symmetry import find_weave_symmetry
from fabweave.weave.threads import thread_labels, trace_threads
from fabweave.weave.twill.weaving import TwillSearch, rotation_ties
from fabweave.weave.weave_pattern import WeaveResult, weave_pattern

CUBE = parse_shape("shape:cube")


def symmetric(mesh: PolyMesh, least: int) -> tuple[WeaveResult, int]:
    """Weave a mesh in a twill that keeps rotations, and count those that it has."""
    halfedges, threads = walked(mesh)
    result = weave_pattern(
        "twill", halfedges, threads, part_bunches(threads), thread_labels(threads.n_threads),
        how=TwillSearch(ties=rotation_ties(mesh, halfedges, threads, least), effort="quick"),
    )  # fmt: skip
    return result, find_weave_symmetry(mesh, halfedges, result.weave).group.n_rotations


@pytest.mark.parametrize(
    ("least", "orders"),
    [
        # The subgroups of the rotations of the cube, up to conjugation: of two, about a face or
        # an edge; of three; of four, a ring and two of half-turns; of six; of eight; of twelve.
        (1, [1]),
        (2, [2, 2, 3]),
        (3, [3, 4, 4, 4]),
        (4, [4, 4, 4, 6]),
        (5, [6, 8, 12]),
        (7, [8, 12]),
        (9, [12]),
        (13, [24]),
        (24, [24]),
    ],
)
def test_the_smallest_groups_of_a_cube_are_known(least, orders) -> None:
    halfedges, threads = walked(CUBE)
    ties = rotation_ties(CUBE, halfedges, threads, least)
    assert [tie.order for tie in ties] == orders
    for tie in ties:
        # Each orbit's size divides the order of its group.
        assert np.all(tie.order % np.bincount(tie.orbit) == 0)


def test_a_mesh_keeps_no_more_rotations_than_it_has() -> None:
    halfedges = build_halfedges(CUBE)
    with pytest.raises(CannotMakeError, match="to keep 25 rotations, but the mesh has only 24"):
        rotation_ties(CUBE, halfedges, trace_threads(halfedges), 25)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("least", "broken"),
    # After one step 16 broken conditions are the least there is, symmetric or not. With all
    # rotations, every edge condition breaks: the crossings of an orbit of 24 are twisted alike.
    [(2, 16), (4, 16), (8, 32), (24, 96)],
)
def test_a_cube_after_a_step_keeps_its_rotations(least, broken) -> None:
    result, kept = symmetric(catmull_clark(CUBE), least)
    assert kept >= least
    assert result.weave.broken.total == broken
    assert result.twill is not None
    assert result.twill.kept is not None
    assert result.twill.kept.free.total == 16


@pytest.mark.slow
@pytest.mark.parametrize(("least", "most"), [(2, 24), (24, 24), (48, 48)])
def test_a_torus_keeps_half_its_rotations_exactly_and_not_all(least, most) -> None:
    result, kept = symmetric(parse_shape("shape:torus?m=24&n=12"), least)
    assert result.weave.exact == (least <= 24)
    assert least <= kept <= most
