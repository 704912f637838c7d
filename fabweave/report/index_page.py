"""Open a job with one page: what it is, and all its files in the order in which they are needed."""

import html
from collections.abc import Collection, Iterator, Sequence

from fabweave.core.arrays import frozen_value
from fabweave.core.messages import agree
from fabweave.flat.crossing_map import CrossingMap
from fabweave.flat.file_records import WeaveRecord
from fabweave.report.charts import charts
from fabweave.report.costs.costs import Costs
from fabweave.report.costs.money import price_text
from fabweave.report.costs.texts import hours_text, time_text
from fabweave.report.verdict import Verdict
from fabweave.report.waste import WasteReport
from fabweave.report.waste_page import verdict_section

#: Where the page stands in a job's folder.
INDEX_FILE = "index.html"

_STYLE = """
body { font: 18px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 62rem;
  padding: 0 1rem; color: #1b1b1b; background: #fff; overflow-wrap: anywhere }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 1rem }
h2 { font-size: 1.4rem; margin: 2.2rem 0 .5rem; padding-top: .5rem; border-top: 2px solid #1b1b1b }
p { margin: .5rem 0 } a { color: #00528c } img { max-width: 100% }
.verdict { border-left: .5rem solid #009e73; padding: .2rem 1rem; background: #f4f2ee }
.verdict ul { padding-left: 1.2rem; margin: .3rem 0 }
.portrait { margin: 1rem 0 } .portrait img { display: block; width: 100%; border: 1px solid #ccc;
  box-sizing: border-box }
table { border-collapse: collapse; width: 100%; margin: 1rem 0 }
th, td { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0;
  border-bottom: 1px solid #ccc }
th { width: 6rem; overflow-wrap: normal }
.figures, .sheets, .files { list-style: none; padding: 0; margin: .8rem 0; display: grid;
  gap: .8rem; grid-template-columns: repeat(auto-fill, minmax(12rem, 1fr)) }
.figures li { background: #f4f2ee; padding: .5rem .8rem; line-height: 1.3 }
.figures strong { display: block; font-size: 1.45rem; overflow-wrap: normal }
.sheets { grid-template-columns: repeat(auto-fill, minmax(16rem, 1fr)) }
.sheets li { border: 1px solid #ccc; padding: .6rem }
.sheets img, .files img { display: block; width: 100% }
.sheets a { display: inline-block; padding: .3rem .4rem .3rem 0 }
.files { grid-template-columns: repeat(auto-fill, minmax(19rem, 1fr)) }
.files li { line-height: 1.35 } .files a { display: block; padding: .3rem 0 }
.files img { max-width: 17rem }
.bar { background: #e4e0d8; height: .7rem; margin: .2rem 0 }
.bar span { display: block; height: 100%; background: #0072b2 }
h3 { font-size: 1.1rem; margin: 1rem 0 .3rem }
.charts { display: grid; gap: 0 1.5rem;
  grid-template-columns: repeat(auto-fit, minmax(17rem, 1fr)) }
svg { display: block; width: 100%; max-width: 22rem; height: auto }
svg text { font: 15px system-ui, sans-serif }
@media screen and (max-width: 30rem) {
  .figures { grid-template-columns: 1fr 1fr } .figures strong { font-size: 1.15rem }
}
@page { size: A4; margin: 12mm }
@media print {
  body { font-size: 10pt; line-height: 1.3; margin: 0; max-width: none; padding: 0 }
  h1 { font-size: 18pt; margin: 0 0 .3rem }
  h2 { font-size: 13pt; margin: .7rem 0 .2rem; padding-top: .2rem; break-after: avoid }
  .portrait { margin: .4rem auto; max-width: 110mm } table { margin: .3rem 0 }
  .figures, .sheets, .files { gap: .3rem .6rem; margin: .3rem 0; grid-template-columns:
    repeat(4, 1fr) }
  .figures strong { font-size: 12pt } .figures li { padding: .2rem .5rem }
  .sheets li { padding: .3rem } .sheets a, .files a { padding: 0 .3rem 0 0 }
  .files { grid-template-columns: repeat(3, 1fr) } .files img { max-width: 40mm }
  .bar, .bar span, .figures li, .verdict { print-color-adjust: exact }
  h3 { font-size: 10pt; margin: .4rem 0 .1rem; break-after: avoid }
  .charts { grid-template-columns: repeat(3, 1fr) }
  li, tr, .portrait, svg { break-inside: avoid }
}
.with-care { border-color: #e69f00 } .not-makeable { border-color: #d55e00 }
"""
_HEAD = (
    '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
    '<meta name="viewport" content="width=device-width"><title>{title}</title>\n'
    "<style>{style}</style></head><body>\n"
)
#: What patterns are called; a fabric has its own name.
_WEAVES = {
    "plain": "plain weave",
    "kagome": "kagome, plain weave in three directions",
    "twill": "2/2 twill",
    "triaxial": "triaxial twill",
    "twists": "edges twisted as they were given",
}
_BUILD = (
    ("assembly.pdf", "the manual, to print: parts, sheets, and every step"),
    ("assembly.html", "the viewer: the object in space, its pieces, sheets and steps"),
    ("pieces.csv", "each piece: sheet, size, kind, material"),
    ("stations.csv", "each piece, crossing by crossing: over or under, partner, joint, hole, step"),
    ("crossing_map.csv", "each crossing: what lies over what"),
    ("crossing_map.json", "the whole plan, for programs"),
)
_MATERIAL = (
    ("waste.html", "how full the sheets are, what to buy, times and costs, what to keep"),
    ("waste.json", "the same, for programs"),
)
_CHECK = (
    ("preflight.json", "which rules of cutting the pieces break, and where"),
    ("ribbons.json", "widths, bends, creases and clearances, and what would mend them"),
    ("verdict.json", "whether it can be built, and why not"),
    ("likeness.png", "what of the model was lost where it was remeshed"),
    ("verify.json", "what was proved about these files"),
)
_AGAIN = (
    ("job.toml", "every setting: fabweave make --config job.toml -o again makes the same"),
    ("woven_mesh.obj", "the mesh that was woven"),
    ("model.glb", "the woven object, for programs that show 3-D models"),
    ("render.png", "its picture"),
    ("qr_code.png", "the command that makes it again, for the camera of a phone"),
    ("contents.json", "all these files with their SHA-256"),
)
#: These are written when the page is there already.
_LATER = ("verify.json", "contents.json")
#: What is shown small beside its link.
_SHOWN = {name: name for name in ("likeness.png", "qr_code.png")} | {"assembly.html": "render.png"}


