"""Spoil finished jobs, and count what the proof finds: spoil_jobs.py FIRST LAST [CLASS ...].

Each class of spoilings is tried with the seeds from FIRST to before LAST on every one of five jobs
that has such files. In the end a table says how many were tried, caught and missed; what was missed
is printed before it. Ctrl-C ends it with the table of what was tried by then.

Known to be missed: how many pieces of a length that was not chosen are longer than it, all figures
of such lengths where not all threads were cut to compare them, and whether a remedy that all files
tell alike would help. ``fabweave verify DIR --remake`` finds these.

What may be missed without harm, and is left out: ``remedy`` of flaws of pieces, in English, that no
other file states, comments in the list of offcuts, the shape of render.png, and ``contents.json``,
which says whose the files of a folder are, and nothing about the object.
"""

import contextlib
import csv
import io
import json
import multiprocessing
import os
import random
import re
import shutil
import signal
import struct
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from jobs import OCTAHEDRON, quick_jobs, run
from pdf_edits import repaired, unpacked
from PIL import Image

from fabweave.verify import verify_job

STOCK = Path(__file__).parents[2] / "examples" / "stock.toml"
QUICK = ("--effort", "quick")
JOBS = {
    "plain": OCTAHEDRON,
    "twill": ("shape:torus?m=4&n=4", "--size", "200mm", "--pattern", "twill", "--kerf", "0.15mm",
              "--micro-joints", "2", "--stock", STOCK, *QUICK),
    "two materials": ("shape:torus?m=4&n=4", "--size", "300mm", "--material",
                      "warp=card,weft=birch-veneer", "--force", *QUICK),
    "service": ("shape:cube", "--size", "110mm", "--profile", "service", *QUICK),
    "open": ("shape:hypar?m=2&n=3", "--size", "150mm", "--sheet", "400x300mm", *QUICK),
}  # fmt: skip


class NothingError(Exception):
    """Say that a job has nothing that could be spoiled like this."""


def pick(dice, folder, pattern):
    """Return a file of a job."""
    return any_of(dice, folder.glob(pattern))


def any_of(dice, things):
    """Return one of some things; NothingError where there is none."""
    things = list(things)
    if not things:
        raise NothingError
    return dice.choice(sorted(things) if isinstance(things[0], Path) else things)


def text_file(pattern):
    """Make a spoiling of a file of one that edits its text."""

    def decorate(edit):
        def spoil(dice, folder):
            path = pick(dice, folder, pattern)
            text = path.read_bytes().decode("utf-8")
            after = edit(dice, text)
            if after == text:
                raise NothingError
            path.write_bytes(after.encode("utf-8"))
            return f"{path.name}: {difference(text, after)}"

        return spoil

    return decorate


def difference(text, after):
    """Say where two texts begin to differ, and how."""
    at = next((k for k, (a, b) in enumerate(zip(text, after, strict=False)) if a != b), len(after))
    start = max(at - 60, 0)
    return f"{text[start : at + 30]!r} -> {after[start : at + 30]!r}"


def nudged(dice, number):
    """Return a number as text that is another one."""
    value = float(number)
    return repr(round(value + dice.choice([-1, 1]) * max(0.5, 0.1 * abs(value)), 6))


def replaced(text, match, other):
    return text[: match.start()] + other + text[match.end() :]


def any_match(dice, pattern, text, start=0):
    """Return one place in a text, or from the beginning of a section of a DXF file to its end."""
    end = text.index("\n  0\nENDSEC", start) if start else len(text)
    return any_of(dice, (m for m in re.finditer(pattern, text) if start <= m.start() < end))


# --- drawings -----------------------------------------------------------------------------------

ENTITY = re.compile(
    r"  0\n(?:LINE|CIRCLE|LWPOLYLINE|POLYLINE|ARC)\n(?:(?!  0\n).*\n.*\n)*?(?=  0\n)"
)
DXF = "**/*.dxf"


@text_file(DXF)
def dxf_entity(dice, text):
    found = any_match(dice, ENTITY, text, text.index("\nENTITIES\n"))
    return replaced(text, found, dice.choice(["", found[0] * 2]))


