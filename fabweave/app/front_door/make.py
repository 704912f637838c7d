"""Make, inspect and prove whole jobs from Python."""

import os
from pathlib import Path
from typing import Any

from fabweave.app.design.making import make_or_advise
from fabweave.app.front_door.inspected import Inspection
from fabweave.app.front_door.layout import Layout
from fabweave.app.front_door.mesh import Mesh, request_of
from fabweave.app.front_door.pieces import Pieces
from fabweave.app.front_door.ribbons import Ribbons
from fabweave.app.front_door.stations import Stations
from fabweave.app.front_door.weave import Weave
from fabweave.app.front_door.written import WrittenJob
from fabweave.app.inspection.facts import inspect_mesh
from fabweave.app.job_folder import folder_at, folder_is_readable
from fabweave.core.arrays import Progress, no_progress
from fabweave.verify import VerifyReport, verify_job


def make(
    mesh: Any, folder: str | Path, *, progress: Progress = no_progress, workers: int = 0,
    **options: Any,
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
    folder, request = folder_at(folder), request_of(mesh, options)
    finished, settings, chosen = make_or_advise(
        request.settings,
        folder,
        progress,
        mesh=request.given,
        workers=min(workers, os.cpu_count() or 1),
    )
    job = finished.job
    if chosen:  # what other options change is made of the mesh that was taken
        request = request.also({"remesh": settings.remesh, "bodies": settings.bodies})
    stations = Stations(request, job.woven.source, weave=job.woven, planned=job, layout=job.layout)
    ribbons = Ribbons(stations, Weave(stations, Mesh(stations)))
    layout = Layout(stations, Pieces(stations, ribbons))
    return WrittenJob(folder, finished, layout, chosen)


def inspect(
    mesh: Any, *, progress: Progress = no_progress, thorough: bool = False, **options: Any
) -> Inspection:
    """Tell what a mesh is, which weaves are exact on it, and what would make them so.

    Parameters
    ----------
    mesh, progress, options
        As for :func:`make`; options of files are of no account.
    thorough : bool
        Whether to tell what takes long of large meshes, too; else ``facts["left_out"]`` names it.

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
    request = request_of(mesh, options)
    return Inspection(inspect_mesh(request.settings, progress, request.given, thorough=thorough))


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
