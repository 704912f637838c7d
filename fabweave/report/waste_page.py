"""Show the report on material as a web page."""

import html
from collections.abc import Iterator, Sequence

from fabweave.core.messages import agree
from fabweave.nest.allotment import Allotment
from fabweave.report.accounts import MaterialAccount, SheetAccount, SheetSums
from fabweave.report.bom import bom_section
from fabweave.report.comparison import comparison_section
from fabweave.report.costs.page import costs_section
from fabweave.report.offcuts import offcut_section
from fabweave.report.rings import rim_section
from fabweave.report.splitting import splitting_section
from fabweave.report.verdict import QUESTION, VERDICTS, Verdict
from fabweave.report.waste import WasteReport
from fabweave.stock.supplies import Supplies

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width"><title>{title}: material</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 60rem; padding: 0 1rem;
  color: #1b1b1b }}
h1 {{ font-size: 1.6rem }} h2 {{ font-size: 1.15rem; margin-top: 2rem }}
table {{ border-collapse: collapse; width: 100% }}
th, td {{ text-align: right; padding: .35rem .6rem; border-bottom: 1px solid #ccc }}
th:first-child, td:first-child {{ text-align: left }}
tfoot td, .taken td {{ font-weight: 600 }}
.bar {{ background: #e4e0d8; height: .8rem; min-width: 8rem }}
.bar span {{ display: block; height: 100%; background: #0072b2 }}
pre {{ background: #f4f2ee; padding: .8rem; overflow-x: auto; font-size: .85rem }}
figure {{ margin: 1rem 0 }} img {{ max-width: 100%; border: 1px solid #ccc }}
li {{ margin: .3rem 0 }}
.verdict {{ border-left: .5rem solid #009e73; padding: .2rem .9rem; background: #f4f2ee }}
@media screen and (max-width: 44rem) {{
  body {{ margin: 1rem auto; overflow-wrap: anywhere }} table {{ display: block; overflow-x: auto }}
  th, td {{ padding: .3rem; font-size: .8rem; overflow-wrap: normal }} .bar {{ min-width: 3rem }}
  svg {{ max-width: 100%; height: auto }}
}}
@page {{ size: A4; margin: 12mm }}
@media print {{
  body {{ font-size: 8pt; line-height: 1.25; margin: 0; max-width: none; padding: 0 }}
  h1 {{ font-size: 13pt; margin: 0 }}
  h2 {{ font-size: 10pt; margin: .6rem 0 .2rem; break-after: avoid }}
  p, ul {{ margin: .2rem 0 }} li {{ margin: 0 }} th, td {{ padding: .05rem .3rem }}
  pre {{ font-size: 6.5pt; padding: .2rem; margin: .2rem 0; white-space: pre-wrap }}
  tr, figure, svg {{ break-inside: avoid }} .verdict {{ padding: 0 .5rem }}
  .bar, .bar span {{ print-color-adjust: exact }} svg {{ height: 34mm; width: auto }}
  ul {{ columns: 2; font-size: 7pt; padding-left: 1rem }} li {{ break-inside: avoid }}
  figure {{ float: left; width: 18%; margin: .2rem 1% }} figure img {{ max-height: 30mm }}
}}
.with-care {{ border-color: #e69f00 }} .not-makeable {{ border-color: #d55e00 }}
</style></head><body>
<h1>{title}: material</h1>
{verdict}
<p>{summary}</p>
<h2>Sheets</h2>
<table><thead><tr><th>Sheet</th><th>Size, mm</th><th>Pieces</th><th>Pieces, cm²</th>
<th>Holes, cm²</th><th>Waste with holes, cm²</th><th>Used</th><th></th></tr></thead>
<tbody>
{rows}
</tbody><tfoot>{total}</tfoot></table>
{materials}{comparison}{estimate}{rings}{offcuts}
{bill}
{splitting}
{notes}
<h2>Pictures</h2>
{pictures}
</body></html>
"""


def waste_page(
    report: WasteReport,
    *,
    title: str,
    verdict: Verdict,
    allotment: Allotment,
    sheet_names: Sequence[str],
    entries: Sequence[str],
    likeness: str | None = None,
) -> str:
    """Return the report as a small web page that opens from the job's folder.

    Parameters
    ----------
    report : WasteReport
    title : str
        Name of the job.
    verdict : Verdict
        Whether it can be built.
    allotment : Allotment
    sheet_names : sequence of str
    entries : sequence of str
        Those of the offcuts in a list of stock.
    likeness : str, optional
        The file with the picture of what a remeshed model lost.
    """
    totals, supplies = report.totals, allotment.supplies
    rows = "\n".join(
        _page_row(name, _size(sheet, with_material=supplies.several), sheet)
        for name, sheet in zip(sheet_names, report.sheets, strict=True)
    )
    summary = (
        f"{agree(totals.sums.pieces, '{n} piece[|s]')} of {supplies.description}, on "
        f"{agree(totals.sums.sheets, '{n} sheet[|s]')}: {totals.sums.utilisation:.0%} of the "
        f"material is used, with {totals.cut_length_mm / 1000:.1f} m of cuts and "
        f"{totals.engrave_length_mm / 1000:.1f} m of engraving. "
        f"The finished object weighs {totals.mass_g:.0f} g."
    )
    if totals.sums.price:
        summary += f" The sheets cost {totals.sums.price:.2f}."
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in report.notes)
    return _PAGE.format(
        title=html.escape(title),
        verdict=verdict_section(verdict),
        summary=html.escape(summary),
        rows=rows,
        total=_page_row("all", "", totals.sums),
        estimate=costs_section(report.estimate, sheet_names),
        comparison=comparison_section(report.comparison, totals.sums),
        rings=rim_section(report.rim),
        offcuts=offcut_section(report.offcuts, entries, sheet_names),
        materials=_material_section(report.materials, supplies) if supplies.several else "",
        bill=bom_section(report.bill),
        splitting=splitting_section(report.splitting),
        notes=f"<h2>Notes</h2><ul>{notes}</ul>" if notes else "",
        pictures="\n".join(_pictures(sheet_names, likeness)),
    )


def _pictures(sheet_names: Sequence[str], likeness: str | None) -> Iterator[str]:
    """Yield the pictures of the sheets, and that of what a remeshed model lost."""
    for name in sheet_names:
        yield (
            f'<figure><img src="sheets/{name}.png" alt="{name}"><figcaption>{name}</figcaption>'
            "</figure>"
        )
    if likeness is not None:
        text = "the model, coloured by how far it is from the mesh that was woven"
        yield (
            f'<figure><img src="{likeness}" alt="{text}"><figcaption>{text}</figcaption></figure>'
        )


def verdict_section(verdict: Verdict) -> str:
    """Return the verdict with its reasons, as a section of a web page.

    Parameters
    ----------
    verdict : Verdict
    """
    reasons = "".join(
        f"<li>{html.escape(reason.text)}"
        + (f"; <em>{html.escape(reason.advice)}</em>" if reason.advice else "")
        + "</li>"
        for reason in verdict.reasons
    )
    forced = " It was made all the same (--force)." if verdict.forced else ""
    return (
        f'<div class="verdict {verdict.level.replace(" ", "-")}"><p><strong>{QUESTION} '
        f"{VERDICTS[verdict.level]}</strong>{forced}</p>"
        + (f"<ul>{reasons}</ul>" if reasons else "")
        + "</div>"
    )


def _size(sheet: SheetAccount, *, with_material: bool) -> str:
    """Return the size of a sheet, what it is called in the stock, and maybe its material."""
    size = f"{sheet.width_mm:g} × {sheet.height_mm:g}"
    if sheet.stock:
        size += f"<br><small>{html.escape(sheet.stock)}</small>"
    return f"{size}, {sheet.material} {sheet.thickness_mm:g}" if with_material else size


def _material_section(accounts: Sequence[MaterialAccount], supplies: Supplies) -> str:
    """Return what each material comes to, as a section of a web page."""
    rows, priced = [], any(account.sums.price for account in accounts)
    for account, supply in zip(accounts, supplies.each, strict=True):
        sums = account.sums
        cells = [
            f"{supply.description} ({', '.join(supply.bunches)})",
            sums.sheets,
            sums.pieces,
            f"{sums.area_mm2 / 100:.1f}",
            f"{sums.piece_area_mm2 / 100:.1f}",
            f"{sums.waste_mm2 / 100:.1f}",
            f"{sums.utilisation:.1%}",
            f"{account.mass_g:.1f}",
        ]
        if priced:
            cells.append("unknown" if sums.price is None else f"{sums.price:.2f}")
        row = "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells)
        rows.append(f"<tr>{row}</tr>")
    body = "\n".join(rows)
    return (
        "<h2>Materials</h2>\n<table><thead><tr><th>Material</th><th>Sheets</th><th>Pieces</th>"
        "<th>Sheets, cm²</th><th>Pieces, cm²</th><th>Waste, cm²</th><th>Used</th><th>Mass, g</th>"
        f"{'<th>Price of sheets</th>' * priced}</tr></thead>\n<tbody>\n{body}\n</tbody></table>\n"
    )


def _page_row(name: str, size: str, account: SheetAccount | SheetSums) -> str:
    """Return one row of the page's table."""
    share = 100 * account.utilisation
    cells = (
        html.escape(name),
        size,
        account.pieces,
        f"{account.piece_area_mm2 / 100:.1f}",
        f"{account.hole_area_mm2 / 100:.1f}",
        f"{account.waste_mm2 / 100:.1f}",
        f"{share:.1f} %",
        f'<div class="bar"><span style="width:{share:.1f}%"></span></div>',
    )
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
