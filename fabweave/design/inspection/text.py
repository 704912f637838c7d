"""Say in words what was found out about a mesh."""

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import convert

from fabweave.core.finding import Finding, Note
from fabweave.core.messages import agree
from fabweave.job.figures import Figures, words
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.remesh.rings import MOST_HANDLES
from fabweave.plan.verdict import VERDICTS
from fabweave.stock.machine import CURRENCY
from fabweave.weave.pattern import exact_text

#: Notes on ribbons that mean nothing where these cannot be built: the advice says what to do.
_OF_NO_USE = {"checks", "bend", "twist"}

#: How many reasons against building an answer tells.
_REASONS = 2
#: Cages of fewer faces are told in the facts only: every grid goes down to a single one.
_LEAST_CAGE = 20
#: A mirror stands straight if its normal is this much along an axis.
_STRAIGHT = 0.99


def inspection_text(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what was found as topics and sentences.

    Parameters
    ----------
    facts : mapping
        As ``inspect_mesh`` finds them.

    Returns
    -------
    list of (topic, sentence)
        In the order in which a person reads; a line without a topic goes on with the one above.
    """
    return [*first_rows(facts), *further_rows(facts), *design_rows(facts)]


def first_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what the mesh is, in a line."""
    mesh, sides = facts["mesh"], (f"{side:.0f}" for side in facts["mesh"]["size_mm"])
    genus = "" if mesh["genus"] is None else f", genus {mesh['genus']}"
    bounds = agree(mesh["boundary_loops"], "{n} boundary loop[|s]")
    text = (
        f"{agree(mesh['faces'], '{n} [face|faces]')}, {mesh['vertices']} vertices, "
        f"{bounds if mesh['boundary_loops'] else 'closed'}{genus}; {' × '.join(sides)} mm"
    )
    return [("mesh", text)]


def answer_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return whether it can be built, what would help, and what it comes to: the rest of an answer.

    Few of the reasons are told.
    """
    threads, pieces = facts["threads"], facts["pieces"]
    told = f"{threads['count']}, {agree(threads['crossings'], '{n} crossing[|s]')}"
    built = facts["verdict"]["level"] != "not makeable"
    return [
        *_chosen_rows(facts["chosen"]),
        *_verdict_rows(facts["verdict"], _REASONS),
        *_advice_rows(facts["advice"]),
        ("threads", told),
        (
            "twill",
            _exact(facts["twill"])
            if facts["twill"]["exact"]
            else f"no exact 2/2 twill{_in_rings(facts['mesh'])} (-v says why)",
        ),
        ("ribbons", f"{_range(facts['ribbons'], 1)} mm wide"),
        *([("pieces", _pieces(pieces))] if built and pieces["count"] is not None else []),
        # How times come about is told by -v.
        *(
            (name, f"{text.partition(';')[0]}, as foretold" if name == "time" else text)
            for name, text in (_cost_rows(facts["costs"])[:-1] if built else [])
        ),
        *_form_rows(facts["form_mm"], facts["grade"], collapses=facts["collapses"]),
        ("more", "-v prints all that is known; --designs tries designs from coarse to fine"),
    ]


def further_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return whether it can be built, what would help, and figures: all but the designs."""
    told = {finding["text"] for finding in facts["checks"]["findings"]}  # the verdict's reasons
    built = facts["verdict"]["level"] != "not makeable"
    checks = [note for note in facts["checks"]["notes"] if note not in told]
    return [
        *_chosen_rows(facts["chosen"]),
        *_verdict_rows(facts["verdict"]),
        *_advice_rows(facts["advice"]),
        *_mesh_notes(facts),
        *_mesh_rows(facts["mesh"], facts["symmetry"]),
        *_thread_rows(facts["threads"], facts["bunches"]),
        *_twill_rows(facts["twill"], facts["mesh"]),
        *_fabric_rows(facts["fabrics"]),
        ("ribbons", f"{_range(facts['ribbons'], 1)} mm wide"),
        *(_topic(note) for note in checks if built or note.rule not in _OF_NO_USE),
        ("pieces", _pieces(facts["pieces"])),
        # What cannot be built need not be priced; the facts hold it.
        *(_choices(facts["pieces"]) if built else []),
        *(_cost_rows(facts["costs"]) if built else []),
        *_form_rows(facts["form_mm"], facts["grade"], collapses=facts["collapses"]),
        *_left_out_rows(facts["left_out"]),
    ]


def _form_rows(
    form_mm: float | None, grade: float | None, *, collapses: bool
) -> list[tuple[str, str]]:
    """Say what is foretold of form and grade; nothing where that is not known."""
    rows = []
    if form_mm is not None:
        text = f"let go, it goes about {form_mm:.1f} mm from its form"
        if collapses:
            text = f"let go, it collapses: by more than {form_mm:.0f} mm, a tenth of its size"
        rows.append(("form", f"{text}, as foretold; make works it out"))
    if grade is not None:
        rows.append(("grade", f"about {grade:.1f} of 10, as foretold"))
    return rows


def _advice_rows(advice: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Say what would help, and below each the command that does it."""
    rows: list[tuple[str, str]] = []
    for way in advice:
        rows.append(("" if rows else "next", way["text"]))
        if way["command"] is not None:
            rows.append(("", way["command"]))
    return rows


def _mesh_notes(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the notes on mesh and weave that nothing else says."""
    changed = any(note.rule == "changed" for note in facts["notes"])
    said = {"twill"} if changed else {"twill", "mesh"}
    return [_topic(note) for note in facts["notes"] if note.rule not in said]


def _topic(note: Note) -> tuple[str, str]:
    """Return the topic of a note, if it begins with its rule, and the rest."""
    rest = note.removeprefix(f"{note.rule}: ")
    return ("note", note) if rest == note else (note.rule, rest)


def _mesh_rows(mesh: Mapping[str, Any], symmetry: Mapping[str, Any]) -> list[tuple[str, str]]:
    sizes = (f"{number} with {size} sides" for size, number in mesh["face_sizes"].items())
    valences = (f"{number} of valence {valence}" for valence, number in mesh["valences"].items())
    cages = [f"--remesh coarse:{number}" for number in mesh["cages"] if number >= _LEAST_CAGE]
    refined = [("cage", f"the mesh is a refined cage, which {' or '.join(cages)} gives back")]
    return [
        *(refined if cages else []),
        *_symmetry_rows(mesh["mirror"], symmetry),
        ("faces", ", ".join(sizes)),
        ("vertices", ", ".join(valences) or "none inside the surface"),
        ("edges", f"{_range(mesh['edge_mm'], 1)} mm long"),
    ]


def _symmetry_rows(mirror: Mapping[str, Any], symmetry: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Say whether the surface is its own mirror image, and what maps the weave onto itself."""
    mesh, weave = symmetry["mesh"], symmetry["weave"]
    carrying, told = [], []
    if weave["rotations"] > 1:
        fewer = weave["rotations"] < mesh["rotations"]
        whose = f" of the mesh's {mesh['rotations']}" if fewer else ""
        carrying.append(f"{weave['rotations']}{whose} rotations")
    if weave["reflections"]:
        carrying.append(agree(weave["reflections"], "{n} reflection[|s]"))
    if carrying:
        one = weave["rotations"] == 1 == weave["reflections"]
        text = f"{' and '.join(carrying)} {'carries' if one else 'carry'} the weave onto itself"
        if not symmetry["exact"]:
            text += f" to within {symmetry['tolerance_percent']:g} % of its size"
        told.append(text)
    if weave["rotations"] > 1 and symmetry["kinds_possible"] is not None:
        kinds = "about {n} kind[|s] of pieces [is|are] possible"
        told.append(agree(symmetry["kinds_possible"], kinds))
    if told and mesh["reflections"] and not weave["reflections"]:
        text = "{n} reflection[|s] of the mesh [does|do] not keep over and under"
        told.append(agree(mesh["reflections"], text))
    rows = [f"mirror-symmetric from {_way(mirror['normal'])}"] if mirror["symmetric"] else []
    rows += ["; ".join(told)] if told else []
    return [("" if number else "symmetry", text) for number, text in enumerate(rows)]


def _way(normal: Sequence[float]) -> str:
    """Say between which sides a mirror stands."""
    axis = max(range(3), key=lambda k: abs(normal[k]))
    sides = ("left to right", "front to back", "bottom to top")[axis]
    if abs(normal[axis]) > _STRAIGHT:
        return sides
    return f"side to side, across ({', '.join(f'{x:.2f}' for x in normal)})"


def _thread_rows(threads: Mapping[str, Any], bunches: Mapping[str, Any]) -> list[tuple[str, str]]:
    text = (
        f"{threads['count']} ({threads['closed']} closed), "
        f"{agree(threads['crossings'], '{n} crossing[|s]')}; each passes "
        f"{_range(threads['passes'], 0)} of them and is {_range(threads['length_mm'], 0)} mm long; "
        f"{threads['total_mm'] / 1000:.1f} m in all"
    )
    if threads["crossing_themselves"]:
        text += agree(threads["crossing_themselves"], "; {n} cross[es itself| themselves]")
    number = f"{bunches['count']}{'' if bunches['fewest'] else ' or fewer'}"
    return [
        ("threads", text),
        ("bunches", "2: warp and weft" if bunches["warp_and_weft"] else number),
    ]


def _exact(twill: Mapping[str, Any]) -> str:
    """Say that a twill is exact, and where it is not all the same."""
    return f"{exact_text(twill.get('broken_at_turns', 0))} (--pattern twill)"


def _in_rings(mesh: Mapping[str, Any]) -> str:
    """Say how a model gets an exact twill whose own mesh has none."""
    if mesh["genus"] is None or mesh["genus"] > MOST_HANDLES:
        return ""
    return f" on this mesh; --remesh rings:300 {'may have' if mesh['genus'] else 'has'} one"


def _twill_rows(twill: Mapping[str, Any], mesh: Mapping[str, Any]) -> list[tuple[str, str]]:
    if twill["exact"]:
        return [("twill", _exact(twill))]
    rows = [("twill", f"no exact 2/2 twill{_in_rings(mesh)}: {twill['because']}")]
    if "voting_breaks" in twill:
        rows.append(("", _broken(twill)))
    after = [
        f"--{remedy['option']} ({agree(remedy['crossings'], '{n} crossing[|s]')})"
        for remedy in twill["exact_after"]
    ]
    rows.append(("", f"exact {_either('with --pattern triaxial', after)}"))
    # A mesh that pairs up is among those above if that helps.
    paired = any(remedy["option"].startswith("remesh") for remedy in twill["exact_after"])
    if 2 * int(mesh["face_sizes"].get("3", 0)) > mesh["faces"] and not paired:
        text = "--remesh quads turns triangles into quads, fit for a biaxial twill"
        rows.append(("", lacking("quads") or text))
    return rows


def _broken(twill: Mapping[str, Any]) -> str:
    """Say how good a twill can be where none is exact."""
    voted, least = twill["voting_breaks"], twill["at_least_broken"]
    text = f"the paper's voting breaks {voted} of {agree(twill['conditions'], '{n} condition[|s]')}"
    broken = twill.get("broken")
    if broken is not None:
        best = (
            "the least possible" if broken == least else f"and every weave breaks {least} or more"
        )
        return f"{text}; this weave breaks {broken}, {best}"
    if voted == least:
        return f"{text}, which is proved to be the least (--pattern twill)"
    return (
        f"{text}, and every weave breaks {least} or more; --pattern twill searches between the two"
    )


def _either(first: str, after: Sequence[str]) -> str:
    """Join ways that lead to the same."""
    return ", ".join((first, *(f"or after {text}" for text in after)))


def _fabric_rows(fabrics: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Say which fabrics close up, and why others do not; one reason once."""
    rows = [("fabrics", f"exact: {', '.join(fabrics['exact']) or 'none'}")]
    reasons: dict[str, list[str]] = {}
    for text, reason in fabrics["because"].items():
        reasons.setdefault(reason, []).append(text)
    return rows + [("", f"not {', '.join(texts)}: {reason}") for reason, texts in reasons.items()]


def _pieces(pieces: Mapping[str, Any]) -> str:
    if "left_out" in pieces:
        return f"not planned, as {pieces['left_out']} (-v or --thorough plans them)"
    if pieces["count"] is None:
        return f"cannot be cut: {pieces['because']}"
    told = f"{pieces['reason']}; for sheets of {' or '.join(pieces['sheets'])}"
    return told + (agree(pieces["kinds"], "; of {n} kind[|s]") if "kinds" in pieces else "")


def _cost_rows(costs: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Say what the job would cost, roughly, as nothing is nested yet."""
    if costs is None:
        return []
    rows = [(name.lower(), text) for name, text in costs["told"].items()]
    return [*rows, ("", "foretold, as nothing is nested yet; your own hours are not in this cost")]


def _left_out_rows(left_out: Sequence[str]) -> list[tuple[str, str]]:
    """Say what was left out for the sake of time."""
    if not left_out:
        return []
    return [("left out", f"{'; '.join(left_out)}. --thorough tells that too, and takes longer")]


def _chosen_rows(chosen: str) -> list[tuple[str, str]]:
    """Say on which mesh it is woven, where that is not its own, and what else could be made."""
    lines = [line.strip() for line in chosen.splitlines()]
    return [("" if number else "choice", line) for number, line in enumerate(lines)]


def _verdict_rows(verdict: Mapping[str, Any], most: int | None = None) -> list[tuple[str, str]]:
    """Say whether it can be built as it is asked for, and what wants care."""
    rows = [("buildable", VERDICTS[verdict["level"]])]
    for reason in verdict["reasons"][:most]:
        mixed = verdict["level"] != reason["level"]
        level = f"{reason['level']}: " if mixed else ""
        rows.append(("", level + Finding(**reason).told))
    left = len(verdict["reasons"]) - (len(rows) - 1)
    return rows + [("", agree(left, "{n} more reason[|s] (-v tells all)"))] * bool(left)


def command_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what makes the designs that can be built, where it is told already what they are."""
    built = [one for one in facts["designs"] if one["verdict"]["level"] != "not makeable"]
    head = [
        ("designs", agree(len(built), "[this makes the one|these make those] that can be built"))
    ]
    return [
        *(head if built else []),
        *(("", one["command"]) for one in built),
        *([("", facts["designs_why"])] if facts["designs_why"] else []),
    ]


def design_rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what designs that were tried come to, and what makes each; or why none can be made."""
    rows = []
    for design in facts["designs"]:
        told = ""
        if design["figures"] is not None:
            told = f": {words(convert(design['figures'], Figures))}"
        rows.append(("design", f"{design['name']}{told}; {design['verdict']['level']}"))
        if design["verdict"]["level"] != "not makeable":
            rows.append(("", design["command"]))
    if facts["designs_why"]:
        rows.append(("", facts["designs_why"]))
    return rows


def _choices(pieces: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Say what other greatest lengths would come to; lengths that change nothing are left out."""
    rows: list[tuple[str, str]] = []
    for choice in pieces.get("choices", []):
        about = "" if choice["exact"] else "about "
        figures = (
            f"{about}{choice['pieces']} pieces, {choice['joints']} joints, "
            f"{agree(choice['sheets'], '{n} sheet[|s]')}, {choice['hours']:.1f} h, "
            f"{choice['cost']:.0f} {CURRENCY}"
        )
        if not rows or not rows[-1][1].endswith(f" {figures}"):
            rows.append(("", f"--max-length {choice['max_length_mm']:g}mm: {figures}"))
    if len(rows) < 2:  # the one is that of the line above
        return []
    head = f"other lengths, with hours and {CURRENCY} for sheets, fasteners, handling and cutting:"
    return [("", head), *rows]


def _range(spread: Mapping[str, float], digits: int) -> str:
    least, most = f"{spread['least']:.{digits}f}", f"{spread['greatest']:.{digits}f}"
    return least if least == most else f"{least} to {most} (median {spread['median']:.{digits}f})"
