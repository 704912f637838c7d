"""Give Python users the stations of a job as values that show themselves, and whole jobs."""

from __future__ import annotations

import base64
import html
import io
import operator
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image
from shapely import affinity

from fabweave.batch.asked import batch_of, read_batch
from fabweave.batch.run import run_batch
from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen,
    frozen_value,
    no_progress,
)
from fabweave.core.colour_space import Colours
from fabweave.core.errors import InputError
from fabweave.core.job_folder import (
    clear_abandoned,
    finished_folder,
    folder_at,
    folder_is_readable,
    told_where,
)
from fabweave.core.messages import agree, shown
from fabweave.core.parallel.executors import Executors, guest, processes
from fabweave.design.inspection.facts import Inspection as Facts
from fabweave.design.inspection.facts import inspect_mesh
from fabweave.design.inspection.files import inspection_picture
from fabweave.design.inspection.text import inspection_text
from fabweave.design.making import make_or_advise, seek
from fabweave.design.search import Search
from fabweave.design.tried import Tried
from fabweave.design.wishes import Wishes, choose, goal_options, parse_wishes
from fabweave.estimate.costs import Costs
from fabweave.form.body import body_of
from fabweave.form.settle import Settled, settle
from fabweave.job.ask import brief_of
from fabweave.job.draw import Job
from fabweave.job.figures import Figures
from fabweave.job.planned import PlannedJob
from fabweave.job.run import draw_stations, run_job, write_and_prove
from fabweave.job.stations import Stations
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import PREFIX
from fabweave.mesh.triangulate import triangulate
from fabweave.nest.layout import Layout as NestedLayout
from fabweave.options.kinds import MOST_MM, called, either, flag, length, real, several, whole
from fabweave.options.table import OPTIONS, option_named
from fabweave.picture.bodies import Body, joined_bodies, yarn_bodies
from fabweave.picture.surfaces import ribbon_triangles, rung_colours
from fabweave.picture.yarns import FEWEST_SIDES, MOST_SIDES
from fabweave.picture.yarns import Yarns as SpunYarns
from fabweave.piece.outline import inscribed_polygon
from fabweave.piece.piece import Piece
from fabweave.plan.preflight import Preflight
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.measures import thread_lengths
from fabweave.ribbon.rules.bends import measure_bends
from fabweave.stock.sheet_size import SheetSize
from fabweave.verify.proof import verify_job
from fabweave.verify.report import VerifyReport
from fabweave.weave.pattern import at_turns_text
from fabweave.weave.weave_mesh import WovenMesh

if TYPE_CHECKING:
    import trimesh


#: So many outlines stand in a row.
_COLUMNS = 6


def face(title: str, figures: Mapping[str, Any], picture: Image.Image | str | None = None) -> str:
    """Return HTML that shows a value in a notebook: a picture, and its key figures.

    Parameters
    ----------
    title : str
    figures : mapping
        Names and what they come to.
    picture : image or str, optional
        A picture, or SVG.
    """
    if isinstance(picture, Image.Image):
        small = picture.copy()
        small.thumbnail((480, 400))
        data = io.BytesIO()
        small.save(data, "PNG")
        picture = f'<img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'
    rows = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>"
        for name, value in figures.items()
    )
    return (
        f"<div><b>{html.escape(title)}</b><div style='display:flex;gap:1em;align-items:start'>"
        f"{picture or ''}<table>{rows}</table></div></div>"
    )


def outlines_svg(
    width_mm: float,
    height_mm: float,
    polygons: Sequence[shapely.Polygon],
    colours: npt.NDArray[np.integer],
) -> str:
    """Return SVG of polygons on a sheet, each in its colour, (N, 3); y points up."""
    # A screen shows no more than a tenth of a millimetre.
    seen = shapely.transform(shapely.simplify(polygons, 0.05), lambda points: points.round(2))
    paths = [
        polygon.svg(0.1, f"rgb({red},{green},{blue})", 1.0)
        for polygon, (red, green, blue) in zip(seen, colours.tolist(), strict=True)
    ]
    shown_px = min(480.0, 300.0 * width_mm / height_mm)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{shown_px:.0f}" '
        f'viewBox="0 0 {width_mm:.1f} {height_mm:.1f}">'
        f'<rect width="100%" height="100%" fill="#f6f4ef"/>'
        f'<g transform="matrix(1 0 0 -1 0 {height_mm:.1f})">{"".join(paths)}</g></svg>'
    )


class _Shown:
    """A value that shows itself in a notebook: by a picture and its key figures."""

    def _repr_html_(self) -> str:
        return face(self._title(), self._figures(), self.picture())

    def _title(self) -> str:
        raise NotImplementedError

    def _figures(self) -> Mapping[str, Any]:
        raise NotImplementedError

    def picture(self) -> Image.Image | str:
        """Return a picture, or SVG."""
        raise NotImplementedError


class _Solid(_Shown):
    """A value in space, of which pictures can be made from any side."""

    def picture(
        self, *, size_px: tuple[int, int] = (1000, 800), view: tuple[float, float] | None = None,
        across: Any = None, samples: int = 2,
    ) -> Image.Image:  # fmt: skip
        """Return a picture.

        Parameters
        ----------
        size_px : (int, int)
            Width and height.
        view : (float, float), optional
            Azimuth and elevation in degrees, as ``--view`` takes them; chosen by default.
        across : length, optional
            How much of the world the picture shows across, such as ``"400mm"``, so that pictures
            of several objects have one scale; by default, the object fills it.
        samples : int
            Samples of a pixel along each side: more make smoother edges.

        Raises
        ------
        InputError
            If the view or the size makes no sense.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
        >>> ribbons.picture(size_px=(300, 240), view=(-90, 20), across="400mm").size
        (300, 240)
        """
        from fabweave.picture.camera import (  # noqa: PLC0415 - for pictures only
            MOST_PIXELS,
            View,
            choose_view,
        )

        look = {
            "size_px": several(whole(1, MOST_PIXELS), 2).argument("size_px", size_px),
            "samples": whole(1, _MOST_SAMPLES).argument("samples", samples),
        }
        if view is None:
            seen = choose_view(*self._surface())
        else:
            seen = View(*several(real(), 2).argument("view", view))
        if across is not None:
            seen = replace(seen, width_mm=_LENGTH.argument("across", across))
        return self._drawn(view=seen, **look)

    def _surface(self) -> tuple[FloatArray, IntArray]:
        """Return vertices, (V, 3), and triangles, (T, 3)."""
        raise NotImplementedError

    def _drawn(self, **look: Any) -> Image.Image:
        raise NotImplementedError


