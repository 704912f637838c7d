"""Where an optional package is missing, one message says which extra to install."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from PIL import Image
from strategies import merged

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape

PYPROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
EXTRAS = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"]

#: By extra: the modules of its packages, what is typed, and with which code it ends.
WITHOUT = {
    "join": (("manifold3d",), ("make", "two.obj", "--bodies", "join", "-o", "out"), 2),
    # There are other ways to quads; where none of them helps, the mesh cannot be made of them.
    "quad": (
        ("pyQuadriFlow", "pynanoinstantmeshes"),
        ("make", "shape:icosahedron", "--remesh", "quads:200", "-o", "out"), 1,
    ),
    "tubes": (("pygel3d",), ("make", "shape:icosahedron", "--remesh", "tubes:200", "-o", "out"), 1),
    "studio": (
        ("starlette", "uvicorn", "websockets", "zxingcpp"), ("studio", "code.png", "-o", "out"), 1,
    ),
    "notebook": (("anywidget",), (), 0),
}  # fmt: skip


def test_every_extra_is_tried():
    assert WITHOUT.keys() == EXTRAS.keys() - {"dev"}
    for extra, (modules, *_) in WITHOUT.items():
        packages = {re.match(r"[\w-]+", package)[0].lower() for package in EXTRAS[extra]}
        assert {name.replace("-", "") for name in packages} == {one.lower() for one in modules}


def test_a_widget_without_its_package_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "fabweave.studio.widget", raising=False)
    ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
    with pytest.raises(InputError, match=r"fabweave\[notebook\]"):
        ribbons.widget()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("extra", "missing"),
    [(extra, module) for extra in ("join", "studio") for module in WITHOUT[extra][0]]
    + [(extra, ",".join(WITHOUT[extra][0])) for extra in ("quad", "tubes")],
)
def test_the_extra_is_named_and_nothing_is_written(extra, missing, tmp_path):
    _, words, code = WITHOUT[extra]
    if extra == "join":
        cube = parse_shape("shape:cube")
        write_mesh(tmp_path / "two.obj", merged(cube, cube.with_vertices(cube.vertices + 1.0)))
    if extra == "studio":
        Image.new("L", (9, 9)).save(tmp_path / "code.png")
        code = 2 if missing == "zxingcpp" else 1
    before = sorted(tmp_path.rglob("*"))
    script = (
        "import sys\n"
        f"sys.modules.update(dict.fromkeys({missing!r}.split(',')))  # as if they were not there\n"
        "from fabweave.cli.main import main\n"
        "main(sys.argv[1:])\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script, *words],
        capture_output=True,
        check=False,
        timeout=300,
        cwd=tmp_path,
    )
    said = ended.stderr.decode("utf-8", "replace")
    assert ended.returncode == code, said
    assert f"fabweave[{extra}]" in said
    assert "install" in said
    assert "Traceback" not in said
    assert len(re.findall(r"^fabweave: ", said, re.MULTILINE)) == 1
    assert sorted(tmp_path.rglob("*")) == before
