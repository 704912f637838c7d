"""Find the rotations and reflections that map a mesh onto itself."""
