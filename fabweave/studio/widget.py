"""A notebook widget with the object of the studio."""

import anywidget
import traitlets

from fabweave.job.stations import Stations
from fabweave.show.bundle import bundled
from fabweave.studio.work import strips
from fabweave.studio.worker import framed

#: Notebooks load one module, and are given no other files.
_ENTRY = "studio/page/widget.js"


class ObjectWidget(anywidget.AnyWidget):
    """The woven object in a notebook: to be turned, in light and shadow."""

    _esm = f'{bundled(_ENTRY)}\nexport default modules["{_ENTRY}"];\n'
    data = traitlets.Bytes().tag(sync=True)


def object_widget(stations: Stations) -> ObjectWidget:
    """Return a widget that shows the ribbons of some stations."""
    woven = stations.clear_ribbons
    return ObjectWidget(data=framed({}, strips(woven, stations.colours(woven))))
