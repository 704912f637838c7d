"""Empty a sheet: put its pieces on the others, where what stands there makes room.

The pieces of one sheet go into a pool. A piece of the pool is put where it overlaps least with
what stands on a sheet, and all pieces there are pushed apart; if they find room, it stays. A
piece that finds none takes the place of a smaller one, which goes into the pool instead: so the
pool's area becomes less with every success, until it is empty. Sheets that refuse are shaken,
which brings their free places together.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.nest.area import Area
from fabweave.nest.item_shape import rotated
from fabweave.nest.place.coarse_search import Finder, Found, Terrain, pixels_of, terrain_of
from fabweave.nest.separate.arrangement import NOWHERE, Arrangement
from fabweave.nest.separate.clearance_proof import missing_mm
from fabweave.nest.separate.item_field import Body
from fabweave.nest.separate.obstacle import Barrier
from fabweave.nest.separate.overlap import crowd_of, stand_at
from fabweave.nest.separate.separation import settle

_STEPS = 40  # of one try to push pieces apart
_PULLS, _PULL_MM = 15, 3.0  # steps that shake a sheet, and how far free pieces move in each
_DEAR = 8000.0  # overlap beyond which a try is hopeless
_LOOKED = 24  # sheets that are searched for a place
_TRIED = 3  # of these, how many are tried
_TRADED = 4  # sheets that are searched for a trade in one round
_PARTNERS = 12  # pieces on each of these that might make way
_TRADES = 5  # trades that are tried in one round
_LEAST_PARTNER = 0.25  # of a piece's area: a smaller one does not make room
_MOST_PARTNER = 0.98  # of a piece's area: so that there is progress
_MOST_BODIES = 250  # a sheet with more pieces than this is left alone
_FULL = 80  # on a sheet with more pieces, not all make room for one
_MOVED = 40  # pieces that do
_AWAY_MM = 8.0  # what is farther from all of these does not matter to them
_PUSHED = 600  # pieces that may stand where one is put, in all tries together, for each round
_PROOF_MM = 1e-9

#: Told after each round what is left in the pool: its area in square millimetres.
Told = Callable[[float], None]


@frozen_value
class Ground:
    """What stays as it is while pieces move.

    Parameters
    ----------
    bodies : sequence of Body
        One for each piece.
    areas : sequence of Area
        The usable area of each sheet in use.
    barriers : sequence of Barrier or None
        What is barred on each.
    gap_mm : float
        Least distance between pieces.
    finder : Finder
        Finds places.
    """

    bodies: Sequence[Body]
    areas: Sequence[Area]
    barriers: Sequence[Barrier | None]
    gap_mm: float
    finder: Finder

    def settled(
        self,
        pieces: Sequence[int],
        poses: FloatArray,
        sheet: int,
        pull: tuple[float, float] | None,
        moving: BoolArray | None = None,
    ) -> FloatArray | None:
        """Return poses near these at which the pieces keep the gap, proved; None if not found.

        All pieces move, or those that are ``moving``.
        """
        bodies = [self.bodies[piece] for piece in pieces]
        near = _concerned(bodies, poses, moving)
        crowd = crowd_of([bodies[number] for number in near])
        moving = None if moving is None else moving[near]
        area, gap = self.areas[sheet], self.gap_mm
        usable, poses = area.size_mm, poses.copy()
        for _ in range(3):
            pulls = 0 if pull is None else _PULLS
            found = settle(
                crowd,
                poses[near],
                usable,
                gap,
                steps=_STEPS,
                pull=pull or (0.0, 0.0),
                pulls=pulls,
                barrier=self.barriers[sheet],
                turns=area.turns,
                moving=moving,
            )
            if not found.ok:
                return None
            poses[near] = found.poses
            missing = missing_mm(bodies, poses, usable, self.gap_mm, area.barred)
            if missing <= _PROOF_MM:
                return poses
            # The fields are a little coarse: ask for that much more.
            gap, pull = gap + missing + 0.005, None
        return None


def _concerned(bodies: Sequence[Body], poses: FloatArray, moving: BoolArray | None) -> IntArray:
    """Return the bodies that move and those that they might come near to."""
    if moving is None:
        return np.arange(len(bodies))
    low, high = np.empty((2, len(bodies), 2))
    for number, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        outline = rotated(body.outline, np.rad2deg(pose[2:]))[0] + pose[:2]
        low[number], high[number] = outline.min(axis=0), outline.max(axis=0)
    low, high = low[:, None] - _AWAY_MM, high[:, None] + _AWAY_MM
    meet = (low <= high[moving, 0]) & (high >= low[moving, 0])
    return np.flatnonzero(meet.all(axis=2).any(axis=1))


@dataclass(eq=False)
class _Search:
    """The state of emptying a sheet: it changes with every piece that finds a place."""

    ground: Ground
    state: Arrangement
    sheets: list[int]
    random: np.random.Generator
    terrains: dict[int, Terrain] = field(default_factory=dict)
    changes: dict[int, int] = field(default_factory=dict)
    #: What failed: piece, sheet, how often that had changed, and the piece that made way.
    failed: set[tuple[int, int, int, int]] = field(default_factory=set)
    #: How many pieces stood where one was put, in all tries together: it counts the work.
    pushed: int = 0

    def area(self, piece: int) -> float:
        return self.ground.bodies[piece].area_mm2

    def pool(self) -> list[int]:
        """Return the pieces that stand nowhere, the largest first."""
        return sorted(
            self.state.on(NOWHERE), key=lambda piece: (-round(self.area(piece), 3), piece)
        )

    def terrain(self, sheet: int) -> Terrain:
        if sheet not in self.terrains:
            pieces, pixels = self.state.on(sheet), pixels_of(self.ground.areas[sheet])
            crowd = crowd_of([self.ground.bodies[piece] for piece in pieces]) if pieces else None
            stand = stand_at(crowd, self.state.poses[pieces]) if crowd else None
            self.terrains[sheet] = terrain_of(
                crowd, stand, pixels, self.ground.gap_mm, self.ground.barriers[sheet]
            )
        return self.terrains[sheet]

    def key(self, piece: int, sheet: int, leaving: int = NOWHERE) -> tuple[int, int, int, int]:
        return piece, sheet, self.changes.get(sheet, 0), leaving

    def changed(self, sheet: int) -> None:
        self.terrains.pop(sheet, None)
        self.changes[sheet] = self.changes.get(sheet, 0) + 1

    def find(
        self, piece: int, sheet: int, leaving: Sequence[tuple[int, int]]
    ) -> list[Found | None]:
        """Return the best place for each (number on the sheet, piece) that leaves it."""
        terrain = self.terrain(sheet)
        costs = [terrain.cost(None if other == NOWHERE else number) for number, other in leaving]
        pixels = pixels_of(self.ground.areas[sheet])
        return self.ground.finder.find(piece, self.ground.bodies[piece], pixels, costs)

    def around(self, pieces: Sequence[int], poses: FloatArray) -> BoolArray | None:
        """Return which pieces move to make room for the last one: on a full sheet those near it."""
        if len(pieces) <= _FULL:
            return None
        reach = np.array([self.ground.bodies[piece].radius_mm for piece in pieces])
        apart = np.hypot(*(poses[:, :2] - poses[-1, :2]).T) - reach
        apart[-1] = -np.inf
        moving = np.zeros(len(pieces), dtype=np.bool_)
        moving[np.argsort(np.round(apart, 3), kind="stable")[:_MOVED]] = True
        return moving

    def put(self, piece: int, sheet: int, found: Found, leaving: int = NOWHERE) -> bool:
        """Try to put a piece on a sheet; return whether all that stands there found room."""
        pieces = [other for other in self.state.on(sheet) if other != leaving] + [piece]
        self.pushed += len(pieces)
        poses = self.state.poses[pieces]
        poses[-1] = found.x_mm, found.y_mm, found.angle
        settled = self.ground.settled(pieces, poses, sheet, None, self.around(pieces, poses))
        if settled is None:
            self.failed.add(self.key(piece, sheet, leaving))
            return False
        self.state.poses[pieces] = settled
        self.state.where[piece] = sheet
        if leaving != NOWHERE:
            self.state.where[leaving] = NOWHERE
        self.changed(sheet)
        return True

    def place(self, piece: int) -> bool:
        """Try to place a piece on the sheets where it overlaps least."""
        open_to = [sheet for sheet in self.sheets if self.key(piece, sheet) not in self.failed]
        ranked = []
        for sheet in open_to[:_LOOKED]:
            found = self.find(piece, sheet, [(0, NOWHERE)])[0]
            if found is None or found.cost > _DEAR:
                self.failed.add(self.key(piece, sheet))
            else:
                ranked.append((found.cost, sheet, found))
        ranked.sort(key=lambda one: one[:2])
        return any(self.put(piece, sheet, found) for _, sheet, found in ranked[:_TRIED])

    def trade(self, piece: int) -> bool:
        """Try to put a piece in the place of a smaller one."""
        ranked = []
        area = self.area(piece)
        chosen = self.random.permutation(len(self.sheets))[:_TRADED]
        for sheet in [self.sheets[number] for number in chosen]:
            leaving = [
                (number, other)
                for number, other in enumerate(self.state.on(sheet))
                if _LEAST_PARTNER * area < self.area(other) < _MOST_PARTNER * area
                and self.key(piece, sheet, other) not in self.failed
            ]
            if len(leaving) > _PARTNERS:
                some = np.sort(self.random.permutation(len(leaving))[:_PARTNERS])
                leaving = [leaving[number] for number in some]
            for found, (_, other) in zip(self.find(piece, sheet, leaving), leaving, strict=True):
                if found is not None and found.cost <= _DEAR:
                    ranked.append((found.cost, sheet, other, found))
        ranked.sort(key=lambda one: one[:3])
        return any(
            self.put(piece, sheet, found, other) for _, sheet, other, found in ranked[:_TRADES]
        )

    def shake(self, sheet: int) -> None:
        """Move everything on a sheet to one side, as far as there is room."""
        pieces = self.state.on(sheet)
        if not pieces:
            return
        angle = 2.0 * math.pi * float(self.random.random())
        pull = (_PULL_MM * math.cos(angle), _PULL_MM * math.sin(angle))
        settled = self.ground.settled(pieces, self.state.poses[pieces], sheet, pull)
        if settled is not None:
            self.state.poses[pieces] = settled
            self.changed(sheet)


def emptied(
    ground: Ground,
    start: Arrangement,
    sheet: int,
    *,
    rounds: int,
    patience: int,
    seed: int,
    told: Told = lambda _area: None,
) -> Arrangement:
    """Move the pieces of one sheet to the others, as many as find room.

    Parameters
    ----------
    ground : Ground
        Bodies, sheets and the gap.
    start : Arrangement
        Every piece on a sheet.
    sheet : int
        The sheet to empty.
    rounds : int
        How often to go through the pool; less often if there is much to push on full sheets.
    patience : int
        How often without any success.
    seed : int
        For the choice of what is tried.
    told : callable
        Told the area that is left after each round.

    Returns
    -------
    Arrangement
        Pieces that found no room stand nowhere; all others keep the gap, proved. Pieces may have
        changed places: those left are not those that were on the sheet, but have less area.
    """
    state = start.copy()
    others = sheets_to_fill(ground, state, sheet)
    state.where[state.where == sheet] = NOWHERE
    search = _Search(ground, state, others, np.random.default_rng(seed))
    if not others:
        return state
    least, since = math.inf, 0
    for number in range(rounds):
        for piece in search.pool():
            if search.pushed < _PUSHED * rounds:
                search.place(piece)
        pool = search.pool()
        left = sum(map(search.area, pool))
        told(left)
        least, since = (left, 0) if left < least else (least, since + 1)
        if not pool or since > patience or search.pushed >= _PUSHED * rounds:
            break
        if not search.trade(pool[number % len(pool)]):
            search.shake(others[int(search.random.integers(len(others)))])
    return state


def sheets_to_fill(ground: Ground, state: Arrangement, sheet: int) -> list[int]:
    """Return the other sheets in use, the emptiest first."""
    standing = state.where != NOWHERE
    where = state.where[standing]
    area = np.array([ground.bodies[int(piece)].area_mm2 for piece in np.flatnonzero(standing)])
    size = len(ground.areas)
    counts = np.bincount(where, minlength=size)
    share = np.bincount(where, area, minlength=size) / np.array(
        [one.open_mm2 for one in ground.areas]
    )
    return [
        int(other)
        for other in np.argsort(share.round(9), kind="stable")
        if other != sheet and 0 < counts[other] <= _MOST_BODIES
    ]
