"""Run the command line with ``python -m fabweave``."""

from fabweave.cli.commands import main

main()
