"""Make the mesh that is woven of the one that is given: remesh, refine, fair, open it."""

import numpy as np

from fabweave.core.arrays import FloatArray, Progress, frozen, frozen_value, no_progress
from fabweave.core.errors import InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.check import faces_text, mesh_counts
from fabweave.mesh.fair.energy import Wish
from fabweave.mesh.fair.fairing import RING_STEPS, STEPS, fair_mesh
from fabweave.mesh.fair.portals import portals_of
from fabweave.mesh.given import GivenMesh, Taken, require_few
from fabweave.mesh.halfedge import Halfedges, build_halfedges, group_edges
from fabweave.mesh.leave_out import Opening, leave_out, parse_leave_out
from fabweave.mesh.likeness import Likeness, Original
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.remesh.coarse import remesh_coarse
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.grid import remesh_grid
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.remesh.request import NONE, Remesh, parse_remesh
from fabweave.mesh.remesh.rings import remesh_rings
from fabweave.mesh.remesh.skeleton_quads import remesh_tubes
from fabweave.mesh.remesh.triangles import remesh_triangles
from fabweave.mesh.seen import Seen
from fabweave.mesh.settings import MeshSettings
from fabweave.mesh.shapes.catalogue import object_title
from fabweave.mesh.subdivide import format_refinements, mid_edge, parse_refinements, refine_mesh
from fabweave.mesh.symmetrise import symmetrise
from fabweave.mesh.upright import resize_mesh


@frozen_value
class LoadedMesh:
    """The mesh of a job, ready to be woven, with what was done to it.

    Parameters
    ----------
    mesh : PolyMesh
        In millimetres.
    halfedges : Halfedges
        Its connectivity.
    title : str
        What to call the job.
    notes : tuple of Note
        What a person should know about the mesh.
    up : str or None
        What was taken to point up where the format does not say so; job.toml keeps it, so that the
        same is made again whatever is guessed later.
    upward : str
        What points up, in the file's own coordinates, whoever says so.
    n_old_vertices : int
        For triaxial twill, how many vertices there were before the mid-edge subdivision; else 0.
    clashes : int
        How many pairs of faces ran through one another, or touched, as the mesh was given.
    left_out : float
        The share of the given surface whose bodies were left out.
    likeness : Likeness or None
        How like the given mesh the remeshed one is, refined and faired as it may be; None where it
        was not remeshed.
    original : Original or None
        What it stands in for, if it was remeshed.
    openings : tuple of Opening
        What was left out of it.
    portals : (H,) float array or None
        Where strands cross their portals, from vertices to centres; None for the middle of all.
    origin_mm : (3,) float array or None
        What brings its vertices back to where the file had them, turned and scaled as they are.
    remeshed : Remeshed or None
        What the given mesh was remeshed to, before anything else was done to it.
    rim : str
        What lies along its rims: ``none``, a ``ring``, or a ``double`` one.
    seen : Seen or None
        What the given mesh was seen to be, before it was remeshed; None of a built-in shape.
    taken : Taken or None
        What was taken of the given mesh, and what was added, where that is not all of it.
    turn_deg : float
        By how much strands turn at a crossing in the mean; 0 where the mesh was not faired.
    """

    mesh: PolyMesh
    halfedges: Halfedges
    title: str
    notes: tuple[Note, ...]
    up: str | None = None
    upward: str = "z"
    n_old_vertices: int = 0
    clashes: int = 0
    left_out: float = 0.0
    likeness: Likeness | None = None
    original: Original | None = None
    openings: tuple[Opening, ...] = ()
    portals: FloatArray | None = None
    origin_mm: FloatArray | None = None
    remeshed: Remeshed | None = None
    rim: str = "none"
    seen: Seen | None = None
    taken: Taken | None = None
    turn_deg: float = 0.0

    def where_given(self, points: FloatArray) -> FloatArray:
        """Return points of the object where the mesh was before it was moved to the origin."""
        return points if self.origin_mm is None else frozen(points + self.origin_mm)

    @property
    def n_crossings(self) -> int:
        """How many crossings its weave has: one at each edge between two faces."""
        return int(np.count_nonzero(self.halfedges.twin >= 0)) // 2


