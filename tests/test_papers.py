"""What the documentation shows works: every command, and every block of Python."""

from pathlib import Path

import click
import pytest
from papers import ROOT, PaperError, blocks_of, check_page, commands_of, run_page, smaller

from fabweave.cli.main import cli

#: Those that are there.
PAGES = [
    path
    for path in (
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        *sorted((ROOT / "fabweave" / "guide").glob("*.md")),
    )
    if path.is_file()
]


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def help_of(name: str) -> str:
    command = cli.commands[name]
    return command.get_help(click.Context(command, info_name=name))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_and_names_on_a_page_exist(page, tmp_path):
    check_page(name_of(page), page.read_text("utf-8"), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_can_be_followed_from_top_to_bottom(page, tmp_path):
    run_page(name_of(page), page.read_text("utf-8"), tmp_path)


@pytest.mark.parametrize("name", [name for name in cli.commands if "Examples:" in help_of(name)])
def test_examples_in_the_help_can_be_understood(name, tmp_path):
    told = help_of(name).split("Examples:")[1].split("\n\n")[0]
    examples = "\n".join(f"    {line.strip()}" for line in told.splitlines())
    (block,) = blocks_of(name, examples)
    assert len(list(commands_of(block))) == len(told.strip().splitlines())
    check_page(f"fabweave {name} --help", examples, tmp_path)


PAGE = """\
# A page

Text with `fabweave nothing` in it, and

    an indented line
    fabweave shapes            # all of them
    make demo

```python
from pathlib import Path
names = [Path("spot.obj").name]
```

1. A list, with

   ```sh
   # a remark
   fabweave model spot.obj --size "100mm" \\
     -o spot.glb && fabweave materials
   pip install fabweave
   make lint test
   ```

<!-- not run: a screen shows
     nothing here -->
```console
$ fabweave nothing
```

```console
$ fabweave coupon --material card \\
    -o coupon
coupon: it says this
```

<!-- file: k40.toml -->
```toml
a = 1
```

<!-- file: k41.toml -->

    a = 1

    [b]
    c = 2

That was it.

```text
fabweave nothing
```

```python
>>> names.append(len(Path("spot.glb").read_bytes()) > 1000)
>>> names, Path("k40.toml").read_text(), Path("coupon/coupon.dxf").is_file()
(['spot.obj', True], 'a = 1\\n', True)
>>> Path("k41.toml").read_text()
'a = 1\\n\\n[b]\\nc = 2\\n'
```
"""


def test_blocks_are_found_with_what_is_said_of_them():
    found = blocks_of("page", PAGE)
    assert [(one.line, one.language, one.not_run, one.file) for one in found] == [
        (6, "indented", None, None),
        (10, "python", None, None),
        (17, "sh", None, None),
        (27, "console", "a screen shows\n     nothing here", None),
        (31, "console", None, None),
        (38, "toml", None, "k40.toml"),
        (43, "indented", None, "k41.toml"),
        (55, "python", None, None),
    ]
    commands = [list(commands_of(found[k])) for k in (0, 2, 4)]
    assert commands == [
        [(0, ["fabweave", "shapes"])],
        [
            (1, ["fabweave", "model", "spot.obj", "--size", "100mm", "-o", "spot.glb"]),
            (1, ["fabweave", "materials"]),
            (3, ["pip", "install", "fabweave"]),
            (4, ["make", "lint", "test"]),
        ],
        [(0, ["fabweave", "coupon", "--material", "card", "-o", "coupon"])],
    ]


def test_a_page_is_followed_in_order_and_in_one_folder(tmp_path, capsys):
    for do in (check_page, run_page):
        folder = tmp_path / do.__name__
        folder.mkdir()
        do("page", PAGE, folder)
    assert "it says this" not in capsys.readouterr().out


def test_jobs_of_a_page_are_made_smaller_but_for_what_it_is_about():
    assert smaller(["make", "a.obj", "--remesh", "quads:800"]) == [
        "make", "a.obj", "--remesh", "quads:60", "--effort", "quick",
    ]  # fmt: skip
    assert smaller(["make", "a.obj", "--effort", "best"]) == ["make", "a.obj", "--effort", "best"]
    assert smaller(["inspect", "a.obj"]) == ["inspect", "a.obj"]


def fenced(language: str, *lines: str) -> str:
    return "\n".join([f"```{language}", *lines, "```"])


@pytest.mark.parametrize(
    ("page", "complaint"),
    [
        ("    fabweave mend", "page:1: fabweave mend: there is no command 'mend'"),
        ("    fabweave make a.obj --sise 3mm -o out", "page:1: .*No such option.*--sise"),
        ("    fabweave make a.obj --size 3ells -o out", "page:1: .*--size"),
        ("    fabweave make a.obj", "Missing option.*-o"),
        ("    fabweave make shape:blob -o out", "page:1: .*blob"),
        ("    fabweave make a.obj --stock mine.toml -o out", "page:1: .*mine.toml"),
        ("    fabweave shapes > list.txt", "page:1: a command with '>' is not run here"),
        (fenced("sh", "", "fabwaeve shapes"), "page:3: fabwaeve shapes: 'fabwaeve' is none of"),
        (fenced("sh", "make everything"), "the Makefile has no target 'everything'"),
        (fenced("sh", "python examples/none.py"), "there is no examples/none.py"),
        (fenced("console", "fabweave shapes"), "page:2: no line begins with '\\$ '"),
        (fenced("python", "a = 1", "a = = 2"), "page:3: invalid syntax"),
        (fenced("python", "", "import fabweave.nothing"), "page:3: No module named"),
        (fenced("python", "from fabweave.core import nothing"), "page:2: No module named"),
        (fenced("python", ">>> a = 1", ">>> a = = 2"), "page:3: invalid syntax"),
        ("<!-- not run: -->\n" + fenced("sh", "fabweave mend"), "'not run' says no more"),
        ("```python\na = 1", "page:1: the block does not end"),
    ],
)
def test_pages_that_cannot_be_followed_are_found_without_doing_anything(page, complaint, tmp_path):
    with pytest.raises(PaperError, match=complaint):
        check_page("page", page, tmp_path)


@pytest.mark.parametrize(
    ("page", "complaint"),
    [
        ("    fabweave verify nothing", "page:1: fabweave verify nothing: exit code 2"),
        ("    fabweave preflight spot", "exit code 2"),
        (fenced("python", "", "1 / 0"), "page:2: ZeroDivisionError"),
        (fenced("python", ">>> 1 + 1", "3"), "Expected:\n    3\nGot:\n    2"),
        (fenced("python", "a = 1") + "\n\n" + fenced("python", "assert a == 2"), "AssertionError"),
        (fenced("python", "open('nothing')"), "FileNotFoundError"),
    ],
)
def test_what_fails_when_a_page_is_followed_is_found(page, complaint, tmp_path):
    check_page("page", page, tmp_path)
    with pytest.raises(PaperError, match=complaint):
        run_page("page", page, tmp_path)
