"""Write models: GLB, OBJ, PLY, STL, 3MF and Rhino's 3DM."""

import io
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import trimesh

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.model.bodies import Body, common_colour
from fabweave.model.gltf import METRES, glb_bytes, paint_of

#: Rhino 7 and later read it.
_RHINO_VERSION = 7
_HEADER = b"fabweave, millimetres"
_3MF = "http://schemas.microsoft.com/3dmanufacturing"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"


def model_bytes(suffix: str, bodies: Sequence[Body]) -> bytes:
    """Return a model file's content.

    Parameters
    ----------
    suffix : str
        ``.glb`` (metres, as glTF has it; one node a thread), ``.obj`` (one object a thread),
        ``.ply``, ``.stl``, ``.3mf`` or ``.3dm`` (with the extra ``rhino``): all in millimetres,
        which 3MF and 3DM state, and the comments of OBJ, PLY and STL.
    bodies : sequence of Body
        The threads.

    Returns
    -------
    bytes
        The same for the same bodies, but for 3DM, which holds random ids.

    Raises
    ------
    InputError
        If there is no such format, or it needs a package that is not installed.
    """
    writers: dict[str, Callable[[Sequence[Body]], bytes]] = {
        ".glb": _glb,
        ".obj": _obj,
        ".ply": _ply,
        ".stl": _stl,
        ".3mf": _3mf,
        ".3dm": _3dm,
    }
    writer = writers.get(suffix)
    if writer is None:
        raise InputError(f"no model is written as {suffix!r}; choose {', '.join(writers)}")
    return writer(bodies)


def require_rhino() -> None:
    """Raise InputError unless 3DM files can be written."""
    try:
        import_module("rhino3dm")
    except ImportError:
        raise InputError(
            "writing .3dm needs the package rhino3dm: pip install 'fabweave[rhino]'; "
            "Rhino reads .obj, too"
        ) from None


def _glb(bodies: Sequence[Body]) -> bytes:
    scene = trimesh.Scene()
    for body in bodies:
        mesh = trimesh.Trimesh(
            body.vertices * METRES,
            body.all_triangles,
            vertex_normals=body.normals,
            process=False,
        )
        mesh.visual = paint_of(body.colours)
        scene.add_geometry(mesh, node_name=body.label, geom_name=body.label)
    return glb_bytes(scene, include_normals=bodies[0].normals is not None)


def _obj(bodies: Sequence[Body]) -> bytes:
    lines = ["# fabweave; units: millimetres"]
    base = 1
    for body in bodies:
        lines.append(f"o {body.label}\ng {body.label}")
        rows = np.concatenate((body.vertices, body.colours / 255), axis=1)
        lines.append(_rows("v %.6f %.6f %.6f %.4g %.4g %.4g", rows))
        lines.append(_rows("f %d %d %d %d", body.quads + base))
        lines.append(_rows("f %d %d %d", body.triangles + base))
        base += len(body.vertices)
    return ("\n".join(filter(None, lines)) + "\n").encode("ascii")


def _rows(form: str, values: FloatArray | IntArray) -> str:
    """Return one line for each row of an array."""
    return "\n".join([form] * len(values)) % tuple(values.ravel().tolist())


def _ply(bodies: Sequence[Body]) -> bytes:
    vertex = np.dtype([("place", "<f4", 3), ("colour", "u1", 3)])
    count = sum(len(body.vertices) for body in bodies)
    vertices, faces, base = np.zeros(count, dtype=vertex), [], 0
    for body in bodies:
        own = slice(base, base + len(body.vertices))
        vertices["place"][own], vertices["colour"][own] = body.vertices, body.colours
        # Several readers take lists of one length only, so there are no quads here.
        rows = np.zeros(len(body.all_triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, body.all_triangles + base
        faces.append(rows.tobytes())
        base = own.stop
    n_faces = sum(len(body.all_triangles) for body in bodies)
    head = [
        "ply", "format binary_little_endian 1.0", "comment fabweave; units: millimetres",
        f"element vertex {count}", "property float x", "property float y", "property float z",
        "property uchar red", "property uchar green", "property uchar blue",
        f"element face {n_faces}", "property list uchar int vertex_indices", "end_header",
    ]  # fmt: skip
    return ("\n".join(head) + "\n").encode("ascii") + vertices.tobytes() + b"".join(faces)


def _stl(bodies: Sequence[Body]) -> bytes:
    corners = np.concatenate([body.vertices[body.all_triangles] for body in bodies])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    rows = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]
    )
    rows["normal"], rows["corners"] = normal / np.where(size > 0.0, size, 1.0), corners
    return _HEADER.ljust(80) + np.uint32(len(rows)).astype("<u4").tobytes() + rows.tobytes()


