"""Say what a job may be called: as it was asked for, or as its mesh is called."""

import re
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

_SHAPE = "shape:"
#: Of built-in shapes whose parameters are told: their words, and these with their usual values.
_COUNTED: dict[str, tuple[str, str, dict[str, int]]] = {
    "cube": ("Cube", ", 6 times {n} by {n}", {"n": 1}),
    "torus": ("Torus", ", {m} by {n}", {"m": 24, "n": 12}),
    "sphere": ("Sphere", ", 6 times {n} by {n}", {"n": 8}),
    "tube": ("Tube", ", {m} by {n}", {"m": 16, "n": 12}),
    "hemisphere": ("Hemisphere", ", {n} rows", {"n": 4}),
    "hypar": ("Saddle", ", {m} by {n}", {"m": 10, "n": 10}),
    "knot": ("Torus knot", ", {p} by {q}", {"p": 2, "q": 3}),
    "regular": (
        "Regular surface of genus {genus}",
        ", {face} by {valence}",
        {"face": 8, "valence": 4, "genus": 3},
    ),
    "slit": ("Surface of genus {genus}", "", {"genus": 3}),
    "bipyramid": ("Bipyramid with handles", "", {}),
}


def titles_of(options: dict[str, Any]) -> list[str]:
    """Return what the job may be called: a path may be of another system, where it reads otherwise.

    Examples
    --------
    >>> titles_of({"mesh": "shape:torus?n=8"}), titles_of({"mesh": "shape:cube?n=1"})
    (['Torus, 24 by 8'], ['Cube'])
    >>> titles_of({"mesh": "my_fine-bowl.v2.obj"}), titles_of({"mesh": "a", "title": "Fruit bowl"})
    (['My fine bowl v2', 'My fine bowl v2'], ['Fruit bowl'])
    """
    if (title := options.get("title")) is not None:
        return [str(title)]
    mesh = str(options["mesh"])
    if not mesh.startswith(_SHAPE):
        stems = [PurePosixPath(mesh).stem, PureWindowsPath(mesh).stem]
        return [_as_words(stem) for stem in stems]
    kind, _, query = mesh.removeprefix(_SHAPE).partition("?")
    name, numbers, usual = _COUNTED.get(kind, (kind.capitalize(), "", {}))
    given = dict(pair.partition("=")[::2] for pair in query.split("&"))
    values = {key: int(given.get(key, value)) for key, value in usual.items()}
    ones = all(values[key] == 1 for key in values if f"{{{key}}}" in numbers)
    return [(name if ones else name + numbers).format(**values)]


def _as_words(stem: str) -> str:
    """Return the name of a file as words, the first with a capital."""
    words = " ".join(re.split(r"[\s_.+-]+", stem)).strip()
    return words[:1].upper() + words[1:] or stem