@text_file(DXF)
def dxf_group(dice, text):
    found = any_match(dice, ENTITY, text, text.index("\nENTITIES\n"))
    more = dice.choice([" 60\n1\n", " 62\n3\n", " 48\n2.0\n", "  6\nDASHED\n", " 39\n1.0\n",
                        "370\n50\n", "210\n0.0\n220\n0.0\n230\n-1.0\n", " 67\n1\n"])  # fmt: skip
    head = found[0].split("\n")
    return replaced(text, found, "\n".join(head[:2]) + "\n" + more + "\n".join(head[2:]))


@text_file(DXF)
def dxf_layer(dice, text):
    start = dice.choice([0, text.index("\nENTITIES\n")])
    names = "CUT_INNER|CUT_OUTER|ENGRAVE_LABEL|ENGRAVE_MARK|NOTES"
    found = any_match(dice, rf"\n  [28]\n({names})\n", text, start)
    other = dice.choice([name for name in names.split("|") if name != found[1]])
    return replaced(text, found, found[0].replace(found[1], other))


@text_file(DXF)
def dxf_block(dice, text):
    line = "LINE\n  8\nCUT_OUTER\n 10\n1.0\n 20\n1.0\n 11\n9.0\n 21\n9.0\n"
    return dice.choice([
        text.replace("  0\nENDBLK", "  0\n" + line + "  0\nENDBLK", dice.choice([1, 2])),
        text.replace("\nENTITIES\n", "\nENTITIES\n  0\nINSERT\n  2\n*Model_Space\n  8\nNOTES\n", 1),
    ])  # fmt: skip


@text_file(DXF)
def dxf_coordinates(dice, text):
    found = any_match(
        dice, r"\n ?[ 1]?[124][0-2]\n(-?\d+\.\d+)\n", text, text.index("\nENTITIES\n")
    )
    return replaced(text, found, found[0].replace(found[1], nudged(dice, found[1])))


SVG = "**/*.svg"
ELEMENT = r"<(?:path|circle)[^>]*>(?:<title>[^<]*</title>)?(?:</(?:path|circle)>)?"


@text_file(SVG)
def svg_element(dice, text):
    found = any_match(dice, ELEMENT, text)
    return replaced(text, found, dice.choice(["", found[0] * 2]))


@text_file(SVG)
def svg_attribute(dice, text):
    found = any_match(dice, r"<(?:path|circle|g) ", text)
    more = dice.choice(["display", "opacity", "class", "style", "stroke-dasharray", "filter",
                        "clip-path", "stroke-width", "fill", "mask", "visibility"])  # fmt: skip
    value = {"stroke-width": "3", "fill": "red", "display": "none", "opacity": "0.5"}
    if f" {more}=" in found.string[found.start() : found.string.index(">", found.start())]:
        raise NothingError
    return replaced(text, found, f'{found[0]}{more}="{value.get(more, "x")}" ')


@text_file(SVG)
def svg_coordinates(dice, text):
    found = any_match(dice, r' (?:d|cx|cy|r|viewBox|width|height)="([^"]*)"', text)
    number = any_match(dice, r"-?\d+\.?\d*", found[1])
    return replaced(text, found, found[0].replace(
        found[1], replaced(found[1], number, nudged(dice, number[0]))))  # fmt: skip


@text_file(SVG)
def svg_transform(dice, text):
    found = any_match(dice, r"<(?:path|circle|g|svg) ", text)
    how = dice.choice(["translate(1 0)", "scale(1.01)", "rotate(1)", "matrix(1 0 0 -1 0 0)"])
    return replaced(text, found, f'{found[0]}transform="{how}" ')


# --- pages --------------------------------------------------------------------------------------


def pdf_file(edit):
    """Make a spoiling of an edit of an unpacked PDF."""

    def spoil(dice, folder):
        path = pick(dice, folder, "**/*.pdf")
        data = unpacked(path.read_bytes())
        after = edit(dice, data)
        if after == data:
            raise NothingError
        path.write_bytes(repaired(after))
        return f"{path.name}: {difference(data.decode('latin-1'), after.decode('latin-1'))}"

    return spoil


def any_bytes(dice, pattern, data):
    return any_of(dice, re.finditer(pattern, data))