#: A length is a number of millimetres, or a text with a unit; progress is told to a function.
_LENGTH, _PROGRESS = length(MOST_MM), called("progress(what, done, total)")
#: More samples along a pixel's side change nothing, and no machine has as many processors.
_MOST_SAMPLES, _MOST_WORKERS = 64, 10_000
#: More designs than these nobody compares, and more pieces nobody weaves.
_MOST_DESIGNS, _MOST_PIECES = 100, 1_000_000
#: The stiffest pin, N mm per radian, of those that a material may have (``turning_nmm``).
_STIFFEST_NMM = 1e6
#: What a file is called in a job's folder, so it must be a plain name.
_PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_- ")
_LONGEST_NAME = 80


@frozen_value
class Mesh(_Solid):
    """A polygon mesh that is ready to be woven, in millimetres.

    Made by :func:`read`, :func:`mesh` and :func:`shape`; :func:`fabweave.weave` takes it on.
    """

    stations: Stations
    loaded: LoadedMesh

    @property
    def vertices(self) -> FloatArray:
        """Positions in millimetres, (V, 3), read-only, where the given mesh has them."""
        return self.loaded.where_given(self.loaded.mesh.vertices)

    @property
    def faces(self) -> list[list[int]]:
        """The vertices of each face, counter-clockwise seen from outside."""
        return self.loaded.mesh.faces()

    @property
    def edges(self) -> IntArray:
        """The two vertices of each edge, (E, 2)."""
        halfedges = self.loaded.halfedges
        first = halfedges.edge_halfedge
        return frozen(np.column_stack((halfedges.tail[first], halfedges.head[first])))

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Extent along x, y and z, millimetres."""
        x, y, z = np.ptp(self.loaded.mesh.vertices, axis=0).tolist()
        return x, y, z

    @property
    def title(self) -> str:
        """What the mesh is called."""
        return self.loaded.title

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the mesh, and what is worth knowing about it."""
        return self.loaded.notes

    def to_trimesh(self) -> trimesh.Trimesh:
        """Return the mesh as ``trimesh.Trimesh``; faces with more corners are cut to triangles.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.shape("cube").to_trimesh().is_watertight
        True
        """
        import trimesh  # noqa: PLC0415 - slow to import, and seldom wanted

        vertices, triangles = self._surface()
        return trimesh.Trimesh(self.loaded.where_given(vertices), triangles, process=False)

    def _surface(self) -> tuple[FloatArray, IntArray]:
        triangles = triangulate(self.loaded.mesh)
        return triangles.vertices, triangles.indices.reshape(-1, 3)

    def _drawn(self, **look: Any) -> Image.Image:
        from fabweave.picture.object_picture import irregular_marks, mesh_picture  # noqa: PLC0415

        return mesh_picture(self.loaded.mesh, marks=irregular_marks(self.loaded.mesh), **look)

    def __repr__(self) -> str:
        counts = f"{len(self.vertices)} vertices, {len(self.edges)} edges, {len(self.faces)} faces"
        return f"Mesh({self.title!r}: {counts}, {self._size()} mm)"

    def _size(self) -> str:
        return " × ".join(f"{side:.1f}" for side in self.size_mm)

    def _title(self) -> str:
        return self.title

    def _figures(self) -> Mapping[str, Any]:
        return {
            "vertices": len(self.vertices),
            "edges": len(self.edges),
            "faces": len(self.faces),
            "size, mm": self._size(),
        }


def read(path: str | Path, **options: Any) -> Mesh:
    """Read a mesh file: OBJ, OFF or PLY with its polygons, STL, GLB or 3MF as triangles.

    Parameters
    ----------
    path : str or Path
    options
        Of the mesh, as on the command line: ``size="400mm"``, ``up="y"``,
        ``remesh="quads:300"``, ``refine="catmull-clark:1"``, ``fair=12``. A number without a unit
        is in millimetres.

    Raises
    ------
    InputError
        If the file cannot be read or the mesh cannot be woven; it says where and what to do.
    CannotMakeError
        If it cannot be remeshed or refined as asked.

    Examples
    --------
    >>> import fabweave as fw, tempfile, pathlib
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = fw.shape("cube").to_trimesh().export(folder / "cube.stl")
    >>> fw.read(folder / "cube.stl", size="30cm").size_mm
    (300.0, 300.0, 300.0)
    """
    return _mesh(Stations.read(option_named("mesh").kind.argument("path", path), options))


def mesh(
    vertices: Any,
    faces: Sequence[Sequence[int]] | npt.NDArray[np.integer] | None = None,
    *,
    name: str = "mesh",
    **options: Any,
) -> Mesh:
    """Take a mesh from memory.

    Parameters
    ----------
    vertices : (V, 3) array, or anything with ``vertices`` and ``faces``
        Positions in millimetres; or a mesh, such as ``trimesh.Trimesh`` or our own.
    faces : (F, k) int array or sequence of sequences of int
        Corners of each face, counter-clockwise seen from outside; faces may differ in size. Left
        out where a mesh is given.
    name : str
        What the object is called. A job keeps the mesh as ``NAME.obj`` in its folder, so that its
        ``job.toml`` can make it again.
    options
        As for :func:`read`.

    Raises
    ------
    InputError
        If these are no vertices and faces, or the mesh cannot be woven.

    Examples
    --------
    >>> import fabweave as fw
    >>> corners = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]
    >>> tetrahedron = fw.mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], size=100)
    >>> tetrahedron
    Mesh('Mesh': 4 vertices, 6 edges, 4 faces, 100.0 × 100.0 × 100.0 mm)
    """
    plain = isinstance(name, str) and name == name.strip() and not set(name) - _PLAIN
    if not (plain and 0 < len(name) <= _LONGEST_NAME):
        raise InputError(
            f"{shown(name)} is no plain name: use letters, digits, spaces, - and _, "
            f"{_LONGEST_NAME} at most"
        )
    if name == "woven_mesh":
        raise InputError("woven_mesh.obj is a file of the job itself: name the mesh otherwise")
    return _mesh(Stations.read(f"{name}.obj", options, _polymesh(vertices, faces)))


def shape(name: str, *, size: Any = None, **parameters: Any) -> Mesh:
    """Build a built-in shape.

    Parameters
    ----------
    name : str
        One of those that ``fabweave shapes`` lists.
    size : length, optional
        The largest dimension, such as ``"400mm"``; a number is in millimetres.
    parameters
        Of the shape, such as ``m=24, n=12``; and options of the mesh, as for :func:`read`.

    Raises
    ------
    InputError
        If there is no such shape or parameter; it lists those that there are.

    Examples
    --------
    >>> import fabweave as fw
    >>> fw.shape("torus", m=24, n=12, size="400mm")
    Mesh('Torus, 24 by 12': 288 vertices, 576 edges, 288 faces, 400.0 × 400.0 × 120.0 mm)
    """
    known = {option.name.replace("-", "_") for option in OPTIONS}
    options = {key: value for key, value in parameters.items() if key in known}
    if size is not None:
        options["size"] = size
    query = "&".join(
        f"{key}={shown(value, form=str)}" for key, value in parameters.items() if key not in known
    )
    return _mesh(
        Stations.read(f"{PREFIX}{shown(name, form=str)}{'?' * bool(query)}{query}", options)
    )


