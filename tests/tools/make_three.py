"""Bundle what our pages use of three.js, minified, with its licence, as a module.

Run it with: python tests/tools/make_three.py
when a page uses more of three.js, or to go to another release. It needs npm, of Node.
"""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
MADE = ROOT / "fabweave" / "show" / "scripts" / "three.js"
#: The releases: of the library, and of what bundles it.
THREE, ESBUILD = "0.187.0", "0.28.2"


def used() -> list[str]:
    """Return the names of three.js that the scripts of our pages use."""
    paths = (path for path in (ROOT / "fabweave").rglob("*.js") if path != MADE)
    scripts = [path.read_text("utf-8") for path in paths]
    return sorted({name for script in scripts for name in re.findall(r"\bTHREE\.(\w+)", script)})


def main() -> None:
    """Fetch both packages into a folder of their own, and write the bundle."""
    npm = shutil.which("npm")
    if npm is None:
        raise SystemExit("npm is not there; install Node")
    with tempfile.TemporaryDirectory() as folder:
        asked = (f"three@{THREE}", f"esbuild@{ESBUILD}")
        command = [npm, "install", "--no-audit", "--no-fund", "--prefix", folder, *asked]
        subprocess.run(command, check=True)
        modules = Path(folder) / "node_modules"
        licence = (modules / "three" / "LICENSE").read_text("utf-8").strip()
        made = subprocess.run(
            [
                modules / ".bin" / "esbuild", "--bundle", "--minify", "--format=iife",
                "--global-name=THREE", "--target=es2020", "--legal-comments=none",
            ],
            input=f"export {{ {', '.join(used())} }} from 'three'", encoding="utf-8",
            cwd=folder, capture_output=True, check=True,
        ).stdout  # fmt: skip
    begun = f"/*! three.js {THREE}: what our pages use.\n\n{licence}\n*/\n"
    exports = [f"export const {name} = THREE.{name};\n" for name in used()]
    MADE.write_text("".join([begun, made, *exports]), "utf-8")
    print(f"{MADE}: three.js {THREE}, {MADE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
