"""Prove a folder whose list of files was written anew: what physics finds, the seal aside."""

from fabweave.app.job_folder import write_contents
from fabweave.verify import VerifyReport
from fabweave.verify import verify_job as verify_folder


def verify_job(directory) -> VerifyReport:
    """Seal a folder as it is, if it is one, and prove it."""
    if directory.is_dir():
        write_contents(directory)
    return verify_folder(directory)
