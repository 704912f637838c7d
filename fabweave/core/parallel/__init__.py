"""Run work in other processes, on a cluster, or here, with the same result."""
