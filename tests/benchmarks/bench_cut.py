"""Write 10,000 pieces as DXF and SVG, and letter 10,000 labels: processor time and memory.

Run: python tests/benchmarks/bench_cut.py [pieces]
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fabweave.cut.drawing import Circle, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.labels.lettering import place_text
from fabweave.cut.notes.notes import sheet_notes
from fabweave.cut.notes.qr_code import with_code
from fabweave.cut.write.dxf import DXF_VERSIONS, dxf_bytes
from fabweave.cut.write.svg import SVG_UNITS, svg_text

#: Pieces of a sheet, of a row, and from piece to piece, millimetres.
SHEET, ROW, STEP = 250, 10, (95.0, 26.0)


def wavy_piece(name, origin):
    """Return a strip with eight labels, sixteen ticks, eight holes and an outline with arcs."""
    run = np.linspace(0.0, 1.0, 30)
    centre = np.stack([90.0 * run, 3.0 * np.sin(9.0 * run)], axis=1) + origin
    at = np.arange(2, 30, 4) + 0
    half = np.array([0.0, 7.0])
    entities = []
    for k in at.tolist():
        text = f"╪{name}" if k > 2 else f"{name}→"
        label = place_text(text, 2.5, centre[k] + [4.0, 3.0], 12.0)
        entities += [Polyline(Layer.ENGRAVE_LABEL, stroke) for stroke in label]
    for sign in (-1.0, 1.0):
        entities += [
            Polyline(Layer.ENGRAVE_MARK, centre[k] + np.outer((0.98, 0.8), sign * half))
            for k in at.tolist()
        ]
    entities += [Circle(Layer.CUT_INNER, x, y, 1.65) for x, y in centre[at].tolist()]
    outline = np.concatenate([centre - half, (centre + half)[::-1]])
    bulges = np.where(np.arange(len(outline)) % 3, 0.02, 0.0)
    entities.append(Polyline(Layer.CUT_OUTER, outline, closed=True, bulges=bulges))
    return PieceDrawing(name, tuple(entities))


def sheets_of(count):
    """Return sheets of so many pieces."""
    drawings = []
    for first in range(0, count, SHEET):
        pieces = tuple(
            wavy_piece(f"A{k + 1}", (12.0 + STEP[0] * (n % ROW), 25.0 + STEP[1] * (n // ROW)))
            for n, k in enumerate(range(first, min(first + SHEET, count)))
        )
        name = f"sheet_{len(drawings) + 1:02d}"
        drawings.append(SheetDrawing(name, 970.0, 720.0, pieces, sheet_notes(970.0, 720.0, [name])))
    return drawings


def spent(work):
    """Return the processor time that something takes."""
    before = time.process_time()
    work()
    return time.process_time() - before


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    labels = [f"╪AB{k % 100}" for k in range(10_000)]
    lettering = spent(lambda: [place_text(text, 2.5, (3.0, 4.0), 30.0) for text in labels])
    print(f"10,000 labels: {lettering:.2f} s")
    drawings = sheets_of(count)
    coding = spent(lambda: [with_code(one, "fabweave make shape:cube -o x") for one in drawings])
    entities = sum(len(piece.entities) for one in drawings for piece in one.pieces)
    print(f"{count} pieces, {len(drawings)} sheets, {entities} entities; codes {coding:.2f} s")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for version in DXF_VERSIONS:
            taken = spent(
                lambda version=version: [
                    (folder / f"{one.name}.dxf").write_bytes(dxf_bytes(one, version=version))
                    for one in drawings
                ]
            )
            size = sum(path.stat().st_size for path in folder.glob("*.dxf")) / 1e6
            print(f"DXF {version}: {taken:.2f} s, {size:.0f} MB")
        for units in SVG_UNITS:
            taken = spent(
                lambda units=units: [
                    (folder / f"{one.name}.svg").write_bytes(svg_text(one, units=units).encode())
                    for one in drawings
                ]
            )
            size = sum(path.stat().st_size for path in folder.glob("*.svg")) / 1e6
            print(f"SVG {units}: {taken:.2f} s, {size:.0f} MB")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MB")


if __name__ == "__main__":
    main()
