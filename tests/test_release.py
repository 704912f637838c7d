"""What an index shows of the project leads somewhere, and a release says what is new."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import fabweave as fw

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
LINK = re.compile(r"\]\(([^)]*)\)")


@pytest.fixture(scope="module")
def for_index():
    pytest.importorskip("hatchling", reason="the build backend is not installed here")
    return runpy.run_path(str(ROOT / "hatch_build.py"))["for_index"]


def test_the_readme_of_an_index_has_no_link_into_the_repository(for_index):
    assert any(not link.startswith("https://") for link in LINK.findall(README))
    without = for_index(README, "", fw.__version__)
    assert all(link.startswith("https://") for link in LINK.findall(without))
    assert "gallery" in without  # its words stay
    assert "![" not in without


def test_with_a_home_every_link_leads_to_a_file_of_this_version(for_index):
    text = for_index(README, "https://example.org/fabweave", "1.2.3")
    pattern = r"(!?)\[[^\]]*\]\(https://example\.org/fabweave/(raw|blob)/v1\.2\.3/([^)]*)\)"
    found = re.findall(pattern, text)
    assert len(found) > 20
    assert all((kind == "raw") == bool(picture) for picture, kind, _ in found)
    assert all((ROOT / path.partition("#")[0]).exists() for _, _, path in found)
    assert all(link.startswith("https://") for link in LINK.findall(text))


def test_a_release_has_notes_and_no_other_versions():
    notes_of = runpy.run_path(str(ROOT / "tests" / "tools" / "make_release.py"))["notes_of"]
    told = notes_of(fw.__version__, (ROOT / "CHANGELOG.md").read_text("utf-8"))
    assert "### Added" in told
    assert "\n## " not in told
    assert notes_of("2", "# C\n\n## [2] - now\n\nNew.\n\n## [1]\n\nOld.\n") == "New."
    with pytest.raises(SystemExit, match="nothing of 9"):
        notes_of("9", "# C\n")


@pytest.mark.slow
def test_a_program_of_somebody_else_is_typed_throughout(tmp_path):
    pytest.importorskip("pyright", reason="pyright is absent")
    program = (ROOT / "tests" / "support" / "typed_program.py").read_text("utf-8")

    def errors(text):
        (tmp_path / "program.py").write_text(text)
        (tmp_path / "pyrightconfig.json").write_text('{"typeCheckingMode": "strict"}')
        command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable]
        ended = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, text=True)
        if not ended.stdout.startswith("{"):
            pytest.skip(f"pyright cannot run here: {ended.stderr[-200:]}")
        return [one["message"] for one in json.loads(ended.stdout)["generalDiagnostics"]]

    assert errors(program) == []
    # It would say what is wrong.
    wrong = ("pieces.nest(sheet", "pieces.nest(3, sheet"), ("thread.label", "thread.name")
    for right, spoilt in (*wrong, ("job.folder", "job.place"), ("tries=3", "tries='3'")):
        assert right in program
        assert len(errors(program.replace(right, spoilt))) > 0, spoilt
