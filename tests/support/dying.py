"""Work that kills the process which does it, as a system does that has run out of memory."""

import os
import signal


def die(*_arguments, **_options):
    """End this process as nothing can prevent."""
    os.kill(os.getpid(), signal.SIGKILL)
