"""Make quads from the skeleton of a surface: limbs become tubes, with rings around them."""

from collections.abc import Iterator

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, Progress, no_progress, unit
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import name_place
from fabweave.mesh.one_rings import find_irregular, irregular_note, sum_at
from fabweave.mesh.polymesh import (
    PolyMesh,
    corner_sines,
    face_normals,
    face_of_corner,
    without_loose,
)
from fabweave.mesh.remesh.chords import lengthened, pillowed, thinned, wide_part
from fabweave.mesh.remesh.engines import (
    EXTRUSION,
    QSLIM,
    SKELETON,
    AttemptFailedError,
    Run,
    run_engine,
)
from fabweave.mesh.remesh.fit import Model, fit, model_of
from fabweave.mesh.remesh.remeshed import Remeshed, check_remeshed, cut_surface, ready_source
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.skeleton import Skeleton, measured, pruned, rerouted, resampled
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import surface_area

#: Triangles that the skeleton is made from: more of them take much longer, and add little.
_ENOUGH = 2000
#: A limb of four quads around with a smaller radius (mm) has ribbons of less than some 5 mm.
_LEAST_RADIUS_MM = 4.0
#: Rounds of growing from the skeleton, and after each change.
_GROW, _REGROW = 25, 6
#: A sample draws a vertex whose normal has at least this cosine with its own.
_ALIKE = 0.3
#: Few samples are less than this share of the usual. How strongly what is in a pleat rises out of
#: it, at first and where that spoils the surface.
_FEW, _RISES = 0.3, (0.2, 0.0)
#: Rounds of fitting at the end, and how even vertices stand.
_FIT, _EVEN = 3, 3.0
#: A corner is flat where the sine of its angle is below this; rounds of mending it.
_FLAT, _UNFOLDINGS = 0.25, 30
#: At most so many rings are put around wide parts.
_MOST_RINGS = 8


def remesh_tubes(mesh: PolyMesh, n_quads: int, *, progress: Progress = no_progress) -> Remeshed:
    """Turn a mesh into quads that run along its limbs and around them.

    1. The skeleton of the surface is found (local separators). Branches that are bumps, or too
       thin for ribbons, are left out; rings are placed about two radii apart.
    2. Quads are extruded along it, and grow to the surface. At a boundary the tube is opened.
    3. Rows of quads are taken out where they are too narrow, rings are put around what is too
       wide, and rows are split where they are too long, until faces have the size wanted.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_quads : int
        About how many quads.
    progress : callable

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If PyGEL is not installed, or nothing sound came of it; the message says why.

    References
    ----------
    Bærentzen, Rotenberg, "Skeletonization via local separators", ACM TOG 40(5), 2021. Pandey,
    Bærentzen, Singh, "Face extrusion quad meshes", SIGGRAPH 2022.
    """
    checked_count("tubes", n_quads)
    if not SKELETON.installed:
        raise CannotMakeError(
            "--remesh tubes needs PyGEL, which is not installed; install it with: pip install "
            "'fabweave[tubes]', or write --remesh quads"
        )
    source, notes = ready_source(mesh)
    model, side = model_of(source, n_quads), float(np.sqrt(surface_area(source) / n_quads))
    try:
        progress("finding the skeleton", 0, 2)
        bones, small = _skeleton(source, model, side)
        progress("laying tubes around the skeleton", 1, 2)
        graph = PolyMesh.from_faces(bones.places, bones.edges)
        tubes = run_engine(EXTRUSION, graph, Run(0, 0, rim=False), radii=bones.radii)
    except AttemptFailedError as error:
        raise _failed(str(error)) from error
    found = None
    faults: tuple[str, ...] = ()
    for made in _sized(model, tubes, source, n_quads, side):
        faults = check_remeshed(source, made)
        clashes = len(self_intersections(made))
        if not faults and (found is None or clashes < found[0]):
            found = clashes, made
        if found is not None and not found[0]:
            break
    told = []
    if small:
        where = few_of(sorted({name_place(place, source) for place in small}), 5)
        told.append(
            agree(len(small), "{n} [branch is|branches are] too small for ribbons and [is|are] ")
            + f"left out ({where}); more quads, and a larger size, would keep more"
        )
    if found is None:
        raise _failed("; ".join([*faults, *told]))
    made = found[1]
    notes.append(
        f"PyGEL found a skeleton with {agree(bones.n_tips, '{n} tip[|s]')}; tubes around it have "
        f"{made.n_faces} quads ({n_quads} were wanted)"
    )
    notes += told
    irregular = find_irregular(made)
    return Remeshed(made, "tubes", (*notes, irregular_note(irregular)), irregular)


def _failed(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"no tubes could be laid around the skeleton of the mesh: {why}. What may help: another "
        "number of quads; --remesh quads or --remesh triangles; or --bodies wrap, if the mesh runs "
        "through itself"
    )


def _skeleton(source: PolyMesh, model: Model, side: float) -> tuple[Skeleton, list[FloatArray]]:
    """Return where rings are to stand, and the tips of branches that are too small."""
    surface = cut_surface(source)
    fewer = surface
    if surface.n_faces > _ENOUGH:
        fewer = run_engine(QSLIM, surface, Run(_ENOUGH, 0, rim=False))
    bones = measured(run_engine(SKELETON, fewer, Run(0, 0, rim=False)), surface)
    bones, small = pruned(rerouted(bones, model.surface), _LEAST_RADIUS_MM, side)
    return resampled(bones), small


