"""Relax models that others wove of curved ribbons, and compare where they come to rest.

    python tests/benchmarks/bench_form_curved_weaving.py REPOSITORY [NAME ...]

REPOSITORY is a checkout or a git directory of github.com/EPFL-LGG/CurvedWeaving (MIT): Ren,
Panetta, Chen, Isvoranu, Poincloux, Brandt, Martin, Pauly, "3D Weaving with Curved Ribbons", ACM
Trans. Graph. 40(4), 2021. Nothing is done without it, and nothing of it is kept.

The authors' files tell how long spans are and how they are curved when flat, where their joints
come to rest, and sections. We are let go from there; from there with joints displaced at random,
1 % of the size in the root mean square; and from the straight edges of their line model. The last
row has their sections: no shear, and the twisting of a rectangle that is not quite thin.

One row a start: crossings; seconds; what is left of the forces, N; by how much our energy is
above the one their notebook prints; how far our joints are from theirs, at most and in the root
mean square; so from the target surface, ours and theirs, and from the line model's joints. Rigid
motions are aside; distances are in per mille of the size, the diagonal of the line model's box.

Not in the files, and taken from the places they hold: which end of a span is first, which spans go
on at a joint, which strand is above, and which side curvatures count from. How a joint is turned
is not saved either. Their pull to the surface, some 1e-5 of a span's stiffness, is left out.
"""

import heapq
import io
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from fabweave.form.body import HELD_N_MM
from fabweave.form.net import Net, cut_inner, section_stiffness
from fabweave.form.relax import relax
from fabweave.form.screw import Frames
from fabweave.mesh.automorphisms import best_motions
from fabweave.mesh.nearest import Surface

EDITOR = "weaving/weaving_editor/"
CUT = EDITOR + "fabrication_tool/{0}_dof.npy"
FOURTH = EDITOR + "nature_paper_experiments/figure_4/zoo/results/{0}/{0}_dof.npy"
FIRST = EDITOR + "nature_paper_experiments/figure_1/results/{0}/{0}_dof.npy"
#: Model, state, section and energy: a section is that of their list of models, or so many times
#: that, of one width, as in the notebook that prints the energy. It does so after it has loaded the
#: state; that of the sphere after it was optimised; the torus may have been optimised again.
MODELS = [
    ("sphere_1", FOURTH, None, 3.65540e-4),
    ("regular_torus_1", FOURTH, None, 1.76414e-4),
    ("small_pseudo_sphere_1", FOURTH, None, None),
    ("costa_1", CUT, None, None),
    ("costa_1", CUT, 1.0, 1.1846e-4),
    ("lilium_1", CUT, None, 3.2574e-6),
    ("bob_1", CUT, None, None),
    ("bob_1", CUT, 1.0, 3.76076e-5),
    ("bob_quad_1", CUT, None, 6.06395e-5),
    ("ducko_v2_1", CUT, None, None),
    ("ducko_v2_1", CUT, 0.75, 1.13249e-5),
    ("bunny_head_small_triaxial_1", CUT, None, None),
    ("bird_close_beak_1", FIRST, None, 1.88174e-6),
]
#: Millimetres a unit; their material, MPa; their edges and ours from joint to joint.
UNIT, YOUNG, POISSON, EDGES, PIECES = 100.0, 2000.0, 0.3, 19, 16
#: How two, three or four ends at a joint may be those of two strands.
SPLITS = {
    2: [((0,), (1,))],
    3: [((0, 1), (2,)), ((0, 2), (1,)), ((1, 2), (0,))],
    4: [((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2))],
}


def unit(rows):
    """Return rows of unit length."""
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def read(folder, path):
    """Return a file of the repository; None where it is not there."""
    if (folder / path).is_file():
        return (folder / path).read_bytes()
    show = [shutil.which("git") or "git", "-C", str(folder), "show", "HEAD:" + path]
    shown = subprocess.run(show, capture_output=True, check=False)
    return shown.stdout if shown.returncode == 0 else None


def rows_of(text, kind, type_):
    """Return the numbers of the lines of an OBJ that begin so, without slashes and after."""
    lines = (line.split() for line in text.decode().splitlines())
    rows = [[word.split("/")[0] for word in line[1:]] for line in lines if line[:1] == [kind]]
    return np.array(rows, dtype=type_)


