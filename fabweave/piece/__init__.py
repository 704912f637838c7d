"""Unfold ribbons, split them into pieces, and join the pieces."""
