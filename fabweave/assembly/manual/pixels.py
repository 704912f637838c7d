"""Keep pictures in a PDF as they are, packed tightly: in bytes, not in letters."""

import zlib

import numpy as np
import numpy.typing as npt
from PIL import Image
from reportlab.pdfbase.pdfdoc import PDFImageXObject

#: Shades of grey that are multiples of this, white included, take half a byte each.
GREY_STEP = 17


class Pixels(PDFImageXObject):  # type: ignore[misc]  # reportlab has no types
    """A picture as an object of a PDF.

    reportlab's own pictures are written in letters, which takes a quarter more room and most of
    the time of a manual with a picture for each step.

    Parameters
    ----------
    name : str
        Unique in its PDF.
    picture : Image
        RGB, or grey; shades of grey that are all multiples of 17 are kept in half a byte.
    """

    def __init__(self, name: str, picture: Image.Image) -> None:
        super().__init__(name)
        values = np.asarray(picture)
        self.width, self.height = picture.size
        self.colorSpace = "DeviceGray" if values.ndim == 2 else "DeviceRGB"
        self.bitsPerComponent = 8
        if values.ndim == 2 and not np.any(values % GREY_STEP):
            self.bitsPerComponent = 4
            values = _halved(values // GREY_STEP)
        self.streamContent = zlib.compress(values.tobytes())
        self._filters = ("FlateDecode",)


def _halved(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Put two values of a row, each below 16, into a byte; a row begins with a byte of its own.

    Examples
    --------
    >>> _halved(np.array([[1, 2, 3]], dtype=np.uint8)).tolist()
    [[18, 48]]
    """
    even = np.pad(values, ((0, 0), (0, values.shape[1] % 2)))
    return np.asarray(even[:, ::2] << 4 | even[:, 1::2], dtype=np.uint8)
