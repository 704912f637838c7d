"""Decide, search and bound 2/2 twills."""
