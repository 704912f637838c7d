"""Write the first pages of the manual: the cover, and how to read a piece."""

import io
from collections.abc import Callable

import numpy as np
from PIL import Image

from fabweave.assembly.extent import MOST_VIEWED
from fabweave.assembly.manual.book import LEADING, TEXT, Book, text_width
from fabweave.assembly.manual.sheets import DrawnPiece, levelling
from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
from fabweave.cut.drawing import Layer
from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.flat.crossing_map import CrossingMap, PieceRecord
from fabweave.flat.joint.kinds import KINDS, RIVET

COVER, LEGEND = "Overview", "How to read a piece"

#: The number that stands for a kind of label where signs are explained.
_NUMBER_OF = {"id": "1", "joint": "2", "partner": "3", "sign": "3"}
_VIEWER = " assembly.html shows the same steps on an object that you can turn and zoom."


@frozen_value
class Facts:
    """What the manual says about a job besides its crossing map.

    Parameters
    ----------
    title : str
        Name of the object.
    buildable : str
        Whether it can be built, and what wants care.
    size_mm : tuple of float
        Its extents along x, y, z.
    material : str
        In words, with its thickness.
    bill : BillOfMaterials
        What is bought besides sheets.
    colours : (X, 2, 2, 3) uint8 array
        The colours of each crossing's strands in the pictures, of the one below and of the one
        above: as it comes, and as it leaves.
    portrait : bytes
        The picture of the object, a PNG file.
    costs : tuple of (str, str)
        Names and texts of what is said of times, difficulty and money.
    """

    title: str
    buildable: str
    size_mm: tuple[float, ...]
    material: str
    bill: BillOfMaterials
    colours: Colours
    portrait: bytes
    costs: tuple[tuple[str, str], ...]


def write_cover(book: Book, crossing_map: CrossingMap, facts: Facts) -> None:
    """Write the cover: the object, what it is made of, and what it takes to put it together."""
    book.page(COVER)
    wide = book.right - book.left
    book.y -= 34.0
    size = min(30.0, 30.0 * wide / max(text_width(facts.title, 30.0, bold=True), 1.0))
    book.text(book.left, book.y, facts.title, size=max(size, 14.0), bold=True)
    book.y -= 10.0
    with Image.open(io.BytesIO(facts.portrait)) as file:
        picture = file.convert("RGB")
    high = wide * picture.height / picture.width
    book.image(picture, book.left, book.y - high, wide, high)
    book.y -= high + 10.0
    for name, text in _overview(crossing_map, facts):
        end = book.block(book.left + 92.0, book.y, text, wide - 92.0)
        book.text(book.left, book.y - LEADING * TEXT + 0.25 * TEXT, name, bold=True)
        book.y = end - 5.0


def _overview(crossing_map: CrossingMap, facts: Facts) -> list[tuple[str, str]]:
    """Return the lines of the cover, each with its name."""
    fasteners, spares = facts.bill.fasteners, len(crossing_map.spares or ())
    kinds = sorted({joint.kind for joint in crossing_map.joints})
    if fasteners and RIVET.name not in kinds:
        kinds.append(RIVET.name)
    lines = [
        ("Buildable?", facts.buildable),
        ("Size", " x ".join(f"{length:.0f}" for length in facts.size_mm) + " mm"),
        ("Material", facts.material),
        (
            "Made of",
            agree(len(crossing_map.pieces), "{n} [piece|pieces]")
            + (agree(spares, " and {n} spare[|s]") if spares else "")
            + agree(len(crossing_map.sheets), " on {n} [sheet|sheets], ")
            + agree(len(crossing_map.threads), "{n} [thread|threads], ")
            + agree(len(crossing_map.crossings), "{n} [crossing|crossings], ")
            + agree(len(crossing_map.joints), "{n} [joint|joints]"),
        ),
    ]
    lines += [
        (
            "Fasteners",
            f"buy {row.buy} for holes of {row.diameter_mm:g} mm with a grip of "
            f"{row.grip_mm:g} mm ({row.layers} layers): {row.needed} needed, "
            f"{row.spare} spare",
        )
        for row in fasteners
    ]
    glue, tape = facts.bill.glue, facts.bill.tape
    if glue.joints:
        lines.append(("Glue", f"{glue.area_mm2 / 100:.0f} cm² of laps in all"))
    if tape.joints:
        lines.append(("Tape", f"{tape.length_mm / 1000:.2f} m in all"))
    tools = [KINDS[kind].tools for kind in kinds]
    lines += [
        ("Tools", "; ".join([*tools, "clips or soft clamps", "a pencil to tick the boxes"])),
        *facts.costs,
        (
            "How to proceed",
            "Take the pieces out of their sheets, one sheet after another, and sort them by "
            "thread. Then follow the steps. Leave a fastener loose as long as a layer is still to "
            "come, and tighten it when the step says that all layers are in place."
            + (_VIEWER if len(crossing_map.crossings) <= MOST_VIEWED else ""),
        ),
    ]
    return lines


