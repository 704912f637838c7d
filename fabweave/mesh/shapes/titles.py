"""Name what is woven as a person would."""

import re
from pathlib import Path

from fabweave.mesh.shapes.catalogue import is_shape, shape_title

#: What parts the words of a file's name.
_BETWEEN = re.compile(r"[\s_.+-]+")


def object_title(mesh: str, title: str | None = None) -> str:
    """Return what to call the object of a job: its title, or a name made of that of its mesh.

    Parameters
    ----------
    mesh : str
        A file, or a built-in shape.
    title : str, optional
        As it was asked for.

    Raises
    ------
    InputError
        If the built-in shape is wrong.

    Examples
    --------
    >>> object_title("models/spot_control_mesh.obj"), object_title("shape:torus?m=24&n=12")
    ('Spot control mesh', 'Torus, 24 by 12')
    >>> object_title("shape:torus", "Fruit bowl")
    'Fruit bowl'
    """
    if title is not None:
        return title
    if is_shape(mesh):
        return shape_title(mesh)
    stem = Path(mesh).stem
    words = _BETWEEN.sub(" ", stem).strip()
    return words[:1].upper() + words[1:] or stem
