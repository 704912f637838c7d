"""A general frame of beams settles as far as a woven object: a check by other means.

Beams are straight, of Euler and Bernoulli, and co-rotational: each sees its ends turn from where
its own chord leads (Crisfield, "A consistent co-rotational formulation for non-linear,
three-dimensional beam-elements", Comput. Methods Appl. Mech. Eng. 81, 1990). Of fabweave's solver
it takes what strips are: where they begin, how they are cut, and what their sections resist.
"""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import expm
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from fabweave.form.body import body_of, off_places
from fabweave.form.hold import pins_of
from fabweave.form.net import end_frames
from fabweave.form.settle import let_go
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.ribbon.rules.remedy import Depth

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_jobs")]


def beams(length, stretch, twist, about_y, about_z):
    """Return the stiffness of straight beams along x, (N, 12, 12), as textbooks have it."""
    k = np.zeros((len(length), 12, 12))
    for at, value in ((0, stretch), (3, twist)):
        for one, other, sign in (
            (at, at, 1),
            (at + 6, at + 6, 1),
            (at, at + 6, -1),
            (at + 6, at, -1),
        ):
            k[:, one, other] = sign * value / length
    for move, turn, value, sign in ((1, 5, about_z, 1.0), (2, 4, about_y, -1.0)):
        at = [move, turn, move + 6, turn + 6]
        a, b, c = 12 * value / length**3, sign * 6 * value / length**2, value / length
        rows = [[a, b, -a, b], [b, 4 * c, -b, 2 * c], [-a, -b, a, -b], [b, 2 * c, -b, 4 * c]]
        for i, row in enumerate(rows):
            for j, entry in enumerate(row):
                k[:, at[i], at[j]] = entry
    return k


def test_a_cantilever_bends_as_it_should():
    k = beams(*(np.array([one]) for one in (100.0, 1e9, 1e6, 500.0, 2e6)))[0, 6:, 6:]
    down = np.linalg.solve(k, [0, 0, -1e-3, 0, 0, 0])
    assert down[2] == pytest.approx(-1e-3 * 100.0**3 / (3 * 500.0))
    assert down[4] == pytest.approx(1e-3 * 100.0**2 / (2 * 500.0))


def skew(some):
    x, y, z = some.T
    none = 0 * x
    rows = [[none, -z, y], [z, none, -x], [-y, x, none]]
    return np.moveaxis(np.array(rows), 2, 0)


def chord_axes(a, b, a_axes, b_axes):
    """Return the axes of beams: x along the chord, y as near as may be to those of both ends."""
    x = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    y = (a_axes + b_axes)[:, :, 1]
    y = y - x * np.sum(x * y, axis=1)[:, None]
    y /= np.linalg.norm(y, axis=1)[:, None]
    return np.stack([x, y, np.cross(x, y)], axis=2)


def rotvec(axes):
    return Rotation.from_matrix(axes).as_rotvec()


