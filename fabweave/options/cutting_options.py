"""Name the options that decide what is cut, and the files: pieces, sheets, search and drawings."""

from fabweave.options.file_kinds import layout, sheets, stock_list
from fabweave.options.kinds import (
    MOST_MM,
    MOST_WHOLE,
    choice,
    length,
    length_by_bunch,
    load,
    text,
    whole,
)
from fabweave.options.option import PIECES, SEARCH, STOCK, Option

#: No side of a sheet is longer.
_LONGEST_SHEET_MM = 20_000.0


#: In the order in which job.toml has them.
CUTTING_OPTIONS = (
    Option(
        "max_length",
        PIECES,
        length(MOST_MM, automatic="auto", metavar="LENGTH|auto"),
        "No piece is longer along its middle; or auto: threads are cut to several lengths for a "
        "trial, and the one that serves best (--prefer) is taken.",
        otherwise="auto",
    ),
    Option(
        "prefer",
        PIECES,
        choice("fabweave.piece.split.preferences.PREFERENCES"),
        "What --max-length auto saves: work (hours of cutting and joining), waste (whole sheets, "
        "then joints), or balanced, the sum of sheets, fasteners and hours in money, by the rates "
        "that fabweave guide pieces lists.",
        default="balanced",
    ),
    Option(
        "kinds",
        PIECES,
        choice("fabweave.piece.split.preferences.KIND_PRICES"),
        "How many different pieces there may be on an object that looks the same from several "
        "sides, or in many places: fewest (threads that repeat one another are cut alike, into as "
        "few kinds as can be), auto (the same, but no kind is saved that costs more than four "
        "joints), or any (each thread is cut as is best for it alone).",
        default="auto",
    ),
    Option(
        "spares",
        PIECES,
        text(
            "SHARE|N",
            "a text such as '5%'",
            "fabweave.piece.congruence.parse_spares",
            form=lambda told: str(load("fabweave.piece.congruence.usual_spares")(told)),
        ),
        "Cut some pieces of each kind once more, in case one breaks: a share of its pieces such as "
        "5%, rounded up, so that there is one of each kind at least; or 2 of each. They lie on the "
        "sheets with the others, and bear the id of the first of their kind with S1, S2 ... (K3 as "
        "all of kind 3, with --labels kinds).",
        otherwise="none",
        making=True,
    ),
    Option(
        "fastener",
        PIECES,
        text(
            "NAME|LENGTH|none",
            "the name of a fastener such as 'screw-m3', a hole such as '3.3mm', or none",
            "fabweave.stock.hardware.parse_fastener",
            form=lambda told: "".join(told.lower().split()),
        ),
        "What holds crossings: a fastener such as screw-m3, or M3 (fabweave guide fasteners has "
        "all), whose hole is cut and whose head keeps off the edges; a hole such as 3.3mm, for "
        "any that fits; both as in screw-m3,3.4mm; or none, without any holes.",
        otherwise="the largest that are sold and that the ribbons have room for, in few sizes",
        making=True,
    ),
    Option(
        "holes",
        PIECES,
        choice(("fastened", "alike", "all")),
        "Which crossings have holes: fastened, those that take a fastener; alike, those at the "
        "same places of pieces that repeat, too, so that there are fewer kinds; or all, to lay "
        "pieces by.",
        otherwise="alike with --labels kinds, --kinds fewest or --profile service, else fastened",
        making=True,
    ),
    Option(
        "fasten",
        PIECES,
        text(
            "WHICH",
            "a text such as 'every:2'",
            "fabweave.piece.joint.fastening.parse_fastening",
            form=lambda told: told.strip().lower(),
        ),
        "Which crossings take a fastener: joints; loose, the joints and more crossings the looser "
        "the weave is; all; rim, the joints and the crossings next to the boundary; every:2, the "
        "joints and one crossing of two; or none, and joints are glued.",
        otherwise="loose, or all with --joint rivet,slots (fabweave guide fasteners)",
        making=True,
        brief="Fasteners at: joints, loose, rim, all, every:2, none.",
    ),
    Option(
        "hang",
        PIECES,
        text(
            "WHERE",
            "a text such as 'top' or 'bottom:3'",
            "fabweave.piece.joint.fastening.parse_hanging",
            form=lambda told: "".join(told.lower().split()),
        ),
        "Crossings that carry something, and take a hole and a fastener for it: top (a cord or a "
        "hook at the topmost), bottom:3 (three feet around the middle), or numbers of crossings, "
        "with commas. The map marks them, and notes name them.",
        making=True,
    ),
    Option(
        "joint",
        PIECES,
        text(
            "KIND",
            "a text such as 'rivet:2,lap=30mm'",
            "fabweave.piece.joint.kinds.parse_joint",
            form=lambda told: "".join(told.lower().split()),
        ),
        "How pieces of one thread are joined: rivet (a lap with a fastener under the strand "
        "above), rivet:2 to rivet:4 (so many), glue (a lap with marks to lay it by), dovetail (a "
        "tongue in a socket, flush), slot (a tab through a slot), or none (end to end, taped). A "
        "comma, then lap=30mm says how far pieces lap (at most to the crossings beside), and "
        "slots cuts slots in place of holes in the strand that lies under, where it has no joint: "
        "they take up small errors.",
        default="rivet",
        brief="rivet, rivet:2, glue, dovetail, slot or none.",
    ),
    Option(
        "sheet",
        STOCK,
        sheets(),
        "Sheet stock, e.g. 600x400mm, or 24x18in:3 for three of them; repeat it for several sizes. "
        "For one bunch only: weft=600x400mm. mat-12x12 and mat-12x24 are what knife plotters cut "
        "of a mat.",
        default=(),
        otherwise="the material's",
        holder="sheets",
        brief="Sheet size and number, such as 600x400mm:3.",
    ),
    Option(
        "stock",
        STOCK,
        stock_list(),
        "A list of the stock (stock.toml): sheets with quantity, price, grain, material and "
        "defects, and offcuts with their outlines. Offcuts are used first, the smallest first; "
        "then the sheets that cost least for their area; sheets without a price, and those of "
        "--sheet, come last. The last sheet is exchanged for the cheapest that takes its pieces.",
        holder="sheets",
        brief="List of sheets and offcuts (stock.toml).",
    ),
    Option(
        "margin",
        STOCK,
        length(_LONGEST_SHEET_MM, zero="0mm"),
        "Border of each sheet that stays empty.",
        default="10mm",
    ),
    Option(
        "gap",
        STOCK,
        length_by_bunch(1000.0, zero="0mm"),  # as an entry of materials.toml
        "Least distance between pieces, or by bunch: warp=2mm,weft=4mm.",
        otherwise="the material's",
        making=True,
    ),
    Option(
        "rotations",
        STOCK,
        text(
            "RULE",
            "a text such as 'grain:5deg' or 'across:10deg'",
            "fabweave.stock.rotations.parse_rotations",
            form=lambda told: "".join(told.lower().replace("°", "deg").split()),
        ),
        "At which angles pieces stand on a sheet: free; 90 or 180 (multiples of that, from the "
        "grain on); grain:5deg (their length along the grain, up to 5 degrees off) or across:10deg "
        "(across it: so plywood bends better). auto is free, or across:10deg where bends ask for "
        "that. Grain runs along a sheet's width unless the list of stock says otherwise.",
        default="auto",
    ),
    Option(
        "effort",
        SEARCH,
        choice(("quick", "normal", "best")),
        "How long to search: for layouts that save material, and for the best twill where none is "
        "exact.",
        default="normal",
        brief="Search for dense sheets: quick, normal, best.",
    ),
    Option(
        "seed",
        SEARCH,
        whole(0, MOST_WHOLE),
        "Of all random choices: same seed, same settings, same files.",
        default=0,
        brief="Same seed, same settings, same files.",
    ),
    Option(
        "layout",
        SEARCH,
        layout(),
        "Take the layout that the crossing_map.json of a finished job records, not a new one; the "
        "pieces must be the same.",
        making=True,
    ),
    Option(
        "colours",
        PIECES,
        choice("fabweave.weave.strand_colours.STRATEGIES"),
        "Colours in model.glb, pictures, viewer and manual. material: its own, in a light and a "
        "dark tone where it crosses itself; a name such as card:white sets it. Sheets know no "
        "tones. safe: one a bunch, told apart by the colour-blind, or changing at joints where a "
        "thread crosses itself. direction: warp and weft, or three. piece: each another. bunch: a "
        "hue each. hue-circle and hue-range: one for each thread.",
        default="material",
        brief="Colours of pictures, viewer and manual.",
    ),
)
