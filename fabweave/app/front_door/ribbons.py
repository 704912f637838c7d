"""Give the ribbons of a woven object to Python users."""

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fabweave.app.colours import woven_colours
from fabweave.app.front_door.look import seen_from
from fabweave.app.front_door.notebook import face
from fabweave.app.front_door.pieces import Pieces
from fabweave.app.front_door.stations import Stations, clear_ribbons, completed, with_pieces
from fabweave.app.woven_object import WovenObject
from fabweave.core.arrays import FloatArray, IntArray, frozen, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.model.rung_colours import rung_colours
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.measures import thread_lengths
from fabweave.ribbon.rules.bends import measure_bends

if TYPE_CHECKING:
    import trimesh
    from PIL import Image

    from fabweave.app.front_door.weave import Weave


@frozen_value
class Ribbons:
    """A ribbon along every thread, in space, with room for what lies above and below it.

    Made by :meth:`fabweave.Weave.ribbons`; :meth:`pieces` goes on from here. Where ribbons would
    come too near to one another they are narrower than elsewhere, unless a width was asked for.
    """

    stations: Stations
    weave: "Weave"

    @cached_property
    def woven(self) -> WovenObject:
        """The woven object as ``fabweave model`` writes it."""
        return clear_ribbons(self.stations)

    @property
    def vertices(self) -> FloatArray:
        """Ends of the cross-lines in millimetres, (2 R, 3): right and left by turns."""
        return frozen(ribbon_triangles(self.woven.ribbons)[0])

    @property
    def triangles(self) -> IntArray:
        """The flat facets of all ribbons, (F, 3)."""
        return frozen(ribbon_triangles(self.woven.ribbons)[1])

    @property
    def thread_of_triangle(self) -> IntArray:
        """The number of the thread of each facet, (F,)."""
        return frozen(ribbon_triangles(self.woven.ribbons)[2])

    @property
    def widths_mm(self) -> FloatArray:
        """The width at every cross-line, (R,)."""
        return frozen(measure_bends(self.woven.ribbons).width_mm)

    @property
    def lengths_mm(self) -> FloatArray:
        """The length of each thread along the middle of its ribbon, (T,)."""
        return frozen(thread_lengths(self.woven.ribbons))

    @property
    def colours(self) -> Colours:
        """Red, green and blue at every cross-line, (R, 3)."""
        colours = woven_colours(self.woven, *completed(self.stations))
        return frozen(rung_colours(self.woven.ribbons, colours))

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each thread, as ``pandas.DataFrame`` takes them.

        Examples
        --------
        >>> import fabweave as fw
        >>> rows = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().rows()
        >>> [row["thread"] for row in rows], rows[0]["crossings"]
        (['A', 'B', 'C', 'D'], 6)
        """
        threads, bounds = self.woven.weave.threads, self.woven.ribbons.offsets.tolist()
        widths, lengths = self.widths_mm, self.lengths_mm.tolist()
        return [
            {
                "thread": label,
                "closed": bool(threads.closed[number]),
                "bunch": int(self.woven.bunches[number]),
                "crossings": int(threads.lengths[number]),
                "length_mm": lengths[number],
                "narrowest_mm": float(widths[start:end].min(initial=np.inf)),
                "widest_mm": float(widths[start:end].max(initial=0.0)),
            }
            for number, (label, start, end) in enumerate(
                zip(self.woven.labels, bounds[:-1], bounds[1:], strict=True)
            )
        ]

    def to_trimesh(self) -> "trimesh.Trimesh":
        """Return the ribbons as ``trimesh.Trimesh`` with the colours of the strands.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("cube", size="200mm")).ribbons()
        >>> len(ribbons.to_trimesh().faces) == len(ribbons.triangles)
        True
        """
        import trimesh  # noqa: PLC0415 - slow to import, and seldom wanted

        vertices, triangles, _ = ribbon_triangles(self.woven.ribbons)
        shown = np.repeat(self.colours[triangles[::2, 0] // 2], 2, axis=0)
        return trimesh.Trimesh(vertices, triangles, face_colors=shown, process=False)

    def pieces(self, **options: Any) -> Pieces:
        """Split the threads into flat pieces that lap and are joined.

        Pieces are as short as waste and joints suggest, unless a length is asked for, and fit the
        sheets: what is said of sheets belongs here.

        Parameters
        ----------
        options
            As on the command line: ``max_length="200mm"``, ``joint="rivet:2"``, ``lap="15mm"``,
            ``hole="3.3mm"``, ``slots=True``, ``sheet="600x400mm:3"`` (or a list of them),
            ``stock="stock.toml"``, ``margin``, ``gap``, ``rotations="90"``.

        Raises
        ------
        InputError
            If an option is wrong.
        CannotMakeError
            If a ribbon is too narrow or too stiff, or no piece fits a sheet; and what would help.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
        >>> ribbons.pieces(max_length="400mm")
        Pieces(Octahedron: 8 pieces, 8 joints, 4 kinds, in Card, 300 g/m², 0.4 mm)
        """
        stations = with_pieces(self.stations, options)
        return Pieces(stations, Ribbons(stations, self.weave))

    def picture(
        self, *, size_px: tuple[int, int] = (1000, 800), view: tuple[float, float] | None = None,
        across: Any = None, samples: int = 2,
    ) -> "Image.Image":  # fmt: skip
        """Return a picture of the woven object, its strands in their colours.

        Parameters
        ----------
        size_px : (int, int)
            Width and height.
        view : (float, float), optional
            Azimuth and elevation in degrees, as ``--view`` takes them; chosen by default.
        across : length, optional
            How much of the world the picture shows across, such as ``"400mm"``, so that pictures
            of several objects have one scale; by default, the object fills it.
        samples : int
            Samples of a pixel along each side: more make smoother edges.

        Raises
        ------
        InputError
            If the view or the size makes no sense.

        Examples
        --------
        >>> import fabweave as fw
        >>> ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
        >>> ribbons.picture(size_px=(300, 240), view=(-90, 20), across="400mm").size
        (300, 240)
        """
        from fabweave.picture.object_picture import weave_picture  # noqa: PLC0415

        vertices, triangles, _ = ribbon_triangles(self.woven.ribbons)
        return weave_picture(
            self.woven.ribbons,
            woven_colours(self.woven, *completed(self.stations)),
            size_px=size_px,
            view=seen_from(view, across, vertices, triangles),
            samples=samples,
        )

    def _figures(self) -> dict[str, str]:
        _, supplies = completed(self.stations)
        widths = self.widths_mm
        return {
            "ribbons": str(len(self.woven.labels)),
            "material": supplies.description,
            "width, mm": f"{widths.min():.1f} to {widths.max():.1f}",
            "length in all, m": f"{self.lengths_mm.sum() / 1000:.2f}",
        }

    def __repr__(self) -> str:
        figures = self._figures()
        return (
            f"Ribbons({self.woven.title}: {figures['ribbons']} ribbons in {figures['material']}, "
            f"{figures['width, mm']} mm wide, {figures['length in all, m']} m in all)"
        )

    def _repr_html_(self) -> str:
        return face(self.woven.title, self._figures(), self.picture())
