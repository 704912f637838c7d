"""Say what would help where a mesh cannot be woven as asked, as commands that can be pasted."""

from dataclasses import replace
from typing import Any

from fabweave.app.design.coarser import is_free
from fabweave.app.design.variety import FEWEST, densities
from fabweave.app.remake_command import long_command
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject
from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.ribbon.measures import NEAR_SIZE
from fabweave.ribbon.rules.remedy import SIZED
from fabweave.ribbon.rules.ribbon_check import RibbonCheck

#: How many densities lie between the coarsest and the finest mesh, of which the coarsest is named.
_DENSITIES = 3


def advice(
    asked: Settings, woven: WovenObject, check: RibbonCheck, level: str, *, tried: bool = False
) -> list[dict[str, Any]]:
    """Return what would help, or what makes it, each with its command.

    A size is told only where it is at most ``NEAR_SIZE`` times the present one. Where rules would
    want more, the mesh is too fine for its size, and a coarser one is named if the mesh is a model
    that can be remeshed.

    Parameters
    ----------
    asked : Settings
        As they were asked for.
    woven : WovenObject
    check : RibbonCheck
        Of its ribbons.
    level : str
        The verdict's.
    tried : bool
        Whether coarser meshes are going to be tried: then none is named before that.

    Returns
    -------
    list of dict
        ``text``, which says what it does, and ``command``; the command is None where the text names
        an option without a value.
    """
    ways: list[dict[str, Any]] = []

    def add(text: str, **changes: Any) -> None:
        command = long_command(replace(asked, **changes))
        ways.append({"text": text, "command": command})

    if level == "makeable":
        add("this makes it")
        return ways
    findings = check.findings
    sizes = [finding.size_mm for finding in findings if finding.rule in SIZED]
    known = [size for size in (check.smallest_mm, *sizes) if size is not None]
    most = max(known, default=0)
    larger = most > woven.size_mm
    if larger and most <= NEAR_SIZE * woven.size_mm:
        rules = [finding.rule for finding in findings if finding.size_mm is not None]
        what = "every rule of size" if check.smallest_mm is not None else " and ".join(rules)
        add(f"at this size {what} would hold", size_mm=float(most), scale=None)
    finer = {finding.refine: finding.rule for finding in findings if finding.refine is not None}
    for refinement, rule in finer.items():
        add(f"a finer mesh mends {rule}, as tried", refine=refinement)
    too_fine = most > NEAR_SIZE * woven.size_mm
    if too_fine or None in sizes:  # or no size helps, or none was looked for
        remeshed = asked.remesh is not None or asked.refine is not None or is_shape(asked.mesh)
        coarser = None if remeshed else _coarser(woven)
        fine = f"this one is too fine for {woven.size_mm:.0f} mm" if too_fine else ""
        text, command = "a mesh with fewer, larger faces may do", None
        if coarser is not None and level == "not makeable" and is_free(asked):
            text, command = "make takes a coarser mesh by itself", long_command(asked)
        elif coarser is not None and tried:
            text = "a coarser mesh may do: see the designs below"
        elif coarser is not None:
            text = "a coarser mesh may do"
            command = long_command(replace(asked, remesh=f"quads:{coarser}"))
        ways.append({"text": f"{text}; {fine}" if fine else text, "command": command})
    for finding in findings:
        if finding.width_factor is not None:
            narrower = round(100 * (1 - finding.width_factor))
            text = f"ribbons {narrower} % narrower mend {finding.rule}"
            command = long_command(asked.narrower(finding.width_factor))
            ways.append({"text": text, "command": command})
    if not ways and level == "with care":
        add("this makes it, with care")
    return ways


def _coarser(woven: WovenObject) -> int | None:
    """Return how many quads a coarse mesh would have; None if this one has no more."""
    least = densities(woven.mesh, _DENSITIES)[0]
    return least if FEWEST <= least < woven.mesh.n_faces else None
