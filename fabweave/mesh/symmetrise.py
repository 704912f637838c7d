"""Make a mesh exactly symmetric that is so but for noise."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.automorphisms import EXACT, Symmetry, best_motions, find_symmetry
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.upright import largest_dimension

#: Noise is looked for up to these shares of the mesh's largest dimension, the least first.
_NOISE = (EXACT, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 2e-2)
#: Motions and places are fitted to one another until no place moves by more than this share.
_SETTLED, _MOST_ROUNDS = 1e-13, 100


@frozen_value
class Symmetrised:
    """A mesh that was made symmetric.

    Parameters
    ----------
    mesh : PolyMesh
    symmetry : Symmetry
        The motions that it was made for.
    moved : (V,) float array
        How far each vertex was moved, in the unit of the mesh.
    """

    mesh: PolyMesh
    symmetry: Symmetry
    moved: FloatArray

    @property
    def note(self) -> str:
        """What was done, in words."""
        group = self.symmetry
        kinds = [agree(group.n_rotations, "{n} [rotation|rotations]")]
        if group.n_reflections:
            kinds.append(agree(group.n_reflections, "{n} [reflection|reflections]"))
        return (
            f"symmetrised: {' and '.join(kinds)} map the mesh onto itself; for that, vertices "
            f"were moved by {self.moved.mean():.3g} mm in the mean and {self.moved.max():.3g} mm "
            "at most"
        )


def symmetrise(mesh: PolyMesh, noise: Sequence[float] = _NOISE) -> Symmetrised:
    """Move the vertices of a mesh as little as need be, so that it is exactly symmetric.

    The largest group of motions is taken that maps the faces onto one another and corners to
    within the most noise; of two of one order, that of the lesser noise. Each vertex then gets to
    the mean of where all motions would have it.

    Parameters
    ----------
    mesh : PolyMesh
        In millimetres.
    noise : sequence of float
        How far corners may be off, as shares of the mesh's size, rising.

    Raises
    ------
    CannotMakeError
        If no motion maps it onto itself.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> noise = np.random.default_rng(1).normal(scale=0.001, size=(8, 3))
    >>> rough = cube().with_vertices(cube().vertices + noise)
    >>> made = symmetrise(rough)
    >>> made.symmetry.n_rotations, made.symmetry.n_reflections, bool(made.moved.max() < 0.004)
    (24, 24, True)
    >>> find_symmetry(made.mesh, build_halfedges(made.mesh)).order
    48
    """
    halfedges = build_halfedges(mesh)
    groups = [find_symmetry(mesh, halfedges, tolerance=share) for share in noise]
    group = max(groups, key=lambda one: one.order)  # the first of the largest
    if group.order == 1:
        raise CannotMakeError(
            "no rotation or reflection maps the mesh onto itself, to within "
            f"{noise[-1]:.0%} of its size and face on face; leave out --symmetrise, or remesh it "
            "(--remesh keeps the mirror symmetry of a model)"
        )
    images = vertex_images(group, halfedges, mesh.n_vertices)
    size, places = largest_dimension(mesh), mesh.vertices - group.centre
    used = np.unique(halfedges.tail)
    for _ in range(_MOST_ROUNDS):
        matrix = best_motions(places[used], places[images[:, used]], ~group.proper)
        # Where a motion takes a vertex, seen from before the motion: x M as a row is M^T x.
        settled = np.mean(places[images] @ matrix, axis=0)
        settled[used] -= settled[used].mean(axis=0) - places[used].mean(axis=0)
        change = float(np.abs(settled - places).max())
        places = settled
        if change <= _SETTLED * size:
            break
    vertices = places + group.centre
    moved = np.linalg.norm(vertices - mesh.vertices, axis=1)
    return Symmetrised(mesh.with_vertices(vertices), group, moved)


def vertex_images(group: Symmetry, halfedges: Halfedges, n_vertices: int) -> IntArray:
    """Return where every motion takes each vertex, (G, V); those of no face stay."""
    images = np.tile(np.arange(n_vertices), (group.order, 1))
    count = halfedges.n_halfedges
    _, first = np.unique(halfedges.tail, return_index=True)
    there = group.images(np.arange(count)[first])
    head = halfedges.tail[halfedges.next]
    # A motion that reverses the surface lets the image run the other way.
    taken = np.where(group.reverses[:, None], head[there], halfedges.tail[there])
    images[:, halfedges.tail[first]] = taken
    return images
