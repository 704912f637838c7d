"""Write a specimen's files by hand-written code that shares nothing with fabweave's makers."""

import base64
import cmath
import csv
import itertools
import json
import math
import re
import struct
import zlib
from functools import cache
from types import SimpleNamespace

import numpy as np
import shapely
from pdf_writer import pdf_bytes
from verify_manual import TITLE, manual_pages
from verify_specimen import COLOURS, DENSITY, HAIRLINE, THICKNESS, placed

from fabweave.assembly.viewer.page import viewer_page
from fabweave.assembly.viewer.space import SpaceRecord
from fabweave.verify.checks.model.ribbons import measure_strip
from fabweave.verify.measure.bending import measure_bending
from fabweave.verify.measure.development import total_turn_deg
from fabweave.verify.read.glb import read_model

PIECE_COLUMNS = (
    "id", "thread", "sheet", "length_mm", "width_mm", "area_mm2", "mass_g", "holes", "kind",
    "material", "thickness_mm",
)  # fmt: skip
STATION_COLUMNS = (
    "piece", "station", "crossing", "distance_mm", "lies", "partner", "partner_station", "joint",
    "mate", "hole_mm", "step",
)  # fmt: skip
CROSSING_COLUMNS = (
    "crossing", "over_piece", "over_station", "under_piece", "under_station", "joint", "hole_mm",
    "x", "y", "z",
)  # fmt: skip
LAYERS = tuple(COLOURS)
#: How far apart ribbons are said to be: the coarsest specimen has 0.27 mm.
LIMITS = {"thickness_mm": 0.2, "clearance_mm": 0.05, "width_mm": 1.0, "bend_mm": 0.005,
          "twist_deg": math.degrees(math.sqrt(6 * 0.2 / 0.005))}  # fmt: skip
#: What is found of each rule, and what helps.
REASONS = {
    "hole": ("a hole without room", "leave those crossings without a fastener, or use glue"),
    "narrow": ("ribbons are as narrow as {narrow:.1f} mm",
               "handle these with tweezers; their labels may have no room"),
    "bodies": ("there are {bodies} bodies that no thread joins",
               "each is an object of its own; --bodies largest keeps one"),
    "ids": ("{unnamed} piece{s} no room for an id",
            "write the id on as you peel the piece, from the picture of its sheet; a larger "
            "--size, wider ribbons (--width) or --hole none make room for it"),
}  # fmt: skip
#: Where the finding about ribbons is.
PLACE = (12.0, -7.5, 30.25)


def rounded(value, digits=6):
    """Round every float of a plan."""
    if isinstance(value, float | np.floating):
        return round(float(value), digits) + 0.0
    if isinstance(value, dict):
        return {key: rounded(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item, digits) for item in value]
    return value


def piece_holes(plan, piece):
    """Return (x, y, diameter) of a piece's holes, each once."""
    holes = [(s["x"], s["y"], s["hole_mm"]) for s in piece["stations"] if s["hole_mm"]]
    for joint in plan["joints"]:
        for side in (0, 1):
            if joint["pieces"][side] != piece["id"]:
                continue
            diameter = piece["stations"][-1 if side == 0 else 0]["hole_mm"]
            holes += [(*both[side], diameter) for both in joint["holes"][1:]]
    return holes


def placed_path(piece):
    """Return what is cut of a piece on its sheet; points of arcs have their bulge after x and y."""
    if "path" not in piece:
        return placed(piece, piece["outline"])
    points = placed(piece, [(x, y) for x, y, _ in piece["path"]])
    return [[*p, bulge] for p, (_, _, bulge) in zip(points, piece["path"], strict=True)]


def svg_path(data, height, closed):
    """Return path data; a side of bulge b is part of a circle of radius c (1 + b²) / 4 b."""
    text = f"M{data[0][0]:.4f},{height - data[0][1]:.4f}"
    sides = list(zip(data, [*data[1:], data[0]], strict=True))
    for start, end in sides if closed else sides[:-1]:
        (x, y, *bulge), (u, v, *_) = start, end
        if bulge and bulge[0]:
            r = math.dist((x, y), (u, v)) * (1 + bulge[0] ** 2) / abs(4 * bulge[0])
            text += f"A{r:.6f},{r:.6f} 0 0 {int(bulge[0] < 0)} {u:.4f},{height - v:.4f}"
        elif end is not data[0]:
            text += f"L{u:.4f},{height - v:.4f}"
    return text + ("Z" if closed else "")


