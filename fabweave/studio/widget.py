"""A notebook widget with the object of the studio."""

from importlib import resources

import anywidget
import traitlets

from fabweave.job.stations import Stations
from fabweave.show.viewer.page import three_script
from fabweave.studio.work import strips
from fabweave.studio.worker import framed

_SCRIPT = """
%s
%s
export default {
  render({ model, el }) {
    const canvas = document.createElement("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "The woven object");
    canvas.style.cssText = "display:block;width:100%%;height:440px;touch-action:none;cursor:grab";
    el.append(canvas);
    const scene = makeScene(canvas, { tapped() {} });
    if (!scene) {
      canvas.replaceWith("This browser shows no WebGL 2.");
      return;
    }
    const show = () => {
      const { buffer, byteOffset, byteLength } = model.get("data");
      const [, arrays] = unpacked(buffer.slice(byteOffset, byteOffset + byteLength));
      scene.show(arrays, usualWidthOf(arrays.position));
    };
    show();
    model.on("change:data", show);
  },
};
"""


def _script() -> str:
    files = [
        resources.files("fabweave.show.viewer").joinpath("viewer_page", "camera.js"),
        resources.files("fabweave.show.viewer").joinpath("viewer_page", "space.js"),
        resources.files("fabweave.studio").joinpath("page", "light.js"),
        resources.files("fabweave.studio").joinpath("page", "scene.js"),
    ]
    return _SCRIPT % (three_script(), "\n".join(file.read_text("utf-8") for file in files))


class ObjectWidget(anywidget.AnyWidget):
    """The woven object in a notebook: to be turned, in light and shadow."""

    _esm = _script()
    data = traitlets.Bytes().tag(sync=True)


def object_widget(stations: Stations) -> ObjectWidget:
    """Return a widget that shows the ribbons of some stations."""
    woven = stations.clear_ribbons
    return ObjectWidget(data=framed({}, strips(woven, stations.colours(woven))))
