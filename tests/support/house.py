"""What keeps the package's rooms apart: imports as its modules state them, and rules for them.

Every function works on a mapping of module names to sources, so that the rules can be tried on
houses that break them.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

#: The rooms of the makers, in the order in which data flows: each imports only from those before.
FLOW = (
    "core", "stock", "mesh", "weave", "ribbon", "nest", "piece", "form", "sheet", "options", "plan",
    "former", "estimate", "picture", "show", "job", "design", "batch", "studio",
    "front_door", "cli",
)  # fmt: skip
#: Those of them that are one module, and no folder.
ALONE = ("front_door",)
#: Proves what the makers wrote, so it shares nothing with them; these may run it.
PROOF, PROVERS = "verify", ("job", "batch", "front_door", "cli")
#: What stands beside the rooms: the front door, which opens each room when it is asked for, and
#: ``python -m``.
DOOR, DOORSTEP = "__init__", "__main__"


@dataclass(frozen=True)
class Import:
    """One module's mention of another module of the package."""

    source: str
    target: str
    line: int
    #: Whether the one is imported as soon as the other is, and not when something is called.
    at_once: bool
    #: Whether it is there for type checkers only, and never runs.
    for_types: bool = False

    def __str__(self) -> str:
        """Tell where it stands."""
        return f"{self.source} (line {self.line}) imports {self.target}"


def read_modules(package: Path) -> dict[str, str]:
    """Return the source of each module of a package; packages under ``name.__init__``."""
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts): path.read_text("utf-8")
        for path in sorted(package.rglob("*.py"))
    }


def imports_of(modules: Mapping[str, str]) -> list[Import]:
    """Return who mentions whom: by ``import``, or by the name of a module in a string.

    A package is ``name.__init__``. Imports inside functions count, and so do those for types.
    """
    return [found for name in modules for found in _module_imports(name, modules)]


def _module_imports(name: str, modules: Mapping[str, str]) -> Iterator[Import]:
    for dotted, line, at_once, for_types in _mentions(name, modules[name]):
        target = _module_named(dotted, modules)
        if target not in (None, name):
            yield Import(name, target, line, at_once, for_types)


@cache
def _mentions(name: str, source: str) -> tuple[tuple[str, int, bool, bool], ...]:
    """Return the dotted names in a module: line, whether at once, whether for types only."""
    tree = ast.parse(source)
    at_once = set(_run_on_import(tree))
    for_types = {
        inner for node in ast.walk(tree) if _is_for_types(node) for inner in ast.walk(node)
    }
    return tuple(
        (
            dotted,
            node.lineno,
            isinstance(node, ast.Import | ast.ImportFrom) and node in at_once,
            node in for_types,
        )
        for node in ast.walk(tree)
        for dotted in _mentioned(node, name)
    )


def _is_for_types(node: ast.AST) -> bool:
    """Say whether code is for type checkers only."""
    test = node.test if isinstance(node, ast.If) else None
    return "TYPE_CHECKING" in (getattr(test, "id", ""), getattr(test, "attr", ""))


def _run_on_import(tree: ast.AST) -> Iterator[ast.AST]:
    """Return what runs when a module is imported: nothing inside functions, nothing for types."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if _is_for_types(node):
            continue
        yield node
        yield from _run_on_import(node)


def _mentioned(node: ast.AST, name: str) -> list[str]:
    """Return the dotted names of modules that a piece of code names, as far as it may."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        above = name.split(".")[: -node.level] if node.level else []
        start = ".".join([*above, *([node.module] if node.module else [])])
        return [f"{start}.{alias.name}" for alias in node.names]
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value] if _is_dotted(node.value) else []
    return []


def _is_dotted(text: str) -> bool:
    return "." in text and all(part.isidentifier() for part in text.split("."))


def _module_named(target: str, modules: Mapping[str, str]) -> str | None:
    """Return the module that a dotted name is, or is in; None if it is none of these."""
    while target:
        for name in (target, f"{target}.__init__"):
            if name in modules:
                return name
        target = target.rpartition(".")[0]
    return None


def room_of(module: str) -> str:
    """Return the room that a module stands in, or the name of what stands beside the rooms."""
    return module.split(".")[1]


def against_the_flow(modules: Mapping[str, str]) -> list[str]:
    """Return imports from a later room, or past the wall around what proves the files."""
    return [str(found) for found in imports_of(modules) if not _may(found)]


def _may(found: Import) -> bool:
    source, target = room_of(found.source), room_of(found.target)
    if source in (target, DOORSTEP):
        return True
    if source == DOOR:
        return not found.at_once
    # The front door has the package's name and version.
    if target == DOOR:
        return source != PROOF
    if PROOF in (source, target):
        return target == PROOF and source in PROVERS
    return source in FLOW and target in FLOW and FLOW.index(target) < FLOW.index(source)


def circles(modules: Mapping[str, str]) -> list[str]:
    """Return a circle of imports between modules, and one between rooms, if there are any.

    What is imported for types only makes no circle: values may name what they came from.
    """
    found = [
        one for one in imports_of(modules) if room_of(one.source) != DOOR and not one.for_types
    ]
    rooms = [(room_of(one.source), room_of(one.target)) for one in found]
    return [
        f"circle: {' → '.join(circle)}"
        for arrows in ([(one.source, one.target) for one in found], rooms)
        if (circle := _circle(arrows))
    ]


def _circle(arrows: Iterable[tuple[str, str]]) -> list[str]:
    sorter: TopologicalSorter[str] = TopologicalSorter()
    for source, target in arrows:
        if source != target:
            sorter.add(target, source)
    try:
        sorter.prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def loose_modules(modules: Mapping[str, str]) -> list[str]:
    """Return modules beside the rooms, and rooms that nobody knows."""
    beside = [name for name in modules if name.count(".") == 1]
    inside = [name for name in modules if name.count(".") > 1]
    return [
        *(
            f"{name} is beside the rooms"
            for name in beside
            if room_of(name) not in (DOOR, DOORSTEP, *ALONE)
        ),
        *(f"{name} is in no room" for name in inside if room_of(name) not in (*FLOW, PROOF)),
    ]


def unlike_rooms(folders: Iterable[str], beside: Iterable[str]) -> list[str]:
    """Return folders of tests that are no room's, and rooms without tests."""
    rooms, known = {*FLOW, PROOF} - {*ALONE} | {"job"}, set(beside)
    return [
        *(f"tests/{name} is no room's" for name in sorted(set(folders) - rooms - known)),
        *(f"{name} has no folder in tests" for name in sorted(rooms - set(folders))),
    ]


def import_table(modules: Mapping[str, str]) -> str:
    """Return a table: how many modules of a room (rows) import something of another (columns)."""
    pairs = {(one.source, room_of(one.target)) for one in imports_of(modules)}
    rows = [*FLOW, PROOF, DOORSTEP, DOOR]
    rows = [name for name in rows if any(room_of(module) == name for module in modules)]
    wide = max(map(len, rows))
    lines = [f"{'':{wide}} {'modules':>8}" + "".join(f" {name[:8]:>8}" for name in rows)]
    for row in rows:
        own = [module for module in modules if room_of(module) == row]
        cells = [sum((module, column) in pairs for module in own) or "." for column in rows]
        lines.append(f"{row:{wide}} {len(own):>8}" + "".join(f" {cell:>8}" for cell in cells))
    return "\n".join(lines)
