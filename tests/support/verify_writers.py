"""Write a specimen's files by hand-written code that shares nothing with fabweave's makers."""

import json
import math
import struct

import numpy as np
from verify_specimen import COLOURS, HAIRLINE, placed

from fabweave.core.job_folder import write_contents

LAYERS = tuple(COLOURS)
#: How far apart ribbons are said to be: the coarsest specimen has 0.27 mm.
LIMITS = {"thickness_mm": 0.2, "clearance_mm": 0.05, "width_mm": 1.0, "bend_mm": 0.005,
          "twist_deg": math.degrees(math.sqrt(6 * 0.2 / 0.005))}  # fmt: skip
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


def completed(plan):
    """Return a plan that says of each piece what is cut, and cut out: its outline, and holes."""
    for piece in plan["pieces"]:
        piece.setdefault("path", [[x, y, 0.0] for x, y in piece["outline"]])
        holes = [
            {"station": k, "kind": "hole", "x": s["x"], "y": s["y"], "diameter_mm": s["hole_mm"]}
            for k, s in enumerate(piece["stations"])
            if s["hole_mm"]
        ]
        piece.setdefault("cutouts", holes)
    return plan


def placed_path(piece):
    """Return what is cut of a piece on its sheet; with arcs, bulges stand after x and y."""
    points = placed(piece, [(x, y) for x, y, _ in piece["path"]])
    bulges = [bulge for _, _, bulge in piece["path"]]
    return [[*p, b] for p, b in zip(points, bulges, strict=True)] if any(bulges) else points


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
    for piece in completed(plan)["pieces"]:
        if piece["sheet"] != sheet["sheet"]:
            continue
        name = piece["id"]
        for layer, points, closed in specimen.engraving[name]:
            shapes.append((name, layer, "path", placed(piece, points), closed))
        for hole in piece["cutouts"]:
            (centre,) = placed(piece, [(hole["x"], hole["y"])])
            shapes.append((name, "CUT_INNER", "circle", (*centre, hole["diameter_mm"] / 2), True))
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
        put(*[] if r12 else [(420, int(colour[1:], 16)), (370, 0)])
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


def glb_bytes(strips, *, edit=None):
    binary = b""
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
                "meshes": [], "accessors": [], "bufferViews": [], "buffers": []}  # fmt: skip

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

    for label, strip in strips.items():
        positions = (np.asarray(strip["rungs"]).reshape(-1, 3) * 0.001).astype("<f4")
        triangles = np.array(strip["triangles"], dtype="<u4").reshape(-1)
        document["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": store(positions, 5126, "VEC3")},
                             "indices": store(triangles, 5125, "SCALAR")}],
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


def write_ribbons(folder):
    ribbons = {"schema": "fabweave.ribbons/1", "units": "mm", "limits": LIMITS, "findings": [],
               "threads": []}  # fmt: skip
    (folder / "ribbons.json").write_text(json.dumps(ribbons))


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


def write_plan(specimen, folder):
    (folder / "crossing_map.json").write_text(json.dumps(rounded(completed(specimen.plan))))


def write_mesh(specimen, folder):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in specimen.points.tolist()]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in specimen.faces]
    (folder / "woven_mesh.obj").write_text("\n".join(lines) + "\n")


def settings_text(specimen, **asked):
    """Return the settings: a preset of one's own, and what else is asked for."""
    asked |= {} if specimen.boundary is None else {"boundary": specimen.boundary}
    # A table [job] may follow it, where there is none yet.
    lines = ["[job]"] if asked else []
    lines += [f'{key} = "{value}"' for key, value in asked.items()]
    lines += ["[job.preset]", 'name = "own"', f"hairline_mm = {HAIRLINE}", "[job.preset.layers]"]
    lines += [f'{layer} = {{colour = "{c}", aci = {aci}}}' for layer, (c, aci) in COLOURS.items()]
    head = 'mesh = "specimen"\n[outcome]\nfasten = "all"\n'
    return head + "\n".join(lines) + "\n"