def sheet_shapes(specimen, plan, sheet):
    """Return (piece, layer, kind, points or circle, closed) in cutting order."""
    shapes = []
    for piece in plan["pieces"]:
        if piece["sheet"] != sheet["sheet"]:
            continue
        name = piece["id"]
        for layer, points, closed in specimen.engraving[name]:
            shapes.append((name, layer, "path", placed(piece, points), closed))
        for x, y, diameter in piece_holes(plan, piece):
            shapes.append(
                (name, "CUT_INNER", "circle", (*placed(piece, [(x, y)])[0], diameter / 2), True)
            )
        shapes.append((name, "CUT_OUTER", "path", placed_path(piece), True))
    w, h = sheet["width_mm"], sheet["height_mm"]
    shapes.append((None, "NOTES", "path", [[0, 0], [w, 0], [w, h], [0, h]], True))
    shapes.append((None, "NOTES", "path", [[5, 4], [105, 4]], False))
    return shapes


def dxf_text(shapes, sheet, *, r12=False):
    lines = []

    def put(*groups):
        for code, value in groups:
            lines.extend([f"{code:>3}", f"{value:.4f}" if isinstance(value, float) else str(value)])

    put((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009" if r12 else "AC1024"))
    if not r12:
        put((9, "$INSUNITS"), (70, 4), (9, "$MEASUREMENT"), (70, 1))
    put((9, "$EXTMIN"), (10, 0.0), (20, 0.0), (30, 0.0))
    put((9, "$EXTMAX"), (10, sheet["width_mm"]), (20, sheet["height_mm"]), (30, 0.0), (0, "ENDSEC"))
    put((0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"))
    for layer in LAYERS:
        colour, aci = COLOURS[layer]
        put((0, "LAYER"), (2, layer), (70, 0), (62, aci), (6, "Continuous"))
        put(*[] if r12 else [(420, int(colour[1:], 16))])
    put((0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES"))
    for handle, (piece, layer, kind, data, closed) in enumerate(shapes, start=0x100):
        tag = [(1001, "FABWEAVE"), (1000, piece)] if piece else []
        mark = [] if r12 else [(5, f"{handle:X}")]
        if kind == "circle":
            put((0, "CIRCLE"), *mark, (8, layer), (10, float(data[0])), (20, float(data[1])))
            put((30, 0.0), (40, float(data[2])), *tag)
        elif len(data) == 2 and not closed:
            (x, y), (u, v) = data
            put((0, "LINE"), *mark, (8, layer), (10, float(x)), (20, float(y)), (30, 0.0))
            put((11, float(u)), (21, float(v)), (31, 0.0), *tag)
        elif r12:
            put((0, "POLYLINE"), (8, layer), (66, 1), (10, 0.0), (20, 0.0), (30, 0.0))
            put((70, int(closed)), *tag)
            for x, y, *bulge in data:
                put((0, "VERTEX"), (8, layer), (10, float(x)), (20, float(y)), (30, 0.0))
                put(*[(42, f"{b:.9f}") for b in bulge])
            put((0, "SEQEND"), (8, layer))
        else:
            put((0, "LWPOLYLINE"), *mark, (8, layer), (90, len(data)), (70, int(closed)))
            for x, y, *bulge in data:
                put((10, float(x)), (20, float(y)), *[(42, f"{b:.9f}") for b in bulge])
            put(*tag)
    put((0, "ENDSEC"), (0, "EOF"))
    return "\n".join(lines) + "\n"


def svg_text(shapes, sheet):
    w, h = sheet["width_mm"], sheet["height_mm"]
    out = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="{w:g}mm" height="{h:g}mm" viewBox="0 0 {w:g} {h:g}">',
    ]
    for layer in LAYERS:
        out.append(f'<g id="{layer}" inkscape:groupmode="layer" inkscape:label="{layer}">')
        count = {}
        for k, (piece, own, kind, data, closed) in enumerate(shapes):
            if own != layer:
                continue
            count[piece] = count.get(piece, 0) + 1
            suffix = {"CUT_OUTER": "outline", "CUT_INNER": f"hole.{count[piece]}"}.get(
                layer, f"mark.{k}"
            )
            name = f"{piece}.{suffix}" if piece else f"note.{k}"
            title = f"<title>{piece}</title>" if piece else ""
            look = f'fill="none" stroke="{COLOURS[layer][0]}" stroke-width="{HAIRLINE}"'
            if kind == "circle":
                x, y, r = data
                out.append(
                    f'<circle id="{name}" cx="{x:.4f}" cy="{h - y:.4f}" r="{r:.4f}" {look}>'
                    f"{title}</circle>"
                )
            else:
                out.append(
                    f'<path id="{name}" d="{svg_path(data, h, closed)}" {look}>{title}</path>'
                )
        out.append("</g>")
    out.append("</svg>")
    return "\n".join(out) + "\n"


#: Colours of threads that differ well from one another.
WORDS = ("#0072b2", "#d55e00", "#f0e442", "#009e73", "#000000", "#cc79a7", "#56b4e9", "#ffffff",
         "#801010", "#7f7f7f", "#30ff30", "#4000ff")  # fmt: skip


def colour_word(strips, label):
    """Return a colour for a thread of a specimen, which none of the others has."""
    return WORDS[sorted(strips).index(label) % len(WORDS)]


def paint(word):
    """Return a material of a colour."""
    share = [int(word[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    light = [((part + 0.055) / 1.055) ** 2.4 if part > 0.04045 else part / 12.92 for part in share]
    return {"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [*light, 1.0]}}


def glb_bytes(strips, *, edit=None):
    binary = b""
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
                "meshes": [], "accessors": [], "bufferViews": [], "buffers": [],
                "materials": [paint(colour_word(strips, label)) for label in strips]}  # fmt: skip

    def store(array, kind, shape):
        nonlocal binary
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes}
        )
        binary += array.tobytes()
        document["accessors"].append(
            {"bufferView": len(document["bufferViews"]) - 1, "componentType": kind,
             "count": len(array), "type": shape}
        )  # fmt: skip
        return len(document["accessors"]) - 1

    for number, (label, strip) in enumerate(strips.items()):
        positions = (np.asarray(strip["rungs"]).reshape(-1, 3) * 0.001).astype("<f4")
        triangles = np.array(strip["triangles"], dtype="<u4").reshape(-1)
        document["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": store(positions, 5126, "VEC3")},
                             "indices": store(triangles, 5125, "SCALAR"), "material": number}],
             "extras": {key: strip[key] for key in ("closed", "entry", "exit")}}
        )  # fmt: skip
        document["nodes"].append({"name": label, "mesh": len(document["meshes"]) - 1})
        document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
    # A ball at the finding, here of two triangles.
    corners = np.add(PLACE, [[-1, -1, -1], [1, 1, 1], [1, -1, 1], [-1, 1, -1]]) * 0.001
    document["meshes"].append(
        {"primitives": [{"attributes": {"POSITION": store(corners.astype("<f4"), 5126, "VEC3")},
                         "indices": store(np.array([0, 1, 2, 0, 3, 1], "<u4"), 5125, "SCALAR")}],
         "extras": {"finding": 1}}
    )  # fmt: skip
    document["nodes"].append({"name": "finding-1", "mesh": len(document["meshes"]) - 1})
    document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
    document["buffers"].append({"byteLength": len(binary)})
    if edit is not None:
        edit(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(binary), 0x004E4942) + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def png_bytes(wide=30, high=20):
    """Return a white picture with a black line."""

    def chunk(kind, body):
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    head = struct.pack(">IIBBBBB", wide, high, 8, 0, 0, 0, 0)
    rows = (b"\0" + b"\xff" * wide) * (high - 1) + b"\0" * (wide + 1)
    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def areas(plan, piece):
    holes = [d for _, _, d in piece_holes(plan, piece)]
    path = piece.get("path") or [(x, y, 0.0) for x, y in piece["outline"]]
    polygon = shapely.Polygon([(x, y) for x, y, _ in path])
    area, length = polygon.area, polygon.length
    for (x, y, bulge), (u, v, _) in zip(path, [*path[1:], path[0]], strict=True):
        if bulge:
            turn, chord = 4 * math.atan(abs(bulge)), math.dist((x, y), (u, v))
            r = chord / 2 / math.sin(turn / 2)
            area += math.copysign(r * r / 2 * (turn - math.sin(turn)), bulge)
            length += r * turn - chord
    return area, sum(math.pi * d * d / 4 for d in holes), holes, length


def least_rectangle(points):
    return least_rectangle_of(tuple(map(tuple, points)))


@cache
def least_rectangle_of(points):
    """Find it once for the many specimens that have the same outlines."""
    hull = np.array(shapely.MultiPoint(points).convex_hull.exterior.coords)
    best = None
    for a, b in itertools.pairwise(hull):
        angle = -math.atan2(b[1] - a[1], b[0] - a[0])
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        size = np.ptp(hull @ turn.T, axis=0)
        if best is None or size.prod() < best.prod() - 1e-9:
            best = size
    return max(best), min(best)


def write_tables(specimen, folder):
    plan = specimen.plan
    piece_of = {piece["id"]: piece for piece in plan["pieces"]}
    with (folder / "pieces.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(PIECE_COLUMNS)
        for piece in plan["pieces"]:
            outline, hole, holes, _ = areas(plan, piece)
            length, width = least_rectangle(piece["outline"])
            mass = (outline - hole) * THICKNESS * DENSITY * 1e-6
            rows.writerow([piece["id"], piece["thread"], piece["sheet"], f"{length:.2f}",
                           f"{width:.2f}", f"{outline - hole:.2f}", f"{mass:.3f}",
                           len(holes), piece["kind"], "card", THICKNESS])  # fmt: skip
    joint_at = {joint["crossing"]: joint["id"] for joint in plan["joints"]}
    with (folder / "crossing_map.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(CROSSING_COLUMNS)
        for crossing in plan["crossings"]:
            over, under = crossing["over"], crossing["under"]
            hole = piece_of[under["piece"]]["stations"][under["station"]]["hole_mm"]
            rows.writerow([crossing["id"], over["piece"], over["station"], under["piece"],
                           under["station"], joint_at.get(crossing["id"], ""),
                           "" if hole is None else hole,
                           *(round(x, 6) for x in crossing["position"])])  # fmt: skip


def write_stations(specimen, folder):
    plan = specimen.plan
    crossings = {crossing["id"]: crossing for crossing in plan["crossings"]}
    joints = {joint["id"]: joint["pieces"] for joint in plan["joints"]}
    with (folder / "stations.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(STATION_COLUMNS)
        for piece in plan["pieces"]:
            along, last = 0.0, piece["stations"][0] if piece["stations"] else None
            for k, s in enumerate(piece["stations"]):
                along += math.dist((last["x"], last["y"]), (s["x"], s["y"]))
                last = s
                other = crossings[s["crossing"]]["under" if s["over"] else "over"]
                mate = next(
                    (name for name in joints.get(s["joint"], ()) if name != piece["id"]),
                    piece["id"] if s["joint"] in joints else "",
                )
                steps = [t["step"] for t in plan["steps"] if s["crossing"] in t["crossings"]]
                rows.writerow([piece["id"], k, s["crossing"], f"{along:.2f}",
                               "over" if s["over"] else "under", s["partner"], other["station"],
                               "" if s["joint"] is None else s["joint"], mate,
                               "" if s["hole_mm"] is None else s["hole_mm"],
                               steps[-1] if steps else ""])  # fmt: skip


def engraved_length(specimen):
    total = 0.0
    for shapes in specimen.engraving.values():
        for _, points, closed in shapes:
            run = [*points, points[0]] if closed else points
            total += sum(math.dist(a, b) for a, b in itertools.pairwise(run))
    return total


def write_waste(specimen, folder):
    plan = specimen.plan
    keys = (
        "area_mm2", "piece_area_mm2", "hole_area_mm2", "waste_mm2", "pieces", "cut_length_mm",
        "pierces",
    )  # fmt: skip
    sheets, n_holes = [], 0
    for sheet in plan["sheets"]:
        entry = dict.fromkeys(keys, 0)
        entry |= {key: sheet[key] for key in ("sheet", "width_mm", "height_mm")}
        entry["area_mm2"] = sheet["width_mm"] * sheet["height_mm"]
        for piece in plan["pieces"]:
            if piece["sheet"] == sheet["sheet"]:
                outline, hole, holes, length = areas(plan, piece)
                entry["piece_area_mm2"] += outline - hole
                entry["hole_area_mm2"] += hole
                entry["pieces"] += 1
                entry["cut_length_mm"] += length + sum(math.pi * d for d in holes)
                entry["pierces"] += 1 + len(holes)
                n_holes += len(holes)
        used = entry["piece_area_mm2"]
        entry["waste_mm2"] = entry["area_mm2"] - used
        entry["utilisation"] = used / entry["area_mm2"]
        sheets.append(entry)
    totals = {key: sum(entry[key] for entry in sheets) for key in keys}
    totals["utilisation"] = 1 - totals["waste_mm2"] / totals["area_mm2"]
    totals |= {"sheets": len(sheets), "holes": n_holes}
    totals["engrave_length_mm"] = engraved_length(specimen)
    waste = {"schema": "fabweave.waste/1", "units": "mm", "sheets": sheets, "totals": totals}
    waste["offcuts"] = []
    (folder / "waste.json").write_text(json.dumps(rounded(waste)))


def write_page(specimen, folder):
    """Write the page on material: the verdict, and the table of sheets."""
    plan = specimen.plan
    waste, verdict = (json.loads((folder / name).read_text())
                      for name in ("waste.json", "verdict.json"))  # fmt: skip
    names = {sheet["sheet"]: sheet["name"] for sheet in plan["sheets"]}
    heads = ("Sheet", "Size, mm", "Pieces", "Pieces, cm²", "Holes, cm²", "Waste with holes, cm²",
             "Used", "")  # fmt: skip
    rows = "".join(f"<th>{head}</th>" for head in heads)
    for entry in (*waste["sheets"], waste["totals"]):
        size = f"{entry['width_mm']:g} × {entry['height_mm']:g}" if "sheet" in entry else ""
        share = f"{100 * entry['utilisation']:.1f}"
        areas = (entry[key] / 100 for key in ("piece_area_mm2", "hole_area_mm2", "waste_mm2"))
        cells = [names.get(entry.get("sheet"), "all"), size, entry["pieces"],
                 *(f"{area:.1f}" for area in areas), f"{share} %",
                 f'<div class="bar"><span style="width:{share}%"></span></div>']  # fmt: skip
        rows += "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
    reasons = "".join(f"<li>{reason['text']}; {reason['advice']}</li>"
                      for reason in verdict["reasons"])  # fmt: skip
    pictures = "".join(f'<img src="sheets/{name}.png"><figcaption>{name}</figcaption>'
                       for name in names.values())  # fmt: skip
    page = (
        f"<html><title>{TITLE}: material</title><h1>{TITLE}: material</h1>"
        f'<div class="verdict with-care"><p>Can it be built? Yes, with care.</p>{reasons}</div>'
        f"<h2>Sheets</h2><table><tr>{rows}</table><h2>Pictures</h2>{pictures}</html>"
    )
    (folder / "waste.html").write_text(page, encoding="utf-8")


def bend_figures(strip):
    """Return figures as verify measures them; test_verify_bends holds these against the makers'."""
    bending = measure_bending(strip, measure_strip(strip)[1])
    least = [np.nanmin(np.append(each, np.inf)) for each in (bending.span_radius_mm,
                                                             bending.radius_mm)]  # fmt: skip
    least = [float(value) if np.isfinite(value) else None for value in least]
    return {"bend_mm": least[0], "modelled_bend_mm": least[1], "fold_deg": bending.fold_deg,
            "crease_deg": float(np.nanmax(np.append(bending.turn_deg, 0.0))),
            "twist_deg": float(np.nanmax(np.append(bending.span_twist_deg, 0.0))),
            "wave_deg": total_turn_deg(strip)[0] / len(strip.entry)}  # fmt: skip


def write_ribbons(specimen, folder):
    threads = []
    model = folder / "model.glb"
    if not model.exists():
        model.write_bytes(glb_bytes(specimen.strips))
    bent = read_model(model)[0]
    for thread in specimen.plan["threads"]:
        strip = specimen.strips.get(thread["label"])
        if strip is None or not thread["crossings"]:
            continue
        ends = [np.asarray(rung, dtype=float) for rung in strip["rungs"]]
        middle = [(right + left) / 2 for right, left in ends]
        ways = [b - a for a, b in itertools.pairwise(middle)]
        if strip["closed"]:
            ways.append(middle[0] - middle[-1])
        widths = []
        for at, (right, left) in enumerate(ends):
            near = [at - 1, at] if strip["closed"] else [k for k in (at - 1, at) if k >= 0]
            near = [ways[k] for k in near if k < len(ways)]
            way = sum(v / math.dist(v, (0, 0, 0)) for v in near)
            way /= math.dist(way, (0, 0, 0))
            rung = left - right
            widths.append(math.sqrt(max(rung @ rung - (rung @ way) ** 2, 0.0)))
        threads.append(
            {"thread": thread["label"], "crossings": len(thread["crossings"]),
             "length_mm": sum(math.dist(v, (0, 0, 0)) for v in ways),
             "narrowest_mm": min(widths), "widest_mm": max(widths),
             **bend_figures(bent[thread["label"]])}
        )  # fmt: skip
    first = threads[0]["thread"]
    crossings = next(t["crossings"] for t in specimen.plan["threads"] if t["label"] == first)
    finding = {"rule": "hole", "severity": "warn", "thread": first, "station": 1,
               "crossing": crossings[1], "other": None, "position": list(PLACE),
               "count": 1, "of": len(specimen.plan["crossings"]), "far": 0,
               "text": REASONS["hole"][0]}  # fmt: skip
    ribbons = {"schema": "fabweave.ribbons/1", "units": "mm", "findings": [finding],
               "limits": LIMITS,
               "threads": rounded(threads)}  # fmt: skip
    (folder / "ribbons.json").write_text(json.dumps(ribbons))


def write_verdict(specimen, folder):
    """State the verdict: a hole without room wants care, and what else there is."""
    ribbons = json.loads((folder / "ribbons.json").read_text())
    rules = [finding["rule"] for finding in ribbons["findings"]]
    narrow = min(thread["narrowest_mm"] for thread in ribbons["threads"])
    if narrow < 4.0:
        rules.append("narrow")
    body = {}
    for crossing in specimen.plan["crossings"]:
        pair = [body.get(crossing[side]["thread"], {crossing[side]["thread"]})
                for side in ("over", "under")]  # fmt: skip
        body |= dict.fromkeys(pair[0] | pair[1], pair[0] | pair[1])
    bodies = len({frozenset(threads) for threads in body.values()})
    if bodies > 1:
        rules.append("bodies")
    unnamed = sum(any(dropped["kind"] == "id" for dropped in piece["dropped"])
                  for piece in specimen.plan["pieces"])  # fmt: skip
    if unnamed:
        rules.append("ids")
    figures = {"narrow": narrow, "bodies": bodies, "unnamed": unnamed,
               "s": " has" if unnamed == 1 else "s have"}  # fmt: skip
    reasons = [{"rule": rule, "level": "with care", "text": REASONS[rule][0].format(**figures),
                "advice": REASONS[rule][1]} for rule in rules]  # fmt: skip
    verdict = {"schema": "fabweave.verdict/1", "units": "mm", "level": "with care",
               "reasons": reasons, "forced": False}  # fmt: skip
    (folder / "verdict.json").write_text(json.dumps(verdict))


def write_preflight(specimen, folder):
    """State flaws that are true: the limits are what they fall short of."""
    piece = next(p for p in specimen.plan["pieces"] if any(s["hole_mm"] for s in p["stations"]))
    station = next(s for s in piece["stations"] if s["hole_mm"])
    place = piece["placement"]
    turn = cmath.rect(1.0, math.radians(place["rotation_deg"]))
    centre = complex(station["x"], station["y"])
    at = turn * centre + complex(place["x_mm"], place["y_mm"])
    sides = [complex(*end) for end in piece["outline"]]
    edge = min(
        abs(a + min(max(((centre - a) / (b - a)).real, 0.0), 1.0) * (b - a) - centre)
        for a, b in zip(sides, [*sides[1:], sides[0]], strict=True)
    )
    own = {"piece": piece["id"], "sheet": piece["sheet"], "place": [at.real, at.imag], "count": 1}
    hole = station["hole_mm"]
    flaws = [
        {"rule": "hole", **own, "value_mm": hole, "limit_mm": hole + 0.5},
        {"rule": "hole-edge", **own, "value_mm": edge, "limit_mm": edge + 0.1},
        {"rule": "sheet", "piece": None, "sheet": 1, "place": None, "count": 1,
         "value_mm": specimen.plan["sheets"][0]["width_mm"], "limit_mm": 100.0},
    ]  # fmt: skip
    preflight = {"schema": "fabweave.preflight/1", "units": "mm", "target": "default",
                 "flaws": rounded(flaws)}  # fmt: skip
    (folder / "preflight.json").write_text(json.dumps(preflight))


def write_sheets(specimen, folder, *, r12=False, edit=None):
    """Write the drawings; ``edit`` changes the list of shapes of each sheet."""
    (folder / "sheets").mkdir(exist_ok=True)
    for sheet in specimen.plan["sheets"]:
        shapes = sheet_shapes(specimen, specimen.plan, sheet)
        if edit is not None:
            shapes = edit(sheet, shapes)
        stem = folder / "sheets" / sheet["name"]
        stem.with_suffix(".dxf").write_text(dxf_text(shapes, sheet, r12=r12))
        stem.with_suffix(".svg").write_text(svg_text(shapes, sheet))
        size = (round(sheet["width_mm"]), round(sheet["height_mm"]))
        stem.with_suffix(".png").write_bytes(png_bytes(*size))


def write_plan(specimen, folder):
    (folder / "crossing_map.json").write_text(json.dumps(rounded(specimen.plan)))


POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"


def piece_rungs(plan, strips, piece):
    """Return the rungs of a piece's strip and where its panels begin; nothing if there are none."""
    thread = next((one for one in plan["threads"] if one["id"] == piece["thread"]), None)
    strip = strips.get(thread["label"]) if thread else None
    wanted = [station["crossing"] for station in piece["stations"]]
    if strip is None or not wanted or len(strip["entry"]) != len(thread["crossings"]):
        return [], []
    size, count = len(thread["crossings"]), len(strip["rungs"])
    starts = [
        start
        for start in range(size)
        if all(thread["crossings"][(start + k) % size] == key for k, key in enumerate(wanted))
    ]
    if not starts:
        return [], []
    over = piece["stations"][0]["over"]
    start = min(starts, key=lambda start: (thread["over"][start] != over, start))
    rung = strip["entry"][start]
    if start == 0 and not strip["closed"]:
        rung = 0
    last = strip["exit"][(start + len(wanted) - 1) % size]
    if start + len(wanted) == size and not strip["closed"]:
        last = count - 1
    walk, panels, at = [rung], [], 0
    while True:
        if at < len(wanted) and walk[-1] == strip["entry"][(start + at) % size]:
            panels.append(len(walk) - 1)
            at += 1
        if at == len(wanted) and walk[-1] == last and len(walk) > 1:
            return walk, panels
        walk.append((walk[-1] + 1) % count)


def viewer_data(specimen, plan, *, edit=None):
    counts, colours, panels, points, right = [], [], [], [], []
    for piece in plan["pieces"]:
        walk, own = piece_rungs(plan, specimen.strips, piece)
        label = next((t["label"] for t in plan["threads"] if t["id"] == piece["thread"]), None)
        strip = specimen.strips.get(label)
        counts.append(len(walk))
        colours.append([[colour_word(specimen.strips, label), len(walk)]] if strip else [])
        panels.append(own)
        for rung in walk:
            points.append(np.asarray(strip["rungs"][rung], dtype=float))
            steps = strip["triangles"][2 * rung : 2 * rung + 2]
            shared = set(steps[0]) & set(steps[1]) if len(steps) == 2 else set()
            right.append(2 * rung in shared)
    corners = np.array(points).reshape(-1, 3)
    low = corners.min(axis=0)
    step = float((corners.max(axis=0) - low).max()) / 65535
    whole = [[round(float(x)) for x in point] for point in (corners - low) / step]
    data = {
        "schema": "fabweave.viewer/1",
        # Specimens have no estimate.
        "hands": None,
        # Their manual shows all steps from one side.
        "views_deg": [[-60.0, 35.0] for step in plan["steps"] if "ring" not in step],
        "plan": rounded(plan, 3),
        "colours": colours,
        "space": {
            "origin_mm": low.tolist(),
            "step_mm": step,
            "counts": counts,
            "panels": panels,
            "rungs": base64.b64encode(
                b"".join(struct.pack("<3H", *point) for point in whole)
            ).decode(),
            "from_right": base64.b64encode(bytes(right)).decode(),
        },
    }
    if edit is not None:
        edit(data)
    return data


def write_viewer(specimen, folder, *, edit=None, policy=POLICY, body=""):
    """Write the viewer; ``edit`` changes its data."""
    data = json.dumps(viewer_data(specimen, specimen.plan, edit=edit)).replace("<", "\\u003c")
    page = re.sub("<title>[^<]*", "<title>specimen: assembly", shipped_page(), count=1)
    page = re.sub("<h1>[^<]*", "<h1>specimen", page, count=1)
    page = re.sub(r'(<script id="data"[^>]*>)[^<]*', lambda start: start[1] + data, page)
    assert POLICY in page
    page = page.replace(POLICY, policy).replace("</body>", body + "</body>")
    (folder / "assembly.html").write_text(page, encoding="utf-8")


@cache
def shipped_page():
    """Return the page as it is shipped, around other data."""
    crossing_map = SimpleNamespace(to_json=dict)
    space = SpaceRecord(
        layer_mm=0.0,
        origin_mm=(0.0, 0.0, 0.0),
        step_mm=1.0,
        counts=(),
        panels=(),
        rungs="",
        from_right="",
    )
    return viewer_page(crossing_map, space, title="", colours=np.zeros((0, 3), np.uint8),
                       view_deg=(0.0, 0.0), hands={})  # fmt: skip


def _sign(corners, operator):
    """Draw a small round sign, filled with black or not."""
    turns = [2 * math.pi * at / corners for at in range(corners)]
    (x, y), *others = [(300 + 2 * math.cos(turn), 300 + 2 * math.sin(turn)) for turn in turns]
    lines = " ".join(f"{a:.5f} {b:.5f} l" for a, b in others)
    return f"0 g n {x:.5f} {y:.5f} m {lines} h {operator}\n"


#: How signs are drawn that the fonts of a PDF have not.
SIGNS = {"●": _sign(24, "B"), "○": _sign(24, "S"), "⊕": _sign(20, "S")}


def write_manual(specimen, folder, *, edit=None):
    """Write the manual; ``edit`` changes the list of the texts of all pages."""
    pages = manual_pages(specimen, json.loads((folder / "verdict.json").read_text()))
    count = len(pages)
    heads = [f"{TITLE}, page {number} / {count}" for number in range(1, count + 1)]
    texts = [text for head, (name, own, _) in zip(heads, pages, strict=True)
             for text in (name, head, *own)]  # fmt: skip
    if edit is not None:
        edit(texts)
    ends = [texts.index(head) - 1 for head in heads[1:]] + [len(texts)]
    contents = []
    for (start, end), (_, _, drawn) in zip(itertools.pairwise([0, *ends]), pages, strict=True):
        content = drawn
        for text in texts[start:end]:
            if text in SIGNS:
                content += SIGNS[text]
                continue
            shown = re.sub(r"([()\\])", r"\\\1", text)
            content += f"BT /F1 9 Tf 1 0 0 1 36 36 Tm ({shown}) Tj ET\n"
        contents.append(zlib.compress(content.encode("cp1252")))
    data = pdf_bytes(*contents, filters=b"/Filter [ /FlateDecode ]")
    (folder / "assembly.pdf").write_bytes(data)


def write_mesh(specimen, folder):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in specimen.points.tolist()]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in specimen.faces]
    (folder / "woven_mesh.obj").write_text("\n".join(lines) + "\n")


def write_job(specimen, folder):
    """Write every file of a job."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = f'mesh = "specimen"\n[material]\nthickness_mm = {THICKNESS}\n'
    settings += f"density_kg_m3 = {DENSITY}\n"
    asked = {} if specimen.boundary is None else {"boundary": specimen.boundary}
    if asked:
        settings += "[job]\n" + "".join(f'{key} = "{value}"\n' for key, value in asked.items())
    (folder / "job.toml").write_text(settings)
    write_mesh(specimen, folder)
    write_plan(specimen, folder)
    (folder / "model.glb").write_bytes(glb_bytes(specimen.strips))
    write_tables(specimen, folder)
    write_stations(specimen, folder)
    write_waste(specimen, folder)
    write_ribbons(specimen, folder)
    write_preflight(specimen, folder)
    write_verdict(specimen, folder)
    write_page(specimen, folder)
    write_viewer(specimen, folder)
    write_manual(specimen, folder)
    write_sheets(specimen, folder)
    (folder / "render.png").write_bytes(png_bytes())
    return folder
