"""Whole jobs of random meshes with random settings: each is proved, or refused in words."""

import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

import fabweave as fw
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.weave.strand_colours import STRATEGIES

MATERIALS = ("card", "card", "museum-board", "birch-veneer", "polypropylene", "spring-shim-0.1")


def hull(dice):
    """Return a polyhedron of triangles around random points, maybe flattened or drawn out."""
    points = dice.normal(size=(int(dice.integers(4, 22)), 3)) * dice.uniform(0.3, 1.0, 3)
    shell = ConvexHull(points)
    faces = shell.simplices.copy()
    middle = points.mean(axis=0)
    a, b, c = points[faces].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - middle) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    used, numbers = np.unique(faces, return_inverse=True)
    return points[used], numbers.reshape(-1, 3).tolist()


def blocks(dice):
    """Return the surface of some cubes of a grid: of any genus, some with edges of four faces."""
    grid = dice.random((3, 3, 2)) < dice.choice([0.15, 0.5, 0.9])
    grid[1, 1, 0] = True
    full = np.pad(grid, 1)
    corners, faces = {}, []

    def corner(place):
        return corners.setdefault(tuple(place.tolist()), len(corners))

    for cell in np.argwhere(full):
        for axis in range(3):
            u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
            step = np.eye(3, dtype=int)[axis]
            if not full[tuple(cell + step)]:
                base = cell + step
                faces.append([corner(p) for p in (base, base + u, base + u + v, base + v)])
            if not full[tuple(cell - step)]:
                faces.append([corner(p) for p in (cell, cell + v, cell + u + v, cell + u)])
    return np.array(list(corners), dtype=float), faces


def sheet(dice):
    """Return an open triangulation: a hilly sheet over random points."""
    points = dice.random((int(dice.integers(4, 26)), 2))
    heights = dice.uniform(0.0, 0.6) * np.sin(4.0 * points[:, 0] + dice.uniform(0, 6))
    return np.column_stack([points, heights]), Delaunay(points).simplices.tolist()


def ring(dice):
    """Return a torus of quads with some noise."""
    m, n = int(dice.integers(3, 12)), int(dice.integers(3, 7))
    u, v = np.meshgrid(np.arange(m) * 2 * np.pi / m, np.arange(n) * 2 * np.pi / n, indexing="ij")
    small = dice.uniform(0.2, 0.6)
    points = np.stack(
        [(1 + small * np.cos(v)) * np.cos(u), (1 + small * np.cos(v)) * np.sin(u),
         small * np.sin(v)], axis=-1,
    ).reshape(-1, 3)  # fmt: skip
    points += dice.normal(size=points.shape) * dice.choice([0.0, 0.02, 0.08])
    faces = [
        [i * n + j, (i + 1) % m * n + j, (i + 1) % m * n + (j + 1) % n, i * n + (j + 1) % n]
        for i in range(m)
        for j in range(n)
    ]
    return points, faces


def bodies(dice):
    """Return two of the others beside one another, which may touch."""
    (one, first), (two, second) = (shape(dice) for shape in dice.choice([hull, blocks, sheet], 2))
    two[:, 0] += np.ptp(one[:, 0]) + dice.choice([0.0, 0.3])
    return np.concatenate([one, two]), [*first, *([v + len(one) for v in face] for face in second)]


SHAPES = (hull, blocks, sheet, ring, bodies)

#: Jobs whose offcuts later ones take: of four materials, from bands of pieces to lone ones.
EARLIER = (
    {"size": "200mm"},
    {"size": "90mm", "width": 0.4},
    {"size": "150mm", "material": "birch-veneer", "sheet": "600x400mm"},
    {"size": "150mm", "material": "polypropylene"},
    {"size": "160mm", "material": "museum-board", "sheet": "400x400mm:2"},
)


#: A small job has a mesh of no more faces.
_FEW = 16


