"""The options of the machine that cuts, and of what is engraved and printed."""

from collections.abc import Iterable

from fabweave.options.file_kinds import bed, calibration, library, preset
from fabweave.options.kinds import (
    choice,
    flag,
    hairline,
    length,
    load,
    text,
    value_of,
)
from fabweave.options.option import MACHINE, PIECES, Option


def _target_names() -> Iterable[str]:
    return (target.name for target in load("fabweave.sheet.targets.targets")())


#: In the order in which job.toml has them.
CUTTER_OPTIONS = (
    Option(
        "profile",
        MACHINE,
        choice(("maker", "service")),
        "Who cuts: a maker, from the nested sheets; or a service, which wants a file for each "
        "distinct piece with nothing in it but cuts, and a table of quantities: they come besides "
        "the sheets, in the folder service.",
        default="maker",
        making=True,
    ),
    Option(
        "preset",
        MACHINE,
        preset(),
        "Colours of the layers, as a program knows them: {choices}; or a file of your own "
        "(fabweave guide machines shows one), which job.toml then holds.",
        default="lightburn",
        brief="The program of the laser, such as lightburn or glowforge: it sets the colours.",
        making=True,
    ),
    Option(
        "dxf",
        MACHINE,
        choice(("R2010", "R2000", "R12")),
        "Version of the DXF files; R12 for very old machines (it cannot carry units).",
        default="R2010",
        brief="Version of the DXF files; R12 for old machines.",
        making=True,
    ),
    Option(
        "svg_units",
        MACHINE,
        choice(("mm", "px96")),
        "What a coordinate of the SVG counts: millimetres; or pixels of 1/96 inch, for programs "
        "that open the others at a wrong size.",
        default="mm",
        brief="What a coordinate of the SVG counts; px96 for programs that show it too small.",
        making=True,
    ),
    Option(
        "hairline",
        MACHINE,
        hairline(),
        "Width of the lines in the SVG, e.g. 0.1mm or 0.001in, or as a preset has it: drivers cut "
        "thin lines and take thicker ones for pictures.",
        otherwise="the preset's, 0.025mm",
        making=True,
    ),
    Option(
        "target",
        MACHINE,
        text(
            "NAME",
            "one of {choices}, or of your own",
            words=_target_names,
            form=lambda told: told.strip().lower(),
        ),
        "Whose rules for holes, webs, gaps and sizes the pieces are checked against: {choices}; "
        "fabweave targets tells them. The default are rules of practice.",
        default="default",
        making=True,
    ),
    Option(
        "rules",
        MACHINE,
        library("target", "fabweave.sheet.targets"),
        "Rules of those who cut for you, which --target may name, with the same entries as ours "
        "(see examples/targets.toml); repeat it for several files.",
        default=(),
        otherwise="targets.toml in the configuration folder, if it is there",
        making=True,
    ),
    Option(
        "strict",
        MACHINE,
        flag(),
        "Refuse a job that breaks a rule of the material or the target.",
        default=False,
        making=True,
    ),
    Option(
        "force",
        PIECES,
        flag(),
        "Make the job although it cannot be built from its material: sheets and notes then say so.",
        default=False,
        making=True,
        brief="Make the files although it cannot be built.",
    ),
    Option(
        "labels",
        PIECES,
        choice("fabweave.sheet.labels.texts.LABELS"),
        "What is engraved: hidden (id, arrow, joints, who crosses at the ends and at every third "
        "crossing; only where a strand covers it when the object is woven), brief (the same, "
        "wherever there is room), full (all crossings), numbers (the pieces' ids alone), kinds (K3 "
        "on all pieces of kind 3, any of which fits any of their places), or none.",
        default="hidden",
        making=True,
        brief="hidden, brief, full, numbers, kinds or none.",
    ),
    Option(
        "label_side",
        PIECES,
        choice("fabweave.sheet.labels.texts.SIDES"),
        "Which face is engraved; for the inside, which nobody sees, whole sheets are mirrored.",
        default="outside",
        making=True,
    ),
    Option(
        "paper",
        MACHINE,
        choice(("a4", "letter")),
        "Paper of the assembly manual.",
        default="a4",
        brief="Paper of the manual.",
        making=True,
    ),
    Option(
        "kerf",
        MACHINE,
        length(10.0, zero=""),  # as an entry of materials.toml
        "Width of the line that the beam burns: the sheets to cut, with outlines moved outward and "
        "holes inward by half of it, go to the folder cut; those in sheets stay nominal. Leave it "
        "out for services, which take it off themselves.",
        default=0.0,
        otherwise="none taken off",
        brief="Width of the line that the beam burns, such as 0.15mm; empty to take none off.",
        making=True,
    ),
    Option(
        "micro_joints",
        MACHINE,
        value_of(
            "N[:WIDTH]",
            "4:0.3mm",
            "fabweave.sheet.kerf.parse_micro_joints",
            "fabweave.sheet.kerf.MicroJoints",
        ),
        "Leave so many bridges in each outline, 0.25 mm wide unless said, so that pieces stay in "
        "the sheet until they are broken out; in the sheets of the folder cut.",
        otherwise="none",
        making=True,
    ),
    Option(
        "cut_order",
        MACHINE,
        choice(("short", "cool")),
        "Order of the pieces on a sheet: with short ways from one to the next, or cool, where no "
        "piece follows its neighbour, for what warps or melts.",
        default="short",
        brief="Order of the pieces on a sheet; cool for what warps or melts.",
        making=True,
    ),
    Option(
        "template",
        MACHINE,
        choice(("sheet", "a4", "a3", "letter", "none")),
        "Sheets at full size as PDF, to cut by hand: on a page as large as the sheet, or on as few "
        "pages of paper as show all pieces, those whole that fit.",
        default="sheet",
        making=True,
    ),
    Option(
        "qr",
        MACHINE,
        choice(("paper", "none")),
        "The QR code with the command that makes the job again: on the page that opens "
        "the job, and on what of each sheet is not cut.",
        default="paper",
        making=True,
    ),
    Option(
        "calibrate",
        MACHINE,
        calibration(),
        "Multiply the estimated times of the machine, as one job was measured: a number, or the "
        "folder of a finished job and what the machine took for all of its sheets.",
        default=1.0,
        otherwise="1, which is nothing measured",
    ),
    Option(
        "bed",
        MACHINE,
        bed(),
        "The largest sheet that the machine takes, such as 600x400mm. Without --sheet, fabweave "
        "cuts the material's sheet down to it. It refuses larger sheets.",
        otherwise="as large as any sheet",
        brief="The largest sheet that the machine takes, such as 600x400mm; empty for any.",
    ),
)