def load_mesh(
    settings: MeshSettings,
    given: GivenMesh,
    progress: Progress = no_progress,
    remeshed: Remeshed | None = None,
    *,
    course: str = "auto",
    triaxial: bool = False,
    seed: int = 0,
    wish: Wish | None = None,
) -> LoadedMesh:
    """Make the mesh of a job of the one that is given, as the settings ask for it.

    It is remeshed, refined, faired, made symmetric, and brought to size again where that changed
    it; at last opened, and subdivided for triaxial twill.

    Parameters
    ----------
    settings : MeshSettings
    given : GivenMesh
        By the same settings.
    progress : callable
    remeshed : Remeshed, optional
        What the mesh was remeshed to before, with the same settings that matter for it.
    course : str
        How strands cross faces, as ``--course`` says it.
    triaxial : bool
        Whether the mesh is subdivided through the middles of its edges, for triaxial twill.
    seed : int
        Of random numbers in remeshing.
    wish : Wish, optional
        What ribbons should be like, for fairing.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If it cannot be remeshed or refined as asked.
    """
    notes = list(given.notes)
    mesh, remeshed, original, like, turn_deg = _changed(
        given, settings, notes, progress, remeshed, course=course, seed=seed, wish=wish
    )
    mesh, n_old_vertices, openings = _opened(mesh, settings, notes, triaxial=triaxial)
    halfedges = build_halfedges(mesh)
    require_few(halfedges.n_edges)
    x, y, z = np.ptp(mesh.vertices, axis=0)
    size = f"size: {x:.1f} × {y:.1f} × {z:.1f} mm; {given.size_note}"
    notes.append(Note("size", size, detail=True))
    return LoadedMesh(
        mesh=mesh,
        halfedges=halfedges,
        up=given.up,
        upward=given.upward,
        title=object_title(settings.source, settings.title),
        notes=tuple(notes),
        n_old_vertices=n_old_vertices,
        clashes=given.clashes,
        left_out=given.left_out,
        likeness=like,
        original=original,
        openings=openings,
        portals=portals_of(course, mesh, halfedges),
        origin_mm=given.origin_mm,
        remeshed=remeshed,
        seen=given.seen,
        taken=given.taken,
        rim=settings.rim,
        turn_deg=turn_deg,
    )


def _changed(
    given: GivenMesh,
    settings: MeshSettings,
    notes: list[Note],
    progress: Progress,
    remeshed: Remeshed | None,
    *,
    course: str,
    seed: int,
    wish: Wish | None,
) -> tuple[PolyMesh, Remeshed | None, Original | None, Likeness | None, float]:
    """Remesh, refine, fair and symmetrise as the settings ask, and note what was done."""
    done = []
    mesh, model, growth, turn_deg = given.mesh, None, 1.0, 0.0
    wanted = parse_remesh(settings.remesh or NONE)
    if wanted.kind != NONE:
        if remeshed is None:
            remeshed = _remeshed(mesh, wanted, progress, seed=seed)
        notes += Note.each("remeshed", remeshed.notes)
        if remeshed.method != "unchanged":
            model = given.mesh
            if remeshed.mesh.n_faces < mesh.n_faces:
                became = f"{faces_text(mesh)} became {faces_text(remeshed.mesh)}"
                told = f"the model's own {became} (--remesh {settings.remesh})"
                notes.append(Note("remeshed", told, detail=True))
        mesh = remeshed.mesh
        kind = {"coarse": "a coarser cage", "triangles": "triangles"}.get(wanted.kind, "quads")
        done.append(f"remeshed to {kind} ({remeshed.method})")
    refinements = parse_refinements(settings.refine or "")
    if refinements:
        mesh = refine_mesh(mesh, refinements, progress=progress)
        done.append(f"refined by {format_refinements(refinements)}")
    # What was made anew need not stay as it is.
    steps = settings.fair
    if steps is None:
        steps = 0 if model is None else RING_STEPS if wanted.kind == "rings" else STEPS
    if steps:
        near = model_of(given.mesh, mesh.n_vertices)
        faired = fair_mesh(mesh, near, steps, wish=wish, course=course, progress=progress)
        mesh, turn_deg = faired.mesh, faired.after.turn_deg
        notes.append(faired.note)
        done.append("faired")
    if settings.symmetrise:
        symmetric = symmetrise(mesh)
        mesh = symmetric.mesh
        notes.append(Note("symmetrised", symmetric.note))
        done.append("made symmetric")
    if done and settings.size_mm is not None:
        mesh, growth = resize_mesh(mesh, size_mm=settings.size_mm)
    original = like = None
    if model is not None:
        progress("likeness", 0, 1)
        original = Original(model, given.worn, growth, mesh)
        like = original.likeness(mesh)
        notes += [Note("likeness", like.note), *_limb_notes(like, wanted)]
    mesh = _prepared(mesh, done, notes, detail=wanted.kind != NONE)
    return mesh, remeshed, original, like, turn_deg


