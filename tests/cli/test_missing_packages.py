"""Where a package is missing, one line says what it costs, or which extra to install."""

import re
import subprocess
import sys

import pytest
from slow import slow_but

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.mesh.remesh.engines import lacking

#: Remeshers that some platforms have no wheels of, by what they make.
REMESHERS = {"quads": ("pyQuadriFlow", "pynanoinstantmeshes"), "tubes": ("pygel3d",)}


def test_a_widget_without_its_package_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "fabweave.studio.widget", raising=False)
    ribbons = fw.weave(fw.shape("octahedron", size="200mm")).ribbons()
    with pytest.raises(InputError, match=r"fabweave\[notebook\]"):
        ribbons.widget()


def without(*modules):
    """Return a script that runs the command line as if some modules were not there."""
    return (
        f"import sys\nsys.modules.update(dict.fromkeys({modules!r}))\n"
        "from fabweave.cli.main import main\nmain(sys.argv[1:])\n"
    )


def said(script, words, folder, code):
    """Return what a script writes to standard error, which is one message of fabweave's."""
    ended = subprocess.run(
        [sys.executable, "-c", script, *map(str, words)],
        capture_output=True,
        check=False,
        timeout=300,
        cwd=folder,
    )
    told = ended.stderr.decode("utf-8", "replace")
    assert ended.returncode == code, told
    assert "Traceback" not in told
    assert len(re.findall(r"^fabweave: ", told, re.MULTILINE)) == 1
    return told


@pytest.mark.parametrize("kind", slow_but(REMESHERS))
def test_a_remesher_that_is_not_there_is_said_in_one_line_with_what_is(kind, tmp_path):
    words = ("make", "shape:icosahedron", "--remesh", f"{kind}:200", "-o", "out")
    told = said(without(*REMESHERS[kind]), words, tmp_path, 1)
    (line,) = (line for line in told.splitlines() if f"--remesh {kind} is not there" in line)
    there = {"quads", "tubes", "triangles"} - {kind}
    assert there <= set(re.findall(r"\w+", line.partition(";")[2]))
    assert all(module in line for module in REMESHERS[kind])
    assert not list(tmp_path.iterdir())


def test_one_of_two_remeshers_of_quads_is_enough(monkeypatch):
    for module in REMESHERS["quads"]:
        monkeypatch.setitem(sys.modules, module, None)
        assert (lacking("quads") == "") is (module != REMESHERS["quads"][-1])
