"""Ribbons as they are when an object was let go, and the record that its form is proved by."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from fabweave.core.arrays import ComplexArray, FloatArray, frozen, offsets_of
from fabweave.core.records import optional, record
from fabweave.form.body import HELD_N_MM, ElasticBody
from fabweave.form.net import Net, NetState, end_frames, strains, turned
from fabweave.form.products import Products
from fabweave.form.screw import Frames
from fabweave.form.settle import Settled
from fabweave.piece.development import run_rungs, unfold
from fabweave.ribbon.project import Ribbons, following_rung, local_entry
from fabweave.weave.pattern import Weave, strand_passes

SCHEMA = "fabweave.form/1"
#: Decimals of millimetres and of radians.
_MM, _RADIANS = 7, 9
#: Ribbons keep their lengths to this share of their width, or to the second at the worst, and are
#: found in so many steps at most. So often laps are drawn together, and lengths kept after that:
#: more brings little.
_EXACT, _KEPT, _STEPS, _LAPPING = 1e-9, 1e-6, 40, 8
#: Rungs unfold to where they are cut, seen from the rung before, to this.
_UNFOLDS_MM = 0.002
#: Strands of more crossings are laid one by one: all together would take minutes.
_MOST_TOGETHER = 3000
#: Into so many parts quads are parted along their strip, which bends between their rungs, too;
#: the rung between both parts of a panel is at the middle of its crossing.
PARTS = 2


class _Flat(NamedTuple):
    """A strip in the plane, at each rung, and where the quad that follows ends, as complex."""

    right: ComplexArray
    left: ComplexArray
    next_right: ComplexArray
    next_left: ComplexArray


def relaxed_ribbons(
    ribbons: Ribbons, weave: Weave, body: ElasticBody, state: NetState
) -> Ribbons | None:
    """Return the strips that are cut, laid along a state: they unfold as the ribbons do.

    None where none are found that keep their lengths, as where strips turn back at a rim.

    Each quad of the ribbons is parted in ``PARTS`` along it, as the strip bends there, too. What is
    between two crossings goes as the net's strip does; then all points go to the nearest at which
    every edge is as long as it is cut.

    Parameters
    ----------
    ribbons : Ribbons
        As they are in the wished state.
    weave : Weave
    body : ElasticBody
    state : NetState
        Of its net.
    """
    fine, flat = _parted(ribbons)
    right, left = _carried(fine, weave, body.wished, state)
    _sweep(ribbons, fine, weave, body.net, state, right, left)
    points, lengths = np.concatenate([right, left]), _lengths(fine, flat)
    if len(state.angles) <= _MOST_TOGETHER:
        lapped = _with_laps(lengths, fine, points, weave)
        for _ in range(_LAPPING):
            for conditions in (lapped, lengths):
                points, _ = conditions.nearest(points, exact=_EXACT, steps=1)
    points, off = lengths.nearest(points, exact=_EXACT, steps=_STEPS)
    if off > _KEPT:
        return None
    right, left = (frozen(side.copy()) for side in np.split(points, 2))
    bands = replace(
        fine,
        right=right,
        left=left,
        normal=frozen(np.ascontiguousarray(state.bodies.axes[:, :, 2])),
        centre=frozen(state.bodies.origin),
    )
    return bands if _unfolds_off(bands, flat) <= _UNFOLDS_MM else None


def _unfolds_off(bands: Ribbons, flat: _Flat) -> float:
    """Return how far a rung is at most from where it is cut, as the rung before sees it.

    Triangles of the same sides may lie on the other side of one of them.
    """
    sizes = np.diff(bands.offsets)
    laid = np.flatnonzero(sizes > 0)
    last = (sizes - 1 + bands.closed)[laid]
    offsets, rung = run_rungs(bands, laid, np.zeros_like(last), last)
    strips = unfold(bands, offsets, rung)
    plane = np.array([1.0, 1.0j])
    right, left = strips.right @ plane, strips.left @ plane
    at = np.delete(np.arange(len(rung)), offsets[1:] - 1)
    own = rung[at]

    def seen(here: ComplexArray, across: ComplexArray, there: ComplexArray) -> ComplexArray:
        way = across - here
        return np.asarray((there - here) * np.abs(way) / way)

    off = [
        np.abs(
            seen(right[at], left[at], there[at + 1])
            - seen(flat.right[own], flat.left[own], due[own])
        )
        for there, due in ((right, flat.next_right), (left, flat.next_left))
    ]
    return float(np.max(off, initial=0.0))


def shown_relaxed(ribbons: Ribbons, weave: Weave, body: ElasticBody, state: NetState) -> Ribbons:
    """Return ribbons whose panels go flat with their crossings: for pictures, not to be measured.

    What is between two panels goes with the first, so strands lie on one another as in the model.
    """
    right, left = map(frozen, _carried(ribbons, weave, body.wished, state))
    normal = frozen(np.ascontiguousarray(state.bodies.axes[:, :, 2]))
    return replace(
        ribbons, right=right, left=left, normal=normal, centre=frozen(state.bodies.origin)
    )


def _parted(ribbons: Ribbons) -> tuple[Ribbons, _Flat]:
    """Return ribbons whose quads are parted, in space along their rails, and how they are cut."""
    sizes = np.diff(ribbons.offsets)
    threads = np.arange(len(sizes))
    # A face by itself has threads without a crossing, and no strip.
    laid = sizes > 0
    # One more where a ring closes.
    last = sizes - 1 + ribbons.closed
    offsets, rung = run_rungs(
        ribbons, threads[laid], np.zeros(np.count_nonzero(laid), dtype=np.int64), last[laid]
    )
    strips = unfold(ribbons, offsets, rung)
    plane = np.array([1.0, 1.0j])
    before = np.delete(np.arange(len(rung)), offsets[1:] - 1)
    share = np.tile(np.arange(PARTS) / PARTS, len(before))
    quad = np.repeat(before, PARTS)
    # An open strip ends with a rung of its own.
    ends = offsets[1:][~ribbons.closed[laid]] - 1
    at = np.concatenate([quad, ends])
    order = np.argsort(at, kind="stable")
    at, share = at[order], np.concatenate([share, np.zeros(len(ends))])[order]
    after = np.minimum(at + 1, len(rung) - 1)

    def between(values: Any, part: FloatArray) -> Any:
        part = part.reshape(-1, *[1] * (values.ndim - 1))
        return values[at] + part * (values[after] - values[at])

    flat = [
        between(side @ plane, part)
        for part in (share, share + 1.0 / PARTS)
        for side in (strips.right, strips.left)
    ]
    fine = replace(
        ribbons,
        offsets=offsets_of(np.where(laid, PARTS * last + ~ribbons.closed, 0)),
        right=between(ribbons.right[rung], share),
        left=between(ribbons.left[rung], share),
        from_right=frozen(ribbons.from_right[rung[at]]),
        entry=ribbons.entry,
    )
    thread = np.repeat(threads, np.diff(ribbons.pass_offsets))
    entry = fine.offsets[thread] + PARTS * (ribbons.entry - ribbons.offsets[thread])
    return replace(fine, entry=entry), _Flat(*flat)


def _carried(
    fine: Ribbons, weave: Weave, wished: NetState, state: NetState
) -> tuple[FloatArray, FloatArray]:
    """Return where rungs go with the panel before them, or with the first."""
    crossing = weave.threads.crossing
    own = np.searchsorted(fine.entry, np.arange(fine.n_rungs), side="right") - 1
    thread = np.repeat(np.arange(len(fine.closed)), np.diff(fine.offsets))
    own = np.maximum(own, fine.pass_offsets[thread])
    at = crossing[own]
    below = strand_passes(weave)[at, 0] == own
    turn = np.where(below, (state.angles - wished.angles)[at], 0.0)
    before, after = wished.bodies[at], state.bodies[at].then(turned(turn))

    def carried(points: FloatArray) -> FloatArray:
        place = np.einsum("nji,nj->ni", before.axes, points - before.origin)
        return np.asarray(after.origin + np.einsum("nij,nj->ni", after.axes, place))

    return carried(fine.right), carried(fine.left)


def _sweep(
    ribbons: Ribbons,
    fine: Ribbons,
    weave: Weave,
    net: Net,
    state: NetState,
    right: FloatArray,
    left: FloatArray,
) -> None:
    """Put parts of rungs between the middles of two panels where the strip of the net has them."""
    threads, pieces = weave.threads, net.rest.shape[1]
    following = following_rung(threads.offsets, threads.closed)
    first = np.flatnonzero(following >= 0)
    of = threads.thread_of_pass[first]
    position = first - threads.offsets[of]
    start = local_entry(ribbons, of, position)
    offsets, rung = run_rungs(ribbons, of, start, local_entry(ribbons, of, position + 1) + 1)
    strips = unfold(ribbons, offsets, rung)
    begin, end = offsets[:-1], offsets[1:] - 1
    plane = np.array([1.0, 1.0j])
    line = (strips.right + strips.left) @ plane / 2
    run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(line)))])
    low, high = (run[begin] + run[begin + 1]) / 2, (run[end - 1] + run[end]) / 2

    # Each part of each quad: on which piece of which span it begins, and how far along that.
    quad = np.repeat(np.delete(np.arange(len(rung)), end), PARTS)
    part = np.arange(len(quad)) % PARTS
    share = part[:, None] / PARTS
    span = np.searchsorted(offsets, quad, side="right") - 1
    along = run[quad] + share[:, 0] * (run[quad + 1] - run[quad])
    way = (along - low[span]) / (high - low)[span] * pieces
    on = (way >= 0.0) & (way <= pieces)
    quad, part, share, span, way = (values[on] for values in (quad, part, share, span, way))
    piece = np.minimum(way.astype(np.int64), pieces - 1)
    on_piece = (way - piece)[:, None]

    heading = np.angle(line[begin + 1] - line[begin])
    origin = (line[begin] + line[begin + 1]) / 2
    cut = [Frames(_in_space(origin), turned(heading).axes)]
    for number in range(pieces - 1):
        cut.append(cut[-1].moved(net.rest[:, number]))
    twist, _ = strains(net, state)
    _, ends = end_frames(net, state.bodies, state.angles)
    inner = (pieces - 1) * np.arange(len(first))
    laid = [ends[: len(first)], *(state.inner[inner + number] for number in range(pieces - 1))]

    def there(frames: list[Frames], twists: FloatArray) -> Frames:
        origin, axes = (
            np.stack([getattr(one, name) for one in frames], axis=1)[span, piece]
            for name in ("origin", "axes")
        )
        return Frames(origin, axes).moved(on_piece * twists[span, piece])

    before, after = there(cut, net.rest), there(laid, twist)
    thread = of[span]
    at = fine.offsets[thread] + PARTS * (rung[quad] - ribbons.offsets[thread]) + part
    for side, flat in ((right, strips.right), (left, strips.left)):
        points = _in_space((flat[quad] + share * (flat[quad + 1] - flat[quad])) @ plane)
        place = np.einsum("nji,nj->ni", before.axes, points - before.origin)
        side[at] = after.origin + np.einsum("nij,nj->ni", after.axes, place)


def _in_space(points: ComplexArray) -> FloatArray:
    return np.stack([points.real, points.imag, np.zeros_like(points.real)], axis=-1)


def _lengths(ribbons: Ribbons, flat: _Flat) -> Products:
    """Return the conditions that all edges of ribbons' facets are as long as they are cut."""
    following = following_rung(ribbons.offsets, ribbons.closed)
    here = np.flatnonzero(following >= 0)
    after, count = following[here], ribbons.n_rungs
    rung, diagonal = np.arange(count), ribbons.from_right[here]
    start = np.concatenate([rung, here, count + here, np.where(diagonal, here, count + here)])
    end = np.concatenate(
        [count + rung, after, count + after, np.where(diagonal, count + after, after)]
    )
    ahead, beside = flat.next_right - flat.right, flat.next_left - flat.left
    across = np.where(ribbons.from_right, flat.next_left - flat.right, flat.next_right - flat.left)
    long = np.abs(np.concatenate([flat.left - flat.right, ahead[here], beside[here], across[here]]))
    each = sp.csr_array(sp.eye_array(2 * count))
    edges = sp.csr_array(each[start] - each[end])
    scale = np.full(len(start), float(np.median(long[:count])) ** 2)
    return Products(edges, edges, long**2, scale)


