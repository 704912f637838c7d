"""Check a finished job's folder against the rules of those who cut it."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.cut.preflight import Flaw, preflight, preflight_record
from fabweave.cut.targets import Target, target_named
from fabweave.errors import InputError
from fabweave.settings import read_job_options
from fabweave.sheet.material import Material, material_named, with_thickness
from fabweave.units import parse_length


@dataclass(frozen=True, eq=False)
class Preflight:
    """What was found, and against whose rules."""

    material: Material
    target: Target
    flaws: tuple[Flaw, ...]

    @property
    def all_clear(self) -> str:
        """What to say if nothing was found."""
        return f"no rule is broken: {self.target.title}, {self.material.title}"

    @property
    def record(self) -> dict[str, Any]:
        """The findings as ``preflight.json`` holds them."""
        return preflight_record(self.flaws, self.material, self.target)


def preflight_job(directory: Path, target: str | None = None) -> Preflight:
    """Check the pieces in a finished job's folder.

    Parameters
    ----------
    directory : Path
    target : str, optional
        Whose rules; else those that the job was made for.

    Raises
    ------
    InputError
        If a file of the job is missing or is not what fabweave writes.
    """
    options = read_job_options(directory / "job.toml")
    try:
        material = with_thickness(
            material_named(options["material"]), parse_length(options["thickness"])
        )
        named = target_named(target or options.get("target", "default"))
        plan = json.loads((directory / "crossing_map.json").read_text(encoding="utf-8"))
        ribbons = json.loads((directory / "ribbons.json").read_text(encoding="utf-8"))
        return Preflight(material, named, preflight(plan, ribbons, material, named))
    except (OSError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{directory} is no finished job that can be checked "
            f"({type(error).__name__}: {error}); fabweave verify tells what is wrong with it"
        ) from error
