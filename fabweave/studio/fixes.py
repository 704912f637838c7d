"""What cures a trouble, as options that a page can set: each was read, and changes something."""

import re
from collections.abc import Mapping
from typing import Any

from fabweave.core.errors import FabweaveError
from fabweave.job.stations import Stations
from fabweave.options.settings import settings_from_options
from fabweave.ribbon.rules.broken_rule import remedies

#: An option with its value, as a cure names it.
_NAMED = re.compile(r"--([a-z][a-z-]*)[ =]([^\s;()]+)")
#: So many cures of one trouble have a button.
_MOST = 3


def fixes(mesh: str, options: Mapping[str, Any], text: str) -> list[dict[str, Any]]:
    """Return the cures that a text names, each in words and as options.

    Examples
    --------
    >>> fixes("shape:cube", {}, "use --size 90mm, or --size N, or --fasten all (--force)")
    [{'text': 'size 90mm', 'options': {'size': '90mm'}}, \
{'text': 'fasten all', 'options': {'fasten': 'all'}}]
    """
    found: list[dict[str, Any]] = []
    for flag, told in _NAMED.findall(text):
        name, value = flag.replace("-", "_"), told.strip(".,:")
        cure = {"text": f"{flag.replace('-', ' ')} {value}", "options": {name: value}}
        if options.get(name) == value or cure in found:
            continue
        try:
            settings_from_options(mesh, **{**options, name: value})
        except (FabweaveError, TypeError):
            continue
        found.append(cure)
    return found[:_MOST]


def reasons_fixed(stations: Stations) -> list[list[dict[str, Any]]]:
    """Return the cures of each reason of the verdict on a job whose pieces are planned."""
    planned, asked = stations.planned, stations.asked
    broken = {finding.rule: finding for finding in planned.check.findings}
    all_cures = []
    for reason in planned.verdict.reasons:
        text, finding = reason.cure, broken.get(reason.rule)
        if finding is not None:
            text += f" {remedies(finding)}"
            if finding.width_factor is not None:
                text += f" --width {asked.width_rule.times(finding.width_factor)}"
        all_cures.append(fixes(asked.mesh.source, stations.options, text))
    return all_cures
