"""The options of the machine that cuts, and of what is engraved and printed."""

from collections.abc import Iterable
from functools import partial

from fabweave.options.file_kinds import bed, calibration, library, preset
from fabweave.options.kinds import choice, flag, hairline, length, load, text, value_of
from fabweave.options.option import MACHINE, PIECES, Option

#: What makes the options of a section: they are for making alone, where they do not say otherwise.
_machine = partial(Option, section=MACHINE, making=True)
_pieces = partial(Option, section=PIECES, making=True)


def _target_names() -> Iterable[str]:
    return (target.name for target in load("fabweave.sheet.targets.targets")())


#: In the order in which job.toml has them.
CUTTER_OPTIONS = (
    _machine(
        "profile",
        choice(("maker", "service", "school")),
        "Who cuts. A maker cuts the nested sheets. A service also gets the folder service: a "
        "file for each distinct piece with nothing but cuts, and a table of quantities. For a "
        "school letters are 3 mm high or more, and the manual ends with a sheet for the teacher.",
        default="maker",
    ),
    _machine(
        "preset",
        preset(),
        "Colours of the layers, as a program knows them: {choices}. A file of your own does as "
        "well (fabweave guide machines shows one), and job.toml keeps it.",
        default="lightburn",
        brief="The program of the laser, such as lightburn or glowforge: it sets the colours.",
    ),
    _machine(
        "dxf",
        choice(("R2010", "R2000", "R12")),
        "Version of the DXF files. R12 is for very old machines, and cannot carry units.",
        default="R2010",
        brief="Version of the DXF files; R12 for old machines.",
    ),
    _machine(
        "svg_units",
        choice(("mm", "px96")),
        "What a coordinate of the SVG counts: millimetres, or pixels of 1/96 inch, for programs "
        "that open the others at a wrong size.",
        default="mm",
        brief="What a coordinate of the SVG counts; px96 for programs that show it too small.",
    ),
    _machine(
        "hairline",
        hairline(),
        "Width of the lines in the SVG, e.g. 0.1mm or 0.001in, or the name of a preset. Drivers "
        "cut thin lines, and take thicker ones for pictures.",
        otherwise="the preset's, 0.025mm",
    ),
    _machine(
        "target",
        text(
            "NAME",
            "one of {choices}, or of your own",
            words=_target_names,
            form=lambda told: told.strip().lower(),
        ),
        "Whose rules for holes, webs, gaps and sizes the pieces are checked against: {choices}. "
        "fabweave targets shows them; the default are rules of practice.",
        default="default",
    ),
    _machine(
        "rules",
        library("target", "fabweave.sheet.targets"),
        "A file with the rules of those who cut for you, which --target then takes (see "
        "examples/targets.toml). Repeat it for several files.",
        default=(),
        otherwise="targets.toml in the configuration folder, if it is there",
    ),
    _machine(
        "strict",
        flag(),
        "Refuse a job that breaks a rule of the material or the target.",
        default=False,
    ),
    _pieces(
        "force",
        flag(),
        "Make the job although it cannot be built from its material. Sheets and notes then say so.",
        default=False,
        brief="Make the files although it cannot be built.",
    ),
    _pieces(
        "labels",
        choice("fabweave.sheet.labels.texts.LABELS"),
        "What is engraved. hidden: id, arrow, step, joints, and a tick and who crosses wherever a "
        "strand passes over, only where it covers them in the woven object. brief: who crosses at "
        "the ends and at every third crossing, wherever there is room. full: all crossings. "
        "numbers: only the ids. kinds: K3 on all pieces of kind 3, each of which fits any of "
        "their places. none: nothing.",
        default="hidden",
        brief="hidden, brief, full, numbers, kinds or none.",
    ),
    _pieces(
        "label_side",
        choice("fabweave.sheet.labels.texts.SIDES"),
        "Which face is engraved. For the inside, which nobody sees, fabweave mirrors whole sheets.",
        default="outside",
    ),
    _machine(
        "paper",
        choice(("a4", "letter")),
        "Paper of the assembly manual.",
        default="a4",
        brief="Paper of the manual.",
        typed="manual-paper",  # verify has --papers
    ),
    _machine(
        "sticks",
        choice(("a4", "letter", "a3", "roll", "none")),
        "Paper of the story sticks of straight strips: tapes at full size with all marks, one for "
        "each kind of strip. Tapes longer than the paper come in lengths to be glued; roll is for "
        "a plotter, which prints them whole.",
        otherwise="the manual's paper",
    ),
    _machine(
        "kerf",
        length(10.0, zero=""),  # as an entry of materials.toml
        "Width of the line that the beam burns. The folder cut then has the sheets to cut, with "
        "outlines moved outward and holes inward by half of it. Those in sheets stay nominal. "
        "Leave it out for services, which take it off themselves.",
        default=0.0,
        otherwise="none taken off",
        brief="Width of the line that the beam burns, such as 0.15mm; empty to take none off.",
    ),
    _machine(
        "micro_joints",
        value_of(
            "N[:WIDTH]",
            "4:0.3mm",
            "fabweave.sheet.kerf.parse_micro_joints",
            "fabweave.sheet.kerf.MicroJoints",
        ),
        "Leave so many bridges in each outline, 0.25 mm wide by default, which hold pieces in "
        "the sheet until you break them out. Only the sheets in the folder cut have them.",
        otherwise="none",
    ),
    _machine(
        "cut_order",
        choice(("short", "cool")),
        "Order of the pieces on a sheet. short keeps the ways between them short. cool lets no "
        "piece follow its neighbour, for what warps or melts.",
        default="short",
        brief="Order of the pieces on a sheet; cool for what warps or melts.",
    ),
    _machine(
        "template",
        choice(("sheet", "a4", "a3", "letter", "none")),
        "Sheets at full size as PDF, to cut by hand. sheet makes a page as large as the sheet. "
        "a4, a3 and letter part it into pages of paper, with crosses to lay on one another.",
        default="sheet",
    ),
    _machine(
        "calibrate",
        calibration(),
        "Multiply the estimated times of the machine, as you measured one job. Write a number, or "
        "the folder of a finished job and the time for all its sheets, as in torus:95min.",
        default=1.0,
        otherwise="nothing measured",
        making=False,
    ),
    _machine(
        "bed",
        bed(),
        "The largest sheet that the machine takes, such as 600x400mm. Without --sheet, fabweave "
        "cuts the material's sheet down to it. It refuses larger sheets.",
        otherwise="as large as any sheet",
        brief="The largest sheet that the machine takes, such as 600x400mm; empty for any.",
        making=False,
    ),
)
