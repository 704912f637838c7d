"""Make the page of the gallery: run each script, and keep its picture and its figures.

Run it with: python examples/make_gallery.py examples/gallery
or, for some objects, whose pictures alone are made: python examples/make_gallery.py DIR plain lamp
"""

import runpy
import sys
from pathlib import Path
from typing import Any

GALLERY = Path(__file__).parent / "gallery"
#: The objects, in the order of the page. The scan is for a mesh of your own.
NAMES = (
    "koala", "koala_twill", "spot", "fish", "goat", "nefertiti",
    "plain", "twill_genus_1", "twill_genus_2", "twill_genus_3", "twill_genus_30", "twill_inexact",
    "triaxial", "kagome", "straight", "satin", "twill_right", "twill_left", "basket", "lamp",
    "two_materials", "yarns", "knot",
)  # fmt: skip
HEAD = """\
# Gallery

Each object has a script of fewer than 40 lines. All pictures have the same camera, light and scale;
no object is larger than 300 mm. Hours are hours by hand, from quick to slow. Who made the models is
said [beside them](../meshes/README.md). `make gallery` makes this page.
"""


def exhibit_of(name: str) -> Any:
    """Run the script of an object, and return what it shows."""
    sys.path.insert(0, str(GALLERY))
    try:
        return runpy.run_path(str(GALLERY / f"{name}.py"))["exhibit"]
    finally:
        sys.path.remove(str(GALLERY))


def entry_of(name: str, exhibit: Any) -> str:
    """Return what the page says of an object."""
    figures = exhibit.figures()
    return "\n".join(
        (
            f"## {exhibit.title}",
            "",
            f"![{exhibit.title}]({name}.png)",
            "",
            f"[`{name}.py`]({name}.py): {exhibit.key}",
            "",
            f"| {' | '.join(figures)} |",
            f"|{'---|' * len(figures)}",
            f"| {' | '.join(map(str, figures.values()))} |",
            "",
        )
    )


if __name__ == "__main__":
    folder, asked = Path(sys.argv[1]), sys.argv[2:]
    folder.mkdir(parents=True, exist_ok=True)
    # The scripts would take the rest for their own.
    del sys.argv[1:]
    entries = []
    for name in asked or NAMES:
        exhibit = exhibit_of(name)
        exhibit.picture().save(folder / f"{name}.png", optimize=True)
        entries.append(entry_of(name, exhibit))
    if not asked:
        page = "\n".join((HEAD, *entries))
        page += """
## A scan

[`scan.py`](scan.py) weaves your own mesh: `python examples/gallery/scan.py cow.obj cow.png`.
"""
        (folder / "README.md").write_text(page, encoding="utf-8", newline="")