def write_tables(specimen, folder):
    """Write the tables that people work by, of all pieces, their stations, and crossings."""
    plan = completed(specimen.plan)
    pieces = {piece["id"]: piece for piece in plan["pieces"]}
    lap_of = {lap["id"]: lap for lap in plan["joints"]}
    crossings = {crossing["id"]: crossing for crossing in plan["crossings"]}
    step_of = {key: step["step"] for step in plan["steps"] for key in step["crossings"]}
    rows = {"pieces": ["id,thread,sheet,length_mm,width_mm,area_mm2,holes,kind,material,"
                       "thickness_mm"],
            "stations": ["piece,station,crossing,distance_mm,lies,partner,partner_station,joint,"
                         "mate,hole_mm,step"],
            "crossing_map": ["crossing,over_piece,over_station,under_piece,under_station,joint,"
                             "hole_mm,x,y,z"]}  # fmt: skip
    for name, piece in pieces.items():
        xs, ys = zip(*piece["outline"], strict=True)
        label = plan["threads"][piece["thread"]]["label"]
        holes = sum(math.pi * hole["diameter_mm"] ** 2 / 4 for hole in piece["cutouts"])
        area = path_area(piece["path"]) - holes
        rows["pieces"].append(
            f"{name},{label},{piece['sheet']},{max(xs) - min(xs):.3f},{max(ys) - min(ys):.3f},"
            f"{area:.3f},{len(piece['cutouts'])},{piece['kind']},,"
        )
        along, last = 0.0, None
        for at, s in enumerate(piece["stations"]):
            along += math.dist(last or (s["x"], s["y"]), (s["x"], s["y"]))
            last = s["x"], s["y"]
            partner = crossings[s["crossing"]]["under" if s["over"] else "over"]
            pair = lap_of[s["joint"]]["pieces"] if s["joint"] is not None else ["", ""]
            mate = pair[1] if pair[0] == name else pair[0]
            joint = "" if s["joint"] is None else s["joint"]
            rows["stations"].append(
                f"{name},{at},{s['crossing']},{along:.1f},{'over' if s['over'] else 'under'},"
                f"{partner['piece']},{partner['station']},{joint},{mate},{s['hole_mm'] or ''},"
                f"{step_of[s['crossing']]}"
            )
    for key, one in crossings.items():
        (up, top), (low, bottom) = (
            (end, pieces[end["piece"]]["stations"][end["station"]])
            for end in (one["over"], one["under"])
        )
        joint = top["joint"] if bottom["joint"] is None else bottom["joint"]
        rows["crossing_map"].append(
            f"{key},{up['piece']},{up['station']},{low['piece']},{low['station']},"
            f"{'' if joint is None else joint},{bottom['hole_mm'] or ''},"
            + ",".join(map(str, one["position"]))
        )
    for name, lines in rows.items():
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def path_area(path):
    """Return the area within a path: triangles from its first corner, and segments of circles."""
    area = 0.0
    for (x, y, bulge), (u, v, _) in zip(path, [*path[1:], path[0]], strict=True):
        area += (x * v - u * y) / 2
        if bulge:
            turn, chord = 4 * math.atan(bulge), math.dist((x, y), (u, v))
            area += (chord / 2 / math.sin(turn / 2)) ** 2 * (turn - math.sin(turn)) / 2
    return area


def write_job(specimen, folder):
    """Write every file that is proved of a job, and seal them."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "job.toml").write_text(settings_text(specimen))
    write_tables(specimen, folder)
    for name in ("waste", "preflight", "verdict"):
        (folder / f"{name}.json").write_text("{}")
    write_mesh(specimen, folder)
    write_plan(specimen, folder)
    (folder / "model.glb").write_bytes(glb_bytes(specimen.strips))
    write_ribbons(folder)
    write_sheets(specimen, folder)
    write_contents(folder)
    return folder
