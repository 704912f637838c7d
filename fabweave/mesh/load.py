"""Bring the mesh of a job to the loom: read or build it, check, remesh, refine, fair, size it."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, Progress, frozen, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.bodies import has_bodies, with_bodies
from fabweave.mesh.check import faces_text, mesh_counts, mesh_notes
from fabweave.mesh.clean import Cleaned, clean_mesh
from fabweave.mesh.fair.energy import Wish
from fabweave.mesh.fair.fairing import STEPS, fair_mesh
from fabweave.mesh.fair.portals import portals_of
from fabweave.mesh.halfedge import Halfedges, build_halfedges, group_edges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.leave_out import Opening, leave_out, parse_leave_out
from fabweave.mesh.likeness import Likeness, LossMap, likeness, loss_map
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import inward_faces, prepare_mesh
from fabweave.mesh.remesh.coarse import remesh_coarse
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.grid import remesh_grid
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.remesh.request import NONE, Remesh, parse_remesh
from fabweave.mesh.remesh.skeleton_quads import remesh_tubes
from fabweave.mesh.remesh.triangles import remesh_triangles
from fabweave.mesh.seen import Seen, fill_cracks, seen_of
from fabweave.mesh.settings import MeshSettings
from fabweave.mesh.shapes.catalogue import is_shape, object_title, parse_shape
from fabweave.mesh.subdivide import format_refinements, mid_edge, parse_refinements, refine_mesh
from fabweave.mesh.symmetrise import symmetrise
from fabweave.mesh.upright import guess_up, largest_dimension, resize_mesh, turn_of, turn_upright
from fabweave.mesh.walls import outer_walls

#: Sizes beyond these are slips of a unit, and arithmetic gets coarse there.
_LEAST_MM, _MOST_MM = 0.01, 1e6


#: Faces with more corners are slips of an export; looking for intersections takes the square of it.
_MOST_CORNERS = 2000
#: Larger meshes would fill the memory of a workstation, and nobody weaves so much by hand.
MOST_EDGES = 2_000_000


@frozen_value
class Taken:
    """What of a mesh is woven where that is not all of it: the outer side of walls, cracks closed.

    Parameters
    ----------
    scale : float
        What brings the mesh as it was given to the size of the object.
    wall_mm : float or None
        How thick the wall is whose outer side was taken.
    cut : int
        Along how many rims faces were cut.
    added : int
        How many triangles close cracks.
    """

    scale: float
    wall_mm: float | None
    cut: int
    added: int

    def record(self) -> dict[str, float | int]:
        """Return it for job.toml."""
        wall = {} if self.wall_mm is None else {"wall_mm": round(self.wall_mm, 3)}
        return {"scale": self.scale, **wall, "cut": self.cut, "added": self.added}


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
    loss : LossMap or None
        What of the given mesh was lost where, if it was remeshed.
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
    loss: LossMap | None = None
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


#: What may help against a mesh that cannot be woven.
_WRAPS = (
    "\nWhat may help: --bodies wrap, which lays one closed surface around whatever the mesh "
    "encloses, with --remesh quads:N"
)


def load_mesh(
    settings: MeshSettings,
    progress: Progress = no_progress,
    given_mesh: PolyMesh | None = None,
    remeshed: Remeshed | None = None,
    *,
    course: str = "auto",
    triaxial: bool = False,
    seed: int = 0,
    wish: Wish | None = None,
) -> LoadedMesh:
    """Read or build the mesh of a job, and do to it what the settings ask for.

    A mesh is first cleaned, rid of debris if asked, turned upright, checked, oriented, and brought
    to size; then remeshed, refined, faired, made symmetric, and brought to size again
    where that changed it; at last opened, and subdivided for triaxial twill.

    Parameters
    ----------
    settings : MeshSettings
    progress : callable
    given_mesh : PolyMesh, optional
        A mesh from memory. It is taken as one read from the file that the settings name would be,
        from a format that states no unit.
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
    progress("mesh", 0, 1)
    file = _given(settings, given_mesh)
    mesh, unit_mm = file.mesh, file.unit_mm or 1.0
    built_in = given_mesh is None and is_shape(settings.source)
    _require_small_faces(mesh)
    if not settings.remeshed:
        _require_few(mesh.n_corners // 2)
    cleaned = Cleaned(mesh, np.zeros(3), ())
    if not built_in:
        cleaned = clean_mesh(mesh, settings.weld, settings.size_mm, unit_mm)
    mesh, kept, left_out = with_bodies(cleaned.mesh, settings.bodies)
    up, said = _upward(mesh, settings, file, in_memory=given_mesh is not None)
    mesh = turn_upright(mesh, up)
    try:
        inward = inward_faces(mesh) if has_bodies(mesh) else np.zeros(mesh.n_faces, dtype=bool)
        mesh, report, repairs = prepare_mesh(mesh)
    except InputError as error:
        # The numbers in the message are those of the mesh after what was done to it.
        done = "".join(f"\n(before that check: {note})" for note in (*cleaned.notes, *kept))
        helps = _WRAPS if mesh.n_faces and settings.bodies != "wrap" else ""
        raise InputError(f"{error}{done}{helps}") from None
    whole, added, wall, cut, mended = mesh, 0, None, 0, list[Note]()
    if not built_in:
        mesh, added, mended = fill_cracks(mesh)
        mesh, wall, cut, left = _walled(mesh, inward, settings.walls)
        mended += left
    partly = mesh is not whole
    if partly:
        mesh, report, _ = prepare_mesh(mesh)
    clashes = self_intersections(mesh)
    if settings.size_mm is None:
        mesh, factor = resize_mesh(mesh, scale=unit_mm)
    else:
        mesh, factor = resize_mesh(mesh, size_mm=settings.size_mm)
    seen = None if built_in else seen_of(report, None if wall is None else wall * factor)
    notes = [
        *Note.each("file", file.notes),
        *Note.each("up", said),
        *Note.each("repaired", (*cleaned.notes, *kept, *repairs)),
        *mended,
        *([] if seen is None else seen.notes),
        *mesh_notes(report, clashes),
    ]
    _require_size(largest_dimension(mesh))
    basis = "the file states " + (f"its unit ({file.unit})" if file.unit else "no unit")
    if built_in:
        basis = "built-in shapes are in millimetres"
    how = f"is scaled by {factor:.6g}" if factor != 1.0 else "keeps its lengths, as millimetres"
    worn = (
        resize_mesh(turn_upright(cleaned.mesh, up), scale=factor)[0]
        if settings.bodies == "wrap"
        else None
    )
    mesh, remeshed, like, loss, turn_deg = _changed(
        mesh, settings, notes, progress, remeshed, worn, course=course, seed=seed, wish=wish
    )
    mesh, n_old_vertices, openings = _opened(mesh, settings, notes, triaxial=triaxial)
    halfedges = build_halfedges(mesh)
    _require_few(halfedges.n_edges)
    x, y, z = np.ptp(mesh.vertices, axis=0)
    size = f"size: {x:.1f} × {y:.1f} × {z:.1f} mm; {basis}, and the mesh {how}"
    notes.append(Note("size", size, detail=True))
    return LoadedMesh(
        mesh=mesh,
        halfedges=halfedges,
        up=up if file.up is None else None,
        upward=up,
        title=object_title(settings.source, settings.title),
        notes=tuple(notes),
        n_old_vertices=n_old_vertices,
        clashes=len(clashes),
        left_out=left_out,
        likeness=like,
        loss=loss,
        openings=openings,
        portals=portals_of(course, mesh, halfedges),
        origin_mm=None if built_in else factor * (turn_of(up) @ cleaned.origin),
        remeshed=remeshed,
        seen=seen,
        taken=Taken(factor, seen.wall_mm, cut, added) if partly and seen is not None else None,
        rim=settings.rim,
        turn_deg=turn_deg,
    )


def _walled(
    mesh: PolyMesh, inward: BoolArray, wanted: str
) -> tuple[PolyMesh, float | None, int, list[Note]]:
    """Return what is seen of a mesh from outside, as ``--walls`` says it.

    Beside it, the thickness of its wall, along how many rims faces were cut, and notes.
    """
    if wanted == "both":
        return mesh, None, 0, []
    # Cracks were closed with faces at the end.
    looked = np.concatenate([inward, np.zeros(mesh.n_faces - len(inward), dtype=bool)])
    walled = outer_walls(mesh, looked, insist=wanted == "outside")
    if wanted == "outside" and walled.thickness is None and not walled.hidden:
        raise CannotMakeError(
            "--walls outside found no wall of two sides in the mesh; leave it out, or use a model "
            "whose wall is thinner than a quarter of its size"
        )
    notes = []
    if walled.hidden:
        told = agree(walled.hidden, "{n} bod[y lies|ies lie] inside another, out of sight, and ")
        told += agree(walled.hidden, "[was|were] left out; --walls both keeps [it|them]")
        notes.append(Note("model", f"model: {told}"))
    return walled.mesh, walled.thickness, walled.ragged, notes


def _given(settings: MeshSettings, in_memory: PolyMesh | None) -> MeshFile:
    """Return the mesh of a job as it was read, built or given."""
    if in_memory is not None:
        return MeshFile(in_memory, "")
    if is_shape(settings.source):
        return MeshFile(parse_shape(settings.source), "", "mm", up="z")
    return read_mesh(settings.source)


def _upward(
    mesh: PolyMesh, settings: MeshSettings, file: MeshFile, *, in_memory: bool
) -> tuple[str, list[str]]:
    """Return what of a mesh points up, and what a person should know about it."""
    stated = file.up
    if in_memory or (stated is not None and settings.up is not None):
        return settings.up or "z", []
    if stated is not None:
        kind = file.format.upper()
        turned = f"the mesh was turned so that its {stated} axis points up, as {kind} files have it"
        return stated, [f"{turned}; --up z leaves it as it is"] if stated != "z" else []
    guess = guess_up(mesh)
    up, reason = guess or ("z", "")
    # The settings of a job say what was guessed for it, and its notes are the same again.
    if settings.up not in (None, up):
        return settings.up, []
    if guess is None:
        return "z", ["z is taken to point up; if pictures show it lying, add --up y or --up x"]
    other = "--up y or --up x turns it" if up == "z" else "--up z keeps the axes of the file"
    return up, [f"up: {up}, guessed from its {reason}; {other}"]


def _require_small_faces(mesh: PolyMesh) -> None:
    """Raise InputError for faces with more corners than ribbons could have room at."""
    large = np.flatnonzero(mesh.face_sizes > _MOST_CORNERS)
    if len(large):
        raise InputError(
            agree(len(large), "{n} [face has|faces have]")
            + f" more than {_MOST_CORNERS} corners (face {large[0]} has "
            f"{mesh.face_sizes[large[0]]}), and a ribbon would cross each of their sides; divide "
            "them into smaller faces in a modelling program"
        )


def _require_few(n_edges: int) -> None:
    """Raise CannotMakeError for more edges than can be woven."""
    if n_edges > MOST_EDGES:
        raise CannotMakeError(
            f"the mesh to be woven has {n_edges} edges, each a crossing, but at most {MOST_EDGES} "
            "can be woven; use a coarser mesh or fewer steps of refinement"
        )


def _require_size(size_mm: float) -> None:
    """Raise InputError for an object that nobody can mean."""
    if not _LEAST_MM <= size_mm <= _MOST_MM:
        raise InputError(
            f"the mesh would be {size_mm:.3g} mm in size, but woven objects measure {_LEAST_MM:g} "
            f"to {_MOST_MM:g} mm: set the size, such as --size 400mm"
        )


def _changed(
    mesh: PolyMesh,
    settings: MeshSettings,
    notes: list[Note],
    progress: Progress,
    remeshed: Remeshed | None,
    worn: PolyMesh | None,
    *,
    course: str,
    seed: int,
    wish: Wish | None,
) -> tuple[PolyMesh, Remeshed | None, Likeness | None, LossMap | None, float]:
    """Remesh, refine, fair and symmetrise as the settings ask, and note what was done.

    What was wrapped (``worn``) is what a wrap adds to: where a mask became a bag, its back is far.
    """
    done = []
    given, model, growth, turn_deg = mesh, None, 1.0, 0.0
    wanted = parse_remesh(settings.remesh or NONE)
    if wanted.kind != NONE:
        if remeshed is None:
            remeshed = _remeshed(mesh, wanted, progress, seed=seed)
        notes += Note.each("remeshed", remeshed.notes)
        if remeshed.method != "unchanged":
            model = given
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
    steps = settings.fair if settings.fair is not None else STEPS if model is not None else 0
    if steps:
        near = model_of(given, mesh.n_vertices)
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
    like = loss = None
    if model is not None:
        progress("likeness", 0, 1)
        # Where it is, not where it went when it was brought to size again.
        there = mesh.with_vertices(mesh.vertices / growth)
        like, loss = likeness(model, there), loss_map(model, there)
        if worn is not None:
            off = likeness(worn, there)
            like = replace(
                like, out_mean_mm=off.out_mean_mm, out_rms_mm=off.out_rms_mm,
                out_greatest_mm=off.out_greatest_mm,
            )  # fmt: skip
        notes.append(Note("likeness", like.note))
    mesh = _prepared(mesh, done, notes, detail=wanted.kind != NONE)
    return mesh, remeshed, like, loss, turn_deg


def _remeshed(mesh: PolyMesh, wanted: Remesh, progress: Progress, *, seed: int) -> Remeshed:
    if wanted.kind == "coarse":
        return remesh_coarse(mesh, wanted.count, progress=progress)
    if wanted.kind == "quads" or wanted.count is None:
        return remesh_quads(mesh, wanted.count, seed=seed, progress=progress)
    if wanted.kind == "triangles":
        return remesh_triangles(mesh, wanted.count, progress=progress)
    if wanted.kind == "grid":
        return remesh_grid(mesh, wanted.count, progress=progress)
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