@frozen_value
class About:
    """What the page says of a job besides its crossing map and its material.

    Parameters
    ----------
    title : str
        Name of the object.
    verdict : Verdict
        Whether it can be built.
    size_mm : tuple of float
        Its extents along x, y, z.
    material : str
        In words, with its thickness.
    given_mesh : str or None
        The file with the mesh as it was given, if that is kept in the folder.
    """

    title: str
    verdict: Verdict
    size_mm: tuple[float, ...]
    material: str
    given_mesh: str | None = None


def index_page(
    about: About,
    crossing_map: CrossingMap,
    report: WasteReport,
    cut_names: Sequence[str],
    files: Collection[str],
) -> str:
    """Return the page that opens a job, as HTML that loads nothing but the job's own pictures.

    Parameters
    ----------
    about : About
    crossing_map : CrossingMap
    report : WasteReport
    cut_names : sequence of str
        What the sheets with kerf are called, without suffix; none where there are none.
    files : collection of str
        What is in the folder already, as paths from there; the page links to what it knows.
    """
    there = {*files, *_LATER}
    mesh = about.given_mesh
    given = [] if mesh is None else [(mesh, "the mesh as it was given")]
    title = html.escape(about.title)
    parts = [
        _HEAD.format(title=title, style=_STYLE),
        f"<h1>{title}</h1>",
        verdict_section(about.verdict),
        '<p class="portrait"><a href="render.png"><img src="render.png" alt="the woven object">'
        "</a></p>",
        *_what(about, crossing_map, report),
        "<h2>1 Cut</h2>",
        *_cut(crossing_map, report, cut_names, there),
        "<h2>2 Build</h2>",
        *_listed(_BUILD, there),
        "<h2>3 Material</h2>",
        *charts(report),
        *_listed(_MATERIAL, there),
        "<h2>4 Check</h2>",
        *_listed(_CHECK, there),
        "<h2>5 Again</h2>",
        *_listed((*_AGAIN[:1], *given, *_AGAIN[1:]), there),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _what(about: About, crossing_map: CrossingMap, report: WasteReport) -> Iterator[str]:
    """Yield what was made, and the figures."""
    rows = (
        ("Weave", _weave_text(crossing_map.weave)),
        ("Size", " × ".join(f"{length:.0f}" for length in about.size_mm) + " mm"),
        ("Material", about.material),
    )
    body = "".join(f"<tr><th>{name}</th><td>{html.escape(text)}</td></tr>" for name, text in rows)
    yield f"<table>{body}</table>"
    figures = "".join(
        f"<li><strong>{html.escape(value)}</strong> {text}</li>"
        for value, text in _figures(crossing_map, report, report.estimate)
    )
    yield f'<ul class="figures">{figures}</ul>'


def _weave_text(weave: WeaveRecord) -> str:
    """Return the pattern in words, and whether it holds everywhere."""
    broken = weave.broken.edge + weave.broken.face + weave.broken.vertex
    name = _WEAVES.get(weave.pattern, weave.pattern)
    if weave.exact:
        return f"{name}, exact"
    return name + agree(broken, "; {n} of its conditions [is|are] broken")


def _figures(
    crossing_map: CrossingMap, report: WasteReport, costs: Costs
) -> Iterator[tuple[str, str]]:
    """Yield numbers, each with what there are so many of."""
    kinds = len({piece.kind for piece in crossing_map.pieces})
    spares = len(crossing_map.spares or ())
    for count, text in (
        (len(crossing_map.threads), "thread[|s]"),
        (len(crossing_map.crossings), "crossing[|s]"),
        (len(crossing_map.pieces), "piece[|s] of " + agree(kinds, "{n} kind[|s]")),
        *([(spares, "spare[|s]")] if spares else []),
        (len(crossing_map.joints), "joint[|s]"),
        (len(crossing_map.sheets), f"sheet[|s], {report.totals.sums.utilisation:.0%} used"),
    ):
        yield str(count), agree(count, text)
    yield time_text(costs.machine_s), "of the machine"
    yield hours_text(costs.assembly.hours), f"of hands, {costs.difficulty.word}"
    yield (
        price_text(costs.price),
        "for sheets and hardware" + ("" if costs.machine_price is None else ", and the machine"),
    )


def _cut(
    crossing_map: CrossingMap, report: WasteReport, cut_names: Sequence[str], there: set[str]
) -> Iterator[str]:
    """Yield what goes to the machine: sheets, files for a service, and what is kept."""
    if cut_names:
        yield (
            "<p>Cut the files that allow for the kerf or have bridges; the nominal ones are the "
            "plan.</p>"
        )
    else:
        yield "<p>DXF and SVG hold the same lines: take the one that your machine likes.</p>"
    yield '<ul class="sheets">'
    for at, (sheet, account) in enumerate(zip(crossing_map.sheets, report.sheets, strict=True)):
        picture, share = f"sheets/{sheet.name}.png", f"{100 * account.utilisation:.1f}"
        nominal = " ".join(_sheet_links(f"sheets/{sheet.name}", there))
        links = f"to cut: {nominal}"
        if cut_names:
            to_cut = " ".join(_sheet_links(f"cut/{cut_names[at]}", there))
            links = f"to cut: {to_cut}<br>nominal: {nominal}"
        pieces = agree(account.pieces, "{n} piece[|s]")
        yield (
            f'<li><a href="{picture}"><img src="{picture}" alt="{sheet.name}"></a>'
            f"<strong>{sheet.name}</strong> {pieces}, {share}% used"
            f'\n<div class="bar"><span style="width:{share}%"></span></div>{links}</li>'
        )
    yield "</ul>"
    for heading, folder in (
        (
            "For a service: each kind of piece in a file of its own, and how many to order.",
            "service/",
        ),
        ("The ring around each opening, to cut as well; rim.txt says how it is laid.", "rim/"),
        (
            "What is left and worth keeping, and a list of it for the --stock of a later job.",
            "offcuts/",
        ),
    ):
        names = sorted(name for name in there if name.startswith(folder))
        if names:
            yield f"<p>{heading}</p>"
            links = "".join(
                f'<li><a href="{name}">{name.removeprefix(folder)}</a></li>' for name in names
            )
            yield f'<ul class="files">{links}</ul>'


def _sheet_links(stem: str, there: set[str]) -> Iterator[str]:
    """Yield links to the drawings of a sheet."""
    for suffix in ("dxf", "svg", "pdf"):
        if f"{stem}.{suffix}" in there:
            yield f'<a href="{stem}.{suffix}">{suffix.upper()}</a>'


def _listed(entries: Sequence[tuple[str, str]], there: set[str]) -> Iterator[str]:
    """Yield links to those files that are there, each with what it is."""
    yield '<ul class="files">'
    for name, text in entries:
        if name in there:
            shown = _SHOWN.get(name)
            picture = "" if shown is None else f'<img src="{shown}" alt="">'
            words = f" {html.escape(text)}" if text else ""
            yield f'<li><a href="{name}">{name}{picture}</a>{words}</li>'
    yield "</ul>"
