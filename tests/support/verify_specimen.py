"""Make a small finished job by hand-written code that shares nothing with fabweave.

Plain loops over dictionaries, slow and obvious: mesh, walks, ribbons by the projection method,
unfolding triangle by triangle, splitting at given places, placing in rows.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

MARGIN, GAP = 10.0, 3.0
HAIRLINE = 0.05
#: Of each layer: its exact colour, and the AutoCAD colour index.
COLOURS = {
    "ENGRAVE_LABEL": ("#112233", 8),
    "ENGRAVE_MARK": ("#000000", 7),
    "CUT_INNER": ("#0000FF", 5),
    "CUT_OUTER": ("#FF0000", 1),
    "NOTES": ("#00FF00", 3),
}
SHEET = (600.0, 400.0)
HOLE = 2.0


# --- meshes -------------------------------------------------------------------------------------


def torus(m, n, ring=60.0, tube=30.0):
    points, faces = [], []
    for i, j in itertools.product(range(m), range(n)):
        a, b = 2 * math.pi * i / m, 2 * math.pi * j / n
        r = ring + tube * math.cos(b)
        points.append((r * math.cos(a), r * math.sin(a), tube * math.sin(b)))
        k, nxt = (i + 1) % m, (j + 1) % n
        faces.append((i * n + j, k * n + j, k * n + nxt, i * n + nxt))
    return np.array(points), faces


def octahedron(size=60.0):
    points = size * np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float
    )
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    return points, faces


def saddle(n=4, step=40.0, *, across=None):
    m = n if across is None else across
    points = [
        (step * i, step * j, 0.08 * step * (i - n / 2) * (j - m / 2))
        for i in range(n + 1)
        for j in range(m + 1)
    ]
    w = m + 1
    faces = [
        (i * w + j, (i + 1) * w + j, (i + 1) * w + j + 1, i * w + j + 1)
        for i in range(n)
        for j in range(m)
    ]
    return np.array(points), faces


# --- walks --------------------------------------------------------------------------------------


class Corners:
    """Half-edges (face, index) in dictionaries."""

    def __init__(self, faces):
        self.faces = faces
        self.all = [(f, i) for f, face in enumerate(faces) for i in range(len(face))]
        where = {(self.tail(h), self.tail(self.next(h))): h for h in self.all}
        self.twin = {h: where.get((self.tail(self.next(h)), self.tail(h))) for h in self.all}

    def next(self, h):
        return h[0], (h[1] + 1) % len(self.faces[h[0]])

    def prev(self, h):
        return h[0], (h[1] - 1) % len(self.faces[h[0]])

    def tail(self, h):
        return self.faces[h[0]][h[1]]

    def edge(self, h):
        return tuple(sorted((self.tail(h), self.tail(self.next(h)))))


def walk_threads(corners):
    """Trace threads by the successor rule; a pass is (half-edge of the face it leaves, forward)."""

    def step(h, forward):
        across = corners.next(h) if forward else h
        twin = corners.twin[across]
        if twin is None:
            return across, None
        return across, (corners.prev(twin), False) if forward else (twin, True)

    seen, threads = set(), []

    def follow(h, forward):
        passes = []
        while True:
            seen.add(h)
            across, state = step(h, forward)
            if state is None:
                return passes
            passes.append((across, forward))
            h, forward = state
            if h in seen:
                return passes

    for h in corners.all:
        if h not in seen and corners.twin[h] is None:
            threads.append((False, follow(h, True)))
        if h not in seen and corners.twin[corners.next(h)] is None:
            threads.append((False, follow(h, False)))
    for h in corners.all:
        if h not in seen:
            threads.append((True, follow(h, True)))
    return threads


def walk_turning(corners):
    """Trace threads that turn back at the boundary; and for each pass the turns that follow it.

    A turn is (boundary half-edge, whether it is walked forward).
    """
    seen, threads, turns = set(), [], {}
    for start in corners.all:
        if start in seen:
            continue
        passes, lead = [], []
        h, forward = start, True
        while True:
            seen.add(h)
            across = corners.next(h) if forward else h
            twin = corners.twin[across]
            if twin is None:
                (turns[passes[-1]] if passes else lead).append((across, forward))
                h = across if forward else corners.prev(across)
            else:
                passes.append((across, forward))
                turns[across, forward] = []
                h, forward = (corners.prev(twin), False) if forward else (twin, True)
            if (h, forward) == (start, True):
                break
        if passes:
            turns[passes[-1]] += lead
        threads.append((True, passes))
    return threads, turns


# --- twill --------------------------------------------------------------------------------------


def count_broken(corners, threads, sense):
    """Count broken edge, face and vertex conditions, window by window."""
    edge = 0
    for closed, passes in threads:
        ring = [corners.edge(h) for h, _ in passes]
        n = len(ring)
        for i in range(n if closed else n - 2):
            edge += sense[ring[i]] == sense[ring[(i + 2) % n]]

    def rotations(cycles):
        total = 0
        for cycle in cycles:
            n = len(cycle)
            for i in range(n if n > 3 else 0):
                a, b, c, d = (sense.get(cycle[(i + k) % n]) for k in range(4))
                if None not in (a, b, c, d):
                    total += b != c and a != d
        return total

    face = rotations(
        [[corners.edge((f, i)) for i in range(len(p))] for f, p in enumerate(corners.faces)]
    )
    stars = []
    for vertex in sorted({corners.tail(h) for h in corners.all}):
        out = {h for h in corners.all if corners.tail(h) == vertex}
        ring, h = [], min(out)
        while h is not None and h in out:
            out.discard(h)
            ring.append(corners.edge(h))
            h = corners.twin[corners.prev(h)]
        stars.append(ring)
    return edge, face, rotations(stars)


def exact_twill(corners, threads):
    """Find twist senses without a broken condition: parities, then all free bits."""
    parent, parity = {}, {}

    def find(e):
        flips = 0
        while parent.get(e, e) != e:
            flips ^= parity[e]
            e = parent[e]
        return e, flips

    edges = sorted({corners.edge(h) for _, passes in threads for h, _ in passes})
    for closed, passes in threads:
        ring = [corners.edge(h) for h, _ in passes]
        for i in range(len(ring) if closed else len(ring) - 2):
            (a, p), (b, q) = find(ring[i]), find(ring[(i + 2) % len(ring)])
            if a != b:
                parent[a], parity[a] = b, p ^ q ^ 1
    roots = sorted({find(e)[0] for e in edges})
    for bits in itertools.product((0, 1), repeat=len(roots)):
        value = dict(zip(roots, bits, strict=True))
        sense = {e: bool(value[find(e)[0]] ^ find(e)[1]) for e in edges}
        if count_broken(corners, threads, sense) == (0, 0, 0):
            return sense
    raise AssertionError("no exact twill on this mesh")


# --- ribbons and unfolding ----------------------------------------------------------------------


def quad_of(points, corners, h, forward):
    """Return right entry, left entry, right exit, left exit in the plane, normal, middle."""
    t = corners.twin[h]
    tail, head = points[corners.tail(h)], points[corners.tail(t)]
    left = np.mean([points[v] for v in corners.faces[h[0]]], axis=0)
    right = np.mean([points[v] for v in corners.faces[t[0]]], axis=0)
    normal = np.cross(head - tail, left - right)
    normal /= np.linalg.norm(normal)
    middle = (tail + head + left + right) / 4
    order = (tail, left, right, head) if forward else (left, head, tail, right)
    return [p - np.dot(p - middle, normal) * normal for p in order], normal, middle


def rim_rungs(points, corners, side, forward, rim):
    """Return two rungs in the triangle of a boundary half-edge; ``rim`` is how far they reach."""
    tail, head = points[corners.tail(side)], points[corners.tail(corners.next(side))]
    centre = np.mean([points[v] for v in corners.faces[side[0]]], axis=0)
    for u in (0.2, 0.8) if forward else (0.8, 0.2):
        ray = tail + u * (head - tail) - centre
        near, far = centre + 0.25 * ray, centre + rim * ray
        yield (far, near) if forward else (near, far)


def ribbon(points, corners, closed, passes, over, height, c, w, *, turns=None, rim=0.9):
    rungs, entry = [], []

    def rung(quad, u, lift):
        re, le, rx, lx = quad
        right, left = re + u * (rx - re), le + u * (lx - le)
        v = (1 - w) / 2
        rungs.append((right + v * (left - right) + lift, left + v * (right - left) + lift))

    for k, ((h, forward), top) in enumerate(zip(passes, over, strict=True)):
        quad, normal, _ = quad_of(points, corners, h, forward)
        lift = (height if top else -height) * normal
        if not closed and k == 0:
            rung(quad, 0.0, lift)
        entry.append(len(rungs))
        rung(quad, (1 - c) / 2, lift)
        rung(quad, (1 + c) / 2, lift)
        for side, way in turns[h, forward] if turns else ():
            rungs.extend(rim_rungs(points, corners, side, way, rim))
        if not closed and k == len(passes) - 1:
            rung(quad, 1.0, lift)
    return np.array(rungs), entry


def strip_triangles(count, closed):
    """Return triangles, with the diagonal changing sides so that both kinds are met."""
    triangles = []
    for r in range(count if closed else count - 1):
        a, b, c, d = 2 * r, 2 * ((r + 1) % count), 2 * ((r + 1) % count) + 1, 2 * r + 1
        triangles += [(a, b, c), (a, c, d)] if r % 2 else [(a, b, d), (b, c, d)]
    return triangles


def lay(p, q, x, flat_p, flat_q, left):
    """Lay x beside the flattened segment pq by the angle at p."""
    u, v = q - p, x - p
    cosine = np.dot(u, v) / np.linalg.norm(u) / np.linalg.norm(v)
    angle = math.acos(max(-1.0, min(1.0, cosine))) * (1 if left else -1)
    along = (flat_q - flat_p) / abs(flat_q - flat_p)
    return flat_p + along * np.linalg.norm(v) * complex(math.cos(angle), math.sin(angle))


def unfold(rungs, first, last):
    """Unfold rungs first..last of a strip, which may run on around a ring; complex numbers."""
    n = len(rungs)
    flat = [(0j, 1j * np.linalg.norm(rungs[first % n][1] - rungs[first % n][0]))]
    for r in range(first, last):
        (a, d), (b, c) = rungs[r % n], rungs[(r + 1) % n]
        fa, fd = flat[-1]
        if (r % n) % 2:
            fc = lay(a, d, c, fa, fd, False)
            fb = lay(a, c, b, fa, fc, False)
        else:
            fb = lay(a, d, b, fa, fd, False)
            fc = lay(d, b, c, fd, fb, True)
        flat.append((fb, fc))
    return flat


# --- the job ------------------------------------------------------------------------------------


@dataclass
class Specimen:
    points: np.ndarray
    faces: list
    plan: dict
    strips: dict
    engraving: dict
    boundary: str | None = None


def pair(z):
    return [z.real, z.imag]


def cut_places(closed, over, wanted, on_top):
    """Return where to joint a thread: under, evenly, as many as wanted."""
    n = len(over)
    under = [k for k in range(n) if over[k] == on_top and (closed or 0 < k < n - 1)]
    wanted = min(wanted, len(under))
    return [under[(i * len(under)) // wanted] for i in range(wanted)] if wanted else []


def make_specimen(  # noqa: PLR0912, PLR0915 - one obvious loop
    mesh,
    *,
    pattern="plain",
    joints=3,
    on_top=False,
    height=0.6,
    c=0.7,
    w=0.6,
    sense=None,
    turning=False,
    rim=0.9,
    bent=False,
):
    points, faces = mesh
    corners = Corners(faces)
    threads, turns = walk_turning(corners) if turning else (walk_threads(corners), None)
    edges = sorted({corners.edge(h) for _, passes in threads for h, _ in passes})
    number = {edge: 100 + k for k, edge in enumerate(edges)}
    if sense is None:
        plain = pattern == "plain"
        sense = dict.fromkeys(edges, True) if plain else exact_twill(corners, threads)

    plan_threads, crossings, pieces, laps, strips, engraving = [], {}, [], [], {}, {}
    for edge, key in number.items():
        crossings[key] = {"id": key, "edge": list(edge), "over": None, "under": None,
                          "fastened": True}  # fmt: skip
    for t, (closed, passes) in enumerate(threads):
        label = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[t % 26] * (1 + t // 26)
        ring = [number[corners.edge(h)] for h, _ in passes]
        over = [forward == sense[corners.edge(h)] for h, forward in passes]
        own = {"id": t, "label": label, "closed": closed, "bunch": 0, "crossings": ring,
               "over": over, "pieces": []}  # fmt: skip
        plan_threads.append(own)
        if not passes:
            continue
        around = turns if rim else None
        rungs, entry = ribbon(
            points, corners, closed, passes, over, height, c, w, turns=around, rim=rim
        )
        strips[label] = {
            "rungs": rungs, "triangles": strip_triangles(len(rungs), closed), "closed": closed,
            "entry": entry, "exit": [k + 1 for k in entry],
        }  # fmt: skip
        for (h, forward), key in zip(passes, ring, strict=True):
            middle = quad_of(points, corners, h, forward)[2]
            crossings[key]["position"] = middle.tolist()
        cuts = cut_places(closed, over, joints, on_top)
        n = len(ring)
        if closed:
            runs = [(a, b) for a, b in zip(cuts, [*cuts[1:], cuts[0] + n], strict=True)]
        else:
            bounds = [0, *cuts, n - 1]
            runs = list(itertools.pairwise(bounds)) if len(bounds) > 2 or n > 1 else [(0, 0)]
        base = len(laps)
        names = [f"{label}{k + 1}" for k in range(len(runs))]
        own["pieces"] = names
        ends = len(runs) if closed else len(runs) - 1
        flats = []
        for k, (a, b) in enumerate(runs):
            size = len(rungs)
            first = entry[a] if closed or a else 0
            last = entry[b % n] + 1 + size * (b // n) if closed or b < n - 1 else size - 1
            flat = unfold(rungs, first, last)
            way = flat[-1][0] + flat[-1][1] - flat[0][0] - flat[0][1]
            turn = abs(way) / way
            flat = [(turn * right, turn * left) for right, left in flat]
            shift = complex(
                min(z.real for rung in flat for z in rung),
                min(z.imag for rung in flat for z in rung),
            )
            flat = [(right - shift, left - shift) for right, left in flat]
            flats.append(flat)
            stations = []
            for at in range(a, b + 1):
                r = entry[at % n] + size * (at // n) - first
                panel = [*flat[r], *flat[r + 1]]
                centre = sum(panel) / 4
                joint = None
                if at == b and (closed or k < len(runs) - 1):
                    joint = base + k + 1
                if at == a and (closed or k):
                    joint = base + (k - 1) % len(runs) + 1
                stations.append(
                    {"crossing": ring[at % n], "over": over[at % n], "partner": None,
                     "x": centre.real, "y": centre.imag, "hole_mm": HOLE, "joint": joint,
                     "_panel": panel}
                )  # fmt: skip
                if not (at == a and joint is not None):
                    strand = {"thread": t, "piece": names[k], "station": at - a}
                    crossings[ring[at % n]]["over" if over[at % n] else "under"] = strand
            pieces.append(
                {"id": names[k], "thread": t, "sheet": 1, "placement": None,
                 "joints": [base + (k - 1) % len(runs) + 1 if closed or k else None,
                            base + k + 1 if k < ends else None],
                 "outline": [pair(r) for r, _ in flat] + [pair(left) for _, left in flat[::-1]],
                 "stations": stations}
            )  # fmt: skip
        own_pieces = pieces[len(pieces) - len(runs) :]
        for k in range(ends):
            a, b = own_pieces[k], own_pieces[(k + 1) % len(runs)]
            one, two = a["stations"][-1]["_panel"], b["stations"][0]["_panel"]
            holes = [[pair(sum(one) / 4), pair(sum(two) / 4)]]
            laps.append({"id": base + k + 1, "pieces": [a["id"], b["id"]],
                         "crossing": a["stations"][-1]["crossing"], "holes": holes,
                         "kind": "rivet", "hole_mm": HOLE, "grip_mm": None})  # fmt: skip
    lap_of = {lap["id"]: lap for lap in laps}
    for piece in pieces:
        for station in piece["stations"]:
            side = "under" if station["over"] else "over"
            station["partner"] = crossings[station["crossing"]][side]["piece"]
        piece["labels"], piece["dropped"] = label_piece(piece, lap_of)
        engraving[piece["id"]] = engrave(piece)
    for piece in pieces:
        for station in piece["stations"]:
            del station["_panel"]
        if bent:
            bend_sides(piece)
    sheets = place_in_rows(pieces)
    plan = {
        "schema": "fabweave.crossing-map/1",
        "units": "mm",
        "weave": {"pattern": pattern, "exact": True, "broken": {"edge": 0, "face": 0, "vertex": 0}},
        "layout": {
            "margin_mm": MARGIN,
            "gap_mm": GAP,
            "rotations": {"step_deg": None, "tolerance_deg": 0.0},
        },
        "cut": {
            "profile": "maker",
            "preset": "own",
            "dxf": "R2010",
            "svg_units": "mm",
            "hairline_mm": HAIRLINE,
            "layers": [
                {"layer": layer, "colour": colour, "aci": aci}
                for layer, (colour, aci) in COLOURS.items()
            ],
        },
        "sheets": sheets,
        "threads": plan_threads,
        "crossings": list(crossings.values()),
        "pieces": pieces,
        "joints": laps,
        "steps": assemble(pieces, laps),
    }
    return Specimen(points, faces, plan, strips, engraving, "turn" if turning else None)


def assemble(pieces, laps, *, hold=True):
    """Return one step a piece; with ``hold``, from piece to piece that touches what is there."""
    mates = {}
    for lap in laps:
        mates.setdefault(lap["pieces"][0], []).append((lap["id"], lap["pieces"][1]))
        mates.setdefault(lap["pieces"][1], []).append((lap["id"], lap["pieces"][0]))
    waiting, there, steps = list(pieces), {}, []
    layers = Counter(s["crossing"] for p in pieces for s in p["stations"])
    while waiting:
        touching = [p for p in waiting if {s["crossing"] for s in p["stations"]} & set(there)]
        piece = (touching or waiting if hold else waiting)[0]
        waiting.remove(piece)
        name = piece["id"]
        made, over, under, fasten = [], {}, {}, []
        both = {key for key, on in there.items() if len({flag for _, flag in on}) == 2}
        for s in piece["stations"]:
            there.setdefault(s["crossing"], []).append((name, s["over"]))
        for s in piece["stations"]:
            key = s["crossing"]
            others = {other for other, flag in there[key] if flag != s["over"]}
            if others:
                (over if s["over"] else under).setdefault(key, others)
                if key not in (*both, *made):
                    made.append(key)
            layers[key] -= 1
            if layers[key] == 0:
                fasten.append(key)
        done = {p["id"] for p in pieces} - {p["id"] for p in waiting}
        joints = [(joint, mate) for joint, mate in mates.get(name, []) if mate in done]
        steps.append(
            {"step": len(steps) + 1, "pieces": [name], "crossings": made, "over": list(over),
             "under": list(under), "joints": sorted({joint for joint, _ in joints}),
             "fasten": fasten, "closes": len(joints) == 2}
        )  # fmt: skip
    return steps


def engrave(piece):
    """Return a V, a closed diamond, a tick and the labels, in the piece's own coordinates."""
    right_entry, left_entry, right_exit, left_exit = piece["stations"][0]["_panel"]
    way = (right_exit + left_exit - right_entry - left_entry) / 2
    along = way / abs(way)
    centre = complex(piece["stations"][0]["x"], piece["stations"][0]["y"])
    across = 1j * along
    reach = abs(way) / 2
    v = [centre + along * 0.55 * reach + k * across for k in (1.0, 0.0)]
    v.append(centre + along * 0.55 * reach + along + across)
    o = [centre - along * 0.6 * reach + 0.8 * d for d in (along, across, -along, -across)]
    edge = (right_entry + right_exit) / 2
    tick = [edge, edge + 1.2 * across]
    return [
        ("ENGRAVE_MARK", [pair(z) for z in v], False),
        ("ENGRAVE_MARK", [pair(z) for z in o], True),
        ("ENGRAVE_MARK", [pair(z) for z in tick], False),
        *(("ENGRAVE_LABEL", run, False) for one in piece["labels"] for run in lettered(one)),
    ]


