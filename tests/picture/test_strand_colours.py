"""The two strands of a crossing differ in colour or tone, on every mesh, and change seldom."""

from functools import partial

import numpy as np
import pytest
from colour_vision import COLOUR_BLINDNESS, as_seen_with
from hypothesis import given
from hypothesis import strategies as st
from ring_meshes import ball, chain
from weaving_meshes import walked

from fabweave.core.colour_space import light_of, oklab_of
from fabweave.core.errors import InputError
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import loop
from fabweave.ribbon.project import following_rung
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave, strand_passes
from fabweave.weave.strand_colours import (
    crossing_colours,
    lean_shades,
    shade_strands,
    strand_colours,
)
from fabweave.weave.twill.rows import TWISTS, ring_rows

#: What differs at every crossing differs by no less, in OKLab, where 0.02 is just seen.
LEAST_DIFFERENCE = 0.06
#: Each of these has one to four threads, and they cross themselves.
FEW = ("torus?m=9&n=7", "torus?m=5&n=4", "sphere?n=4", "slit?genus=3", "hypar", "tube")
SHAPES = ("tetrahedron", "cube", "octahedron", "icosahedron", "dodecahedron", *FEW)


def woven(name, *, steps=0, turn=False, seed=None):
    mesh = parse_shape(f"shape:{name}")
    for _ in range(steps):
        mesh = loop(mesh)
    _, threads = walked(mesh, turn=turn)
    if seed is None:
        return plain_weave(threads)
    twist = np.random.default_rng(seed).random(threads.n_crossings) < 0.5
    return Weave(threads, "random", twist, over_of_passes(threads, twist))


def least_difference(weave, strands, seen=lambda light: light):
    """Compare the strand below, on both sides of the one above, with the one above."""
    lab = oklab_of(seen(light_of(crossing_colours(weave, strands))))
    away = np.linalg.norm(lab[:, 0, :, None] - lab[:, 1, None, :], axis=-1)
    return float(away.min(initial=np.inf))


def naive_least(weave, strands):
    """Compare the strands of each crossing one after another."""
    least = np.inf
    for crossing in range(weave.threads.n_crossings):
        one, other = np.flatnonzero(weave.threads.crossing == crossing)
        for a in strands[one]:
            for b in strands[other]:
                away = np.linalg.norm(oklab_of(light_of(a)) - oklab_of(light_of(b)))
                least = min(least, float(away))
    return least


def flows(weave, strands):
    """Whether each pass leaves in the colour in which the next one comes."""
    threads = weave.threads
    following = following_rung(threads.offsets, threads.closed)
    here = np.flatnonzero(following >= 0)
    return np.array_equal(strands[here, 1], strands[following[here], 0])


def alike(weave, shades):
    """Whether the strands of each crossing have one shade somewhere, (X,)."""
    by_crossing = crossing_colours(weave, np.repeat(shades[..., None], 3, axis=2))[..., 0]
    below, above = by_crossing[:, 0], by_crossing[:, 1]
    return np.any(below[:, :, None] == above[:, None, :], axis=(1, 2))


@pytest.mark.parametrize("strategy", ["safe", "direction"])
@pytest.mark.parametrize("name", SHAPES)
def test_the_strands_of_every_crossing_differ(name, strategy):
    weave = woven(name)
    strands = strand_colours(weave, part_bunches(weave.threads), strategy)
    assert least_difference(weave, strands) >= LEAST_DIFFERENCE
    assert flows(weave, strands)
    changes = np.any(strands[:, 0] != strands[:, 1], axis=1)
    assert not np.any(changes & weave.over)
    # The same measure objects when one strand has the colour of the one that it crosses.
    spoiled = strands.copy()
    pair = np.flatnonzero(weave.threads.crossing == 0)
    spoiled[pair[0], 1] = spoiled[pair[1], 0]
    assert least_difference(weave, spoiled) < 1e-9


@pytest.mark.parametrize(
    ("mesh", "turns"),
    [
        (parse_shape("shape:torus?m=6&n=4"), 0),
        # Strands turn at the tip and at the bottom only.
        (ball(7, 6), 2 * 7),
        (chain([(2, 4)]), None),
    ],
)
def test_strands_of_rings_have_two_colours_by_the_way_they_lean(mesh, turns):
    halfedges, threads = walked(mesh)
    rows = ring_rows(halfedges)[halfedges.edge[threads.crossing_halfedge]]
    weave = Weave(threads, "twill", TWISTS[rows], over_of_passes(threads, TWISTS[rows]))
    shades = lean_shades(weave, rows)
    assert np.unique(shades).tolist() == [0, 1]
    assert flows(weave, shades)
    changes = shades[:, 0] != shades[:, 1]
    assert not np.any(changes & weave.over)
    if turns is not None:
        assert changes.sum() == turns
    # One of each two strands leans to the right, but where it is about to turn.
    same = alike(weave, shades)
    at_turns = np.unique(threads.crossing[changes])
    assert np.isin(np.flatnonzero(same), at_turns).all()
    # Rows that are none are seen: strands would turn again and again.
    wrong = lean_shades(weave, np.random.default_rng(1).permutation(rows))
    assert np.count_nonzero(wrong[:, 0] != wrong[:, 1]) > changes.sum()
    strands = strand_colours(weave, np.zeros(threads.n_threads, dtype=int), "direction", rows=rows)
    assert len(np.unique(strands.reshape(-1, 3), axis=0)) == 2


