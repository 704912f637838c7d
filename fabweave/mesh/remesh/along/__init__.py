"""Lay quads along a direction: say which, groove the surface along it, and compare results."""
