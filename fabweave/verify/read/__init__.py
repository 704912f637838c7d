"""Read the files of a finished job, independently of what wrote them."""
