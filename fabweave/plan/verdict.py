"""Say whether a thing can be built: one verdict from all that was found.

"Proved" is said of files: they rebuild the weave. Whether hands can build it from this material is
another question, and is answered here.
"""

from collections.abc import Sequence

from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Finding, Level
from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.form.settle import Form
from fabweave.ribbon.rules.broken_rule import BrokenRule, statement

#: Up to this share of its places a rule may be broken: there the material is coaxed, damped,
#: scored or tried first. These are a maker's estimates, not measurements.
COAXED = {"width": 0.02, "bend": 0.10, "crease": 0.10, "twist": 0.25, "layers": 0.10,
          "clearance": 0.10, "grain": 0.10}  # fmt: skip
#: Up to this share of the places may be far from what is needed, or one place; but none may be far
#: too narrow, as a ribbon breaks there.
FAR_SHARE = 0.005
#: Narrower ribbons want tweezers, and have no room for a label.
NARROW_MM = 4.0
#: What is made is not the whole model if more of its surface than this is left out.
LEFT_OUT = 0.01
#: What stands on the sheets of what is made all the same.
FORCED = "CANNOT BE BUILT AS IT IS: MADE WITH --FORCE"
#: What the verdict answers, and each as its answer.
QUESTION = "Can it be built?"
VERDICTS = {"makeable": "Yes.", "with care": "Yes, with care.", "not makeable": "No."}
#: What can be done where a rule is broken in few places.
_CARE = {
    "width": "handle them with tweezers",
    "bend": "damp or roll the strip there before it is woven",
    "grain": "damp or roll the strip there before it is woven",
    "crease": "soften the crease by rolling, or score it",
    "twist": "ease the strip in slowly, or narrow it there by hand",
    "layers": "the layers press on one another: do not fasten there before all are in place",
    "clearance": "push the strips aside there, or trim an edge by hand",
    "hole": "leave those crossings without a fastener, or use glue",
}


@record
class Verdict:
    """Whether a thing can be built: ``verdict.json``.

    Parameters
    ----------
    level : "makeable", "with care" or "not makeable"
        The worst of the reasons.
    reasons : tuple of Finding
        The worst first.
    forced : bool
        Whether it was made although it is not makeable.
    """

    level: Level
    reasons: tuple[Finding, ...]
    forced: bool = False

    @property
    def stops(self) -> tuple[Finding, ...]:
        """The reasons for which it cannot be built."""
        return tuple(reason for reason in self.reasons if reason.level == "not makeable")

    @property
    def headline(self) -> str:
        """The verdict in one line, with its first reason."""
        first = f": {self.reasons[0].text}" if self.reasons else ""
        more = len(self.reasons) - 1
        return f"{self.level}{first}" + (f" (and {more} more)" if more > 0 else "")


class NotMakeableError(CannotMakeError):
    """Report what cannot be built from its material, with the verdict."""

    def __init__(self, verdict: Verdict, ways: str = "") -> None:
        stops = "\n".join(f"  {reason.text}" for reason in verdict.stops)
        super().__init__(
            f"this cannot be built as asked:\n{stops}\n{ways}"
            "--force makes the files anyway, and says so on every sheet"
        )
        self.verdict, self.reason = verdict, verdict.stops[0].text


def judge(
    findings: Sequence[BrokenRule],
    *,
    narrowest_mm: float,
    bodies: int = 1,
    left_out: float = 0.0,
    unnamed: int = 0,
    form: Form | None = None,
    cure: str = "",
    former: bool = False,
    forced: bool = False,
) -> Verdict:
    """Return the verdict on a woven object.

    A rule that is broken in few places, and nowhere by far, wants care; one that is broken in more
    than ``COAXED`` of its places, or by far in more than ``FAR_SHARE`` of them, cannot be kept by
    any care.

    Parameters
    ----------
    findings : sequence of BrokenRule
        The rules that the ribbons break.
    narrowest_mm : float
        The least width of a ribbon.
    bodies : int
        How many bodies there are that no thread joins.
    left_out : float
        The share of the given surface whose bodies were left out.
    unnamed : int
        How many pieces have no room for their id.
    form : Form or None
        What becomes of its form when it is let go; None where that is not known.
    cure : str
        What keeps it from collapsing, if it does.
    former : bool
        Whether it is laid on a former, which holds it while that stays inside.
    forced : bool
        Whether it is made whatever the verdict is.

    Examples
    --------
    >>> few = BrokenRule("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 5, 120)
    >>> judge([few], narrowest_mm=9.0).level
    'with care'
    >>> many = BrokenRule("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 50, 120)
    >>> judge([many], narrowest_mm=9.0).level
    'not makeable'
    >>> judge([], narrowest_mm=9.0).headline
    'makeable'
    """
    reasons = [_reason(finding) for finding in findings]

    def care(rule: str, text: str, cure: str) -> None:
        reasons.append(Finding(rule=rule, level="with care", text=text, cure=cure))

    if narrowest_mm < NARROW_MM and all(reason.rule != "width" for reason in reasons):
        care(
            "narrow",
            f"ribbons are as narrow as {narrowest_mm:.1f} mm",
            "handle these with tweezers; their labels may have no room",
        )
    if bodies > 1:
        care(
            "bodies",
            f"there are {bodies} bodies that no thread joins",
            "each is an object of its own; --bodies largest keeps one",
        )
    if left_out >= LEFT_OUT:
        care(
            "left-out",
            f"bodies with {left_out:.0%} of the model's surface were left out",
            "look at the picture: this is not the whole model; --bodies join makes one "
            "surface of bodies that run into one another",
        )
    if unnamed:
        care(
            "ids",
            agree(unnamed, "{n} [piece has|pieces have] no room for an id"),
            "write the id on as you peel the piece, from the picture of its sheet; a "
            "larger --size, wider ribbons (--width) or --fastener none make room for it",
        )
    if form is not None:
        reasons = [*_form_reasons(form, cure, former=former), *reasons]
    reasons.sort(key=lambda reason: reason.level != "not makeable")
    level: Level = reasons[0].level if reasons else "makeable"
    return Verdict(level=level, reasons=tuple(reasons), forced=forced and level == "not makeable")


