"""Say whether a woven object keeps its form when the maker lets go."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import BoolArray, FloatArray, frozen, frozen_value
from fabweave.core.records import optional, record, to_json
from fabweave.form.body import ElasticBody, fitted, off_by, standing
from fabweave.form.net import Net, NetState, local_system, strains
from fabweave.form.relax import Relaxed, Solver, factor, relax, soft_modes
from fabweave.form.screw import Frames
from fabweave.mesh.likeness import name_place
from fabweave.mesh.nearest import Surface
from fabweave.mesh.triangulate import plain_triangles

#: Where straight strips turn by more, thinner ones are advised.
_TURNS_DEG = 2.0
#: What settles by no more than this share of its size keeps its form; what goes by more than that
#: collapses: figures of small bends tell no more than that, and a maker has no use for them.
BOUND, STANDS = 0.01, 0.1
#: A mode is loose if its own weight is enough to push an object by such a share of its size.
_LOOSE, _MODES = 0.01, 12
#: At so many crossings, evenly chosen, it is tried how far a thumb moves them.
_THUMBS, _THUMB_DAMPING = 32, 1e-7
#: Strands are pulled apart by such a force, N: a gram.
_APART_N = 0.01


#: What its own weight can push farther, the way in which it gives most easily, as a share of its
#: size, is a mechanism.
_SWAYS = 0.5


#: What is not told of what collapses: that its mesh was moved, for nothing; and what goes too far.
_MOVED = ("drawn_mm", "drawn_mean_mm", "drawn_where", "moved_mm")
_FAR = ("settles_mm", "mean_mm", "sags_mm", "loaded_mm", "pushed_mm", "off_mm", "off_mean_mm")


@record
class Form:
    """What becomes of an object's form when the maker lets go.

    Parameters
    ----------
    settles_mm, mean_mm : float
        How far its crossings go from where they were wished, at most, and in the root mean square,
        by what its strips want alone.
    where : str
        Where they go farthest.
    bound_mm : float
        What keeps its form settles by no more than that, and sags so.
    size_mm : float
        The largest extent of the object.
    sags_mm : float
        How far it sags under its own weight, standing on its lowest crossings, or as it is hung.
    loaded_mm : float or None
        And under the load that was asked for, too.
    loose : int
        In how many ways its own weight is enough to push it by a hundredth of its size.
    pushed_mm : float
        How far that pushes it at most, the way in which it gives most easily.
    gives_mm_n : float
        By how many millimetres the softest of a few crossings gives way to a push of one newton.
    soft : str
        Where that is.
    apart, apart_n : int and float
        How many crossings that are not fastened are pulled apart, and by how many newtons at most.
    strain : float
        How far the material is stretched at most, as a share of what it takes.
    settled : bool
        Whether it came to rest; else it goes on from there.
    model_mm, model_mean_mm : float or None
        Of straight strips: how far crossings are then from the mesh that is woven, at most, and in
        the root mean square.
    turn_deg, turn_mean_deg : float or None
        Of straight strips: by how much they turn in their plane between two crossings then, at
        most, and in the root mean square.
    air_mm : float or None
        How high in the air a body hangs that no thread joins to what stands; it is told how it
        would stand.
    off_mm, off_mean_mm, off_where : float and str
        How far they are from there in the end, as it stands or hangs with its load.
    drawn_mm, drawn_mean_mm, drawn_where : float and str, or None
        And how far they would be, if it were cut as it is drawn on its mesh, where that was moved
        so that the object settles onto it.
    moved_mm : float or None
        How far it was moved then, at most.
    bodies : tuple of Form or None
        Of several bodies, each by itself; what is told of the whole is then that of the worst.
    """

    settles_mm: float
    mean_mm: float
    where: str
    bound_mm: float
    size_mm: float
    sags_mm: float
    loaded_mm: float | None = optional()
    loose: int
    pushed_mm: float
    gives_mm_n: float
    soft: str
    apart: int
    apart_n: float
    strain: float
    settled: bool
    model_mm: float | None = optional()
    model_mean_mm: float | None = optional()
    turn_deg: float | None = optional()
    turn_mean_deg: float | None = optional()
    air_mm: float | None = optional()
    off_mm: float
    off_mean_mm: float
    off_where: str
    drawn_mm: float | None = optional()
    drawn_mean_mm: float | None = optional()
    drawn_where: str | None = optional()
    moved_mm: float | None = optional()
    bodies: "tuple[Form, ...] | None" = optional()

    @property
    def limit_mm(self) -> float:
        """What goes farther collapses."""
        return STANDS * self.size_mm

    @property
    def goes_mm(self) -> float:
        """How far it is off in the end where it was moved for that; else how far it settles."""
        return self.settles_mm if self.moved_mm is None else self.off_mm

    @property
    def keeps(self) -> bool:
        """Whether it keeps its form."""
        if self.bodies is not None:
            return all(one.keeps for one in self.bodies)
        return self.goes_mm <= self.bound_mm and self.settled

    @property
    def collapse(self) -> str:
        """Why it collapses, in words; empty where it does not.

        It goes by more than a tenth of its size, or its own weight can push it by half of its size:
        what is limp in a few places, as the tips of a crown are, stands all the same.
        """
        for number, one in enumerate(self.bodies or (), start=1):
            if one.collapse:
                return f"body {number}: {one.collapse}"
        if self.bodies is not None:
            return ""
        by = f"by more than a tenth of its size ({length_text(self.limit_mm)})"
        for far_mm, why in (
            (self.sags_mm, f"it collapses under its own weight: it sags {by}"),
            (self.loaded_mm or 0.0, f"it collapses under its load: it sags {by}"),
            (self.settles_mm, f"it collapses when it is let go: it goes {by}"),
        ):
            if far_mm > self.limit_mm:
                return why
        if self.pushed_mm > _SWAYS * self.size_mm:
            return "it collapses: its own weight is enough to sway it by more than half of its size"
        return ""

    @property
    def gives(self) -> float:
        """How far it settles, as a share of what keeps its form; of the worst."""
        if self.bodies is not None:
            return max(one.gives for one in self.bodies)
        return self.goes_mm / self.bound_mm

    @property
    def sinks(self) -> float:
        """How far it sags under all that weighs on it, as a share of its size; of the worst."""
        if self.bodies is not None:
            return max(one.sinks for one in self.bodies)
        return max(self.sags_mm, self.loaded_mm or 0.0) / self.size_mm

    @property
    def stands(self) -> bool:
        """Whether it stands: it comes to rest, and does not collapse."""
        return self.settled and not self.collapse

    @property
    def hanging(self) -> tuple[str, ...]:
        """Which bodies hang in the air, in words."""
        return tuple(
            f"body {number} hangs in the air, {length_text(one.air_mm)} up"
            for number, one in enumerate(self.bodies or (), start=1)
            if one.air_mm is not None
        )

    @property
    def text(self) -> str:
        """What a maker wants to read of it."""
        if self.collapse:
            return "; ".join([f"does not stand: {self.collapse}", *self.hanging])
        if self.drawn_mm is not None:
            said = (
                f"ends within {length_text(self.off_mm)} of the model ({self.off_where}), "
                f"{length_text(self.off_mean_mm)} in the root mean square; as drawn, "
                f"{length_text(self.drawn_mm)} and {length_text(self.drawn_mean_mm or 0.0)}"
            )
        elif self.keeps:
            said = f"keeps its form within {length_text(self.settles_mm)}"
        else:
            said = f"moves by up to {length_text(self.settles_mm)} ({self.where})"
        if not self.settled:
            said += " and does not come to rest"
        if self.model_mm is not None:
            said += f", and is then up to {length_text(self.model_mm)} off the model"
        sags = f"sags {length_text(self.sags_mm)} under its own weight"
        if self.loaded_mm is not None:
            sags += f", and {length_text(self.loaded_mm)} with its load"
        parts = [said, sags]
        if self.turn_deg is not None:
            turns = f"straight strips turn by up to {self.turn_deg:.1f}° at a crossing"
            thinner = " (half the thickness about halves that)"
            parts.append(turns + thinner * (self.turn_deg > _TURNS_DEG))
        if self.loose:
            parts.append("sways a little")
        return "; ".join([*parts, *self.hanging])

    def record(self) -> dict[str, Any]:
        """Return it as ``verdict.json`` holds it: of what collapses, no distance is told."""
        record = to_json(self)
        for key in _FAR:
            limit_mm = _SWAYS * self.size_mm if key == "pushed_mm" else self.limit_mm
            if (record.get(key) or 0.0) > limit_mm:
                record[key] = None
        for key in _MOVED if self.collapse else ():
            record.pop(key, None)
        if self.bodies is not None:
            record["bodies"] = [one.record() for one in self.bodies]
        return {**record, "collapses": bool(self.collapse), "text": self.text}


def length_text(length_mm: float) -> str:
    """Return a length as makers say it."""
    return f"{length_mm:.0f} mm" if length_mm >= 10.0 else f"{max(length_mm, 0.1):.1f} mm"


@frozen_value
class Settled:
    """An object that was let go: what became of its form, and of its crossings.

    Parameters
    ----------
    form : Form
    body : ElasticBody
    pins : (X,) float array
        How crossings resisted turning, N mm per radian.
    held : (X,) bool array
        What it stood on or hung from.
    states : dict
        Where it comes to rest: ``let go`` by itself, after the rigid motion that brings it nearest
        to where it is wished; ``standing`` under its own weight; ``loaded`` as well, if that was
        asked for.
    mode : (X, 3) float array
        How crossings go in the way in which they move most easily, by a millimetre at most.
    """

    form: Form
    body: ElasticBody
    pins: FloatArray
    held: BoolArray
    states: Mapping[str, Relaxed]
    mode: FloatArray

    @property
    def wished(self) -> FloatArray:
        """Where crossings are wished to be, (X, 3), millimetres."""
        return self.body.target

    @property
    def end(self) -> Relaxed:
        """Where it comes to rest with all that weighs on it."""
        return list(self.states.values())[-1]

    @property
    def rested(self) -> FloatArray:
        """Where they come to rest when they are let go, (X, 3)."""
        return self.states["let go"].state.bodies.origin


class Closely(NamedTuple):
    """How closely it is found where an object rests: what steps gain at least, and how many.

    Weight does little to what strips have in store, and is to be borne.
    """

    gain: float = 2e-5
    sag_gain: float = 1e-9
    steps: int = 200


_CLOSELY = Closely()


class Rests(NamedTuple):
    """Where an object comes to rest when it is let go, and when it stands under its own weight.

    ``free`` is as in :class:`Settled`, and ``came`` before it was moved; the net is that which
    stands, on what is ``held``.
    """

    free: Relaxed
    came: Relaxed
    held: BoolArray
    standing: Net
    stood: Relaxed
    away_mm: FloatArray
    sags_mm: float

    @property
    def most_mm(self) -> float:
        """The larger of both distances."""
        return max(float(self.away_mm.max()), self.sags_mm)


def let_go(
    body: ElasticBody, pins: FloatArray, how: Closely = _CLOSELY, begun: Relaxed | None = None
) -> Rests:
    """Return where an object comes to rest.

    Parameters
    ----------
    body : ElasticBody
    pins : (X,) float array
        How crossings resist turning, N mm per radian.
    how : Closely
        Near enough to rest.
    begun : Relaxed, optional
        How far this very body came, by itself, where it was let go less closely.
    """
    net = replace(body.net, pins=pins)
    if body.based:
        net = standing(net, body.hung, body.target)
    bare = replace(net, weight=0 * net.weight)
    free = came = relax(bare, body.wished, gain=how.gain, most=how.steps, begun=begun)
    if not body.based:
        free = replace(free, state=fitted(free.state, body.target))
    places = free.state.bodies.origin
    held = body.held(places)
    stands = net if body.based else standing(net, held, places)
    stood = relax(stands, free.state, gain=how.sag_gain, most=how.steps)
    away = np.linalg.norm(places - body.target, axis=1)
    return Rests(free, came, held, stands, stood, away, _sag(body, stood, free))


def in_the_end(body: ElasticBody, rests: Rests, how: Closely = _CLOSELY) -> Relaxed:
    """Return where an object comes to rest with its load."""
    if not body.load.any():
        return rests.stood
    net = rests.standing
    more = replace(net, weight=net.weight + body.load)
    return relax(more, rests.stood.state, gain=how.sag_gain, most=how.steps)


def settle(
    body: ElasticBody,
    pins: FloatArray,
    bound_mm: float | None = None,
    how: Closely = _CLOSELY,
    begun: Sequence[Relaxed] = (),
) -> Settled:
    """Let a woven object go, and say what becomes of its form; of several bodies, each by itself.

    Its strips are as they are cut. What is not known: friction's scatter, contact beside the
    crossings, creep and humidity.

    Parameters
    ----------
    body : ElasticBody
    pins : (X,) float array
        How crossings resist turning, N mm per radian.
    bound_mm : float, optional
        How far what keeps its form may settle; a hundredth of its size unless said.
    how : Closely
        Near enough to rest.
    begun : sequence of Relaxed
        How far each came, where they were let go less closely; none if they were not.
    """
    came: Sequence[Relaxed | None] = begun or [None] * len(body.bodies)
    with threadpool_limits(limits=1, user_api="blas"):
        each = [
            _settle(part, pins[own], bound_mm, how, one)
            for part, own, one in zip(body.parts, body.bodies, came, strict=True)
        ]
    return each[0] if len(each) == 1 else _together(body, pins, each, bound_mm)


def _settle(
    body: ElasticBody,
    pins: FloatArray,
    bound_mm: float | None,
    how: Closely,
    begun: Relaxed | None,
) -> Settled:
    """Let one body go."""
    rests = let_go(body, pins, how, begun)
    free, stood, net = rests.free, rests.stood, rests.standing
    states = {"let go": free, "standing": stood}
    end = in_the_end(body, rests, how)
    if end is not stood:
        states["loaded"] = end
    off = np.linalg.norm(off_by(body, end.state.bodies.origin), axis=1)
    rigid = 0 if body.based else 6
    unmoved = replace(net, weight=0 * net.weight, held=net.held * body.based)
    count = min(_MODES, 6 * net.n_bodies - 1)
    stiffness, motion = soft_modes(unmoved, free.state, count)
    gives, softest = _thumb(net, stood.state)
    pulls = np.where(pins <= body.turning_nmm[0], _pulls(net, stood.state), 0.0)
    strain = float((_strain(net, stood.state) / body.strain[:, None]).max())
    weight = float(-net.weight[:, 2].sum())
    # Where all bodies move as far, work done is half of the stiffness times their squares.
    least = np.maximum(stiffness[rigid:], 2.0 * weight / (net.n_bodies * body.size_mm))
    # What lies on the table all over, as a mat does, cannot sway.
    pushed = (not rests.held.all()) * 2.0 * weight / (net.n_bodies * least)
    mode = motion[min(rigid, count - 1)]
    if body.based and pushed.max(initial=0.0) > _SWAYS * body.size_mm:
        # What is held may be limp in a place: its weight is let go that way.
        push = weight / net.n_bodies * mode / np.linalg.norm(mode, axis=1).max()
        swayed = relax(replace(net, weight=push), free.state, gain=how.sag_gain, most=how.steps)
        far = np.linalg.norm(swayed.state.bodies.origin - free.state.bodies.origin, axis=1)
        pushed = np.minimum(pushed, float(far.max()))
    away, farthest = rests.away_mm, int(rests.away_mm.argmax())
    straight = _as_straight(body, free.state) if body.straight else {}
    form = Form(
        settles_mm=round(float(away[farthest]), 2),
        mean_mm=round(float(np.sqrt((away**2).mean())), 2),
        where=name_place(body.target[farthest], body.mesh),
        bound_mm=round(BOUND * body.size_mm if bound_mm is None else bound_mm, 2),
        size_mm=round(body.size_mm, 2),
        sags_mm=round(rests.sags_mm, 2),
        loaded_mm=round(_sag(body, states["loaded"], free), 2) if "loaded" in states else None,
        loose=int(np.count_nonzero(pushed > _LOOSE * body.size_mm)),
        pushed_mm=round(float(pushed.max(initial=0.0)), 2),
        gives_mm_n=round(gives, 3),
        soft=name_place(body.places[softest], body.mesh),
        apart=int(np.count_nonzero(pulls > _APART_N)),
        apart_n=round(max(float(pulls.max()), 0.0), 3),
        strain=round(strain, 3),
        settled=all(rest.settled for rest in states.values()),
        air_mm=None if body.air_mm is None else round(body.air_mm, 2),
        model_mm=straight.get("model_mm"),
        model_mean_mm=straight.get("model_mean_mm"),
        turn_deg=straight.get("turn_deg"),
        turn_mean_deg=straight.get("turn_mean_deg"),
        bodies=None,
        **_ends(body, off),
    )
    mode = mode / np.linalg.norm(mode, axis=1).max()
    return Settled(form, body, pins, rests.held, states, frozen(mode))


def _ends(body: ElasticBody, off: FloatArray) -> dict[str, Any]:
    """Return how far crossings are off in the end, and how far they would be as drawn."""
    cases = {"off": off} if body.aim is None else {"off": off, "drawn": body.aim.drawn_mm}
    told: dict[str, Any] = {}
    for name, away in cases.items():
        told[f"{name}_mm"] = round(float(away.max()), 2)
        told[f"{name}_mean_mm"] = round(float(np.sqrt((away**2).mean())), 2)
        told[f"{name}_where"] = name_place(body.target[int(away.argmax())], body.mesh)
    return told if body.aim is None else {**told, "moved_mm": round(body.aim.moved_mm, 3)}


def _together(
    body: ElasticBody, pins: FloatArray, each: Sequence[Settled], bound_mm: float | None
) -> Settled:
    """Return several bodies that were let go as one object: the worst of all is told of it."""
    forms, owns = [one.form for one in each], body.bodies
    worst = max(range(len(forms)), key=lambda at: forms[at].settles_mm)
    softest = max(range(len(forms)), key=lambda at: forms[at].gives_mm_n)
    crossings = np.array([len(own) for own in owns])

    def mean(name: str) -> float:
        each = np.array([getattr(form, name) for form in forms])
        return round(float(np.sqrt(np.average(each**2, weights=crossings))), 2)

    def ends(name: str) -> dict[str, Any]:
        at = max(range(len(forms)), key=lambda at: getattr(forms[at], f"{name}_mm"))
        where = f"{getattr(forms[at], f'{name}_where')} of body {at + 1}"
        whole = most(f"{name}_mm"), mean(f"{name}_mean_mm"), where
        return dict(zip((f"{name}_mm", f"{name}_mean_mm", f"{name}_where"), whole, strict=True))

    def most(name: str) -> Any:
        return max((getattr(form, name) or 0.0 for form in forms), default=0.0)

    form = Form(
        settles_mm=most("settles_mm"),
        mean_mm=mean("mean_mm"),
        where=f"{forms[worst].where} of body {worst + 1}",
        bound_mm=round(BOUND * body.size_mm if bound_mm is None else bound_mm, 2),
        size_mm=round(body.size_mm, 2),
        sags_mm=most("sags_mm"),
        loaded_mm=most("loaded_mm") if body.load.any() else None,
        loose=sum(form.loose for form in forms),
        pushed_mm=most("pushed_mm"),
        gives_mm_n=forms[softest].gives_mm_n,
        soft=f"{forms[softest].soft} of body {softest + 1}",
        apart=sum(form.apart for form in forms),
        apart_n=most("apart_n"),
        strain=most("strain"),
        settled=all(form.settled for form in forms),
        model_mm=most("model_mm") if body.straight else None,
        model_mean_mm=most("model_mean_mm") if body.straight else None,
        turn_deg=most("turn_deg") if body.straight else None,
        turn_mean_deg=most("turn_mean_deg") if body.straight else None,
        air_mm=None,
        bodies=tuple(forms),
        **ends("off"),
        **(ends("drawn") if body.aim is not None else {}),
        moved_mm=forms[0].moved_mm,
    )
    held, mode = np.zeros(len(body.places), dtype=np.bool_), np.zeros_like(body.places)
    for own, one in zip(owns, each, strict=True):
        held[own] = one.held
    mode[owns[softest]] = each[softest].mode
    names = ("let go", "standing", *(["loaded"] if body.load.any() else []))
    states = {name: _joined(body, [one.states.get(name, one.states["standing"]) for one in each])
              for name in names}  # fmt: skip
    return Settled(form, body, pins, held, states, frozen(mode))


def _joined(body: ElasticBody, each: Sequence[Relaxed]) -> Relaxed:
    """Return where all bodies come to rest; what no strip joins to another stays where it is."""
    bodies, inner = (
        [part.origin.copy(), part.axes.copy()] for part in (body.wished.bodies, body.wished.inner)
    )
    angles = body.wished.angles.copy()
    for own, one in zip(body.bodies, each, strict=True):
        state, between = one.state, body.inner_of(own)
        bodies[0][own], bodies[1][own] = state.bodies.origin, state.bodies.axes
        inner[0][between], inner[1][between] = state.inner.origin, state.inner.axes
        angles[own] = state.angles
    return Relaxed(
        NetState(Frames(*bodies), angles, Frames(*inner)),
        sum(one.energy_nmm for one in each),
        max(one.residual for one in each),
        (),
        all(one.settled for one in each),
    )


def _as_straight(body: ElasticBody, state: NetState) -> dict[str, float]:
    """Return how far an object of straight strips is from its mesh, and how much these turn."""
    away = Surface(*plain_triangles(body.mesh)).feet(state.bodies.origin).distances
    turn = np.degrees(np.abs((strains(body.net, state)[0] - body.net.rest)[..., 5].sum(axis=1)))
    return {
        "model_mm": round(float(away.max()), 2),
        "model_mean_mm": round(float(np.sqrt((away**2).mean())), 2),
        "turn_deg": round(float(turn.max()), 3),
        "turn_mean_deg": round(float(np.sqrt((turn**2).mean())), 3),
    }


def _sag(body: ElasticBody, stood: Relaxed, free: Relaxed) -> float:
    """Return how far an object gives where it stands; what hangs may turn about that freely."""
    places, state = free.state.bodies.origin, stood.state
    state = fitted(state, places) if body.hung.any() and not body.based else state
    return float(np.linalg.norm(state.bodies.origin - places, axis=1).max())


def _thumb(net: Net, state: NetState) -> tuple[float, int]:
    """Return how far the softest of a few crossings gives way to a newton, and which that is."""
    solver = Solver(net)
    _, matrix, _ = solver.system(state, _THUMB_DAMPING, stressed=True)
    factors = factor(matrix)
    pressed = np.unique(np.linspace(0, net.n_bodies - 1, _THUMBS).round().astype(np.int64))
    normal = 6 * pressed + 2
    gives = np.empty(len(pressed))
    for number, freedom in enumerate(normal.tolist()):
        push = np.zeros(net.n_freedoms)
        push[freedom] = 1.0
        gives[number] = abs(solver.solve(factors, push)[freedom])
    softest = int(gives.argmax())
    return float(gives[softest]), int(pressed[softest])


def _pulls(net: Net, state: NetState) -> FloatArray:
    """Return what pulls the strands of each crossing apart, N; below 0, they press together."""
    local = local_system(net, state, np.zeros(6))
    along = local.force.reshape(-1, 2, 7)[..., 2]
    side = np.where(net.turns >= 0, 0.5, -0.5)  # the strand below is the one that is turned
    pulls = np.bincount(net.ends.ravel(), (side * along).ravel(), minlength=net.n_bodies)
    return np.asarray(pulls, dtype=np.float64)


def _strain(net: Net, state: NetState) -> FloatArray:
    """Return how far the material is stretched at its faces and edges, (S, M)."""
    twist, _ = strains(net, state)
    length = np.linalg.norm(net.rest[..., :3], axis=2)
    off = np.abs(twist - net.rest)[..., [0, 4, 5]] / length[..., None]
    thick, wide = (np.sqrt(3.0 * net.stiffness[..., at] / net.stiffness[..., 0]) for at in (4, 5))
    return np.asarray(off[..., 0] + thick * off[..., 1] + wide * off[..., 2])
