"""Keep pictures in a PDF as they are, packed tightly: in bytes, not in letters."""

import zlib
from typing import Any

import numpy as np
from PIL import Image
from reportlab.pdfbase.pdfdoc import PDFImageXObject

from fabweave.core.arrays import frozen_value
from fabweave.core.colour_space import Colours


@frozen_value
class Painted:
    """A picture of few colours, packed.

    Parameters
    ----------
    width_px, height_px : int
    colours : (C, 3) uint8 array
        At most 256.
    packed : bytes
        The number of the colour of each pixel, row after row from the top, deflated.
    """

    width_px: int
    height_px: int
    colours: Colours
    packed: bytes

    @property
    def image(self) -> Image.Image:
        """The picture in RGB."""
        number = np.frombuffer(zlib.decompress(self.packed), dtype=np.uint8)
        return Image.fromarray(self.colours[number.reshape(self.height_px, self.width_px)])


class Pixels(PDFImageXObject):  # type: ignore[misc]  # reportlab has no types
    """A picture as an object of a PDF.

    reportlab's own pictures are written in letters, which takes a quarter more room and most of
    the time of a manual with a picture for each step.

    Parameters
    ----------
    name : str
        Unique in its PDF.
    picture : Image or Painted
        RGB, or of few colours.
    """

    def __init__(self, name: str, picture: Image.Image | Painted) -> None:
        super().__init__(name)
        self._filters = ("FlateDecode",)
        self.bitsPerComponent = 8
        self._colours = b""
        if isinstance(picture, Painted):
            self.width, self.height = picture.width_px, picture.height_px
            self.colorSpace = "Indexed"
            self._colours = picture.colours.tobytes()
            self.streamContent = picture.packed
        else:
            self.width, self.height = picture.size
            self.colorSpace = "DeviceRGB"
            self.streamContent = zlib.compress(np.asarray(picture).tobytes())

    def format(self, document: Any) -> bytes:
        """Return the object as it is written: reportlab cannot name the colours of a picture."""
        head, word, pixels = bytes(super().format(document)).partition(b"stream\n")
        last, colours = len(self._colours) // 3 - 1, self._colours.hex().encode()
        named = b"[ /Indexed /DeviceRGB %d <%s> ]" % (last, colours)
        return head.replace(b"/Indexed", named) + word + pixels
