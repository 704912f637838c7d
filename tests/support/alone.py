"""Run the command line where neither processes nor threads can be started, as in a web page."""

import os
import sys
import threading


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
import _posixsubprocess  # noqa: E402 - what subprocess starts processes with

_posixsubprocess.fork_exec = refuse_process

if __name__ == "__main__":
    from fabweave.cli.main import main

    main(sys.argv[1:])