def excess(findings: Sequence[BrokenRule]) -> float:
    """Return by how much the worst finding passes what care makes up for: 1 is just kept.

    Parameters
    ----------
    findings : sequence of BrokenRule

    Examples
    --------
    >>> found = BrokenRule("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 24, 120)
    >>> excess([found]), excess([])
    (2.0, 0.0)
    """
    return max(map(_excess, findings), default=0.0)


def _excess(finding: BrokenRule) -> float:
    """Return the places of a finding over those that care makes up for."""
    few = finding.count / max(1, COAXED.get(finding.rule, 1.0) * finding.of)
    most = {"width": 0.0, "hole": finding.of}.get(finding.rule, max(1, FAR_SHARE * finding.of))
    # Where no place may be far from what is needed, the first one is as bad as two too many.
    near = finding.far / most if most else float(finding.far + 1) * (finding.far > 0)
    return float(max(few, near))


def _form_reasons(form: Form, cure: str, *, former: bool) -> list[Finding]:
    """Return what its form asks of whoever builds an object: a collapse first."""
    reasons = []
    if form.collapse:
        level: Level = "with care" if former else "not makeable"
        cure = "leave its former inside, which holds it" if former else cure
        reasons.append(Finding(rule="collapse", level=level, text=form.collapse, cure=cure))
    elif not form.settled:
        text = "it does not come to rest when it is let go"
        cure = "fasten all crossings (--fasten all), or lay it on a former (--former auto)"
        reasons.append(Finding(rule="form", level="with care", text=text, cure=cure))
    if form.hanging:
        text = f"{', '.join(form.hanging)}: no thread joins it to what stands"
        cure = "hang it up, put a support under it, or keep one body only (--bodies largest)"
        reasons.append(Finding(rule="air", level="with care", text=text, cure=cure))
    return reasons


def _reason(finding: BrokenRule) -> Finding:
    """Return what a finding means to whoever builds the object."""
    care = _excess(finding) <= 1.0 and finding.severity != "refuse"
    return Finding(
        rule=finding.rule,
        level="with care" if care else "not makeable",
        text=statement(finding),
        cure=_CARE[finding.rule] if care else "",
        where=f"thread {finding.thread}, crossing {finding.crossing}",
    )


def refused(why: str, verdict: Verdict | None = None, *, cure: str = "") -> Verdict:
    r"""Return the verdict on what is refused before there are pieces.

    Examples
    --------
    >>> refused("thread A curls onto itself\nand more").headline
    'not makeable: thread A curls onto itself'
    >>> refused("it has no faces:\n  - none of four\n  - nor of three").headline
    'not makeable: it has no faces: none of four'
    """
    text, *lines = why.split("\n")
    if text.endswith(":") and lines:  # a list, of which the first says most
        text = f"{text} {lines[0].strip(' -')}"
    reason = Finding(rule="refused", level="not makeable", text=text, cure=cure)
    others = verdict.reasons if verdict is not None else ()
    return Verdict(level="not makeable", reasons=(reason, *others))


def verdict_words(verdict: Verdict) -> str:
    """Return the verdict in a sentence or two, for paper.

    Examples
    --------
    >>> verdict_words(judge([], narrowest_mm=9.0))
    'Yes.'
    """
    told = [reason.told for reason in verdict.reasons[:3]]
    more = [f"and {len(verdict.reasons) - 3} more"] if len(verdict.reasons) > 3 else []
    return " ".join([VERDICTS[verdict.level], "; ".join([*told, *more])]).strip()


def verdict_text(verdict: Verdict) -> str:
    """Return the verdict with all its reasons, a line each.

    Examples
    --------
    >>> print(verdict_text(judge([], narrowest_mm=2.0)))
    Can it be built? Yes, with care.
      ribbons are as narrow as 2.0 mm (handle these with tweezers; their labels may have no room)
    """
    lines = [f"  {reason.told}" for reason in verdict.reasons]
    made = ["  made all the same, as --force asks"] if verdict.forced else []
    return "\n".join([f"{QUESTION} {VERDICTS[verdict.level]}", *lines, *made])
