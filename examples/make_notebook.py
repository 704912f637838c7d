"""Make the notebook: run its cells from top to bottom, and keep what they show.

Run it with: python examples/make_notebook.py examples/fabweave.ipynb
"""

import ast
import base64
import contextlib
import io
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

#: Text, and code: a cell that begins with a heading or is a sentence is text.
CELLS = (
    """\
# From a mesh to a proved job

Install fabweave, and run these cells from top to bottom: it takes less than a minute, and writes
one folder, `ring`.""",
    """\
import fabweave as fw

mesh = fw.shape("torus", m=12, n=6, size="300mm")  # or fw.read("yours.obj", size="300mm")
mesh""",
    """\
## What can be woven on it?

Nothing is decided yet. `inspect` tells which weaves are exact here.""",
    """\
report = fw.inspect(mesh, effort="quick")
print(report)
print("exact twill:", report.facts["twill"]["exact"])""",
    """\
## A choice of design

Every value depends on its arguments alone, so a choice is a loop: three patterns, and what each
asks of your hands.""",
    """\
choices = {}
for pattern in ("plain", "twill", "3/1"):
    ribbons = fw.weave(mesh, pattern=pattern).ribbons(material="card")
    pieces = ribbons.pieces(max_length="300mm", sheet="600x400mm")
    low, high = pieces.costs.assembly.hours
    choices[pattern] = ribbons, pieces
    kinds = len(set(pieces.kinds))
    print(f"{pattern:6} {len(pieces):3} pieces, {kinds:2} kinds, {low:.1f} to {high:.1f} hours")""",
    "The twill it is: its diagonal shows, and it takes no longer than the others.",
    """\
ribbons, pieces = choices["twill"]
ribbons""",
    """\
## Sheets

The pieces are packed on the stock that you have.""",
    """\
layout = pieces.nest(sheet="600x400mm", effort="quick")
layout""",
    """\
## The job, and its proof

Only this writes to the disk. A second program reads the files back and proves that they rebuild the
weave.""",
    """\
job = layout.write("ring")
print("proved:", job.proof.ok)
for path in job.files[:6]:
    print(path.name)""",
    "Open `ring/index.html` in a browser: it leads to all files, in the order of their use.",
)


def is_text(cell: str) -> bool:
    """Return whether a cell is read, not run."""
    try:
        ast.parse(cell)
    except SyntaxError:
        return True
    return cell.startswith("#")


def outputs_of(cell: str, names: dict[str, Any]) -> list[dict[str, Any]]:
    """Run a cell, and return what it shows: its prints, and the value of its last line."""
    body = ast.parse(cell).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "<cell>", "exec"), names)  # noqa: S102 - our own cells
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)  # noqa: S307
    shown: list[dict[str, Any]] = []
    if printed.getvalue():
        text = printed.getvalue().splitlines(keepends=True)
        shown.append({"name": "stdout", "output_type": "stream", "text": text})
    if value is not None:
        data = {"text/plain": [repr(value)]}
        if hasattr(value, "_repr_html_"):
            data["text/html"] = [smaller(value._repr_html_())]
        result = {"data": data, "execution_count": None, "metadata": {}}
        shown.append({**result, "output_type": "execute_result"})
    return shown


def smaller(page: str) -> str:
    """Return HTML whose pictures have few colours, so that the notebook stays small."""
    mark = "data:image/png;base64,"
    head, *rest = page.split(mark)
    for part in rest:
        code, quote, tail = part.partition('"')
        data = io.BytesIO()
        with Image.open(io.BytesIO(base64.b64decode(code))) as picture:
            few = picture.convert("RGB").quantize(96, dither=Image.Dither.NONE)
            few.save(data, "PNG", optimize=True)
        head += mark + base64.b64encode(data.getvalue()).decode() + quote + tail
    return head


def notebook() -> dict[str, Any]:
    """Run all cells in an empty folder, and return the notebook with what they show."""
    cells: list[dict[str, Any]] = []
    names: dict[str, Any] = {}
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for number, cell in enumerate(CELLS):
                one: dict[str, Any] = {"id": f"cell-{number}", "metadata": {}}
                one["source"] = cell.splitlines(keepends=True)
                if is_text(cell):
                    cells.append({"cell_type": "markdown", **one})
                    continue
                count = 1 + sum(one["cell_type"] == "code" for one in cells)
                outputs = outputs_of(cell, names)
                for output in outputs:
                    if "execution_count" in output:
                        output["execution_count"] = count
                code = {"execution_count": count, "outputs": outputs}
                cells.append({"cell_type": "code", **one, **code})
        finally:
            os.chdir(before)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    return {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


if __name__ == "__main__":
    text = json.dumps(notebook(), indent=1, ensure_ascii=False, sort_keys=True) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8", newline="")
