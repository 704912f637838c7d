"""A notebook widget with the object of the studio."""

from typing import Any

import anywidget
import numpy as np
import traitlets

from fabweave.core.errors import FabweaveError
from fabweave.job.stations import Stations
from fabweave.show.bundle import bundled
from fabweave.studio.work import cut_ribbons, strips
from fabweave.studio.worker import framed

#: Notebooks load one module, and are given no other files.
_ENTRY = "studio/page/widget.js"
#: The options that are traits.
_OPTIONS = ("width", "pattern", "colours")


class ObjectWidget(anywidget.AnyWidget):
    """The woven object in a notebook: to be turned, in light and shadow.

    ``width``, ``pattern`` and ``colours`` are the options of these names; once one is set, the
    object follows. ``piece`` is the id of the piece that was tapped.
    """

    _esm = f'{bundled(_ENTRY)}\nexport default modules["{_ENTRY}"];\n'
    data = traitlets.Bytes().tag(sync=True)
    width = traitlets.Unicode().tag(sync=True)
    pattern = traitlets.Unicode().tag(sync=True)
    colours = traitlets.Unicode().tag(sync=True)
    piece = traitlets.Unicode().tag(sync=True)
    rung = traitlets.Int(-1).tag(sync=True)
    chosen = traitlets.Int(-1).tag(sync=True)

    def __init__(self, stations: Stations) -> None:
        """Show the ribbons of some stations."""
        settings = stations.asked
        super().__init__(
            width=str(settings.width_rule), pattern=settings.weave.pattern,
            colours=settings.pieces.colours,
        )  # fmt: skip
        self._show(stations)
        self.observe(self._tapped, "rung")

    def _show(self, stations: Stations) -> None:
        woven = stations.clear_ribbons
        self.data = framed({}, strips(woven, stations.colours(woven)))
        self.stations = stations
        self._owner: dict[str, np.ndarray[Any, Any]] | None = None
        self.rung = self.chosen = -1
        self.piece = ""

    @traitlets.validate(*_OPTIONS)
    def _set(self, proposal: Any) -> str:
        """Make the object anew with an option; a TraitError says why that cannot be."""
        name, value = proposal["trait"].name, str(proposal["value"])
        if hasattr(self, "stations") and value != getattr(self, name):
            try:
                self._show(self.stations.also({name: value}))
            except FabweaveError as error:
                raise traitlets.TraitError(str(error)) from None
        return value

    def _tapped(self, change: Any) -> None:
        """Say which piece has a rung; pieces are planned when one is first asked for."""
        if change["new"] < 0:
            return
        if self._owner is None:
            self._owner = cut_ribbons(self.stations)
            self.data = framed({}, self._owner)
        number = int(self._owner["owner"][change["new"]])
        self.piece = self.stations.planned.piece_set.pieces[number].id
        self.chosen = number
