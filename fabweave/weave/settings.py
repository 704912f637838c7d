"""Hold what is asked of a weave; the table of options says what each field means."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WeaveSettings:
    """Who passes over whom, and what threads do at a boundary and across faces."""

    pattern: str
    twists: str | None
    twill_method: str
    twill_weights: str
    boundary: str
    course: str

    @property
    def triaxial(self) -> bool:
        """Whether the mesh is subdivided through the middles of its edges first."""
        return self.pattern == "triaxial"