@pdf_file
def pdf_pages(dice, data):
    found = any_bytes(dice, rb"/Rotate 0", data)
    more = [b"/Rotate 90", b"/Rotate 0 /UserUnit 2", b"/Rotate 0 /Annots [ ]"]
    return replaced(data, found, dice.choice(more))


@pdf_file
def pdf_boxes(dice, data):
    found = any_bytes(dice, rb"/MediaBox \[ 0 0 (\S+) (\S+) \]", data)
    boxes = [b"/MediaBox [ 0 0 %s 99 ]" % found[1], b"/CropBox [ 0 0 9 9 ] " + found[0],
             b"/MediaBox [ 5 0 %s %s ]" % found.groups()]  # fmt: skip
    return replaced(data, found, dice.choice(boxes))


@pdf_file
def pdf_streams(dice, data):
    found = any_bytes(dice, rb"\n-?[\d.]+ -?[\d.]+ [lm]\b|\((?:[^()\\]){2,}\) Tj", data)
    text = found[0].decode("latin-1")
    if text.endswith("Tj"):
        return replaced(data, found, b"(nothing) Tj")
    number = any_match(dice, r"-?[\d.]+", text)
    return replaced(data, found, replaced(text, number, nudged(dice, number[0])).encode("latin-1"))


# --- viewer and model ---------------------------------------------------------------------------

VIEWER = "assembly.html"


@text_file(VIEWER)
def viewer_script(dice, text):
    found = any_match(dice, r"\b(?:const|let|return|function)\b", text)
    return replaced(text, found, f"/* */{found[0]}")


@text_file(VIEWER)
def viewer_policy(dice, text):
    found = any_match(dice, r"default-src 'none'|script-src [^;\"]*|Content-Security-Policy", text)
    more = '<script src="http://a.b/c.js"></script></body>'
    return dice.choice([replaced(text, found, "x"), text.replace("</body>", more)])


@text_file(VIEWER)
def viewer_data(dice, text):
    found = any_match(dice, r'<script[^>]*type="application/json"[^>]*>(.*?)</script>', text)
    spoilt = json.dumps(spoilt_leaf(dice, json.loads(found[1])))
    return replaced(text, found, found[0].replace(found[1], spoilt))


def glb_file(edit):
    """Make a spoiling of an edit of a GLB file: of its document and its data."""

    def spoil(dice, folder):
        path = folder / "model.glb"
        data = path.read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        document, binary = json.loads(data[20 : 20 + size]), bytearray(data[28 + size :])
        said = edit(dice, document, binary)
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text
        body += struct.pack("<II", len(binary), 0x004E4942) + binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return f"model.glb: {said}"

    return spoil


@glb_file
def glb_nodes(dice, document, _):
    node = dice.choice(document["nodes"])
    key = dice.choice(["name", "mesh"])
    node[key] = "nobody" if key == "name" else (node.get("mesh", 0) + 1) % len(document["meshes"])
    return f"{key} of a node is {node[key]}"


