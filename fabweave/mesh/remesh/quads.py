"""Turn a mesh of triangles into a mesh of quads."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.irregular import Irregular, find_irregular, irregular_note
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.remesh.engines import ENGINES, Engine
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.remesh.runs import best_run
from fabweave.mesh.triangulate import triangulate
from fabweave.mesh.weld import weld_mesh

#: Bounds of what may be asked for.
LEAST_QUADS, MOST_QUADS = 6, 100_000
#: Quads to aim at by default: half as many as triangles, but no more than a person can weave.
_DEFAULT_MOST = 3000
#: Quads that pairing gives are "about" the number asked for up to this factor either way.
_ABOUT = 2.0
#: Of a paired mesh, at most this share of the faces may be other than quads.
_STRAY = 1 / 8


@dataclass(frozen=True)
class Remesh:
    """What ``--remesh`` asks for.

    Parameters
    ----------
    n_quads : int or None
        About how many quads; None leaves it to fabweave.
    """

    n_quads: int | None = None


@frozen_value
class Remeshed:
    """A mesh of quads, and how it came about.

    Parameters
    ----------
    mesh : PolyMesh
        The quads; some other faces may have stayed if it was paired, and a note says so.
    method : str
        ``unchanged``, ``pairing``, or the name of the remesher.
    notes : tuple of str
        What a person should know.
    irregular : Irregular
        The irregular vertices that remain.
    """

    mesh: PolyMesh
    method: str
    notes: tuple[str, ...]
    irregular: Irregular


def parse_remesh(text: str) -> Remesh:
    """Read what ``--remesh`` asks for: ``quads`` or ``quads:3000``.

    Raises
    ------
    InputError
        If it reads otherwise.

    Examples
    --------
    >>> parse_remesh("quads:3000"), parse_remesh("quads")
    (Remesh(n_quads=3000), Remesh(n_quads=None))
    """
    kind, colon, number = text.strip().partition(":")
    if kind != "quads":
        raise InputError(
            f"--remesh {text[:40]!r} is not known; write quads, or quads:3000 for about 3000 quads"
        )
    if not colon:
        return Remesh()
    if not (number.isascii() and number.isdigit()):
        raise InputError(
            f"--remesh {text[:40]!r}: after the colon there must be a whole number of quads, such "
            "as quads:3000"
        )
    return Remesh(_checked_count(int(number[:12])))


def _checked_count(n_quads: int) -> int:
    if not LEAST_QUADS <= n_quads <= MOST_QUADS:
        raise InputError(
            f"remeshing makes from {LEAST_QUADS} to {MOST_QUADS} quads, but {n_quads} were asked "
            "for; to get more, refine the result"
        )
    return n_quads


def remesh_quads(
    mesh: PolyMesh,
    n_quads: int | None,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
    engines: Sequence[Engine] = ENGINES,
) -> Remeshed:
    """Turn a mesh into quads.

    1. Vertices at the same place are joined, and faces are turned to agree.
    2. A mesh whose triangles are split quads gets them back by pairing, and keeps its vertices,
       if the count is left open or they are about as many as asked for (up to factor 2).
    3. Else remeshers lay a new mesh of quads over the surface: QuadriFlow, or where that fails
       Instant Meshes, each a few times; of the results that pass `check_remeshed` the one with
       the fewest irregular vertices is taken.
    4. Where no result passes, triangles that pair up completely are taken even if they do not
       look like split quads.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres (the notes say so of positions).
    n_quads : int or None
        About how many quads; None for those that pairing gives, or else half as many as
        triangles, at most 3000.
    seed : int
        The first seed of the remesher.
    progress : callable
        Told about each run.
    engines : sequence of Engine
        The remeshers in the order of preference.

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If nothing gave a mesh of quads; the message says why each attempt failed.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> remeshed = remesh_quads(triangulate(torus(12, 8, 35.0, 15.0)), None)
    >>> remeshed.method, remeshed.mesh.n_faces, len(remeshed.irregular)
    ('pairing', 96, 0)

    References
    ----------
    Huang, Zhou, Nießner, Shewchuk, Guibas, "QuadriFlow: a scalable and robust method for
    quadrangulation", Computer Graphics Forum 37(5), 2018. Jakob, Tarini, Panozzo,
    Sorkine-Hornung, "Instant field-aligned meshes", ACM TOG 34(6), 2015.
    """
    if n_quads is not None:
        _checked_count(n_quads)
    source, notes = _ready(mesh)
    pairing = pair_triangles(source)
    paired = merge_pairs(source, pairing)
    if (pairing.split or _mostly_quads(source)) and _mostly_quads(paired):
        if _about(paired.n_faces, n_quads):
            return _from_pairing(source, paired, notes)
        notes.append(
            f"the triangles pair up into {paired.n_faces} quads with {len(find_irregular(paired))} "
            f"irregular vertices, but about {n_quads} quads were asked for; --remesh quads keeps "
            "the pairs"
        )
    surface = triangulate(source)
    wanted = n_quads or min(max(LEAST_QUADS, surface.n_faces // 2), _DEFAULT_MOST)
    if n_quads is None:
        notes.append(f"no number of quads was given, so about {wanted} were aimed for")
    failures: list[str] = []
    for engine in engines:
        if not engine.installed:
            failures.append(
                f"{engine.title}: it is not installed "
                '(pip install "fabweave[quad]", where there is a wheel for your machine)'
            )
            continue
        best, failed = best_run(engine, source, surface, wanted, seed=seed, progress=progress)
        failures += failed
        if best is not None:
            notes += [f"another attempt failed: {text}" for text in failures]
            return _finished(best.mesh, engine.name, [*notes, best.note])
    return _last_resort(source, n_quads, notes, failures)


def _ready(mesh: PolyMesh) -> tuple[PolyMesh, list[str]]:
    """Join vertices and orient faces; say what was done."""
    if check_mesh(mesh).codes & {"index-range", "small-face"} or not mesh.n_faces:
        prepare_mesh(mesh)  # says what is wrong
    welded, joined, dropped = weld_mesh(mesh)
    notes: list[str] = []
    source = mesh
    # Bodies that only touch are better left apart than joined to something that cannot be woven.
    if joined and (not check_mesh(welded).fatal or check_mesh(mesh).fatal):
        source = welded
        notes.append(
            agree(
                joined,
                "{n} [vertex was|vertices were] at the same place as another vertex and merged "
                "with it",
            )
            + (agree(dropped, "; {n} [face|faces] vanished as a result") if dropped else "")
        )
    source, _, repairs = prepare_mesh(source)
    return source, [*notes, *repairs]


def _mostly_quads(mesh: PolyMesh) -> bool:
    return bool(np.mean(mesh.face_sizes != 4) <= _STRAY)


def _about(found: int, wanted: int | None) -> bool:
    return wanted is None or wanted / _ABOUT <= found <= wanted * _ABOUT


def _from_pairing(source: PolyMesh, paired: PolyMesh, notes: list[str]) -> Remeshed:
    """Describe a mesh that pairing gave."""
    merged = source.n_faces - paired.n_faces
    stray = np.flatnonzero(paired.face_sizes != 4)
    notes = list(notes)
    if merged:
        notes.append(
            f"{2 * merged} triangles were paired into {agree(merged, '{n} quad[|s]')}; "
            "every vertex stays where it was"
        )
    else:
        share = "nearly all faces are" if len(stray) else "all faces are"
        notes.append(f"{share} quads already, so the mesh was left as it is")
    if len(stray):
        some = few_of(stray.tolist(), 5)
        notes.append(
            agree(len(stray), "{n} [face is not a quad|faces are not quads] (face ")
            + f"{some}); one Catmull-Clark step turns all faces into quads"
        )
    return _finished(paired, "pairing" if merged else "unchanged", notes)


def _finished(mesh: PolyMesh, method: str, notes: list[str]) -> Remeshed:
    irregular = find_irregular(mesh)
    return Remeshed(mesh, method, (*notes, irregular_note(irregular)), irregular)


def _last_resort(
    source: PolyMesh, n_quads: int | None, notes: list[str], failures: list[str]
) -> Remeshed:
    """Take pairs that do not look like split quads, or say that nothing helped."""
    paired = merge_pairs(source, pair_triangles(source, repair=True))
    stray = int(np.count_nonzero(paired.face_sizes != 4))
    if not stray and _about(paired.n_faces, n_quads):
        notes = notes + [f"another attempt failed: {text}" for text in failures]
        notes.append("the triangles do not look like split quads, so the new quads may be skewed")
        return _from_pairing(source, paired, notes)
    if stray:
        text = agree(stray, "{n} [face would not be a quad|faces would not be quads]")
    else:
        text = f"it gives {paired.n_faces} quads (--remesh quads keeps them)"
    failures = [*failures, f"pairing triangles: {text}"]
    raise CannotMakeError(
        "the mesh could not be turned into quads:\n"
        + "\n".join(f"  - {failure}" for failure in failures)
        + f"\nWhat may help: {'; '.join(_remedies(source))}; or leaving the mesh as it is and "
        "refining it (one Catmull-Clark step turns any mesh into quads)"
    )


def _remedies(source: PolyMesh) -> list[str]:
    """Return what may help against what is wrong with a mesh."""
    remedies = ["another number of quads (more where the mesh has thin bars or small holes)"]
    crossing = len(self_intersections(source))
    if crossing:
        remedies.append(
            "moving apart what runs through itself "
            + agree(crossing, "({n} pair[|s] of faces [intersects or touches|intersect or touch])")
        )
    remedies.append("smoothing it first, if it is a scan")
    if np.any(build_halfedges(source).twin < 0):
        remedies.append("closing small holes")
    return remedies
