"""Pack sheets with an engine in a child process."""
