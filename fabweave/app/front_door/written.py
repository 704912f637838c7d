"""Write jobs from Python, and hold what was written."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fabweave.app.front_door.notebook import face
from fabweave.app.front_door.stations import Stations, there
from fabweave.app.job import Job
from fabweave.app.job_folder import check_destination, clear_abandoned, finished_folder, told_where
from fabweave.app.pipeline import FinishedJob, draw_job, start_side_work, write_and_prove
from fabweave.app.preflight_job import Preflight
from fabweave.core.arrays import frozen_value
from fabweave.core.messages import agree
from fabweave.report.costs.costs import Costs
from fabweave.verify import VerifyReport

if TYPE_CHECKING:
    from PIL import Image

    from fabweave.app.front_door.layout import Layout
    from fabweave.app.front_door.pieces import Pieces
    from fabweave.app.front_door.weave import Weave


@frozen_value
class WrittenJob:
    """A finished job in its folder, with the proof of its files.

    Made by :func:`fabweave.make` and :meth:`fabweave.Layout.write`. ``chosen`` says which coarser
    mesh was woven in place of one that cannot be built; it is empty where none was.
    """

    folder: Path
    finished: FinishedJob
    layout: "Layout"
    chosen: str = ""

    @property
    def job(self) -> Job:
        """Everything that was made: weave, ribbons, pieces, layout and drawings."""
        return self.finished.job

    @property
    def pieces(self) -> "Pieces":
        """The flat pieces."""
        return self.layout.pieces

    @property
    def weave(self) -> "Weave":
        """The weave."""
        return self.pieces.ribbons.weave

    @property
    def proof(self) -> VerifyReport:
        """What was proved about the written files, check by check."""
        return self.finished.proof

    @property
    def preflight(self) -> Preflight:
        """Which rules of the material and of those who cut the pieces break."""
        return self.finished.preflight

    @property
    def missing(self) -> tuple[str, ...]:
        """The papers that could not be made, each with the reason; none in most jobs."""
        return self.finished.missing

    @property
    def notes(self) -> tuple[str, ...]:
        """What a maker should know before cutting."""
        return self.job.notes

    @property
    def files(self) -> tuple[Path, ...]:
        """The files in the folder, in the order of their names."""
        return tuple(sorted(path for path in self.folder.rglob("*") if path.is_file()))

    @property
    def costs(self) -> Costs:
        """Times of machine and hands, and money, each a range."""
        return self.job.costs

    def picture(self) -> "Image.Image":
        """Return the picture of the woven object."""
        from PIL import Image  # noqa: PLC0415 - only pictures need it

        with Image.open(self.folder / "render.png") as picture:
            return picture.copy()

    def _counts(self) -> dict[str, str]:
        return {
            "pieces": agree(len(self.job.piece_set.pieces), "{n} piece[|s]"),
            "joints": agree(len(self.job.piece_set.joints), "{n} joint[|s]"),
            "sheets": agree(len(self.job.drawings), "{n} sheet[|s]"),
            "proof": f"proved by {len(self.proof.checks)} checks",
        }

    def __repr__(self) -> str:
        return f"WrittenJob({str(self.folder)!r}: {', '.join(self._counts().values())})"

    def _repr_html_(self) -> str:
        figures: dict[str, Any] = {**self._counts(), "folder": self.folder}
        return face(self.job.woven.title, figures, self.picture())


def write_stations(stations: Stations, folder: Path) -> FinishedJob:
    """Write and prove the job that stations lead to."""
    clear_abandoned(folder)
    check_destination(folder)
    planned, layout = there(stations.planned), there(stations.layout)
    side = start_side_work(planned)
    job = draw_job(planned, layout, side, given_mesh=stations.request.given)
    with told_where(folder), finished_folder(folder) as fresh:
        return write_and_prove(job, fresh)
