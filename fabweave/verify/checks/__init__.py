"""Check a finished job, one property in each module."""
