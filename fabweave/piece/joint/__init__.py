"""Join the pieces of a thread: kinds, ends, holes."""
