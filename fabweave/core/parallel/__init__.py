"""Run work in other processes, or here, with the same result."""
