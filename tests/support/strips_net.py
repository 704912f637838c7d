"""Nets of a few straight strips, for which the answer is known."""

from dataclasses import replace

import numpy as np

from fabweave.form.net import Net, NetState, end_frames, section_stiffness
from fabweave.form.screw import Frames, exponential, logarithm

YOUNG, POISSON = 3000.0, 0.3


def still(count):
    """Return frames that are where they are given from."""
    return Frames(np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))


def net_of(ends, rest, stiffness, n_bodies, *, turns=None, pins=(), at=None):
    """Return a net of spans between bodies, with nothing that pulls or holds."""
    ends, pins = np.asarray(ends), np.asarray(pins, dtype=float)
    return Net(
        ends=ends,
        at=still(2 * len(ends)) if at is None else at,
        turns=np.full((len(ends), 2), -1) if turns is None else np.asarray(turns),
        rest=rest,
        stiffness=stiffness,
        pins=pins,
        rest_angles=np.zeros(len(pins)),
        weight=np.zeros((n_bodies, 3)),
        held=np.zeros((n_bodies, 3)),
        place=np.zeros((n_bodies, 3)),
        fixed=np.zeros(n_bodies, dtype=bool),
    )


def chain(length, spans, *, width=10.0, thickness=0.4, pieces=1, turn=0.0, young=YOUNG, ring=False):
    """Return a strip of some length along x, cut as an arc that turns by so much in all."""
    count = spans * pieces
    rest = np.zeros((spans, pieces, 6))
    rest[..., 0], rest[..., 5] = length / count, turn / count
    section = section_stiffness(np.array(width), np.array(thickness), np.array(young), POISSON)
    stiffness = np.broadcast_to(section / (length / count), rest.shape).copy()
    bodies = np.arange(spans + (not ring))
    ends = np.stack([np.arange(spans), (np.arange(spans) + 1) % len(bodies)], axis=1)
    return net_of(ends, rest, stiffness, len(bodies))


def even_inner(net, bodies, angles):
    """Return a state whose spans are screws from end to end."""
    _, frames = end_frames(net, bodies, angles)
    spans, pieces = net.rest.shape[:2]
    start, end = frames[:spans], frames[spans:]
    twist = logarithm(end.seen_from(start))
    shares = np.arange(1, pieces) / pieces
    each = np.repeat(np.arange(spans), pieces - 1)
    inner = start[each].moved((twist[:, None] * shares[:, None]).reshape(-1, 6))
    return NetState(bodies, angles, inner)


def screw_state(net, twist):
    """Return a chain that has the same twist (6,) in all of its spans."""
    steps = np.arange(net.n_bodies)[:, None] * np.asarray(twist)
    return even_inner(net, exponential(steps), np.zeros(len(net.pins)))


def fixing(net, *bodies):
    """Return a net with some bodies fixed."""
    fixed = net.fixed.copy()
    fixed[list(bodies)] = True
    return replace(net, fixed=fixed)
