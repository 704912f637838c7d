"""The papers say what is true: every topic, option, file, message and figure on them is there."""

import json
import re
import tomllib
from functools import cache
from pathlib import Path

import click
import pytest
from jobs import OCTAHEDRON, contents_of

from fabweave.cli.guide import TOPICS, for_terminal, options_page, page
from fabweave.cli.main import cli
from fabweave.estimate.texts import hours_text
from fabweave.mesh.shapes.catalogue import SHAPES
from fabweave.mesh.subdivide import SCHEMES
from fabweave.piece.joint.kinds import KINDS
from fabweave.sheet.presets import preset_names
from fabweave.sheet.targets import targets
from fabweave.verify.report import MEANINGS

pytestmark = pytest.mark.usefixtures("quick_jobs")

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "fabweave" / "guide"
PAPERS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted(GUIDE.glob("*.md")),
]
#: Options of other programs that a page names.
FOREIGN = {"--help", "--strict-markers"}


def text_of(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


def rows(markdown: str, first_head: str) -> list[list[str]]:
    """Return the rows of the table whose head begins with these words, without backticks."""
    lines = markdown.replace("`", "").splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith(f"| {first_head} |")) + 2
    found = []
    while at < len(lines) and lines[at].startswith("|"):
        found.append([cell.strip() for cell in lines[at].strip("|").split(" | ")])
        at += 1
    return found


def first_column(topic: str, head: str) -> list[str]:
    return [name for row in rows(page(topic), head) for name in row[0].split(", ")]


# -- pages ---------------------------------------------------------------------------------------


def test_a_terminal_sees_no_comment_no_picture_and_no_dead_link():
    for topic in TOPICS:
        shown = for_terminal(page(topic))
        assert "<!--" not in shown
        assert "![" not in shown
        assert re.findall(r"\]\((?!https?:)", shown) == []
        # Nothing else is lost.
        assert shown.count("```") == page(topic).count("```")


# -- links and pictures --------------------------------------------------------------------------


def dead_links(text: str, folder: Path) -> list[str]:
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    files = [link.partition("#")[0] for link in links if not link.startswith("https://")]
    return [name for name in files if not (folder / name).exists()]


@pytest.mark.parametrize("path", PAPERS, ids=lambda path: path.name)
def test_links_lead_somewhere(path):
    assert dead_links(path.read_text("utf-8"), path.parent) == []


# -- options, names and paths --------------------------------------------------------------------


@cache
def known_options() -> frozenset[str]:
    return frozenset(
        name
        for command in cli.commands.values()
        for param in command.get_params(click.Context(command))
        for name in (*param.opts, *param.secondary_opts)
    )


def unknown_options(text: str) -> set[str]:
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*[a-z]", re.sub(r"<!--|-->", "", text)))
    return named - known_options() - FOREIGN


@pytest.mark.parametrize("path", PAPERS, ids=lambda path: path.name)
def test_every_option_that_is_named_is_there(path):
    # What was removed is named by what it was.
    text = re.sub(r"(?ms)^### Removed\n.*?(?=^### )", "", path.read_text("utf-8"))
    assert unknown_options(text) == set()


def test_every_option_of_a_job_is_explained_somewhere_in_the_guide():
    told = "".join(map(page, TOPICS))
    options = re.findall(r"^### `(--[\w-]+)", options_page(), re.MULTILINE)
    assert len(options) > 35
    # These are explained by the reference alone.
    alone = {"--crossing", "--manual-paper"}
    assert {name for name in options if name not in told} <= alone


def missing_paths(text: str) -> list[str]:
    paths = re.findall(r"`((?:fabweave|tests|examples)/[\w./-]+)`", text)
    assert len(paths) > 0
    return [path for path in paths if not (ROOT / path).exists()]


def test_every_file_that_contributing_names_is_there():
    assert missing_paths(text_of("CONTRIBUTING.md")) == []
    assert missing_paths("`fabweave/piece` and `fabweave/none.py`") == ["fabweave/none.py"]


def test_contributing_names_every_room_in_the_order_of_imports():
    from house import ALONE, FLOW, PROOF  # noqa: PLC0415 - found beside the tests

    rooms = [row[0] for row in rows(text_of("CONTRIBUTING.md"), "room")]
    assert rooms == [f"fabweave/{room}{'.py' * (room in ALONE)}" for room in (*FLOW, PROOF)]


def test_the_story_that_contributing_tells_is_the_pipeline():
    text = text_of("CONTRIBUTING.md").partition("excerpt of")[2]
    excerpt = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    assert excerpt.count("\n") >= 3
    assert excerpt in text_of("fabweave/job/run.py")


# -- tables of the guide -------------------------------------------------------------------------


def test_tables_name_all_that_there_is():
    assert set(first_column("machines", "--preset")) == set(preset_names())
    assert first_column("services", "--target") == [target.name for target in targets()]
    kinds = {name.partition(":")[0] for name in first_column("joints", "--joint")}
    assert kinds == set(KINDS)
    shapes = {shape.name for shape in SHAPES}
    assert set(first_column("weaves", "shape")) == shapes
    assert set(first_column("meshes", "scheme")) == {scheme.name for scheme in SCHEMES}
    checks = first_column("files", "checks")
    assert sorted(checks) == sorted(MEANINGS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("row", "words"),
    [
        (0, "shape:octahedron --size 200mm"),
        (1, f"{ROOT / 'examples' / 'lampshade.obj'} --size 300mm --pattern twill --boundary turn"),
        (2, "shape:torus?m=24&n=12 --size 400mm"),
    ],
)
def test_figures_of_the_guide_are_those_of_a_job(finished, row, words):
    job = finished(*words.split(), "--effort", "quick")
    waste = json.loads((job / "waste.json").read_text("utf-8"))
    plan = json.loads((job / "crossing_map.json").read_text("utf-8"))
    _, *told, time = rows(page("design"), "object")[row]
    fasteners = sum(one["needed"] for one in waste["fasteners"])
    assert list(map(int, told)) == [len(plan["crossings"]), len(plan["pieces"]), fasteners]
    hours = hours_text(waste["estimate"]["assembly"]["hours"])
    assert time.replace("minutes", "min").replace("hours", "h") == hours


@pytest.mark.slow
def test_the_files_of_a_job_are_those_that_are_told(finished):
    told, plan_told, job = page("files"), page("map"), finished(*OCTAHEDRON)
    names = {re.sub(r"\d\d", "01", name) for name in contents_of(job)}
    table = " ".join(cell for row in rows(told, "file") for cell in row[0].split())
    for name in names:
        stem, dot, suffix = name.rpartition(".")
        assert name in table or (f"{stem}." in table and f"{dot}{suffix}" in table), name
    plan = json.loads((job / "crossing_map.json").read_text("utf-8"))
    # Some keys are there only with an option, as their row says.
    keys = [row for row in rows(plan_told, "key") if not row[1].startswith("with --")]
    assert {name for row in keys for name in row[0].split(", ")} == set(plan)
    for part in ("pieces", "steps"):
        section = plan_told.partition(f"### A {part[:-1]}\n")[2].partition("\n#")[0]
        for key in plan[part][0]:
            assert f"`{key}`" in section or key == "step", key


# -- examples of files --------------------------------------------------------------


@pytest.mark.parametrize("topic", TOPICS)
def test_blocks_of_toml_can_be_read(topic):
    for block in re.findall(r"```toml\n(.*?)```", page(topic), re.DOTALL):
        tomllib.loads(block)