class Frame:
    """The strips of a woven object as beams, cut flat: four from crossing to crossing."""

    def __init__(self, body, pins):
        self.net, self.pins = body.net, pins
        state = body.wished
        spans, pieces = self.net.rest.shape[:2]
        self.count, inner = self.net.n_bodies, len(state.inner.origin)
        self.nodes = np.concatenate([state.bodies.origin, state.inner.origin])
        self.axes = np.concatenate([state.bodies.axes, state.inner.axes])
        self.angles = np.zeros(len(pins))
        own, _ = end_frames(self.net, state.bodies, state.angles)
        chain = self.count + np.arange(inner).reshape(spans, pieces - 1)
        ends = self.net.ends
        self.node = np.concatenate([ends[:, :1], chain, ends[:, 1:]], axis=1)
        self.node = np.stack([self.node[:, :-1], self.node[:, 1:]], axis=2).reshape(-1, 2)
        # Where each end lies on its node, and by which angle it turns with it.
        shape = spans, pieces, 2
        self.off, self.own = np.zeros((*shape, 3)), np.zeros((*shape, 3, 3))
        self.own[:] = np.eye(3)
        self.turn = np.full(shape, -1)
        for side, at in ((0, (slice(None), 0, 0)), (1, (slice(None), -1, 1))):
            rows = slice(side * spans, (side + 1) * spans)
            self.off[at], self.own[at] = own.origin[rows], own.axes[rows]
            self.turn[at] = self.net.turns[:, side]
        self.off, self.own = self.off.reshape(-1, 2, 3), self.own.reshape(-1, 2, 3, 3)
        self.turn = self.turn.reshape(-1, 2)
        # As they are cut.
        twists = self.net.rest.reshape(-1, 6)
        generator = np.zeros((len(twists), 4, 4))
        generator[:, :3, :3], generator[:, :3, 3] = skew(twists[:, 3:]), twists[:, :3]
        there = expm(generator)
        start = np.broadcast_to(np.eye(3), (len(twists), 3, 3))
        chord = chord_axes(0 * there[:, :3, 3], there[:, :3, 3], start, there[:, :3, :3])
        self.length = np.linalg.norm(there[:, :3, 3], axis=1)
        self.rest = np.stack(
            [np.swapaxes(chord, 1, 2), np.swapaxes(chord, 1, 2) @ there[:, :3, :3]], 1
        )
        section = self.net.stiffness.reshape(-1, 6) * np.linalg.norm(twists[:, :3], axis=1)[:, None]
        self.stiff = beams(self.length, section[:, 0], *section[:, 3:].T)

    def system(self):
        """Return forces and stiffness of all freedoms."""
        whole = 6 * len(self.nodes)
        turn = np.where(self.turn >= 0, self.angles[self.turn], 0.0)
        spin = np.zeros((*turn.shape, 3))
        spin[..., 2] = turn
        # What turns does so about its node's normal.
        turned = Rotation.from_rotvec(spin.reshape(-1, 3)).as_matrix().reshape(*turn.shape, 3, 3)
        base = self.axes[self.node]
        arm = np.einsum("neij,nej->nei", base @ turned, self.off)
        axes = base @ turned @ self.own
        a, b = np.moveaxis(self.nodes[self.node] + arm, 1, 0)
        chord = chord_axes(a, b, axes[:, 0], axes[:, 1])
        seen = np.swapaxes(chord, 1, 2)[:, None] @ axes @ np.swapaxes(self.rest, 2, 3)
        bent = np.zeros((len(a), 12))
        bent[:, 6] = np.linalg.norm(b - a, axis=1) - self.length
        for side in (0, 1):
            bent[:, 6 * side + 3 : 6 * side + 6] = rotvec(seen[:, side])
        link = np.zeros((len(a), 12, 14))
        for side in (0, 1):
            row, column = 6 * side, 7 * side
            link[:, row : row + 6, column : column + 6] = np.eye(6)
            link[:, row : row + 3, column + 3 : column + 6] = -skew(arm[:, side])
            normal = base[:, side, :, 2] * (self.turn[:, side] >= 0)[:, None]
            link[:, row + 3 : row + 6, column + 6] = normal
            link[:, row : row + 3, column + 6] = np.cross(normal, arm[:, side])
        to_local = np.kron(np.eye(4), np.ones((3, 3)))[None] * np.tile(
            np.swapaxes(chord, 1, 2), (1, 4, 4)
        )
        link = to_local @ link
        matrix = np.swapaxes(link, 1, 2) @ self.stiff @ link
        pull = np.einsum("nji,njk,nk->ni", link, self.stiff, bent)
        at = np.concatenate(
            [
                np.concatenate(
                    [6 * self.node[:, side, None] + np.arange(6),
                     whole + np.maximum(self.turn[:, side, None], 0)], axis=1
                )
                for side in (0, 1)
            ],
            axis=1,
        )  # fmt: skip
        size = whole + len(self.angles)
        force = np.bincount(at.ravel(), pull.ravel(), minlength=size)
        force[whole:] += self.pins * self.angles
        rows, columns = np.repeat(at, 14, axis=1), np.tile(at, (1, 14))
        matrix = sp.coo_array((matrix.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        return force, sp.csc_array(matrix)

    def settle(self, steps=60):
        """Let it go; return where crossings come to rest."""
        whole = 6 * len(self.nodes)
        for _ in range(steps):
            force, matrix = self.system()
            more = np.full(len(force), 1e-9 * matrix.diagonal().mean())
            more[whole:] += self.pins
            step = spsolve(matrix + sp.diags_array(more, format="csc"), -force)
            each = step[:whole].reshape(-1, 6)
            step *= min(1.0, 0.1 / max(np.abs(each[:, 3:]).max(), np.abs(step[whole:]).max()))
            self.nodes = self.nodes + each[:, :3]
            self.axes = Rotation.from_rotvec(each[:, 3:]).as_matrix() @ self.axes
            self.angles = self.angles + step[whole:]
            if np.abs(each).max() < 1e-5:
                return self.nodes[: self.count]
        raise AssertionError("it does not come to rest")


@pytest.mark.parametrize(
    ("source", "size_mm"),
    [
        ("shape:torus?m=16&n=8", 300.0),
        ("shape:tube?m=12&n=6", 300.0),
        ("shape:hypar?m=6&n=6", 300.0),
    ],
)
def test_it_settles_as_a_frame_of_beams_does_within_a_tenth(source, size_mm):
    asked = Settings.of(source, size_mm=size_mm, boundary="end", effort="quick")
    job = Stations(asked, depth=Depth.ALONG)
    body = body_of(job.planned.woven, job.brief)
    pins = pins_of(body, job.piece_set)
    ours = let_go(body, pins).away_mm
    theirs = np.linalg.norm(off_places(Frame(body, pins).settle(), body.places), axis=1)
    assert theirs.max() == pytest.approx(ours.max(), rel=0.1)
    assert np.sqrt((theirs**2).mean()) == pytest.approx(np.sqrt((ours**2).mean()), rel=0.1)
