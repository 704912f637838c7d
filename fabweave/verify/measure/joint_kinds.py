"""Hold one record for each kind of joint: where its pieces end, and what is checked of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fabweave.verify.crossing_map import Joint


@dataclass(frozen=True)
class JointKind:
    """What is known of a kind of joint, and which checks it must pass.

    Parameters
    ----------
    name : str
        As crossing_map.json has it.
    fits : tuple of str
        How its two pieces, laid on one another, are checked: by the names of the checks in
        `fabweave.verify.checks.plan.joints`.
    laps : bool
        Whether its pieces lie on one another at the crossing.
    shaped : pair of bool
        Which of its pieces, the one that ends there and the one that begins there, are cut in the
        middle of the crossing to a shape of the joint's own. Others end half a lap beyond it.
    fastened : bool
        Whether fasteners hold it.
    """

    name: str
    fits: tuple[str, ...]
    laps: bool = False
    shaped: tuple[bool, bool] = (False, False)
    fastened: bool = False

    @property
    def slotted(self) -> bool:
        """Whether the second piece has a slot, through which the first one's tab goes."""
        return "tab" in self.fits


KINDS: Mapping[str, JointKind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            JointKind("rivet", ("lap",), laps=True, fastened=True),
            JointKind("glue", ("lap",), laps=True),
            JointKind("dovetail", ("flush", "hold"), shaped=(True, True)),
            JointKind("slot", ("tab",), laps=True, shaped=(True, False)),
            JointKind("none", ("abut",), shaped=(True, True)),
        )
    }
)


def kind_of(joint: Joint) -> JointKind:
    """Return the kind of a joint; of an unknown one, another check says so."""
    return KINDS.get(joint.kind, JointKind(joint.kind, ()))
