"""Make objects of straight strips, and of wavy ones, and tell what each comes to.

    python tests/benchmarks/bench_straight.py [--only ball,spot] [--size 300mm] [--models FOLDER]

Twelve objects on triangles in two densities, as kagome: shapes that are made here, and found
models. One row each for straight and for wavy strips:

off       how far crossings rest from the mesh when the object is let go: at most, and root mean
          square, and the first as a share of the size
turn      by how much straight strips turn in their plane between two crossings then, at most, mean
filled    the pieces' share of the sheets that are full, and of the last one's part that is used
cut, min  length of all cuts and minutes of the machine, in the middle of the range
hours     of assembly, in the middle of the range
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import trimesh

from fabweave.core.errors import FabweaveError
from fabweave.job.run import draw_stations
from fabweave.job.stations import Stations
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import plain_triangles
from fabweave.options.settings import settings_from_options
from fabweave.sheet.drawing import Layer

HERE = Path(__file__).parent
MODELS = HERE.parents[1] / "examples" / "meshes"
SHARED = HERE.parents[2] / "shared" / "meshes"
_MANY = 2000


def ball(frequency):
    """Return an icosahedron whose faces are parted in frequency squared triangles, on a sphere."""
    solid = trimesh.creation.icosahedron()
    steps = [(i, j) for i in range(frequency + 1) for j in range(frequency + 1 - i)]
    number = {step: at for at, step in enumerate(steps)}
    corners, faces = [], []
    for at, triangle in enumerate(solid.triangles):
        share = np.array([(frequency - i - j, i, j) for i, j in steps]) / frequency
        corners.append(share @ triangle)
        first = at * len(steps)
        for i, j in steps:
            if i + j < frequency:
                faces.append([number[i, j], number[i + 1, j], number[i, j + 1]])
                faces[-1] = [first + one for one in faces[-1]]
            if i + j < frequency - 1:
                faces.append([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])
                faces[-1] = [first + one for one in faces[-1]]
    points = np.concatenate(corners)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    mesh = trimesh.Trimesh(points, faces, process=False)
    mesh.merge_vertices(digits_vertex=9)
    return mesh


def squeezed(mesh, *factors):
    """Return a mesh that is longer or shorter along its axes."""
    return trimesh.Trimesh(mesh.vertices * factors, mesh.faces, process=False)


def above(mesh, height):
    """Return the faces whose centres are above a height."""
    kept = trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.triangles_center[:, 2] > height])
    kept.remove_unreferenced_vertices()
    return kept


def tube(rings, around, radius):
    """Return an open tube of nearly regular triangles with a radius at each height from 0 to 1."""
    step = 2 * np.pi / around
    at = np.arange(around)
    rows = []
    for ring in range(rings + 1):
        share = ring / rings
        angle = step * (at + ring / 2)
        high = share * rings * step * np.sqrt(3) / 2
        rows.append(radius(share) * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
        rows[-1][:, 2] = high
    faces = []
    for ring in range(rings):
        a, b = ring * around, (ring + 1) * around
        for k in range(around):
            other = (k + 1) % around
            faces += [[a + k, a + other, b + k], [b + k, a + other, b + other]]
    return trimesh.Trimesh(np.concatenate(rows), faces, process=False)


def torus(around, across):
    """Return a torus of triangles, every second ring turned by half a step."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = 2 * np.pi * (i + j / 2) / around, 2 * np.pi * j / across
    out = 1 + 0.42 * np.cos(v)
    points = np.stack([out * np.cos(u), out * np.sin(u), 0.42 * np.sin(v)], axis=-1)
    faces = []
    for a in range(around):
        for b in range(across):
            c, d = (a + 1) % around, (b + 1) % across
            # Around the tube once, rings are turned by half of all steps across.
            back = across // 2 if d == 0 else 0
            one, two = (a + back) % around, (c + back) % around
            faces += [
                [a * across + b, c * across + b, one * across + d],
                [one * across + d, c * across + b, two * across + d],
            ]
    return trimesh.Trimesh(points.reshape(-1, 3), faces, process=False)


def given(mesh):
    """Return a mesh as fabweave takes it from memory."""
    return PolyMesh.from_faces(mesh.vertices.tolist(), mesh.faces.tolist())


