"""Whether a woven object holds its form: elastic strips, pinned where they cross."""