def _mesh(stations: Stations) -> Mesh:
    return Mesh(stations, stations.loaded)


def stations_of(source: Any, options: Mapping[str, Any]) -> Stations:
    """Return the stations for what stands for a mesh: a path, a shape's name, or any mesh."""
    if isinstance(source, Mesh):
        return source.stations.also(options)
    if isinstance(source, str | Path):
        return Stations.read(str(source), options)
    return Stations.read("mesh.obj", options, _polymesh(source, None))


def _polymesh(vertices: Any, faces: Any) -> PolyMesh:
    """Return vertices and faces, or any mesh that has them, as a polygon mesh of its own."""
    if isinstance(vertices, PolyMesh):
        return vertices
    if isinstance(vertices, str | Path):
        raise InputError(f"this is the name of a file: call fabweave.read({str(vertices)!r}, ...)")
    if faces is None:
        vertices, faces = getattr(vertices, "vertices", None), getattr(vertices, "faces", None)
        faces = faces() if callable(faces) else faces
    if vertices is None or faces is None:
        raise InputError(
            "this is no mesh: give vertices and faces, or something that has both, such as "
            "trimesh.Trimesh"
        )
    try:
        return PolyMesh.from_faces(_positions(vertices), _corners(faces))
    except (OverflowError, TypeError, ValueError) as error:
        raise InputError(f"this is no mesh of vertices and faces: {error}") from error


def _positions(vertices: Any) -> FloatArray:
    """Return a copy of vertices, so that the caller's array stays as it is; else raise TypeError.

    A complex number has a part that would be lost.
    """
    positions = np.array(vertices)
    if positions.dtype.kind == "c" or positions.ndim != 2 or positions.shape[1] != 3:
        told = f"{positions.dtype} of shape {positions.shape}"
        raise TypeError(f"vertices are {told}, and must be real numbers (V, 3)")
    return positions.astype(np.float64)


def _corners(faces: Any) -> Any:
    """Return faces as they are, if their corners are whole numbers; else raise TypeError."""
    if hasattr(faces, "__array__") or isinstance(faces, memoryview):
        faces = np.asarray(faces)  # rows of a matrix are matrices again
        if faces.dtype.kind not in "iu" or faces.ndim != 2:
            raise TypeError(f"faces are {faces.ndim}-dimensional {faces.dtype}, not whole numbers")
        return faces
    return [[operator.index(corner) for corner in corners] for corners in faces]


@frozen_value
class Yarns(_Solid):
    """A closed tube along every thread, over and under the others without touching them.

    Made by :meth:`fabweave.Weave.yarns`; nothing is cut of them.
    """

    stations: Stations
    spun: SpunYarns

    @property
    def radius_mm(self) -> FloatArray:
        """The radius of each cross-section, (N,)."""
        return self.spun.radius_mm

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """One closed surface for each thread."""
        woven = self.stations.ribbons
        return yarn_bodies(self.spun, woven.labels, self.stations.colours(woven))

    def _surface(self) -> tuple[FloatArray, IntArray]:
        return joined_bodies(self.bodies)

    def _drawn(self, **look: Any) -> Image.Image:
        from fabweave.picture.object_picture import bodies_picture  # noqa: PLC0415

        return bodies_picture(self.bodies, **look)

    def _title(self) -> str:
        return self.stations.loaded.title

    def _figures(self) -> Mapping[str, Any]:
        least, most = self.radius_mm.min(), self.radius_mm.max()
        return {"yarns": len(self.bodies), "radius, mm": f"{least:.2f} to {most:.2f}"}

    def __repr__(self) -> str:
        yarns, radius = self._figures().values()
        return f"Yarns({self._title()}: {yarns} yarns, {radius} mm in radius)"


class Thread(NamedTuple):
    """One thread of a weave.

    ``crossings`` are the numbers of the crossings that it passes, in walking order, (n,), and
    ``over`` whether it lies on top there, (n,). A closed thread is a ring.
    """

    label: str
    closed: bool
    bunch: int
    crossings: IntArray
    over: BoolArray

    def __repr__(self) -> str:
        kind = "ring" if self.closed else "thread with two ends"
        return f"Thread({self.label}: {kind}, {len(self.crossings)} crossings)"


@frozen_value
class Weave(_Shown):
    """A woven mesh: which threads there are, and which lies on top where two cross.

    Made by :func:`fabweave.weave`; :meth:`ribbons` goes on from here.
    """

    stations: Stations
    woven: WovenMesh

    @property
    def pattern(self) -> str:
        """The pattern, such as ``"twill"``."""
        return self.woven.weave.pattern

    @property
    def threads(self) -> tuple[Thread, ...]:
        """The threads, in the order of their names."""
        threads, over = self.woven.weave.threads, self.woven.weave.over
        bounds = threads.offsets.tolist()
        return tuple(
            Thread(
                label,
                bool(threads.closed[number]),
                int(self.woven.bunches[number]),
                threads.crossing[bounds[number] : bounds[number + 1]],
                over[bounds[number] : bounds[number + 1]],
            )
            for number, label in enumerate(self.woven.labels)
        )

    @property
    def crossings(self) -> IntArray:
        """The mesh edge on which each crossing lies, as two vertices, (X, 2)."""
        halfedges = self.woven.halfedges
        first = self.woven.weave.threads.crossing_halfedge
        return frozen(np.column_stack((halfedges.tail[first], halfedges.head[first])))

    @property
    def exact(self) -> bool:
        """Whether the pattern holds everywhere."""
        return self.woven.weave.exact

    @property
    def reason(self) -> str | None:
        """Why there is no exact twill on this mesh; None where the pattern is exact."""
        twill = self.woven.result.twill
        if twill is None or twill.obstruction is None:
            return None
        return twill.obstruction.text

    @property
    def broken(self) -> dict[str, int]:
        """How many conditions of the pattern are broken, by kind: edge, face, vertex."""
        broken = self.woven.weave.broken
        return {"edge": broken.edge, "face": broken.face, "vertex": broken.vertex}

    @property
    def notes(self) -> tuple[str, ...]:
        """What is worth knowing about the mesh and its weave."""
        return self.woven.notes

    def ribbons(self, **options: Any) -> Ribbons:
        """Lay a ribbon along every thread.

        Parameters
        ----------
        options
            As on the command line: ``material="card"``, ``thickness="0.4mm"``, ``width="12mm"``,
            ``smooth=3``, ``crossing=0.7``, ``clearance="0.1mm"``.

        Returns
        -------
        Ribbons
            With room for two layers at each crossing, and for three, where a joint may lie.

        Raises
        ------
        InputError
            If the material is not known, or an option is wrong.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.weave(fw.shape("octahedron", size="200mm")).ribbons(width="9mm")
        Ribbons(Octahedron: 4 ribbons in Card, 300 g/m², 0.4 mm, 8.9 to 8.9 mm wide, 1.57 m in all)
        """
        stations = self.stations.also(options)
        return Ribbons(stations, stations.ribbons)

    def yarns(self, *, radius: Any = None, sides: int = 12) -> Yarns:
        """Spin a yarn along every thread, for pictures and for printing.

        Parameters
        ----------
        radius : length, optional
            One radius for all; by default, the thickest that have room.
        sides : int
            Sides of the tubes.

        Raises
        ------
        InputError, CannotMakeError
            If yarns of this radius have no room, or radius or sides make no sense.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.weave(fw.shape("tetrahedron", size="60mm")).yarns(radius="3mm")
        Yarns(Tetrahedron: 3 yarns, 3.00 to 3.00 mm in radius)
        """
        from fabweave.job.model import YarnOptions, spin_object  # noqa: PLC0415

        options = YarnOptions(
            None if radius is None else _LENGTH.argument("radius", radius),
            whole(FEWEST_SIDES, MOST_SIDES).argument("sides", sides),
        )
        return Yarns(self.stations, spin_object(self.stations.ribbons, options))

    def picture(self, **look: Any) -> Image.Image:
        """Return a picture of the woven object, with ribbons as they come in card.

        The arguments are those of ``Ribbons.picture``.
        """
        return self.ribbons().picture(**look)

    def __repr__(self) -> str:
        kind, threads, crossings, *_ = self._figures().values()
        return f"Weave({self._title()}: {kind}, {threads} threads, {crossings} crossings)"

    def _title(self) -> str:
        return self.woven.title

    def _figures(self) -> Mapping[str, Any]:
        threads, broken = self.woven.weave.threads, self.woven.weave.broken.total
        turns = self.woven.weave.broken_at_turns
        kind = f"{self.pattern} with {broken} broken conditions"
        return {
            "weave": f"exact {self.pattern}" if self.exact else kind,
            "threads": threads.n_threads,
            "crossings": threads.n_crossings,
            **({"why not exact": self.reason} if self.reason else {}),
            **({"but for": at_turns_text(turns)} if turns else {}),
        }


