"""Hold materials and stock, and nest pieces on sheets."""
