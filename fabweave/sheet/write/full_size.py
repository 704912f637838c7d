"""Pages of a PDF that are cut along or laid on: printed at full size, however large they are."""

from io import BytesIO
from math import ceil

from reportlab import rl_config
from reportlab.pdfgen.canvas import Canvas

#: Streams are bytes: written in letters they take a quarter more room, and most of the time.
rl_config.useA85 = 0

#: Readers show no page with a longer side, in the units of the page.
_LONGEST = 14_400.0
#: The version of PDF in which pages may have a larger unit than a point.
_VERSION = (1, 6)


class FullSizeCanvas(Canvas):  # type: ignore[misc]  # reportlab has no types
    """A canvas that tells printers not to scale; pages that are too large have a larger unit.

    Examples
    --------
    >>> file = BytesIO()
    >>> canvas = FullSizeCanvas(file, pagesize=(20000.0, 1000.0), pageCompression=0, invariant=1)
    >>> canvas.showPage()
    >>> canvas.save()
    >>> b"/MediaBox [ 0 0 10000 500 ]" in file.getvalue(), b"/UserUnit 2" in file.getvalue()
    (True, True)
    """

    def __init__(self, file: BytesIO, **kwargs: object) -> None:
        super().__init__(file, **kwargs)
        self.setViewerPreference("PrintScaling", "None")

    def showPage(self) -> None:  # noqa: N802 - reportlab's name
        """End a page."""
        wide, high = self._pagesize  # type: ignore[has-type]
        unit = ceil(max(wide, high) / _LONGEST)
        if unit == 1:
            super().showPage()
            return
        self._psCommandsBeforePage = [f"{1.0 / unit:.9f} 0 0 {1.0 / unit:.9f} 0 0 cm"]
        self._pagesize = wide / unit, high / unit
        super().showPage()
        self._psCommandsBeforePage, self._pagesize = [], (wide, high)
        page = self._doc.Pages.pages[-1]
        page.__NoDefault__ = [*page.__NoDefault__, "UserUnit"]
        page.UserUnit = unit
        self._doc._pdfVersion = max(self._doc._pdfVersion, _VERSION)
