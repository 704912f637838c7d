"""Find out and tell what a mesh is, and what can be woven on it."""