def grown(model: Model, mesh: PolyMesh, rounds: int, rise: float) -> PolyMesh:
    """Let a mesh grow smoothly from inside a model to it.

    Each round draws each vertex to the samples that are nearest to it, of those that look its way,
    and to the middle of its neighbours.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
    rounds : int
    rise : float
        How strongly what is in a pleat between limbs rises out of it.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> ball = grown(model_of(sphere(24, 50.0), 98), sphere(4, 20.0), 8, 0.0)
    >>> bool(np.linalg.norm(ball.vertices, axis=1).min() > 45)
    True
    """
    count, half = mesh.n_vertices, build_halfedges(mesh)
    near = sparse.csr_array((np.ones(half.n_halfedges), (half.tail, half.head)), (count, count))
    near = near.maximum(near.T)
    umbrella = sparse.diags_array(1 / near.sum(axis=1)) @ near - sparse.eye_array(count)
    smooth, face = umbrella.T @ umbrella, face_of_corner(mesh)
    for _ in range(rounds):
        normal = unit(sum_at(mesh.indices, face_normals(mesh)[face], count))
        nearest: IntArray = np.asarray(cKDTree(mesh.vertices).query(model.places)[1])
        alike = np.einsum("nd,nd->n", normal[nearest], model.normals) - _ALIKE
        samples = alike > 0
        if not samples.any():  # all is turned over, which is refused later
            break
        with_one = np.column_stack([model.places, np.ones(len(alike))])
        total = sum_at(nearest[samples], (alike[:, None] * with_one)[samples], count)
        # What few samples draw is in a pleat between limbs, and rises out of it.
        drawn = np.minimum(total[:, 3:] / (_FEW * total[:, 3].mean()), 1.0)
        middle = total[:, :3] / np.maximum(total[:, 3:], 1e-12)
        feet = model.surface.feet(mesh.vertices)
        inside = np.einsum("vd,vd->v", mesh.vertices - feet.points, feet.normals) < 0
        risen = mesh.vertices + np.where(inside, feet.distances, 0.0)[:, None] * normal
        rising = rise * (1.0 - drawn)
        matrix = smooth + sparse.diags_array((drawn + rising)[:, 0])
        mesh = mesh.with_vertices(
            splu(sparse.csc_array(matrix)).solve(drawn * middle + rising * risen)
        )
    return mesh


def _opened(tubes: PolyMesh, source: PolyMesh) -> PolyMesh:
    """Leave out the faces of tubes around the vertex that is nearest to each boundary loop."""
    half = build_halfedges(source)
    rim = np.flatnonzero(half.twin < 0)
    _, loop = label_links(half.tail[rim], half.head[rim], source.n_vertices)
    gone = [
        np.linalg.norm(tubes.vertices - source.vertices[loop == name].mean(axis=0), axis=1).argmin()
        for name in np.unique(loop[half.tail[rim]])
    ]
    kept = ~np.isin(tubes.indices.reshape(-1, 4), gone).any(axis=1)
    return without_loose(PolyMesh.from_faces(tubes.vertices, tubes.indices.reshape(-1, 4)[kept]))


def _sized(
    model: Model, raw: PolyMesh, source: PolyMesh, n_quads: int, side: float
) -> Iterator[PolyMesh]:
    """Yield tubes whose faces are about as large as wanted, in the order of preference."""
    for rise in _RISES:
        tubes = _opened(grown(model, raw, _GROW, rise), source)
        tubes = grown(model, thinned(tubes, side, n_quads), _REGROW, rise)
        wide = tubes
        for _ in range(_MOST_RINGS):
            part = wide_part(wide, side)
            ringed = None if part is None else pillowed(wide, part)
            if ringed is None:
                break
            wide = grown(model, ringed, _REGROW, rise)
        for one in (wide, tubes) if wide is not tubes else (tubes,):
            smooth = grown(model, lengthened(one, n_quads), _REGROW, rise)
            fitted = fit(model, smooth, _FIT, _EVEN)
            unfolded = _unfolded(model, fitted)
            worse = len(self_intersections(unfolded)) > len(self_intersections(fitted))
            yield fitted if worse else unfolded


def _unfolded(model: Model, mesh: PolyMesh) -> PolyMesh:
    """Move corners of quads that are nearly flat or turned in to the middle of their neighbours."""
    half, face = build_halfedges(mesh), face_of_corner(mesh)
    rim = np.zeros(mesh.n_vertices, dtype=bool)
    rim[mesh.indices[(half.twin < 0) | (half.twin[half.prev] < 0)]] = True
    for _ in range(_UNFOLDINGS):
        flat = corner_sines(mesh) < _FLAT
        if not flat.any():
            break
        moved = np.zeros(mesh.n_vertices, dtype=bool)
        moved[mesh.indices[np.isin(face, face[flat])]] = True
        moved &= ~rim
        total = sum_at(half.tail, mesh.vertices[half.head], mesh.n_vertices)
        number = np.bincount(half.tail, minlength=mesh.n_vertices)[:, None]
        middle = model.surface.feet(total / number).points
        mesh = mesh.with_vertices(
            np.where(moved[:, None], (mesh.vertices + middle) / 2, mesh.vertices)
        )
    return mesh
