"""Run the command line where neither processes nor threads can be started, as in a web page."""

import os
import subprocess
import sys
import threading


def forbid():
    """Have this process start nothing from now on."""

    def refuse(*_arguments, **_options):
        raise RuntimeError("can't start new thread")

    def refuse_process(*_arguments, **_options):
        raise OSError("no processes here")

    for name in ("_multiprocessing", "_posixshmem"):
        sys.modules[name] = None
    for name in ("_start_new_thread", "_start_joinable_thread"):
        if hasattr(threading, name):
            setattr(threading, name, refuse)
    os.fork = os.posix_spawn = refuse_process
    sys.modules["_posixsubprocess"].fork_exec = subprocess._fork_exec = refuse_process


def alone(*words):
    """Run it so, and return how it ended."""
    command = [sys.executable, __file__, *map(str, words)]
    return subprocess.run(command, capture_output=True, check=False, timeout=600, text=True)


if __name__ == "__main__":
    forbid()
    from fabweave.cli.main import main

    main(sys.argv[1:])
