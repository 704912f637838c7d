"""Build wheel and sdist, twice, and hold both to what an index wants: `make release`.

Prints the notes of this version out of CHANGELOG.md, for whoever publishes it. With FABWEAVE_HOME
in the environment, the README's links and pictures lead there (see hatch_build.py).
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]


def built(folder: Path) -> dict[str, bytes]:
    """Build into a folder, and return what came of it."""
    command = [sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def notes_of(version: str, changelog: str) -> str:
    """Return what a changelog says of a version.

    >>> notes_of("2.0", "# C\\n\\n## [2.0] - today\\n\\nNew.\\n\\n## [1.0]\\n\\nOld.\\n")
    'New.'
    """
    section = rf"^## \[{re.escape(version)}\][^\n]*\n(.*?)(?=^## |\Z)"
    found = re.search(section, changelog, re.DOTALL | re.MULTILINE)
    if found is None:
        raise SystemExit(f"CHANGELOG.md says nothing of {version}")
    return found[1].strip()


def main(target: Path) -> None:
    """Build, compare, check, and keep."""
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
        files = built(Path(one))
        if files != built(Path(two)):
            raise SystemExit("two builds of the same files differ")
    target.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (target / name).write_bytes(data)
    paths = [str(target / name) for name in files]
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *paths], check=True)
    version = next(iter(files)).split("-")[1]
    print(notes_of(version, (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")))
    print(f"\n{', '.join(files)}: the same twice, in {target}", file=sys.stderr)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
