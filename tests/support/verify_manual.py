"""Say what stands in the manual of a specimen, by hand-written code as the rest of its files.

The sentences that every manual has are those that verify expects; that they are the makers', too,
is seen with jobs of theirs.
"""

import numpy as np
from verify_specimen import placed

from fabweave.verify.checks.reports.manual import MAP, SECTIONS
from fabweave.verify.checks.reports.manual_cover import LOOSE, PROCEED, TABLE, TAKE, VIEWER
from fabweave.verify.checks.reports.manual_steps import BOXES, PICTURED

#: Points in a millimetre of what is drawn, and how many millimetres one stands for.
SCALE = 0.9
RATIO = f"1 : {72 / 25.4 / SCALE:.1f}"
TITLE = "specimen"


def placed_outline(plan, piece):
    """Return a piece's corners on its sheet, which may be mirrored."""
    corners = placed(piece, piece["outline"])
    sheet = next((one for one in plan["sheets"] if one["sheet"] == piece["sheet"]), {})
    return [(sheet["width_mm"] - x, y) if sheet.get("mirrored") else (x, y) for x, y in corners]


def many(number, word):
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def manual_pages(specimen, verdict):
    """Return for each page its section, its texts, and what is drawn: a page for each sheet."""
    plan = specimen.plan
    first = {piece.get("kind", 0): piece for piece in reversed(plan["pieces"])}
    drawn = "".join(
        closed(piece["outline"]) for piece in plan["pieces"] if first[piece.get("kind", 0)] is piece
    )
    pages = [
        [(cover(specimen, plan, verdict), "")], [(legend(plan), "")], [(thread_map(plan), "")],
        [(parts_list(plan), drawn)],
        [(sheet_texts(plan, sheet), sheet_figures(plan, sheet)) for sheet in plan["sheets"]],
        [(steps(plan), "")],
    ]  # fmt: skip
    return [(name, *page) for name, own in zip(SECTIONS, pages, strict=True) for page in own]


def cover(specimen, plan, verdict):
    size = np.ptp(np.asarray(specimen.points), axis=0)
    told = "; ".join(f"{reason['text']} ({reason['advice']})" for reason in verdict["reasons"][:3])
    more = f"; and {len(verdict['reasons']) - 3} more" if len(verdict["reasons"]) > 3 else ""
    counts = ", ".join(many(len(plan[key]), key[:-1] if key != "crossings" else "crossing")
                       for key in ("threads", "crossings", "joints"))  # fmt: skip
    tools = ["clips or soft clamps; a pencil to tick the boxes"]
    if plan["joints"]:
        tools.insert(0, "for the fasteners: your fingers for brads, a screwdriver for Chicago "
                     "screws, or a rivet setter that reaches the middle of a strip")  # fmt: skip
    return [
        TITLE, f"Yes, with care. {told}{more}", "Buildable?",
        " x ".join(f"{length:.0f}" for length in size) + " mm", "Size",
        f"{many(len(plan['pieces']), 'piece')} on {many(len(plan['sheets']), 'sheet')}, {counts}",
        "Made of", TABLE, f"the {many(len(plan['sheets']), 'sheet')}, cut", "Sheets",
        "; ".join(tools), "Tools", PROCEED, TAKE, "1", f"Sort them: {piles(plan)}.", "2",
        f"Follow the steps.{VIEWER}", "3", LOOSE, "4",
    ]  # fmt: skip


def piles(plan):
    kinds = plan["cut"].get("labels") == "kinds"
    names = [piece.get("kind") for piece in plan["pieces"]]
    counts = [len(thread["pieces"]) for thread in plan["threads"]]
    counts = sorted(map(names.count, set(names)) if kinds else counts)
    of = many(counts[0], "piece") if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]} "
    of = of if counts[0] == counts[-1] else f"{of}pieces"
    end = "the letters of an id name its thread"
    if kinds:
        end = "any piece of a pile fits any of its places"
    word = "kind" if kinds else "thread"
    return f"{many(len(counts), 'pile')}, one for each {word}, of {of}; {end}"


