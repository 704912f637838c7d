"""Run what a page of documentation shows: its commands, and its blocks of Python.

A page is Markdown. Fenced blocks of ``python`` are run, with one namespace a page; so is every
command in a fenced block of ``sh`` or ``console``, and every indented line that begins with
``fabweave``. All of them run in the order of the page, in one folder. A comment before a block says
what else is to be done with it:

    <!-- not run: why not -->
    <!-- file: k40.toml -->          the block is what that file of the reader's holds
"""

import ast
import doctest
import importlib
import re
import shlex
import shutil
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path

import click
import trimesh

from fabweave.cli.main import cli, main
from fabweave.core.errors import FabweaveError
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate

ROOT = Path(__file__).resolve().parents[2]

#: What a reader types that is no business of ours.
_OTHER_PROGRAMS = {"cd", "git", "pip", "python3", "source", "."}
_MESHES = (".obj", ".off", ".ply", ".stl", ".glb", ".3mf")
_FENCE = re.compile(r"(?P<indent> *)(?P<fence>`{3,}|~{3,}) *(?P<language>\w*)")
_COMMENT = re.compile(r"<!--\s*(not run|file):\s*((?:(?!-->).)*?)\s*-->\s*\Z", re.DOTALL)
_INDENTED = re.compile(r" {4}|\s*\Z")
_COMMAND = re.compile(r" {4,}(\$ )?fabweave ")


class PaperError(AssertionError):
    """Something on a page is not as it should be; says where."""


@dataclass(frozen=True)
class Block:
    """A block of a page that is run, or that is a file."""

    page: str
    line: int
    language: str
    lines: tuple[str, ...]
    #: Why it is not run, or which file it is: the words of the comment before it.
    not_run: str | None = None
    file: str | None = None

    @property
    def text(self) -> str:
        """All of it."""
        return "\n".join(self.lines) + "\n"

    def error(self, what: object, line: int = 0) -> PaperError:
        """Return an error that says where it is."""
        return PaperError(f"{self.page}:{self.line + line}: {what}")


def blocks_of(page: str, text: str) -> list[Block]:
    """Return the blocks of a page that matter here, in order."""
    lines = text.splitlines()
    found, at = [], 0
    while at < len(lines):
        fence, end = _FENCE.fullmatch(lines[at]), at + 1
        if fence:
            stop = re.compile(rf" *{fence['fence']}[`~]*\s*")
            while end < len(lines) and not stop.fullmatch(lines[end]):
                end += 1
            if end == len(lines):
                raise PaperError(f"{page}:{at + 1}: the block does not end")
            inner = [line.removeprefix(fence["indent"]) for line in lines[at + 1 : end]]
            block = Block(page, at + 2, fence["language"], tuple(inner))
            end += 1
        elif _COMMAND.match(lines[at]) or (lines[at].startswith("    ") and _is_told(lines[:at])):
            while end < len(lines) and _INDENTED.match(lines[end]):
                end += 1
            inner = textwrap.dedent("\n".join(lines[at:end])).rstrip().splitlines()
            block = Block(page, at + 1, "indented", tuple(inner))
        else:
            at += 1
            continue
        found.append(_with_comment(block, "\n".join(lines[:at])))
        at = end
    known = ("python", "sh", "console", "indented")
    return [block for block in found if block.file or block.language in known]


def _is_told(above: Sequence[str]) -> bool:
    """Return whether a comment stands directly above."""
    return bool(_COMMENT.search("\n".join(above)))


def _with_comment(block: Block, above: str) -> Block:
    comment = _COMMENT.search(above)
    if comment is None:
        return block
    if not comment[2]:
        raise block.error(f"'{comment[1]}' says no more")
    if comment[1] == "file":
        return replace(block, file=comment[2])
    return replace(block, not_run=comment[2])


