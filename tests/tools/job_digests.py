"""Make small jobs of every kind and print a digest of each file: equal before and after a move.

Run it before code is moved or renamed, and again afterwards, and compare:

    python tests/tools/job_digests.py > before.txt
    python tests/tools/job_digests.py > after.txt; diff before.txt after.txt

Everything goes through the command line, in processes of their own, so the script knows nothing of
how the package is laid out. Names given as arguments restrict it to these jobs.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

STOCK = Path(__file__).parents[2] / "examples" / "stock.toml"

#: What is made, by name: the words after ``fabweave``. ``OUT`` is a new folder.
JOBS = {
    "plain": "make shape:octahedron --size 200mm --effort quick -o OUT/job",
    "twill": "make shape:torus?m=8&n=4 --size 300mm --pattern twill -o OUT/job",
    "inexact": "make shape:cube --size 300mm --refine catmull-clark:1 --pattern twill "
    "--effort quick --seed 3 -o OUT/job",
    "triaxial": "make shape:tetrahedron --size 250mm --pattern triaxial --effort quick -o OUT/job",
    "fabric": "make shape:torus?m=8&n=8 --size 400mm --pattern 3/1 --effort quick -o OUT/job",
    "satin": "make shape:torus?m=10&n=5 --size 400mm --pattern satin:5/2 --effort quick "
    "--joint rivet:2,slots -o OUT/job",
    "kerf": "make shape:octahedron --size 300mm --effort quick --kerf 0.15mm --micro-joints 4 "
    "--cut-order cool --template a4 --manual-paper letter --smooth 2 -o OUT/job",
    "service": "make shape:cube --size 200mm --effort quick --profile service --target fictiv "
    "--preset glowforge --dxf R12 --svg-units px96 --hairline 0.001in --labels numbers -o OUT/job",
    "bunches": "make shape:torus?m=8&n=4 --size 400mm --material warp=card,weft=birch-veneer "
    "--gap warp=2mm,weft=3mm --effort quick -o OUT/job",
    "turned": "make shape:hypar --size 300mm --boundary turn --colours hue-range --effort quick "
    "--label-side inside -o OUT/job",
    "open": "make shape:tube --size 30cm --joint glue,lap=12mm --max-length 150mm "
    "--sheet 400x300mm:9 --effort quick --width 5mm..9mm -o OUT/job",
    "stock": f"make shape:cube --size 250mm --stock {STOCK} --sheet 600x400mm "
    "--rotations grain:5deg --effort quick --fair 5 -o OUT/job",
    "dovetail": "make shape:octahedron --size 300mm --joint dovetail --effort quick -o OUT/job",
    "slot": "make shape:octahedron --size 300mm --joint slot --effort quick -o OUT/job",
    "butt": "make shape:icosahedron --size 300mm --joint none --effort quick --up y -o OUT/job",
    "remeshed": "make shape:icosahedron --size 300mm --remesh quads:60 --effort quick -o OUT/job",
    "glb": "model shape:octahedron --size 100mm --pattern triaxial -o OUT/model.glb",
    "yarn": "model shape:octahedron --size 100mm --yarn -o OUT/model.stl",
    "picture": "model shape:tube --size 100mm --view -60,30 --view 95,52 -o OUT/model.png",
    "inspect": "inspect shape:sphere?n=3 --size 300mm --json --png OUT/a.png --edges OUT/a.csv",
    "inspect-text": "inspect shape:slit?genus=2 --size 400mm",
    "coupon": "coupon --material birch-veneer --fastener 3.3mm -o OUT/coupon",
    "shapes": "shapes --png OUT/shapes.png",
    "materials": "materials",
}


def digest(content: bytes, folder: str) -> str:
    """Return a short digest of a file, whatever folder it was made in and is named in it."""
    return hashlib.sha256(content.replace(folder.encode(), b"OUT")).hexdigest()[:16]


def run(name: str) -> list[str]:
    """Run one job and return a line for each file, and for what was printed."""
    with tempfile.TemporaryDirectory() as folder:
        words = JOBS[name].replace("OUT", folder).split()
        done = subprocess.run(
            [sys.executable, "-m", "fabweave", *words],
            capture_output=True,
            check=False,
            # Nobody's own materials and targets change a digest.
            env={**os.environ, "FABWEAVE_CONFIG_DIR": f"{folder}/configuration"},
        )
        here = Path(folder)
        contents = {
            str(path.relative_to(here)): path.read_bytes()
            for path in sorted(here.rglob("*"))
            if path.is_file()
        }
        contents["(printed)"] = done.stdout + done.stderr + str(done.returncode).encode()
        return [f"{digest(text, folder)} {name}/{file}" for file, text in contents.items()]


def main() -> None:
    """Run the jobs, two at a time, and print their digests in a fixed order."""
    with ThreadPoolExecutor(2) as pool:
        for lines in pool.map(run, sys.argv[1:] or list(JOBS)):
            print("\n".join(lines), flush=True)


if __name__ == "__main__":
    main()