def legend(plan):
    piece = max(
        plan["pieces"], key=lambda p: (len({one["kind"] for one in p["labels"]}), len(p["labels"]))
    )
    kinds = {one["kind"] for one in piece["labels"]}
    name, first = piece["id"], piece["stations"][0]
    explained = [kind for kind in ("id", "joint") if kind in kinds] + ["crossing", "hole"]
    number = {kind: str(at) for at, kind in enumerate(explained, start=1)}
    ways = {one["station"] is not None and piece["stations"][one["station"]]["over"]
            for one in piece["labels"] if one["kind"] in ("partner", "sign")}  # fmt: skip
    texts = [number[kind] for kind in explained[:-2]]
    texts += [number["crossing"]] * len(ways) + [number["hole"]]
    side = "inside" if any(sheet.get("mirrored") for sheet in plan["sheets"]) else "outside"
    texts += [f"Piece {name} of this object", "Engraved face", f"This is the {side} of the object."]
    if "id" in kinds:
        texts += [
            f"{number['id']} Id",
            f"{name}: the letters name the thread, and the number counts its pieces. "
            "The arrow points from the start of the piece to its end.",
        ]
    if "joint" in kinds:
        key = next(key for key in piece["joints"] if key is not None)
        pair = next(joint["pieces"] for joint in plan["joints"] if joint["id"] == key)
        mate = next((other for other in pair if other != name), name)
        texts += [
            f"{number['joint']} Joint",
            f"#{key}>{mate}: joint {key} joins this end to piece {mate}.",
        ]
    over = "over" if first["over"] else "under"
    texts += [
        f"{number['crossing']} Crossing",
        "Beside a crossing stands the piece that is met there: with a disc "
        "before its id where this piece passes over, with a ring where it passes under. At "
        f"its first station, {name} passes {over} {first['partner']}.",
    ]
    return [
        *texts,
        f"{number['hole']} Hole",
        "A fastener goes through all layers of the crossing: line up their holes.",
    ]


def thread_map(plan):
    texts, pieces = [MAP], {piece["id"]: piece for piece in plan["pieces"]}
    steps = {key: step["step"] for step in plan["steps"] for key in step["pieces"]}
    for thread in plan["threads"]:
        texts.append(f"Thread {thread['label']}")
        placed = ", ".join(f"{key} {steps.get(key)}" for key in thread["pieces"])
        kind = "ring" if thread["closed"] else "open"
        texts.append(f"{kind}, {many(len(thread['pieces']), 'piece')}, "
                     f"{many(len(set(thread['crossings'])), 'crossing')}; steps: "
                     f"{placed}")  # fmt: skip
        for number, key in enumerate(thread["pieces"]):
            piece = pieces[key]
            texts.append(key)
            for k, station in enumerate(piece["stations"]):
                if k == 0 and number and piece["joints"][0] is not None:
                    continue
                if station["joint"] is not None:
                    texts.append(f"#{station['joint']}")
                texts += ["●" if station["over"] else "○", station["partner"]]
    return texts


def parts_list(plan):
    names = {sheet["sheet"]: sheet["name"] for sheet in plan["sheets"]}
    kinds = {}
    for piece in plan["pieces"]:
        kinds.setdefault(piece.get("kind", 0), []).append(piece)
    texts = [f"{many(len(plan['pieces']), 'piece')} of {many(len(kinds), 'kind')}, engraved face "
             f"up, drawn at a scale of {RATIO}. Pieces of one kind are cut alike: they are drawn "
             "once, and their ids stand by sheet. Where there is only one, its place is that of "
             "its middle on the sheet, in mm from the left edge and from the lower "
             "edge."]  # fmt: skip
    for kind, alike in kinds.items():
        piece = alike[0]
        length = np.ptp(np.asarray(piece["outline"])[:, 0])
        size = f"{length:.0f} mm, {many(len(piece['stations']), 'station')}"
        if len(alike) == 1:
            xs, ys = zip(*placed_outline(plan, piece), strict=True)
            place = f"{names.get(piece['sheet'])} at "
            place += f"{(min(xs) + max(xs)) / 2:.0f}, {(min(ys) + max(ys)) / 2:.0f}"
            texts += [piece["id"], size, place]
            continue
        texts += [f"Kind {kind}", f"x {len(alike)}: {size}"]
        for sheet in sorted({one["sheet"] for one in alike}):
            ids = " ".join(one["id"] for one in alike if one["sheet"] == sheet)
            texts.append(f"{names.get(sheet)}: {ids}")
    return texts


def sheet_texts(plan, sheet):
    names = [piece["id"] for piece in plan["pieces"] if piece["sheet"] == sheet["sheet"]]
    mirrored = ", mirrored, as it is cut" if sheet.get("mirrored") else ""
    return [
        f"{sheet['name']}: {sheet['width_mm']:g} x {sheet['height_mm']:g} mm{mirrored}, left edge "
        f"at the bottom, scale {RATIO}", *names, "Dotted: the margin.",
        f"Pieces of {sheet['name']}, to tick off as you take them out:",
        *sorted(names, key=lambda name: (name.rstrip("0123456789"), len(name), name)),
    ]  # fmt: skip


