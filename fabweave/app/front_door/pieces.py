"""Give the flat pieces of a job to Python users."""

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from fabweave.app.front_door.layout import Layout
from fabweave.app.front_door.notebook import face, outlines_svg
from fabweave.app.front_door.stations import Stations, there, with_layout
from fabweave.app.job import PlannedJob
from fabweave.app.joined_pieces import pieces_costs
from fabweave.core.arrays import IntArray, frozen_value
from fabweave.flat.outline import inscribed_polygon
from fabweave.flat.piece import Piece
from fabweave.report.costs.costs import Costs

if TYPE_CHECKING:
    from fabweave.app.front_door.ribbons import Ribbons


@frozen_value
class Pieces:
    """All flat pieces of an object, and how they are joined.

    Made by :meth:`fabweave.Ribbons.pieces`; :meth:`nest` goes on from here. Iterating gives each
    piece with its outline, stations, holes and joints, in millimetres in its own frame.
    """

    stations: Stations
    ribbons: "Ribbons"

    @property
    def planned(self) -> PlannedJob:
        """The station that stands behind this, as the pipeline hands it on."""
        return there(self.stations.planned)

    def __len__(self) -> int:
        return len(self.planned.piece_set.pieces)

    def __iter__(self) -> Iterator[Piece]:
        return iter(self.planned.piece_set.pieces)

    def __getitem__(self, number: int) -> Piece:
        return self.planned.piece_set.pieces[number]

    @cached_property
    def polygons(self) -> tuple[shapely.Polygon, ...]:
        """Each piece as a shapely polygon with its holes, nominal, in its own frame.

        Arcs are polygons within 0.01 mm; a round hole has 64 sides.
        """
        return tuple(map(_polygon, self))

    @property
    def kinds(self) -> IntArray:
        """Which kind each piece is of, from 1: congruent pieces of a material are one kind."""
        return self.planned.kinds

    @cached_property
    def costs(self) -> Costs:
        """Times of machine and hands, and money, as far as they are known before nesting."""
        planned = self.planned
        return pieces_costs(planned.piece_set, planned.woven, planned.settings, planned.supplies)

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each piece, as ``pandas.DataFrame`` takes them.

        Examples
        --------
        >>> import fabweave as fw
        >>> pieces = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> sorted(pieces.rows()[0])[:5]
        ['area_mm2', 'crossings', 'end_joint', 'holes', 'id']
        """
        labels = self.planned.woven.labels
        return [
            {
                "id": piece.id,
                "thread": labels[piece.thread],
                "kind": kind,
                "length_mm": float(np.ptp(piece.outline[:, 0])),
                "width_mm": float(np.ptp(piece.outline[:, 1])),
                "area_mm2": polygon.area,
                "crossings": len(piece.crossings),
                "holes": len(piece.holes) + len(piece.slots),
                "start_joint": piece.start_joint,
                "end_joint": piece.end_joint,
            }
            for piece, kind, polygon in zip(self, self.kinds.tolist(), self.polygons, strict=True)
        ]

    def nest(self, **options: Any) -> Layout:
        """Nest the pieces on sheets, each material on its own.

        Parameters
        ----------
        options
            As on the command line: ``effort="quick"``, ``seed=1``, ``layout=FILE``. If sheets are
            named here, and differ from those that the pieces were split for, the threads are split
            anew: the layout's own :attr:`~fabweave.Layout.pieces` are those that lie on it.

        Raises
        ------
        CannotMakeError
            If a piece fits no sheet, or sheets run out; and what would help.

        Examples
        --------
        >>> import fabweave as fw
        >>> pieces = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> pieces.nest(sheet="400x300mm", effort="quick")
        Layout(octahedron: 8 pieces on 1 sheet, 40 % used)
        """
        stations = with_layout(self.stations, options)
        return Layout(stations, Pieces(stations, self.ribbons))

    def _figures(self) -> dict[str, Any]:
        return {
            "pieces": len(self),
            "joints": len(self.planned.piece_set.joints),
            "kinds": len(np.unique(self.kinds)),
            "material": self.planned.supplies.description,
        }

    def __repr__(self) -> str:
        figures = self._figures()
        return (
            f"Pieces({self.planned.woven.title}: {figures['pieces']} pieces, {figures['joints']} "
            f"joints, {figures['kinds']} kinds, in {figures['material']})"
        )

    def _repr_html_(self) -> str:
        colours = self.planned.piece_colours
        return face(self.planned.woven.title, self._figures(), outlines_svg(self.polygons, colours))


def _polygon(piece: Piece) -> shapely.Polygon:
    """Return a piece as a polygon with its round holes and slots, in its own frame."""
    holes = [
        shapely.Point(x, y).buffer(diameter / 2, quad_segs=16).exterior
        for _, x, y, diameter in piece.holes.tolist()
    ]
    slots = [shapely.LinearRing(inscribed_polygon(slot.path)) for slot in piece.slots]
    return shapely.Polygon(piece.outline, [*holes, *slots])