def load(folder, name, path):
    """Return a model with its state; a span has two ends, and all starts come before all ends."""
    files = [f"weaving/normalized_objs/{kind}/{name}.obj" for kind in ("models", "surface_models")]
    text, state, surface = (read(folder, one) for one in (files[0], path.format(name), files[1]))
    if text is None or state is None:
        return None
    target, edges = UNIT * rows_of(text, "v", float), rows_of(text, "l", int) - 1
    spans, joints = len(edges), len(target)
    numbers = np.load(io.BytesIO(state))
    inner, joint, kappa, length = np.split(numbers, np.cumsum([69 * spans, 9 * joints, 19 * spans]))
    inner = UNIT * inner.reshape(spans, 69)[:, :51].reshape(spans, 17, 3)
    places = UNIT * joint.reshape(joints, 9)[:, :3]
    # The first vertex is near the first joint.
    far = np.linalg.norm(inner[:, :1] - places[edges], axis=2)
    ends = np.where(far[:, 1:] < far[:, :1], edges[:, ::-1], edges)
    body, near = ends.T.ravel(), np.concatenate([inner[:, 0], inner[:, -1]])
    model = SimpleNamespace(
        target=target, ends=ends, body=body, places=places, inner=inner, near=near,
        kappa=kappa.reshape(spans, EDGES), length=UNIT * length, valence=np.bincount(body),
        size=np.linalg.norm(np.ptp(target, axis=0)), out=unit(near - places[body]),
        other=np.roll(np.arange(2 * spans), spans), surface=None,
        straight=np.tile(np.linalg.norm(target[ends[:, 0]] - target[ends[:, 1]], axis=1), 2),
    )  # fmt: skip
    if surface is not None:
        corners = rows_of(surface, "f", int) - 1
        model.surface = Surface(UNIT * rows_of(surface, "v", float)[:, :3], corners)
    pair_ends(model)
    orient(model)
    return model


def pair_ends(model):
    """Find which ends go on in which at a joint: its strands, 0 and 1, and their way through it."""
    model.strand, model.way = np.zeros(len(model.body), dtype=int), np.ones(len(model.body))
    for joint, valence in enumerate(model.valence):
        here = np.flatnonzero(model.body == joint)
        cosine = model.out[here] @ model.out[here].T
        pairs = min(SPLITS[valence], key=lambda two: sum(cosine[one] for one in two if one[1:]))
        model.strand[here[list(pairs[1])]] = 1
        model.way[here[[one[1] for one in pairs if one[1:]]]] = -1.0


def frames(model, places, out):
    """Return the frames of joints, and the angles of their strands, from where ends lead to."""
    along = np.zeros((2, len(places), 3))
    np.add.at(along, (model.strand, model.body), model.way[:, None] * out)
    one, two = unit(along)
    normal = unit(np.cross(one, two)) * model.side[:, None]
    axes = np.stack([one, np.cross(normal, one), normal], axis=2)
    angles = np.arctan2((two * axes[:, :, 1]).sum(axis=1), (two * one).sum(axis=1))
    return Frames(places, axes), angles


def orient(model):
    """Find a side that normals share, which strand is above, and the sign of curvatures."""
    count, body, other = len(model.places), model.body, model.other
    model.side = np.ones(count)
    normal = frames(model, model.places, model.out)[0].axes[:, :, 2]
    side, todo = np.zeros(count), [(-1.0, 0, 1.0)]
    while todo:  # along the spans that turn least, first
        _, joint, sign = heapq.heappop(todo)
        if side[joint]:
            continue
        side[joint] = sign
        for end in np.flatnonzero(body == joint):
            cosine = normal[joint] @ normal[body[other[end]]]
            heapq.heappush(todo, (-abs(cosine), int(body[other[end]]), sign * np.sign(cosine)))
    model.side, normal = side, normal * side[:, None]
    height = np.zeros((2, count, 3))
    np.add.at(height, (model.strand, body), model.near)
    up = np.sign(((height[0] - height[1]) * normal).sum(axis=1))
    model.level = up[body] * (1 - 2 * model.strand)
    # Where a strand ends, nothing tells its height: it alternates.
    whole = model.valence == 4
    for end in np.flatnonzero(~whole[body] & whole[body[other]]):
        here = body == body[end]
        same = 1 - 2 * (model.strand[here] != model.strand[end])
        model.level[here] = -model.level[other[end]] * same
    along = unit(np.diff(model.inner, axis=1))
    share = np.linspace(0, 1, 15)[None, :, None]
    upright = normal[model.ends[:, :1]] * (1 - share) + normal[model.ends[:, 1:]] * share
    turn = (np.cross(along[:, :-1], along[:, 1:]) * upright).sum(axis=2)
    model.sign = np.sign((turn * model.kappa[:, 2:17]).sum())


def widths(model, section, even):
    """Return how wide pieces are, (S, M), and how thick: wider where spans are longer, or not."""
    width, thickness = (UNIT * section[key] * (even or 1.0) for key in ("width", "thickness"))
    share = (np.arange(PIECES) + 0.5) / PIECES
    if even or section["constant_cross_section"]:
        return np.full((len(model.ends), PIECES), width), thickness
    radius = np.bincount(model.body, model.straight) / model.valence
    for _ in range(10):
        beside = np.bincount(model.body, radius[model.body[model.other]]) / model.valence
        radius = 0.75 * radius + 0.25 * beside
    factor = np.interp(radius, [radius.min(), radius.max()], section["cross_section_scale"])
    first, last = width * factor[model.ends.T]
    return first[:, None] * (1 - share) + last[:, None] * share, thickness


