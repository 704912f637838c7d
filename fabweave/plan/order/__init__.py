"""Find the order in which pieces are put together."""
