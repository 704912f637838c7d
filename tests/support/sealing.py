"""Prove a folder whose list of files was written anew: what physics finds, the seal aside."""

from fabweave.core.job_folder import write_contents
from fabweave.verify.proof import verify_job as verify_folder
from fabweave.verify.report import VerifyReport


def verify_job(directory) -> VerifyReport:
    """Seal a folder as it is, if it is one, and prove it."""
    if directory.is_dir():
        write_contents(directory)
    return verify_folder(directory)
