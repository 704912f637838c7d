"""Print the options of a command under headings, in the order in which a person decides them."""

import click

#: What a job is asked, station by station. Options that are not named here come last.
SECTIONS = {
    "Mesh": ("config", "up", "size", "scale", "remesh", "refine", "fair"),
    "Weave": ("pattern", "boundary", "colours"),
    "Ribbons": ("material", "thickness", "width", "smooth", "crossing", "clearance"),
    "Pieces and sheets": ("max_length", "joint", "lap", "hole", "slots", "sheet", "margin", "gap"),
    "Search": ("effort", "seed", "layout"),
    "Files for the cutter": (
        "profile",
        "preset",
        "dxf",
        "svg_units",
        "hairline",
        "kerf",
        "micro_joints",
        "cut_order",
        "template",
        "target",
        "strict",
        "labels",
        "label_side",
    ),
}
REST = "Output"


class SectionedCommand(click.Command):
    """A command whose help lists its options in sections."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each section that has options, and the rest."""
        home = {name: title for title, names in SECTIONS.items() for name in names}
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in (*SECTIONS, REST)}
        for parameter in self.get_params(ctx):
            # Newer versions of click have a line for arguments, too; the text above names those.
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is not None:
                rows[home.get(parameter.name or "", REST)].append(record)
        for title, records in rows.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)
