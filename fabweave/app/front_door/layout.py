"""Give the layout of a job to Python users, and write its folder."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import affinity

from fabweave.app.front_door.notebook import face, sheet_svg
from fabweave.app.front_door.stations import Stations, there, with_files
from fabweave.app.front_door.written import WrittenJob, write_stations
from fabweave.app.job import PlannedJob
from fabweave.app.job_folder import folder_at
from fabweave.core.arrays import FloatArray, frozen, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
from fabweave.nest.layout import Layout as NestedLayout
from fabweave.stock.sheet_size import SheetSize

if TYPE_CHECKING:
    from fabweave.app.front_door.pieces import Pieces


@frozen_value
class Layout:
    """Where each piece lies on which sheet.

    Made by :meth:`fabweave.Pieces.nest`; :meth:`write` goes on from here.

    Parameters
    ----------
    stations : Stations
    pieces : Pieces
        The pieces that lie on the sheets.
    """

    stations: Stations
    pieces: "Pieces"

    @property
    def planned(self) -> PlannedJob:
        """The pieces that lie on the sheets, as the pipeline hands them on."""
        return there(self.stations.planned)

    @property
    def nested(self) -> NestedLayout:
        """The station that stands behind this, as the pipeline hands it on."""
        return there(self.stations.layout)

    @property
    def sheets(self) -> tuple[SheetSize, ...]:
        """The sheets in use, with their sizes in millimetres."""
        return self.nested.sheets

    @cached_property
    def polygons(self) -> tuple[shapely.Polygon, ...]:
        """Each piece and spare where it lies on its sheet, as a shapely polygon with holes."""
        placed = []
        own, origins = self.pieces.polygons, self.planned.origins.tolist()
        for origin, place in zip(origins, self.nested.placements, strict=True):
            turned = affinity.rotate(own[origin], place.rotation_deg, origin=(0, 0))
            placed.append(affinity.translate(turned, place.x_mm, place.y_mm))
        return tuple(placed)

    @property
    def colours(self) -> Colours:
        """Red, green and blue of each piece, as it is shown in the object, (N, 3)."""
        return frozen(self.planned.piece_colours)

    @property
    def utilisation(self) -> FloatArray:
        """What share of each sheet becomes pieces, holes taken off, (S,)."""
        used = np.zeros(len(self.sheets))
        for polygon, place in zip(self.polygons, self.nested.placements, strict=True):
            used[place.sheet] += polygon.area
        return frozen(used / [sheet.area_mm2 for sheet in self.sheets])

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each piece and spare, as ``pandas.DataFrame`` takes them.

        A point p of the piece lies at R(rotation_deg) p + (x_mm, y_mm) on its sheet. Sheets are
        numbered from 1, as their files are.

        Examples
        --------
        >>> import fabweave as fw
        >>> ball = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> list(ball.nest(effort="quick").rows()[0])
        ['id', 'sheet', 'rotation_deg', 'x_mm', 'y_mm']
        """
        return [
            {
                "id": piece.id,
                "sheet": place.sheet + 1,
                "rotation_deg": place.rotation_deg,
                "x_mm": place.x_mm,
                "y_mm": place.y_mm,
            }
            for piece, place in zip(self.planned.to_cut, self.nested.placements, strict=True)
        ]

    def write(self, folder: str | Path, **options: Any) -> WrittenJob:
        """Write the finished job, and prove the written files.

        Parameters
        ----------
        folder : str or Path
            New, empty, or an older job's folder, which is replaced.
        options
            Of files, as on the command line: ``kerf="0.15mm"``, ``preset="glowforge"``,
            ``labels="numbers"``, ``dxf="R12"``, ``profile="service"``, ``paper="letter"`` …

        Returns
        -------
        WrittenJob
            The same bytes as ``fabweave make`` writes with the same options.

        Raises
        ------
        InputError
            If the folder holds anything but a job, or an option is wrong.
        CannotMakeError
            If a rule is broken under ``strict=True``, or a check objects to the files.

        Examples
        --------
        >>> import fabweave as fw, tempfile, pathlib
        >>> ball = fw.weave(fw.shape("octahedron", size="200mm")).ribbons().pieces()
        >>> layout = ball.nest(effort="quick")
        >>> layout.write(pathlib.Path(tempfile.mkdtemp()) / "ball").proof.ok
        True
        """
        stations = with_files(self.stations, options)
        directory = folder_at(folder)
        return WrittenJob(directory, write_stations(stations, directory), self)

    def picture(self, sheet: int = 1) -> str:
        """Return a sheet, counted from 1, as SVG."""
        size = self.sheets[sheet - 1]
        lying = [
            number
            for number, place in enumerate(self.nested.placements)
            if place.sheet == sheet - 1
        ]
        colours = self.planned.piece_colours[self.planned.origins[lying]]
        polygons = [self.polygons[number] for number in lying]
        return sheet_svg((size.width_mm, size.height_mm), polygons, colours)

    def _counts(self) -> str:
        pieces = agree(len(self.nested.placements), "{n} piece[|s]")
        return f"{pieces} on {agree(len(self.sheets), '{n} sheet[|s]')}"

    def __repr__(self) -> str:
        used = self.utilisation.mean()
        return f"Layout({self.planned.woven.title}: {self._counts()}, {100 * used:.0f} % used)"

    def _repr_html_(self) -> str:
        figures = {
            f"sheet {number}": f"{100 * used:.0f} % used"
            for number, used in enumerate(self.utilisation.tolist(), start=1)
        }
        return face(f"{self.planned.woven.title}: {self._counts()}", figures, self.picture())