def _limb_notes(like: Likeness, wanted: Remesh) -> list[Note]:
    """Say what keeps limbs that are cut short, where a count of faces was asked for."""
    if not like.short or wanted.count is None or wanted.kind == "coarse":
        return []
    text = agree(len(like.short), "{n} [limb is|limbs are] cut short; finer strips keep more")
    return [Note("limbs", f"{text}: --remesh {wanted.kind}:{2 * wanted.count}, or a larger --size")]


def _remeshed(mesh: PolyMesh, wanted: Remesh, progress: Progress, *, seed: int) -> Remeshed:
    if wanted.kind == "coarse":
        return remesh_coarse(mesh, wanted.count, progress=progress)
    if wanted.kind == "quads" or wanted.count is None:
        return remesh_quads(mesh, wanted.count, seed=seed, progress=progress)
    if wanted.kind == "triangles":
        return remesh_triangles(mesh, wanted.count, progress=progress)
    if wanted.kind == "grid":
        return remesh_grid(mesh, wanted.count, progress=progress)
    if wanted.kind == "rings":
        return remesh_rings(mesh, wanted.count, progress=progress)
    return remesh_tubes(mesh, wanted.count, progress=progress)


def _opened(
    mesh: PolyMesh, settings: MeshSettings, notes: list[Note], *, triaxial: bool
) -> tuple[PolyMesh, int, tuple[Opening, ...]]:
    """Leave out faces, and subdivide for triaxial twill, and note what was done.

    The second is how many vertices there were before a subdivision.

    Raises
    ------
    InputError
        If a ring is wanted, and no rim is left for it.
    """
    done = []
    openings: tuple[Opening, ...] = ()
    if settings.leave_out is not None:
        mesh, openings = leave_out(mesh, parse_leave_out(settings.leave_out))
        notes += Note.each("opening", (opening.note for opening in openings))
        done.append("opened")
    n_old_vertices = 0
    if triaxial:
        n_old_vertices = mesh.n_vertices
        mesh = mid_edge(mesh)
        done.append("subdivided through the middles of its edges for triaxial twill")
    mesh = _prepared(mesh, done, notes)
    if settings.rim != "none" and not len(group_edges(mesh).rim):
        # Four faces of a coarse mesh, and less than half of the object.
        size_mm = settings.size_mm
        wide_mm = 80 if size_mm is None else max(10 * round(0.04 * size_mm), 10)
        raise InputError(
            "rim: a ring lies along a rim, and this mesh is closed; leave out --rim, or add "
            f"--leave-out top:{wide_mm}mm"
        )
    return mesh, n_old_vertices, openings


def _prepared(
    mesh: PolyMesh, done: list[str], notes: list[Note], *, detail: bool = False
) -> PolyMesh:
    """Make a mesh ready to weave after what was done to it, and note what that was."""
    if done:
        mesh, report, repairs = prepare_mesh(mesh)
        notes += Note.each("repaired", repairs)
        told = f"the mesh was {', '.join(done)}: {mesh_counts(report)}"
        notes.append(Note("changed", told, detail=detail))
    return mesh