def commands_of(block: Block) -> Iterator[tuple[int, list[str]]]:
    """Give the commands of a block, each with its line in it and its words."""
    lines = list(block.lines)
    if block.language == "console":
        if not any(line.startswith("$ ") for line in lines):
            raise block.error("no line begins with '$ ', so there is no command")
        lines = [_typed(lines, number) for number in range(len(lines))]
    elif block.language == "indented":
        lines = [
            _typed(lines, number, ("fabweave ", "$ fabweave ")) for number in range(len(lines))
        ]
    at = 0
    while at < len(lines):
        first, line = at, lines[at]
        while line.endswith("\\") and at + 1 < len(lines):
            at += 1
            line = line[:-1] + lines[at]
        at += 1
        words = shlex.split(line.removeprefix("$ "), comments=True)
        for sign in ("|", ">", ";", "<"):
            if any(word.endswith(sign) for word in words):
                raise block.error(f"a command with {sign!r} is not run here", first)
        while words:
            cut = words.index("&&") if "&&" in words else len(words)
            yield first, words[:cut]
            words = words[cut + 1 :]


def _typed(lines: Sequence[str], number: int, starts: tuple[str, ...] = ("$ ",)) -> str:
    """Return a line if it is typed, or goes on with one that is; else nothing."""
    first = number
    while first and lines[first - 1].endswith("\\"):
        first -= 1
    return lines[number] if lines[first].startswith(starts) else ""


def check_page(page: str, text: str, folder: Path) -> None:
    """Check a page without doing what it shows: options, values, names, syntax.

    Raises
    ------
    PaperError
        At the first thing that would not do.
    """
    with chdir(folder):
        for block in _prepared(page, text):
            if block.language == "python":
                _check_python(block)
                continue
            for line, words in commands_of(block):
                try:
                    _check_command(words)
                except (click.ClickException, FabweaveError, OSError, ValueError) as error:
                    told = error.format_message() if hasattr(error, "format_message") else error
                    raise block.error(f"{shlex.join(words)}: {told}", line) from error


