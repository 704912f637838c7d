"""Find places for the names in a picture: on what they name or near it, and off what matters."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.show.manual.book import text_width
from fabweave.show.manual.step_pictures import PictureLabel

#: Names in pictures: the size of their letters, and the height of their boxes, in points; a sign
#: before a name takes so much.
TAG, TAG_HIGH, SIGN = 9.5, 12.5, 9.0
#: The lower right corner of a picture is kept for its scale: width and height.
CORNER = (40.0, 12.5)
#: Between two boxes is so much room, or at least that.
_APART, _LEAST_APART = 5.7, 1.0
#: How far from what it names a box may stand, in points, and in how many directions it is tried:
#: these first, and those where names then cover one another, or a crossing.
_FEW = (1.5, 7.0, 18.0, 36.0), 12
_MANY = (1.5, 4.0, 7.0, 11.0, 16.0, 22.0, 29.0, 36.0, 41.5), 30
#: A longer line than this is drawn, in points; it is looked at in these shares of its length.
_LED, _ALONG = 0.5, np.array([0.0, 0.4, 0.8])[:, None, None]
#: Covering a rung of what is new costs as much as so many points of distance.
_COVERED = 3.0
#: What cannot be allowed, and what can if nothing else is left.
_NEVER, _HARDLY = 1e6, 1e3
#: What a box costs on another.
_ON_ANOTHER = 3e3
#: What a box costs on another's line, and one that is close to another.
_OVER_LINE, _CLOSE = 100.0, 20.0
_ROUNDS = 3
#: So many places are looked at together, and then twice as many.
_AT_ONCE = 32


@frozen_value
class Tag:
    """The place of a name.

    Parameters
    ----------
    mark : PictureLabel
    middle : (2,) float array
        Of its box.
    half : (2,) float array
        Half the width and height of its box.
    line : (2, 2) float array
        From what is named to the box; of no length where the box is at it.
    """

    mark: PictureLabel
    middle: FloatArray
    half: FloatArray
    line: FloatArray

    @property
    def led(self) -> bool:
        """Whether a line is drawn to what is named."""
        return float(np.linalg.norm(self.line[1] - self.line[0])) > _LED


def tag_half(mark: PictureLabel) -> FloatArray:
    """Return half the width and height of the box of a name."""
    sign = SIGN if mark.kind in ("over", "under") else 0.0
    wide = text_width(mark.text, TAG, bold=True) + 6.0 + sign
    return np.array([wide / 2.0, TAG_HIGH / 2.0])


def place_tags(
    marks: tuple[PictureLabel, ...],
    size: tuple[float, float],
    crossings: FloatArray,
    radius: float,
    bands: FloatArray,
) -> list[Tag]:
    """Find a place for each name in a picture.

    Places are tried on the strand itself, and around what is named at growing distances. One after
    the other takes the best that is free; as long as some are crowded, each then moves if another
    place has become better.

    Parameters
    ----------
    marks : tuple of PictureLabel
    size : tuple of float
        Width and height of the picture in points.
    crossings : (N, 2) float array
        What no box may cover ...
    radius : float
        ... nor what is so near to it.
    bands : (M, 2) float array
        Places on what is new, which boxes had better not cover.

    Returns
    -------
    list of Tag
        One for each mark, in their order.
    """
    tags: list[Tag] = []
    for tries in (_FEW, _MANY):
        tags, worst = _placed(
            [_Places(mark, size, crossings, radius, bands, tries) for mark in marks]
        )
        if worst < _HARDLY:
            break
    return tags


def _placed(tried: "Sequence[_Places]") -> tuple[list[Tag], float]:
    """Place names, and return what the worst of them costs."""
    tags: list[Tag] = []
    costs, seen_moves, moves = np.zeros(len(tried)), [-1] * len(tried), 0
    for _ in range(_ROUNDS):
        for number, places in enumerate(tried):
            if seen_moves[number] == moves:
                continue  # no other has moved
            best, costs[number] = places.best(tags[:number] + tags[number + 1 :])
            tag = places.tag(best)
            if number == len(tags) or np.any(tag.middle != tags[number].middle):
                moves += 1
            tags[number : number + 1] = [tag]
            seen_moves[number] = moves
        if costs.max(initial=0.0) < _CLOSE:
            break
    return tags, float(costs.max(initial=0.0))


class _Places:
    """The places that are tried for a name, nearest first, with what each costs by itself.

    What a place covers is looked at only when no nearer one is as good.
    """

    def __init__(
        self,
        mark: PictureLabel,
        size: tuple[float, float],
        crossings: FloatArray,
        radius: float,
        bands: FloatArray,
        tries: tuple[tuple[float, ...], int],
    ) -> None:
        self.mark, self.half = mark, tag_half(mark)
        self._bands, self._crossings, self._radius = bands, crossings, radius
        meets = mark.kind in ("over", "under")
        own = np.array([1.0, -1.0] if meets else [1.0])[:, None] * mark.along
        ends = mark.at + (mark.clear + 1.5) * own if meets else mark.at[None]
        reaches, directions = tries
        turns = 2.0 * np.pi * (np.arange(directions) + 0.5) / directions
        around = np.column_stack((np.cos(turns), np.sin(turns)))
        ways = np.concatenate((own[:, None], np.repeat(around[None], len(own), axis=0)), axis=1)
        reach = _smaller(self.half / np.maximum(np.abs(ways), 1e-9))
        far = reach[..., None] + reaches
        tried = (ends[:, None, None] + ways[:, :, None] * far[..., None]).reshape(len(own), -1, 2)
        if meets:
            # On the strand itself, beside what is new.
            beside = ends + own * float(np.abs(mark.along) @ self.half)
            tried = np.concatenate((tried, beside[:, None]), axis=1)
        anchors, middles = np.repeat(ends, tried.shape[1], axis=0), tried.reshape(-1, 2)
        low, high = middles - self.half, middles + self.half
        tips = np.minimum(np.maximum(anchors, low), high)
        length = np.linalg.norm(tips - anchors, axis=1)
        outside = (_smaller(low) < 0.5) | (_smaller(np.array(size) - 0.5 - high) < 0.0)
        outside |= (high[:, 0] > size[0] - CORNER[0]) & (low[:, 1] < CORNER[1])
        least = length + _NEVER * outside
        self._order = order = np.argsort(least, kind="stable")
        self.middles, self.anchors, self.tips = middles[order], anchors[order], tips[order]
        self._least, self._cost = least[order], np.empty(0)

    def _own_cost(self, until: int) -> FloatArray:
        """Return what the first places cost by themselves."""
        done = len(self._cost)
        if done < until:
            some = slice(done, until)
            covered = self._within(some, self._bands, 0.0)
            crossed = self._within(some, self._crossings, self._radius)
            cost = self._least[some] + _COVERED * covered + _HARDLY * crossed
            self._cost = np.concatenate((self._cost, cost))
        return self._cost[:until]

    def _within(self, some: slice, points: FloatArray, radius: float) -> IntArray:
        """Return how many points some boxes have or are so near to, (C,)."""
        across, up = (
            np.maximum(np.abs(points[:, axis] - self.middles[some, axis, None]) - half, 0.0)
            for axis, half in enumerate(self.half)
        )
        return np.asarray((across * across + up * up <= radius * radius).sum(axis=1))

    def best(self, others: Sequence[Tag]) -> tuple[int, float]:
        """Return the best place beside other names, and what it costs."""
        middles = np.array([tag.middle for tag in others]).reshape(-1, 2)
        halves = np.array([tag.half for tag in others]).reshape(-1, 2)
        leaders = np.array([tag.line for tag in others]).reshape(-1, 2, 2)
        best, least = 0, np.inf
        end = 0
        while end < len(self._least) and self._least[end] <= least:
            begin, end = end, end + max(end, _AT_ONCE)
            cost = self._own_cost(end)[begin:]
            if others:
                cost = cost + self._beside(slice(begin, end), middles, halves, leaders)
            # Of equals the first in the order of directions.
            ties = np.flatnonzero(cost == cost.min())
            at = int(ties[np.argmin(self._order[begin + ties])])
            if (cost[at], self._order[begin + at]) < (least, self._order[best]):
                best, least = begin + at, float(cost[at])
        return best, least

    def _beside(
        self, some: slice, middles: FloatArray, halves: FloatArray, leaders: FloatArray
    ) -> FloatArray:
        """Return what other names cost some places, by their boxes and lines."""
        own, anchors, tips = self.middles[some], self.anchors[some], self.tips[some]
        gap = _larger(np.abs(own[:, None] - middles) - self.half - halves)
        cost = _ON_ANOTHER * (gap < _LEAST_APART) + _CLOSE * (gap < _APART)
        cost += _HARDLY * _crossing(anchors, tips, leaders[:, 0], leaders[:, 1])
        point = anchors + _ALONG * (tips - anchors)
        over = _larger(np.abs(point[:, :, None] - middles) - halves) < 0.0
        point = leaders[:, 0] + _ALONG * (leaders[:, 1] - leaders[:, 0])
        beneath = _larger(np.abs(own[:, None] - point[:, None]) - self.half) < 0.0
        cost += _OVER_LINE * (over.sum(axis=0) + beneath.sum(axis=0))
        return np.asarray(cost.sum(axis=1))

    def tag(self, at: int) -> Tag:
        """Return a place."""
        line = np.stack((self.anchors[at], self.tips[at]))
        return Tag(self.mark, self.middles[at], self.half, line)


def _crossing(
    anchors: FloatArray, tips: FloatArray, starts: FloatArray, ends: FloatArray
) -> BoolArray:
    """Return which leaders cross which lines, (C, O)."""
    one, two = (
        _turn((ends - starts)[None], points[:, None] - starts[None]) for points in (anchors, tips)
    )
    line = (tips - anchors)[:, None]
    three, four = (_turn(line, points[None] - anchors[:, None]) for points in (starts, ends))
    return np.asarray((one * two < 0.0) & (three * four < 0.0))


def _larger(away: FloatArray) -> FloatArray:
    """Return the larger of what is across and up: ten times as fast as the maximum of an axis."""
    return np.asarray(np.maximum(away[..., 0], away[..., 1]))


def _smaller(room: FloatArray) -> FloatArray:
    """Return the smaller of what is across and up."""
    return np.asarray(np.minimum(room[..., 0], room[..., 1]))


def _turn(way: FloatArray, away: FloatArray) -> FloatArray:
    """Return to which side of directions others point, by sign."""
    return np.asarray(way[..., 0] * away[..., 1] - way[..., 1] * away[..., 0])