# --- labels: letters 1 mm wide and half a millimetre apart --------------------------------------

TEXT = 2.0
SIGNS = "ABCDEFGHJKLMNPRSTUVWXYZ0123456789#>[]→●○"


def lettered(label):
    """Letter a label with an alphabet that no person reads: zigzags, low ones for A and L."""
    turn = complex(math.cos(math.radians(label["rotation_deg"])),
                   math.sin(math.radians(label["rotation_deg"])))  # fmt: skip
    centre, high = complex(label["x"], label["y"]), label["height_mm"]
    left, base = -label["box_mm"][0] / 2, label["box_mm"][1] / 2 - high
    runs = []
    for k, sign in enumerate(label["text"]):
        number = SIGNS.index(sign)
        levels = [(number // 4**digit % 4) * 0.15 + (0 if sign in "AL" else 0.55)
                  for digit in range(3)]  # fmt: skip
        zigzag = [0j, 1j, *(complex((d + 1) / 3, y) for d, y in enumerate(levels))]
        drawn = [[complex(z.real, high * z.imag) for z in zigzag]]
        if sign in "69":
            drawn.append([complex(0, -high / 4), complex(1, -high / 4)])
        runs += [[pair(centre + turn * (z + complex(left + 1.5 * k, base))) for z in run]
                 for run in drawn]  # fmt: skip
    return runs


def label_piece(piece, laps):
    """Letter much of what a piece should tell, two lines at each station, and drop the rest."""
    labels, dropped = [], []
    last = len(piece["stations"]) - 1

    def put(kind, text, station, line, about=None):
        right_entry, left_entry, right_exit, left_exit = piece["stations"][station]["_panel"]
        way = right_exit + left_exit - right_entry - left_entry
        along = way / abs(way)
        here = complex(piece["stations"][station]["x"], piece["stations"][station]["y"])
        here += 1j * along * (3.6, -3.4)[line]
        high = TEXT * (1.25 if set(text) & set("69") else 1)
        labels.append(
            {"kind": kind, "text": text, "station": about, "height_mm": TEXT, "x": here.real,
             "y": here.imag, "rotation_deg": math.degrees(math.atan2(along.imag, along.real)),
             "box_mm": [1.5 * len(text) - 0.5, high]}
        )  # fmt: skip

    def drop(kind, text, station):
        dropped.append({"kind": kind, "text": text, "station": station})

    for at, station in enumerate(piece["stations"]):
        sign = "●" if station["over"] else "○"
        if at % 3 == 2:
            drop("partner", station["partner"], at)
            drop("sign", sign, at)
        else:
            put("partner", sign + station["partner"], at, 0, at)
    start, end = piece["joints"]
    if start is not None:
        put("joint", f"#{start}>{laps[start]['pieces'][0]}", 0, 1, 0)
    if end is not None:
        put("joint", f"#{end}", last, 1, last)
        drop("mate", f">{laps[end]['pieces'][1]}", last)
    free = next((k for k in range(last + 1) if piece["stations"][k]["joint"] is None), None)
    if free is None:
        drop("id", piece["id"], None)
        drop("arrow", "→", None)
    elif piece["id"].endswith("2"):
        put("id", piece["id"], free, 1)
        drop("arrow", "→", None)
    else:
        put("id", f"{piece['id']}→", free, 1)
    return labels, dropped


def placed(piece, points):
    """Return points of a piece on its sheet."""
    place = piece["placement"]
    turn = complex(math.cos(math.radians(place["rotation_deg"])),
                   math.sin(math.radians(place["rotation_deg"])))  # fmt: skip
    shift = complex(place["x_mm"], place["y_mm"])
    return [pair(turn * complex(x, y) + shift) for x, y in points]


def bend_sides(piece, height=0.1):
    """Cut the long sides of a piece as arcs, to the left and to the right by turns.

    Its outline gets points on the arcs, so that it is within some micrometres of what is cut.
    """
    path, outline = [], []
    corners = [complex(x, y) for x, y in piece["outline"]]
    side = 1
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        outline.append(pair(a))
        bulge = 0.0
        if abs(b - a) > 8.0:
            bulge, side = side * 2 * height / abs(b - a), -side
            turn = 4 * math.atan(bulge)
            centre = a + (b - a) / (1 - cmath.exp(1j * turn))
            outline += [
                pair(centre + (a - centre) * cmath.exp(1j * turn * k / 5)) for k in (1, 2, 3, 4)
            ]
        path.append([*pair(a), bulge])
    piece["path"], piece["outline"] = path, outline


def place_in_rows(pieces):
    """Place pieces in rows, at different rotations, sheet after sheet."""
    x = y = MARGIN
    row = 0.0
    sheet = 1
    for k, piece in enumerate(pieces):
        piece["kind"] = k + 1
        piece["placement"] = {"rotation_deg": (0.0, 180.0, 4.5)[k % 3], "x_mm": 0.0, "y_mm": 0.0}
        points = np.array(placed(piece, piece["outline"]))
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        if x + size[0] > SHEET[0] - MARGIN:
            x, y, row = MARGIN, y + row + GAP, 0.0
        if y + size[1] > SHEET[1] - MARGIN:
            x, y, row, sheet = MARGIN, MARGIN, 0.0, sheet + 1
        piece["sheet"] = sheet
        piece["placement"]["x_mm"] = x - low[0]
        piece["placement"]["y_mm"] = y - low[1]
        x, row = x + size[0] + GAP, max(row, size[1])
    return [
        {
            "sheet": k,
            "name": f"sheet_{k:02d}",
            "width_mm": SHEET[0],
            "height_mm": SHEET[1],
            "mirrored": False,
            "stock": "",
            "offcut": False,
            "price": None,
            "material": None,
            "grain_deg": None,
            "outline": [[0.0, 0.0], [SHEET[0], 0.0], list(SHEET), [0.0, SHEET[1]]],
            "defects": [],
        }
        for k in range(1, sheet + 1)
    ]
