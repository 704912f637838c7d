"""Name the options that decide the woven object: its mesh, its weave and its ribbons."""

from fabweave.options.file_kinds import leave_out, library
from fabweave.options.kinds import (
    MOST_MM,
    choice,
    flag,
    length,
    length_by_bunch,
    line,
    load,
    number,
    place,
    text,
    value_of,
    whole,
)
from fabweave.options.option import MESH, RIBBONS, STOCK, WEAVE, Option


def _tidy_materials(told: str) -> str:
    tidy: str = load("fabweave.stock.supplies.tidy_materials")(told)
    return tidy


def _usual_pattern(told: str) -> str:
    return str(load("fabweave.weave.weave_pattern.parse_pattern")(told))


def _tidy_weights(told: str) -> str:
    tidy: str = load("fabweave.weave.twill.conditions.tidy_weights")(told)
    return tidy


#: In the order in which job.toml has them.
OBJECT_OPTIONS = (
    Option(
        "mesh",
        MESH,
        place("MESH", "a file, or a shape such as shape:torus?m=24&n=12"),
        "What is woven: an OBJ, OFF, PLY, STL, GLB or 3MF file, or a built-in shape.",
        brief="OBJ, OFF, PLY, STL, GLB or 3MF file, or shape:NAME.",
        holder="source",
    ),
    Option(
        "title",
        MESH,
        line("NAME", "a line of text of at most 80 characters"),
        "What to call the object, such as Fruit bowl: in the manual, the viewer, the pages, and "
        "in the margin of the sheets.",
        otherwise="made of the name of the mesh",
    ),
    Option(
        "up",
        MESH,
        choice(("z", "y", "x")),
        "Which axis of the mesh points up; the mesh is turned so that it becomes z. make and "
        "inspect say what they guess.",
        otherwise="y or z, guessed from base and symmetry, z if unsure; y for GLB and glTF",
        brief="Axis of the mesh that points up.",
    ),
    Option(
        "weld",
        MESH,
        flag(denied=True),
        "Merge vertices at the same place into one. Programs split vertices where normals or "
        "textures change, which leaves loose faces that nothing is woven across. STL, GLB and 3MF "
        "are always merged.",
        otherwise="done at boundaries if most of their vertices have another at the same place",
    ),
    Option(
        "bodies",
        MESH,
        text(
            "all|largest|N|join|wrap",
            "all, largest, join, wrap or a whole number",
            "fabweave.mesh.bodies.parse_bodies",
        ),
        "How many bodies of the mesh to keep: all, only the largest, or the N largest, by the "
        "diagonals of their bounding boxes. Scans often hold small pieces of debris. join makes "
        "one surface of closed bodies that run into one another, as models are often put together. "
        "wrap lays a closed surface around all of it, however open, loose or broken its parts are.",
        default="all",
        brief="all, largest, N, join or wrap.",
    ),
    Option(
        "size",
        MESH,
        length(MOST_MM, least=0.01),
        "Scale the mesh so that its largest dimension is this, e.g. 400mm or 16in. Without it the "
        "mesh's numbers are millimetres.",
        brief="Largest dimension of the object, such as 400mm.",
    ),
    Option(
        "remesh",
        MESH,
        text(
            "none|KIND[:N]",
            "a text such as 'quads:3000'",
            "fabweave.mesh.remesh.request.parse_remesh",
        ),
        "Make a coarser mesh first, of about N faces. quads:N, for twill; without N as many as the "
        "triangles pair up to, or else half as many as triangles, at most 3000. triangles:N, for "
        "triaxial weaves, keeps horns and limbs best. coarse:N undoes a subdivision. none keeps "
        "the mesh as it is.",
        otherwise="none; make takes a coarser mesh where this one cannot be built",
        brief="A new mesh first: quads:N, triangles:N, coarse:N.",
    ),
    Option(
        "along",
        MESH,
        place(
            "x|y|z|curvature|FILE",
            "x, y, z, curvature or the path of a list of directions",
        ),
        "Which way strands should run, with --remesh quads: along an axis of the upright mesh; as "
        "the surface bends most and least; or as a list says, in lines such as 10 0 25 0 0 1, a "
        "place of the given mesh and a vector (the nearest place counts). Quads follow it as far "
        "as their topology lets them, and the notes say how far.",
    ),
    Option(
        "refine",
        MESH,
        text(
            "SCHEME:STEPS",
            "a text such as 'catmull-clark:2'",
            "fabweave.mesh.subdivide.refine.parse_refinements",
        ),
        "Refine the mesh first, e.g. catmull-clark:2, or simplest:1,catmull-clark:1. Schemes that "
        "round the shape: catmull-clark, doo-sabin, simplest, sqrt3, loop; that keep it: mid-edge, "
        "quads.",
        brief="Refine the mesh, such as catmull-clark:1.",
    ),
    Option(
        "symmetrise",
        MESH,
        flag(),
        "Make a mesh exactly symmetric that is so but for noise of up to 2 % of its size, so that "
        "it can be cut from few kinds of pieces; how far vertices move is told.",
        default=False,
    ),
    Option(
        "fair",
        MESH,
        whole(0, 1000),
        "Move the vertices along the surface in so many steps, such as 50, so that threads run "
        "straighter and narrow ribbons find room. Sharp edges stay; a coarse mesh loses some "
        "shape, so refine it first.",
        default=0,
    ),
    Option(
        "leave_out",
        MESH,
        leave_out(),
        "Leave out faces, for a bulb, an arm or a pot: top:80mm or bottom:80mm opens the mesh "
        "around its topmost or bottommost point, where centres of faces are within that diameter "
        "in plan, and lays the rim onto that circle; or faces by number (12,13), or as a file "
        "lists them, counted from 0 as they are woven. Commas part several. Threads end at the "
        "rim, or turn back (--boundary turn). --size counts as it was before.",
    ),
    Option(
        "rim",
        MESH,
        choice(("none", "ring")),
        "ring lays a ring around each round opening of --leave-out, over the ends of the threads: "
        "a band in pieces R1, R2 and so on, in the folder rim, that the fasteners of the crossings "
        "beside the rim go through.",
        default="none",
    ),
    Option(
        "pattern",
        WEAVE,
        text(
            "PATTERN",
            "a text such as 'twill' or '3/1'",
            "fabweave.weave.weave_pattern.parse_pattern",
            form=_usual_pattern,
        ),
        "How strands go over and under: plain (on every mesh); kagome (plain weave on triangles, "
        "the open basket); twill (2/2, exact where one exists, "
        "else as near as can be found); triaxial (exact on every mesh, which is first subdivided); "
        "or, where warp and weft exist, a twill such as 3/1 (the warp goes over 3 weft threads and "
        "under 1; with a shift, 2/2/1 has its diagonal to the right, 2/2/-1 to the left) or a "
        "satin such as satin:5/2 (repeat, shift).",
        default="plain",
        brief="plain, kagome, twill, triaxial, 3/1, satin:5/2 ...",
    ),
    Option(
        "twists",
        WEAVE,
        place("FILE", "the path of a list of twists"),
        "A weave of your own instead of a pattern: a list of edges and their half-twists, in lines "
        "such as 0,1,-1 (vertices of woven_mesh.obj; 1 is counter-clockwise). inspect --edges "
        "writes one to begin with.",
    ),
    Option(
        "twill_method",
        WEAVE,
        choice(("search", "voting")),
        "How --pattern twill decides where no exact twill exists: search breaks the fewest "
        "conditions; voting is the paper's method, for those who compare.",
        default="search",
    ),
    Option(
        "twill_weights",
        WEAVE,
        text(
            "FACE/VERTEX",
            "two numbers from 0.1 to 10, such as '2/2'",
            "fabweave.weave.twill.conditions.parse_weights",
            form=_tidy_weights,
        ),
        "What a broken face or vertex condition counts where --pattern twill cannot be exact; a "
        "broken edge condition counts 1. More, such as 2/2, keeps diagonals rather than the rhythm "
        "of over two, under two.",
        default="1/1",
    ),
    Option(
        "twill_symmetry",
        WEAVE,
        whole(1, 1000),
        "How many rotations of the mesh --pattern twill must keep at least, with over and under (1 "
        "leaves it free). More make fewer kinds of pieces, but may break more conditions.",
        default=1,
    ),
    Option(
        "boundary",
        WEAVE,
        choice(("end", "turn")),
        "What threads do at the boundary of an open mesh: end there, or turn back as in a plaited "
        "mat, which then has no loose ends.",
        default="end",
        brief="What threads do at a boundary.",
    ),
    Option(
        "course",
        WEAVE,
        choice(("auto", "straight", "projection")),
        "How strands run over faces: straight from the middle of one edge to that of the next; "
        "projection, the paper's way, which covers the surface nearly whole, but bends strands at "
        "every crossing of faces that are not quads; or auto: straight on these faces, projection "
        "on quads.",
        default="auto",
    ),
    Option(
        "material",
        STOCK,
        text(
            "NAME",
            "the name of a material",
            form=_tidy_materials,
        ),
        "fabweave materials lists all. For each bunch its own: "
        "warp=card,weft=birch-veneer, or by number (0=card,1=card,2=birch-veneer) where there are "
        "more than two. What is equal is nested together; card:red and card:blue are not.",
        default="card",
        brief="What it is cut from; fabweave materials lists all.",
    ),
    Option(
        "library",
        STOCK,
        library("material", "fabweave.stock.material"),
        "Materials of your own that --material may name, with the same entries as ours (see "
        "examples/materials.toml); repeat it for several files. An entry called as one of ours "
        "stands in for it.",
        default=(),
        otherwise="materials.toml in the configuration folder, if it is there",
    ),
    Option(
        "thickness",
        STOCK,
        length_by_bunch(100.0),  # as an entry of materials.toml
        "Measured thickness, such as 0.5mm, or by bunch: warp=0.5mm,weft=0.8mm.",
        otherwise="the material's",
        brief="As measured, such as 0.5mm.",
    ),
    Option(
        "width",
        RIBBONS,
        value_of(
            "WIDTH",
            "12mm",
            "fabweave.ribbon.width.parse_width",
            "fabweave.ribbon.width.WidthRule",
            automatic="auto",
        ),
        "Width of the ribbons. even chooses one width for the object, and even,12mm says which; "
        "they are narrower only where there is no room. proportional takes a share of the room "
        "at each place, and 0.5 says which (smaller leaves larger gaps). 12mm is that width even "
        "where ribbons touch; 6mm..14mm or 0.5,6mm..14mm bound it. auto before these, as in "
        "auto,0.5, narrows ribbons where they would come too near to one another.",
        otherwise="even; proportional on a built-in shape",
        brief="even, even,12mm, proportional, 0.5, 12mm ...",
    ),
    Option(
        "smooth",
        RIBBONS,
        whole(0, 50),
        "Cross-lines between two crossings: more make rounder ribbons and outlines, 0 leaves two "
        "flat triangles there.",
        default=3,
    ),
    Option(
        "crossing",
        RIBBONS,
        number(below=1.0),
        "Length of the flat panel at each crossing relative to the room it has; at least the "
        "width.",
        otherwise="0.7, or the width if that is more",
    ),
    Option(
        "clearance",
        RIBBONS,
        length(100.0, zero="0mm"),
        "Air between two layers at a crossing.",
        default="0.1mm",
    ),
)
