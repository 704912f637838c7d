"""Run the command line with ``python -m fabweave``."""

from fabweave.cli import main

main()
