"""Turn a polygon mesh into a woven object that a person can cut and assemble.

    import fabweave as fw

    mesh = fw.read("cow.obj", size="400mm")
    weave = fw.weave(mesh, pattern="twill")
    ribbons = weave.ribbons(material="card")
    pieces = ribbons.pieces(max_length="200mm")
    layout = pieces.nest(sheet="600x400mm")
    job = layout.write("cow")

``fw.make(mesh, folder, …)`` does all of it at once, ``fw.inspect(mesh)`` tells beforehand what can
be woven, and ``fw.verify(folder)`` proves the files of a finished job. Options have the names and
values of the command line's.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fabweave.core.errors import CannotMakeError, FabweaveError, InputError
    from fabweave.front_door import (
        Design,
        Inspection,
        Layout,
        Mesh,
        Pieces,
        Ribbons,
        Thread,
        Weave,
        WrittenBatch,
        WrittenJob,
        Yarns,
        batch,
        design,
        inspect,
        make,
        mesh,
        read,
        shape,
        verify,
        weave,
    )
    from fabweave.options.settings import Settings
    from fabweave.verify.report import VerifyReport

__version__ = "0.1.0"

#: Where public names are found that are not in the front door; they are imported when first used.
_HOMES = {
    **dict.fromkeys(("CannotMakeError", "FabweaveError", "InputError"), "fabweave.core.errors"),
    "Settings": "fabweave.options.settings",
    "VerifyReport": "fabweave.verify",
}

__all__ = [
    "CannotMakeError", "Design", "FabweaveError", "InputError", "Inspection", "Layout", "Mesh",
    "Pieces", "Ribbons", "Settings", "Thread", "VerifyReport", "Weave", "WrittenBatch",
    "WrittenJob", "Yarns", "batch", "design", "inspect", "make", "mesh", "read", "shape", "verify",
    "weave",
]  # fmt: skip


class _FrontDoor(ModuleType):
    """The package: ``fabweave.mesh`` is the function, though there is a room of that name too."""

    def __setattr__(self, name: str, value: object) -> None:
        # Whoever imports a module of a room sets the room on the package.
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'fabweave' has no attribute {name!r}")
    public = getattr(import_module(_HOMES.get(name, "fabweave.front_door")), name)
    if f"{__name__}.{name}" in sys.modules:
        # So that `import fabweave.weave.threads as threads` finds its way past the function.
        public.__name__ = f"{__name__}.{name}"
    globals()[name] = public
    return public


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _FrontDoor
