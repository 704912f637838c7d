"""Let objects go in OpenSees, a general finite-element program, and compare how far they settle.

    python tests/benchmarks/bench_form_strangers.py

It needs ``pip install openseespy`` (and the system's BLAS), which fabweave does not. One row an
object and a way of fastening: how far its crossings go at most and in the root mean square, here
and there, and the ratios.

There, strips are straight beams (Euler and Bernoulli's) from rung to rung of the ribbons in space.
Nothing of the form room is used: what a strip was bent, turned and stretched by from the flat is
read at each rung, where one facet meets the next, and its moments and forces are let go as loads.
It is linear: displacements are small to how strips are bent, and our first step of Newton's is
beside it, too.
"""

import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fabweave.form.body import ElasticBody, body_of, fitted
from fabweave.form.hold import Foresight
from fabweave.form.net import NetState
from fabweave.form.screw import Frames
from fabweave.form.settle import let_go
from fabweave.job.stations import Stations
from fabweave.options.settings import settings_from_options
from fabweave.picture.model_files import woven_glb
from fabweave.verify.measure.geometry import lay_steps, unfold
from fabweave.verify.read.glb import read_model
from fabweave.weave.pattern import strand_passes

OBJECTS = {
    "lampshade": ("shape:tube?m=12&n=6", {"size": "300mm"}),
    "torus": ("shape:torus?m=16&n=8", {"size": "400mm"}),
    "kagome ball": ("shape:icosahedron",
                    {"size": "300mm", "pattern": "kagome", "refine": "loop:1"}),
}  # fmt: skip
#: How stiff what is tied is, N/mm and N mm; how softly all is held in space, N/mm.
TIED, SOFT = 1e7, 1e-7


def unit(rows):
    """Return rows of unit length."""
    return rows / np.linalg.norm(rows, axis=1)[:, None]


def strips(woven, model):
    """Yield what is wanted of each ribbon.

    Middles of rungs; frames of facets, x along the strip and z outward; at which rungs panels
    begin; widths of rungs; closedness; passes; for each facet how much longer it is flat than from
    rung to rung in space; and at each rung the rotation from one facet to the next that it would
    not have flat.
    """
    ribbons = woven.ribbons
    for thread, closed in enumerate(ribbons.closed):
        start, end = ribbons.offsets[thread : thread + 2]
        right, left = ribbons.right[start:end], ribbons.left[start:end]
        middle, count = (right + left) / 2, end - start
        after = (np.arange(count) + 1) % count if closed else np.arange(1, count)
        here = np.arange(len(after))
        out = unit(np.cross(right[after] - left[here], left[after] - right[here]))
        along = middle[after] - middle[here]
        along = unit(along - np.sum(along * out, axis=1)[:, None] * out)
        frames = np.stack([along, np.cross(out, along), out], axis=2)
        strip = model[woven.labels[thread]]
        line = unfold(strip, lay_steps(strip), 0, len(here)).mean(axis=1) @ np.array([1, 1j])
        if closed:
            line = unfold(strip, lay_steps(strip), 0, count + 1).mean(axis=1) @ np.array([1, 1j])
        step = np.diff(line)
        longer = np.abs(step[here]) - np.linalg.norm(middle[after] - middle[here], axis=1)
        fold = np.zeros((count, 3))
        rungs = here if closed else here[1:]
        before = frames[np.roll(here, 1)] if closed else frames[here[:-1]]
        turn = Rotation.from_matrix(np.swapaxes(before, 1, 2) @ frames[rungs]).as_rotvec()
        flat = np.angle(step[1:] / step[:-1])
        turn[:, 2] -= np.roll(flat[: len(here)], 1) if closed else flat
        half = before @ Rotation.from_rotvec(turn / 2).as_matrix()
        fold[rungs] = np.einsum("nij,nj->ni", half, turn)
        passes = slice(ribbons.pass_offsets[thread], ribbons.pass_offsets[thread + 1])
        width = np.linalg.norm(left - right, axis=1)
        entry = ribbons.entry[passes] - start
        yield middle, frames, entry, width, bool(closed), passes, longer, fold


def model_of(woven):
    """Return the ribbons' strips as verify reads them, which has developments of its own."""
    path = Path(tempfile.mkdtemp()) / "model.glb"
    white = np.full((len(woven.labels), 3), 255, dtype=np.uint8)
    path.write_bytes(woven_glb(woven.ribbons, woven.labels, white))
    return read_model(path)


