"""Write models: GLB, OBJ, PLY, STL and 3MF."""

import io
import zipfile
from collections.abc import Callable, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply
from trimesh.exchange.stl import export_stl

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.colour_space import Colours, light_of
from fabweave.core.errors import InputError
from fabweave.picture.bodies import Body, joined_bodies
from fabweave.picture.surfaces import rung_colours
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.ribbon.stretches import facet_vertices

#: glTF counts in metres.
METRES = 0.001


def linear(colour: Colours) -> list[float]:
    """Return the light of a colour in sRGB, as glTF takes it."""
    return np.round(light_of(colour), 4).tolist()


def paint_of(colours: Colours) -> trimesh.visual.TextureVisuals:
    """Return the paint of a body whose vertices have these colours in sRGB, (V, 3).

    A body of one colour has a material of that colour; else the material is white, and vertices
    have colours, in linear light as glTF wants it.
    """
    if not np.any(colours != colours[:1]):
        return painted(linear(colours[0]))
    visual = painted([1.0, 1.0, 1.0])
    light = np.round(255.0 * light_of(colours)).astype(np.uint8)
    whole = np.full((len(light), 1), 255, dtype=np.uint8)
    visual.vertex_attributes["color"] = np.concatenate((light, whole), axis=1)
    return visual


def painted(light: list[float]) -> trimesh.visual.TextureVisuals:
    """Return a dull, opaque material that is seen from both sides."""
    return trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            baseColorFactor=[*light, 1.0],
            metallicFactor=0.0,
            roughnessFactor=0.8,
            doubleSided=True,
        )
    )


def glb_bytes(scene: trimesh.Scene, **options: Any) -> bytes:
    """Return a scene as binary glTF."""

    def state_up(tree: dict[str, Any]) -> None:
        tree["asset"]["extras"] = {"up": "z"}  # the standard says y, and woven objects have z

    exported = scene.export(file_type="glb", tree_postprocessor=state_up, **options)
    if not isinstance(exported, bytes):
        raise TypeError("the glTF exporter returned no bytes")
    return exported


_3MF = "http://schemas.microsoft.com/3dmanufacturing"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"


def model_bytes(suffix: str, bodies: Sequence[Body]) -> bytes:
    """Return a model file's content.

    Parameters
    ----------
    suffix : str
        ``.glb`` (metres, as glTF has it; one node a thread), ``.obj`` (one object a thread),
        ``.ply``, ``.stl`` or ``.3mf``: all in millimetres, which 3MF states, and the comment of
        OBJ.
    bodies : sequence of Body
        The threads.

    Returns
    -------
    bytes
        The same for the same bodies.

    Raises
    ------
    InputError
        If there is no such format.
    """
    writers: dict[str, Callable[[Sequence[Body]], bytes]] = {
        ".glb": _glb,
        ".obj": _obj,
        ".ply": lambda bodies: export_ply(_whole(bodies)),
        ".stl": lambda bodies: export_stl(_whole(bodies)),
        ".3mf": _3mf,
    }
    writer = writers.get(suffix)
    if writer is None:
        raise InputError(f"no model is written as {suffix!r}; choose {', '.join(writers)}")
    return writer(bodies)


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


def _whole(bodies: Sequence[Body]) -> trimesh.Trimesh:
    """Return all bodies as one mesh: several readers take triangles only, so there are no quads."""
    colours = np.concatenate([body.colours for body in bodies])
    return trimesh.Trimesh(*joined_bodies(bodies), vertex_colors=colours, process=False)


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


#: The balls at findings: radius relative to the object, and a magenta that no thread has.
_MARKER, _MARKER_COLOUR = 0.012, [0.7, 0.0, 0.35]


def ribbon_faces(ribbons: Ribbons, thread: int) -> IntArray:
    """Return the triangles of one ribbon, two for each quad, in order along the strip.

    Vertex ``2 r`` is the right and ``2 r + 1`` the left end of the thread's rung ``r``.
    """
    start, end = ribbons.offsets[thread : thread + 2].tolist()
    steps = np.arange(start, end if ribbons.closed[thread] else end - 1)
    return facet_vertices(ribbons, steps) - 2 * start


def woven_glb(
    ribbons: Ribbons,
    labels: Sequence[str],
    colours: Colours,
    findings: Sequence[BrokenRule] = (),
    *,
    parts: int = 1,
) -> bytes:
    """Return the woven object as binary glTF: one node for each thread, named by its label.

    Each mesh's ``extras`` say whether the thread is closed and, for every crossing along it, at
    which rung its panel begins (``entry``) and ends (``exit``). Colours are those of
    passes or of threads, as ``rung_colours`` takes them. A ball in a colour of its own stands at
    the place of every finding; its node is named ``finding-1-bend`` and so on, and its ``extras``
    hold the ``finding``'s number. Panels lead over so many ``parts``.
    """
    shown = rung_colours(ribbons, colours)
    scene = trimesh.Scene()
    for thread, label in enumerate(labels):
        start, end = ribbons.offsets[thread : thread + 2]
        if start == end:
            continue
        rails = np.stack((ribbons.right[start:end], ribbons.left[start:end]), axis=1)
        passes = slice(ribbons.pass_offsets[thread], ribbons.pass_offsets[thread + 1])
        entry = ribbons.entry[passes] - start
        mesh = trimesh.Trimesh(
            rails.reshape(-1, 3) * METRES,
            ribbon_faces(ribbons, thread),
            process=False,
            metadata={
                "closed": bool(ribbons.closed[thread]),
                "entry": entry.tolist(),
                "exit": ((entry + parts) % (end - start)).tolist(),
            },
        )
        mesh.visual = paint_of(np.repeat(shown[start:end], 2, axis=0))
        scene.add_geometry(mesh, node_name=label, geom_name=label)
    for number, ball in enumerate(_markers(ribbons, findings), start=1):
        name = f"finding-{number}-{findings[number - 1].rule}"
        scene.add_geometry(ball, node_name=name, geom_name=name)
    return glb_bytes(scene)


def _markers(ribbons: Ribbons, findings: Sequence[BrokenRule]) -> list[trimesh.Trimesh]:
    """Return a ball at the place of each finding."""
    corners = np.concatenate((ribbons.left, ribbons.right))
    size = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.0
    balls = []
    for number, found in enumerate(findings, start=1):
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_MARKER * size * METRES)
        ball.apply_translation(np.array(found.position) * METRES)
        ball.metadata = {"finding": number, "rule": found.rule}
        ball.visual = painted(_MARKER_COLOUR)
        balls.append(ball)
    return balls
