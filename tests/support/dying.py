"""Work that kills the process which does it, as a system does that has run out of memory."""

import multiprocessing
import os
import signal


def die(*_arguments, **_options):
    """End this process as nothing can prevent, unless it is the one that runs the tests."""
    assert multiprocessing.parent_process() is not None, "this was to be done in another process"
    os.kill(os.getpid(), signal.SIGKILL)
