"""Name the options that decide what is cut, and the files: pieces, sheets, search and drawings."""

from functools import partial

from fabweave.options.file_kinds import layout, sheets, stock_list
from fabweave.options.kinds import (
    MOST_MM,
    MOST_WHOLE,
    choice,
    later,
    length,
    length_by_bunch,
    text,
    whole,
)
from fabweave.options.option import PIECES, SEARCH, STOCK, Option

#: What makes the options of a section; of pieces, those for making alone are apart.
_pieces, _stock = partial(Option, section=PIECES), partial(Option, section=STOCK)
_search, _making = partial(Option, section=SEARCH), partial(_pieces, making=True)

#: No side of a sheet is longer.
_LONGEST_SHEET_MM = 20_000.0


#: In the order in which job.toml has them.
CUTTING_OPTIONS = (
    _pieces(
        "max_length",
        length(MOST_MM, automatic="auto", metavar="LENGTH|auto"),
        "No piece is longer along its middle. auto cuts threads to several lengths for a trial, "
        "and takes the best by --prefer.",
        otherwise="auto",
    ),
    _pieces(
        "prefer",
        choice("fabweave.piece.split.preferences.PREFERENCES"),
        "What --max-length auto saves: work (hours of cutting and joining) or waste (whole "
        "sheets, then joints). balanced sums up sheets, fasteners and hours in money, by the "
        "rates in fabweave guide pieces. Straight strips are cut so that they fill rows, unless "
        "work is to be saved.",
        default="balanced",
    ),
    _pieces(
        "kinds",
        choice("fabweave.piece.split.preferences.KIND_PRICES"),
        "How many different pieces an object has that looks the same from several sides. fewest "
        "cuts threads that repeat one another alike. auto does the same, but saves no kind that "
        "costs more than four joints. any cuts each thread as is best for it alone.",
        default="auto",
    ),
    _making(
        "spares",
        text(
            "SHARE|N",
            "a text such as '5%'",
            "fabweave.piece.congruence.parse_spares",
            form=later("fabweave.piece.congruence.usual_spares"),
        ),
        "Cut some pieces of each kind once more, in case one breaks: a share such as 5%, "
        "rounded up to one at least, or 2 of each. They lie on the sheets with the others. They "
        "bear the id of the first of their kind and S1, S2 ... (with --labels kinds, K3 as the "
        "others of kind 3).",
        otherwise="none",
    ),
    _making(
        "fastener",
        text(
            "NAME|LENGTH|none",
            "the name of a fastener such as 'screw-m3', a hole such as '3.3mm', or none",
            "fabweave.stock.hardware.parse_fastener",
            form=lambda told: "".join(told.lower().split()),
        ),
        "What holds crossings. screw-m3, or M3, cuts the hole for it and keeps its head off the "
        "edges; fabweave guide fasteners lists all. A hole such as 3.3mm takes anything that fits, "
        "screw-m3,3.4mm says both, and none cuts no holes.",
        otherwise="the largest that are sold and that the ribbons have room for, in few sizes",
    ),
    _making(
        "holes",
        choice(("fastened", "alike", "all")),
        "Which crossings have holes. fastened: those that take a fastener. alike: those at the "
        "same places of repeated pieces, too, for fewer kinds. all: every crossing, to lay "
        "pieces by.",
        otherwise="alike",
    ),
    _making(
        "fasten",
        text(
            "WHICH",
            "a text such as 'every:2'",
            "fabweave.piece.joint.fastening.parse_fastening",
            form=lambda told: "".join(told.lower().split()),
        ),
        "Which crossings take a fastener. joints: only these. form: joints, ends of threads, and "
        "as few more as keep the form within 1 % of the size; form:3mm within 3 mm. rim: joints, "
        "and crossings next to the boundary. every:2: joints, and one crossing of two. all: every "
        "crossing. glue: joints, and glue at all others. none: no crossing, so glue the joints. "
        "Numbers of crossings may follow, which take one besides: form,12,40.",
        otherwise="form, or all with --joint rivet,slots (fabweave guide fasteners)",
        brief="Fasteners at: joints, form, rim, all, glue, every:2.",
    ),
    _making(
        "former",
        text(
            "MATERIAL",
            "auto, or the name of a material such as 'birch-ply-3'",
            form=lambda told: told.strip().lower(),
        ),
        "Cut a former, too: slotted plates of the inside that strips are laid on, with the name "
        "of each strip where it passes. It is of this material; auto is the job's own from "
        "1.2 mm on, or else museum-board. The folder former has it.",
    ),
    _making(
        "hang",
        text(
            "WHERE",
            "a text such as 'top' or 'bottom:3'",
            "fabweave.piece.joint.fastening.parse_hanging",
            form=lambda told: "".join(told.lower().split()),
        ),
        "Crossings that carry something, and take a hole and a fastener for it. top is a cord "
        "or a hook at the topmost, and bottom:3 three feet around the middle. Numbers of "
        "crossings, with commas, do as well. The map marks them, and notes name them.",
    ),
    _making(
        "load",
        text(
            "MASS@WHERE",
            "a text such as '200g@top' or '1.5kg@bottom:3'",
            "fabweave.piece.joint.fastening.parse_load",
            form=lambda told: "".join(told.lower().split()),
        ),
        "What it carries, a bulb or fruit: a mass in g, kg, oz or lb, and which crossings bear it, "
        "as --hang names them. The verdict says how far it sags, and --fasten form bears it.",
    ),
    _making(
        "base",
        choice(("on", "off")),
        "on ties the feet of an open object, the crossings beside its rim at the ground, to a "
        "board of plywood or the like: so it neither spreads nor falls. base.dxf and base.svg are "
        "the board at true size, with two holes for a wire at each foot. Where fabweave chooses "
        "the mesh, it takes a base for what goes far or falls without.",
        otherwise="off",
    ),
    _making(
        "as_drawn",
        choice(("on", "off")),
        "on cuts strips so that the object comes out as the model is: what it would settle by, and "
        "sag under its weight and --load, is taken back before. off cuts them as they lie on the "
        "model, as fabweave always does with straight strips, and on a former.",
        default="on",
    ),
    _pieces(
        "joint",
        text(
            "KIND",
            "a text such as 'rivet:2,lap=30mm'",
            "fabweave.piece.joint.kinds.parse_joint",
            form=lambda told: "".join(told.lower().split()),
        ),
        "How pieces of one thread are joined. rivet is a lap with a fastener under the strand "
        "above, and rivet:2 to rivet:4 take more. glue is a lap with marks. tuck is a lap over "
        "three crossings that the weave holds. dovetail is a tongue in a socket, flush. slot is a "
        "tab through a slot. none is end to end, taped. lap=30mm after a comma sets how far pieces "
        "lap, at most to the crossings beside. slots after a comma cuts slots for holes in the "
        "strand below, where it has no joint; they take up small errors.",
        default="rivet",
        brief="rivet, rivet:2, glue, tuck, dovetail, slot or none.",
    ),
    _stock(
        "sheet",
        sheets(),
        "Sheet stock, e.g. 600x400mm, or 24x18in:3 for three of them. Repeat it for several "
        "sizes. weft=600x400mm is for one bunch only. mat-12x12 and mat-12x24 are what knife "
        "plotters cut of a mat.",
        default=(),
        otherwise="the material's",
        holder="sheets",
        brief="Sheet size and number, such as 600x400mm:3.",
    ),
    _stock(
        "stock",
        stock_list(),
        "A list of your stock (stock.toml): sheets with quantity, price, grain, material and "
        "defects, and offcuts with their outlines. Or a roll, such as roll:12mm:50m: width, length "
        "and, as in roll:12mm:50m:3, how many; --strips straight cuts strips from it that are as "
        "wide. Repeat it for several lists and rolls. A list may also set options of this section, "
        "such as margin and gap. fabweave takes offcuts first, the smallest first. Then it "
        "takes the sheets that cost least for their area; sheets without a price, and those of "
        "--sheet, come last. It exchanges the last sheet for the cheapest that takes its "
        "pieces.",
        holder="sheets",
        brief="List of sheets and offcuts (stock.toml), or a roll such as roll:12mm:50m.",
    ),
    _stock(
        "margin",
        length(_LONGEST_SHEET_MM, zero="0mm"),
        "Border of each sheet that stays empty.",
        default="10mm",
    ),
    _stock(
        "gap",
        length_by_bunch(1000.0, zero="0mm"),  # as an entry of materials.toml
        "Least distance between pieces, or by bunch: warp=2mm,weft=4mm.",
        otherwise="the material's",
        making=True,
    ),
    _stock(
        "rotations",
        text(
            "RULE",
            "a text such as 'grain:5deg' or 'across:10deg'",
            "fabweave.stock.rotations.parse_rotations",
            form=lambda told: "".join(told.lower().replace("°", "deg").split()),
        ),
        "At which angles pieces stand on a sheet. free allows any; 90 or 180 allow multiples of "
        "that, from the grain on. grain:5deg lays their length along the grain, up to 5 degrees "
        "off, and across:10deg across it, where plywood bends better. auto is free, or "
        "across:10deg where bends need that. Grain runs along the width of a sheet unless the "
        "list of stock says otherwise.",
        default="auto",
    ),
    _search(
        "effort",
        choice(("quick", "normal", "best")),
        "How long to search for layouts that save material, and for the best twill where none "
        "is exact.",
        default="normal",
        brief="Search for dense sheets: quick, normal, best.",
    ),
    _search(
        "seed",
        whole(0, MOST_WHOLE),
        "Start of all random choices: same seed, same settings, same files.",
        default=0,
        brief="Same seed, same settings, same files.",
    ),
    _search(
        "layout",
        layout(),
        "Take the layout in the crossing_map.json of a finished job, not a new one. The pieces "
        "must be the same.",
        making=True,
    ),
    _search(
        "pin",
        text(
            "ID@SHEET:X,Y,DEG",
            "pieces with their places, such as 'A3@1:120,40,90'",
            "fabweave.nest.pins.parse_pins",
            form=lambda told: "".join(told.split()),
        ),
        "Pieces that stay where you put them: sheet, x and y in millimetres and degrees, as "
        "crossing_map.json tells placements, with / between several. The others are nested around "
        "them. In the studio, drag a piece on its sheet.",
        making=True,
    ),
    _pieces(
        "colours",
        choice("fabweave.weave.strand_colours.STRATEGIES"),
        "Colours in model.glb, pictures, viewer and manual. material: its own, in a light and a "
        "dark tone where it crosses itself; card:white sets it. Sheets have no tones. safe: one "
        "for each bunch, which the colour-blind tell apart, or changing at joints where a "
        "thread crosses itself. direction: warp and weft, or three. piece: a colour each. "
        "bunch: a hue each. hue-circle and hue-range: one for each thread.",
        default="material",
        brief="Colours of pictures, viewer and manual.",
    ),
)