def net_of(model, width, thickness, *, held, theirs):
    """Return the net; rims may be held, and sections be theirs."""
    spans, joints = len(model.ends), len(model.places)
    # An edge that two spans share at a joint is as long as in the one that is shorter.
    key = 2 * model.body + model.strand
    order = np.lexsort((model.straight, key))
    known, at = np.unique(key[order], return_index=True)
    owner = order[at][np.searchsorted(known, key)] % spans
    begin, end = model.length[owner].reshape(2, spans) / EDGES
    step = (model.length - (begin + end) / 2) / (EDGES - 1)
    kinks = begin[:, None] / 2 + step[:, None] * np.arange(EDGES)
    middle = np.pad((kinks[:, 1:] + kinks[:, :-1]) / 2, ((0, 0), (1, 1)))
    middle[:, -1] = model.length
    turns = model.sign * 2 * np.arctan(model.kappa / 2)
    heading = np.pad(np.cumsum(turns, axis=1), ((0, 0), (1, 0)))
    rest = np.zeros((spans, PIECES, 6))
    rest[..., 0] = model.length[:, None] / PIECES
    places = model.length[:, None] * np.linspace(0, 1, PIECES + 1)
    rest[..., 5] = np.diff([np.interp(*each) for each in zip(places, middle, heading, strict=True)])
    thick = np.full(width.shape, thickness)
    stiffness = section_stiffness(width, thick, np.full(width.shape, YOUNG), POISSON)
    if theirs:
        stiffness[..., 1:3] *= 100.0
        stiffness[..., 3] *= 1 - 0.63 * thickness / width
    axes = np.zeros((2 * spans, 3, 3))
    axes[:, 0, 0] = axes[:, 1, 1] = model.way * np.repeat([1.0, -1.0], spans)
    axes[:, 2, 2] = 1.0
    zero = np.zeros((joints, 3))
    return Net(
        ends=model.ends, at=Frames(model.level[:, None] * [0, 0, thickness / 2], axes),
        turns=np.where(model.strand == 1, model.body, -1).reshape(2, spans).T,
        rest=rest, stiffness=stiffness / rest[..., :1],
        pins=np.zeros(joints), rest_angles=np.zeros(joints), weight=zero,
        held=zero + held * HELD_N_MM * (model.valence < 4)[:, None],
        place=model.places, fixed=np.zeros(joints, dtype=bool),
    )  # fmt: skip


def fitted(places, to):
    """Return places after the rigid motion that brings them nearest to others."""
    middle, there = places.mean(axis=0), to.mean(axis=0)
    return (places - middle) @ best_motions(places - middle, to - there, mirrors=False).T + there


def text(distances, size):
    """Return the largest and the root mean square of distances in per mille; blanks for none."""
    if distances is None:
        return 15 * " "
    return f"{1e3 * distances.max() / size:8.3f} {1e3 * np.sqrt((distances**2).mean()) / size:6.3f}"


def starts(model):
    """Yield a name, places of joints, where ends lead to, and whether sections are theirs."""
    noise = np.random.default_rng(0).normal(size=model.places.shape) * 0.01 * model.size / 3**0.5
    lines = unit(model.target[model.body[model.other]] - model.target[model.body])
    yield "theirs", model.places, model.out, False
    yield "1 %", model.places + noise, model.out, False
    yield "lines", model.target, lines, False
    yield "section", model.target, lines, True


def main(folder, names):
    """Print the table."""
    listed = read(folder, "weaving/woven_model.json")
    if listed is None:
        print(f"{folder} is no checkout of github.com/EPFL-LGG/CurvedWeaving: nothing is compared")
        return
    sections = {one["name"]: one for one in json.loads(listed)["models"]}
    print("model                  start   cross. seconds residual  energy      from theirs   "
          " from surface          theirs      from lines          theirs")  # fmt: skip
    for name, path, even, energy in MODELS:
        if names and name not in names:
            continue
        model = load(folder, name, path)
        if model is None:
            print(f"{name}: its files are not there")
            continue
        section = sections[name]
        width, thickness = widths(model, section, even)
        for start, places, out, theirs in starts(model):
            net = net_of(model, width, thickness, held=section["fix_boundary"], theirs=theirs)
            bodies, angles = frames(model, places, out)
            begun = time.perf_counter()
            found = relax(net, cut_inner(net, bodies, angles))
            took = time.perf_counter() - begun
            ours = found.state.bodies.origin
            apart = fitted(ours, model.places) - model.places
            both = [fitted(each, model.target) for each in (ours, model.places)]
            more = found.energy_nmm / ((energy or np.inf) * UNIT**3) - 1
            above = f"{more:+7.2%}" if energy else 7 * " "
            far = [np.linalg.norm(apart, axis=1)]
            far += [model.surface.feet(each).distances if model.surface else None for each in both]
            far += [np.linalg.norm(each - model.target, axis=1) for each in both]
            label = name[:18] + (f" x{even:g}" if even else "")
            print(f"{label:22} {start:7} {len(places):6} {took:7.1f} {found.residual:8.0e} "
                  f"{above} " + " ".join(text(each, model.size) for each in far)
                  + ("" if found.settled else "  not at rest"), flush=True)  # fmt: skip


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]), sys.argv[2:])
