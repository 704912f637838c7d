"""Put three things of a finished job side by side, as in the README.

They are the woven object, its first sheet, and a page of its manual.

Run it with: python examples/make_job_picture.py lampshade 15 examples/lampshade.png
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HEIGHT, SPACE = 400, 12
job, page, target = Path(sys.argv[1]), sys.argv[2], sys.argv[3]


def scaled(picture: Image.Image) -> Image.Image:
    """Return a picture of the common height."""
    width = round(picture.width * HEIGHT / picture.height)
    return picture.convert("RGB").resize((width, HEIGHT), Image.Resampling.LANCZOS)


with tempfile.TemporaryDirectory() as folder:
    # Poppler's program draws a page of a PDF.
    pages = ["-f", page, "-l", page, str(job / "assembly.pdf")]
    command = ["pdftoppm", "-r", "120", "-png", "-singlefile", *pages, f"{folder}/page"]
    subprocess.run(command, check=True)  # noqa: S603 - these words and two paths
    render = Image.open(job / "render.png")
    parts = [
        # It shows the object twice; once is enough.
        scaled(render.crop((render.width // 24, 0, render.width * 7 // 16, render.height))),
        scaled(Image.open(job / "sheets" / "sheet_01.png")),
        scaled(Image.open(f"{folder}/page.png")),
    ]
picture = Image.new("RGB", (sum(part.width + SPACE for part in parts) - SPACE, HEIGHT), "white")
left = 0
for part in parts:
    picture.paste(part, (left, 0))
    left += part.width + SPACE
# A palette keeps the file small; the eye sees no difference.
picture.quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)