def weave(mesh: Any, **options: Any) -> Weave:
    """Weave a mesh.

    Parameters
    ----------
    mesh : Mesh, path, or anything with vertices and faces
    options
        As on the command line: ``pattern="twill"`` (plain, twill, triaxial, ``"3/1"``,
        ``"satin:5/2"``), ``boundary="turn"``, ``course="straight"``, ``twists="edges.csv"``,
        ``effort="best"``, ``seed=1``.

    Raises
    ------
    InputError
        If the mesh or an option is bad.
    CannotMakeError
        If the pattern cannot be woven on this mesh, and why.

    References
    ----------
    E. Akleman, J. Chen, Y. Chen, Q. Xing, J. L. Gross, "Cyclic twill-woven objects", Computers &
    Graphics 35 (2011), section 5; an m × n quad torus has 2·gcd(m, n) threads.

    Examples
    --------
    >>> import fabweave as fw
    >>> twill = fw.weave(fw.shape("torus", m=8, n=4), pattern="twill")
    >>> twill
    Weave(Torus, 8 by 4: exact twill, 8 threads, 64 crossings)
    >>> twill.threads[0].over[:8].tolist()
    [False, True, True, False, False, True, True, False]
    """
    stations = stations_of(mesh, options)
    return Weave(stations, stations.weave)