def balance(ops, loads):
    """Let forces and moments at nodes go, and find where all comes to rest."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for at, moment in loads.items():
        ops.load(at, *np.asarray(moment).tolist())
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    if ops.analyze(1) != 0:
        raise RuntimeError("OpenSees found no balance")


def moves_there(woven, body: ElasticBody, pins):  # noqa: PLR0915 - a model is a list of statements
    """Return how crossings move in OpenSees, (X, 3)."""
    import openseespy.opensees as ops  # noqa: PLC0415 - it may not be there

    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    lower, _ = strand_passes(woven.weave).T
    is_lower = np.zeros(len(woven.weave.threads.crossing), dtype=bool)
    is_lower[lower] = True
    crossing, count = woven.weave.threads.crossing, len(body.places)
    normal = woven.ribbons.normal
    for at, place in enumerate(body.places.tolist()):
        ops.node(at + 1, *place)
    node, tag, loads = count + 1, 1, {}
    ops.uniaxialMaterial("Elastic", 1, TIED)
    ops.uniaxialMaterial("Elastic", 2, SOFT)
    turning = {}
    for number, stiffness in enumerate(sorted(set(pins.tolist())), start=3):
        ops.uniaxialMaterial("Elastic", number, stiffness)
        turning[stiffness] = number
    ops.node(node, *body.places[0])
    ground = node
    ops.fix(ground, *[1] * 6)
    node += 1
    model = model_of(woven)
    for thread, (middle, frames, entry, width, closed, passes, longer, folds) in enumerate(
        strips(woven, model)
    ):
        # The middle of a panel is a node, too: half way between its rungs.
        points, order, facet_of = list(middle), [], {}
        for rung in range(len(middle)):
            order.append(rung)
            facet_of[rung] = min(rung, len(frames) - 1)
            if rung in set(entry.tolist()):
                points.append((middle[rung] + middle[(rung + 1) % len(middle)]) / 2)
                facet_of[len(points) - 1] = rung
                order.append(len(points) - 1)
        tags = {}
        for at, point in enumerate(points):
            ops.node(node, *point.tolist())
            tags[at] = node
            node += 1
        fold = np.zeros((len(points), 3))
        fold[: len(middle)] = folds
        material = body.materials[thread]
        young, thick = material.young_mpa, body.thickness_mm[thread]
        shear = young / (2 + 2 * material.poisson)
        pairs = list(zip(order, order[1:] + (order[:1] if closed else []), strict=False))
        lengths = {pair: np.linalg.norm(points[pair[1]] - points[pair[0]]) for pair in pairs}
        beside = {at: [pair for pair in pairs if at in pair] for at in order}
        for pair in pairs:
            one, other = pair
            length = lengths[pair]
            facet = facet_of[one]
            axes = frames[facet]
            along, z = unit((points[other] - points[one])[None])[0], axes[:, 2]
            wide = float(width[facet])
            facet_length = np.linalg.norm(middle[(facet + 1) % len(middle)] - middle[facet])
            ops.geomTransf("Linear", tag, *z.tolist())
            bends, edge = wide * thick**3 / 12, thick * wide**3 / 12
            # OpenSees: local z is along x cross the vector in the plane; that is our -y.
            ops.element("elasticBeamColumn", tag, tags[one], tags[other], wide * thick, young,
                        shear, wide * thick**3 / 3, bends, edge, tag)  # fmt: skip
            # Half of a fold's angle goes to either side of it, by their lengths.
            turned = sum(
                fold[at] * length / sum(lengths[each] for each in beside[at]) for at in pair
            )
            resists = np.array([shear * wide * thick**3 / 3, young * bends, young * edge])
            moment = axes @ (resists * (axes.T @ turned)) / length
            # As long as it was cut, it would push its ends apart.
            push = young * wide * thick * longer[facet] / facet_length * along
            for at, sign in ((one, 1.0), (other, -1.0)):
                loads[tags[at]] = loads.get(tags[at], 0.0) + sign * np.append(-push, moment)
            tag += 1
        panels = dict(zip(entry.tolist(), range(passes.start, passes.stop), strict=True))
        for rung, number in panels.items():
            at = order[order.index(rung) + 1]
            own = crossing[number]
            free = turning[pins[own]] if is_lower[number] else 1
            # A short stiff arm to the crossing would bend; so both are tied, and it is carried.
            z = normal[own]
            x = unit(np.cross(z, np.eye(3)[np.abs(z).argmin()])[None])[0]
            y = np.cross(z, x)
            ops.node(node, *points[at].tolist())
            ops.rigidLink("beam", int(own) + 1, node)
            ops.element("zeroLength", tag, node, tags[at], "-mat", 1, 1, 1, 1, 1, free,
                        "-dir", 1, 2, 3, 4, 5, 6, "-orient", *x.tolist(), *y.tolist())  # fmt: skip
            node, tag = node + 1, tag + 1
    for at in range(count):
        ops.node(node, *body.places[at].tolist())
        ops.fix(node, *[1] * 6)
        ops.element("zeroLength", tag, at + 1, node, "-mat", 2, 2, 2, "-dir", 1, 2, 3)
        node, tag = node + 1, tag + 1
    balance(ops, loads)
    return np.array([ops.nodeDisp(at + 1)[:3] for at in range(count)])


def distances(places, wished):
    """Return how far places are at most and in the root mean square, rigid motions aside."""
    frames = Frames(places, np.tile(np.eye(3), (len(places), 1, 1)))
    none = Frames(np.zeros((0, 3)), np.zeros((0, 3, 3)))
    moved = fitted(NetState(frames, np.zeros(0), none), wished).bodies.origin
    away = np.linalg.norm(moved - wished, axis=1)
    return away.max(), np.sqrt((away**2).mean())


def main():
    """Print the table."""
    try:
        import openseespy.opensees  # noqa: F401, PLC0415 - it may not be there
    except (ImportError, RuntimeError) as error:
        print(f"OpenSees is not there ({error}): pip install openseespy")
        return
    print("object        pins      OpenSees, mm   first order, mm   let go, mm    ratios")
    for name, (source, options) in OBJECTS.items():
        job = Stations(settings_from_options(source, **options))
        woven = job.ribbons
        body = body_of(woven, job.brief)
        for stiffness in (25.0, 10_000.0):
            pins = np.full(len(body.places), stiffness)
            there = distances(body.places + moves_there(woven, body, pins), body.places)
            first = Foresight(body)(pins, body.size_mm).settles_mm
            away = let_go(body, pins).away_mm
            ours = away.max(), np.sqrt((away**2).mean())
            print(f"{name:13} {stiffness:6.0f} {there[0]:8.2f} {there[1]:6.2f} {first:12.2f} "
                  f"{ours[0]:14.2f} {ours[1]:6.2f} {there[0] / ours[0]:8.2f} "
                  f"{there[1] / ours[1]:5.2f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
