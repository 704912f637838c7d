"""Hold what is asked of pieces; the table of options says what each field means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fabweave.weave.strand_colours import Strategy


@dataclass(frozen=True)
class PieceSettings:
    """How threads are cut into pieces, how these are joined and held, and what they carry."""

    max_length_mm: float | None
    prefer: str
    kinds: str
    spares: str | None
    fastener: str | None
    holes: str | None
    fasten: str | None
    hang: str | None
    load: str | None
    base: str | None
    as_drawn: str
    joint: str
    colours: Strategy
    force: bool
    former: str | None
    labels: str
    label_side: str

    @property
    def may_be_based(self) -> bool:
        """Whether it may be tied to a base unasked: of one nothing is said, nor does it hang."""
        return self.base is None and self.hang is None

    @property
    def mirrored(self) -> bool:
        """Whether sheets are drawn mirrored, since the inside is engraved."""
        return self.label_side == "inside"
