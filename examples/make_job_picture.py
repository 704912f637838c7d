"""Put a sheet of a finished job and a page of its manual side by side, as in the README.

Run it with: python examples/make_job_picture.py lampshade 15 examples/lampshade.png
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HEIGHT = 470
job, page, target = Path(sys.argv[1]), sys.argv[2], sys.argv[3]

with tempfile.TemporaryDirectory() as folder:
    # Poppler's program draws a page of a PDF.
    name = str(Path(folder) / "page")
    pdf = str(job / "assembly.pdf")
    subprocess.run(  # noqa: S603
        ["pdftoppm", "-r", "120", "-png", "-singlefile", "-f", page, "-l", page, pdf, name],  # noqa: S607
        check=True,
    )
    pictures = [
        Image.open(job / "sheets" / "sheet_01.png").convert("RGB"),
        Image.open(f"{name}.png").convert("RGB"),
    ]
    small = [
        picture.resize(
            (round(picture.width * HEIGHT / picture.height), HEIGHT), Image.Resampling.LANCZOS
        )
        for picture in pictures
    ]
both = Image.new("RGB", (sum(picture.width for picture in small) + 12, HEIGHT), "#ECEDF1")
both.paste(small[0], (0, 0))
both.paste(small[1], (small[0].width + 12, 0))
# A palette keeps the file small; the eye sees no difference.
both.quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)
