"""Letter pieces: what is said, how, and where there is room."""