def write_legend(book: Book, crossing_map: CrossingMap, drawn: dict[str, DrawnPiece]) -> None:
    """Show a piece of this job in large, and say what is engraved on it."""
    book.page(LEGEND)
    piece = max(
        crossing_map.pieces,
        key=lambda piece: (len({label.kind for label in piece.labels}), len(piece.labels)),
    )
    drawn_piece = drawn[piece.id]
    turn = levelling(drawn_piece.outline)
    for label in piece.labels[:1]:
        angle = np.deg2rad(label.rotation_deg)
        way = np.array([[0.0, 0.0], [np.cos(angle), np.sin(angle)]])
        start, tip = crossing_map.on_sheet(piece, way + np.array([label.x_mm, label.y_mm]))
        if ((tip - start) @ turn)[0] < 0.0:
            turn = -turn  # its letters would stand on their heads
    points = drawn_piece.outline @ turn
    wide = book.right - book.left
    low, high = points.min(axis=0), points.max(axis=0)
    scale = min(wide / float(high[0] - low[0]), 240.0 / float(high[1] - low[1]))
    book.y -= 34.0
    shift = np.array([book.left, book.y]) - np.array([low[0], high[1]]) * scale
    book.line(points * scale + shift, width=1.0, closed=True, fill=0.96)
    for layer, run in drawn_piece.lines:
        book.line(run @ turn * scale + shift, width=1.0 if layer is Layer.ENGRAVE_LABEL else 0.8)
    for x, y, radius in drawn_piece.holes.tolist():
        across, up = (np.array([x, y]) @ turn * scale + shift).tolist()
        book.circle(across, up, radius * scale)
    ticks = [run.mean(axis=0) for layer, run in drawn_piece.lines if layer is Layer.ENGRAVE_MARK]
    _point_out(
        book,
        piece,
        lambda at: crossing_map.on_sheet(piece, at) @ turn * scale + shift,
        np.array(ticks).reshape(-1, 2) @ turn * scale + shift,
    )
    book.y -= float(high[1] - low[1]) * scale + 20.0
    book.text(book.left, book.y, f"Piece {piece.id} of this object", size=12.0, bold=True)
    book.y -= 6.0
    for name, text in _signs(crossing_map, piece):
        end = book.block(book.left + 120.0, book.y, text, wide - 120.0)
        book.text(book.left, book.y - LEADING * TEXT + 0.25 * TEXT, name, bold=True)
        book.y = end - 5.0


def _point_out(
    book: Book,
    piece: PieceRecord,
    place: Callable[[FloatArray], FloatArray],
    ticks: FloatArray,
) -> None:
    """Stand the number of each sign above the piece, with a line to where it is on it."""
    spots: dict[str, tuple[float, float]] = {}
    for label in piece.labels:
        spots.setdefault(_NUMBER_OF.get(label.kind, ""), (label.x_mm, label.y_mm))
    holes = [station for station in piece.stations if station.hole_mm]
    if holes:
        middle = holes[len(holes) // 2]
        spots["5"] = middle.x_mm, middle.y_mm
    spots.pop("", None)
    names = list(spots)
    points = place(np.array(list(spots.values())).reshape(-1, 2))
    if len(ticks) and names:
        # The tick that is farthest from what has a number already.
        away = np.abs(ticks[:, :1] - points[:, 0]).min(axis=1)
        points = np.concatenate((points, ticks[[int(np.argmax(away))]]))
        names.append("4")
    last = -np.inf
    for at in np.argsort(points[:, 0], kind="stable").tolist():
        x, y = points[at].tolist()
        stand = max(x, last + 18.0)
        last = stand
        book.line([(x, y + 1.5), (stand, book.y + 12.0)], width=0.6, grey=0.35)
        book.tag(stand, book.y + 18.0, names[at], dark=True)


def _signs(crossing_map: CrossingMap, piece: PieceRecord) -> list[tuple[str, str]]:
    """Say what the marks on a piece mean, each with an example from the piece itself."""
    labels = {label.kind: label.text for label in reversed(piece.labels)}
    inside = any(sheet.mirrored for sheet in crossing_map.sheets)
    signs = []
    face = "inside" if inside else "outside"
    if labels:
        covered = any(label.hidden for label in piece.labels)
        words = f"This is the {face} of the object."
        words += " Other strands cover the letters when it is woven." if covered else ""
        signs.append(("Engraved face", words))
    else:
        signs.append(
            (
                "No lettering",
                f"The pieces are not engraved. The face that is up on the sheet is the {face}.",
            )
        )
    if "id" in labels and crossing_map.cut.labels == "kinds":
        signs.append(
            (
                "1 Kind",
                f"K{piece.kind}: all pieces with these letters are alike, and any of them fits any "
                f"of their places. {piece.id} is a name of the place alone: its letters name the "
                "thread, and the number counts its pieces. Stations are counted along the arrow, "
                "from 0; or against it, where a step says that the arrow runs back.",
            )
        )
    elif "id" in labels:
        signs.append(
            (
                "1 Id",
                f"{piece.id}: the letters name the thread, and the number counts its pieces. The "
                "arrow points along the thread; stations are counted in its direction, from 0.",
            )
        )
    if "joint" in labels:
        key = next(key for key in piece.joints if key is not None)
        mate = next(joint for joint in crossing_map.joints if joint.id == key).mate(piece.id)
        signs.append(("2 Joint", f"#{key}>{mate}: joint {key} joins this end to piece {mate}."))
    station = piece.stations[0]
    if "partner" in labels or "sign" in labels:
        word = "over" if station.over else "under"
        signs.append(
            (
                "3 Crossing",
                "Beside a crossing stands the piece that is met there: with a disc before its id "
                f"where this piece passes over, with a ring where it passes under. At its first "
                f"station, {piece.id} passes {word} {station.partner}.",
            )
        )
    if any(KINDS[joint.kind].marked for joint in crossing_map.joints):
        signs.append(
            (
                "4 Cross",
                "A cross in place of a hole marks a glued lap: lay cross on cross. Where there are "
                "ticks, the end of the other piece lies at them.",
            )
        )
    if any(station.hole_mm for station in piece.stations):
        signs.append(
            ("5 Hole", "A fastener goes through all layers of the crossing: line up their holes.")
        )
    return signs
