"""Measure what was read."""
