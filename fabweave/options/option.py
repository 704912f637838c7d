"""Hold what is known of one option, and the sections in which options stand."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fabweave.options.kinds import Kind

MESH = "Mesh"
WEAVE = "Weave"
RIBBONS = "Ribbons"
PIECES = "Pieces"
STOCK = "Stock"
SEARCH = "Search"
MACHINE = "Machine"
#: The sections of the reference, in the order in which a person decides them. ``--set`` names an
#: option by its section: ``--set ribbons.clearance=0.2mm``. With each, the settings that hold it.
GROUPS = {
    MESH: "fabweave.mesh.settings.MeshSettings",
    WEAVE: "fabweave.weave.settings.WeaveSettings",
    RIBBONS: "fabweave.ribbon.settings.RibbonSettings",
    PIECES: "fabweave.piece.settings.PieceSettings",
    STOCK: "fabweave.stock.settings.StockSettings",
    SEARCH: "fabweave.core.search.Search",
    MACHINE: "fabweave.sheet.settings.MachineSettings",
}
SECTIONS = tuple(GROUPS)


@dataclass(frozen=True)
class Option:
    """One option of the main job.

    Parameters
    ----------
    name : str
        In job.toml and in Python.
    kind : Kind
        What it takes.
    help : str
        What it is, and why to change it. ``{choices}`` stands for the words that it takes.
    section : str
        One of ``SECTIONS``.
    default : object
        As it would be typed; None if fabweave chooses.
    otherwise : str
        What that is, for people, where it is not the text of the default.
    brief : str
        What it is in a line: of what makers change from job to job, and of what differs most from
        machine to machine, which `fabweave machine new` asks.
    holder : str
        The field of its group, where it is not called as the option, with ``_mm`` for lengths.
    typed : str
        Its name on the command line, where that is not its name with hyphens for underscores.
    making : bool
        Whether it is for making alone: it changes neither the weave nor the ribbons.
    """

    name: str
    kind: Kind
    help: str
    section: str
    default: Any = None
    otherwise: str = ""
    brief: str = ""
    holder: str = ""
    typed: str = ""
    making: bool = False

    @property
    def flag(self) -> str:
        """Its name on the command line."""
        return "--" + (self.typed or self.name.replace("_", "-"))

    @property
    def group(self) -> str:
        """The field of ``Settings`` that holds its section."""
        return self.section.lower()

    @property
    def path(self) -> str:
        """Its name after ``--set``: its section and its name."""
        return f"{self.group}.{self.name}"

    @property
    def shown(self) -> str:
        """Its name and value as help shows them: no name for the mesh, which is no option."""
        names = "" if self.name == "mesh" else self.flag
        return names if self.kind.flag else f"{names} {self.metavar}".lstrip()

    @property
    def first(self) -> bool:
        """Whether it stands in the first help: a machine's options stand in its profile."""
        return bool(self.brief) and self.section != MACHINE

    @property
    def field(self) -> str:
        """The field of its group that holds it."""
        return self.holder or self.name + ("_mm" if self.kind.unit else "")

    @property
    def metavar(self) -> str:
        """What stands for its value in help."""
        return self.kind.metavar or f"[{'|'.join(self.kind.choices)}]"

    @property
    def text(self) -> str:
        """What it is, with the words that it takes."""
        return self.help.replace("{choices}", ", ".join(self.kind.choices))

    @property
    def usual(self) -> str:
        """Its default, for people; empty if there is none."""
        unsaid = self.default is None or self.default is False
        return self.otherwise or ("" if unsaid else str(self.default))

    @cached_property
    def default_value(self) -> Any:
        """Its default, as settings hold it."""
        return None if self.default is None else self.kind.parse(self.default)
