"""Ribbons as they are when an object was let go, and the record that its form is proved by."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fabweave.core.arrays import FloatArray, frozen
from fabweave.core.records import record
from fabweave.form.body import HELD_N_MM
from fabweave.form.net import State, turned
from fabweave.form.screw import Frames
from fabweave.form.settle import Settled
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave, strand_passes

SCHEMA = "fabweave.form/1"
#: Decimals of millimetres and of radians.
_MM, _RADIANS = 7, 9


def relaxed_ribbons(ribbons: Ribbons, weave: Weave, wished: State, state: State) -> Ribbons:
    """Return ribbons whose crossings are as in a state; each panel moves as its strand does.

    Parameters
    ----------
    ribbons : Ribbons
        As they are in the wished state.
    weave : Weave
    wished, state : State
        Of :func:`fabweave.form.woven_net.woven_net`.
    """
    threads = weave.threads
    # Rungs between two panels go with the one that comes first; those before all, with the first.
    own = np.searchsorted(ribbons.entry, np.arange(ribbons.n_rungs), side="right") - 1
    rung_thread = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.offsets))
    own = np.maximum(own, ribbons.pass_offsets[rung_thread])
    crossing = threads.crossing[own]
    lower = strand_passes(weave)[:, 0]
    below = lower[crossing] == own
    turn = np.where(below, (state.angles - wished.angles)[crossing], 0.0)
    before, after = wished.bodies[crossing], state.bodies[crossing].then(turned(turn))

    def moved(points: FloatArray) -> FloatArray:
        place = np.einsum("nji,nj->ni", before.axes, points - before.origin)
        return frozen(after.origin + np.einsum("nij,nj->ni", after.axes, place))

    return replace(
        ribbons,
        right=moved(ribbons.right),
        left=moved(ribbons.left),
        normal=frozen(np.ascontiguousarray(state.bodies.axes[:, :, 2])),
        centre=frozen(state.bodies.origin),
    )


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
    states : tuple of StateRecord
    """

    schema: str
    threads: tuple[ThreadRecord, ...]
    pins_nmm: tuple[float, ...]
    held: tuple[int, ...]
    held_n_mm: float
    load_n: tuple[tuple[int, float], ...]
    states: tuple[StateRecord, ...]


def form_record(settled: Settled) -> FormRecord:
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
