"""The controls of a page: what can be changed, in the order in which makers decide, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.estimate.money import price_text, priced
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.remesh.engines import lacking
from fabweave.mesh.shapes.catalogue import SHAPES, described, is_shape
from fabweave.mesh.upright import AXES
from fabweave.options.settings import Settings
from fabweave.options.table import option_named
from fabweave.options.user_files import all_entries
from fabweave.ribbon.lay import WovenObject
from fabweave.stock.machine import as_span
from fabweave.stock.material import Material, material_library
from fabweave.weave.strand_colours import STRATEGIES

#: Sizes that a slider reaches, millimetres; the faces that a remesher is asked for; and counts.
_SIZES_MM, _FACES, _COUNT = (60.0, 1500.0), (60, 2000), 64.0
_PATTERNS = ("plain", "kagome", "twill", "triaxial", "3/1", "2/2/-1", "satin:5/2")
_BOUNDARIES = ("auto", "end", "turn")
_REFINED = ("catmull-clark:1", "catmull-clark:2", "doo-sabin:1", "loop:1", "mid-edge:1")
#: What people call some values.
_WORDS = {
    "plain": "plain", "kagome": "kagome, open",
    "twill": "twill 2/2", "triaxial": "triaxial, dense",
    "3/1": "twill 3/1", "2/2/-1": "twill 2/2, leaning left",
    "satin:5/2": "satin of 5", "end": "end at rims", "turn": "turn at rims",
    "catmull-clark:1": "once, rounded", "catmull-clark:2": "twice, rounded",
    "doo-sabin:1": "corners cut off", "loop:1": "triangles, rounded",
    "mid-edge:1": "edges halved", "joints": "at joints", "form": "for the form",
    "rivet:2": "two rivets", "rim": "along rims", "every:2": "every other", "all": "all crossings",
}  # fmt: skip


@dataclass(frozen=True)
class Control:
    """Something on the page that changes one option.

    Parameters
    ----------
    group, label : str
        Under which heading it stands, and what it is called.
    option : str
        What it changes: ``mesh``, or an option of job.toml.
    kind : "choice", "range", "text" or "flag"
    value : str, float or bool
        What is in force, be it asked for or chosen.
    template : str
        How the option is written, with ``{}`` for the value.
    choices : tuple of (str, str)
        What can be chosen, and in words; the empty one leaves it to fabweave.
    asides : tuple of (str, str)
        The colour of each, and what it costs, as far as it has any.
    least, most, step : float
        Of a range.
    unit, help : str
    """

    group: str
    label: str
    option: str
    kind: str
    value: str | float | bool
    template: str = "{}"
    choices: tuple[tuple[str, str], ...] = ()
    asides: tuple[tuple[str, str], ...] = ()
    least: float = 0.0
    most: float = 0.0
    step: float = 1.0
    unit: str = ""
    help: str = ""


def controls(
    settings: Settings, complete: Settings, loaded: LoadedMesh, woven: WovenObject | None = None
) -> list[Control]:
    """Return the controls of a job, each with the range that makes sense for its model.

    Parameters
    ----------
    settings, complete : Settings
        As they are asked for, and with what was left to fabweave.
    loaded : LoadedMesh
    woven : WovenObject, optional
        With ribbons as wide as asked, once there are any.
    """
    return [
        *_model(settings, loaded),
        *_density(settings, loaded),
        _choice("Weave", "Pattern", "pattern", settings.weave.pattern, _PATTERNS),
        *(
            [_choice("Weave", "Boundary", "boundary", settings.weave.boundary, _BOUNDARIES)]
            if np.any(loaded.halfedges.twin < 0)
            else []
        ),
        *([] if woven is None else _widths(settings, woven)),
        *_stock(settings, complete),
        _own("Joints", "Joint", settings.pieces.joint,
             ("rivet", "rivet:2", "glue", "tuck", "dovetail", "slot", "none"), "joint"),
        _own("Joints", "Fasteners", settings.pieces.fasten,
             ("joints", "form", "rim", "every:2", "all", "none"), "fasten"),
        _choice("Look", "Colours", "colours", settings.pieces.colours, STRATEGIES),
        _own("Look", "Labels", settings.pieces.labels,
             option_named("labels").kind.choices, "labels"),
    ]  # fmt: skip


def _choice(group: str, label: str, option: str, value: str, words: Sequence[str]) -> Control:
    """Return a choice of words; that which is in force is among them."""
    known = tuple(words) if value in words else (*words, value)
    choices = tuple((w, _WORDS.get(w, w)) for w in known)
    return Control(group, label, option, "choice", value, choices=choices,
                   help=option_named(option).text)  # fmt: skip


def _own(group: str, label: str, value: str | None, words: Sequence[str], option: str) -> Control:
    """Return a choice that can be left to fabweave."""
    known = [*words, *([value] if value and value not in words else [])]
    choices = (("", _usual(option)), *((w, _WORDS.get(w, w)) for w in known))
    return Control(group, label, option, "choice", value or "", choices=choices,
                   help=option_named(option).text)  # fmt: skip


def _usual(option: str) -> str:
    """Return what leaves a choice to fabweave, in words."""
    usual = option_named(option).usual.partition(",")[0]
    return f"as usual: {usual}" if usual else "none"


def _model(settings: Settings, loaded: LoadedMesh) -> list[Control]:
    mesh = settings.mesh.source
    names = [f"shape:{shape.name}" for shape in SHAPES]
    known = [(name, name.removeprefix("shape:").capitalize()) for name in names]
    own = mesh.partition("?")[0]
    if own not in names:
        known.insert(0, (mesh, loaded.title))
    read = f"as read: {loaded.up}" if loaded.up else "as read"
    up = settings.mesh.up or ""
    turned = {"": read, **{way: way for way in (*AXES, up) if way}}
    size = float(np.ptp(loaded.mesh.vertices, axis=0).max())
    return [
        Control("Model", "Model", "mesh", "choice", own if own in names else mesh,
                choices=tuple(known)),
        Control("Model", "Up", "up", "choice", up, choices=tuple(turned.items()),
                help=option_named("up").text),
        Control("Model", "Size", "size", "range", round(size, 1), "{}mm",
                least=min(_SIZES_MM[0], size), most=max(_SIZES_MM[1], size), step=1.0, unit="mm",
                help=option_named("size").text),
    ]  # fmt: skip


def _density(settings: Settings, loaded: LoadedMesh) -> list[Control]:
    """Return how fine the mesh is: by the parameters of a shape, or by a new mesh."""
    mesh, asked = settings.mesh.source, settings.mesh.remesh
    found: list[Control] = []
    if is_shape(mesh):
        shape, given = described(mesh)
        values = shape.completed(given)
        for item in shape.parameters:
            if not item.whole:
                continue
            pairs = [f"{name}={'{}' if name == item.name else f'{value:g}'}"
                     for name, value in values.items()]  # fmt: skip
            value = float(values[item.name])
            most = min(item.most, max(_COUNT, 2.0 * value))
            told = item.text[:1].upper() + item.text[1:]
            found.append(
                Control("Mesh", told.partition(",")[0], "mesh", "range", value,
                        f"shape:{shape.name}?{'&'.join(pairs)}", least=item.least, most=most,
                        help=told)
            )  # fmt: skip
    else:
        kind = "" if asked is None else str(asked).partition(":")[0]
        faces = float(loaded.mesh.n_faces)
        known = ("quads", "tubes", "rings", "triangles")
        kinds = [(f"{name}:300", name) for name in known if not lacking(name)]
        words = (("", "chosen for it"), ("none", "the model's own"), *kinds)
        lacks = filter(None, map(lacking, known))
        now = kind if kind in ("", "none") else f"{kind}:300"
        found.append(
            Control("Mesh", "New mesh", "remesh", "choice", now,
                    choices=words if now in dict(words) else (*words, (now, kind)),
                    help=" ".join((option_named("remesh").text, *lacks)))
        )  # fmt: skip
        if kind and kind not in ("none", "coarse"):
            found.append(
                Control("Mesh", "Faces", "remesh", "range", faces, kind + ":{}",
                        least=min(_FACES[0], faces), most=max(_FACES[1], faces), step=10.0)
            )  # fmt: skip
    refined = settings.mesh.refine
    found.append(_own("Mesh", "Refine", str(refined) if refined else None, _REFINED, "refine"))
    return found


def _widths(settings: Settings, woven: WovenObject) -> list[Control]:
    """Return how wide ribbons are: one width, a share of the room, or how open the weave is."""
    rule, ribbons = settings.width_rule, woven.ribbons
    own = np.linalg.norm(ribbons.right - ribbons.left, axis=1)[ribbons.entry]
    middle = round(float(np.median(own)), 1) if len(own) else 1.0
    room = max(middle, float(own.max(initial=1.0)))
    ways = (("even", "one width"), ("proportional", "by its room"))
    drawn = Control("Form", "Comes out", "as_drawn", "choice", settings.pieces.as_drawn,
                    choices=(("on", "as modelled"), ("off", "as it settles")),
                    help=option_named("as_drawn").text)  # fmt: skip
    base = Control("Form", "Base", "base", "choice", settings.pieces.base or "off",
                   choices=(("off", "none"), ("on", "a board that it is tied to")),
                   help=option_named("base").text)  # fmt: skip
    found = [
        Control("Ribbons", "Strips", "strips", "choice", settings.ribbons.strips,
                choices=(("wavy", "wavy"), ("straight", "straight")),
                help=option_named("strips").text),
        Control("Ribbons", "Width", "width", "choice", "even" if rule.even or rule.constant
                else "proportional", choices=ways, help=option_named("width").text)
    ]  # fmt: skip
    if rule.even or rule.constant:
        value = middle if rule.most_mm == np.inf else rule.most_mm
        found.append(
            Control("Ribbons", "Strip width", "width", "range", round(value, 1), "even,{}mm",
                    least=0.5, most=float(np.ceil(max(2.0 * room, value))), step=0.1, unit="mm")
        )  # fmt: skip
    else:
        found.append(
            Control("Ribbons", "Gaps", "width", "range", round(1.0 - rule.relative, 3), "open:{}",
                    least=0.1, most=0.9, step=0.01)
        )  # fmt: skip
    is_open = bool((woven.halfedges.twin < 0).any())
    return [*found, drawn, *([base] if is_open else [])]


def _aside(material: Material) -> tuple[str, str]:
    """Return the colour of a material, and what a square metre costs."""
    price = material.price_per_m2
    costs = (
        f"{price_text(priced(as_span(price), material.currency))}/m²" if price is not None else ""
    )
    return "#{:02x}{:02x}{:02x}".format(*material.rgb), costs


def _stock(settings: Settings, complete: Settings) -> list[Control]:
    stock = settings.stock
    known = [entry for entry, _ in all_entries("library", material_library())]
    titles = [entry.title.partition(",")[0].replace("{g_m2} ", "") for entry in known]
    words = [
        (one.name, title + f", {one.thickness_mm:g} mm" * (titles.count(title) > 1))
        for one, title in zip(known, titles, strict=True)
    ]
    if stock.material not in dict(words):
        words.append((stock.material, stock.material))
    thick = complete.stock.thickness_mm
    found = [
        Control("Material", "Material", "material", "choice", stock.material, choices=tuple(words),
                asides=tuple(map(_aside, known)), help=option_named("material").text)
    ]  # fmt: skip
    if isinstance(thick, float):
        found.append(
            Control("Material", "Thickness", "thickness", "range", thick, "{}mm",
                    least=min(0.1, thick), most=max(4.0, thick), step=0.05, unit="mm")
        )  # fmt: skip
    sheet = complete.stock.sheets[0] if len(complete.stock.sheets) == 1 else None
    if sheet is not None:
        found.append(
            Control("Material", "Sheet", "sheet", "text",
                    f"{sheet.width_mm:g}x{sheet.height_mm:g}mm", help=option_named("sheet").text)
        )  # fmt: skip
    return found
