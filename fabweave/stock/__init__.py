"""Hold materials and stock: what a job is cut from, and what that asks of ribbons."""
