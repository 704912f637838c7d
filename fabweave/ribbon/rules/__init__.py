"""Measure ribbons against the rules of their material, and look for remedies."""
