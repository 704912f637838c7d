"""Hold what was found out about a mesh, and show it."""

from typing import TYPE_CHECKING, Any

from fabweave.app.front_door.notebook import face
from fabweave.app.inspection.facts import Inspection as Facts
from fabweave.app.inspection.files import inspection_picture
from fabweave.app.inspection.text import inspection_text
from fabweave.core.arrays import frozen_value

if TYPE_CHECKING:
    from PIL import Image


@frozen_value
class Inspection:
    """What a mesh is and what can be woven on it, before anything is decided.

    Made by :func:`fabweave.inspect`.
    """

    inspected: Facts

    @property
    def facts(self) -> dict[str, Any]:
        """Everything as plain values, as ``fabweave inspect --json`` prints it."""
        return self.inspected.facts

    @property
    def text(self) -> str:
        """All of it in words, as ``fabweave inspect`` prints it."""
        rows = inspection_text(self.facts)
        return "\n".join(f"{topic + ': ' if topic else '  '}{words}" for topic, words in rows)

    def picture(self) -> "Image.Image":
        """Return a picture of the mesh with its irregular vertices, beside the woven object."""
        return inspection_picture(self.inspected)

    def __repr__(self) -> str:
        mesh, twill = self.facts["mesh"], self.facts["twill"]
        return (
            f"Inspection({self.inspected.woven.title}: {mesh['faces']} faces, genus "
            f"{mesh['genus']}, {self.facts['threads']['count']} threads; 2/2 twill "
            f"{'exact' if twill['exact'] else 'not exact'})"
        )

    def _repr_html_(self) -> str:
        figures: dict[str, str] = {}
        for topic, words in inspection_text(self.facts):
            if topic or not figures:
                figures[topic] = words
            else:  # a line without a topic goes on with the one above
                last = next(reversed(figures))
                figures[last] += f"; {words}"
        return face(self.inspected.woven.title, figures, self.picture())
