"""Name the options that decide the woven object: its mesh, its weave and its ribbons."""

from functools import partial

from fabweave.options.file_kinds import leave_out, library
from fabweave.options.kinds import (
    MOST_MM,
    choice,
    flag,
    later,
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

#: What makes the options of a section.
_mesh, _weave = partial(Option, section=MESH), partial(Option, section=WEAVE)
_stock, _ribbons = partial(Option, section=STOCK), partial(Option, section=RIBBONS)


#: In the order in which job.toml has them.
OBJECT_OPTIONS = (
    _mesh(
        "mesh",
        place("MESH", "a file, or a shape such as shape:torus?m=24&n=12"),
        "What is woven: an OBJ, OFF, PLY, STL, GLB or 3MF file, or a built-in shape.",
        brief="OBJ, OFF, PLY, STL, GLB or 3MF file, or shape:NAME.",
        holder="source",
    ),
    _mesh(
        "title",
        line("NAME", "a line of text of at most 80 characters"),
        "The name of the object, such as Fruit bowl. The manual, the viewer, the pages and the "
        "margins of the sheets show it.",
        otherwise="made of the name of the mesh",
    ),
    _mesh(
        "up",
        text(
            "AXIS|X,Y,Z",
            "an axis such as y, or a direction such as 0.2,-1,0.1",
            words=lambda: load("fabweave.mesh.upright.AXES"),
            form=later("fabweave.mesh.upright.parse_up"),
        ),
        "What of the mesh points up: {choices}, or a direction in the file's coordinates, such as "
        "0.2,-1,0.1. fabweave turns the mesh so that it becomes z; make and inspect say what they "
        "guess.",
        otherwise="y or z, guessed from base and symmetry, z if unsure; y for GLB and glTF",
        brief="Axis or direction of the mesh that points up.",
    ),
    _mesh(
        "weld",
        text(
            "all|none|LENGTH",
            "all, none or a length such as 0.01mm",
            "fabweave.mesh.weld.parse_weld",
        ),
        "Merge vertices at the same place into one: all, none, or those within a length of the "
        "finished object. Programs split vertices where normals or textures change, and nothing "
        "is woven across the loose faces. fabweave always merges STL, GLB and 3MF.",
        otherwise="where two edges of the boundary lie on one another",
    ),
    _mesh(
        "bodies",
        text(
            "all|largest|N|join|wrap",
            "all, largest, join, wrap or a whole number",
            "fabweave.mesh.bodies.parse_bodies",
        ),
        "Which bodies of the mesh to keep: all, the largest, or the N largest by the diagonals "
        "of their bounding boxes. join makes one surface of closed bodies that run into one "
        "another. wrap lays a closed surface around everything, however open or broken its "
        "parts are.",
        default="all",
        brief="all, largest, N, join or wrap.",
    ),
    _mesh(
        "walls",
        choice(("auto", "outside", "both")),
        "Which sides of a thin wall to weave. auto weaves the outside alone where a solid is a "
        "thin wall, as vases, lampshades and bowls to be printed are, and leaves out what lies "
        "inside. outside takes thicker walls, too. both weaves all that is there.",
        default="auto",
        brief="Sides of a thin wall: auto, outside, both.",
    ),
    _mesh(
        "size",
        length(MOST_MM, least=0.01),
        "Scale the mesh so that its largest dimension is this, e.g. 400mm or 16in. Without it, "
        "the numbers of the mesh are millimetres.",
        brief="Largest dimension of the object, such as 400mm.",
    ),
    _mesh(
        "remesh",
        text(
            "none|KIND[:N]",
            "a text such as 'quads:3000'",
            "fabweave.mesh.remesh.request.parse_remesh",
        ),
        "Make a coarser mesh first, of about N faces. quads:N suits twill; without N, there are "
        "at most 3000. tubes:N lays quads along limbs and around them, grid:N rows and "
        "columns over a disc, tube or torus, rings:N rings that have an exact twill. triangles:N "
        "suits triaxial weaves, and keeps horns and limbs. coarse:N undoes a subdivision. none "
        "keeps the mesh as it is.",
        otherwise="none; make takes a coarser mesh where this one cannot be built",
        brief="A new mesh first: quads:N, rings:N, grid:N, tubes:N, triangles:N, coarse:N.",
    ),
    _mesh(
        "refine",
        text(
            "SCHEME:STEPS",
            "a text such as 'catmull-clark:2'",
            "fabweave.mesh.subdivide.parse_refinements",
        ),
        "Refine the mesh first, e.g. catmull-clark:2, or simplest:1,catmull-clark:1. These "
        "schemes round the shape: catmull-clark, doo-sabin, simplest, loop. These keep it: "
        "mid-edge, quads.",
        brief="Refine the mesh, such as catmull-clark:1.",
    ),
    _mesh(
        "symmetrise",
        flag(),
        "Make a mesh exactly symmetric if noise of at most 2 % of its size spoils it. Few kinds "
        "of pieces are then enough. The notes say how far vertices move.",
        default=False,
    ),
    _mesh(
        "fair",
        whole(0, 1000),
        "Move the vertices in so many steps. Strands then run straighter, ribbons are more even, "
        "and the mesh stays near the model. 0 leaves them where they are. By default 12 where the "
        "mesh was remeshed, else none.",
    ),
    _mesh(
        "leave_out",
        leave_out(),
        "Leave out faces, for a bulb, an arm or a pot. top:80mm or bottom:80mm opens the mesh "
        "there, and lays the rim onto a circle of that diameter. Numbers such as 12,13, or a "
        "file of them, name faces of the woven mesh, counted from 0. Threads end at the rim, or "
        "turn back (--boundary). --size counts as before.",
    ),
    _mesh(
        "rim",
        choice(("none", "ring", "double")),
        "ring lays a ring along each rim of an open mesh, and of --leave-out, over the ends of "
        "the strips. double lays one inside, too. Pieces R1, R2 ... are in the folder rim. The "
        "fasteners of the crossings beside the rim go through them.",
        default="none",
    ),
    _weave(
        "pattern",
        text(
            "PATTERN",
            "a text such as 'twill' or '3/1'",
            "fabweave.weave.weave_pattern.parse_pattern",
            form=later("fabweave.weave.weave_pattern.parse_pattern"),
        ),
        "How strands go over and under. plain and kagome (plain on triangles, the open basket) "
        "need nothing. twill is exact where it can be, and else as near as fabweave finds. "
        "triaxial is exact on every mesh, which it subdivides first. Where warp and weft exist, "
        "3/1 is a twill over 3 and under 1. 2/2/1 has its diagonal to the right, 2/2/-1 to the "
        "left. satin:5/2 is a satin (repeat, shift).",
        default="plain",
        brief="plain, kagome, twill, triaxial, 3/1, satin:5/2 ...",
    ),
    _weave(
        "twists",
        place("FILE", "the path of a list of twists"),
        "A weave of your own: a list of edges and their half-twists, in lines such as 0,1,-1. "
        "The first two are vertices of woven_mesh.obj, and 1 is counter-clockwise. inspect "
        "--edges writes a list to begin with.",
    ),
    _weave(
        "twill_method",
        choice(("search", "voting")),
        "How --pattern twill decides where no exact twill exists. search breaks the fewest "
        "conditions; voting is the method of the paper, for comparison.",
        default="search",
    ),
    _weave(
        "twill_weights",
        text(
            "FACE/VERTEX",
            "two numbers from 0.1 to 10, such as '2/2'",
            "fabweave.weave.twill.conditions.parse_weights",
            form=later("fabweave.weave.twill.conditions.tidy_weights"),
        ),
        "What a broken face or vertex condition counts where --pattern twill is not exact; a "
        "broken edge condition counts 1. More, such as 2/2, keeps diagonals rather than the "
        "rhythm of over two, under two.",
        default="1/1",
    ),
    _weave(
        "boundary",
        choice(("auto", "end", "turn")),
        "What threads do at the boundary of an open mesh. They end there, or they turn back as "
        "in a plaited mat, which has no loose ends. auto turns them, but where strips are "
        "straight, a ring lies over their ends, warp and weft are apart, or a face has no room.",
        default="auto",
        brief="What threads do at a boundary.",
    ),
    _weave(
        "course",
        choice(("auto", "straight", "projection")),
        "How strands run over faces. straight goes from the middle of one edge to the next. "
        "projection, the way of the paper, covers more of the surface, but bends strands at "
        "crossings of faces that are not quads. auto takes projection on quads, and straight "
        "elsewhere, less so where most faces are quads.",
        default="auto",
    ),
    _stock(
        "material",
        text(
            "NAME",
            "the name of a material",
            form=later("fabweave.stock.supplies.tidy_materials"),
        ),
        "What the object is cut from; fabweave materials lists all. warp=card,weft=birch-veneer "
        "names one for each bunch, and so do numbers (0=card,1=card,2=birch-veneer). fabweave "
        "nests equal materials together, but keeps card:red and card:blue apart.",
        default="card",
        brief="What it is cut from; fabweave materials lists all.",
    ),
    _stock(
        "library",
        library("material", "fabweave.stock.material"),
        "A file of your own materials, which --material then takes (see "
        "examples/materials.toml). Repeat it for several files. An entry with the name of one "
        "of ours takes its place.",
        default=(),
        otherwise="materials.toml in the configuration folder, if it is there",
    ),
    _stock(
        "thickness",
        length_by_bunch(100.0),  # as an entry of materials.toml
        "Measured thickness, such as 0.5mm, or by bunch: warp=0.5mm,weft=0.8mm.",
        otherwise="the material's",
        brief="As measured, such as 0.5mm.",
    ),
    _ribbons(
        "width",
        value_of(
            "WIDTH",
            "12mm",
            "fabweave.ribbon.width.parse_width",
            "fabweave.ribbon.width.WidthRule",
            automatic="auto",
        ),
        "Width of the ribbons. even chooses one width for the object, and even,12mm sets it; "
        "ribbons are narrower only where they have no room. proportional takes a share of the "
        "room at each place, and 0.5 sets that share. 12mm is that width even where ribbons "
        "touch; 6mm..14mm or 0.5,6mm..14mm bound it. auto before these, as in auto,0.5, narrows "
        "ribbons that come too near to one another.",
        otherwise="even; proportional on a built-in shape",
        brief="even, even,12mm, proportional, 0.5, 12mm ...",
    ),
    _ribbons(
        "strips",
        choice(("wavy", "straight")),
        "Shape of the strips. wavy strips unfold exactly from the model. straight strips are "
        "rectangles of one width, from sheets or from a roll: the object is the nearest to the "
        "model that such strips make, and fabweave says how near that is. Choose them with "
        "triangles and --pattern kagome or triaxial.",
        default="wavy",
        brief="wavy, or straight: rectangles of one width.",
    ),
    _ribbons(
        "smooth",
        whole(0, 50),
        "Cross-lines between two crossings. More of them make rounder ribbons and outlines; 0 "
        "leaves two flat triangles there.",
        default=3,
    ),
    _ribbons(
        "crossing",
        number(below=1.0),
        "Length of the flat panel at each crossing relative to its room. It is at least the width; "
        "ribbons of one width have panels no longer than what they cross is wide.",
        otherwise="0.7, or the width if that is more",
    ),
    _ribbons(
        "clearance",
        length(100.0, zero="0mm"),
        "Air between two layers at a crossing.",
        default="0.1mm",
    ),
)
