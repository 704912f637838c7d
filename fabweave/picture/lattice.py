"""Lay the samples of a picture on a lattice that is turned against its pixels."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray


@dataclass(frozen=True)
class Lattice:
    """Samples of a picture: ``samples`` squared and one for each pixel.

    A square lattice is turned so that a step of a pixel to the right is so many steps of the
    lattice to the right and one down. No two samples of a pixel then lie in one row or one column:
    an edge that is nearly upright or level has as many shades as a pixel has samples, where a
    lattice that is not turned gives it only the square root of that, and looks like a saw.

    Parameters
    ----------
    width_px, height_px : int
        Size of the picture.
    samples : int
        With 1, a pixel has one sample, in its middle.

    Examples
    --------
    >>> lattice = Lattice(20, 10, 2)
    >>> lattice.count, lattice.width, lattice.height
    (5, 50, 40)
    >>> lattice.pixels(lattice.of_pixels(np.array([[3.0, 4.0, 1.0]]))).round(9).tolist()
    [[3.0, 4.0, 1.0]]
    """

    width_px: int
    height_px: int
    samples: int

    @property
    def _lean(self) -> int:
        return 0 if self.samples == 1 else 1

    @property
    def count(self) -> int:
        """Samples of a pixel."""
        return self.samples**2 + self._lean

    @property
    def scale(self) -> float:
        """Steps of the lattice to a pixel."""
        return float(np.sqrt(self.count))

    @property
    def width(self) -> int:
        """Columns of the lattice that reach over the whole picture."""
        return self.samples * self.width_px + self._lean * self.height_px

    @property
    def height(self) -> int:
        """Rows of it."""
        return self.samples * self.height_px + self._lean * self.width_px

    @property
    def _start(self) -> tuple[float, float]:
        """Where the picture's corner lies; an even number of samples stands in the middle, too."""
        aside = 0.5 if self.count % 2 == 0 else 0.0
        return float(self._lean * self.height_px), -aside

    def of_pixels(self, points: FloatArray) -> FloatArray:
        """Return places of the picture in steps of the lattice, nearness included, (N, 3)."""
        x, y, near = points.T
        across, down = self._start
        return np.column_stack(
            (
                self.samples * x - self._lean * y + across,
                self._lean * x + self.samples * y + down,
                near * self.scale,
            )
        )

    def pixels(self, places: FloatArray) -> FloatArray:
        """Return places of the lattice in pixels, nearness included, (N, 3)."""
        across, down = self._start
        u, v = places[:, 0] - across, places[:, 1] - down
        x = (self.samples * u + self._lean * v) / self.count
        y = (self.samples * v - self._lean * u) / self.count
        return np.column_stack((x, y, places[:, 2] / self.scale))

    def upright(self, places: FloatArray) -> FloatArray:
        """Return places turned back, so that they lie as seen, in steps of the lattice, (N, 3)."""
        return self.pixels(places) * self.scale

    def averaged(self, picture: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Return the mean of the samples of each pixel, (height_px, width_px, ...).

        Parameters
        ----------
        picture : (height, width, ...) float array
            What the samples show.
        """
        if self.samples == 1:
            return picture
        rows, columns = np.ogrid[0 : self.height_px, 0 : self.width_px]
        across = self.samples * columns - rows + self.height_px
        down = columns + self.samples * rows
        total = np.zeros((self.height_px, self.width_px, *picture.shape[2:]), dtype=np.float32)
        for aside, below in self._own():
            total += picture[down + below, across + aside]
        total /= np.float32(self.count)
        return total

    def _own(self) -> list[tuple[int, int]]:
        """Return the steps from the first pixel's corner to its samples, to the right and down."""
        reach = range(-self.samples - 1, self.samples + 2)
        steps = np.array([(right, down) for right in reach for down in reach], dtype=np.float64)
        middle = np.column_stack((steps + 0.5, np.zeros(len(steps))))
        middle[:, 0] += self.height_px
        inside = np.floor(self.pixels(middle)[:, :2] + 1e-9) == 0.0
        return [(int(x), int(y)) for x, y in steps[inside.all(axis=1)]]
