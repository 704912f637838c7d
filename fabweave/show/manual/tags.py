"""Find places for the names in a picture: on what they name or near it, and off what matters."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, frozen_value
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
_LED, _ALONG = 0.5, (0.0, 0.4, 0.8)
#: Covering a rung of what is new costs as much as so many points of distance.
_COVERED = 3.0
#: What cannot be allowed, and what can if nothing else is left.
_NEVER, _HARDLY = 1e6, 1e3
#: What a box costs on another.
_ON_ANOTHER = 3e3
#: What a box costs on another's line, and one that is close to another.
_OVER_LINE, _CLOSE = 100.0, 20.0
_ROUNDS = 3


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
    tags: dict[int, Tag] = {}
    worst = 0.0
    for _ in range(_ROUNDS):
        worst = 0.0
        for number, places in enumerate(tried):
            others = [tag for at, tag in tags.items() if at != number]
            best, cost = places.best(others)
            tags[number] = places.tag(best)
            worst = max(worst, cost)
        if worst < _CLOSE:
            break
    return list(tags.values()), worst


class _Places:
    """The places that are tried for a name, with what each costs by itself."""

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
        ends = [mark.at]
        if mark.kind in ("over", "under"):
            ends = [mark.at + way * (mark.clear + 1.5) * mark.along for way in (1.0, -1.0)]
        reaches, directions = tries
        turns = 2.0 * np.pi * (np.arange(directions) + 0.5) / directions
        ways = np.column_stack((np.cos(turns), np.sin(turns)))
        middles, anchors = [], []
        for end, own in zip(ends, (1.0, -1.0), strict=False):
            for way in (own * mark.along, *ways):
                reach = float(np.min(self.half / np.maximum(np.abs(way), 1e-9)))
                for far in reaches:
                    middles.append(end + way * (reach + far))
                    anchors.append(end)
            if mark.kind in ("over", "under"):
                # On the strand itself, beside what is new.
                middles.append(end + own * mark.along * float(np.abs(mark.along) @ self.half))
                anchors.append(end)
        self.middles, self.anchors = np.array(middles), np.array(anchors)
        near = np.clip(self.anchors, self.middles - self.half, self.middles + self.half)
        self.tips = near
        length = np.linalg.norm(near - self.anchors, axis=1)
        low, high = self.middles - self.half, self.middles + self.half
        outside = (low < 0.5).any(axis=1) | (high > np.array(size) - 0.5).any(axis=1)
        outside |= (high[:, 0] > size[0] - CORNER[0]) & (low[:, 1] < CORNER[1])
        covered = self._within(bands, 0.0).sum(axis=1)
        crossed = self._within(crossings, radius).sum(axis=1)
        self.cost = length + _COVERED * covered + _NEVER * outside + _HARDLY * crossed

    def _within(self, points: FloatArray, radius: float) -> BoolArray:
        """Return which points each box has or is so near to, (C, N)."""
        away = np.abs(points[None] - self.middles[:, None]) - self.half
        across, up = np.maximum(away, 0.0).transpose(2, 0, 1)
        return np.asarray(across * across + up * up <= radius * radius)

    def best(self, others: Sequence[Tag]) -> tuple[int, float]:
        """Return the best place beside other names, and what it costs."""
        if not others:
            return int(np.argmin(self.cost)), float(self.cost.min())
        middles = np.array([tag.middle for tag in others])
        halves = np.array([tag.half for tag in others])
        leaders = np.array([tag.line for tag in others])
        gap = _larger(np.abs(self.middles[:, None] - middles) - self.half - halves)
        cost = self.cost + (_ON_ANOTHER * (gap < _LEAST_APART) + _CLOSE * (gap < _APART)).sum(
            axis=1
        )
        cost += _HARDLY * self._crossing(leaders[:, 0], leaders[:, 1]).sum(axis=1)
        line = self.tips - self.anchors
        for share in _ALONG:
            own = self.anchors + share * line
            away = np.abs(own[:, None] - middles) - halves
            cost += _OVER_LINE * (_larger(away) < 0.0).sum(axis=1)
            point = leaders[:, 0] + share * (leaders[:, 1] - leaders[:, 0])
            away = np.abs(self.middles[:, None] - point) - self.half
            cost += _OVER_LINE * (_larger(away) < 0.0).sum(axis=1)
        return int(np.argmin(cost)), float(cost.min())

    def _crossing(self, starts: FloatArray, ends: FloatArray) -> BoolArray:
        """Return which leaders cross which lines, (C, O)."""
        one, two = (
            _turn((ends - starts)[None], points[:, None] - starts[None])
            for points in (self.anchors, self.tips)
        )
        line = (self.tips - self.anchors)[:, None]
        three, four = (
            _turn(line, points[None] - self.anchors[:, None]) for points in (starts, ends)
        )
        return np.asarray((one * two < 0.0) & (three * four < 0.0))

    def tag(self, at: int) -> Tag:
        """Return a place."""
        line = np.stack((self.anchors[at], self.tips[at]))
        return Tag(self.mark, self.middles[at], self.half, line)


def _larger(away: FloatArray) -> FloatArray:
    """Return the larger of what is across and up: ten times as fast as the maximum of an axis."""
    return np.asarray(np.maximum(away[..., 0], away[..., 1]))


def _turn(way: FloatArray, away: FloatArray) -> FloatArray:
    """Return to which side of directions others point, by sign."""
    return np.asarray(way[..., 0] * away[..., 1] - way[..., 1] * away[..., 0])
