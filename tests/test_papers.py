"""What the documentation shows works: every command, and every block of Python."""

from pathlib import Path

import pytest
from papers import ROOT, PaperError, blocks_of, check_page, commands_of, run_page, smaller

pytestmark = pytest.mark.usefixtures("quick_jobs")

PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "fabweave" / "guide").glob("*.md")),
]


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_and_names_on_a_page_exist(page, tmp_path):
    check_page(name_of(page), page.read_text("utf-8"), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_can_be_followed_from_top_to_bottom(page, tmp_path):
    run_page(name_of(page), page.read_text("utf-8"), tmp_path)


PAGE = """\
# A page

1. A list, with text with `fabweave nothing` in it, and

   ```sh
   # a remark
   fabweave model spot.obj --size "100mm" \\
     -o spot.glb && fabweave materials
   pip install fabweave
   make lint test             # both
   ```

<!-- not run: takes minutes -->
```sh
fabweave nothing
```

<!-- file: k40.toml -->
```toml
a = 1
```

```text
fabweave nothing
```

```python
from pathlib import Path
names = [Path("spot.obj").name]
```

```python
>>> names.append(len(Path("spot.glb").read_bytes()) > 1000)
>>> names, Path("k40.toml").read_text()
(['spot.obj', True], 'a = 1\\n')
```
"""


def test_blocks_are_found_with_what_is_said_of_them():
    found = blocks_of("page", PAGE)
    assert [(one.place, one.language, one.not_run, one.file) for one in found] == [
        ("page:6", "sh", None, None),
        ("page:15", "sh", "takes minutes", None),
        ("page:20", "toml", None, "k40.toml"),
        ("page:28", "python", None, None),
        ("page:33", "python", None, None),
    ]
    assert list(commands_of(found[0])) == [
        ["fabweave", "model", "spot.obj", "--size", "100mm", "-o", "spot.glb"],
        ["fabweave", "materials"],
        ["pip", "install", "fabweave"],
        ["make", "lint", "test"],
    ]


@pytest.mark.parametrize("do", [check_page, run_page])
def test_a_page_is_followed_in_order_and_in_one_folder(do, tmp_path):
    do("page", PAGE, tmp_path)


def test_jobs_of_a_page_are_made_smaller_but_for_what_it_is_about():
    remesh = smaller(["make", "a.obj", "--remesh", "quads:800"])
    assert remesh == ["make", "a.obj", "--remesh", "quads:60", "--effort", "quick"]
    assert smaller(["make", "a.obj", "--effort", "best"]) == ["make", "a.obj", "--effort", "best"]
    assert smaller(["inspect", "a.obj"]) == ["inspect", "a.obj"]


#: A line of a block, and what is said of it without doing anything, or when it is done.
@pytest.mark.parametrize(
    ("do", "language", "line", "complaint"),
    [
        (check_page, "sh", "fabweave mend", "page:2: fabweave mend: there is no command 'mend'"),
        (check_page, "sh", "fabweave make a.obj --sise 3mm -o out", "page:2: .*option.*--sise"),
        (check_page, "sh", "fabweave make a.obj --size 3ells -o out", "page:2: .*--size"),
        (check_page, "sh", "fabweave make a.obj", "Missing option.*-o"),
        (check_page, "sh", "fabweave make shape:blob -o out", "page:2: .*blob"),
        (check_page, "sh", "fabweave make a.obj --stock mine.toml -o out", "page:2: .*mine.toml"),
        (check_page, "sh", "fabweave shapes > list.txt", "page:2: .* is not run here"),
        (check_page, "sh", "fabwaeve shapes", "page:2: fabwaeve shapes: 'fabwaeve' is none of"),
        (check_page, "sh", "make everything", "the Makefile has no target 'everything'"),
        (check_page, "sh", "python examples/none.py", "there is no examples/none.py"),
        (check_page, "python", "a = = 2", "page:2: invalid syntax"),
        (check_page, "python", ">>> a = = 2", "page:2: invalid syntax"),
        (run_page, "sh", "fabweave verify nothing", "page:2: fabweave verify nothing: exit code 2"),
        (run_page, "python", "1 / 0", "page:2: ZeroDivisionError"),
        (run_page, "python", "import fabweave.nothing", "No module named"),
        (run_page, "python", ">>> 1 + 1\n3", "Expected:\n    3\nGot:\n    2"),
    ],
)
def test_what_is_wrong_on_a_page_is_found(do, language, line, complaint, tmp_path):
    with pytest.raises(PaperError, match=complaint):
        do("page", f"```{language}\n{line}\n```", tmp_path)
