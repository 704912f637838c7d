"""Refine meshes by subdivision."""