def steps(plan):
    """Return the texts of the steps, all of which one picture of the whole object shows."""
    texts, new = [PICTURED + BOXES], [key for step in plan["steps"] for key in step["pieces"]]
    number, last = plan["steps"][0]["step"], plan["steps"][-1]["step"]
    total = len(plan["pieces"])
    texts += [f"Next: step{'' if number == last else 's'} {number}"
              + ("" if number == last else f" to {last}"),
              "Seen from the front right and above.",
              f"With these, {total} of {total} {'piece is' if total == 1 else 'pieces are'} in "
              "place.", *new]  # fmt: skip
    pieces = {piece["id"]: piece for piece in plan["pieces"]}
    there, so_far = set(), 0.0
    for step in plan["steps"]:
        there |= set(step["pieces"])
        # Pieces of a specimen state no holes; found, taken, laid over, slid under.
        seconds = 9.5 * len(step["pieces"]) + 2.5 * len(step["over"]) + 8.5 * len(step["under"])
        so_far += 4.5**0.5 * seconds
        minutes = max(round(so_far / 60), 1)
        texts += [f"Step {step['step']}", f"{max(round(4.5**0.5 * seconds / 60), 1)} min, "
                  f"{minutes // 60} h {minutes % 60:02d}"]  # fmt: skip
        texts += [f"{key} (sheet {pieces[key]['sheet']})" for key in step["pieces"]]
        words = step["text"].split(" ")
        half = len(words) // 2
        texts += [" ".join(words[:half]), " ".join(words[half:])]
        texts += card_texts(plan, step, there)
        texts += ["⊕" for _ in step["fasten"]]
        texts += [*names(plan, step, there), "1 : 2.5"]
    return texts


def carriers(plan, crossing, over):
    """Return the pieces that make a strand."""
    return [
        piece["id"]
        for piece in plan["pieces"]
        if any((one["crossing"], one["over"]) == (crossing, over) for one in piece["stations"])
    ]


def card_texts(plan, step, there):
    """Return what stands on the cards of a step."""
    texts = []
    joints = {joint["id"]: joint["pieces"] for joint in plan["joints"]}
    pieces = {piece["id"]: piece for piece in plan["pieces"]}
    for name in step["pieces"]:
        piece, words = pieces[name], []
        ends = [f"#{key}>{next((one for one in joints[key] if one != name), name)}"
                if key is not None and key in step["joints"] else None
                for key in piece["joints"]]  # fmt: skip
        for station in piece["stations"]:
            key, over = station["crossing"], station["over"]
            others = [one for one in carriers(plan, key, not over) if one in there]
            if others and key in step["over" if over else "under"]:
                words += ["●" if over else "○", " ".join(others)]
                words += ["⊕"] if key in step["fasten"] else []
        words = [*ends[:1], *words, *ends[1:]]
        words = [word for word in words if word is not None]
        texts += [name, *words] if words else []
    return texts


def names(plan, step, there):
    """Return what stands in the picture of a step."""
    texts = [*step["pieces"], *(f"#{key}" for key in step["joints"])]
    for piece in plan["pieces"]:
        met = {
            (one["over"], other)
            for one in piece["stations"]
            if piece["id"] in step["pieces"]
            and one["crossing"] in step["over" if one["over"] else "under"]
            for other in carriers(plan, one["crossing"], not one["over"])
            if other in there
        }
        for over, other in sorted(met):
            texts += ["●" if over else "○", other]
    return texts


def closed(points):
    """Draw a closed figure."""
    (x, y), *others = [(SCALE * float(x), SCALE * float(y)) for x, y in points]
    lines = " ".join(f"{a:.4f} {b:.4f} l" for a, b in others)
    return f"n {x:.4f} {y:.4f} m {lines} h S\n"


def sheet_figures(plan, sheet):
    """Return what is drawn of a sheet: its edge and its pieces, turned by a quarter."""
    own = [placed_outline(plan, piece) for piece in plan["pieces"]
           if piece["sheet"] == sheet["sheet"]]  # fmt: skip
    rings = [[(sheet["height_mm"] - y, x) for x, y in ring] for ring in (sheet["outline"], *own)]
    return "".join(map(closed, rings))
