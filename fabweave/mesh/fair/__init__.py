"""Move the vertices of a mesh so that ribbons on it run straight, even, and along the model."""
