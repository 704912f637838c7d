"""Nest pieces on sheets."""
