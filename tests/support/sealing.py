"""Prove a folder whose list of files was written anew: what physics finds, the seal aside."""

import numpy as np

from fabweave.core.job_folder import write_contents
from fabweave.verify.proof import verify_job as verify_folder
from fabweave.verify.report import Tally, VerifyReport


def verify_job(directory) -> VerifyReport:
    """Seal a folder as it is, if it is one, and prove it."""
    if directory.is_dir():
        write_contents(directory)
    return verify_folder(directory)


def told(directory) -> dict[str, tuple[str, ...]]:
    """Return what each check finds in a folder, by name; nothing of those that find nothing."""
    return {check.name: check.findings for check in verify_job(directory).checks if not check.ok}


def result_of(check, *of):
    """Return what one check counts and finds."""
    tally = Tally("files")  # whatever it is called
    with np.errstate(all="ignore"):
        check(*of, tally)
    return tally.result()


def found_by(check, *of) -> str:
    """Return all that one check finds; empty if it finds nothing."""
    return " | ".join(map(str, result_of(check, *of).findings))