def run_page(page: str, text: str, folder: Path) -> None:
    """Do what a page shows, in an empty folder; jobs are made as small as they can be.

    Raises
    ------
    PaperError
        At the first command that does not exit with 0, and the first block that fails.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    with chdir(folder):
        for block in _prepared(page, text):
            if block.language == "python":
                _run_python(block, names)
                continue
            for line, words in commands_of(block):
                if words[0] != "fabweave":
                    _check_command(words)
                elif code := _exit_code(smaller(words[1:])):
                    raise block.error(f"{shlex.join(words)}: exit code {code}", line)


def _prepared(page: str, text: str) -> Iterator[Block]:
    """Give the blocks to run, after what a reader would have is put into the folder."""
    shutil.copytree(ROOT / "examples", "examples", dirs_exist_ok=True)
    blocks = blocks_of(page, text)
    for block in blocks:
        if block.file:
            Path(block.file).write_text(block.text, encoding="utf-8")
    for block in blocks:
        if not block.file and not block.not_run:
            for name in re.findall(r"[\w./-]+", block.text):
                if name.endswith(_MESHES) and not Path(name).exists():
                    _write_stand_in(Path(name))
            yield block


def _write_stand_in(path: Path) -> None:
    """Write a small mesh in place of one that a reader has: a torus that has an exact twill."""
    mesh = parse_shape("shape:torus?m=6&n=4")
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix in (".obj", ".off", ".ply"):
        write_mesh(path, mesh)
        return
    split = triangulate(mesh)
    trimesh.Trimesh(split.vertices, split.indices.reshape(-1, 3)).export(path)


def _check_command(words: Sequence[str]) -> None:
    """Raise unless a command can be understood; so can what depends on its output, afterwards."""
    program, *rest = words
    if program == "make":
        _check_targets(rest)
    elif program == "python" and rest and rest[0].endswith(".py"):
        if not (ROOT / rest[0]).is_file():
            raise ValueError(f"there is no {rest[0]}")
    elif program == "fabweave":
        _check_words(rest)
    elif program not in {*_OTHER_PROGRAMS, "python"}:
        raise ValueError(f"{program!r} is none of the programs that a page may name")


def _check_targets(words: Sequence[str]) -> None:
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    for word in words:
        if word not in targets:
            raise ValueError(f"the Makefile has no target {word!r}")


def _check_words(words: Sequence[str]) -> None:
    """Have click take the words of a command; a shape must be one that there is."""
    name, *rest = words
    if name in ("--help", "-h", "--version"):
        return
    if name not in cli.commands:
        raise ValueError(f"there is no command {name!r}")
    try:
        context = cli.commands[name].make_context(name, rest)
    except click.exceptions.Exit:  # told its help
        return
    mesh = context.params.get("mesh")
    if mesh and mesh.startswith("shape:"):
        parse_shape(mesh)
    if name == "make":
        _write_stand_in_job(Path(context.params["output"]))


def _write_stand_in_job(folder: Path) -> None:
    """Put there what later commands read of a finished job before they do anything."""
    (folder / "offcuts").mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / "examples" / "stock.toml", folder / "offcuts" / "stock.toml")
    (folder / "job.toml").write_text('[job]\nmesh = "shape:cube"\n', encoding="utf-8")


def smaller(words: Sequence[str]) -> list[str]:
    """Return a command that makes the same with less work."""
    few = [re.sub(r"(quads:)\d+", r"\g<1>60", word) for word in words]
    quick = words[0] in ("make", "design") and not {"--effort", "--help"} & set(words)
    tries = ["--tries", "3"] * (words[0] == "design")
    return [*few, *["--effort", "quick"] * quick, *tries]


def _exit_code(words: Sequence[str]) -> object:
    try:
        main(list(words))
    except SystemExit as stop:
        return stop.code
    return 0


def _compiled(block: Block, mode: str = "exec"):
    """Return a block as code, with the line numbers of the page."""
    text = "\n" * (block.line - 1) + block.text
    return compile(text, block.page, mode, dont_inherit=True)


def _is_session(block: Block) -> bool:
    return block.text.lstrip().startswith(">>>")


def _check_python(block: Block) -> None:
    """Raise unless a block of Python is valid, and takes from fabweave what is there."""
    if _is_session(block):
        examples = doctest.DocTestParser().get_examples(block.text)
        block = replace(block, lines=tuple("".join(one.source for one in examples).splitlines()))
    try:
        _compiled(block)
    except SyntaxError as error:
        raise PaperError(f"{block.page}:{error.lineno}: {error.msg}") from error
    for node in ast.walk(ast.parse(block.text)):
        for module, name in _taken(node):
            try:
                found = importlib.import_module(module)
                if name is not None and not hasattr(found, name):
                    importlib.import_module(f"{module}.{name}")
            except ImportError as error:
                raise block.error(error, node.lineno - 1) from error


def _taken(node: ast.AST) -> list[tuple[str, str | None]]:
    """Return what is imported from fabweave: modules, and names in them."""
    if isinstance(node, ast.Import):
        found = [(alias.name, None) for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and node.module:
        found = [(node.module, alias.name) for alias in node.names]
    else:
        return []
    return [one for one in found if one[0].partition(".")[0] == "fabweave"]


def _run_python(block: Block, names: dict[str, object]) -> None:
    if _is_session(block):
        test = doctest.DocTestParser().get_doctest(
            block.text, names, block.page, block.page, block.line - 1
        )
        told: list[str] = []
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
        if runner.run(test, out=told.append, clear_globs=False).failed:
            raise block.error("".join(told))
        names.update(test.globs)
        return
    try:
        exec(_compiled(block), names)  # noqa: S102 - that is what it is for
    except Exception as error:
        raise block.error(f"{type(error).__name__}: {error}") from error
