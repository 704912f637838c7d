"""Read a finished job's files back and prove them, sharing no code with the makers."""

from fabweave.verify.proof import verify_job
from fabweave.verify.report import Check, VerifyReport

__all__ = ["Check", "VerifyReport", "verify_job"]
