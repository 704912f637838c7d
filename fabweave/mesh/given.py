"""Bring the mesh that is given: read or build it, clean and check it, turn it upright, size it."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.bodies import has_bodies, sound_part, with_bodies
from fabweave.mesh.check import mesh_notes
from fabweave.mesh.clean import Cleaned, clean_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import inward_faces, prepare_mesh
from fabweave.mesh.seen import Seen, fill_cracks, seen_of
from fabweave.mesh.settings import MeshSettings
from fabweave.mesh.shapes.catalogue import is_shape, parse_shape
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
class GivenMesh:
    """The mesh that was given, as it comes to the loom: before anything is made of it.

    Parameters
    ----------
    mesh : PolyMesh
        In millimetres, at the size of the object.
    notes : tuple of Note
        What a person should know about it.
    size_note : str
        What its lengths come from, and how it was scaled.
    up, upward : str or None, str
        As a :class:`fabweave.mesh.load.LoadedMesh` has them.
    clashes : int
        How many pairs of faces run through one another, or touch.
    left_out : float
        The share of its surface whose bodies were left out.
    origin_mm : (3,) float array or None
        What brings its vertices back to where the file had them; None of a built-in shape.
    seen : Seen or None
        What it was seen to be; None of a built-in shape.
    taken : Taken or None
        What was taken of it, and what was added, where that is not all of it.
    worn : PolyMesh or None
        What was wrapped, if it was.
    """

    mesh: PolyMesh
    notes: tuple[Note, ...]
    size_note: str
    up: str | None
    upward: str
    clashes: int
    left_out: float
    origin_mm: FloatArray | None
    seen: Seen | None
    taken: Taken | None
    worn: PolyMesh | None


#: What may help against a mesh that cannot be woven.
_WRAPS = (
    "\nWhat may help: --bodies wrap, which lays one closed surface around whatever the mesh "
    "encloses, with --remesh quads:N"
)


def give_mesh(
    settings: MeshSettings,
    progress: Progress = no_progress,
    in_memory: PolyMesh | None = None,
) -> GivenMesh:
    """Read or build the mesh of a job, and bring it to the loom.

    It is first cleaned, rid of debris if asked, turned upright, checked, oriented, and brought to
    size.

    Parameters
    ----------
    settings : MeshSettings
    progress : callable
    in_memory : PolyMesh, optional
        A mesh from memory. It is taken as one read from the file that the settings name would be,
        from a format that states no unit.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If it has no walls, and their outside is asked for.
    """
    progress("mesh", 0, 1)
    file = _read(settings, in_memory)
    mesh, unit_mm = file.mesh, file.unit_mm or 1.0
    built_in = in_memory is None and is_shape(settings.source)
    _require_small_faces(mesh)
    if not settings.remeshed:
        require_few(mesh.n_corners // 2)
    cleaned = Cleaned(mesh, np.zeros(3), ())
    if not built_in:
        cleaned = clean_mesh(mesh, settings.weld, settings.size_mm, unit_mm)
    mesh, kept, left_out = with_bodies(cleaned.mesh, settings.bodies)
    up, said = _upward(mesh, settings, file, in_memory=in_memory is not None)
    mesh = turn_upright(mesh, up)
    try:
        inward = inward_faces(mesh) if has_bodies(mesh) else np.zeros(mesh.n_faces, dtype=bool)
        mesh, report, repairs = prepare_mesh(mesh)
    except InputError as error:
        # The numbers in the message are those of the mesh after what was done to it.
        done = "".join(f"\n(before that check: {note})" for note in (*cleaned.notes, *kept))
        helps = _WRAPS if settings.bodies != "wrap" and sound_part(mesh) is not None else ""
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
    return GivenMesh(
        mesh=mesh,
        notes=tuple(notes),
        size_note=f"{basis}, and the mesh {how}",
        up=up if file.up is None else None,
        upward=up,
        clashes=len(clashes),
        left_out=left_out,
        origin_mm=None if built_in else factor * (turn_of(up) @ cleaned.origin),
        seen=seen,
        taken=Taken(factor, seen.wall_mm, cut, added) if partly and seen is not None else None,
        worn=worn,
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


def _read(settings: MeshSettings, in_memory: PolyMesh | None) -> MeshFile:
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
    guess = guess_up(mesh, file.format)
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


def require_few(n_edges: int) -> None:
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
