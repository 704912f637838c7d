"""Check a finished job's folder against the rules of those who cut it."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.errors import InputError
from fabweave.core.finding import Finding
from fabweave.core.units import parse_length
from fabweave.options.settings import read_job_options
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.plan.preflight.rules import preflight, preflight_record
from fabweave.plan.ribbon_report import read_ribbon_report
from fabweave.sheet.targets import Target, target_named, targets_of
from fabweave.stock.material import materials_of
from fabweave.stock.per_bunch import split_by_bunch
from fabweave.stock.supplies import Supplies, parse_materials, plan_supplies


@frozen_value
class Preflight:
    """The rules that pieces break, and whose rules they are."""

    supplies: Supplies
    target: Target
    findings: tuple[Finding, ...]

    @property
    def all_clear(self) -> str:
        """The message if no rule is broken."""
        return f"no rule is broken: {self.target.title}, {self.supplies.titles}"

    @property
    def record(self) -> dict[str, Any]:
        """The findings as ``preflight.json`` holds them."""
        return preflight_record(self.findings, self.supplies.materials, self.target)


def preflight_job(
    directory: Path, target: str | None = None, user_targets: Sequence[Target] = ()
) -> Preflight:
    """Check the pieces in a finished job's folder.

    Parameters
    ----------
    directory : Path
    target : str, optional
        Whose rules; else those that the job was made for.
    user_targets : sequence of Target
        Beside ours, if it is asked for a target.

    Raises
    ------
    InputError
        If a file of the job is missing or is not what fabweave writes.
    """
    options = read_job_options(directory / "job.toml")
    with finished_job(directory, "can be checked"):
        supplies = supplies_of(options)
        targets = targets_of(options.get("rules", {}), "the rules in job.toml")
        if target is not None:
            targets = (*targets, *user_targets)
        named = target_named(target or options.get("target", "default"), targets)
        crossing_map = read_crossing_map(directory / "crossing_map.json")
        ribbons = read_ribbon_report(directory / "ribbons.json")
        bunches = np.array([thread.bunch for thread in crossing_map.threads], dtype=np.int64)
        supplies.require(bunches)
        materials = [supplies.materials[index] for index in supplies.of(bunches).tolist()]
        found = preflight(crossing_map, ribbons.findings, materials, named)
        return Preflight(supplies, named, found)


@contextmanager
def finished_job(directory: Path, purpose: str) -> Iterator[None]:
    """Say what is wrong with a folder if its files, as they are read, are no finished job's."""
    try:
        yield
    except InputError:
        raise
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"{directory} is not a finished job that {purpose} "
            f"({type(error).__name__}: {error}); run fabweave verify to see what is wrong with it"
        ) from error


def supplies_of(options: Mapping[str, Any]) -> Supplies:
    """Return the materials that a job.toml names, with their thickness, but without its sheets.

    Raises
    ------
    InputError, KeyError
        If they are not written as fabweave writes them.
    """
    thickness = split_by_bunch(str(options["thickness"]), what="thickness")
    return plan_supplies(
        parse_materials(str(options["material"])),
        tuple((name, parse_length(text)) for name, text in thickness),
        (("", None),),
        (),
        materials_of(options.get("library", {}), "the library in job.toml"),
    )
