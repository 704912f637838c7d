"""Turn a polygon mesh into a woven object that a person can cut and assemble."""

__version__ = "0.1.0"
