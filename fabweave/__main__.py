"""Run the command line with ``python -m fabweave``."""

from fabweave.cli.main import main

main()
