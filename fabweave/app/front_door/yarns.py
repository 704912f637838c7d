"""Give yarns along the threads of a woven object to Python users."""

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fabweave.app.colours import woven_colours
from fabweave.app.front_door.look import seen_from
from fabweave.app.front_door.notebook import face
from fabweave.app.front_door.stations import Stations, completed, with_ribbons
from fabweave.app.woven_object import WovenObject
from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.model.bodies import Body, yarn_bodies
from fabweave.model.yarns import Yarns as SpunYarns

if TYPE_CHECKING:
    from PIL import Image


@frozen_value
class Yarns:
    """A closed tube along every thread, over and under the others without touching them.

    Made by :meth:`fabweave.Weave.yarns`; nothing is cut of them.
    """

    stations: Stations
    spun: SpunYarns

    @property
    def woven(self) -> WovenObject:
        """The woven object whose threads these are."""
        woven = with_ribbons(self.stations, {}).ribbons
        assert woven is not None  # noqa: S101 - they were laid to spin these
        return woven

    @property
    def radius_mm(self) -> FloatArray:
        """The radius of each cross-section, (N,)."""
        return self.spun.radius_mm

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """One closed surface for each thread."""
        colours = woven_colours(self.woven, *completed(self.stations))
        return yarn_bodies(self.spun, self.woven.labels, colours)

    def picture(
        self, *, size_px: tuple[int, int] = (1000, 800), view: tuple[float, float] | None = None,
        across: Any = None, samples: int = 2,
    ) -> "Image.Image":  # fmt: skip
        """Return a picture of the yarns; the arguments are those of ``Ribbons.picture``."""
        from fabweave.picture.body_picture import bodies_picture  # noqa: PLC0415

        vertices = np.concatenate([body.vertices for body in self.bodies])
        base = np.cumsum([0, *(len(body.vertices) for body in self.bodies)]).tolist()
        triangles = np.concatenate(
            [body.all_triangles + first for body, first in zip(self.bodies, base, strict=False)]
        )
        seen = seen_from(view, across, vertices, triangles)
        return bodies_picture(self.bodies, seen, size_px=size_px, samples=samples)

    def _figures(self) -> dict[str, str]:
        radius = self.radius_mm
        return {
            "yarns": str(len(self.bodies)),
            "radius, mm": f"{radius.min():.2f} to {radius.max():.2f}",
        }

    def __repr__(self) -> str:
        figures = self._figures()
        return (
            f"Yarns({self.woven.title}: {figures['yarns']} yarns, "
            f"{figures['radius, mm']} mm in radius)"
        )

    def _repr_html_(self) -> str:
        return face(self.woven.title, self._figures(), self.picture())