@frozen_value
class Ribbons(_Solid):
    """A ribbon along every thread, in space, with room for what lies above and below it.

    Made by :meth:`fabweave.Weave.ribbons`; :meth:`pieces` goes on from here. Where ribbons would
    come too near to one another they are narrower than elsewhere, unless a width was asked for.
    """

    stations: Stations
    laid: WovenObject

    @property
    def woven(self) -> WovenObject:
        """The woven object as ``fabweave model`` writes it."""
        return self.stations.clear_ribbons

    @property
    def weave(self) -> Weave:
        """The weave that they follow."""
        return Weave(self.stations, self.laid)

    def widget(self) -> Any:
        """Return a widget that shows the object in a notebook: to be turned, with its shadows.

        Raises
        ------
        InputError
            If anywidget is not there, which the extra ``notebook`` brings.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
        >>> type(ribbons.widget()).__name__
        'ObjectWidget'
        """
        try:
            from fabweave.studio.widget import ObjectWidget  # noqa: PLC0415 - it may be absent
        except ImportError as error:
            raise InputError(
                f"widgets need {error.name}: pip install 'fabweave[notebook]'"
            ) from error
        return ObjectWidget(self.stations)

    @property
    def vertices(self) -> FloatArray:
        """Ends of the cross-lines in millimetres, (2 R, 3): right and left by turns."""
        ends = frozen(ribbon_triangles(self.woven.ribbons)[0])
        return self.stations.loaded.where_given(ends)

    @property
    def triangles(self) -> IntArray:
        """The flat facets of all ribbons, (F, 3)."""
        return frozen(ribbon_triangles(self.woven.ribbons)[1])

    @property
    def widths_mm(self) -> FloatArray:
        """The width at every cross-line, (R,)."""
        return frozen(measure_bends(self.woven.ribbons).width_mm)

    @property
    def lengths_mm(self) -> FloatArray:
        """The length of each thread along the middle of its ribbon, (T,)."""
        return frozen(thread_lengths(self.woven.ribbons))

    @property
    def colours(self) -> Colours:
        """Red, green and blue at every cross-line, (R, 3)."""
        return frozen(rung_colours(self.woven.ribbons, self.stations.colours(self.woven)))

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each thread, as ``pandas.DataFrame`` takes them.

        Examples
        --------
        >>> import fabweave as fw
        >>> rows = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().rows()
        >>> [row["thread"] for row in rows], rows[0]["crossings"]
        (['A', 'B', 'C', 'D'], 6)
        """
        threads, bounds = self.woven.weave.threads, self.woven.ribbons.offsets.tolist()
        widths, lengths = self.widths_mm, self.lengths_mm.tolist()
        return [
            {
                "thread": label,
                "closed": bool(threads.closed[number]),
                "bunch": int(self.woven.bunches[number]),
                "crossings": int(threads.lengths[number]),
                "length_mm": lengths[number],
                "narrowest_mm": float(widths[start:end].min(initial=np.inf)),
                "widest_mm": float(widths[start:end].max(initial=0.0)),
            }
            for number, (label, start, end) in enumerate(
                zip(self.woven.labels, bounds[:-1], bounds[1:], strict=True)
            )
        ]

    def to_trimesh(self) -> trimesh.Trimesh:
        """Return the ribbons as ``trimesh.Trimesh`` with the colours of the strands.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("cube", size="200mm")).ribbons()
        >>> len(ribbons.to_trimesh().faces) == len(ribbons.triangles)
        True
        """
        import trimesh  # noqa: PLC0415 - slow to import, and seldom wanted

        vertices, triangles = self._surface()
        shown = np.repeat(self.colours[triangles[::2, 0] // 2], 2, axis=0)
        places = self.stations.loaded.where_given(vertices)
        return trimesh.Trimesh(places, triangles, face_colors=shown, process=False)

    def pieces(self, **options: Any) -> Pieces:
        """Split the threads into flat pieces that lap and are joined.

        Pieces are as short as waste and joints suggest, unless a length is asked for, and fit the
        sheets: what is said of sheets belongs here.

        Parameters
        ----------
        options
            As on the command line: ``max_length="200mm"``, ``joint="rivet:2,lap=15mm"``,
            ``fastener="3.3mm"``, ``sheet="600x400mm:3"`` (or a list of them),
            ``stock="stock.toml"``, ``margin``, ``gap``, ``rotations="90"``.

        Raises
        ------
        InputError
            If an option is wrong.
        CannotMakeError
            If a ribbon is too narrow or too stiff, or no piece fits a sheet; and what would help.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
        >>> ribbons.pieces(max_length="400mm")
        Pieces(Octahedron: 8 pieces, 8 joints, 2 kinds, in Card, 300 g/m², 0.4 mm)
        """
        stations = self.stations.also(options)
        return Pieces(stations, stations.buildable)

    def relax(self, *, pins: float | FloatArray | None = None) -> Settled | None:
        """Let the ribbons go, pinned where they cross, and tell where they come to rest.

        Parameters
        ----------
        pins : float or (X,) float array, optional
            How each crossing resists turning, N mm per radian: by default as strips that only lie
            on one another.

        Returns
        -------
        Settled or None
            None where there are too many crossings.

        Raises
        ------
        InputError
            If pins are no numbers, or not as many as there are crossings.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("sphere?n=3", size="300mm")).ribbons()
        >>> settled = ribbons.relax()
        >>> form, wished, rested = settled.form, settled.wished, settled.rested
        >>> form.keeps, wished.shape, bool(abs(wished - rested).max() < form.bound_mm)
        (True, (108, 3), True)
        """
        body = body_of(self.woven, brief_of(*self.stations.completed))
        if body is None:
            return None
        count = len(body.places)
        pin = real(0.0, _STIFFEST_NMM)
        taken = body.turning_nmm[0]
        if pins is not None:
            taken = either(pin, several(pin, count)).argument("pins", pins)
        return settle(body, np.broadcast_to(np.asarray(taken, dtype=np.float64), (count,)))

    def _surface(self) -> tuple[FloatArray, IntArray]:
        return ribbon_triangles(self.woven.ribbons)[:2]

    def _drawn(self, **look: Any) -> Image.Image:
        from fabweave.picture.object_picture import weave_picture  # noqa: PLC0415

        return weave_picture(self.woven.ribbons, self.stations.colours(self.woven), **look)

    def _title(self) -> str:
        return self.laid.title

    def _figures(self) -> Mapping[str, Any]:
        widths = self.widths_mm
        return {
            "ribbons": len(self.woven.labels),
            "material": self.stations.completed[1].description,
            "width, mm": f"{widths.min():.1f} to {widths.max():.1f}",
            "length in all, m": f"{self.lengths_mm.sum() / 1000:.2f}",
        }

    def __repr__(self) -> str:
        ribbons, material, width, length = self._figures().values()
        return (
            f"Ribbons({self._title()}: {ribbons} ribbons in {material}, {width} mm wide, "
            f"{length} m in all)"
        )


@frozen_value
class Pieces(_Shown):
    """All flat pieces of an object, and how they are joined.

    Made by :meth:`fabweave.Ribbons.pieces`; :meth:`nest` goes on from here. Iterating gives each
    piece with its outline, stations, holes and joints, in millimetres in its own frame.
    """

    stations: Stations
    planned: PlannedJob

    def __len__(self) -> int:
        return len(self.planned.piece_set.pieces)

    def __iter__(self) -> Iterator[Piece]:
        return iter(self.planned.piece_set.pieces)

    def __getitem__(self, number: int) -> Piece:
        return self.planned.piece_set.pieces[number]

    @cached_property
    def polygons(self) -> tuple[shapely.Polygon, ...]:
        """Each piece as a shapely polygon with its holes, nominal, in its own frame.

        Arcs are polygons within 0.01 mm; a round hole has 64 sides.
        """
        return tuple(map(_polygon, self))

    @property
    def kinds(self) -> IntArray:
        """Which kind each piece is of, from 1: congruent pieces of a material are one kind."""
        return self.planned.kinds

    @cached_property
    def costs(self) -> Costs:
        """Times of machine and hands, and money, as far as they are known before nesting."""
        return self.stations.costs

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each piece, as ``pandas.DataFrame`` takes them.

        Examples
        --------
        >>> import fabweave as fw
        >>> pieces = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> sorted(pieces.rows()[0])[:5]
        ['area_mm2', 'crossings', 'end_joint', 'holes', 'id']
        """
        labels = self.planned.woven.labels
        return [
            {
                "id": piece.id,
                "thread": labels[piece.thread],
                "kind": kind,
                "length_mm": float(np.ptp(piece.outline[:, 0])),
                "width_mm": float(np.ptp(piece.outline[:, 1])),
                "area_mm2": polygon.area,
                "crossings": len(piece.crossings),
                "holes": len(piece.holes) + len(piece.slots),
                "start_joint": piece.start_joint,
                "end_joint": piece.end_joint,
            }
            for piece, kind, polygon in zip(self, self.kinds.tolist(), self.polygons, strict=True)
        ]

    def nest(self, **options: Any) -> Layout:
        """Nest the pieces on sheets, each material on its own.

        Parameters
        ----------
        options
            As on the command line: ``effort="quick"``, ``seed=1``, ``layout=FILE``. If sheets are
            named here, and differ from those that the pieces were split for, the threads are split
            anew: the layout's own :attr:`~fabweave.Layout.pieces` are those that lie on it.

        Raises
        ------
        CannotMakeError
            If a piece fits no sheet, or sheets run out; and what would help.

        Examples
        --------
        >>> import fabweave as fw
        >>> pieces = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> pieces.nest(sheet="400x300mm", effort="quick")
        Layout(Octahedron: 8 pieces on 1 sheet, 36 % used)
        """
        stations = self.stations.also(options)
        _ = stations.buildable
        return Layout(stations, stations.layout)

    def picture(self) -> str:
        """Return the pieces side by side, in rows, as SVG."""
        sizes = [np.ptp(piece.outline, axis=0) for piece in self]
        wide, high = (1.1 * np.max(sizes, axis=0)).tolist()
        placed = []
        for number, polygon in enumerate(self.polygons):
            row, column = divmod(number, _COLUMNS)
            left, low, *_ = polygon.bounds
            placed.append(affinity.translate(polygon, column * wide - left, row * high - low))
        rows = -(-len(placed) // _COLUMNS)
        size = min(_COLUMNS, len(placed)) * wide, rows * high
        return outlines_svg(*size, placed, self.planned.piece_colours)

    def _title(self) -> str:
        return self.planned.woven.title

    def _figures(self) -> Mapping[str, Any]:
        return {
            "pieces": len(self),
            "joints": len(self.planned.piece_set.joints),
            "kinds": len(np.unique(self.kinds)),
            "material": self.planned.supplies.description,
        }

    def __repr__(self) -> str:
        pieces, joints, kinds, material = self._figures().values()
        return (
            f"Pieces({self._title()}: {pieces} pieces, {joints} joints, {kinds} kinds, "
            f"in {material})"
        )


def _polygon(piece: Piece) -> shapely.Polygon:
    """Return a piece as a polygon with its round holes and slots, in its own frame."""
    holes = [
        shapely.Point(x, y).buffer(diameter / 2, quad_segs=16).exterior
        for _, x, y, diameter in piece.holes.tolist()
    ]
    slots = [shapely.LinearRing(inscribed_polygon(slot.path)) for slot in piece.slots]
    return shapely.Polygon(piece.outline, [*holes, *slots])


@frozen_value
class Layout(_Shown):
    """Where each piece lies on which sheet.

    Made by :meth:`fabweave.Pieces.nest`; :meth:`write` goes on from here.
    """

    stations: Stations
    nested: NestedLayout

    @cached_property
    def pieces(self) -> Pieces:
        """The pieces that lie on the sheets."""
        return Pieces(self.stations, self.stations.planned)

    @property
    def sheets(self) -> tuple[SheetSize, ...]:
        """The sheets in use, with their sizes in millimetres."""
        return self.nested.sheets

    @cached_property
    def polygons(self) -> tuple[shapely.Polygon, ...]:
        """Each piece and spare where it lies on its sheet, as a shapely polygon with holes."""
        placed = []
        own, origins = self.pieces.polygons, self.pieces.planned.origins.tolist()
        for origin, place in zip(origins, self.nested.placements, strict=True):
            turned = affinity.rotate(own[origin], place.rotation_deg, origin=(0, 0))
            placed.append(affinity.translate(turned, place.x_mm, place.y_mm))
        return tuple(placed)

    @property
    def colours(self) -> Colours:
        """Red, green and blue of each piece, as it is shown in the object, (N, 3)."""
        return frozen(self.pieces.planned.piece_colours)

    @property
    def utilisation(self) -> FloatArray:
        """What share of each sheet becomes pieces, holes taken off, (S,)."""
        used = np.zeros(len(self.sheets))
        for polygon, place in zip(self.polygons, self.nested.placements, strict=True):
            used[place.sheet] += polygon.area
        return frozen(used / [sheet.area_mm2 for sheet in self.sheets])

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each piece and spare, as ``pandas.DataFrame`` takes them.

        A point p of the piece lies at R(rotation_deg) p + (x_mm, y_mm) on its sheet. Sheets are
        numbered from 1, as their files are.

        Examples
        --------
        >>> import fabweave as fw
        >>> ball = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> list(ball.nest(effort="quick").rows()[0])
        ['id', 'sheet', 'rotation_deg', 'x_mm', 'y_mm']
        """
        return [
            {
                "id": piece.id,
                "sheet": place.sheet + 1,
                "rotation_deg": place.rotation_deg,
                "x_mm": place.x_mm,
                "y_mm": place.y_mm,
            }
            for piece, place in zip(self.pieces.planned.to_cut, self.nested.placements, strict=True)
        ]

    def write(self, folder: str | Path, **options: Any) -> WrittenJob:
        """Write the finished job, and prove the written files.

        Parameters
        ----------
        folder : str or Path
            New, empty, or an older job's folder, which is replaced.
        options
            Of files, as on the command line: ``kerf="0.15mm"``, ``preset="glowforge"``,
            ``labels="numbers"``, ``dxf="R12"``, ``profile="service"``, ``paper="letter"`` …

        Returns
        -------
        WrittenJob
            The same bytes as ``fabweave make`` writes with the same options.

        Raises
        ------
        InputError
            If the folder holds anything but a job, or an option is wrong.
        CannotMakeError
            If a rule is broken under ``strict=True``, or a check objects to the files.

        Examples
        --------
        >>> import fabweave as fw, tempfile, pathlib
        >>> ball = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> layout = ball.nest(effort="quick")
        >>> layout.write(pathlib.Path(tempfile.mkdtemp()) / "ball").proof.ok
        True
        """
        stations, directory = self.stations.also(options), folder_at(folder)
        layout = Layout(stations, stations.layout)
        clear_abandoned(directory)
        with told_where(directory), finished_folder(directory) as fresh:
            return WrittenJob(directory, *write_and_prove(draw_stations(stations), fresh), layout)

    def picture(self, sheet: int = 1) -> str:
        """Return a sheet, counted from 1, as SVG; InputError if there is no such sheet."""
        sheet = whole(1, len(self.sheets)).argument("sheet", sheet)
        places, planned = self.nested.placements, self.pieces.planned
        lying = [number for number, place in enumerate(places) if place.sheet == sheet - 1]
        size, colours = self.sheets[sheet - 1], planned.piece_colours[planned.origins[lying]]
        polygons = [self.polygons[number] for number in lying]
        return outlines_svg(size.width_mm, size.height_mm, polygons, colours)

    def _title(self) -> str:
        pieces = agree(len(self.nested.placements), "{n} piece[|s]")
        sheets = agree(len(self.sheets), "{n} sheet[|s]")
        return f"{self.pieces.planned.woven.title}: {pieces} on {sheets}"

    def _figures(self) -> Mapping[str, Any]:
        return {
            f"sheet {number}": f"{100 * used:.0f} % used"
            for number, used in enumerate(self.utilisation.tolist(), start=1)
        }

    def __repr__(self) -> str:
        return f"Layout({self._title()}, {100 * self.utilisation.mean():.0f} % used)"


@frozen_value
class WrittenJob(_Shown):
    """A finished job in its folder, with the proof of its files.

    Made by :func:`fabweave.make` and :meth:`fabweave.Layout.write`.

    Parameters
    ----------
    folder : Path
    job : Job
        Everything that was made: weave, ribbons, pieces, layout and drawings.
    proof : VerifyReport
        What was proved about the written files, check by check.
    preflight : Preflight
        Which rules of the material and of those who cut the pieces break.
    missing : tuple of str
        The papers that could not be made, each with the reason; none in most jobs.
    layout : Layout
    chosen : str
        Which coarser mesh was woven in place of one that cannot be built; empty where none was.
    """

    folder: Path
    job: Job
    proof: VerifyReport
    preflight: Preflight
    missing: tuple[str, ...]
    layout: Layout
    chosen: str = ""

    @property
    def pieces(self) -> Pieces:
        """The flat pieces."""
        return self.layout.pieces

    @property
    def weave(self) -> Weave:
        """The weave."""
        return Weave(self.layout.stations, self.job.woven)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a maker should know before cutting."""
        return self.job.notes

    @property
    def files(self) -> tuple[Path, ...]:
        """The files in the folder, in the order of their names."""
        return tuple(sorted(path for path in self.folder.rglob("*") if path.is_file()))

    @property
    def costs(self) -> Costs:
        """Times of machine and hands, and money, each a range."""
        return self.job.costs

    def picture(self) -> Image.Image:
        """Return the picture of the woven object."""
        with Image.open(self.folder / "render.png") as picture:
            return picture.copy()

    def _title(self) -> str:
        return self.job.woven.title

    def _figures(self) -> Mapping[str, Any]:
        return {
            "pieces": agree(len(self.job.piece_set.pieces), "{n} piece[|s]"),
            "joints": agree(len(self.job.piece_set.joints), "{n} joint[|s]"),
            "sheets": agree(len(self.job.drawings), "{n} sheet[|s]"),
            "proof": f"proved by {len(self.proof.checks)} checks",
            "folder": self.folder,
        }

    def __repr__(self) -> str:
        *counts, _ = self._figures().values()
        return f"WrittenJob({str(self.folder)!r}: {', '.join(counts)})"


class Inspection(Facts, _Shown):
    """What a mesh is and what can be woven on it, before anything is decided.

    Made by :func:`fabweave.inspect`. ``facts`` holds everything as plain values, as
    ``fabweave inspect --json`` prints it.
    """

    @property
    def text(self) -> str:
        """All of it in words, as ``fabweave inspect`` prints it."""
        rows = inspection_text(self.facts)
        return "\n".join(f"{topic + ': ' if topic else '  '}{words}" for topic, words in rows)

    def picture(self) -> Image.Image:
        """Return a picture of the mesh with its irregular vertices, beside the woven object."""
        return inspection_picture(self)

    def __repr__(self) -> str:
        mesh, twill = self.facts["mesh"], self.facts["twill"]
        return (
            f"Inspection({self._title()}: {mesh['faces']} faces, genus "
            f"{mesh['genus']}, {self.facts['threads']['count']} threads; 2/2 twill "
            f"{'exact' if twill['exact'] else 'not exact'})"
        )

    def _title(self) -> str:
        return self.woven.title

    def _figures(self) -> Mapping[str, Any]:
        figures: dict[str, str] = {}
        last = ""
        for topic, words in inspection_text(self.facts):
            # A line without a topic goes on with the one above.
            last, before = (topic, "") if topic or not figures else (last, figures[last] + "; ")
            figures[last] = before + words
        return figures


def _work(workers: Any, executors: Any) -> tuple[int, Executors]:
    """Return how many processes work beside this one, and what opens who does parts of the work."""
    count = min(whole(0, _MOST_WORKERS).argument("workers", workers), os.cpu_count() or 1)
    if executors is None:
        return count, processes(count)
    if not isinstance(executors, Executor):
        raise InputError(
            f"executors: {shown(executors)} is no concurrent.futures.Executor, such as "
            "ProcessPoolExecutor(), or Client(...).get_executor() of dask.distributed"
        )
    return count, guest(executors)


@frozen_value
class Design(_Shown):
    """A design of a model that was tried: how it would be woven, and what it comes to.

    Made by :func:`fabweave.design`; :meth:`write` makes it. ``figures`` has pieces, sheets, hours,
    price, grade and more.
    """

    stations: Stations
    tried: Tried
    figures: Figures

    @property
    def name(self) -> str:
        """What sets it apart."""
        return self.tried.name

    def write(
        self, folder: str | Path, *, progress: Progress = no_progress, workers: int = 0,
        executors: Executor | None = None, **options: Any,
    ) -> WrittenJob:  # fmt: skip
        """Make it, as :func:`make` does, with more options if need be."""
        directory, told = folder_at(folder), _PROGRESS.argument("progress", progress)
        count, opens = _work(workers, executors)
        stations = self.stations.also(options)
        stations.progress = told
        made = run_job(stations, directory, workers=count, executors=opens)
        return WrittenJob(directory, *made, Layout(stations, stations.layout))

    def picture(self) -> Image.Image:
        """Return the picture of the woven object."""
        return Image.open(io.BytesIO(self.tried.picture or b""))

    def _title(self) -> str:
        return self.name

    def _figures(self) -> Mapping[str, Any]:
        return {"pieces": self.figures.pieces, "sheets": self.figures.sheets} | {
            "hours": " to ".join(f"{hours:.1f}" for hours in self.figures.hours or ())
        }

    def __repr__(self) -> str:
        return f"Design({self.tried.brief})"


def design(
    mesh: Any, *, tries: int = 9, pieces: int | None = None, goal: str = "",
    progress: Progress = no_progress, workers: int = 0, executors: Executor | None = None,
    **options: Any,
) -> tuple[Design, ...]:  # fmt: skip
    """Try designs of a model, from coarse to fine or for a goal, and return the best first.

    Parameters
    ----------
    mesh, pieces, goal, progress, workers, executors, options
        As for :func:`make`; what options state is the same in every design.
    tries : int
        How many designs are tried at most.

    Returns
    -------
    tuple of Design
        Those that can be built, the same with any executor.

    Raises
    ------
    InputError, CannotMakeError
        If the mesh is bad, or no design can be built.

    Examples
    --------
    >>> import fabweave as fw
    >>> best, *others = fw.design("shape:cube?n=2", tries=3, size="200mm", effort="quick")
    >>> best.figures.pieces > 0
    True
    """
    wishes = _wishes(goal, pieces)
    stations = stations_of(mesh, options)
    search = Search(
        stations.asked, stations.given, progress=_PROGRESS.argument("progress", progress),
        executors=_work(workers, executors)[1], wishes=wishes, looks=True,
    )  # fmt: skip
    seek(search, whole(1, _MOST_DESIGNS).argument("tries", tries))
    choose(search.tried, wishes)
    return tuple(
        Design(stations.instead(one.design), one, one.figures)
        for one in search.ranked
        if one.makeable and one.figures is not None
    )


def _wishes(goal: str, pieces: int | None) -> Wishes:
    """Return what is wished for."""
    if pieces is not None:
        pieces = whole(1, _MOST_PIECES).argument("pieces", pieces)
    return parse_wishes(shown(goal, form=str), pieces)


def make(
    mesh: Any, folder: str | Path, *, progress: Progress = no_progress, workers: int = 0,
    executors: Executor | None = None, pieces: int | None = None, goal: str = "", **options: Any,
) -> WrittenJob:  # fmt: skip
    """Make a whole job, as ``fabweave make`` does: from a mesh to a proved folder.

    Where a model is too fine to be built as it is, a coarser mesh is woven, and ``chosen`` of the
    job says which; ``remesh="none"`` keeps the mesh.

    Parameters
    ----------
    mesh : path, shape, Mesh, or anything with vertices and faces
        A file's name, ``"shape:torus?m=24&n=12"``, what :func:`fabweave.read` gives, or a mesh
        in memory, such as ``trimesh.Trimesh``.
    folder : str or Path
        New, empty, or an older job's folder, which is replaced when the new one is proved.
    progress : callable, optional
        Called as ``progress(what, done, total)``.
    workers : int
        Processes beside this one; the same bytes are written with any number.
    executors : Executor, optional
        Any `concurrent.futures.Executor`, here or on many machines, that tries designs and nests
        pieces in place of those processes. What it loses is done again. It is not shut down.
    pieces : int, optional
        About so many pieces: mesh, pattern and width are picked for that.
    goal : str
        Wishes to meet, such as ``"hours=5,ribbon=15mm"``.
    options
        Any option of ``fabweave make``, ``-`` written ``_``: ``size="400mm"``,
        ``pattern="twill"``, ``material="card"``, ``kerf="0.15mm"``; ``fabweave guide options``
        lists them all.

    Returns
    -------
    WrittenJob

    Raises
    ------
    InputError
        For a bad mesh or option, or a folder with anything else in it.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.

    Examples
    --------
    >>> import fabweave as fw, tempfile
    >>> folder = tempfile.mkdtemp()
    >>> job = fw.make("shape:octahedron", folder, size="200mm", effort="quick")
    >>> job.proof.ok, len(job.pieces)
    (True, 8)
    """
    count, opens = _work(workers, executors)
    wishes = _wishes(goal, pieces)
    progress = _PROGRESS.argument("progress", progress)
    directory = folder_at(folder)
    stations = stations_of(mesh, {**goal_options(goal), **options})
    stations.progress = progress
    finished, job, chosen = make_or_advise(
        stations,
        directory,
        workers=count,
        executors=opens,
        wishes=wishes,
    )
    return WrittenJob(directory, *finished, Layout(job, job.layout), chosen)


@frozen_value
class WrittenBatch:
    """The jobs of a batch in their folders.

    Made by :func:`fabweave.batch`.

    Parameters
    ----------
    folder : Path
    made, kept : tuple of str
        The jobs that were made now, and those that were there already.
    failed : dict
        Why others were not made, by their names.
    together : tuple of Path
        The folders of sheets that jobs share; ``queue.json`` there says what that saves.
    """

    folder: Path
    made: tuple[str, ...]
    kept: tuple[str, ...]
    failed: dict[str, str]
    together: tuple[Path, ...]


def batch(
    jobs: str | Path | Mapping[str, Mapping[str, Any]], folder: str | Path, *,
    together: bool = False, told: Callable[[str, str], None] = lambda _name, _why: None,
    progress: Progress = no_progress, workers: int = 0, executors: Executor | None = None,
) -> WrittenBatch:  # fmt: skip
    """Make many jobs, as ``fabweave batch`` does: each a proved folder, and a page of all.

    What is there already is kept, and what cannot be made does not stop the rest.

    Parameters
    ----------
    jobs : path or mapping
        A file of jobs (TOML or CSV), or options by the names of the jobs. ``mesh`` is anything that
        :func:`make` takes.
    folder : str or Path
        Holds the folders of the jobs.
    together : bool
        Whether jobs of one material share sheets.
    told : callable
        Called as ``told(name, why)`` with each job; ``why`` is empty if it was made.
    progress, workers, executors
        As for :func:`make`; here, whole jobs are the parts of the work.

    Raises
    ------
    InputError
        If the file of jobs is wrong, or the folder cannot be written.

    Examples
    --------
    >>> import fabweave as fw, tempfile
    >>> common = {"size": "120mm", "effort": "quick"}
    >>> jobs = {name: {"mesh": f"shape:{name}", **common} for name in ("octahedron", "sphinx")}
    >>> done = fw.batch(jobs, tempfile.mkdtemp())
    >>> done.made, sorted(done.failed)
    (('octahedron',), ['sphinx'])
    """
    together = flag().argument("together", together)
    if not isinstance(jobs, str | Path | Mapping):
        raise InputError(f"jobs are a mapping, or the path of a list of them, not {shown(jobs)}")
    asked = batch_of(jobs) if isinstance(jobs, Mapping) else read_batch(Path(jobs))
    directory = folder_at(folder)
    outcome = run_batch(
        replace(asked, together=asked.together or together),
        directory,
        read=stations_of,
        executors=_work(workers, executors)[1],
        told=told,
        progress=_PROGRESS.argument("progress", progress),
    )
    return WrittenBatch(
        directory, outcome.made, outcome.kept, dict(outcome.failed), outcome.together
    )


def inspect(
    mesh: Any, *, progress: Progress = no_progress, thorough: bool = False, designs: int = 0,
    workers: int = 0, executors: Executor | None = None, **options: Any,
) -> Inspection:  # fmt: skip
    """Tell what a mesh is, which weaves are exact on it, and what would make them so.

    Parameters
    ----------
    mesh, progress, workers, executors, options
        As for :func:`make`; options of files are of no account.
    thorough : bool
        Whether to tell what takes long of large meshes, too; else ``facts["left_out"]`` names it.
    designs : int
        How many designs from coarse to fine to try.

    Returns
    -------
    Inspection
        ``facts`` holds everything as plain values, ``text`` says it in words.

    Raises
    ------
    InputError, CannotMakeError
        If the mesh cannot be woven at all.

    Examples
    --------
    >>> import fabweave as fw
    >>> report = fw.inspect("shape:cube", size="200mm")
    >>> report.facts["threads"]["count"], report.facts["twill"]["exact"]
    (4, False)
    """
    progress = _PROGRESS.argument("progress", progress)
    thorough = flag().argument("thorough", thorough)
    stations = stations_of(mesh, options)
    stations.progress = progress
    count = whole(0, _MOST_DESIGNS).argument("designs", designs)
    found = inspect_mesh(
        stations, thorough=thorough, n_designs=count, looks=count > 0,
        executors=_work(workers, executors)[1],
    )  # fmt: skip
    return Inspection(found.woven, found.facts, found.designs)


def verify(folder: str | Path) -> VerifyReport:
    """Read the files of a finished job back and prove that they rebuild the weave.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    VerifyReport
        ``ok``, and ``checks`` with what each proves and finds.

    Raises
    ------
    InputError
        If there is no such folder.

    Examples
    --------
    >>> import fabweave as fw, tempfile
    >>> fw.verify(tempfile.mkdtemp()).ok  # an empty folder is no job
    False
    """
    directory = folder_at(folder)
    folder_is_readable(directory)
    return verify_job(directory)
