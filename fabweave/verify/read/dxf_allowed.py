"""Say what in a DXF file might be drawn otherwise than its entities' coordinates say.

Programs differ in what they show and cut: frozen layers, line types, widths, thickness, blocks,
extrusions. So only what our sheets need may be in a file; all else is a problem.
"""

from collections import Counter

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Flags, Ints
from fabweave.verify.read.dxf_groups import Entities, Groups

_SECTIONS = frozenset({"HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS"})
_COMMON = frozenset({0, 5, 8, 100, 330, 1000, 1001})
#: The groups that an entity may have; of some, several.
_GROUPS = {
    "LWPOLYLINE": _COMMON | {10, 20, 42, 43, 70, 90},
    "POLYLINE": _COMMON | {10, 20, 30, 66, 70},
    "VERTEX": _COMMON | {10, 20, 30, 42, 70},
    "SEQEND": _COMMON,
    "LINE": _COMMON | {10, 20, 30, 11, 21, 31},
    "CIRCLE": _COMMON | {10, 20, 30, 40},
}
_REPEATED = {"LWPOLYLINE": {10, 20, 42}}
_ALWAYS_REPEATED = frozenset({100, 330, 1000, 1001})
_ZERO = (30, 31, 43)
#: What groups mean that other programs obey, and ours does not need.
_MEANINGS = {
    6: "a line type", 38: "an elevation", 39: "a thickness", 40: "a width", 41: "a width",
    48: "a line type scale", 60: "a mark that it is invisible", 62: "a colour of its own",
    67: "a mark that it is in paper space", 210: "an extrusion direction",
    220: "an extrusion direction", 230: "an extrusion direction", 370: "a line width",
    420: "a colour of its own", 430: "a colour of its own", 440: "a transparency",
}  # fmt: skip
_LINE_TYPES = frozenset({"BYBLOCK", "BYLAYER", "CONTINUOUS"})
_BLOCKS = frozenset({"*MODEL_SPACE", "*PAPER_SPACE", "$MODEL_SPACE", "$PAPER_SPACE"})
_OBJECTS = frozenset({
    "DICTIONARY", "ACDBDICTIONARYWDFLT", "ACDBPLACEHOLDER", "LAYOUT", "MATERIAL", "MLINESTYLE",
    "MLEADERSTYLE", "DICTIONARYVAR", "SCALE", "VISUALSTYLE", "TABLESTYLE",
})  # fmt: skip
_TABLES = frozenset({
    "TABLE", "ENDTAB", "VPORT", "VIEW", "UCS", "LTYPE", "LAYER", "STYLE", "APPID", "DIMSTYLE",
    "BLOCK_RECORD",
})  # fmt: skip
#: Line widths of a layer: as programs please, or the thinnest.
_LAYER_WIDTHS = ("-3", "0")


def strange_parts(sections: dict[str, Groups]) -> list[str]:
    """Return what is in a file beside what our sheets need, a line for each kind of it."""
    problems = [f"section {name} may not be there" for name in sorted({*sections} - _SECTIONS)]
    for name, groups in sections.items():
        if np.any(groups.code == 999):
            problems.append(f"section {name} has comments, which not every program takes")
    nothing = Groups(np.zeros(0, dtype=np.int64), [])
    tables = Entities(sections.get("TABLES", nothing))
    problems += _strange_kinds("TABLES", tables, _TABLES)
    problems += _strange_layers(tables)
    problems += _strange_line_types(tables)
    blocks = Entities(sections.get("BLOCKS", nothing))
    problems += _strange_kinds("BLOCKS", blocks, frozenset({"BLOCK", "ENDBLK"}))
    problems += [
        f"block {name!r} may not be there"
        for name in _names(blocks, "BLOCK")
        if name.upper() not in _BLOCKS
    ]
    objects = Entities(sections.get("OBJECTS", nothing))
    problems += _strange_kinds("OBJECTS", objects, _OBJECTS)
    return problems + _strange_groups(Entities(sections["ENTITIES"]))


