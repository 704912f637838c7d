"""Weave threads over a mesh: walks, crossings, over and under, bunches."""