@glb_file
def glb_buffers(dice, document, binary):
    views = [document["accessors"][p["attributes"]["POSITION"]]["bufferView"]
             for mesh in document["meshes"] for p in mesh["primitives"]]  # fmt: skip
    view = document["bufferViews"][dice.choice(views)]
    at = view.get("byteOffset", 0) + 4 * dice.randrange(view["byteLength"] // 4)
    value = struct.unpack_from("<f", binary, at)[0]
    struct.pack_into("<f", binary, at, value + 0.003)
    return f"{value} at byte {at} of {view}"


@glb_file
def glb_transform(dice, document, _):
    change = dice.choice([{"translation": [0, 0, 0.01]}, {"scale": [1, 1, 1.1]},
                          {"rotation": [0, 0, 1, 0]}])  # fmt: skip
    dice.choice(document["nodes"]).update(change)
    return str(change)


def png(dice, folder):
    """Spoil a picture."""
    path = pick(dice, folder, "**/*.png")
    data = path.read_bytes()
    how = dice.choice(["cut short", "blank", "other shape", "a byte"])
    if how == "other shape" and path.name == "render.png":
        raise NothingError
    if how == "cut short":
        path.write_bytes(data[: dice.randrange(len(data) - 12)])
    elif how == "a byte":
        spoilt = bytearray(data)
        spoilt[dice.randrange(33, len(data) - 16)] ^= 0x55
        path.write_bytes(bytes(spoilt))
    else:
        with Image.open(io.BytesIO(data)) as picture:
            width, height = picture.size
            size = (width, height) if how == "blank" else (4 * width, height)
            shown = picture.convert("RGB").resize(size)
        (Image.new("RGB", size, "white") if how == "blank" else shown).save(path)
    return f"{path.name}: {how}"


# --- tables and records -------------------------------------------------------------------------


def leaves(document, path=()):
    """Yield the way to each value of a document that holds no others."""
    items = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in items:
        if isinstance(value, dict | list) and value:
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def spoilt_leaf(dice, document):
    """Change one value somewhere in a document."""
    way = dice.choice([way for way in leaves(document) if way[-1] not in ("text", "remedy")])
    place = document
    for key in way[:-1]:
        place = place[key]
    value = place[way[-1]]
    if isinstance(value, bool):
        place[way[-1]] = not value
    elif isinstance(value, int):
        place[way[-1]] = value + dice.choice([-1, 1])
    elif isinstance(value, float):
        place[way[-1]] = float(nudged(dice, value))
    elif isinstance(value, str):
        place[way[-1]] = value + "x" if value else "x"
    else:
        place[way[-1]] = 1
    return document


def json_file(pattern):
    """Make a spoiling of JSON files: one value is another."""

    def spoil(dice, folder):
        path = pick(dice, folder, pattern)
        document = json.loads(path.read_text(encoding="utf-8"))
        before = json.dumps(document, indent=1)
        after = json.dumps(spoilt_leaf(dice, document), indent=1)
        path.write_text(after, encoding="utf-8")
        return f"{path.name}: {difference(before, after)}"

    return spoil


def csv_file(pattern):
    @text_file(pattern)
    def spoil(dice, text):
        rows = list(csv.reader(io.StringIO(text, newline="")))
        at = dice.randrange(1, len(rows))
        how = dice.choice(["cell", "cell", "cell", "twice", "gone"])
        if how == "cell":
            column = dice.randrange(len(rows[at]))
            cell = rows[at][column]
            number = re.fullmatch(r"-?\d+(\.\d+)?", cell)
            rows[at][column] = nudged(dice, cell) if number else cell + "x"
        else:
            rows[at : at + 1] = [rows[at]] * (2 if how == "twice" else 0)
        out = io.StringIO(newline="")
        csv.writer(out, lineterminator="\n").writerows(rows)
        return out.getvalue()

    return spoil


@text_file("waste.html")
def waste_page(dice, text):
    found = any_match(dice, r"<td[^>]*>[^<]*?(\d[\d.]*)[^<]*</td>", text)
    return replaced(text, found, found[0].replace(found[1], nudged(dice, found[1])))


@text_file("index.html")
def index_page(dice, text):
    found = any_match(dice, r"<li><strong>(\d[\d.]*)[^<]*</strong>", text)
    return replaced(text, found, found[0].replace(found[1], nudged(dice, found[1])))


@text_file("job.toml")
def settings(dice, text):
    found = any_match(dice, r"(?m)^(\w+) = (.+)$", text)
    key, value = found.groups()
    if value == "[":
        raise NothingError
    if value in ("true", "false"):
        other = "false" if value == "true" else "true"
    elif value.startswith('"'):
        number = re.match(r'"(\d+\.?\d*)(.*)"$', value)
        other = f'"{nudged(dice, number[1])}{number[2]}"' if number else f'"x{value[1:]}'
    else:
        other = nudged(dice, value) if "." in value else str(int(value) + 1)
    return replaced(text, found, f"{key} = {other}")


@text_file("offcuts/stock.toml")
def offcut_list(dice, text):
    found = any_match(dice, r"(?<== )(?:-?\d+\.\d+|\"[^\"]+\")", text)
    other = '"x' + found[0][1:] if found[0].startswith('"') else nudged(dice, found[0])
    return replaced(text, found, other)


def missing_file(dice, folder):
    """Take a file away."""
    path = dice.choice([
        path for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in ("contents.json", "verify.json")
    ])  # fmt: skip
    path.unlink()
    return f"{path.relative_to(folder)} is gone"


def extra_file(dice, folder):
    """Put a file there that somebody would cut."""
    path = dice.choice(sorted([*folder.rglob("*.dxf"), *folder.rglob("*.svg")]))
    other = path.with_name(f"more{path.suffix}")
    shutil.copy(path, other)
    return f"{other.relative_to(folder)} is there, too"


def within(name, spoil):
    """Spoil what is in a folder of a job alone."""

    def spoil_there(dice, folder):
        return spoil(dice, folder / name)

    return spoil_there


CLASSES = {
    "DXF entity": dxf_entity, "DXF group": dxf_group, "DXF layer": dxf_layer,
    "DXF block": dxf_block, "DXF coordinates": dxf_coordinates,
    "SVG element": svg_element, "SVG attribute": svg_attribute,
    "SVG coordinates": svg_coordinates, "SVG transform": svg_transform,
    "PDF pages": pdf_pages, "PDF boxes": pdf_boxes, "PDF streams": pdf_streams,
    "viewer scripts": viewer_script, "viewer policy": viewer_policy, "viewer data": viewer_data,
    "GLB nodes": glb_nodes, "GLB buffers": glb_buffers, "GLB transform": glb_transform,
    "PNG": png,
    "waste.html": waste_page, "index.html": index_page,
    "waste.json": json_file("waste.json"), "job.toml": settings,
    "crossing_map.json": json_file("crossing_map.json"),
    "crossing_map.csv": csv_file("crossing_map.csv"),
    "stations.csv": csv_file("stations.csv"), "pieces.csv": csv_file("pieces.csv"),
    "ribbons.json": json_file("ribbons.json"), "preflight.json": json_file("preflight.json"),
    "missing files": missing_file, "extra files": extra_file,
    "service parts": within("service", csv_file("parts.csv")),
    "service DXF": within("service", dxf_coordinates),
    "service SVG": within("service", svg_coordinates),
    "offcut list": offcut_list, "offcut DXF": within("offcuts", dxf_coordinates),
}  # fmt: skip


def tried(task):
    """Spoil a copy of a job; return what was done, and which checks object."""
    source, name, job, seed = task
    dice = random.Random(f"{name} {job} {seed}")  # noqa: S311 - no secret
    with tempfile.TemporaryDirectory() as place:
        folder = Path(shutil.copytree(Path(source) / job, Path(place) / "job"))
        try:
            said = CLASSES[name](dice, folder)
        except NothingError:
            return name, job, seed, None, ()
        return name, job, seed, said, verify_job(folder).failed


def leave_interrupts():
    """Leave Ctrl-C to the process that waits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def main() -> int:
    """Make the jobs, spoil them, and print the table."""
    first, last, *only = int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:]
    only = only or list(CLASSES)
    counts: Counter[tuple[str, bool]] = Counter()
    with tempfile.TemporaryDirectory() as source, quick_jobs():
        for name, words in JOBS.items():
            assert run("make", *words, "-q", "-o", Path(source) / name) == 0, name
            assert verify_job(Path(source) / name).ok, name
        tasks = [
            (source, name, job, seed)
            for seed in range(first, last)
            for name in only
            for job in JOBS
        ]
        processes = os.cpu_count() or 1
        with (
            contextlib.suppress(KeyboardInterrupt),  # the table comes all the same
            multiprocessing.get_context("spawn").Pool(processes, leave_interrupts) as pool,
        ):
            for name, job, seed, said, failed in pool.imap_unordered(tried, tasks):
                if said is None:
                    continue
                counts[name, bool(failed)] += 1
                if not failed:
                    print(f"missed: {name}, {job}, seed {seed}: {said}", flush=True)
    print(f"{'class':20}{'tried':>8}{'caught':>8}{'missed':>8}")
    for name in only:
        caught, missed = counts[name, True], counts[name, False]
        print(f"{name:20}{caught + missed:8}{caught:8}{missed:8}")
    print(f"{'all':20}{counts.total():8}{sum(n for (_, good), n in counts.items() if good):8}"
          f"{sum(n for (_, good), n in counts.items() if not good):8}")  # fmt: skip
    return int(any(not good for _, good in counts))


if __name__ == "__main__":
    sys.exit(main())