@pytest.mark.parametrize("name", ["hypar?m=2&n=3", "hypar?m=7&n=5", "hypar?m=9&n=4"])
@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_mesh_of_one_thread_shows_its_weave(name, seed):
    weave = woven(name, turn=True, seed=seed)
    assert weave.threads.n_threads == 1
    strands = strand_colours(weave, np.zeros(1, dtype=int), "safe")
    assert naive_least(weave, strands) >= LEAST_DIFFERENCE
    assert flows(weave, strands)


@given(st.sampled_from(SHAPES), st.integers(0, 2**32 - 1), st.booleans(), st.integers(1, 3))
def test_they_differ_whoever_is_on_top(name, seed, turn, n_groups):
    try:
        weave = woven(name, turn=turn, seed=seed)
    except InputError:
        return
    groups = np.arange(weave.threads.n_threads) % n_groups
    own = groups[weave.threads.thread_of_pass][strand_passes(weave)]
    same = own[:, 0] == own[:, 1]
    shades = shade_strands(weave, groups=groups)
    assert not np.any(alike(weave, shades) & same)
    assert flows(weave, shades[..., None])
    assert shades.max() + 1 <= (24 if same.any() else 1)
    strands = strand_colours(weave, np.zeros(weave.threads.n_threads, dtype=int), "direction")
    assert np.isclose(least_difference(weave, strands), naive_least(weave, strands))


@pytest.mark.parametrize("view", COLOUR_BLINDNESS)
@pytest.mark.parametrize("name", FEW)
def test_to_the_colour_blind_they_differ_too(name, view):
    weave = woven(name)
    strands = strand_colours(weave, part_bunches(weave.threads), "safe")
    seen = partial(as_seen_with, blindness=view)
    assert least_difference(weave, strands, seen) >= LEAST_DIFFERENCE


@pytest.mark.parametrize(("m", "n"), [(9, 7), (12, 8), (5, 5), (8, 3)])
def test_a_grid_on_a_torus_has_warp_and_weft_as_far_as_they_close_up(m, n):
    """On a grid without irregular vertices two directions suffice where both sides are even."""
    weave = woven(f"torus?m={m}&n={n}")
    shades = shade_strands(weave)
    if m % 2 == n % 2 == 0:
        assert shades.max() + 1 == 2
        assert np.all(shades[:, 0] == shades[:, 1])
    assert shades.max() + 1 <= 4


def test_pieces_have_one_colour_each_and_neighbours_others():
    weave = woven("torus?m=9&n=7")
    threads = weave.threads
    breaks = np.zeros(len(threads.crossing), dtype=bool)
    below = np.flatnonzero(~weave.over)
    breaks[below[::4]] = True
    bunches = part_bunches(threads)
    strands = strand_colours(weave, bunches, "piece", breaks=breaks)
    changes = np.any(strands[:, 0] != strands[:, 1], axis=1)
    assert np.array_equal(changes, breaks)
    assert least_difference(weave, strands) >= LEAST_DIFFERENCE
    # Safe colours change there only, too, but not everywhere.
    safe = strand_colours(weave, bunches, "safe", breaks=breaks)
    seldom = np.any(safe[:, 0] != safe[:, 1], axis=1)
    assert not np.any(seldom & ~breaks)
    with pytest.raises(InputError, match="where no pieces are cut"):
        strand_colours(weave, bunches, "piece")


@pytest.mark.parametrize(("name", "steps"), [("icosahedron", 2), ("sphere", 0)])
def test_a_material_has_three_tones_and_few_crossings_are_alike(name, steps):
    weave = woven(name, steps=steps)
    one = np.zeros(weave.threads.n_threads, dtype=int)
    strands = strand_colours(weave, one, materials=np.full((len(one), 3), 128, dtype=np.uint8))
    tones = np.unique(strands.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 2)
    assert tones.max() == 2
    assert alike(weave, tones).mean() < 0.1
    changes = tones[:, 0] != tones[:, 1]
    assert changes.mean() <= 0.25
    assert not np.any(changes & weave.over)


def test_a_material_that_crosses_others_only_has_its_very_colour():
    weave = woven("torus?m=8&n=6")
    bunches = part_bunches(weave.threads)
    assert bunches.max() == 1
    navy_gold = np.array([[0, 0, 128], [255, 215, 0]], dtype=np.uint8)
    strands = strand_colours(weave, bunches, materials=navy_gold[bunches])
    assert np.array_equal(
        strands, np.repeat(navy_gold[bunches][weave.threads.thread_of_pass, None], 2, axis=1)
    )