def _with_laps(lengths: Products, fine: Ribbons, points: FloatArray, weave: Weave) -> Products:
    """Return conditions with those that strands lie on one another in the middle of panels."""
    each = sp.csr_array(sp.eye_array(2 * fine.n_rungs))
    right, left = each[: fine.n_rungs], each[fine.n_rungs :]
    middle, rung = sp.csr_array((right + left) / 2.0), sp.csr_array(left - right)
    upper, lower = (fine.entry[at] + PARTS // 2 for at in strand_passes(weave).T[::-1])
    apart = middle[upper] - middle[lower]
    lines = [
        one for at in (upper, lower) for one in (rung[at], middle[at + 1] - middle[at - 1])
    ] + [apart]
    first, second = (sp.csr_array(sp.vstack(some)) for some in (lines, [apart] * len(lines)))
    high = np.linalg.norm(apart @ points, axis=1) * np.sqrt(lengths.scale[0])
    return Products(
        sp.csr_array(sp.vstack([lengths.first, first])),
        sp.csr_array(sp.vstack([lengths.second, second])),
        np.concatenate([lengths.wanted, np.einsum("cd,cd->c", first @ points, second @ points)]),
        np.concatenate([lengths.scale, np.tile(high, len(lines))]),
    )


def off_crossings_mm(bands: Ribbons, weave: Weave) -> float:
    """Return how far the middle of both strands is from its crossing, at most, millimetres."""
    middle = (bands.right + bands.left) / 2.0
    panels = middle[bands.entry + PARTS // 2]
    there = panels[strand_passes(weave)].mean(axis=1)
    return float(np.linalg.norm(there - bands.centre, axis=1).max(initial=0.0))


@record
class StateRecord:
    """Where an object is: ``form.json``.

    Parameters
    ----------
    name : "let go", "standing" or "loaded"
    energy_nmm, residual_n : float
        What is in store, and the largest force that is not balanced.
    bodies : tuple of six floats each
        Of each crossing its place and its rotation vector: x along the strand above, z outward.
    angles : tuple of float
        Of each crossing, from the strand above to the one below, about the normal.
    inner : tuple of six floats each
        The frames of strips at each quarter of the way from crossing to crossing, thread after
        thread: between two crossings, a strip may rest in more than one way.
    settled : bool
        Whether it came to rest.
    """

    name: str
    energy_nmm: float
    residual_n: float
    bodies: tuple[tuple[float, ...], ...]
    angles: tuple[float, ...]
    inner: tuple[tuple[float, ...], ...]
    settled: bool


@record
class ThreadRecord:
    """What the strip of a thread resists with: ``form.json``."""

    young_mpa: float
    poisson: float
    density_kg_m3: float
    thickness_mm: float


@record
class FormRecord:
    """What a form was found with, and what it came to: ``form.json``.

    Parameters
    ----------
    schema : str
    threads : tuple of ThreadRecord
    pins_nmm : tuple of float
        How each crossing resists turning, N mm per radian.
    held : tuple of int
        The crossings that an object stands on or hangs from.
    held_n_mm : float
        How stiffly.
    load_n : tuple of (int, float)
        Which crossings bear a load, and how much.
    strips_mm : float
        How far the strips of ``model_relaxed.glb``, which keep their lengths, are from crossings of
        the first state, at most; None where there is no such model.
    aim : tuple of (float, float, float), or None
        Where each crossing is to be in the end, on ``aimed_mesh.obj``, where another mesh is woven.
    states : tuple of StateRecord
    """

    schema: str
    threads: tuple[ThreadRecord, ...]
    pins_nmm: tuple[float, ...]
    held: tuple[int, ...]
    held_n_mm: float
    load_n: tuple[tuple[int, float], ...]
    strips_mm: float | None
    aim: tuple[tuple[float, ...], ...] | None = optional()
    states: tuple[StateRecord, ...]


def form_record(settled: Settled, strips_mm: float | None) -> FormRecord:
    """Return what :func:`fabweave.form.settle.settle` found, as it is written."""
    body, materials = settled.body, settled.body.materials
    held = np.flatnonzero(settled.held)
    bears = np.flatnonzero(body.load[:, 2])
    return FormRecord(
        schema=SCHEMA,
        threads=tuple(
            ThreadRecord(
                young_mpa=one.young_mpa,
                poisson=one.poisson,
                density_kg_m3=one.density_kg_m3,
                thickness_mm=thickness,
            )
            for one, thickness in zip(materials, body.thickness_mm.tolist(), strict=True)
        ),
        pins_nmm=tuple(settled.pins.tolist()),
        held=tuple(held.tolist()),
        held_n_mm=HELD_N_MM,
        load_n=tuple((at, float(-body.load[at, 2])) for at in bears.tolist()),
        strips_mm=None if strips_mm is None else round(strips_mm, 3),
        aim=None if body.aim is None else tuple(map(tuple, body.target.round(_MM).tolist())),
        states=tuple(
            StateRecord(
                name=name,
                energy_nmm=round(rest.energy_nmm, 6),
                residual_n=round(rest.residual, 6),
                bodies=_rows(rest.state.bodies),
                angles=tuple(rest.state.angles.round(_RADIANS).tolist()),
                inner=_rows(rest.state.inner),
                settled=rest.settled,
            )
            for name, rest in settled.states.items()
        ),
    )


def _rows(frames: Frames) -> Any:
    turn = Rotation.from_matrix(frames.axes).as_rotvec().round(_RADIANS)
    rows = np.concatenate((frames.origin.round(_MM), turn), axis=1) + 0.0
    return tuple(map(tuple, rows.tolist()))
