"""Define the errors that fabweave raises on purpose.

A message says what is wrong, how many times, where, and what to do about it.
"""


class FabweaveError(Exception):
    """Be the root of every error that fabweave raises on purpose.

    Parameters
    ----------
    reason : str
        What is wrong.
    cure : str
        What to do about it, where that is said apart; the message says both.
    """

    def __init__(self, reason: str, cure: str = "") -> None:
        super().__init__(f"{reason}; {cure}" if cure else reason)
        self.reason, self.cure = reason, cure


class InputError(FabweaveError, ValueError):
    """Report wrong usage or bad input; the command line exits with 2."""


class CannotMakeError(FabweaveError, RuntimeError):
    """Report a job that cannot be made as asked; the command line exits with 1."""


class TooFineError(CannotMakeError):
    """Report ribbons too narrow to be cut, or too tightly bent for their material."""
