"""Choose where threads are cut into pieces."""
