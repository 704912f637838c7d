"""The studio: a page on which a job is changed and seen at once."""
