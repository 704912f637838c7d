"""Report material, waste and size of the work."""
