"""Build the built-in shapes."""