def random_job(seed, *, small=False):
    """Return vertices, faces and options of a job; a small one takes a fraction of the time."""
    dice = np.random.default_rng(seed)
    vertices, faces = SHAPES[seed % len(SHAPES)](dice)
    while small and len(faces) > _FEW:
        vertices, faces = SHAPES[seed % len(SHAPES)](dice)

    # Only rings of quads have warp and weft.
    patterns = ("satin:5/2", "2/1") if SHAPES[seed % len(SHAPES)] is ring else ("plain",)

    def maybe(share, value):
        return value if dice.random() < share else None

    def one_of(*values):
        return values[int(dice.integers(len(values)))]

    options = {
        "size": f"{10 ** dice.uniform(1.3, 3.0):.0f}mm",
        "effort": "quick",
        "pattern": one_of("plain", "plain", "twill", "triaxial", *patterns),
        "material": one_of(*MATERIALS),
        "sheet": maybe(0.5, one_of("300x200mm", "600x400mm", "1000x700mm", "250x250mm:2")),
        "width": maybe(0.4, round(float(dice.uniform(0.2, 0.9)), 2)),
        "joint": maybe(0.4, one_of("glue", "rivet:2", "tuck", "dovetail", "slot", "none")),
        "fastener": maybe(0.3, one_of("none", "2mm", "4mm")),
        "labels": maybe(0.3, one_of("none", "numbers")),
        "kerf": maybe(0.2, "0.15mm"),
        "boundary": maybe(0.2, "turn"),
        "refine": maybe(0.2, one_of("catmull-clark:1", "loop:1")),
        "max_length": maybe(0.3, one_of("auto", "150mm", "400mm")),
        "prefer": maybe(0.3, one_of("balanced", "work", "waste")),
        "lap": maybe(0.2, one_of("8mm", "25mm", "100mm")),
        "seed": seed,
        # Many of them bend or twist too much to be built, and are refused unless forced.
        "force": maybe(0.95, value=True),
        "course": maybe(0.2, one_of("straight", "projection")),
        "fair": maybe(0.1, 20),
    }
    if options["width"] is None:
        share = maybe(0.2, round(float(dice.uniform(0.05, 0.8)), 2))
        options["width"] = None if share is None else f"open:{share:g}"
    lap = options.pop("lap")
    if lap is not None:
        options["joint"] = f"{options['joint'] or 'rivet'},lap={lap}"
    return vertices, faces, {name: value for name, value in options.items() if value is not None}


#: Shapes that newer options suit, beside the random ones: strips straight, formers, rims, feet.
NAMED_SHAPES = (
    *("tetrahedron", "octahedron", "cube", "icosahedron", "dodecahedron", "sphere?n=2"),
    *("hypar?m=4&n=4", "torus?m=6&n=4", "torus?m=8&n=4", "tube?m=8&n=4"),
)
TRIANGULATED = ("shape:tetrahedron", "shape:octahedron", "shape:icosahedron")
#: A scrap whose outline leaves a tongue at one side, and one that is small, with a hole in it.
SCRAPS = """\
[[offcut]]
outline = [[0, 0], [280, 0], [280, 100], [110, 190], [0, 190]]
quantity = 2
[[offcut]]
outline = [[0, 0], [120, 0], [120, 40], [40, 60], [40, 150], [0, 150]]
quantity = 3
"""


