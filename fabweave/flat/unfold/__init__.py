"""Unfold ribbons to the plane, exactly."""