def _3mf(bodies: Sequence[Body]) -> bytes:
    objects, items = [], []
    bases: list[str] = []
    for number, body in enumerate(bodies):
        shown, index = np.unique(body.triangle_colours, axis=0, return_inverse=True)
        first = len(bases)
        bases += [
            f'<base name={quoteattr(body.label)} displaycolor="#{bytes(colour).hex().upper()}"/>'
            for colour in shown
        ]
        vertices = _rows('<vertex x="%.6f" y="%.6f" z="%.6f"/>', body.vertices)
        triangles = _rows('<triangle v1="%d" v2="%d" v3="%d"/>', body.all_triangles)
        if len(shown) > 1:
            corners = np.column_stack((body.all_triangles, first + index.reshape(-1)))
            triangles = _rows('<triangle v1="%d" v2="%d" v3="%d" pid="1" p1="%d"/>', corners)
        objects.append(
            f'<object id="{number + 2}" type="model" name={quoteattr(body.label)} pid="1" '
            f'pindex="{first}"><mesh>\n<vertices>\n{vertices}\n</vertices>\n<triangles>\n'
            f"{triangles}\n</triangles>\n</mesh></object>\n"
        )
        items.append(f'<item objectid="{number + 2}"/>')
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    model = (
        f'{head}<model unit="millimeter" xml:lang="en-US" xmlns="{_3MF}/core/2015/02">\n'
        f'<resources>\n<basematerials id="1">{"".join(bases)}</basematerials>\n{"".join(objects)}'
        f"</resources>\n<build>{''.join(items)}</build>\n</model>\n"
    )
    types = (
        f'{head}<Types xmlns="{_PACKAGE}/content-types"><Default Extension="rels" ContentType='
        '"application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" '
        'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
    )
    rels = (
        f'{head}<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="rel0" '
        f'Target="/3D/3dmodel.model" Type="{_3MF}/2013/01/3dmodel"/></Relationships>\n'
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (
            ("[Content_Types].xml", types), ("_rels/.rels", rels), ("3D/3dmodel.model", model),
        ):  # fmt: skip
            # A fixed date, so that the same model gives the same bytes.
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return file.getvalue()


def _3dm(bodies: Sequence[Body]) -> bytes:
    require_rhino()
    rhino = import_module("rhino3dm")
    document = rhino.File3dm()
    document.Settings.ModelUnitSystem = rhino.UnitSystem.Millimeters
    for body in bodies:
        mesh = rhino.Mesh()
        for x, y, z in body.vertices.tolist():
            mesh.Vertices.Add(x, y, z)
        for corners in (*body.quads.tolist(), *body.triangles.tolist()):
            mesh.Faces.AddFace(*corners)
        mesh.Normals.ComputeNormals()
        attributes = rhino.ObjectAttributes()
        attributes.Name = body.label
        attributes.ObjectColor = (*common_colour(body.colours), 255)
        if body.colour is None:
            for red, green, blue in body.colours.tolist():
                mesh.VertexColors.Add(red, green, blue)
        attributes.ColorSource = rhino.ObjectColorSource.ColorFromObject
        document.Objects.AddMesh(mesh, attributes)
    with tempfile.TemporaryDirectory() as folder:  # the library writes files only
        path = Path(folder) / "model.3dm"
        if not document.Write(str(path), _RHINO_VERSION):
            raise CannotMakeError(
                "rhino3dm could not write the model; write .obj, which Rhino reads"
            )
        return path.read_bytes()
