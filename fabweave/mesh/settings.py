"""Hold what is asked of a mesh; the table of options says what each field means."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MeshSettings:
    """Which mesh is woven, and what is done to it before."""

    source: str
    title: str | None
    up: str | None
    weld: str | None
    bodies: str
    walls: str
    size_mm: float | None
    remesh: str | None
    refine: str | None
    symmetrise: bool
    fair: int | None
    leave_out: str | None
    rim: str

    @property
    def remeshed(self) -> bool:
        """Whether the mesh is made anew before it is woven."""
        return self.remesh not in (None, "none")

    @property
    def faired(self) -> bool:
        """Whether its vertices move, so that ribbons run straighter."""
        return self.remeshed if self.fair is None else self.fair > 0