def _strange_groups(entities: Entities) -> list[str]:
    """Return which groups of entities may change how they are drawn, one of each kind named."""
    problems = []
    kind = np.array(entities.kind, dtype=object)
    code, owner = entities.groups.code, entities.owner
    inside = owner >= 0

    def of_kind(name: str) -> Flags:
        return (kind == name)[np.maximum(owner, 0)] if len(kind) else np.zeros(len(code), bool)

    for name, allowed in _GROUPS.items():
        mine = np.flatnonzero(inside & of_kind(name))
        if not len(mine):
            continue
        codes = code[mine]
        for strange in sorted({*np.unique(codes).tolist()} - allowed):
            places = mine[codes == strange]
            said = _MEANINGS.get(strange, f"a group {strange}")
            if strange in (210, 220, 230):
                said += f" ({entities.groups.value[int(places[0])]})"
            problems.append(
                f"{entities.name(places[0])} has {said}, which changes how it is drawn"
                + _more(places)
            )
        single = np.isin(codes, [*_ALWAYS_REPEATED, *_REPEATED.get(name, ())], invert=True)
        pairs, counts = np.unique(
            np.column_stack([owner[mine[single]], codes[single]]), axis=0, return_counts=True
        )
        for at, which in pairs[counts > 1][:1].tolist():
            problems.append(f"{entities.names[at]} has group {which} twice")
        for flat in _ZERO:
            places = mine[codes == flat]
            places = places[entities.numbers(places) != 0.0]
            if len(places):
                what = "a width" if flat == 43 else "a height above the sheet"
                problems.append(f"{entities.name(places[0])} has {what}" + _more(places))
        flags = mine[codes == 70]
        wrong = [at for at in flags.tolist() if entities.groups.value[at] not in ("0", "1")]
        if wrong:
            problems.append(f"{entities.name(wrong[0])} has flags that are not open or closed")
        if name == "LWPOLYLINE":
            problems += _wrong_counts(entities, mine, codes)
    return problems + _strange_corners(entities, kind)


def _wrong_counts(entities: Entities, mine: Ints, codes: Ints) -> list[str]:
    """Compare the stated number of corners with those that are there."""
    owner = entities.owner
    there = np.bincount(owner[mine[codes == 10]], minlength=len(entities.begin))
    stated = mine[codes == 90]
    wrong = stated[entities.numbers(stated) != there[owner[stated]]]
    return [f"{entities.name(at)} has another number of corners than it states" for at in wrong[:1]]


def _strange_corners(entities: Entities, kind: npt.NDArray[np.object_]) -> list[str]:
    """Find corners that are on another layer than their polyline."""
    corner = (kind == "VERTEX") | (kind == "SEQEND")
    if not np.any(corner):
        return []
    parent = np.maximum.accumulate(np.where(corner, -1, np.arange(len(kind))))
    layer = np.array(entities.texts(entities.at(8), ""), dtype=object)
    wrong = np.flatnonzero(corner & (parent >= 0) & (layer != layer[np.maximum(parent, 0)]))
    return [f"{entities.names[at]} is on another layer than its polyline" for at in wrong[:1]]


def _more(places: Ints) -> str:
    return f" (and {len(places) - 1} more)" if len(places) > 1 else ""


def _strange_kinds(section: str, entities: Entities, allowed: frozenset[str]) -> list[str]:
    return [
        f"{section} has {kind}, which may not be there"
        for kind in sorted({*entities.kind} - allowed)
    ]


def _names(entities: Entities, kind: str) -> list[str]:
    """Return the names of all entities of one kind."""
    names = entities.texts(entities.at(2), "")
    return [name for name, what in zip(names, entities.kind, strict=True) if what == kind]


def _strange_layers(tables: Entities) -> list[str]:
    """Find layers that programs hide, lock, do not plot, dash or draw wide."""
    problems = []
    wanted = ((70, "0", "flags", ("0",)), (290, "1", "a plot flag", ("1",)),
              (6, "Continuous", "line type", ("Continuous",)),
              (370, "-3", "line width", _LAYER_WIDTHS))  # fmt: skip
    columns = [(tables.texts(tables.at(code), usual), what, allowed)
               for code, usual, what, allowed in wanted]  # fmt: skip
    colours = tables.texts(tables.at(62), "7")
    layers = [(at, name) for at, name in enumerate(tables.texts(tables.at(2), ""))
              if tables.kind[at] == "LAYER"]  # fmt: skip
    for at, name in layers:
        for values, what, allowed in columns:
            if values[at] not in allowed:
                problems.append(f"layer {name!r} has {what} {values[at]}, not {allowed[0]}")
        if colours[at].startswith("-"):
            problems.append(f"layer {name!r} is switched off")
    same = Counter(name.upper() for _, name in layers)
    problems += [f"there are {n} layers called {name}" for name, n in same.items() if n > 1]
    return problems


def _strange_line_types(tables: Entities) -> list[str]:
    """Find line types beside the usual three, or dashes in these."""
    dashes = tables.texts(tables.at(73), "0")
    return [
        f"line type {name!r} may not be there, or has dashes"
        for at, name in enumerate(tables.texts(tables.at(2), ""))
        if tables.kind[at] == "LTYPE" and (name.upper() not in _LINE_TYPES or dashes[at] != "0")
    ]
