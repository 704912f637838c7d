"""Run what a page of documentation shows: its commands, and its blocks of Python.

A page is Markdown. Fenced blocks of ``python`` are run, with one namespace a page; so is every
command in a fenced block of ``sh``. All of them run in the order of the page, in one folder. A
comment before a block says what else is to be done with it:

    <!-- not run: why not -->
    <!-- file: k40.toml -->          the block is what that file of the reader's holds
"""

import ast
import doctest
import re
import shlex
import shutil
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import click
import trimesh
from mesh_writers import write_mesh

from fabweave.cli.main import cli, main
from fabweave.core.errors import FabweaveError
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.triangulate import triangulate

ROOT = Path(__file__).resolve().parents[2]

#: What a reader types that is no business of ours.
_OTHER_PROGRAMS = {"cd", "export", "git", "pip", "python", "python3", "source", "."}
_MESH = re.compile(r"[\w./-]+\.(?:obj|off|ply|stl|glb|3mf)\b")
_BLOCK = re.compile(
    r"(?:^<!-- (?P<word>not run|file): (?P<said>[^>]+) -->\n\n?)?"
    r"^ *```(?P<language>\w+)\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)


class PaperError(AssertionError):
    """Something on a page is not as it should be; says where."""


@dataclass(frozen=True)
class Block:
    """A block of a page: its text, where it stands, and why it is not run, or which file it is."""

    place: str
    language: str
    text: str
    not_run: str | None
    file: str | None

    def error(self, what: object) -> PaperError:
        """Return an error that says where it is."""
        return PaperError(f"{self.place}: {what}")


def blocks_of(page: str, text: str) -> list[Block]:
    """Return the blocks of a page that are run, or are files."""
    found = []
    for match in _BLOCK.finditer(text):
        place = f"{page}:{text.count(chr(10), 0, match.start('text')) + 1}"
        said = {match["word"]: match["said"]}
        inner = textwrap.dedent(match["text"])
        found.append(Block(place, match["language"], inner, said.get("not run"), said.get("file")))
    return [one for one in found if one.file or one.language in ("python", "sh")]


def commands_of(block: Block) -> Iterator[list[str]]:
    """Give the words of each command of a block."""
    for line in block.text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if any(word.endswith(sign) for word in words for sign in "|>;<"):
            raise block.error(f"{line!r} is not run here")
        while words:
            end = words.index("&&") if "&&" in words else len(words)
            yield words[:end]
            words = words[end + 1 :]


def check_page(page: str, text: str, folder: Path) -> None:
    """Raise at the first thing on a page that would not do: options, values, names, syntax."""
    with chdir(folder):
        for block in _prepared(page, text):
            if block.language == "python":
                _check_python(block)
                continue
            for words in commands_of(block):
                try:
                    _check_command(words)
                except (click.ClickException, FabweaveError, OSError, ValueError) as error:
                    told = error.format_message() if hasattr(error, "format_message") else error
                    raise block.error(f"{shlex.join(words)}: {told}") from error


def run_page(page: str, text: str, folder: Path) -> None:
    """Do what a page shows, in an empty folder; jobs are made as small as they can be.

    Raises at the first command that does not exit with 0, and the first block that fails.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    with chdir(folder):
        for block in _prepared(page, text):
            if block.language == "python":
                _run_python(block, names)
                continue
            for words in commands_of(block):
                if words[0] != "fabweave":
                    _check_command(words)
                elif code := _exit_code(smaller(words[1:])):
                    raise block.error(f"{shlex.join(words)}: exit code {code}")


def _prepared(page: str, text: str) -> Iterator[Block]:
    """Give the blocks to run, after what a reader would have is put into the folder."""
    shutil.copytree(ROOT / "examples", "examples", dirs_exist_ok=True)
    blocks = blocks_of(page, text)
    for block in blocks:
        if block.file:
            Path(block.file).write_text(block.text, encoding="utf-8")
    for block in blocks:
        if not block.file and not block.not_run:
            for name in _MESH.findall(block.text):
                if not Path(name).exists():
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
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    if program == "make" and not {word for word in rest if "=" not in word} <= set(targets):
        raise ValueError(f"the Makefile has no target {' '.join(rest)!r}")
    if program == "python" and rest[0].endswith(".py") and not (ROOT / rest[0]).is_file():
        raise ValueError(f"there is no {rest[0]}")
    if program == "fabweave":
        _check_words(rest)
    elif program not in {*_OTHER_PROGRAMS, "make"}:
        raise ValueError(f"{program!r} is none of the programs that a page may name")


def _check_words(words: Sequence[str]) -> None:
    """Have click take the words of a command; a shape must be one that there is."""
    name, *rest = words
    if name.startswith("-"):
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
        # What later commands read of a finished job before they do anything.
        folder = Path(context.params["output"])
        (folder / "offcuts").mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "examples" / "stock.toml", folder / "offcuts" / "stock.toml")
        (folder / "job.toml").write_text('[job]\nmesh = "shape:cube"\n', encoding="utf-8")


def smaller(words: Sequence[str]) -> list[str]:
    """Return a command that makes the same with less work."""
    few = [re.sub(r"(quads:)\d+", r"\g<1>60", word) for word in words]
    quick = words[0] == "make" and not {"--effort", "--help"} & set(words)
    return [*few, *["--effort", "quick"] * quick]


def _exit_code(words: Sequence[str]) -> object:
    try:
        main(list(words))
    except SystemExit as stop:
        return stop.code
    return 0


def _check_python(block: Block) -> None:
    """Raise unless a block of Python is valid."""
    examples = doctest.DocTestParser().get_examples(block.text)
    try:
        ast.parse("".join(one.source for one in examples) or block.text)
    except SyntaxError as error:
        raise block.error(error.msg) from error


def _run_python(block: Block, names: dict[str, object]) -> None:
    if block.text.startswith(">>>"):
        test = doctest.DocTestParser().get_doctest(block.text, names, block.place, None, 0)
        told: list[str] = []
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
        if runner.run(test, out=told.append, clear_globs=False).failed:
            raise block.error("".join(told))
        names.update(test.globs)
        return
    try:
        exec(compile(block.text, block.place, "exec", dont_inherit=True), names)  # noqa: S102 - that is what it is for
    except Exception as error:
        raise block.error(f"{type(error).__name__}: {error}") from error