#: By name: for each density the mesh or its file, and options.
OBJECTS = {
    "ball": lambda dense: (given(ball(6 if dense else 4)), {}),
    "egg": lambda dense: (given(squeezed(ball(6 if dense else 4), 1, 1, 1.4)), {}),
    "dome": lambda dense: (given(above(ball(7 if dense else 5), -0.25)), {}),
    "basket": lambda dense: (
        given(squeezed(above(ball(7 if dense else 5), -0.05), 1, 1, -0.8)),
        {},
    ),
    "lampshade": lambda dense: (
        given(tube(*((12, 28) if dense else (8, 18)), lambda share: 1 - 0.35 * share)),
        {},
    ),
    "torus": lambda dense: (given(torus(*((36, 16) if dense else (24, 12)))), {}),
    "spot": lambda dense: (MODELS / "spot.obj", {"remesh": f"triangles:{600 if dense else 400}"}),
    "bob": lambda dense: (
        SHARED / "quad" / "bob_quad.obj",
        {"remesh": f"triangles:{600 if dense else 400}"},
    ),
    "fish": lambda dense: (MODELS / "fish.obj", {"remesh": f"triangles:{600 if dense else 400}"}),
    "koala": lambda dense: (
        MODELS / "koala.obj",
        {"remesh": f"triangles:{600 if dense else 400}"},
    ),
    "goat": lambda dense: (
        MODELS / "goathead.obj",
        {"remesh": f"triangles:{600 if dense else 400}"},
    ),
    "nefertiti": lambda dense: (
        MODELS / "nefertiti.obj",
        {"remesh": f"triangles:{600 if dense else 400}"},
    ),
}


def filled(job):
    """Return the share of the material in use that pieces have."""
    outlines = [piece.outline for piece in job.to_cut]
    area = sum(
        abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2 for x, y in (o.T for o in outlines)
    )
    used = 0.0
    for number, sheet in enumerate(job.layout.sheets):
        placed = [p.apply(outlines[p.piece]) for p in job.layout.placements if p.sheet == number]
        points = np.concatenate(placed)
        margin = job.layout.margin_mm
        size = np.array([sheet.width_mm, sheet.height_mm]) - 2 * margin
        reach = points.max(axis=0) - margin
        # Of the last sheet, what is beyond its pieces on one side is left over.
        part = min(reach[0] * size[1], reach[1] * size[0])
        used += part if number == len(job.layout.sheets) - 1 else float(np.prod(size))
    return area / used


def row(name, dense, strips, size):
    """Return a row of the table."""
    source, options = OBJECTS[name](dense)
    mesh = source if isinstance(source, PolyMesh) else None
    words = {**options, "size": size, "pattern": "kagome", "strips": strips, "force": True}
    start = time.perf_counter()
    settings = settings_from_options("mesh" if mesh is not None else str(source), **words)
    try:
        job = draw_stations(Stations(settings, mesh))
    except FabweaveError as error:
        return f"| {name} | {dense} | {strips} | {str(error)[:90]} |"
    form, rested = job.form, None
    if form is not None:
        surface = Surface(*plain_triangles(job.woven.mesh))
        rested = surface.feet(job.let_go.settled.rested).distances
    sheets = job.kerfed or job.drawings
    length = sum(
        float(np.hypot(*np.diff(run, axis=0).T).sum())
        for sheet in sheets
        for piece in sheet.pieces
        for entity in piece.entities
        if entity.layer is Layer.CUT_OUTER
        for run in [np.concatenate([entity.points, entity.points[: int(entity.closed)]])]
    )
    minutes = np.mean(job.costs.machine_s) / 60
    width = job.check.measured["width"].value
    return " | ".join(
        str(cell)
        for cell in (
            "", name, job.woven.weave.threads.n_crossings, strips, job.verdict.level,
            len(job.piece_set.pieces), int(job.kinds.max()), f"{np.median(width):.1f}",
            "-" if rested is None else f"{rested.max():.1f} / {np.sqrt((rested**2).mean()):.1f}",
            "-" if rested is None else f"{100 * rested.max() / job.woven.size_mm:.1f} %",
            "-" if form is None or form.turn_deg is None
            else f"{form.turn_deg:.2f} / {form.turn_mean_deg:.2f}",
            len(job.layout.sheets), f"{100 * filled(job):.0f} %", f"{length / 1000:.1f} m",
            f"{minutes:.0f} min", f"{np.mean(job.costs.assembly.hours):.1f} h",
            f"{time.perf_counter() - start:.0f} s", "",
        )
    ).strip()  # fmt: skip


def main():
    """Print the table, row by row."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default=",".join(OBJECTS))
    parser.add_argument("--size", default="300mm")
    parser.add_argument("--strips", default="straight,wavy")
    asked = parser.parse_args()
    print(
        "| object | crossings | strips | verdict | pieces | kinds | width mm | off mm | off | turn "
        "deg | sheets | filled | cut | machine | hours | made in |\n" + "|---" * 16 + "|"
    )
    for name in asked.only.split(","):
        for dense in (False, True):
            for strips in asked.strips.split(","):
                print(row(name, dense, strips, asked.size), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