def newest_job(seed, folder):
    """Return the mesh and the options of a job of what is newest: formers, rolls, rows, loads."""
    dice = np.random.default_rng((seed, 2))

    def maybe(share, *values):
        return values[int(dice.integers(len(values)))] if dice.random() < share else None

    mesh = "shape:" + NAMED_SHAPES[int(dice.integers(len(NAMED_SHAPES)))]
    if dice.random() < 0.35:
        mesh = random_job(int(dice.integers(1_000_000)), small=True)[:2]
    straight = dice.random() < 0.4
    scraps = folder / "scraps.toml"
    scraps.write_text(SCRAPS)
    options = {
        "size": f"{10 ** dice.uniform(1.9, 2.7):.0f}mm",
        "effort": "quick",
        "seed": seed,
        "force": maybe(0.7, True),
        "pattern": maybe(0.5, "kagome", "twill", "triaxial", "plain"),
        "material": maybe(0.6, *MATERIALS, "birch-ply-1.5"),
        "strips": "straight" if straight else None,
        "joint": maybe(0.6, "glue", "rivet:2", "tuck", "tuck", "dovetail", "slot", "none"),
        "stock": maybe(0.3, scraps, "roll:12mm:20m", "roll:8mm:5m:3"),
        "sheet": maybe(0.4, "300x200mm", "600x400mm", "200x200mm:4", "mat-12x12"),
        "margin": maybe(0.6, 0, "1mm", "2mm", "3mm"),
        "gap": maybe(0.3, 0, "0.5mm", "3mm"),
        "micro_joints": maybe(0.2, 2, 3, "4:0.3mm"),
        "kerf": maybe(0.2, "0.15mm", "0.3mm"),
        "former": maybe(0.3, "auto", "birch-ply-3"),
        "up": maybe(0.2, "x", "-z", "0.2,-1,0.1"),
        "hang": maybe(0.15, "top", "bottom:3"),
        "load": maybe(0.15, "200g@top", "1kg@bottom:3"),
        "fasten": maybe(0.3, "form", "form:3mm", "all", "none", "joints", "every:2"),
        "leave_out": maybe(0.15, "top:60mm", "bottom:50mm"),
        "rim": maybe(0.1, "ring", "double"),
        "pin": maybe(0.1, "A1@1:60,60,0", "A1@3:40,40,90"),
        "preset": maybe(0.3, "boxes", "epilog", "glowforge", "snijlab", "trotec", "xtool"),
        "profile": maybe(0.15, "service"),
        "target": maybe(0.2, "cutitout", "fictiv", "mat-12x12", "snijlab"),
        "dxf": maybe(0.15, "R12", "R2000"),
        "svg_units": maybe(0.15, "px96"),
        "labels": maybe(0.3, "brief", "full", "numbers", "kinds", "none"),
        "label_side": maybe(0.1, "inside"),
        "spares": maybe(0.1, "5%", 1),
        "template": maybe(0.2, "a4", "letter", "none"),
        "boundary": maybe(0.2, "turn"),
        "max_length": maybe(0.2, "150mm", "400mm"),
        "prefer": maybe(0.2, "work", "waste"),
        "colours": maybe(0.2, *sorted(STRATEGIES)),
    }
    # What is refused at a glance says little about the rest of the house.
    if str(options["stock"]).startswith("roll"):
        options |= {"strips": "straight", "kerf": None, "micro_joints": None, "sheet": None}
    if options["kerf"] and options["gap"] is not None:
        options["gap"] = "1mm"
    if mesh not in TRIANGULATED and options["pattern"] == "kagome":
        options["pattern"] = None
    return mesh, {name: value for name, value in options.items() if value is not None}


def earlier_stock(folder):
    """Make the earlier jobs in a folder and return the lists of their offcuts, by material."""
    stocks = {}
    for number, options in enumerate(EARLIER):
        made = folder / f"earlier_{number}"
        fw.make("shape:torus?m=8&n=4", made, effort="quick", force=True, **options)
        material = options.get("material", "card")
        stocks.setdefault(material, []).append(made / "offcuts" / "stock.toml")
    return stocks


def with_offcuts(seed, options, stocks):
    """Return options of a job with a scheme of colours, and offcuts of its material if any are.

    What is drawn at random is drawn apart, so that a seed stands for the same job without them.
    """
    dice = np.random.default_rng((seed, 1))
    options = {**options, "colours": str(dice.choice(sorted(STRATEGIES)))}
    offcuts = stocks.get(options["material"])
    if offcuts:
        options["stock"] = str(offcuts[int(dice.integers(len(offcuts)))])
        # Most have sheets for what finds no place on an offcut.
        if dice.random() < 0.3:
            options.pop("sheet", None)
    return options


def outcome_of(seed, *, small=False, stocks=None):
    """Make a random job and return what came of it, and the words with which it was refused.

    With ``stocks``, from :func:`earlier_stock`, it has colours, and offcuts to be cut from.
    """
    vertices, faces, options = random_job(seed, small=small)
    if stocks is not None:
        options = with_offcuts(seed, options, stocks)
    return outcome((vertices, faces), options)


def outcome_of_newest(seed, folder):
    """Make a job of what is newest; return what came of it, and the words of a refusal."""
    return outcome(*newest_job(seed, folder))


def outcome(mesh, options):
    """Make a job of a shape, or of vertices and faces; return what came of it, and why not.

    A paper that could not be made is a fault, though it loses no job.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = fw.make(
                fw.mesh(*mesh) if isinstance(mesh, tuple) else mesh, Path(folder) / "job", **options
            )
        except CannotMakeError as error:
            return ("unproved" if "did not pass" in str(error) else "cannot be made"), str(error)
        except InputError as error:
            return "bad input", str(error)
    return ("fault", "; ".join(made.missing)) if made.missing else ("proved", "")
